//! `hlcp film` in two dimensions: what is told of doubtful films, and what is refused.

use std::fs;

use serde_json::Value;

use crate::{
    command::{is_refusal, number, text},
    film_plane::{film, folder, journal, json},
    fuzz::npy,
};

/// A plain journal that is fed by the pressure around it alone.
fn unfed(size: f64, clearance: f64, viscosity: f64, ecc: f64, ambient: f64) -> String {
    format!(
        "--journal --diameter {size} --length {size} --x-unit mm --h-unit um --rpm 3000 \
         --clearance {clearance} --viscosity {viscosity} --ecc {ecc} --ambient {ambient} --nx 40 \
         --ny 12"
    )
}

#[test]
fn what_settles_by_rounding_is_told() {
    let told = |arguments: &str| {
        let output = film(&format!("{arguments} --json"));
        let found: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
        (found, text(&output.stderr), output.status.code())
    };
    // Algebraic multigrid alone, with sweeps to fall back on, does not converge in the first two,
    // and in the third it ends with contents of −2788 and a load 10 % off.
    for (size, clearance, viscosity, ecc, ambient) in
        [(100.0, 10.0, 0.1, 0.2, 0.1), (50.0, 5.0, 0.1, 0.5, 0.1), (500.0, 1.0, 1.0, 0.9, 100.0)]
    {
        let (found, err, status) = told(&unfed(size, clearance, viscosity, ecc, ambient));
        assert_eq!((status, &found["converged"]), (Some(0), &true.into()), "{found}");
        assert!(number(&found, "feed") < 1e-8 && number(&found, "least_content") > 0.0, "{found}");
        let doubt = found["doubt"].as_str().expect("a doubt");
        assert!(doubt.contains("of the oil that goes round enters the film"), "{doubt}");
        assert!(
            doubt.contains("what is certified holds for the coefficients as they were rounded"),
            "{doubt}"
        );
        assert!(err.starts_with(&format!("warning: {doubt}")), "{err}");
    }
    let weak = unfed(500.0, 1.0, 1.0, 0.9, 100.0);
    let output = film(&weak);
    assert!(text(&output.stdout).contains("e-9 of the oil that goes round; least content 0.0542"));
    // Fed well, and not converged.
    let (found, err, _) = told(&unfed(100.0, 100.0, 0.02, 0.5, 1e5));
    assert!(found["doubt"].is_null() && err.is_empty() && number(&found, "feed") > 0.1, "{found}");
    let weaker = format!("{} --method MGS", unfed(100.0, 10.0, 0.1, 0.2, 0.1));
    let (found, _, status) = told(&weaker);
    assert_eq!((status, &found["converged"]), (Some(2), &false.into()), "{found}");
    let output = film(&weaker);
    let second = text(&output.stdout).lines().nth(1).map(str::to_owned);
    assert_eq!(second.as_deref(), Some("not converged, so these are no figures of the film:"));
}

/// Three stretches with gaps of their own, and nothing leaves sideways: in each the pressure is a
/// straight line, and the flow is the same. A film has this pressure, or a doubt.
#[test]
fn what_is_too_deep_for_its_figures_is_told() {
    let asked = "--pad plane,2e-5,2e-5 --lx 0.05 --ly 0.01 --nx 50 --ny 1 --speed 2 --viscosity 0.04 \
                 --side south=closed --side north=closed --pocket 0,0,0.01,0.01,1e-5";
    let mut worst = 0.0_f64;
    for depth in [2e-4, 2e-2, 0.5, 1.0, 2.0] {
        let found = json(&format!("{asked} --pocket 0.01,0,0.02,0.01,{depth}"));
        let stretches = [(0.01, 3e-5), (0.02, 2e-5 + depth), (0.02, 2e-5_f64)];
        let sum = |power: i32| stretches.map(|(x, h)| x / h.powi(power)).iter().sum::<f64>();
        let flow = sum(2) / sum(3);
        let peak = 12.0 * 0.04 * 0.02 / 2e-5_f64.powi(3) * (flow - 2e-5);
        let off = (number(&found, "peak_pressure_pa") / peak - 1.0).abs();
        let doubt = found["doubt"].as_str();
        assert!(doubt.is_some() || off <= 1e-4, "{depth}: {off:e}");
        assert!(doubt.is_none_or(|why| why.contains("too deep for double precision")), "{doubt:?}");
        assert_eq!(doubt.is_some(), depth > 0.1, "{depth}: {off:e}");
        worst = worst.max(off);
    }
    assert!(worst > 1e-3, "{worst:e}: these are right, and need no doubt");
}

