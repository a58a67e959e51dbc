//! Problems as Matrix Market files, and maps and profiles of films: read to the entry, refused
//! without harm.

use std::{fs, path::Path};

use hlcp::market;
use hlcp_verify::Example;

use crate::{
    command::{is_refusal, json, refused, run_in, succeeded},
    folder::{Folder, entries, text_of},
    fuzz::npy,
};

/// The samples are Example 1 for m = 4, and what is solved from them is its solution.
#[test]
fn the_sample_files_are_example_1() {
    let scene = Example { symmetric: true, m: 4, mu: 4.0, nu: 4.0 }.pose::<f64>().unwrap();
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("data");
    let sample = |name| fs::read_to_string(data.join(name)).unwrap();
    assert_eq!(sample("A.mtx"), text_of(&scene.a));
    assert_eq!(sample("B.mtx"), text_of(&scene.b));
    let folder = Folder::new("samples");
    let [q, z, r] = ["q.mtx", "z.mtx", "r.mtx"].map(|name| folder.0.join(name));
    market::write_vectors(&[(&q, &scene.q)]).unwrap();
    assert_eq!(sample("q.mtx"), fs::read_to_string(&q).unwrap());
    let [a, b, q] = ["A.mtx", "B.mtx", "q.mtx"].map(|name| data.join(name).display().to_string());
    let out = format!("--out-z {} --out-r {}", z.display(), r.display());
    let (_, status) = json(&format!("--a {a} --b {b} --q {q} --method AUTO --json {out}"));
    assert_eq!(status, 0);
    for (path, known) in [(z, scene.z), (r, scene.r)] {
        let found = market::read_vector::<f64>(&path, 16).unwrap();
        assert!(found.iter().zip(&known).all(|(v, known)| (v - known).abs() <= 1e-9));
    }
}

/// In single precision the bound is on the error in the problem of the files, which f32 rounds.
#[test]
fn a_certificate_in_single_precision_is_of_the_files() {
    let folder = Folder::new("narrow");
    let a = folder.write("A.mtx", format!("{HEAD}1 1 1\n1 1 1.00000003\n"));
    let q = folder.write("q.txt", "-16777217\n");
    let z = folder.0.join("z.mtx");
    let [a, q, out] = [&a, &q, &z].map(|path| path.display().to_string());
    let arguments = format!("--a {a} --q {q} --method MGS --precision f32 --certify --json");
    let (found, status) = json(&format!("{arguments} --out-z {out}"));
    let z = market::read_vector::<f64>(&z, 1).unwrap()[0];
    let error = (z - 16_777_217.0 / 1.000_000_03).abs();
    let bound = found["certified_error_bound"].as_f64().unwrap();
    assert!(status == 0 && 0.4 < error && error <= bound && bound <= 2.0 * error, "{found}");
}

#[test]
fn unique_is_null_in_json_where_nothing_is_proved() {
    let folder = Folder::new("verdicts");
    let q = folder.write("q.mtx", "%%MatrixMarket matrix array real general\n2 1\n-1\n-1\n");
    for (off, unique) in [("-0.5", Some(true)), ("-2", Some(false)), ("2", None)] {
        // Neither of the last two is a P-matrix, but with positive couplings no theorem says so.
        let entries = format!("1 1 1\n2 2 1\n1 2 {off}\n2 1 {off}\n");
        let a = folder.write("A.mtx", format!("{HEAD}2 2 4\n{entries}"));
        let command =
            format!("--a {} --q {} --method PIVOTING --certify --json", a.display(), q.display());
        let (report, _) = json(&command);
        let certificate = &report["certificate"];
        assert_eq!(certificate["unique"].as_bool(), unique, "{report}");
        assert_eq!(certificate["disproof"].is_object(), unique == Some(false));
    }
}

