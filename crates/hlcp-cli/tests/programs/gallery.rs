//! The commands that draw run, and what they write is small.

use std::{fs, path::PathBuf};

use crate::{
    command::{hlcp, is_refusal, run_in, succeeded, text},
    folder::Folder,
};

#[test]
fn the_gallery_is_drawn() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("gallery");
    succeeded(&hlcp("gallery", "--out").arg(&folder).output().unwrap(), "gallery");
    let names = "slider disc-lcp disc-hlcp journal-bearing obstacle membranes dam bearing2d \
                 bearing2d-groove american-put";
    for name in names.split(' ') {
        let file = |kind: &str| fs::read_to_string(folder.join(format!("gallery-{name}.{kind}")));
        let (svg, csv) = (file("svg").expect("drawn"), file("csv").expect("written"));
        assert!(svg.starts_with("<svg") && svg.len() < 300_000, "{name}: {} bytes", svg.len());
        assert!(csv.lines().count() > 100 && csv.len() < 300_000, "{name}");
        // A value that is no number would be drawn as nothing.
        assert!(!csv.contains("NaN") && !csv.contains("inf"), "{name}");
    }
}

#[test]
fn each_problem_of_ones_own_has_a_map() {
    let folder = Folder::new("own-map");
    let run = |options: &str| {
        let mut command = hlcp("stability-map", &format!("{options} --quick --out"));
        command.arg(&folder.0).output().unwrap()
    };
    let read = |name: &str| fs::read_to_string(folder.0.join(name)).unwrap();
    let [small, large] =
        [3, 4].map(|m| format!("stability-own-example1-m-{m}-mu-4-nu-4-solution-default"));
    for (m, name) in [(3, &small), (4, &large)] {
        // Corollary 1 proves the row τ = 1 up to α = 1, and all cells there converge.
        let told = succeeded(&run(&format!("--m {m}")), name);
        assert_eq!(told.lines().filter(|line| line.contains("cells with a proof")).count(), 6);
        assert!(!told.contains("limit") && !told.contains("diverged"), "{told}");
        let svg = read(&format!("{name}.svg"));
        assert!(svg.contains(&format!("example1, m = {m}, mu = 4")), "{svg}");
        assert!(svg.contains(&format!("hlcp stability-map --scene example1 --m {m} --mu 4")));
        // Three methods with two βs in two precisions, α and τ from 0.5 to 2 by 0.5.
        assert_eq!(read(&format!("{name}.csv")).lines().count(), 1 + 3 * 2 * 2 * 4 * 4);
    }
    let mut names: Vec<_> = fs::read_dir(&folder.0)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    let files = [&small, &large].map(|name| [format!("{name}.csv"), format!("{name}.svg")]);
    assert_eq!(names, [&["measured.csv".to_owned()], files.as_flattened()].concat());
    // The same data, drawn anew; the problem with another number has none.
    let svg = read(&format!("{small}.svg"));
    assert!(run("--draw --m 3").status.success());
    assert_eq!(read(&format!("{small}.svg")), svg);
    let refused = text(&run("--draw --m 5").stderr);
    assert!(refused.contains("no data of stability-map --scene example1 --m 5"), "{refused}");
}

