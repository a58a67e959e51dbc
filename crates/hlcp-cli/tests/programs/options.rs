//! Every option of every command: it has an effect, or it is refused; none is passed over.

use std::{collections::BTreeMap, fs, iter, process::Command};

use crate::{
    command::{hlcp, run_in, text},
    folder::{Folder, market_text},
};

/// The commands, from the help.
pub(crate) fn commands() -> Vec<String> {
    let output = Command::new(env!("CARGO_BIN_EXE_hlcp")).arg("--help").output().unwrap();
    let help = text(&output.stdout);
    let lines = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let names = lines.map_while(|line| line.split_whitespace().next().map(String::from));
    names.filter(|name| name != "help").collect()
}

/// The options of a command, from its help, and whether they take a value.
pub(crate) fn options(command: &str) -> Vec<(String, bool)> {
    let help = text(&hlcp(command, "--help").output().unwrap().stdout);
    let found = help.lines().filter_map(|line| {
        let mut words = line.strip_prefix("      --")?.split_whitespace();
        let name = words.next()?.to_owned();
        Some((name, words.next().is_some_and(|word| word.starts_with('<'))))
    });
    found.collect()
}

/// A value of each option that takes one, which changes what is computed or printed.
const OF_SOLVE: &str = "\
    --scene disc-lcp --m 7 --mu 3 --nu 3 --solution generic --nx 17 --ny 18 --dimples 2 \
    --depth 1.5 --ecc 0.4 --b-length 8 --aspect 2 --groove 30 --length 0.7 --tail 0.3 \
    --layer 2 --rate 0.05 --volatility 0.3 --maturity 0.5 --spot 1 --steps 5 --a A.mtx \
    --b B.mtx --q q.txt --grid 2x2 --x0 half.txt --z0 half.txt --r0 half.txt --method TMGS \
    --base MGS --window 3 --alpha 1.2 --beta 1.1 --alpha2 1.15 --beta2 1.2 --tau 1.3 --omega 2.5 \
    --gamma 1.7 --precision f32 --threads 2 --tol 1e-5 --rtol 1e-4 --norm linf \
    --max-iterations 2 --max-seconds 0 --out-z z.mtx --out-r r.mtx --repeats 2";

const OF_FILM: &str = "\
    --map map.csv --pad plane,4e-5,2e-5 --lx 0.05 --ly 0.02 --diameter 0.1 --length 0.05 \
    --clearance 1e-4 --lobes 2,0.3 --ecc 0.4 --attitude 20 --tilt 1e-5,1e-5 --nx 9 --ny 5 \
    --pocket 0.005,0.005,0.01,0.01,1e-5 --dimples 2,1,0.01,0.01,1e-5 --roughness rough.csv \
    --supply 0.01,0.005,0.01,0.01,1e5 --groove 30,2e5 --dam 20,80,0.03,1e-5 \
    --side north=closed --x-unit 1.1 --h-unit 1.1 --p-unit 1.1 --speed 2 --rpm 1000 \
    --viscosity 0.05 --ambient 1e5 --cavitation -1e4 --oil 950,1800 --load 1000 \
    --whirl 0.5,1 --motion motion.csv --mass 1 --refine 3 --method NEWTON --threads 2 \
    --out other --data-tolerance 1e-3";

/// Options whose effect may be on the time alone, or too small for the digits of a small problem.
const SLIGHT: [&str; 8] =
    ["grid", "threads", "repeats", "norm", "tol", "rtol", "max-iterations", "max-seconds"];

const PAD: &str = "--pad plane,4e-5,2e-5 --lx 0.05 --ly 0.02 --nx 8 --ny 4 --viscosity 0.04";
const JOURNAL: &str = "--journal --diameter 0.1 --length 0.05 --clearance 1e-4 --nx 8 --ny 4 \
                       --viscosity 0.02 --rpm 3000 --groove 0,1e5";