/// A scene through files takes the iterations it takes as stencils, also where that needs its grid,
/// and its answer comes back to the last bit. A grid that is said must fit.
#[test]
fn a_scene_through_files() {
    let folder = Folder::new("scene");
    let scene = Example { symmetric: false, m: 11, mu: 3.0, nu: 2.0 }.pose::<f64>().unwrap();
    let problem = folder.problem(&[("a", &scene.a), ("b", &scene.b)], &scene.q);
    let (z, r) = (folder.0.join("z.mtx"), folder.0.join("r.mtx"));
    let files = format!("{problem} --out-z {} --out-r {}", z.display(), r.display());
    for method in ["MGS", "AMGS", "TMGS", "MJ", "TMRBGS", "FMG"] {
        let (by_scene, _) =
            json(&format!("--scene example2 --m 11 --mu 3 --nu 2 --json --method {method}"));
        for grid in ["", "--grid 11x11"] {
            let asked = format!("{files} {grid} --tol 1e-10 --json --method {method}");
            let (by_files, status) = json(&asked);
            assert_eq!((by_files["scene"].as_str(), status), (Some("file"), 0));
            assert!(by_files["error_linf"].is_null());
            assert_eq!(by_files["n"], 121);
            assert_eq!(by_files["iterations"], by_scene["iterations"]);
            let z = market::read_vector::<f64>(&z, 121).unwrap();
            let r = market::read_vector::<f64>(&r, 121).unwrap();
            for i in 0..121 {
                assert!((z[i] - scene.z[i]).abs() <= 1e-10 && (r[i] - scene.r[i]).abs() <= 1e-10);
            }
        }
    }
    let x0 = folder.write("x0.txt", "0.5\n".repeat(121));
    let (warm, _) = json(&format!("{problem} --x0 {} --method MGS --json", x0.display()));
    assert_eq!(warm["outcome"], "converged");
    refused(&format!("{problem} --method MGS --grid 121x1"), "row 0 has an entry in column 11");
    refused(&format!("{problem} --method MGS --grid 11x12"), "a.mtx: the grid has order 132");
    refused(&format!("{problem} --method MGS --grid 11"), "such as 512x256");
    // One entry that leads round the edge of the grid.
    let text = text_of(&scene.a).replacen("121 121 561\n", "121 121 562\n11 12 -0.5\n", 1);
    let other = folder.write("other.mtx", text);
    let files = format!("--a {} --q {}", other.display(), folder.0.join("q.txt").display());
    refused(&format!("{files} --method FMG"), "the files show no grid, which this method needs");
    let said = format!("{files} --method MGS --grid 11x11");
    refused(&said, "row 10 has an entry in column 11");
}