#[test]
fn files_of_ones_own_are_measured() {
    let folder = Folder::new("own-files");
    let data = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("data");
    for name in ["A.mtx", "B.mtx", "q.mtx"] {
        fs::copy(data.join(name), folder.0.join(name)).unwrap();
    }
    let mine = "\"A.mtx, B.mtx, q.mtx\",mine,1e-2,3e-3,0.001,0.002,0.004,,true\n";
    folder.write("mine.csv", format!("{COLUMNS}{mine}"));
    let files = "--a A.mtx --b B.mtx --q q.mtx";
    for (command, more) in [("stability-map", ""), ("speed-vs-accuracy", " --add mine.csv")] {
        let options = format!("--quick --out charts {files}{more}");
        succeeded(&run_in(&folder.0, command, &options), command);
    }
    let read = |name: &str| {
        let path = folder.0.join("charts").join(name);
        fs::read_to_string(&path).unwrap_or_else(|_| panic!("{}", path.display()))
    };
    let own = "own-a-A_mtx-b-B_mtx-q-q_mtx";
    for chart in ["stability", "speed-vs-accuracy"] {
        let svg = read(&format!("{chart}-{own}.svg"));
        assert!(svg.contains(&format!("{files} --quick")), "{svg}");
    }
    let csv = read(&format!("speed-vs-accuracy-{own}.csv"));
    for series in ["mine", "auto", "TMGS", "Newton, sparse LU"] {
        let row = format!("\"A.mtx, B.mtx, q.mtx\",\"{series}\",");
        assert!(csv.lines().any(|line| line.starts_with(&row)), "{series}: {csv}");
    }
    assert!(read(&format!("speed-vs-accuracy-{own}.svg")).contains(">mine"));
    // A line for each command below the names of the columns.
    assert_eq!(read("measured.csv").lines().count(), 3);
}

const COLUMNS: &str = "problem,series,tolerance,true error,seconds min,seconds median,seconds max,half-steps,reached\n";

#[test]
fn measurements_of_ones_own_are_on_the_charts() {
    let folder = Folder::new("added");
    // Faster than all others on the one problem, far slower on the other.
    let rows = "\"Example 1 (4, 4), m = 16, 0/1\",mine,1e-2,3e-3,1e-6,2e-6,4e-6,7,true\n\
                \"slider, N = 12\",mine,1e-2,3e-3,1000,2000,4000,,true\n";
    let file = folder.write("mine.csv", format!("{COLUMNS}{rows}"));
    let run = |options: &str| {
        let mut command = hlcp("speed-vs-accuracy", &format!("--quick {options} --out"));
        succeeded(&command.arg(&folder.0).output().unwrap(), options);
    };
    run("");
    // The problems need not be measured anew.
    run(&format!("--draw --add {}", file.display()));
    let read = |name: &str| fs::read_to_string(folder.0.join(name)).unwrap();
    let csv = read("speed-vs-accuracy.csv");
    let written = csv.lines().filter(|line| line.contains(",\"mine\",")).collect::<Vec<_>>();
    assert_eq!(written.len(), 2, "{csv}");
    assert!(written[0].ends_with(",3e-3,0.000001,0.000002,0.000004,7,true"), "{}", written[0]);
    // What is written can be added in its turn.
    assert_eq!(csv.lines().next(), COLUMNS.lines().next());
    // Its line has a name in the key; times far above all others are told in words.
    for chart in ["methods", "beyond"] {
        let svg = read(&format!("{chart}.svg"));
        for name in [">mine<", "mine 2000 s"] {
            assert!(svg.contains(name), "{chart}: {name}");
        }
    }
    assert!(!read("precisions.csv").contains("mine"));
}

#[test]
fn measurements_that_fit_no_chart_are_refused_with_their_line() {
    let folder = Folder::new("unfit");
    for (row, named) in [
        (
            "slider,mine,1,1,1,1,1,1,true",
            "there is no problem 'slider' here; they are Example 1 (4",
        ),
        ("mine,1,1,1,1,1,1,true", "8 columns where there must be 9"),
        ("\"slider, N = 12\",mine,1,-1,1,1,1,1,true", "true error is '-1', not a number of 0"),
        ("\"slider, N = 12\",mine,1,1,1,nan,1,1,true", "seconds median is 'nan'"),
        ("\"slider, N = 12\",mine,1,1,1,1,1,1,yes", "reached must be true or false"),
    ] {
        folder.write("mine.csv", format!("{COLUMNS}{row}\n"));
        let added = "--quick --out nowhere --add mine.csv";
        let err = is_refusal(&run_in(&folder.0, "speed-vs-accuracy", added), row, named);
        assert!(err.contains("mine.csv, line 2: "), "{err}");
        assert!(!folder.0.join("nowhere").exists());
    }
}
