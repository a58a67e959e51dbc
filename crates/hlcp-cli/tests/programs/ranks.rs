//! `mpirun -n 4 hlcp solve` comes to the bits of one process, where an MPI is installed.

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

use serde_json::Value;

use crate::command::{solve, text};

/// Solves on so many processes.
fn on_ranks(ranks: usize, arguments: &str) -> Output {
    let oversubscribed = ["--allow-run-as-root", "--oversubscribe"];
    Command::new("mpirun")
        .args(oversubscribed)
        .args(["-n", &ranks.to_string(), env!("CARGO_BIN_EXE_hlcp"), "solve"])
        .args(arguments.split_whitespace())
        .output()
        .expect("mpirun starts: install Open MPI, or test without the feature mpi")
}

/// The numbers of a solve that do not depend on time.
fn numbers(output: &Output, arguments: &str) -> Value {
    let mut object: Value = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|e| panic!("{arguments}: {e}: {}", text(&output.stderr)));
    object["seconds"] = Value::Null;
    object
}

#[test]
fn processes_come_to_the_bits_of_one() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ranks");
    fs::create_dir_all(&folder).unwrap();
    let [z, r] = ["z.mtx", "r.mtx"].map(|name| folder.join(name).display().to_string());
    let write = format!("--out-z {z} --out-r {r}");
    for (arguments, threads) in [
        ("--scene example1 --m 1030 --method TMGS --max-iterations 4", 1),
        ("--scene disc-hlcp --m 1030 --method AMRBSOR --alpha 1.9 --max-iterations 5", 1),
        ("--scene journal-bearing --nx 1100 --ny 9 --method ADAPTIVE --max-iterations 40", 1),
        ("--scene bearing2d --nx 1100 --ny 21 --method ANDERSON --max-iterations 12", 2),
        ("--scene obstacle --m 1032 --method AMGS --precision f32 --max-iterations 3", 1),
        ("--scene disc-lcp --m 1030 --method MGW --max-iterations 2", 1),
        ("--scene bearing2d --nx 1100 --ny 61 --method FMG --max-iterations 3", 2),
        ("--scene disc-lcp --m 1024 --method AUTO --precision f32 --max-iterations 10", 1),
    ] {
        let arguments = format!("{arguments} --json --threads {threads}");
        let arguments =
            if arguments.contains("bearing") { format!("{arguments} {write}") } else { arguments };
        let written = || [&z, &r].map(|path| fs::read(path).unwrap_or_default());
        let alone = (numbers(&solve(&arguments), &arguments), written());
        for ranks in 1..=4 {
            let together = (numbers(&on_ranks(ranks, &arguments), &arguments), written());
            assert_eq!(together.0, alone.0, "{ranks} ranks: {arguments}");
            assert!(together.1 == alone.1, "{ranks} ranks: {arguments}");
        }
    }
    // An answer of three ranks is the start of two, and of one.
    let scene = "--scene bearing2d --nx 1100 --ny 9 --method TMGS --json";
    on_ranks(3, &format!("{scene} --max-iterations 3 --out-z {z} --out-r {r}"));
    let resume = format!("{scene} --z0 {z} --r0 {r} --max-iterations 2");
    assert_eq!(numbers(&on_ranks(2, &resume), &resume), numbers(&solve(&resume), &resume));
}

#[test]
fn what_one_process_alone_can_do_is_refused() {
    for (arguments, reason) in [
        ("--scene disc-lcp --m 600 --method NEWTON", "works on one rank, but 2 share the problem"),
        ("--scene disc-lcp --m 600 --method AMG", "works on one rank, but 2 share the problem"),
        ("--scene film --nx 520 --ny 33 --method MGS", "film works on one process"),
        ("--scene slider --method TMGS", "slider works on one process"),
        ("--scene disc-lcp --m 600 --method TMGS --certify", "--certify works on one process"),
        ("--scene disc-lcp --m 300 --method TMGS", "at most one for every 256 columns"),
    ] {
        let output = on_ranks(if arguments.contains("300") { 3 } else { 2 }, arguments);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{arguments}: {said}");
        assert!(said.contains("error: "), "{arguments}: {said}");
        assert!(said.contains(reason), "{arguments}: {said}");
    }
}