#[test]
fn what_a_matrix_may_look_like() {
    let folder = Folder::new("forms");
    let read =
        |text: &str| entries(&market::read_matrix::<f64>(&folder.write("a.mtx", text)).unwrap());
    let expected = [(0, 0, 4.0), (0, 1, -1.0), (1, 0, -1.0), (1, 1, 3.0)];
    let general = "%%MatrixMarket matrix coordinate real general\n% note\n\n2 2 4\n1 2 -1.0\n2 1 -1e0\n2 2 3\n1 1 4\n";
    assert_eq!(read(general), expected);
    assert_eq!(read(general.trim_end()), expected);
    let symmetric = "%%matrixmarket MATRIX coordinate Integer symmetric\n2 2 3\n1 1 4\n2 1 -1\n2 2 3\n\n% end\n";
    assert_eq!(read(symmetric), expected);
    // Half of the entries are stored, less than one for each row.
    let exchange = "%%MatrixMarket matrix coordinate real symmetric\n2 2 1\n2 1 0.5\n";
    assert_eq!(read(exchange), [(0, 1, 0.5), (1, 0, 0.5)]);
    // As SciPy writes the matrices of linear programs, and those of unsigned entries.
    let skew = "%%MatrixMarket matrix coordinate real skew-symmetric\n2 2 1\n2 1 0.5\n";
    assert_eq!(read(skew), [(0, 1, -0.5), (1, 0, 0.5)]);
    // As SciPy writes arrays, by columns: those of all rows, from the diagonal on, or below it.
    let array = |text: &str| read(&format!("%%MatrixMarket matrix array {text}\n"));
    let of_three = [(0, 0, 1.0), (0, 1, 4.0), (1, 0, 2.0), (1, 1, 0.0), (2, 1, 6.0), (2, 2, 9.0)];
    assert_eq!(array("real general\n3 3\n1\n2\n0\n4\n0\n6\n0\n0\n9"), of_three);
    let lower =
        [(0, 0, 1.0), (0, 2, 3.0), (1, 1, 4.0), (1, 2, 5.0), (2, 0, 3.0), (2, 1, 5.0), (2, 2, 6.0)];
    assert_eq!(array("integer symmetric\n3 3\n1\n0\n3\n4\n5\n6"), lower);
    let below = [(0, 1, -1.0), (0, 2, -2.0), (1, 0, 1.0), (1, 2, -3.0), (2, 0, 2.0), (2, 1, 3.0)];
    assert_eq!(array("real skew-symmetric\n3 3\n1\n2\n3"), below);
    let unsigned =
        "%%MatrixMarket matrix coordinate unsigned-integer general\n2 2 2\n1 1 4\n2 2 3\n";
    assert_eq!(read(unsigned), [(0, 0, 4.0), (1, 1, 3.0)]);

    for text in [
        "%%MatrixMarket matrix array real general\n3 1\n1\n0\n-2.0\n",
        "%%MatrixMarket matrix array integer general\n3 1\n1\n0\n-2",
        "%%MatrixMarket matrix coordinate real general\n3 1 2\n3 1 -2\n1 1 1e0\n",
        "%%MatrixMarket matrix array real general\n1 3\n1\n0\n-2\n",
        "%%MatrixMarket matrix coordinate integer general\n1 3 2\n1 3 -2\n1 1 1\n",
        "1.0\n\n% note\n0\n-2\n",
        "% note\n\n1\n0\n-2\n",
    ] {
        let vector = market::read_vector::<f64>(&folder.write("q.mtx", text), 3).unwrap();
        assert_eq!(vector, [1.0, 0.0, -2.0], "{text}");
    }
    let single = folder.write("q.mtx", "%%MatrixMarket matrix array real symmetric\n1 1\n2\n");
    assert_eq!(market::read_vector::<f64>(&single, 1).unwrap(), [2.0]);
    assert!(market::read_vector::<f64>(&single, 2).is_err());
}

const HEAD: &str = "%%MatrixMarket matrix coordinate real general\n";

/// What is wrong in A, without the head of a sound file, and a word of the line that says so.
const BAD_ENTRIES: [(&str, &str); 16] = [
    ("1000000000000 1000000000000 3\n1 1 1\n", "but each needs one"),
    ("2 2 1000000000000\n1 1 1\n", "can hold"),
    ("99999999999999999999 1 3\n1 1 1\n", "99999999999999999999"),
    ("-2 2 3\n1 1 1\n", "-2"),
    ("2 3 2\n1 1 1\n2 2 1\n", "2 × 3"),
    ("0 0 0\n", "0 × 0"),
    ("2 2\n1 1 1\n2 2 1\n", "wanted"),
    ("2 2 2 9\n1 1 1\n2 2 1\n", "'9'"),
    ("2 2 3\n1 1 1\n2 2 1\n", "entry 3 of 3"),
    ("2 2 2\n1 1 1\n2 2 1\n1 2 1\n", "after the last entry"),
    ("2 2 2\n1 1 1\n3 2 1\n", "(3, 2)"),
    ("2 2 2\n1 1 1\n2 0 1\n", "(2, 0)"),
    ("2 2 3\n1 1 1\n2 2 1\n1 1 2\n", "line 5: entry (1, 1) is given twice; add such entries up"),
    ("2 2 2\n1 1 NaN\n2 2 1\n", "NaN"),
    ("2 2 2\n1 1 1e999\n2 2 1\n", "inf"),
    ("2 2 2\r\n1 1 1\r\n2 2 1\r\n", "CRLF"),
];

