//! `hlcp solve`, run as a user runs it.

use hlcp_verify::Slider;
use serde_json::Value;

use crate::{
    command::{json, number, refused, solve, succeeded, text},
    folder::Folder,
};

#[test]
fn the_report_has_its_keys_and_numbers() {
    let arguments = "--scene example2 --m 9 --mu 3 --nu 2.5 --method tmaor --alpha 1.1 --beta 0.8 --tau 0.9 \
                     --gamma 2.5 --json";
    let (report, status) = json(arguments);
    let keys: Vec<&str> = report.as_object().unwrap().keys().map(String::as_str).collect();
    let expected = "scene n method alpha beta tau omega gamma precision threads outcome converged iterations sweeps linear_iterations \
                    residual_l2 residual_linf backward_error forgone error_linf objective seconds";
    assert_eq!(keys, expected.split_whitespace().collect::<Vec<_>>());
    assert_eq!(status, 0);
    let given = serde_json::json!({
        "scene": "example2", "n": 81, "method": "TMAOR", "alpha": 1.1, "beta": 0.8, "tau": 0.9,
        "gamma": 2.5, "precision": "f64",
    });
    for (key, value) in given.as_object().unwrap() {
        assert_eq!(report[key], *value, "{key}");
    }
    let [l2, linf] = ["residual_l2", "residual_linf"].map(|key| number(&report, key));
    assert!(l2 <= 1e-10 && linf <= l2, "{report}");
}

/// The report of a solve that ends with this outcome: with the status 0 if it converged, else 2.
fn ends(arguments: &str, outcome: &str) -> Value {
    let (report, status) = json(&format!("{arguments} --json"));
    let wanted = if outcome == "converged" { 0 } else { 2 };
    assert_eq!((&report["outcome"], status), (&Value::from(outcome), wanted), "{arguments}");
    report
}

#[test]
fn the_norm_and_the_tolerance_of_the_test() {
    let at = |norm: &str| json(&format!("--m 40 --method MGS --norm {norm} --tol 1e-6 --json")).0;
    let (l2, linf) = (at("l2"), at("linf"));
    assert!(number(&l2, "residual_l2") <= 1e-6 && number(&linf, "residual_linf") <= 1e-6);
    assert!(number(&linf, "iterations") < number(&l2, "iterations"));
}

#[test]
fn not_converging_is_status_2_with_the_outcome_printed() {
    let report = ends("--m 20 --method MGS --max-iterations 3", "iteration_limit");
    assert_eq!((&report["iterations"], &report["converged"]), (&3.into(), &false.into()));
    // Its figures are marked, too.
    let marked = |arguments: &str| -> Vec<bool> {
        let out = text(&solve(&format!("--scene bearing2d --nx 31 --ny 15 {arguments}")).stdout);
        let figures = out.lines().filter(|line| line.starts_with("          "));
        figures.map(|line| line.ends_with(" (not converged: no figure of the scene)")).collect()
    };
    assert_eq!(marked("--method MGS --max-iterations 5"), [true; 5]);
    assert_eq!(marked("--method AUTO"), [false; 5]);
    let report = ends("--m 20 --mu 0 --nu 0 --method MSOR --alpha 3.5", "diverged");
    assert!(report["residual_l2"].as_f64().is_some_and(f64::is_finite));
    // Below the rounding floor, which a γ that is no power of two keeps off zero.
    let fine = "--m 20 --method TMGS --precision f32 --gamma 0.7 --tau 1.1 --tol 1e-12";
    ends(fine, "stagnated");
    let output = solve("--m 20 --method MGS --max-iterations 3");
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stdout).contains("iteration limit"));
    assert!(text(&output.stderr).starts_with("note: MGS did not converge; try AUTO"));
    // No method is told to try itself.
    let output = solve("--m 20 --method AUTO --max-iterations 0");
    let told = "note: AUTO did not converge; try ANDERSON or AMG, or more by --max-iterations";
    assert!(text(&output.stderr).starts_with(told), "{}", text(&output.stderr));
}

#[test]
fn without_a_method_three_of_them_in_both_precisions() {
    let out = succeeded(&solve("--m 16"), "--m 16");
    for method in ["MGS", "AMGS", "TMGS"] {
        for precision in ["f64", "f32"] {
            let row = |line: &&str| {
                let mut words = line.split_whitespace();
                words.next() == Some(method) && words.next() == Some(precision)
            };
            assert_eq!(out.lines().filter(row).count(), 1, "{method} {precision}:\n{out}");
        }
    }
}

