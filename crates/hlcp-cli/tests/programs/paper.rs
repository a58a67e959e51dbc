//! The iteration counts that the tables of `docs/results` have for m = 128 and N = 128. That the
//! iterates are the paper's is tested in `tests/lockstep.rs`.

use std::fs;

use approx::assert_abs_diff_eq;
use hlcp_core::{Aor, Rows};
use hlcp_methods::{Limits, Named, Solver};
use hlcp_verify::{Example, Slider, theorem_2};
use nalgebra::{DMatrix, DVector};

use crate::{
    common::{assembled, named, problem, solve_from_ones},
    examples::root,
};

/// Examples 1 and 2 of Tables 3 to 5: whether symmetric, and μ = ν.
const SCENES: [(bool, f64); 3] = [(true, 4.0), (true, 0.0), (false, 4.0)];

/// The cells of the rows that a table has for 128; a pair of parameters is two cells.
fn recorded(table: u8) -> Vec<Vec<String>> {
    let path = root().join(format!("docs/results/table{table}.csv"));
    let text = fs::read_to_string(path).expect("a table of the documents");
    let cell = |cell: &str| cell.trim_matches(['"', '(', ')', ' ']).to_owned();
    let rows = text.lines().filter(|line| line.starts_with("128,"));
    rows.map(|row| row.split(',').map(cell).collect()).collect()
}

/// τ, α and β of a row of Tables 3 to 5.
fn parameters(row: &[String]) -> [f64; 3] {
    [1, 2, 3].map(|k| row[k].parse().expect("a number"))
}

/// A residual that lands on the threshold may fall on either side of it; far down a slow iteration,
/// where the residual shrinks by one part in a thousand a step, so may a few. The slider's residual
/// carries roundings of ε‖A‖‖z‖ ≈ 10⁻¹³ ‖q‖ there, a thousandth of the tolerance.
fn same_count(found: Option<usize>, recorded: &str) -> bool {
    match (found, recorded.parse::<usize>()) {
        (Some(found), Ok(recorded)) => found.abs_diff(recorded) <= 1 + recorded / 10_000,
        // A cell of a solve that did not converge has no number.
        (found, recorded) => found.is_none() && recorded.is_err(),
    }
}

/// The library's count; `None` where it does not converge.
fn count<A: Rows<f64>, B: Rows<f64>>(
    (a, b, q): (&A, &B, &[f64]),
    tau: f64,
    method: Named,
    limits: Limits,
) -> Option<usize> {
    let mut solver = Solver::new(method.on(problem(tau, a, b)).unwrap());
    let outcome = solve_from_ones(&mut solver, q, limits);
    outcome.converged().then_some(outcome.iterations)
}

#[test]
fn counts_of_tables_3_to_5() {
    for (table, (symmetric, shift)) in (3..).zip(SCENES) {
        let scene = Example { symmetric, m: 128, mu: shift, nu: shift }.pose::<f64>().unwrap();
        let (data, rows) = ((&scene.a, &scene.b, &scene.q[..]), recorded(table));
        assert_eq!(rows.len(), 18);
        for row in rows {
            let [tau, alpha, beta] = parameters(&row);
            for (name, cell) in
                ["MAOR", "AMAOR", "TMAOR"].into_iter().zip(row[4..].iter().step_by(4))
            {
                let found = count(data, tau, named(name, [alpha, beta]), Limits::absolute(1e-10));
                assert!(same_count(found, cell), "table {table}, {name}: {found:?} in {row:?}");
            }
        }
    }
}

#[test]
fn counts_of_table_6() {
    let (a, b, q) = Slider { cells: 128 }.pose::<f64>().unwrap();
    let rows = recorded(6);
    assert_eq!(rows.len(), 14);
    for row in rows {
        for (tau, cell) in [0.8, 1.0, 1.2].into_iter().zip(row[2..].iter().step_by(4)) {
            let method = row[1].parse().unwrap();
            let found = count((&a, &b, &q), tau, method, Limits::relative(1e-10));
            assert!(same_count(found, cell), "τ = {tau}: {found:?} in {row:?}");
        }
    }
}

