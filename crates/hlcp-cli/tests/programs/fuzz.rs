//! Readers against damaged input: Matrix Market, CSV and NPY files, names of methods, and the
//! program's files and options.
//!
//! Sound input is damaged at random, in bytes, words and lines. Whatever comes of it, a reader does
//! not panic, takes no memory that the length of its file does not explain, and refuses in one
//! line. `HLCP_FUZZ=100` takes 100 times as many cases as the gate.

use std::{
    fs,
    path::{Path, PathBuf},
};

use hlcp::{
    LinearOperator,
    files::FileError,
    film::Map,
    market::{self, read_matrix, read_vector},
};
use hlcp_methods::{Named, Parameters};
use proptest::{collection::vec, prelude::*, sample::Index, sample::select};

use crate::{
    common::asked,
    counting::{LIVE, PEAK},
    folder::{self, Folder, market_text},
};

fn cases(of_gate: u32) -> ProptestConfig {
    let cases = of_gate.saturating_mul(asked("HLCP_FUZZ", 1));
    let config = ProptestConfig::with_cases(cases);
    ProptestConfig { failure_persistence: None, max_shrink_time: 60_000, ..config }
}

const MARKET: [&str; 8] = [
    "%%MatrixMarket matrix coordinate real general\n% note\n3 3 5\n1 1 4\n2 2 3.5\n3 3 1e1\n1 3 -0.5\n3 1 -1\n",
    "%%MatrixMarket matrix coordinate integer symmetric\n2 2 3\n1 1 4\n2 1 -1\n2 2 3\n",
    "%%MatrixMarket matrix array real general\n3 1\n1\n-2.5e-3\n3\n",
    "%%MatrixMarket matrix array real symmetric\n2 2\n4\n-1\n3\n",
    "%%MatrixMarket matrix array integer general\n1 4\n1\n2\n3\n4\n",
    "%%MatrixMarket matrix coordinate real general\n4 1 2\n4 1 -2\n1 1 1.5\n",
    "%%MatrixMarket matrix coordinate real general\n1 3 2\n1 3 -2\n1 1 1.5\n",
    "1\n-2\n\n% note\n3.25\n",
];

const TABLES: [&str; 6] = [
    "# the gap in um\n40,30,20\n40,30.5,20\n40,30,20\n",
    "40;30\r\n40.5;30\r\n",
    "\u{feff}\"40\"\t\"30\"\n40\t30\n",
    "0  40\n0.02  30\n0.021  20\n0.05  10\n",
    "40\n30\n20\n",
    "1e-5, 2e-5, 3e-5, 4e-5\n",
];

/// An NPY file by the description of the format, of any version and type.
pub(crate) fn npy(version: u8, kind: &str, fortran: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': '{kind}', 'fortran_order': {fortran}, 'shape': {shape}, }}\n");
    let length = (header.len() as u32).to_le_bytes();
    let length = if version == 1 { &length[..2] } else { &length };
    [b"\x93NUMPY", &[version, 0][..], length, header.as_bytes(), data].concat()
}

fn arrays() -> Vec<Vec<u8>> {
    let doubles: Vec<u8> = [4e-5, 3e-5, 2e-5, 4e-5, 3e-5, 2e-5].map(f64::to_le_bytes).concat();
    let shorts: Vec<u8> = [40_i16, 30, 20, 10].map(i16::to_be_bytes).concat();
    vec![
        npy(1, "<f8", "False", "(2, 3)", &doubles),
        npy(2, "<f8", "True", "(3, 2)", &doubles),
        npy(3, ">i2", "False", "(4,)", &shorts),
        npy(1, "<f4", "False", "(3, 4)", &doubles),
    ]
}

