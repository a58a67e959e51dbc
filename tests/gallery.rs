//! The programs about the scenes run, and what they write is small.

use std::{fs, path::PathBuf, process::Command};

fn example(name: &str) -> Command {
    let mut path = std::env::current_exe().expect("a test is a file");
    path.pop();
    path.pop();
    path.push(format!("examples/{name}{}", std::env::consts::EXE_SUFFIX));
    Command::new(path)
}

#[test]
fn the_gallery_is_drawn() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("gallery");
    let output = example("gallery").arg("--out").arg(&folder).output();
    let output = output.expect("a bare `cargo test` builds the examples");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let names = [
        "slider",
        "disc-lcp",
        "disc-hlcp",
        "journal-bearing",
        "obstacle",
        "bearing2d",
        "bearing2d-groove",
        "american-put",
    ];
    for name in names {
        let file = |kind: &str| fs::read_to_string(folder.join(format!("gallery-{name}.{kind}")));
        let (svg, csv) = (file("svg").expect("drawn"), file("csv").expect("written"));
        assert!(svg.starts_with("<svg") && svg.len() < 300_000, "{name}: {} bytes", svg.len());
        assert!(csv.lines().count() > 100 && csv.len() < 300_000, "{name}");
        // A value that is no number would be drawn as nothing.
        assert!(!csv.contains("NaN") && !csv.contains("inf"), "{name}");
    }
}