/// Lists that are lost in the cells, and cells that no memory holds, are refused before they are
/// made: all in 2 GB of addresses.
#[cfg(target_os = "linux")]
#[test]
fn what_no_memory_holds_is_refused_in_words() {
    let pad = "film --pad plane,4e-5,2e-5 --lx 0.05 --ly 0.03 --viscosity 0.04 --speed 3";
    for (arguments, what) in [
        (format!("{pad} --nx 100 --ny 100 --dimples 10000,10000,5e-6,3e-6,1e-5"), "is lost in"),
        (format!("{pad} --nx 10000 --ny 10000"), "100000000 unknowns take 40.0 GB of memory or"),
        ("solve --m 6000".into(), "36000000 unknowns take 2.2 GB of memory or more"),
        ("solve --m 3000 --method MGS,AMG".into(), "cannot be had; take a smaller grid by --m"),
        ("solve --scene film --nx 9000 --ny 9000".into(), "or --nx and --ny"),
    ] {
        let limited = "ulimit -v 2000000; exec \"$0\" \"$@\"";
        let mut command = std::process::Command::new("sh");
        command.args(["-c", limited, env!("CARGO_BIN_EXE_hlcp")]);
        command.args(arguments.split_whitespace()).current_dir(folder());
        let output = command.output().expect("a shell");
        is_refusal(&output, &arguments, what);
    }
}