/// Words that stand in the place of others: sizes, numbers out of range, and what is no number.
#[rustfmt::skip] // a list
const WORDS: [&str; 32] = [
    "0", "1", "2", "3", "17", "4000000", "4294967296", "18446744073709551615",
    "", "-0", "-1", "2.5", "+7", "1e-5", "1e-320", "1e308", "-1e308", "1e999", "nan", "-inf",
    "1,5", "0x10", "1_0", "1e", ".", "--", "%", "#", "\"", "٣", "\u{202e}", "e\u{301}",
];

#[rustfmt::skip] // a list
const BYTES: [&[u8]; 14] = [
    b"\0", b"\n", b"\r", b"\t", b" ", b",", b";", b"%", b"\x1b[2J", b"\x7f", b"\x80", b"\xff\xfe",
    b"\xef\xbb\xbf", b"\xe2\x82",
];

/// The places of words, or with `\n` alone of lines.
fn pieces(text: &[u8], separators: &[u8]) -> Vec<(usize, usize)> {
    let mut from = 0;
    let mut found = vec![];
    for piece in text.split(|byte| separators.contains(byte)) {
        found.push((from, from + piece.len()));
        from += piece.len() + 1;
    }
    found.retain(|(from, to)| from < to);
    found
}

/// Damages a word, one of the first by the kind 0: where sizes are.
fn damage_word(text: &mut Vec<u8>, kind: u8, at: Index, with: Index) {
    let words = pieces(text, b" ,;=x\t\r\n()'");
    if words.is_empty() {
        return;
    }
    let (from, to) = words[at.index(if kind == 0 { words.len().min(12) } else { words.len() })];
    let (other_from, other_to) = words[with.index(words.len())];
    let new = match kind {
        0 => WORDS[with.index(8)].as_bytes().to_vec(),
        1..=3 => WORDS[with.index(WORDS.len())].as_bytes().to_vec(),
        4 => text[other_from..other_to].to_vec(),
        5 => [&text[from..to], b" ", &text[from..to]].concat(),
        _ => vec![],
    };
    // A word that is left out takes with it what separates it from the next one.
    let to = if kind < 6 { to } else { text.len().min(to + 1) };
    text.splice(from..to, new);
}

fn damage(text: &mut Vec<u8>, kind: u8, at: Index, with: Index) {
    let place = at.index(text.len() + 1);
    let lines = pieces(text, b"\n");
    match kind {
        0..=6 => damage_word(text, kind, at, with),
        7 | 8 if !lines.is_empty() => {
            let (from, to) = lines[at.index(lines.len())];
            let line = [&text[from..to], b"\n"].concat();
            if kind == 7 {
                text.drain(from..to);
            } else {
                let from = lines[with.index(lines.len())].0;
                text.splice(from..from, line);
            }
        }
        9 => {
            let ends: &[u8] = [&b"\r\n"[..], b"\r", b"\n\n"][with.index(3)];
            *text = text.split(|&byte| byte == b'\n').collect::<Vec<_>>().join(ends);
        }
        10 => text.truncate(place),
        11 => drop(text.splice(place..place, BYTES[with.index(BYTES.len())].iter().copied())),
        12 => drop(text.splice(place..place, [with.index(256) as u8])),
        13 if place < text.len() => text[place] = with.index(256) as u8,
        // As long as a line may be, and longer.
        14 if place < text.len() && with.index(20) == 0 => {
            let byte = text[place];
            text.splice(place..place, vec![byte; 65_530 + with.index(10)]);
        }
        _ => {}
    }
}

fn damages(most: usize) -> impl Strategy<Value = Vec<(u8, Index, Index)>> {
    vec((0_u8..15, any::<Index>(), any::<Index>()), 0..most)
}

fn damaged(sound: Vec<Vec<u8>>) -> impl Strategy<Value = Vec<u8>> {
    (select(sound), damages(6)).prop_map(|(mut text, damages)| {
        damages.into_iter().for_each(|(kind, at, with)| damage(&mut text, kind, at, with));
        text
    })
}

fn bytes(texts: &[&str]) -> Vec<Vec<u8>> {
    texts.iter().map(|text| text.as_bytes().to_vec()).collect()
}

