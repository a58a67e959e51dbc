//! The commands that draw run, and what they write is small.

use std::{fs, path::PathBuf};

use crate::{
    command::{hlcp, text},
    folder::Folder,
};

#[test]
fn the_gallery_is_drawn() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("gallery");
    let output = hlcp("gallery", "--out").arg(&folder).output().expect("the command starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let names = [
        "slider",
        "disc-lcp",
        "disc-hlcp",
        "journal-bearing",
        "obstacle",
        "membranes",
        "dam",
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

#[test]
fn a_problem_of_ones_own_has_a_map() {
    let folder = Folder::new("own-map");
    let run = |options: &str| {
        let mut command = hlcp("stability-map", &format!("{options} --out"));
        command.arg(&folder.0).output().unwrap()
    };
    let output = run("--quick --scene dam --nx 5 --ny 6");
    assert!(output.status.success(), "{}", text(&output.stderr));
    let mut names: Vec<_> =
        fs::read_dir(&folder.0).unwrap().map(|e| e.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["measured.csv", "stability-own-dam.csv", "stability-own-dam.svg"]);
    let read = |name: &str| fs::read_to_string(folder.0.join(name)).unwrap();
    let svg = read("stability-own-dam.svg");
    assert!(
        svg.contains("nx = 5, ny = 6") && svg.contains("hlcp stability-map --scene dam --quick")
    );
    // Three methods with two βs in two precisions, α and τ from 0.25 to 2 by 0.25.
    assert_eq!(read("stability-own-dam.csv").lines().count(), 1 + 3 * 2 * 2 * 8 * 8);
    // The same data, drawn anew; another scene has none.
    assert!(run("--draw --quick --scene dam --nx 5 --ny 6").status.success());
    assert_eq!(read("stability-own-dam.svg"), svg);
    assert!(
        text(&run("--draw --scene slider").stderr).contains("no data of stability-map --scene")
    );
}

const COLUMNS: &str = "problem,series,tolerance,true error,seconds min,seconds median,seconds max,half-steps,reached\n";

#[test]
fn measurements_of_ones_own_are_on_the_charts() {
    let folder = Folder::new("added");
    let rows = "\"Example 1 (4, 4), m = 32, 0/1\",mine,1e-2,3e-3,0.001,0.002,0.004,7,true\n\
                \"slider, N = 24\",mine,1e-2,3e-3,0.001,0.002,0.004,,false\n";
    let file = folder.write("mine.csv", format!("{COLUMNS}{rows}"));
    let run = |options: &str| {
        let mut command = hlcp("speed-vs-accuracy", &format!("--quick {options} --out"));
        let output = command.arg(&folder.0).output().unwrap();
        assert!(output.status.success(), "{}", text(&output.stderr));
    };
    run("");
    // The problems need not be measured anew.
    run(&format!("--draw --add {}", file.display()));
    let read = |name: &str| fs::read_to_string(folder.0.join(name)).unwrap();
    let csv = read("speed-vs-accuracy.csv");
    let written = csv.lines().filter(|line| line.contains(",mine,")).collect::<Vec<_>>();
    assert_eq!(written.len(), 2, "{csv}");
    assert!(written[0].ends_with(",3e-3,0.001000,0.002000,0.004000,7,true"), "{}", written[0]);
    // What is written can be added in its turn.
    assert_eq!(csv.lines().next(), COLUMNS.lines().next());
    for chart in ["methods", "beyond"] {
        assert!(read(&format!("{chart}.svg")).contains(">mine<"), "{chart}");
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
        ("\"slider, N = 24\",mine,1,-1,1,1,1,1,true", "true error is '-1', not a number of 0"),
        ("\"slider, N = 24\",mine,1,1,1,nan,1,1,true", "seconds median is 'nan'"),
        ("\"slider, N = 24\",mine,1,1,1,1,1,1,yes", "reached must be true or false"),
    ] {
        let file = folder.write("mine.csv", format!("{COLUMNS}{row}\n"));
        let mut command = hlcp("speed-vs-accuracy", "--quick --out nowhere --add");
        let output = command.current_dir(&folder.0).arg(&file).output().unwrap();
        let err = text(&output.stderr);
        assert_eq!((output.status.code(), err.lines().count()), (Some(1), 1), "{err}");
        assert!(err.contains("mine.csv, line 2: ") && err.contains(named), "{err}");
        assert!(!folder.0.join("nowhere").exists());
    }
}