/// The slider's matrices in SI units, from the discretised Reynolds equation.
fn dense_slider(cells: usize) -> [DMatrix<f64>; 2] {
    let (n, dx) = (cells - 1, Slider::LENGTH / cells as f64);
    let h = |x: f64| {
        let s = 2.0 * x / Slider::LENGTH - 1.0;
        Slider::H_MIN + (Slider::H_MAX - Slider::H_MIN) * s.powi(2)
    };
    let conductance =
        |x: f64| h(x).powi(3) / (6.0 * Slider::VISCOSITY * Slider::SPEED * dx.powi(2));
    let x = |i: usize| (i + 1) as f64 * dx;
    let a = DMatrix::from_fn(n, n, |i, j| match (i + 1).wrapping_sub(j) {
        2 => -conductance(x(i) - dx / 2.0),
        1 => conductance(x(i) - dx / 2.0) + conductance(x(i) + dx / 2.0),
        0 => -conductance(x(i) + dx / 2.0),
        _ => 0.0,
    });
    let b = DMatrix::from_fn(n, n, |i, j| match (i + 1).wrapping_sub(j) {
        2 => -h(x(j)) / dx,
        1 => h(x(j)) / dx,
        _ => 0.0,
    });
    [a, b]
}

#[test]
fn the_slider_is_the_reynolds_equation() {
    let cells = 24;
    let (a, b, q) = Slider { cells }.pose::<f64>().unwrap();
    let n = q.len();
    let row_unit = Slider::LENGTH / Slider::H_MIN;
    let [dense_a, dense_b] = dense_slider(cells);
    let dense_a = dense_a * (Slider::PRESSURE_UNIT * row_unit);
    let dense_b = dense_b * row_unit;
    for (found, expected) in [(assembled(&a), &dense_a), (assembled(&b), &dense_b)] {
        // Some twenty roundings an entry.
        let sizes = expected.map(|v| v.abs().max(1e-300));
        assert!((found - expected).abs().component_div(&sizes).max() <= 1e-14);
    }
    // q is what a full film would need: with z = 0 and r = 0 the flux is h.
    let inlet = 2.0 * cells as f64;
    let full = &dense_b * DVector::from_element(n, 1.0)
        - DVector::from_fn(n, |i, _| if i == 0 { inlet } else { 0.0 });
    assert!((full - DVector::from_column_slice(&q)).amax() <= 1e-14 * inlet);
}

/// With s = 2X − 1, H = 1 + s² and H³ z' = H − H(X_c), both the rupture and the peak are integrals
/// of H⁻² and H⁻³, and those have closed forms.
#[test]
fn the_slider_answer_solves_the_continuous_problem() {
    let squared = |s: f64| s / (2.0 * (1.0 + s * s)) + s.atan() / 2.0;
    let cubed = |s: f64| s / (4.0 * (1.0 + s * s).powi(2)) + 0.75 * squared(s);
    let s_c = 2.0 * Slider::RUPTURE / Slider::LENGTH - 1.0;
    let z =
        |s: f64| (squared(s) - squared(-1.0) - (1.0 + s_c * s_c) * (cubed(s) - cubed(-1.0))) / 2.0;
    // The constants carry 15 and 13 decimals.
    assert!(z(s_c).abs() <= 1e-14, "{:e}", z(s_c));
    assert_abs_diff_eq!(z(-s_c), Slider::PEAK / Slider::PRESSURE_UNIT, epsilon = 1e-13);
    assert!([-1e-3, 1e-3].iter().all(|step| z(-s_c + step) < z(-s_c)));
}

/// Of the 54 configurations the theorem covers 6, 3 and 6: those of τ = 1, without over-relaxation
/// where μ = ν = 0. The others converge all the same, by the counts above.
#[test]
fn theorem_2_covers_fifteen_of_the_54_configurations() {
    let covered = SCENES.map(|(symmetric, shift)| {
        let scene = Example { symmetric, m: 6, mu: shift, nu: shift }.pose::<f64>().unwrap();
        let covers = |[tau, alpha, beta]: &[f64; 3]| {
            let problem = problem(*tau, &scene.a, &scene.b);
            theorem_2(&problem, &[Aor::new(*alpha, *beta).unwrap()]).applies()
        };
        let rows = recorded(3).into_iter().map(|row| parameters(&row));
        let covered: Vec<_> = rows.filter(covers).collect();
        let is_expected =
            |[tau, alpha, _]: &[f64; 3]| *tau == 1.0 && (*alpha <= 1.0 || shift > 0.0);
        assert!(covered.iter().all(is_expected));
        covered.len()
    });
    assert_eq!(covered, [6, 3, 6]);
}