/// One line that prints, and short enough to be read.
fn is_sentence(error: &str) -> bool {
    (10..1000).contains(&error.chars().count()) && !error.chars().any(char::is_control)
}

/// What a reader makes of a file, which takes at most 64 bytes for each of the file's and 16 KiB,
/// with the error that it refuses by.
///
/// A number takes two bytes of a text at least, a line end with it. For it there are at most two
/// triplets of 16 bytes and 12 in the matrix, or a word of 16 bytes and 8 in the map, twice over
/// while vectors grow. A line that an error quotes is escaped before it is cut: 10 bytes for one.
fn read<V>(path: &Path, read: impl Fn(&Path) -> Result<V, FileError>) -> Option<V> {
    let (length, lines) = {
        let bytes = fs::read(path).unwrap();
        (bytes.len(), bytes.split(|&byte| byte == b'\n').count())
    };
    let before = LIVE.get();
    PEAK.set(before);
    let found = read(path);
    let taken = (PEAK.get() - before) as usize;
    assert!(taken <= 64 * length + (16 << 10), "{taken} bytes for a file of {length}");
    found
        .map_err(|error| {
            assert!(is_sentence(&error.to_string()), "{error}");
            assert!(error.line.is_none_or(|line| (1..=lines + 1).contains(&line)), "{error}");
        })
        .ok()
}

/// The same numbers, to the sign of zero.
fn same(one: &[f64], other: &[f64]) -> bool {
    let bits = |v: &[f64]| v.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    bits(one) == bits(other)
}

fn is_finite(v: &[f64]) -> bool {
    v.iter().all(|v| v.is_finite())
}

/// A folder for one test, and a file in it.
fn file(name: &str) -> (Folder, PathBuf) {
    let folder = Folder::new(&format!("fuzz-{name}"));
    let path = folder.0.join("file");
    (folder, path)
}

#[test]
fn damaged_market_files_are_read_or_refused() {
    let (folder, path) = file("market");
    proptest!(cases(8000), |(text in damaged(bytes(&MARKET)))| {
        folder.write("file", &text);
        if let Some(matrix) = read(&path, |path| read_matrix::<f64>(path)) {
            let entries = folder::entries(&matrix);
            prop_assert!(entries.len() <= text.len() && matrix.order() <= text.len());
            prop_assert!(entries.iter().all(|(.., value)| value.is_finite()));
            folder.write("file", market_text(matrix.order(), &entries));
            prop_assert_eq!(folder::entries(&read_matrix::<f64>(&path).unwrap()), entries);
            folder.write("file", &text);
        }
        for order in 1..5 {
            let Some(vector) = read(&path, |path| read_vector::<f64>(path, order)) else { continue };
            prop_assert!(vector.len() == order && is_finite(&vector));
            market::write_vectors(&[(&folder.0.join("written"), &vector)]).unwrap();
            let again = read_vector::<f64>(&folder.0.join("written"), order).unwrap();
            prop_assert!(same(&vector, &again), "{vector:?} and {again:?}");
        }
        let narrow = read(&path, |path| read_vector::<f32>(path, 3));
        prop_assert!(narrow.is_none_or(|vector| vector.iter().all(|v| v.is_finite())));
    });
}

#[test]
fn damaged_maps_are_read_or_refused() {
    let (folder, path) = file("maps");
    let sound = [bytes(&TABLES), arrays()].concat();
    proptest!(cases(8000), |(text in damaged(sound))| {
        folder.write("file", &text);
        let Some(map) = read(&path, Map::read) else { return Ok(()) };
        prop_assert!(map.values.len() == map.rows * map.columns && is_finite(&map.values));
        prop_assert!(read(&path, Map::read_gap).is_none_or(|gap| same(&gap.values, &map.values)));
        for written in [map.csv(), map.npy()] {
            folder.write("file", written);
            let again = Map::read(&path).unwrap();
            prop_assert!([again.rows, again.columns] == [map.rows, map.columns]);
            prop_assert!(same(&again.values, &map.values), "{map:?} and {again:?}");
        }
    });
}

