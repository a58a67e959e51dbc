//! Outputs and inputs of the programs: devices, links and inputs are not replaced, a FIFO does not
//! block, text from a file is printed harmlessly, and a reader may go away.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
    sync::mpsc,
    thread,
    time::Duration,
};

use hlcp::{files, market};

use crate::{
    command::{hlcp, is_refusal, run_in, succeeded, text},
    folder::Folder,
};

/// A folder with a sound A, q and x0 of order 2 and a profile, named so, and precious text in `z`
/// and `r`.
fn sound(name: &str) -> Folder {
    let folder = Folder::new(name);
    folder.write("A", "%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 4\n2 2 3\n");
    folder.write("q", "-1\n2\n");
    folder.write("x0", "0.5\n0.25\n");
    folder.write("profile", "0 3e-5\n0.01 2e-5\n");
    folder.write("z", "precious z");
    folder.write("r", "precious r");
    folder
}

fn solve(folder: &Folder, more: &str) -> Output {
    run_in(&folder.0, "solve", &format!("{SOLVE} {more}"))
}

/// The names in a folder and what is there: the text of a file, the target of a link, or nothing.
fn content(folder: &Path) -> Vec<(PathBuf, Option<Vec<u8>>)> {
    let look = |entry: fs::DirEntry| {
        let path = entry.path();
        let kind = entry.file_type().unwrap();
        let link = fs::read_link(&path).ok().map(|to| to.into_os_string().into_encoded_bytes());
        let text = if kind.is_file() { fs::read(&path).ok() } else { link };
        (path, text)
    };
    let mut content: Vec<_> = fs::read_dir(folder).unwrap().map(|e| look(e.unwrap())).collect();
    content.sort();
    content
}

/// Refused in one line before the solve, with nothing printed and every file as it was; the line.
fn refused(folder: &Folder, name: &str, arguments: &str, named: &[&str]) -> String {
    let before = content(&folder.0);
    let output = run_in(&folder.0, name, arguments);
    named.iter().for_each(|named| drop(is_refusal(&output, arguments, named)));
    assert_eq!(content(&folder.0), before, "{arguments}");
    text(&output.stderr)
}

const SOLVE: &str = "--a A --q q --method MGS";
const FILM: &str = "profile --speed 3.7 --viscosity 0.041";

#[test]
fn an_input_is_not_written_over() {
    let folder = sound("inputs");
    for (more, named) in [
        ("--out-z A", "--out-z A would overwrite the file of --a"),
        ("--out-r ./q", "--out-r ./q would overwrite the file of --q"),
        ("--b A --out-r A", "--out-r A would overwrite the file of --a"),
        ("--x0 x0 --out-z z --out-r x0", "--out-r x0 would overwrite the file of --x0"),
        ("--x0 none --out-z none", "--out-z none would overwrite the file of --x0"),
    ] {
        refused(&folder, "solve", &format!("{SOLVE} {more}"), &[named]);
    }
    let beside = format!("--out-z ../{}/q", folder.0.file_name().unwrap().to_str().unwrap());
    refused(&folder, "solve", &format!("{SOLVE} {beside}"), &["would overwrite the file of --q"]);
    fs::hard_link(folder.0.join("q"), folder.0.join("twin")).unwrap();
    #[cfg(unix)]
    {
        use std::os::unix::fs::symlink;
        symlink(".", folder.0.join("here")).unwrap();
        symlink("q", folder.0.join("link")).unwrap();
        for (arguments, named) in [
            (format!("{SOLVE} --out-z twin"), "--out-z twin would overwrite the file of --q"),
            (format!("{SOLVE} --out-z here/A"), "--out-z here/A would overwrite the file of --a"),
            (format!("{SOLVE} --out-z link"), "--out-z link would overwrite the file of --q"),
            (
                SOLVE.replace("--q q", "--q link --out-r q"),
                "--out-r q would overwrite the file of --q",
            ),
        ] {
            refused(&folder, "solve", &arguments, &[named]);
        }
    }
}

