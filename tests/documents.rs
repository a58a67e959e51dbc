//! What the documents say a reader can type, typed; and where their links point.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

/// Programs whose full run takes minutes; here they run with `--quick`.
const LONG: [&str; 4] = ["paper", "speed_vs_accuracy", "stability_map", "comparison"];

/// Every Markdown file of the repository.
fn documents() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut folders = vec![root.to_owned()];
    let mut found = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a folder of the repository") {
            let path = entry.expect("an entry").path();
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            if path.is_dir() && name != "target" && !name.starts_with('.') {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "md") {
                found.push(path);
            }
        }
    }
    found
}

/// The commands between backticks and in fenced blocks, without comments and prompts.
fn commands(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut fenced = false;
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            fenced = !fenced;
        } else if fenced {
            found.push(line.split(" #").next().unwrap_or_default());
        } else {
            found.extend(line.split('`').skip(1).step_by(2));
        }
    }
    let typed = |command: &&str| command.starts_with("cargo ") || command.starts_with("scripts/");
    found.into_iter().map(str::trim).filter(typed).map(String::from).collect()
}

/// A folder with a small problem as files, under the names that the documents use.
fn workplace() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("documents");
    fs::create_dir_all(folder.join("docs/results")).expect("a folder under target");
    let entries = "%%MatrixMarket matrix coordinate real general\n3 3 7\n1 1 4\n1 2 -1\n2 1 -1\n2 2 4\n2 3 -1\n3 2 -1\n3 3 4\n";
    for name in ["A.mtx", "B.mtx"] {
        fs::write(folder.join(name), entries).expect("a file under target");
    }
    for (name, head) in
        [("q.mtx", "%%MatrixMarket matrix array real general\n3 1\n"), ("q.txt", "")]
    {
        fs::write(folder.join(name), format!("{head}-2\n5\n-6\n")).expect("a file under target");
    }
    let profile = "examples/data/pad.csv";
    let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join(profile);
    fs::create_dir_all(folder.join("examples/data")).expect("a folder under target");
    fs::copy(sample, folder.join(profile)).expect("a sample profile");
    folder
}

#[test]
fn what_the_documents_say_to_type_works() {
    let folder = workplace();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut examples = std::env::current_exe().expect("a test is a file");
    examples.pop();
    examples.set_file_name("examples");
    let all: BTreeSet<String> = documents()
        .iter()
        .flat_map(|path| commands(&fs::read_to_string(path).expect("a document is text")))
        .collect();
    assert!(all.len() >= 8, "found only {all:?}");
    for command in all {
        let words: Vec<&str> = command.split_whitespace().collect();
        match words[..] {
            ["cargo", "run", "--release", "--example", "NAME"] => {}
            ["cargo", "run", "--release", "--example", name, ref rest @ ..] => {
                let mut program = Command::new(examples.join(name));
                program.args(rest.iter().skip(1)).current_dir(&folder);
                if LONG.contains(&name) && !rest.contains(&"--quick") {
                    program.arg("--quick");
                }
                let output = program.output().unwrap_or_else(|e| panic!("{command}: {e}"));
                let err = String::from_utf8_lossy(&output.stderr);
                assert!(output.status.success(), "{command}: {err}");
            }
            ["cargo", "test", "--test", name, ..] => {
                assert!(root.join(format!("tests/{name}.rs")).exists(), "{command}");
            }
            ["cargo", "bench", "--bench", name, ..] => {
                assert!(root.join(format!("benches/{name}.rs")).exists(), "{command}");
            }
            ["cargo", "build", "--profile", "test", "--example", name] => {
                assert!(root.join(format!("examples/{name}.rs")).exists(), "{command}");
            }
            ["cargo", "test" | "doc", ..] => {}
            ["cargo", "build", "--release", "-p", name] | ["cargo", "tree", .., name] => {
                let known = name == "NAME" || root.join("crates").join(name).exists();
                assert!(known, "{command}");
            }
            [script] if script.starts_with("scripts/") => {
                assert!(root.join(script).exists(), "{command}");
            }
            ["scripts/check", "--but-tests"] => {}
            _ => panic!("no test runs `{command}`"),
        }
    }
}

#[test]
fn links_lead_somewhere() {
    let mut count = 0;
    for path in documents() {
        let text = fs::read_to_string(&path).expect("a document is text");
        let links = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
        let pictures = text.split("src=\"").skip(1).filter_map(|rest| rest.split('"').next());
        for target in links.chain(pictures) {
            let file = target.split('#').next().unwrap_or_default();
            if file.is_empty() || file.contains("://") {
                continue;
            }
            let folder = path.parent().expect("a file is in a folder");
            assert!(folder.join(file).exists(), "{}: {target}", path.display());
            count += 1;
        }
    }
    assert!(count >= 10, "found only {count}");
}
