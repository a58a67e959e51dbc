//! The examples of the repository, which check themselves.

use std::{fs, path::Path, process::Command};

/// The folder of the repository.
pub(crate) fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

/// Runs an example as a reader does; where the tests of all crates are run it is built already.
pub(crate) fn runs(name: &str) {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["run", "--quiet", "--offline", "--profile", "test", "--example", name]);
    let output = cargo.current_dir(root()).output().expect("cargo starts");
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn examples_find_their_own_results_right() {
    let mut names = vec![];
    for entry in fs::read_dir(root().join("examples")).expect("a folder of the repository") {
        let path = entry.expect("an entry").path();
        if path.extension().is_some_and(|extension| extension == "rs") {
            names.push(path.file_stem().expect("a name").to_string_lossy().into_owned());
        }
    }
    assert!(names.len() >= 2, "{names:?}");
    names.iter().for_each(|name| runs(name));
}