#[test]
fn one_file_is_not_two_outputs() {
    let folder = sound("same");
    let mut pairs = vec![("z", "z"), ("./z", "z"), ("new", "./new")];
    fs::create_dir(folder.0.join("sub")).unwrap();
    pairs.push(("sub/../new", "new"));
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("sub", folder.0.join("short")).unwrap();
        fs::hard_link(folder.0.join("z"), folder.0.join("twin")).unwrap();
        pairs.extend([("short/new", "sub/new"), ("twin", "z")]);
    }
    for (z, r) in pairs {
        let both = "--out-z and --out-r name the same file";
        refused(&folder, "solve", &format!("{SOLVE} --out-z {z} --out-r {r}"), &[both]);
        let (z, r) = (folder.0.join(z), folder.0.join(r));
        let error = market::write_vectors(&[(&z, &[1.0]), (&r, &[2.0])]).unwrap_err();
        assert!(error.reason.contains("the same file"), "{error}");
    }
    assert_eq!(fs::read_to_string(folder.0.join("z")).unwrap(), "precious z");
}

#[test]
#[cfg(unix)]
fn what_is_no_regular_file_is_not_replaced() {
    use std::os::unix::{fs::symlink, net::UnixListener};

    let folder = sound("special");
    fs::create_dir(folder.0.join("folder")).unwrap();
    fifo(&folder.0.join("fifo"));
    let _listener = UnixListener::bind(folder.0.join("socket")).unwrap();
    symlink("x0", folder.0.join("link")).unwrap();
    symlink("nowhere", folder.0.join("dangling")).unwrap();
    for (name, kind) in [
        ("folder", "is a directory"),
        ("fifo", "is a FIFO"),
        ("socket", "is a socket"),
        ("link", "is a symbolic link to x0; an output is a new file or a regular one"),
        ("dangling", "is a symbolic link"),
        // In a file system without room for files of one's own, in case the program is wrong.
        ("/dev/pts/ptmx", "is a device"),
        ("folder/", "is a directory"),
        ("new/", "ends in no file's name"),
        ("..", "is a directory"),
    ] {
        if name.starts_with('/') && !Path::new(name).exists() {
            continue;
        }
        for more in [
            format!("--out-z {name}"),
            format!("--out-z z --out-r {name}"),
            format!("--out-r {name}"),
        ] {
            refused(&folder, "solve", &format!("{SOLVE} {more}"), &[name, kind]);
        }
    }
    symlink("z", folder.0.join("film.svg")).unwrap();
    fifo(&folder.0.join("pipe.csv"));
    symlink("profile", folder.0.join("same.csv")).unwrap();
    fs::hard_link(folder.0.join("profile"), folder.0.join("twin.svg")).unwrap();
    for (out, kind) in [
        ("film", "film.svg: is a symbolic link"),
        ("./pipe", "./pipe.csv: is a FIFO"),
        ("same", "--out would overwrite the profile, same.csv"),
        ("twin", "--out would overwrite the profile, twin.svg"),
    ] {
        refused(&folder, "film", &format!("{FILM} --out {out}"), &[kind]);
    }
}

#[cfg(unix)]
fn fifo(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().expect("mkfifo").success());
}