#[test]
fn wrong_films_are_refused_in_one_line() {
    let here = folder();
    // What a run before has left is no fault of the first case.
    let _ = fs::remove_dir_all(here.join("new"));
    let write = |name: &str, bytes: &[u8]| fs::write(here.join(name), bytes).unwrap();
    write("gap.csv", b"2e-5,2e-5,2e-5\n2e-5,3e-5,2e-5\n");
    write("negative.csv", b"# gap\n2e-5,2e-5\n2e-5,-3e-5\n");
    write("word.csv", b"2e-5,wide\n");
    write("ragged.csv", b"1,2\n3\n");
    write("small.csv", b"1\n");
    write("commas.csv", b"5,97e-6;5,92e-6\n5,95e-6;5,90e-6\n");
    write("blanks.csv", b"5,97e-6 5,92e-6\n");
    write("times.csv", b"0,0\n1,1e-6\n1,2e-6\n");
    write("meets.csv", b"0,0\n1,-1\n");
    let npy = |shape: &str| npy(1, "<f8", "False", shape, &[0; 48]);
    write("lie.npy", &npy("(3, 3)"));
    write("huge.npy", &npy("(4611686018427387904, 2)"));
    write("zero.npy", &npy("(2, 3)"));
    write("cut.npy", b"\x93NUMPY\x01");
    let size = "--lx 0.01 --ly 0.01 --speed 2 --viscosity 0.03 --out new/film";
    #[rustfmt::skip] // a table
    let of_shapes = [
        ("--map negative.csv", "negative.csv: row 2, column 2: the gap is -3e-5 m"),
        ("--map zero.npy", "zero.npy: row 1, column 1: the gap is 0e0 m"),
        ("--map word.csv", "word.csv, line 1: column 2: 'wide' is not a finite number"),
        ("--map commas.csv", "commas.csv, line 1: a comma within numbers; write decimals with a"),
        ("--map blanks.csv", "blanks.csv, line 1: a comma within numbers"),
        ("--map ragged.csv", "ragged.csv, line 2: 1 columns where 2 are wanted"),
        ("--map lie.npy", "the shape is (3, 3) of 8 bytes each, but the data have 48 bytes"),
        ("--map huge.npy", "but the data have 48 bytes"),
        ("--map cut.npy", "cut.npy: the NPY header is cut short"),
        ("--map none.csv", "none.csv"),
        ("--pad plane", "taper,WEST,LAND,LENGTH or parabola,LEAST,RADIUS[,X], in numbers"),
        ("--pad plane,2e-5,1e-5 --nx 36 --ny 12 --load 10,0.0099,0.005",
         "the search for a position that carries 10 N at 0.0099, 0.005 in units of --x-unit"),
        ("--pad plane,2e-5,1e-5 --nx 36 --ny 12 --load 1e6", "is narrow, by --nx and --ny, or begin"),
        ("--pad taper,1,1,0", "a pad is plane,WEST,EAST or taper,WEST,LAND,LENGTH"),
        ("--pad cone,1", "a pad is plane,WEST,EAST or taper,WEST,LAND,LENGTH or parabola"),
        ("--journal", "required"),
    ];
    #[rustfmt::skip] // a table
    let of_map = [
        ("--roughness small.csv", "small.csv has 1 rows and 1 columns, but the film has 2 and 3"),
        ("--side west=0 --side west=1", "--side west is given twice"),
        ("--side west=periodic", "must both be periodic, or neither"),
        ("--side up=0", "a side is west, east, south or north"),
        ("--side west=starved,2", "the film content '2' is not between 0 and 1"),
        ("--side west=-1", "a pressure in Pa is -1"),
        ("--pocket 0.009,0,0.002,0.001,1e-6", "--pocket from x = 0.009 to 0.011 is outside"),
        ("--pocket 0,-1,0.002,0.001,1e-6", "--pocket from y = -1 to -0.999 is outside"),
        ("--pocket 1,2,3", "a pocket is x,y,lx,ly,depth"),
        ("--pocket 0,0,1e-5,1e-5,1e-6",
         "--pocket of 0.00001 by 0.00001 is lost in cells of 0.00333"),
        ("--dimples 1,1,1e-5,1e-5,1e-6", "check its size, or take more cells by a finer --map"),
        ("--dimples 2,2,1e-3,1e-3,1e-6,circle", "dimples are kx,ky,lx,ly,depth in"),
        ("--dimples 2,2,0.006,0.001,1e-6", "--dimples overlap"),
        ("--supply 0.009,0,0.002,0.001,1e5", "--supply from x = 0.009 to 0.011 is outside"),
        ("--supply 0,0,0.001,0.001,1e5", "the number of cells of a supply is 0"),
        ("--load 1e9", "the search for a position that carries 1000000000 N failed; each of the "),
        ("--supply 0.001,0.001,0.005,0.006,1e6 --load 1",
         " N or more, also by the pressures of supplies and sides"),
        ("--whirl=-1", "--whirl has -1, but a frequency over the running speed is"),
        ("--load 50kN", "'50kN' is not a number; units are given by their own"),
        ("--load 5 --mass 5", "--mass lets the wall move under the loads of --motion"),
        ("--load -1", "--load is -1 N, but it must be positive"),
        ("--x-unit 1 --load 1,0.005,5",
         "--load: Y is 5 m, outside the film, which ends at 0.01 m; X and Y are in units of"),
        ("--motion times.csv", "times.csv: row 3: the time 1 does not exceed the one before"),
        ("--motion meets.csv",
         "meets.csv: row 2: the walls meet; positions are in units of --h-unit"),
        ("--motion gap.csv --load 1", "--load is where a free motion begins, but"),
        ("--motion gap.csv --mass -1", "not a number of kilogrammes, 0 or more"),
        ("--motion gap.csv --mass 1",
         "but a motion has two rows or more, each with the time and the load"),
        ("--ambient -1", "--ambient is -1 Pa, below --cavitation, 0 Pa"),
        ("--method FOO", "there is no method 'FOO'"),
        ("--method MSOR", "; films take methods that need no parameters, as AMG or AUTO"),
        ("--nx 4", "cannot be used with"),
        ("--tilt 1", "--tilt has 1 numbers, but it takes A,B"),
        ("--bogus", "unexpected argument '--bogus'"),
    ];
    let round = "--journal --diameter 0.1 --length 0.05 --clearance 1e-4 --viscosity 0.03 --rpm 3000 \
                 --groove 0,1e5 --ecc 0.6 --out new/film";
    #[rustfmt::skip] // a table
    let of_bushes = [
        ("--lobes 2,1.2",
         "--lobes: the preload of the lobes is 1.2, but it must be from 0 to below 1"),
        ("--lobes 2.5,0.5", "--lobes takes COUNT,PRELOAD[,OFFSET[,DEGREES]], with a whole COUNT"),
        ("--lobes 2,0.5,0.5,0,9",
         "--lobes has 5 numbers, but it takes COUNT,PRELOAD[,OFFSET[,DEGREES]]"),
        ("--lobes 2", "--lobes has 1 numbers, but it takes COUNT,PRELOAD"),
        ("--lobes 2,0.5,1.5", "the offset of the lobes is 1.5, but it must be from 0 to 1"),
        ("--nx 1", "--nx is 1, but a journal takes 3 cells or more around it"),
        ("--lobes 2,0.5", "the journal meets its bush at an end, 180.0 degrees from x = 0"),
        ("--groove 0,1e5,0.01", "those beside it; make it wider, or take more cells; see --side"),
        ("--groove 0,1e5,400", "--groove: a width of 400 degrees"),
        ("--groove 0,1e5,-5", "a width of -5 degrees and a length of 0.05 m, but the width must be 0"),
        ("--groove 0,1e5,10,0", "0 m, but the width must be 0 or more and below 360 degrees, and the"),
        ("--groove 0,1e5,10,0.06", "the length positive and at most that of the bearing, 0.05 m"),
        ("--groove 0,1e5,10,0.03,1", "--groove has 5 numbers, but it takes DEGREES[,PRESSURE"),
        ("--dam 90,20,0.03,1e-5", "--dam from 90 to 20 degrees"),
        ("--dam 20,90,0.06,1e-5", "--dam from y = "),
        ("--dam 20,90,1e-6,1e-5", "by 1e-6 is lost in cells of"),
    ];
    #[rustfmt::skip] // a table
    let of_places = [
        ("--ecc 1.2",
         "--ecc is 1.2, but an eccentricity over the clearance is at least 0 and below"),
        ("", "a journal needs its position: give --ecc, from 0 to below 1, or --load or --motion"),
    ];
    let (map, journal) = (format!("--map gap.csv {size}"), journal(0.1));
    let of_films = [(size, &of_shapes[..]), (&map, &of_map)];
    let of_journals = [(round, &of_bushes[..]), (&journal, &of_places)];
    for (rest, cases) in of_films.into_iter().chain(of_journals) {
        for (arguments, what) in cases {
            is_refusal(&film(&format!("{arguments} {rest}")), arguments, what);
            let left = fs::read_dir(here.join("new")).map_or(0, Iterator::count);
            assert_eq!(left, 0, "{arguments}: something was written");
        }
    }
    let options = "lx ly diameter length clearance lobes ecc attitude tilt pad pocket dimples supply \
                   groove dam side x-unit h-unit p-unit speed rpm ambient cavitation oil load whirl \
                   mass data-tolerance";
    for option in options.split(' ') {
        for value in ["nan", "inf", "1,nan"] {
            let asked = format!("--journal --{option} {value}");
            let err = is_refusal(&film(&asked), &asked, &format!("--{option}"));
            assert!(err.contains(&format!("'{value}'")), "--{option} {value}: {err}");
        }
    }
    let beside = "gap.csv --speed 2 --viscosity 0.03 --load 5 --nx 4";
    let what =
        "cannot be used with: --load <LOAD[,X,Y]>; in two dimensions the gap is given by --map";
    is_refusal(&film(beside), beside, what);
    let turns = "--pad plane,2e-5,1e-5 --lx 0.01 --ly 0.01 --viscosity 0.03 --rpm 3000";
    is_refusal(&film(turns), turns, "--rpm is of a --journal; anything else takes --speed, in m/s");
    let comma = "--pad plane,2e-5,1e-5 --lx 1 --ly 1 --speed 1 --viscosity 0,04";
    is_refusal(&film(comma), comma, "a comma between them; write decimals with a point");
    let still = "--map gap.csv --lx 1 --ly 1 --viscosity 0.03 --ambient 2e5";
    let err = is_refusal(&film(still), still, "nothing drives the film");
    assert!(err.contains("all pressures are 200000 Pa, "), "{err}");
    assert!(err.contains("give --speed or --motion"), "{err}");
    let still = "--journal --diameter 0.1 --length 0.1 --clearance 1e-4 --viscosity 0.03 --ecc 0.5 \
                 --rpm 0 --p-unit MPa --ambient 0.1";
    let err = is_refusal(&film(still), still, "all pressures are 100000 Pa, ");
    assert!(err.contains("give --rpm or --motion"), "{err}");
    let over = film(&format!("--map gap.csv {} --out gap", &size[..size.len() - 15]));
    assert!(over.status.success(), "gap-pressure.csv is another file");
}