/// What is asked of `solve` and of `film`, to which each option is added.
fn contexts(command: &str) -> Vec<String> {
    let with = |stem: &str, more: &[&str]| -> Vec<String> {
        more.iter().map(|more| format!("{stem} {more}")).collect()
    };
    if command == "film" {
        let moved = ["--speed 3", "--speed 3 --motion motion.csv --json"];
        let mut all = with("", &["", "profile.csv --speed 3 --viscosity 0.04"]);
        all.extend(with(PAD, &moved));
        all.extend(with(PAD, &["--speed 3 --motion loads.csv --mass 1", "--speed 3 --load 900"]));
        all.extend(with(JOURNAL, &["--ecc 0.6", "--load 800", "--ecc 0.6 --coefficients --json"]));
        all.extend(with(JOURNAL, &["--motion whirl.csv", "--motion loads3.csv --mass 1 --json"]));
        return all;
    }
    let scenes = [
        "example1 --m 8",
        "disc-hlcp --m 8",
        "journal-bearing --nx 7 --ny 8",
        "obstacle --m 8",
        "spiral --m 8",
        "bessel --m 8",
        "dam --nx 7 --ny 8",
        "bearing2d --nx 7 --ny 9",
        "film --nx 16 --ny 16",
        "slider --m 20",
        "american-put --m 6",
    ];
    let methods = ["--method ANDERSON --json", "--method TMAOR --alpha 1.1 --beta 1 --json"];
    let mut all = with("--m 8", &methods);
    let plain = ["", "--method MGS --json"];
    all.extend(scenes.iter().flat_map(|scene| with(&format!("--scene {scene}"), &plain)));
    all.extend(with("--a A.mtx --q q.txt", &["", "--method FMG --json", "--method MGS --json"]));
    all.extend(with("--a A.mtx --q q.txt --method MGS", &["--x0 half.txt", "--b B.mtx"]));
    all.push("--a A.mtx --q q.txt --method MGS --json --z0 half.txt --r0 half.txt".into());
    all
}

/// What a run comes to: nothing if it was refused, as it must be, in one line.
type Found = Option<(Option<i32>, String, BTreeMap<String, Vec<u8>>)>;

/// A folder with the files that the options name, and what runs in it have come to.
struct Place {
    folder: Folder,
    inputs: Vec<String>,
}

impl Place {
    fn new(name: &str) -> Self {
        let folder = Folder::new(name);
        let matrix = |diagonal: f64| {
            let places = (0..16).map(|k| (k / 4, k % 4)).filter(|(i, j)| i == j || i + j != 3);
            let entry = |(i, j)| (i, j, if i == j { diagonal } else { -1.0 });
            market_text(4, &places.map(entry).collect::<Vec<_>>())
        };
        let files = [
            ("A.mtx", matrix(4.0)),
            ("B.mtx", matrix(4.5)),
            ("q.txt", "1\n-2\n3\n-1\n".into()),
            ("half.txt", "0.5\n".repeat(4)),
            ("map.csv", "4e-5,3.5e-5,3e-5\n4e-5,3e-5,2e-5\n".into()),
            ("rough.csv", "0,1e-6,0,0,1e-6,0,0,0\n".repeat(4)),
            ("profile.csv", "0 4e-5\n0.025 3e-5\n0.05 2e-5\n".into()),
            ("motion.csv", "0,0\n0.001,-1e-6\n".into()),
            ("whirl.csv", "0,0,0\n0.001,1e-6,1e-6\n".into()),
            ("loads.csv", "0,100\n0.001,120\n".into()),
            ("loads3.csv", "0,100,0\n0.001,120,10\n".into()),
        ];
        let inputs = files.iter().map(|(name, _)| (*name).to_owned()).collect();
        files.into_iter().for_each(|(name, text)| drop(folder.write(name, text)));
        Self { folder, inputs }
    }

    fn run(&self, command: &str, arguments: &str) -> Found {
        let output = run_in(&self.folder.0, command, arguments);
        let (out, err) = (text(&output.stdout), text(&output.stderr));
        let mut files = BTreeMap::new();
        for folder in [self.folder.0.clone(), self.folder.0.join("target")] {
            for entry in fs::read_dir(folder).into_iter().flatten() {
                let path = entry.unwrap().path();
                let name = path.file_name().unwrap().to_str().unwrap().to_owned();
                if path.is_file() && !self.inputs.contains(&name) {
                    files.insert(name, fs::read(&path).unwrap());
                    fs::remove_file(path).unwrap();
                }
            }
        }
        if output.status.code() == Some(1) {
            let asked = format!("{command} {arguments}");
            assert!(out.is_empty() && files.is_empty(), "{asked}: {out} {files:?}");
            assert_eq!(err.lines().count(), 1, "{asked}: {err}");
            assert!(err.starts_with("error: "), "{asked}: {err}");
            return None;
        }
        // Without times: the entry of a JSON object, words before a second, a table's last word.
        let timeless = |line: &str| {
            if line.starts_with('{') {
                let entries = line.split(',').filter(|entry| !entry.starts_with("\"seconds\""));
                return entries.collect::<Vec<_>>().join(",");
            }
            let words: Vec<&str> = line.split_whitespace().collect();
            let is_time =
                |k: usize| words.get(k + 1).is_some_and(|next| ["s;", "s),"].contains(next));
            let is_row = command == "solve" && !line.starts_with(' ');
            let last = words.len() - usize::from(is_row);
            (0..last).filter(|&k| !is_time(k)).map(|k| words[k]).collect::<Vec<_>>().join(" ")
        };
        let out: Vec<String> = out.lines().map(timeless).collect();
        Some((output.status.code(), out.join("\n"), files))
    }
}