#[cfg(unix)]
#[test]
fn what_cannot_be_written_is_refused_before_the_solve_with_the_systems_reason() {
    let folder = sound("unwritable");
    let long = "n".repeat(300);
    let mut cases = vec![
        ("none/z".to_owned(), "cannot be written: No such file or directory"),
        ("A/z".into(), "cannot be written: Not a directory"),
        (long, "cannot be written: File name too long"),
    ];
    if cfg!(target_os = "linux") {
        // Root cannot write there either.
        cases.push(("/proc/z".into(), "cannot be written: No such file or directory"));
        cases.push(("/sys/z".into(), "/sys/z: cannot be written: "));
    }
    for (path, reason) in cases {
        // As many iterations as would be noticed, and a table that would be printed.
        let hard = format!("--m 400 --method MGS --tol 0 --out-z z --out-r {path}");
        refused(&folder, "solve", &hard, &[reason]);
        let error = market::write_vectors(&[(&folder.0.join(&path), &[1.0])]).unwrap_err();
        assert!(error.to_string().contains("cannot be written: "), "{error}");
    }
    refused(&folder, "film", &format!("{FILM} --out A/film"), &["A: "]);
    if cfg!(target_os = "linux") {
        refused(&folder, "film", &format!("{FILM} --out /proc/film"), &["/proc/film.svg: cannot"]);
    }
}

#[test]
#[cfg(unix)]
fn permissions_are_kept_and_what_is_read_only_is_spared() {
    use std::os::unix::fs::PermissionsExt;

    let folder = sound("permissions");
    let chmod = |name: &str, mode| {
        fs::set_permissions(folder.0.join(name), fs::Permissions::from_mode(mode))
    };
    let mode = |name: &str| fs::metadata(folder.0.join(name)).unwrap().permissions().mode() & 0o777;
    chmod("z", 0o640).unwrap();
    chmod("r", 0o600).unwrap();
    assert!(solve(&folder, "--out-z z --out-r r").status.success());
    assert_eq!((mode("z"), mode("r")), (0o640, 0o600));

    // Root may write to both; to others they are refused.
    chmod("z", 0o440).unwrap();
    fs::create_dir(folder.0.join("closed")).unwrap();
    chmod("closed", 0o555).unwrap();
    for (path, opened) in [
        ("z", fs::OpenOptions::new().write(true).open(folder.0.join("z"))),
        ("closed/z", fs::File::create(folder.0.join("closed/z"))),
    ] {
        if opened.is_err() {
            let reason = [path, "cannot be written: Permission denied"];
            refused(&folder, "solve", &format!("{SOLVE} --out-r r --out-z {path}"), &reason);
        } else {
            assert!(solve(&folder, &format!("--out-z {path}")).status.success());
        }
    }
    chmod("closed", 0o755).unwrap();
}

/// Each of three writes fails in turn, which leaves all files as they were, or its rename does
/// because a folder came into its place, which leaves those after it.
#[test]
fn files_are_replaced_once_all_are_written() {
    for failing in 0..3 {
        for by_rename in [false, true] {
            let folder = sound(&format!("together-{failing}-{by_rename}"));
            // One that exists, one that does not, one that exists.
            let paths = ["z", "new", "r"].map(|name| folder.0.join(name));
            let outputs: Vec<(&Path, usize)> =
                paths.iter().map(PathBuf::as_path).zip(0..).collect();
            let mut before = content(&folder.0);
            let error = files::write_together(&outputs, |&k, file| {
                writeln!(file, "file {k}")?;
                if k != failing {
                    return Ok(());
                }
                if !by_rename {
                    return Err(std::io::Error::other("the disc is full"));
                }
                let _ = fs::remove_file(&paths[k]);
                fs::create_dir(&paths[k])
            });
            let error = error.unwrap_err();
            assert_eq!(error.path, paths[failing]);
            let reason = if by_rename { "cannot be written: " } else { "the disc is full" };
            assert!(error.reason.contains(reason), "{error}");
            if by_rename {
                before.retain(|(path, _)| !paths[..=failing].contains(path));
                let text = |k: usize| (k < failing).then(|| format!("file {k}\n").into_bytes());
                before.extend((0..=failing).map(|k| (paths[k].clone(), text(k))));
                before.sort();
            }
            assert_eq!(content(&folder.0), before, "{failing} {by_rename}");
        }
    }
    let folder = sound("together");
    let paths = ["z", "new", "r"].map(|name| folder.0.join(name));
    let outputs: Vec<(&Path, usize)> = paths.iter().map(PathBuf::as_path).zip(0..).collect();
    files::write_together(&outputs, |k, file| write!(file, "file {k}")).unwrap();
    for (path, k) in outputs {
        assert_eq!(fs::read_to_string(path).unwrap(), format!("file {k}"));
    }
    assert_eq!(content(&folder.0).len(), 7);
}

