//! Splittings of one's own: Gauss–Seidel by grid lines, and a library's sparse factorisation.
//!
//! ```text
//! cargo run --release --example custom_splitting
//! ```
//!
//! A pair of stencils couples neighbours in a grid line 20 times as strongly as neighbouring lines.
//! Point Gauss–Seidel crawls; a splitting that solves for a whole line at a time does not, and one
//! that solves with all of A + BΩ is the limit of what a splitting can do. The program ends with an
//! error if the three answers differ.

use std::error::Error;

use hlcp_core::{Aor, FivePoint, Hlcp, Omega, Rows, Splitting};
use hlcp_methods::{Limits, Method, Mms, Options, Solver};
use nalgebra::DMatrix;
use nalgebra_sparse::{CooMatrix, CscMatrix, factorization::CscCholesky};

const NX: usize = 40;
const NY: usize = 30;
const A: [f64; 5] = [-0.5, -10.0, 21.2, -10.0, -0.5];
const B: [f64; 5] = [0.0, -5.0, 10.2, -5.0, 0.0];
const OMEGA: f64 = 2.0;

/// The entries of A + BΩ, in the order south, west, centre, east, north.
fn system() -> [f64; 5] {
    std::array::from_fn(|k| A[k] + OMEGA * B[k])
}

/// Block Gauss–Seidel: M is everything but the couplings to the next line.
struct Lines;

impl Splitting<f64> for Lines {
    fn solve(&self, rhs: &[f64], y: &mut [f64]) {
        let [south, west, centre, east, _] = system();
        let mut upper = [0.0; NX];
        for (j, rhs) in rhs.chunks(NX).enumerate() {
            let (below, line) = y[..(j + 1) * NX].split_at_mut(j * NX);
            // Thomas' algorithm for tridiag(west; centre; east) line = rhs − south·(the line
            // below).
            for i in 0..NX {
                let known = if j > 0 { south * below[(j - 1) * NX + i] } else { 0.0 };
                let (before, above) = if i > 0 { (line[i - 1], upper[i - 1]) } else { (0.0, 0.0) };
                let pivot = centre - west * above;
                upper[i] = east / pivot;
                line[i] = (rhs[i] - known - west * before) / pivot;
            }
            for i in (0..NX - 1).rev() {
                line[i] -= upper[i] * line[i + 1];
            }
        }
    }
}

/// All of A + BΩ, assembled and factorised by a library, as a closure.
fn whole() -> Result<impl Splitting<f64>, Box<dyn Error>> {
    let sum = FivePoint::new(NX, NY, system())?;
    let mut coo = CooMatrix::new(NX * NY, NX * NY);
    for i in 0..NX * NY {
        sum.visit_row(i, &mut |j, a| coo.push(i, j, a));
    }
    let factors = CscCholesky::factor(&CscMatrix::from(&coo))?;
    Ok(move |rhs: &[f64], y: &mut [f64]| {
        let solution = factors.solve(&DMatrix::from_column_slice(rhs.len(), 1, rhs));
        y.copy_from_slice(solution.as_slice());
    })
}

fn solve(name: &str, method: impl Method<f64>) -> Result<(usize, Vec<f64>), Box<dyn Error>> {
    let n = method.problem().order();
    let q: Vec<f64> = (0..n).map(|i| f64::cos((i % NX) as f64 / 6.0) - 0.1).collect();
    let mut solver = Solver::new(method);
    let outcome =
        solver.solve(&q, Options::from_x(&vec![1.0; n]).limits(Limits::absolute(1e-10)))?;
    println!("{name:<22} {outcome}");
    outcome.ok()?;
    Ok((outcome.iterations, solver.z().to_vec()))
}

fn main() -> Result<(), Box<dyn Error>> {
    let (a, b) = (FivePoint::new(NX, NY, A)?, FivePoint::new(NX, NY, B)?);
    let problem = Hlcp::new(a, b, Omega::Uniform(OMEGA))?;
    let points = solve("point Gauss–Seidel", Mms::new(problem.clone(), Aor::gauss_seidel())?)?;
    let lines = solve("line Gauss–Seidel", Mms::with_splitting(problem.clone(), Lines)?)?;
    let whole = solve("sparse Cholesky", Mms::with_splitting(problem, whole()?)?)?;

    let apart =
        |u: &[f64], v: &[f64]| u.iter().zip(v).map(|(u, v)| (u - v).abs()).fold(0.0, f64::max);
    let apart = apart(&points.1, &lines.1).max(apart(&points.1, &whole.1));
    println!("the answers differ by at most {apart:.1e}");
    if apart < 1e-8 && lines.0 < points.0 { Ok(()) } else { Err("the splittings disagree".into()) }
}
