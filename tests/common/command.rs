//! The programs, `solve` above all, run as a user runs them.
#![allow(dead_code, reason = "each test program uses its own part")]

use std::{
    path::PathBuf,
    process::{Command, Output},
};

use serde_json::Value;

/// An example, which a bare `cargo test` builds next to the tests.
pub(crate) fn program(name: &str) -> PathBuf {
    let mut path = std::env::current_exe().expect("a test is a file");
    path.pop();
    path.pop();
    path.push(format!("examples/{name}{}", std::env::consts::EXE_SUFFIX));
    assert!(path.exists(), "{} is missing: run `cargo test` or build the examples", path.display());
    path
}

/// Runs the example `solve`.
pub(crate) fn solve(arguments: &str) -> Output {
    let mut command = Command::new(program("solve"));
    command.args(arguments.split_whitespace()).output().expect("solve starts")
}

pub(crate) fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("the output is UTF-8")
}

/// The one JSON object on stdout, and the exit status.
pub(crate) fn json(arguments: &str) -> (Value, i32) {
    let output = solve(arguments);
    let value = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|e| panic!("{arguments}: {e}: {}", text(&output.stderr)));
    (value, output.status.code().expect("not killed"))
}

/// Exit status 1, one line on stderr that names `named`, nothing on stdout.
pub(crate) fn refused(arguments: &str, named: &str) {
    let output = solve(arguments);
    let err = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{arguments}: {err}");
    assert!(output.stdout.is_empty(), "{arguments}: {}", text(&output.stdout));
    assert_eq!(err.lines().count(), 1, "{arguments}: {err}");
    assert!(err.contains(named), "{arguments}: {err}");
}