/// A file that is in the way of a temporary one is left alone.
#[test]
fn temporary_names_that_are_taken_are_left_alone() {
    let folder = sound("taken");
    // More than all tests of this file take.
    let stale = |k| format!(".hlcp-{}-{k}.partial", std::process::id());
    for k in 0..500 {
        folder.write(stale(k), "stale");
    }
    let (z, r) = (folder.0.join("z"), folder.0.join("r"));
    market::write_vectors(&[(&z, &[1.0][..]), (&r, &[2.0])]).unwrap();
    assert_eq!(market::read_vector::<f64>(&r, 1).unwrap(), [2.0]);
    for k in 0..500 {
        assert_eq!(fs::read_to_string(folder.0.join(stale(k))).unwrap(), "stale");
    }
    assert_eq!(content(&folder.0).len(), 6 + 500);
}

#[test]
#[cfg(unix)]
fn an_input_that_is_no_regular_file_does_not_block() {
    let folder = sound("blocking");
    fifo(&folder.0.join("fifo"));
    for (name, kind) in
        [("fifo", "is a FIFO"), ("/dev/zero", "is a device"), (".", "is a directory")]
    {
        for (option, others) in
            [("a", "--q q"), ("b", "--a A --q q"), ("q", "--a A"), ("x0", "--a A --q q")]
        {
            let asked = format!("{others} --{option} {name} --method MGS --out-z z");
            let mut command = hlcp("solve", &asked);
            command.current_dir(&folder.0);
            let (done, output) = mpsc::channel();
            thread::spawn(move || done.send(command.output().unwrap()));
            // A minute is a program that waits for the other end of the FIFO.
            let output = output.recv_timeout(Duration::from_secs(60)).expect("an answer");
            let wanted = format!("{name}: {kind}; give a regular file instead\n");
            is_refusal(&output, &asked, &wanted);
        }
    }
    assert_eq!(fs::read_to_string(folder.0.join("z")).unwrap(), "precious z");
}

/// Characters that write over a line, change a title or turn the direction of writing.
const HOSTILE: &str =
    "\u{1b}]0;title\u{7}\u{1b}[2J\rfine\u{2028}\u{202e}\u{2066}\u{200b}\u{9b}3m\u{7f}";

/// A line of at most `most` characters, all of which print.
fn harmless(err: &str, most: usize) {
    let line = err.strip_suffix('\n').unwrap_or(err);
    assert!(line.chars().count() <= most, "{} characters", line.chars().count());
    let bad = |c: char| {
        c.is_control() || c.is_whitespace() && c != ' ' || "\u{202e}\u{2066}\u{200b}".contains(c)
    };
    assert!(!line.contains(bad), "{line:?}");
}

#[test]
fn what_a_file_holds_is_shown_in_part_and_escaped() {
    let folder = sound("hostile");
    let head = "%%MatrixMarket matrix coordinate real general\n";
    let long = "7x".repeat(30_000);
    for bad in [HOSTILE, &long, &format!("{HOSTILE}{long}")] {
        let word: String = bad.chars().filter(|c| !c.is_whitespace()).collect();
        for text in [
            format!("{bad}\n2 2 2\n1 1 4\n2 2 3\n"),
            format!("{head}{word} 2 2\n1 1 4\n2 2 3\n"),
            format!("{head}2 2 2 {word}\n1 1 4\n2 2 3\n"),
            format!("{head}2 2 2\n1 1 {word}\n2 2 3\n"),
            format!("{head}2 2 2\n1 1 4\n2 2 3\n{bad}\n"),
        ] {
            folder.write("bad", text);
            let asked = "--a bad --q q --method MGS";
            harmless(&refused(&folder, "solve", asked, &["bad, line "]), 250);
        }
        for text in [format!("{bad}\n1\n"), format!("1\n{word}\n"), format!("1\n2\n{bad}\n")] {
            folder.write("bad", text);
            let asked = "--a A --q bad --method MGS";
            harmless(&refused(&folder, "solve", asked, &["bad, line "]), 250);
        }
        folder.write("profile", format!("0 1\n1 {}\n", word.replace(';', "")));
        harmless(&refused(&folder, "film", FILM, &["profile, line 2: column 2: '"]), 250);
    }
    folder.write("bad", format!("{head}2 2 2\n1 1 \u{1b}[31mred\n2 2 3\n"));
    let red = "bad, line 3: '\\u{1b}[31mred' is no number for 'value'";
    refused(&folder, "solve", "--a bad --q q --method MGS", &[red]);
}