/// The same, with what follows `%%MatrixMarket matrix` in the head.
#[rustfmt::skip] // a table
const BAD: [(&str, &str); 8] = [
    ("coordinate real symmetric\n2 2 4\n1 1 1\n2 1 1\n2 2 1\n2 1 2\n",
     "line 6: entry (2, 1) is given twice"),
    ("coordinate integer general\n2 2 2\n1 1 1\n2 2 1.5\n",
     "line 4: 1.5 is not a whole number, as the banner's 'integer' says; write 'real' there"),
    ("coordinate Integer symmetric\n2 2 2\n1 1  1e-9\n2 2 1\n",
     "line 3: 1e-9 is not a whole number"),
    ("coordinate pattern general\n2 2 2\n1 1\n2 2\n", "is not"),
    ("coordinate complex general\n2 2 2\n1 1 1 0\n2 2 1 0\n", "is not"),
    ("array real general\n2 2\n1\n0\n0\n", "entry 4 of 4"),
    ("coordinate real symmetric\n2 2 3\n1 1 1\n2 2 1\n1 2 2\n", "above the diagonal"),
    ("coordinate real skew-symmetric\n2 2 2\n2 1 1\n2 2 1\n", "is on the diagonal"),
];

#[test]
fn bad_files_are_refused_in_one_line_and_harm_nothing() {
    let folder = Folder::new("bad");
    let sound = folder.write("sound.mtx", format!("{HEAD}2 2 2\n1 1 4\n2 2 3\n"));
    let q = folder.write("q.txt", "-1\n2\n");
    let z = folder.write("z.mtx", "precious");
    let command = |a: &Path, b: &Path, q: &Path| {
        let [a, b, q, z] = [a, b, q, &z].map(|p| p.display());
        format!("--a {a} --b {b} --q {q} --method MGS --out-z {z}")
    };
    let entries = BAD_ENTRIES.map(|(text, named)| (format!("{HEAD}{text}"), named));
    let heads = BAD.map(|(text, named)| (format!("%%MatrixMarket matrix {text}"), named));
    let none = [("", "banner"), ("2 2 2\n1 1 1\n2 2 1\n", "is not")];
    let none = none.map(|(text, named)| (text.to_owned(), named));
    for (text, named) in entries.into_iter().chain(heads).chain(none) {
        let bad = folder.write("bad.mtx", text);
        refused(&command(&bad, &sound, &q), named);
        refused(&command(&sound, &bad, &q), named);
    }
    let not_text =
        folder.write("bytes.mtx", [HEAD.as_bytes(), b"2 2 2\n1 1 \xff\n2 2 1\n"].concat());
    refused(&command(&not_text, &sound, &q), "UTF-8");
    for (bytes, named) in [
        (&b"\x1f\x8b\x08\0"[..], "is compressed by gzip; unpack it with gunzip"),
        (b"\x93NUMPY\x01\0", "is an NPY file"),
    ] {
        refused(&command(&folder.write("packed.mtx", bytes), &sound, &q), named);
        refused(&command(&sound, &sound, &folder.write("packed", bytes)), named);
    }
    let endless = folder.write("line.mtx", "%".repeat(1 << 17));
    refused(&command(&endless, &sound, &q), "longer than");
    refused(&command(&folder.0, &sound, &q), folder.0.to_str().unwrap());
    refused(&command(&folder.0.join("none"), &sound, &q), "none");

    for (text, named) in [
        ("", "banner"),
        ("1.25\n", "entry 2 of 2, one for each row of the matrix, should be"),
        ("1,25\n2,5\n", "'1,25' is no number for 'value'; write decimals with a point"),
        ("1\n2\n3\n", "after the last entry"),
        ("1\nx\n", "'x'"),
        ("1\nnan\n", "NaN"),
        ("1\r\n2\r\n", "CRLF"),
        ("%%MatrixMarket matrix array real general\n3 1\n1\n2\n3\n", "3 × 1 where 2 × 1"),
        ("%%MatrixMarket matrix array real general\n1 3\n1\n2\n3\n", "1 × 3 where 2 × 1"),
        ("%%MatrixMarket matrix array integer general\n2 1\n1\n0.5\n", "0.5 is not a whole"),
        ("%%MatrixMarket matrix coordinate real general\n1 2 1\n2 1 1\n", "outside 1 × 2"),
        ("%%MatrixMarket matrix array real general\n1000000000000 1\n1\n", "1000000000000 × 1"),
        ("%%MatrixMarket matrix coordinate real general\n2 1 2\n1 1 1\n1 1 2\n", "given twice"),
        ("%%MatrixMarket matrix coordinate real general\n2 1 1\n3 1 1\n", "(3, 1)"),
        ("%%MatrixMarket matrix coordinate real general\n2 1 1\n2 2 1\n", "(2, 2)"),
        ("%%MatrixMarket matrix array real general\n2 2\n1\n2\n", "2 × 2 where 2 × 1"),
        ("%%MatrixMarket matrix coordinate real general\n2 1 4000000000\n2 1 1\n", "can hold"),
    ] {
        refused(&command(&sound, &sound, &folder.write("bad.txt", text)), named);
    }
    let large = folder.write("large.mtx", format!("{HEAD}2 2 2\n1 1 4\n2 2 1e99\n"));
    let narrow = format!("{} --precision f32", command(&large, &sound, &q));
    refused(&narrow, "line 4: 1e99 does not fit f32; take f64");
    let wide = folder.write("wide.mtx", format!("{HEAD}3 3 3\n1 1 4\n2 2 3\n3 3 1\n"));
    refused(&command(&sound, &wide, &q), "order 3");
    assert_eq!(fs::read_to_string(&z).unwrap(), "precious");
}