#[test]
fn damaged_names_are_known_or_refused() {
    let names: Vec<_> = Named::names().into_iter().map(String::into_bytes).collect();
    let name = || damaged(names.clone()).prop_map(|name| String::from_utf8_lossy(&name).into());
    proptest!(cases(4000), |(name in name(), base in name(), given: [bool; 6])| {
        let [name, base]: [String; 2] = [name, base];
        let [alpha, beta, alpha2, beta2] = [0, 1, 2, 3].map(|k| given[k].then_some(1.2));
        let (base, window) = (given[4].then_some(&*base), given[5].then_some(3));
        let parameters = Parameters { alpha, beta, alpha2, beta2, base, window };
        match Named::parse(&name, parameters) {
            Ok(named) => {
                prop_assert!(name.eq_ignore_ascii_case(&named.to_string()));
                prop_assert_eq!(Named::parse(&named.to_string(), parameters), Ok(named));
            }
            Err(error) => {
                let length = name.len() + base.map_or(0, str::len);
                prop_assert!(error.to_string().len() < length + 1000);
            }
        }
    });
}

/// The program itself, where a shell can limit its memory.
#[cfg(target_os = "linux")]
mod program {
    use std::process::Command;

    use super::*;

    /// What the program reads.
    fn files() -> Vec<(&'static str, Vec<u8>)> {
        let matrix = |diagonal: f64| {
            let mut entries: Vec<_> = (0..4).map(|i| (i, i, diagonal)).collect();
            entries.extend((0..3).map(|i| (i, i + 1, -1.0)));
            market_text(4, &entries).into_bytes()
        };
        let rough =
            Map { columns: 3, rows: 3, values: vec![1.0, 0.5, 0.0, 0.0, 2.0, 0.0, 1.0, 0.0, 0.5] };
        let columns = hlcp::ladder::COLUMNS.join(",");
        let row = "\"example1 (4, 4), m = 512\",mine,1e-2,1e-3,0.1,0.2,0.3,7,true\n";
        vec![
            ("A.mtx", matrix(4.0)),
            ("B.mtx", matrix(3.0)),
            ("q.txt", b"-1\n2\n-3\n4\n".to_vec()),
            ("x0.mtx", MARKET[4].into()),
            ("profile.csv", TABLES[3].into()),
            ("map.csv", TABLES[0].into()),
            ("rough.npy", rough.npy()),
            ("oil.csv", b"0.04,0.04,0.04\n0.04,0.05,0.04\n0.04,0.04,0.06\n".to_vec()),
            ("motion.csv", b"0,0,0\n1e-3,1e-6,0\n2e-3,2e-6,1e-6\n".to_vec()),
            ("mine.csv", format!("{columns}\n{row}{row}").into_bytes()),
        ]
    }

    const COMMANDS: [&str; 10] = [
        "solve --a A.mtx --b B.mtx --q q.txt --x0 x0.mtx --method AUTO,MSOR --alpha 1.1 --certify",
        "solve --a A.mtx --q q.txt --grid 2x2 --method FMG --rtol 1e-6 --threads 2 --out-z z --out-r r",
        "solve --a A.mtx --b B.mtx --q q.txt --method TMAOR --alpha 1.1 --beta 0.9 --norm linf --tau 1.5",
        "solve --scene american-put --m 3 --steps 2 --rate 0.05 --spot 1 --method ADAPTIVE --window 3",
        "film profile.csv --x-unit m --h-unit um --speed 3 --viscosity 0.04 --ambient 1e5 --refine 3",
        "film --map map.csv --roughness rough.npy --viscosity oil.csv --lx 0.05 --ly 0.03 --h-unit um \
         --speed 3,1 --supply 0.01,0.01,0.01,0.01,1e5 --side north=closed --side west=starved,0.4",
        "film --pad taper,4e-5,2e-5,0.02 --lx 0.05 --ly 0.02 --dimples 2,1,0.01,0.01,1e-5,ellipse --nx 9 \
         --ny 5 --speed 3 --viscosity 0.04 --whirl 0.5,1 --data-tolerance 1e-3 --oil 900,2000 --certify",
        "film --journal --diameter 0.1 --length 0.05 --clearance 1e-4 --nx 24 --ny 5 --viscosity 0.02 \
         --rpm 1000 --lobes 2,0.3,0.5,9 --groove 30,2e5,20,0.02 --dam 20,80,0.03,1e-5 --load 500 --tilt 0,0",
        "film --journal --diameter 0.1 --length 0.05 --clearance 100 --h-unit um --nx 24 --ny 5 --speed 2 \
         --viscosity 0.02 --motion motion.csv --attitude 20 --ambient 1 --p-unit MPa --method NEWTON",
        "speed-vs-accuracy --add mine.csv",
    ];