#[test]
fn methods_with_commas_between_them_are_compared() {
    let asked = "--scene disc-lcp --m 15 --method FMG,amg,TMGS --json";
    let out = succeeded(&solve(asked), asked);
    let of = |line: &str| serde_json::from_str::<Value>(line).unwrap()["method"].clone();
    assert_eq!(out.lines().map(of).collect::<Vec<_>>(), ["FMG", "AMG", "TMGS"]);
    // One that does not converge is told by the status, and the others are solved.
    let output = solve("--scene disc-lcp --m 15 --method MJ,FMG --max-iterations 20");
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(text(&output.stdout).lines().count(), 4);
}

#[test]
fn bad_input_is_status_1_with_one_line_on_stderr_and_nothing_on_stdout() {
    for (arguments, named) in [
        ("--method TMAR", "'TMAOR'"),
        ("--method MSOR", "MSOR needs --alpha: 1 is Gauss-Seidel, 1.1 to 1.4"),
        ("--method FOO", "no method 'FOO'; the names are M, AM or TM before J"),
        ("--method MGS,FOO", "no method 'FOO'"),
        ("--method MGS,TMGS --out-z z.mtx", "take the answer of one method; name one by --method"),
        ("--method MGS --alpha 1.2", "MGS takes no --alpha (given: 1.2); use MSOR"),
        ("--method MGS --alpha2 1.2", "alpha2"),
        ("--method AUTO --alpha 1.2", "AUTO takes no --alpha"),
        ("--alpha 1.2", "--method"),
        ("--json", "--method"),
        ("--m 0", "0"),
        ("--m 99999", "99999"),
        ("--repeats 0", "0"),
        ("--threads 0", "0"),
        ("--method MGS --base TMGS", "--base"),
        ("--method MGS --window 3", "--window"),
        ("--method ANDERSON --window 0", "window is 0"),
        ("--method ANDERSON --base MSOR", "alpha"),
        ("--method NEWTON --base NEWTON", "NEWTON"),
        ("--scene obstacle --m 2", "m is 2"),
        ("--scene slider --m 1", "order 0"),
        ("--scene slider --groove 10", "--groove is an option of bearing2d, not of slider"),
        ("--scene obstacle --mu 2", "--mu is an option of example1, example2, not of obstacle"),
        ("--scene bearing2d --b-length 3", "--b-length is an option of journal-bearing"),
        ("--m 8 --rate 0.06", "--rate is an option of american-put"), // the default, but given
        ("--a a.mtx --q q.mtx --steps 3", "--steps is an option of american-put, not of files"),
        ("--a a.mtx --q q.mtx --m 3", "not of files"),
        ("--a a.mtx --q q.mtx --scene slider", "--scene"),
        ("--scene bearing2d --ecc 1.5", "ecc is 1.5"),
        ("--scene american-put --rate -1", "rate is -1"),
        ("--m 8 --tau 0", "tau is 0"),
        ("--m 8 --tau -1.5", "tau is -1.5"),
        ("--m 8 --omega -2", "omega is -2"),
        ("--m 8 --omega 2 --tau 1", "--tau"),
        ("--m 8 --gamma 0", "gamma is 0"),
        ("--m 8 --gamma nan", "gamma is NaN"),
        ("--m 8 --gamma -1e-300", "gamma is -1e-300, but"),
        ("--m 8 --method MSOR --alpha -1", "alpha is -1"),
        ("--m 8 --tol -1e-9", "absolute tolerance is -1e-9"),
        ("--m 8 --mu -4.5", "diagonal of M[0] is 0, "),
        ("--m 8 --nu -4.5", "diagonal of B[0] is -0.5"),
        ("--m 8 --mu nan", "NaN"),
        ("--m 8 --precision f32 --mu 1e300", "inf"),
        ("--scene example9", "example9"),
        ("extra", "extra"),
    ] {
        refused(arguments, named);
    }
}

/// First order in the peak pressure, and the rupture within a cell.
#[test]
fn the_film_comes_out_in_si_units_with_its_errors() {
    for cells in [80, 400] {
        let report = ends(&format!("--scene slider --m {cells} --method NEWTON"), "converged");
        assert!(report["scene"] == "slider" && report["error_linf"].is_null(), "{report}");
        assert_eq!(report["n"], cells - 1);
        let number = |key: &str| number(&report, key);
        for (figure, error, known) in [
            ("peak_pa", "peak_error_pa", Slider::PEAK),
            ("rupture_m", "rupture_error_m", Slider::RUPTURE),
        ] {
            // Reading a number may round it once more.
            let off = number(error) - (number(figure) - known);
            assert!(off.abs() <= 4.0 * f64::EPSILON * known, "{report}");
        }
        // 3.7175 MPa at 100 cells is 126 kPa above the continuous peak.
        assert!((number("peak_error_pa") * f64::from(cells) - 12.6e6).abs() <= 0.3e6);
        assert!(number("rupture_error_m").abs() <= Slider::LENGTH / f64::from(cells));
    }
}