/// A cell that is left out is not passed over, and a comma is not guessed at.
#[test]
fn maps_and_profiles_lose_no_cell() {
    let folder = Folder::new("cells");
    let run = |form: &str| {
        let size = "--lx 0.05 --ly 0.03 --h-unit um --speed 3 --viscosity 0.04 --json";
        let arguments = match form {
            "profile" => "map --speed 3 --viscosity 0.04 --x-unit mm --h-unit um".to_owned(),
            _ => format!("--map map {size}"),
        };
        run_in(&folder.0, "film", &arguments)
    };
    let empty = npy(1, "<f8", "False", "(0, 4)", &[]);
    for (bytes, form, named) in [
        (&b"40,30\n40,,30\n"[..], "map", "map, line 2: column 2 is empty; write a number there"),
        (b"40,30,\n40,30,\n", "map", "map, line 1: column 3 is empty"),
        (b";40;30\n", "map", "map, line 1: column 1 is empty"),
        (b"40\t\t30\n", "map", "map, line 1: column 2 is empty"),
        (b"# h\n40,5\n30,2\n", "map", "map: two columns of whole numbers, or one with decimal"),
        (b"\"40,5\";\"30,2\"\n", "map", "map, line 1: a comma within numbers"),
        (b"\x1f\x8b\x08\0", "map", "map: is compressed by gzip; unpack it with gunzip"),
        (b"PK\x03\x04", "map", "map: is a ZIP archive"),
        (&empty, "map", "map: the array has the shape (0, 4), and so no numbers"),
        (b"0,,40\n50,,20\n", "profile", "map, line 1: column 2 is empty"),
        (b"\x1f\x8b\x08\0", "profile", "map: is compressed by gzip"),
        (b"0 \xff\n", "profile", "map: neither an NPY file nor text"),
    ] {
        folder.write("map", bytes);
        is_refusal(&run(form), form, named);
    }
    let load = |text_of: &str| {
        folder.write("map", text_of);
        let report = succeeded(&run("map"), text_of);
        let report: serde_json::Value = serde_json::from_str(&report).unwrap();
        (report["load_n"].clone(), report["unknowns"].clone())
    };
    let plain = load("40 30\n40 30\n");
    for same in
        ["40;30\n40;30\n", "40.0, 30\n40, 30\n", "\"40\",\"30\"\n\"40\",30\n", "40\t30\n40\t30"]
    {
        assert_eq!(load(same), plain, "{same}");
    }
}
