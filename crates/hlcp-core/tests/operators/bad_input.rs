//! Bad input is refused with the offending value and its index.

use hlcp_core::{Aor, Error, FivePoint, Hlcp, Jacobi, Omega, Rhs};
use hlcp_methods::{Mms, NameError, Named, Parameters, Tmms};

use nalgebra::{DMatrix, dmatrix, dvector};

fn stencil(centre: f64) -> FivePoint<f64> {
    FivePoint::new(3, 2, [-0.5, -1.0, centre, -1.5, -0.25]).unwrap()
}

fn problem() -> Hlcp<f64, FivePoint<f64>, FivePoint<f64>> {
    Hlcp::new(stencil(8.0), stencil(6.0), Omega::Uniform(1.2)).unwrap()
}

/// Holds that an error names this number, which may be NaN, with its place.
fn is_not_positive(error: Error, (name, at, number): (&str, usize, f64)) {
    let Error::NotPositive { what, index, value } = error else { panic!("{error:?}") };
    assert_eq!((what, index, value.to_bits()), (name, at, number.to_bits()));
}

#[test]
fn orders_that_differ_are_refused() {
    let other = FivePoint::new(3, 3, [0.0, -1.0, 4.0, -1.0, 0.0]).unwrap();
    let refused = Error::Order { what: "B", found: 9, expected: 6 };
    assert_eq!(Hlcp::new(stencil(4.0), other, Omega::Uniform(2.0)).unwrap_err(), refused);
    assert_eq!(Omega::diagonal_ratio(1.5, &stencil(4.0), &other).unwrap_err(), refused);
    let short = Hlcp::new(stencil(4.0), stencil(4.0), Omega::Each(vec![2.0; 5]));
    assert_eq!(short.unwrap_err(), Error::Order { what: "omega", found: 5, expected: 6 });
}

#[test]
#[should_panic(expected = "r has length 5, but it must have length 6")]
fn a_panic_names_the_vector_of_a_wrong_length() {
    problem().solution_from_x(&[0.0; 6], &mut [0.0; 6], &mut [0.0; 5]);
}

#[test]
fn empty_problems_are_refused() {
    let too_large = [(usize::MAX, 2), (usize::MAX, 1 << 31), (1 << 31, 1 << 31)];
    for (nx, ny) in [(0, 3), (3, 0), (0, 0)].into_iter().chain(too_large) {
        assert_eq!(FivePoint::new(nx, ny, [1.0; 5]), Err(Error::Grid { nx, ny }));
        let refused = FivePoint::from_fn(nx, ny, |_, _| [1.0; 5]);
        assert_eq!(refused, Err(Error::Grid { nx, ny }));
    }
    assert!(matches!(Rhs::<f64>::new(&[]), Err(Error::Empty { .. })));
    let none = || DMatrix::zeros(0, 0);
    assert!(matches!(Hlcp::new(none(), none(), Omega::Uniform(1.5)), Err(Error::Empty { .. })));
    assert!(matches!(Omega::diagonal_ratio(1.5, &none(), &none()), Err(Error::Empty { .. })));
}

#[test]
fn numbers_that_are_not_finite_are_refused() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let refused_at = |error: Error, at: usize, name: &str| {
            let Error::NotFinite { what, index, value } = error else { panic!("{error:?}") };
            assert_eq!((index, value.to_bits()), (at, bad.to_bits()));
            assert!(what.contains(name), "{what}");
        };
        let mut coefficients = [-0.5, -1.0, 4.0, -1.5, -0.25];
        coefficients[3] = bad;
        refused_at(FivePoint::new(3, 2, coefficients).unwrap_err(), 0, "east");

        let omega = Omega::Each(vec![2.0, 2.0, bad, 2.0, 2.0, 2.0]);
        let refused = Hlcp::new(stencil(4.0), stencil(4.0), omega).unwrap_err();
        is_not_positive(refused, ("omega", 2, bad));

        let spoilt = dmatrix![4.0, 0.5, 0.2; 0.3, 5.0, 0.1; 0.7, bad, 6.0];
        let sound = dmatrix![3.0, 0.5, 0.2; 0.3, 2.0, 0.1; 0.7, 0.4, 2.5];
        let pair = |a: &DMatrix<f64>, b: &DMatrix<f64>| {
            Hlcp::new(a.clone(), b.clone(), Omega::Uniform(1.2)).unwrap()
        };
        let gs = Aor::gauss_seidel();
        refused_at(Mms::new(pair(&spoilt, &sound), gs).unwrap_err(), 2, "A");
        refused_at(Mms::new(pair(&sound, &spoilt), gs.accelerated()).unwrap_err(), 2, "B");
        refused_at(Tmms::new(pair(&sound, &spoilt), Jacobi, gs).unwrap_err(), 2, "B");
    }
}

