//! External problems with exact answers (see `../data/siconos-lcp/README.md`), solved through files
//! by the command `solve`, as a user would.

use approx::abs_diff_eq;
use std::{fs, path::Path};

use hlcp::market;
use nalgebra::{DMatrix, DVector};
use serde_json::Value;

use crate::{command::json, folder::Folder};

/// M and q of an LCP file.
fn read(name: &str) -> (DMatrix<f64>, Vec<f64>) {
    let text = fs::read_to_string(Path::new("tests/data/siconos-lcp").join(name)).unwrap();
    let mut numbers = text.split_whitespace().map_while(|word| word.parse::<f64>().ok());
    let mut number = || numbers.next().expect("the file goes on");
    let n = number() as usize;
    // The storage, and rows and columns twice.
    (0..5).for_each(|_| _ = number());
    let matrix = DMatrix::from_fn(n, n, |_, _| number()); // filled by columns, as the file is
    let q = (0..n).map(|_| number()).collect();
    (matrix, q)
}

/// A problem in files, with B the identity.
struct Files {
    folder: Folder,
    command: String,
}

impl Files {
    fn new(name: &str, a: &DMatrix<f64>, q: &[f64]) -> Self {
        let folder = Folder::new(name);
        let [z, r] = ["z.mtx", "r.mtx"].map(|name| folder.0.join(name));
        let problem = folder.problem(&[("a", a)], q);
        let command = format!("{problem} --out-z {} --out-r {}", z.display(), r.display());
        Self { folder, command }
    }

    /// The report of a method, z and r.
    fn solve(&self, method: &str, order: usize) -> (Value, Vec<f64>, Vec<f64>) {
        let (report, _) = json(&format!("{} --json --method {method}", self.command));
        let read = |file| market::read_vector(self.folder.0.join(file), order).unwrap();
        (report, read("z.mtx"), read("r.mtx"))
    }
}

const METHODS: [&str; 9] = ["MJ", "MGS", "AMJ", "AMGS", "TMJ", "TMGS", "MSOR3", "AMAOR3", "TMAOR3"];

fn expected() -> Value {
    let text = fs::read_to_string("tests/data/siconos-lcp/expected.json").unwrap();
    serde_json::from_str(&text).unwrap()
}

#[test]
fn h_plus_files_are_solved_exactly_by_every_method() {
    let mut files = 0;
    for (name, facts) in expected().as_object().unwrap() {
        if facts["h_plus"] != true {
            continue;
        }
        files += 1;
        let (matrix, q) = read(name);
        let command = Files::new(name, &matrix, &q);
        for method in METHODS {
            let (report, z, r) = command.solve(method, q.len());
            assert_eq!(report["outcome"], "converged", "{name} {method}");
            // The modulus method's residual bounds the error through ‖M⁻¹‖, at most 3^6 here.
            for (found, key) in [(z, "z"), (r, "w")] {
                for (i, found) in found.iter().enumerate() {
                    let exact = facts["solutions"][0][key][i].as_f64().unwrap();
                    let is_near = abs_diff_eq!(*found, exact, epsilon = 729.0 * 1e-10);
                    assert!(is_near, "{name} {method} {key}[{i}]");
                }
            }
        }
    }
    assert_eq!(files, 3);
}

#[test]
fn zero_diagonals_are_solved_where_there_is_a_solution() {
    let mut solved = vec![];
    for name in ["lcp_CPS_2.dat", "lcp_CPS_4.dat", "lcp_Pang_isolated_sol_perturbed.dat"] {
        let (matrix, q) = read(name);
        let command = Files::new(name, &matrix, &q);
        for method in METHODS.into_iter().chain(["AUTO", "PIVOTING"]) {
            let (report, z, r) = command.solve(method, q.len());
            if report["outcome"] == "converged" {
                let w = &matrix * DVector::from_column_slice(&z) + DVector::from_vec(q.clone());
                let off = z.iter().zip(&w).map(|(z, w)| z.min(*w).abs()).fold(0.0, f64::max);
                assert!(off <= 1e-8 && w.iter().zip(&r).all(|(w, r)| (w - r).abs() <= 1e-8));
                solved.push((name, method));
            }
        }
    }
    for method in ["AUTO", "PIVOTING"] {
        for name in ["lcp_CPS_2.dat", "lcp_CPS_4.dat"] {
            assert!(solved.contains(&(name, method)), "{solved:?}");
        }
    }
    assert!(
        solved.iter().all(|(name, _)| !name.contains("Pang")),
        "it has no solution: {solved:?}"
    );
}

#[test]
fn a_segment_of_solutions_is_met_in_one_of_its_points_or_not_at_all() {
    let (matrix, q) = read("lcp_CPS_1.dat");
    let command = Files::new("segment", &matrix, &q);
    let mut met = 0;
    for method in METHODS {
        let (report, z, r) = command.solve(method, 2);
        if report["outcome"] == "converged" {
            met += 1;
            assert!((z[0] + z[1] - 1.0).abs() <= 1e-10, "{method}");
            assert!(r.iter().all(|&r| r <= 1e-10), "{method}");
        }
    }
    assert!(met > 0);
}
