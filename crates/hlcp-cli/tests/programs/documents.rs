//! What the documents say a reader can type, typed; and where their links point.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
};

use crate::{
    command::{hlcp, run_in, succeeded},
    examples, options,
};

/// Whether the full run of a command takes minutes; here it runs with `--quick`.
fn is_long(command: &str) -> bool {
    options::options(command).iter().any(|(option, _)| option == "quick")
}

/// The commands that `hlcp charts` runs, but for a film: its command is short enough to be typed.
fn drawn() -> Vec<String> {
    let help = succeeded(&hlcp("charts", "--help").output().unwrap(), "charts");
    let (_, steps) = help.split_once("[possible values: ").expect("the commands that it runs");
    let steps = steps.split(']').next().unwrap_or_default().split(',').map(str::trim);
    steps.filter(|step| *step != "film").map(String::from).collect()
}

/// Every Markdown file of the repository.
fn documents() -> Vec<PathBuf> {
    let root = examples::root();
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
    let typed = |command: &&str| {
        ["cargo ", "scripts/", "hlcp "].iter().any(|start| command.starts_with(start))
    };
    found.into_iter().map(str::trim).filter(typed).map(String::from).collect()
}

/// A folder with a small problem as files, under the names that the documents use.
fn workplace(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(folder.join("docs/results")).expect("a folder under target");
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("data");
    let same = folder.join("crates/hlcp-cli/data");
    fs::create_dir_all(&same).expect("a folder under target");
    for name in ["A.mtx", "B.mtx", "q.mtx", "pad.csv"] {
        for folder in [&folder, &same] {
            fs::copy(data.join(name), folder.join(name)).expect("a sample");
        }
    }
    fs::copy(data.join("q.mtx"), folder.join("q.txt")).expect("a sample");
    folder
}

#[test]
fn what_the_documents_say_to_type_works() {
    let folder = workplace("documents");
    let root = examples::root();
    let all: BTreeSet<String> = documents()
        .iter()
        .flat_map(|path| commands(&fs::read_to_string(path).expect("a document is text")))
        .collect();
    assert!(all.len() >= 8, "found only {all:?}");
    let drawn = drawn();
    for command in all {
        let words: Vec<&str> = command.split_whitespace().collect();
        match words[..] {
            ["cargo", "run", "--release", "--example", "NAME"] => {}
            ["hlcp", "=", ..] => {} // a dependency of a Cargo.toml
            ["hlcp", "charts", ref steps @ ..]
                if !steps.is_empty()
                    && steps.iter().all(|step| drawn.iter().any(|known| known == step)) => {}
            // `hlcp charts` runs these.
            ["cargo", "run", "--release", "--", name, ref rest @ ..]
            | ["hlcp", name, ref rest @ ..]
                if drawn.iter().any(|step| step == name)
                    && matches!(rest, [] | ["--quick"] | ["--out", _]) => {}
            ["cargo", "run", "--release", "--example", name] => examples::runs(name),
            ["cargo", "run", "--release", "--", ref rest @ ..] | ["hlcp", ref rest @ ..] => {
                let mut arguments = rest[1..].join(" ");
                if is_long(rest[0]) && !rest.contains(&"--quick") {
                    arguments += " --quick";
                }
                succeeded(&run_in(&folder, rest[0], &arguments), &command);
            }
            ["cargo", "install", "--locked", "hlcp-cli"]
            | ["cargo", "add", "hlcp"]
            | ["cargo", "check" | "metadata" | "publish" | "yank", ..] => {}
            ["cargo", "install", "--locked", "--path", path] => {
                assert!(root.join(path).join("Cargo.toml").exists(), "{command}");
            }
            ["cargo", "test", ref rest @ ..] if rest.contains(&"--test") => {
                let name = rest.iter().skip_while(|word| **word != "--test").nth(1);
                let name = name.unwrap_or_else(|| panic!("{command}"));
                let crates = fs::read_dir(root.join("crates")).expect("a folder of the repository");
                let of_crates = crates.map(|entry| entry.expect("an entry").path().join("tests"));
                let exists = of_crates.chain([root.join("tests")]).any(|folder| {
                    let file = folder.join(format!("{name}.rs"));
                    file.exists() || folder.join(name).join("main.rs").exists()
                });
                assert!(exists, "{command}");
            }
            ["cargo", "bench", "--bench", name, ..] => {
                assert!(root.join(format!("benches/{name}.rs")).exists(), "{command}");
            }
            ["cargo", "test" | "doc", ..]
            | ["cargo", "build", "--release", "-p", "hlcp-cli", "--features", "mpi"] => {}
            ["cargo", "build", "--release", "-p", name] | ["cargo", "tree", .., name] => {
                let known = name == "NAME" || root.join("crates").join(name).exists();
                assert!(known, "{command}");
            }
            [script, ..] if script.starts_with("scripts/") => {
                assert!(root.join(script).exists(), "{command}");
            }
            _ => panic!("no test runs `{command}`"),
        }
    }
}

#[test]
fn the_help_of_each_command_has_examples_that_work() {
    let folder = workplace("help");
    for command in options::commands().iter().filter(|command| *command != "scenes") {
        let help = succeeded(&hlcp(command, "--help").output().unwrap(), command);
        let lines = help.lines().skip_while(|line| *line != "Examples:").skip(1);
        let examples: Vec<&str> = lines.map_while(|line| line.strip_prefix("  hlcp ")).collect();
        assert_eq!(examples.len(), 2, "{command}: {examples:?}");
        for example in examples.iter().filter(|_| !is_long(command)) {
            let arguments = example.strip_prefix(command).expect("it is the command's");
            succeeded(&run_in(&folder, command, arguments), example);
        }
    }
}

#[test]
fn charts_name_commands_that_exist() {
    let charts = examples::root().join("docs/charts");
    let all = options::commands();
    let mut count = 0;
    for entry in fs::read_dir(charts).expect("a folder of the repository") {
        let path = entry.expect("an entry").path();
        if path.extension().is_none_or(|extension| extension != "svg") {
            continue;
        }
        let text = fs::read_to_string(&path).expect("a chart is text");
        // Where a line of the caption begins.
        for (at, _) in text.match_indices(">cargo ").chain(text.match_indices(">hlcp ")) {
            let command = text[at + 1..].split(['·', '<']).next().unwrap_or_default().trim();
            let words: Vec<&str> = command.split_whitespace().collect();
            match words[..] {
                ["hlcp", name, ref rest @ ..] => {
                    assert!(all.iter().any(|known| known == name), "{}: {command}", path.display());
                    let known = options::options(name);
                    for option in rest.iter().filter_map(|word| word.strip_prefix("--")) {
                        assert!(known.iter().any(|(known, _)| known == option), "{command}");
                    }
                }
                ["cargo", "bench", "--bench", name] => {
                    let path = examples::root().join(format!("benches/{name}.rs"));
                    assert!(path.exists(), "{command}");
                }
                _ => panic!("{}: `{command}` is no command", path.display()),
            }
            count += 1;
        }
    }
    assert!(count >= 20, "found only {count}");
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
