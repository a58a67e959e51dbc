//! `solve --scene slider`, run as a user runs it.

use std::process::{Command, Output};

use hlcp_verify::Slider;
use serde_json::Value;

/// The example `solve`, which a bare `cargo test` builds next to the tests.
fn solve(arguments: &str) -> Output {
    let mut path = std::env::current_exe().expect("a test is a file");
    path.pop();
    path.pop();
    path.push(format!("examples/solve{}", std::env::consts::EXE_SUFFIX));
    assert!(path.exists(), "{} is missing: run `cargo test` or build the examples", path.display());
    Command::new(path).args(arguments.split_whitespace()).output().expect("solve starts")
}

#[test]
fn the_film_comes_out_in_si_units_with_its_errors() {
    let output = solve("--scene slider --m 80 --method TMGSSOR2 --json");
    assert_eq!(output.status.code(), Some(0));
    let report: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!(
        (&report["scene"], &report["n"], &report["error_linf"]),
        (&Value::from("slider"), &Value::from(79), &Value::Null)
    );
    let number = |key: &str| report[key].as_f64().unwrap();
    assert_eq!(number("peak_error_pa"), number("peak_pa") - Slider::PEAK);
    assert_eq!(number("rupture_error_m"), number("rupture_m") - Slider::RUPTURE);
    // First order: 3.7175 MPa at 100 cells is 126 kPa above the continuous peak.
    assert!((number("peak_error_pa") * 80.0 - 12.6e6).abs() <= 0.3e6);
    assert!(number("rupture_error_m").abs() <= Slider::LENGTH / 80.0);
}

#[test]
fn what_the_slider_cannot_take_is_refused_in_one_line() {
    for (arguments, named) in
        [("--m 1", "order 0"), ("--m 8 --mu 2", "--mu"), ("--m 8 --nu 2", "--nu")]
    {
        let output = solve(&format!("--scene slider {arguments}"));
        let err = String::from_utf8(output.stderr).expect("the output is UTF-8");
        assert_eq!((output.status.code(), output.stdout.len()), (Some(1), 0), "{err}");
        assert!(err.lines().count() == 1 && err.contains(named), "{err}");
    }
}