#[test]
#[cfg(unix)]
fn names_of_files_are_printed_escaped() {
    let folder = sound("names");
    let name = format!("{HOSTILE}\n.mtx");
    let run = |program: &str, arguments: &str| {
        // A word with blanks of its own.
        let words = arguments.split(' ').map(|word| word.replace("NAME", &name));
        hlcp(program, "").current_dir(&folder.0).args(words).output().unwrap()
    };
    let refused = |program: &str, arguments: &str, most: usize| {
        let output = run(program, arguments);
        let err = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{err}");
        assert!(err.contains(r"\rfine\u{2028}\u{202e}\u{2066}\u{200b}\u{9b}3m"), "{err}");
        harmless(&err, most);
    };
    refused("solve", "--a NAME --q q", 250);
    folder.write(&name, "nothing\n");
    refused("solve", "--a NAME --q q", 350);
    refused("solve", "--a NAME --q q --out-z NAME --method MGS", 250);
    refused("solve", "--a A --q q --out-z none/NAME --method MGS", 250);
    refused("solve", "--a A --q q NAME", 300);
    refused("film", "NAME --speed 1 --viscosity 1", 250);
    refused("film", "NAME --speed 1 --viscosity 1 --out A/NAME", 250);
    refused("film", "NAME --speed 1 --viscosity 1 NAME", 250);

    let printed = succeeded(&run("film", &format!("{FILM} --out NAME")), "--out NAME");
    let last = printed.lines().last().unwrap();
    assert!(last.starts_with(r"wrote \u{1b}]0;title"), "{last}");
    harmless(last, 300);
}

/// A reader that has gone away before the first line: no panic, no message, and the files are
/// written all the same.
#[test]
fn a_reader_that_goes_away_ends_a_program_quietly() {
    let folder = sound("pipe");
    let gone = |name: &str, arguments: &str| {
        let mut command = hlcp(name, arguments);
        command.current_dir(&folder.0);
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = command.stdout(writer).stderr(Stdio::piped()).output().unwrap();
        assert_eq!(text(&output.stderr), "", "{name} {arguments}");
        assert_eq!(output.status.code(), Some(0), "{name} {arguments}");
    };
    gone("solve", "--help");
    gone("solve", "--m 4");
    gone("solve", "--m 4 --method MGS --certify --json");
    gone("solve", &format!("{SOLVE} --out-z z --out-r r"));
    assert!(market::read_vector::<f64>(&folder.0.join("z"), 2).is_ok());
    assert!(market::read_vector::<f64>(&folder.0.join("r"), 2).is_ok());
    gone("film", "--help");
    gone("film", "");
    gone("film", FILM);
    gone("scenes", "");
    gone("--version", "");
    for name in ["gallery", "paper", "comparison", "speed-vs-accuracy", "stability-map"] {
        gone(name, "--help");
    }
    gone("gallery", "--out gallery");
    let names = content(&folder.0);
    assert!(!names.iter().any(|(path, _)| path.to_string_lossy().contains("partial")), "{names:?}");
}