    /// The program with damaged files and a damaged command line answers, or refuses in one line;
    /// it stays within a gigabyte and a minute, beyond which the shell has it killed.
    #[test]
    fn damaged_files_and_options_are_read_or_refused() {
        let (folder, files) = (Folder::new("fuzz-program"), files());
        let options: Vec<_> =
            ["solve", "film"].iter().flat_map(|c| crate::options::options(c)).collect();
        let words = (0_u8..9, any::<Index>(), any::<Index>());
        let of_file = (any::<Index>(), damages(3));
        proptest!(cases(500), |(command in select(&COMMANDS), words in vec(words, 0..3), of_file in of_file)| {
            let mut line = command.as_bytes().to_vec();
            // The command itself stays, and this file with it: others take minutes.
            let words = if command.contains("mine.csv") { &[][..] } else { &words };
            let mut rest = line.split_off(line.iter().position(|&byte| byte == b' ').unwrap());
            for &(kind, at, with) in words {
                if kind < 7 {
                    damage_word(&mut rest, kind, at, with);
                } else {
                    let option = &options[at.index(options.len())].0;
                    rest.extend(format!(" --{option} {}", WORDS[with.index(WORDS.len())]).into_bytes());
                }
            }
            line.extend(rest);
            let line = String::from_utf8_lossy(&line);
            let damaged = of_file.0.index(files.len());
            for (k, (name, text)) in files.iter().enumerate() {
                let mut text = text.clone();
                if k == damaged {
                    of_file.1.iter().for_each(|&(kind, at, with)| damage(&mut text, kind, at, with));
                }
                if *name == "mine.csv" {
                    text.extend(b"\nthe chart would take minutes");
                }
                folder.write(name, text);
            }
            let limited = "ulimit -v 1000000; ulimit -t 60; exec \"$0\" \"$@\"";
            let mut shell = Command::new("sh");
            shell.current_dir(&folder.0).args(["-c", limited, env!("CARGO_BIN_EXE_hlcp")]);
            // A word that is not there splits into none, as in a shell.
            shell.args(line.split(' ').filter(|word| !word.is_empty()));
            if line.starts_with("solve") && !line.contains("max-seconds") {
                shell.args(["--max-seconds", "1"]);
            }
            let output = shell.output().unwrap();
            let (code, told) = (output.status.code(), String::from_utf8(output.stderr).unwrap());
            let is_note = |line: &&str| ["warning: ", "note: "].iter().any(|of| line.starts_with(of));
            let (notes, refusals): (Vec<&str>, Vec<&str>) = told.lines().partition(is_note);
            prop_assert!(notes.iter().chain(&refusals).all(|line| is_sentence(line)), "{line}: {told}");
            match code {
                Some(1) => prop_assert!(output.stdout.is_empty() && refusals.len() == 1, "{line}: {told}"),
                Some(0 | 2) => prop_assert!(refusals.is_empty(), "{line}: {told}"),
                _ => prop_assert!(false, "{code:?} of {line}: {told}"),
            }
        });
    }
}
