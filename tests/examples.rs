//! The examples that take no arguments and check themselves.

use std::process::Command;

#[test]
fn examples_find_their_own_results_right() {
    for name in ["custom_operator", "custom_splitting"] {
        let mut path = std::env::current_exe().expect("a test is a file");
        path.pop();
        path.pop();
        path.push(format!("examples/{name}{}", std::env::consts::EXE_SUFFIX));
        let output = Command::new(&path).output().expect("a bare `cargo test` builds the examples");
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
    }
}