#[test]
fn the_disc_scenes_by_name_and_the_median_of_repeats() {
    // Counts of the same scenes in an independent program: 1637 (TMSOR 1.5, m = 64) and divergence
    // of the LCP.
    let disc = "--scene disc-hlcp --m 64 --method TMSOR --alpha 1.5 --repeats 3";
    let report = ends(disc, "converged");
    assert_eq!(report["scene"], "disc-hlcp");
    assert!((number(&report, "iterations") - 1637.0).abs() <= 1.0, "{report}");
    assert!(number(&report, "error_linf") <= 1e-8);
    ends("--scene disc-lcp --m 64 --method TMSOR --alpha 1.5", "diverged");
}

/// A price is one of all time steps, each of which takes over the errors of those before.
#[test]
fn no_price_is_proved_by_its_last_time_step() {
    let command = "--scene american-put --m 16 --method NEWTON --certify";
    let said = succeeded(&solve(command), command);
    assert!(said.contains("proofs of the last time step alone"), "{said}");
    let (report, _) = json(&format!("{command} --json"));
    assert_eq!(report["certificate"]["figures"], serde_json::json!({}));
}

/// What is proved of a rough answer holds of a fine one, and every side is proved of both.
#[test]
fn figures_lie_where_they_are_proved_to() {
    for (scene, n, rough, figures) in [
        ("--scene slider --m 129", 128, "--rtol 1e-6", "peak_pa rupture_m"),
        (
            "--scene bearing2d --nx 31 --ny 15 --groove 200",
            465,
            "--tol 1e-5",
            "sommerfeld attitude_degrees flow_drawn flow_returned flow_ends",
        ),
        ("--scene disc-lcp --m 31", 961, "--tol 1e-5", ""),
    ] {
        let run = |options: &str| {
            let (report, _) = json(&format!("{scene} --method NEWTON --certify --json {options}"));
            let certificate = report["certificate"].clone();
            assert_eq!(certificate["open"], 0, "{scene}");
            assert_eq!(certificate["unique"], true, "{scene}");
            let sides = ["z_positive", "r_positive"].map(|key| certificate[key].as_i64().unwrap());
            assert!(sides[0] > 0 && sides[1] > 0 && sides[0] + sides[1] == n, "{certificate}");
            (report, certificate["figures"].clone())
        };
        let ((coarse, proved), (fine, closer)) = (run(rough), run("--tol 1e-13"));
        let keys: Vec<&str> = proved.as_object().unwrap().keys().map(String::as_str).collect();
        assert_eq!(keys, figures.split_whitespace().collect::<Vec<_>>());
        // At the floor of rounding a box may come out a little wider than another.
        let bound = |report| number(report, "certified_error_bound");
        assert!(4.0 * bound(&coarse) >= bound(&fine));
        for key in keys {
            let ends = |of: &Value| [0, 1].map(|end| of[end].as_f64().unwrap());
            let [lower, upper] = ends(&proved[key]);
            let (value, [low, high]) = (number(&fine, key), ends(&closer[key]));
            // The printed figure has an error of its own.
            let slack = 1e-11 * value.abs();
            assert!(lower <= value + slack && value - slack <= upper, "{key}: {proved} {fine}");
            assert!(low <= value + slack && value - slack <= high && low <= upper && lower <= high);
            assert!(upper - lower <= 1e-3 * value.abs(), "{key}: {proved}");
        }
    }
}

#[test]
fn a_certificate_is_refused_with_its_reason() {
    let folder = Folder::new("refused");
    let rows = "2 2 4\n1 1 1\n1 2 -1\n2 1 -1\n2 2 1\n";
    let head = "%%MatrixMarket matrix coordinate integer general\n";
    let a = folder.write("singular.mtx", format!("{head}{rows}"));
    let q = folder.write("q", "-1\n-1\n");
    let (a, q) = (a.display(), q.display());
    let arguments = format!("--a {a} --q {q} --method MGS --max-iterations 5 --certify");
    let (report, _) = json(&format!("{arguments} --json"));
    assert!(report["certified_error_bound"].is_null());
    let why = "no box near the answer was found that must hold a solution; a smaller residual may \
               show one";
    assert_eq!(report["certificate"]["refused"], why);
    assert!(text(&solve(&arguments).stdout).contains(&format!("none, because {why}")));
}

#[test]
fn long_numbers_and_long_times_are_short() {
    let out = text(&solve("--m 8 --gamma 1e-300 --method MGS").stdout);
    assert!(out.contains("mu = 4, nu = 4, tau = 1, gamma = 1e-300\n"), "{out}");
    ends("--m 8 --method MGS --max-seconds 1e308", "converged");
}
