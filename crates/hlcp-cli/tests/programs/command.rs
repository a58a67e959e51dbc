//! The command `hlcp`, run as a user runs it.

use std::{
    collections::BTreeMap,
    path::Path,
    process::{Command, Output},
};

use serde_json::Value;

/// The command with a subcommand and its arguments.
pub(crate) fn hlcp(subcommand: &str, arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hlcp"));
    command.arg(subcommand).args(arguments.split_whitespace());
    command
}

/// Runs a command in a folder.
pub(crate) fn run_in(folder: &Path, subcommand: &str, arguments: &str) -> Output {
    hlcp(subcommand, arguments).current_dir(folder).output().expect("the command starts")
}

/// Runs `hlcp solve`.
pub(crate) fn solve(arguments: &str) -> Output {
    hlcp("solve", arguments).output().expect("the command starts")
}

pub(crate) fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("the output is UTF-8")
}

/// What a command has printed, which must succeed.
pub(crate) fn succeeded(output: &Output, asked: &str) -> String {
    assert_eq!(output.status.code(), Some(0), "{asked}: {}", text(&output.stderr));
    text(&output.stdout)
}

/// A number of a JSON object.
pub(crate) fn number(object: &Value, key: &str) -> f64 {
    object[key].as_f64().unwrap_or_else(|| panic!("no {key} in {object}"))
}

/// Holds a number to another one but for a part of it.
#[track_caller]
pub(crate) fn near(found: f64, wanted: f64, part: f64) {
    approx::assert_relative_eq!(found, wanted, epsilon = 0.0, max_relative = part);
}

/// The rows of a CSV file, without the first ones.
pub(crate) fn rows(path: &Path, heads: usize) -> Vec<Vec<f64>> {
    let csv = std::fs::read_to_string(path).expect("a file of numbers");
    let row = |line: &str| line.split(',').map(|v| v.parse().expect("a number")).collect();
    csv.lines().skip(heads).map(row).collect()
}

/// The one JSON object on stdout, and the exit status.
pub(crate) fn json(arguments: &str) -> (Value, i32) {
    let output = solve(arguments);
    let value = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|e| panic!("{arguments}: {e}: {}", text(&output.stderr)));
    (value, output.status.code().expect("not killed"))
}

/// Holds that `hlcp solve` is refused.
pub(crate) fn refused(arguments: &str, named: &str) {
    is_refusal(&solve(arguments), arguments, named);
}

/// Returns the line on stderr that names `named`; with it come status 1 and nothing on stdout.
pub(crate) fn is_refusal(output: &Output, asked: &str, named: &str) -> String {
    let err = text(&output.stderr);
    let found = (output.status.code(), text(&output.stdout), err.lines().count());
    assert_eq!(found, (Some(1), String::new(), 1), "{asked}: {err}");
    assert!(err.contains(named), "{asked}: '{named}' is not in {err}");
    err
}

/// What cannot be written is an error that names it, also of help and pictures.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_told() {
    use std::fs::File;
    let full = || File::options().write(true).open("/dev/full").expect("Linux has it");
    for arguments in ["--help", "--version", "--version --verbose", "solve --help", "solve --m 8"] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_hlcp"));
        let output = command.args(arguments.split(' ')).stdout(full()).output().unwrap();
        is_refusal(&output, arguments, "error: No space left on device");
    }
    for (arguments, file) in [("gallery --out", "gallery-"), ("families rings-1 --out", "families")]
    {
        // A folder in the place of a file can be written as little as a full disk.
        let out = crate::folder::Folder::new("full");
        std::fs::create_dir(out.0.join("gallery-slider.svg")).unwrap();
        std::fs::create_dir(out.0.join("families.csv")).unwrap();
        let (name, rest) = arguments.split_once(' ').unwrap();
        let output = hlcp(name, rest).arg(&out.0).output().unwrap();
        let err = text(&output.stderr);
        assert_eq!((output.status.code(), err.lines().count()), (Some(1), 1), "{arguments}: {err}");
        assert!(err.contains(file), "{arguments}: {err}");
    }
}

#[test]
fn the_version_says_more_when_asked() {
    let run = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_hlcp")).args(arguments).output().unwrap();
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    };
    let name = concat!("hlcp ", env!("CARGO_PKG_VERSION"), "\n");
    assert_eq!(run(&["--version"]), (Some(0), name.to_owned(), String::new()));
    let (status, all, _) = run(&["--version", "--verbose"]);
    assert_eq!((status, &all), (Some(0), &run(&["--verbose", "-V"]).1));
    let rest: BTreeMap<&str, &str> = all
        .strip_prefix(name)
        .unwrap()
        .lines()
        .map(|line| line.split_once(": ").unwrap())
        .collect();
    assert_eq!(rest["threads"], std::thread::available_parallelism().unwrap().to_string());
    assert_eq!(rest["features"], if cfg!(feature = "mpi") { "mpi" } else { "none" });
    assert!(rest["target"].starts_with(std::env::consts::ARCH), "{all}");
    if let Ok(cpu) = std::fs::read_to_string("/proc/cpuinfo")
        && cfg!(target_arch = "x86_64")
    {
        let flags: Vec<&str> = cpu.split_whitespace().collect();
        let sets = ["avx2", "fma", "avx512f"].into_iter().filter(|set| flags.contains(set));
        let sets: Vec<&str> = sets.collect();
        let sets = if sets.is_empty() { "none".to_owned() } else { sets.join(" ") };
        assert_eq!(rest["instruction sets"], sets);
    }
    let (status, out, err) = run(&["--verbose", "solve", "--m", "8"]);
    assert!((status, out.as_str()) == (Some(1), "") && err.contains("--version"), "{err}");
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
