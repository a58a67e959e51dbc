//! The command `hlcp`, run as a user runs it.

use std::process::{Command, Output};

use serde_json::Value;

/// The command with a subcommand and its arguments.
pub(crate) fn hlcp(subcommand: &str, arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hlcp"));
    command.arg(subcommand).args(arguments.split_whitespace());
    command
}

/// Runs `hlcp solve`.
pub(crate) fn solve(arguments: &str) -> Output {
    hlcp("solve", arguments).output().expect("the command starts")
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

#[test]
fn without_a_command_the_help_is_printed_with_status_1() {
    let output = Command::new(env!("CARGO_BIN_EXE_hlcp")).output().expect("the command starts");
    let err = text(&output.stderr);
    assert_eq!((output.status.code(), output.stdout.len()), (Some(1), 0));
    for word in ["Usage: hlcp", "speed-vs-accuracy", "Examples:"] {
        assert!(err.contains(word), "{err}");
    }
}