#[test]
fn diagonals_that_are_negative_or_not_finite_are_refused_in_the_last_row_too() {
    let last = |value: f64| DMatrix::from_diagonal(&dvector![2.0, 2.0, 2.0, 2.0, value]);
    let even = DMatrix::from_diagonal_element(5, 5, 4.0);
    let omega = Omega::diagonal_ratio(1.5, &last(3.0), &even).unwrap();
    assert_eq!(omega, Omega::Each(vec![0.75, 0.75, 0.75, 0.75, 1.125]));
    for bad in [-2.0, f64::NAN, f64::INFINITY] {
        let spoilt = last(bad);
        let cases = [(&spoilt, &even, "diagonal of A"), (&even, &spoilt, "diagonal of B")];
        for (a, b, name) in cases.into_iter().skip(usize::from(bad < 0.0)) {
            is_not_positive(Omega::diagonal_ratio(0.7, a, b).unwrap_err(), (name, 4, bad));
        }
    }
    // Largest entries take the place of zeros on a diagonal; where a row has none, the ratio is 1.
    for (off, omega) in [(0.0, 0.7), (-8.0, 1.4)] {
        let mut zero = last(0.0);
        zero[(4, 1)] = off;
        let each = |omega| Omega::Each(vec![0.35, 0.35, 0.35, 0.35, omega]);
        assert_eq!(Omega::diagonal_ratio(0.7, &zero, &even).unwrap(), each(omega));
    }
    // The sizes serve where that of A is negative.
    for of_b in [4.0, -4.0] {
        let mut b = even.clone();
        b[(4, 4)] = of_b;
        let omega = Omega::diagonal_ratio(1.5, &last(-3.0), &b).unwrap();
        assert_eq!(omega, Omega::Each(vec![0.75, 0.75, 0.75, 0.75, 1.125]));
    }
    let none = Hlcp::new(last(-2.0), even, Omega::Uniform(0.5)).unwrap();
    let error = Mms::new(none, Jacobi).unwrap_err().to_string();
    assert!(error.starts_with("diagonal of M[4] is 0,") && error.contains("a larger Ω"), "{error}");
}

#[test]
fn parameters_out_of_range_are_refused() {
    for bad in [0.0, -1.5, f64::NAN, f64::INFINITY] {
        let named = |error: Error, expected: &str| {
            let Error::Parameter { name, value, .. } = error else { panic!("{error:?}") };
            assert_eq!((name, value.to_bits()), (expected, bad.to_bits()));
        };
        named(Aor::new(bad, 1.1).unwrap_err(), "alpha");
        named(Aor::sor(bad).unwrap_err(), "alpha");
        named(Aor::with_pairs([1.1, 0.9], [bad, 0.9]).unwrap_err(), "alpha");
        named(Omega::diagonal_ratio(bad, &stencil(4.0), &stencil(4.0)).unwrap_err(), "tau");
        named(problem().with_gamma(bad).unwrap_err(), "gamma");
        named(Hlcp::new(stencil(4.0), stencil(4.0), Omega::Uniform(bad)).unwrap_err(), "omega");
    }
    assert!(matches!(Aor::new(1.1, f64::NAN), Err(Error::Parameter { name: "beta", .. })));
    // Their reciprocals and ratios overflow.
    assert!(Aor::new(5e-324, 0.0).is_err() && Aor::new(1e-300, 1e300).is_err());
    // Nothing is in order on a grid without columns.
    let without = Aor::<f64>::gauss_seidel().red_black(0);
    assert!(matches!(without, Err(Error::Parameter { value: 0.0, .. })));
}