/// The options of a command with a value each; the table has every one.
fn valued(command: &str) -> Vec<(String, String)> {
    let table = if command == "film" { OF_FILM } else { OF_SOLVE };
    let mut words = table.split_whitespace();
    let values: BTreeMap<&str, &str> =
        iter::from_fn(|| Some((words.next()?.trim_start_matches('-'), words.next()?))).collect();
    let pair = |(option, takes): (String, bool)| {
        if !takes {
            return (option, String::new());
        }
        let value = values.get(&*option).map(|value| (*value).to_owned());
        let value = value.unwrap_or_else(|| panic!("{command} --{option} is not in the table"));
        (option, value)
    };
    options(command).into_iter().map(pair).collect()
}

/// What is asked, but for an option and its value.
fn without(asked: &str, option: &str) -> String {
    let start = format!("{option} ");
    let parts: Vec<&str> = asked.split("--").filter(|part| !part.starts_with(&start)).collect();
    parts.join("--").trim_end().to_owned()
}

#[test]
fn an_option_has_an_effect_or_is_refused() {
    for command in ["solve", "film"] {
        let place = Place::new(&format!("options-{command}"));
        let (mut effective, mut ignored) = (vec![], vec![]);
        let all = valued(command);
        for context in contexts(command) {
            let plain = place.run(command, &context);
            assert!(command == "film" || plain.is_some(), "{command} {context}");
            for (option, value) in &all {
                let rest = without(&context, option);
                let asked = format!("{rest} --{option} {value}");
                let same = format!("--{option} {value}");
                if format!("{context} ").contains(&format!("{} ", same.trim_end())) {
                    continue;
                }
                let found = place.run(command, &asked);
                if found.is_some() && found != plain {
                    effective.push(option.clone());
                    let between = if value.is_empty() { '=' } else { ' ' };
                    let nonsense = format!("{rest} --{option}{between}/dev/null/nonsense");
                    assert_eq!(place.run(command, &nonsense), None, "{command} {nonsense}");
                }
                if found.is_some() && found == plain && !SLIGHT.contains(&option.as_str()) {
                    ignored.push(asked);
                }
            }
        }
        assert!(ignored.is_empty(), "ignored by {command}:\n{}", ignored.join("\n"));
        for (option, _) in all {
            // Of a pair that is given together, or of what a context has.
            let paired = ["z0", "r0", "a", "q", "map", "pad", "journal", "diameter", "length"];
            let paired = [&paired[..], &["clearance", "lx", "ly", "mass", "motion"]].concat();
            let is_known = effective.contains(&option) || SLIGHT.contains(&option.as_str());
            assert!(is_known || paired.contains(&option.as_str()), "{command} --{option}: where?");
        }
    }
}

/// An option that is refused alone, for want of another, stays refused beside what that other
/// cannot be used with.
#[test]
fn what_an_option_requires_is_required_in_every_company() {
    for (command, context) in [("solve", "--m 8"), ("film", "")] {
        let place = Place::new(&format!("pairs-{command}"));
        let all: Vec<(String, Found)> = valued(command)
            .into_iter()
            .map(|(option, value)| {
                let asked = format!("{context} --{option} {value}");
                let found = place.run(command, &asked);
                (asked, found)
            })
            .collect();
        let (refused, taken): (Vec<_>, Vec<_>) = all.into_iter().partition(|(_, f)| f.is_none());
        for (lone, _) in &refused {
            for (company, alone) in &taken {
                let both = format!("{company} {}", lone.strip_prefix(context).unwrap());
                let found = place.run(command, &both);
                assert!(found.is_none() || found != *alone, "{command} {both}: ignored");
            }
        }
    }
}

#[test]
fn nonsense_is_refused_by_every_command() {
    let place = Place::new("nonsense");
    let all = commands();
    assert_eq!(all.len(), 12, "{all:?}");
    for command in &all {
        let options = options(command);
        for (option, takes) in options {
            let asked = match (takes, option.as_str()) {
                // They run for a minute before they write.
                (true, "out" | "tables") if !["solve", "film"].contains(&command.as_str()) => {
                    format!("--{option}")
                }
                (true, _) => format!("--{option} /dev/null/nonsense"),
                (false, _) => format!("--{option}=/dev/null/nonsense"),
            };
            assert_eq!(place.run(command, &asked), None, "{command} {asked}");
        }
        assert_eq!(place.run(command, "--nonsense"), None, "{command}");
    }
    let of_names = ["--problems 3 rings-7", "--seed 3 rings-7", "--quick rings-7"];
    for asked in of_names.into_iter().chain(["--quick --problems 3", "--quick --seed 3"]) {
        assert_eq!(place.run("families", asked), None, "{asked}");
    }
}