#[test]
fn table_1_has_its_parameters() {
    let sor = [[1.2, 1.2], [1.0, 1.0], [0.8, 0.8]];
    let aor = [[1.3, 1.1], [1.1, 0.9], [0.9, 0.7]];
    for (splitting, parameters) in [("SOR", sor), ("AOR", aor)] {
        for (k, first) in parameters.into_iter().enumerate() {
            for (family, second) in [("M", None), ("AM", None), ("TM", Some(first))] {
                let name = format!("{family}{splitting}{}", k + 1);
                let named = Named::parse(&name, Parameters::default()).unwrap();
                assert_eq!((named.first(), named.second()), (Some(first), second), "{name}");
            }
        }
    }
    for (name, first, second) in [
        ("TMJSOR1", [1.0, 0.0], [0.9, 0.9]),
        ("TMJSOR2", [1.0, 0.0], [1.0, 1.0]),
        ("TMJSOR3", [1.0, 0.0], [1.1, 1.1]),
        ("TMJSOR4", [1.0, 0.0], [1.2, 1.2]),
        ("TMGSJ", [1.0, 1.0], [1.0, 0.0]),
        ("TMGSSOR1", [1.0, 1.0], [0.9, 0.9]),
        ("TMGSSOR2", [1.0, 1.0], [1.1, 1.1]),
        ("TMGSSOR3", [1.0, 1.0], [1.2, 1.2]),
    ] {
        let named = Named::parse(name, Parameters::default()).unwrap();
        assert_eq!((named.first(), named.second()), (Some(first), Some(second)), "{name}");
    }
}

#[test]
fn method_names_are_checked_and_suggested() {
    let none = Parameters::default();
    let alpha = Parameters { alpha: Some(1.3), ..none };
    let both = Parameters { beta: Some(0.7), ..alpha };
    for (typo, suggestion) in [("TMGS5", "TMGS"), ("MSOT", "MSOR"), ("tmgssro2", "TMGSSOR2")] {
        let error = Named::parse(typo, none).unwrap_err();
        let NameError::Unknown { closest, .. } = error else { panic!("{error:?}") };
        assert_eq!(closest.as_deref(), Some(suggestion));
    }
    let family = Named::parse("amms", alpha).unwrap_err().to_string();
    assert!(family.starts_with("AMMS is a family of methods: take AMJ, AMGS, AMSOR or AMAOR;"));
    let far = Named::parse("FOO", none).unwrap_err();
    assert!(matches!(far, NameError::Unknown { closest: None, .. }), "{far}");
    for (name, given, parameter) in [
        ("MSOR", none, "alpha"),
        ("TMAOR", alpha, "beta"),
        ("AMAOR", Parameters { beta: Some(0.7), ..none }, "alpha"),
    ] {
        let error = Named::parse(name, given).unwrap_err();
        let NameError::Missing { parameter: missing, .. } = error else { panic!("{error:?}") };
        assert_eq!(missing, parameter);
    }
    for (name, given, parameter) in [
        ("MGS", alpha, "alpha"),
        ("TMSOR", both, "beta"),
        ("MSOR1", alpha, "alpha"),
        ("TMGSSOR2", Parameters { alpha2: Some(1.4), ..none }, "alpha2"),
        ("MAOR", Parameters { alpha2: Some(1.4), ..both }, "alpha2"),
        ("AMAOR", Parameters { beta2: Some(1.4), ..both }, "beta2"),
        ("TMSOR", Parameters { beta2: Some(1.4), ..alpha }, "beta2"),
    ] {
        let error = Named::parse(name, given).unwrap_err();
        let NameError::Fixed { parameter: fixed, .. } = error else { panic!("{error:?}") };
        assert_eq!(fixed, parameter, "{name}");
    }
    let second = |name, given| Named::parse(name, given).unwrap().second();
    assert_eq!(second("TMSOR", Parameters { alpha2: Some(1.4), ..alpha }), Some([1.4, 1.4]));
    assert_eq!(second("TMSOR", alpha), Some([1.3, 1.3]));
    assert_eq!(second("TMAOR", both), Some([1.3, 0.7]));
    assert_eq!(second("TMAOR", Parameters { beta2: Some(0.6), ..both }), Some([1.3, 0.6]));
    assert_eq!(second("MAOR", both), None);
}
