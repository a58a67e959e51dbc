//! Sweeps over rows against loops by hand over the same arrays: prints a table of
//! `docs/results/sweeps.md`.
//!
//! ```text
//! cargo bench --bench rows
//! ```
//!
//! By the processor time of one thread, unless said.

mod common;

use std::{error::Error, hint::black_box, time::Instant};

use common::{against, done, seconds};
use hlcp_core::{Aor, Csr, FivePoint, Hlcp, Identity, Multicolour, Omega, Rhs, RowMajor, Step};

/// Runs that are measured together, since the system counts processor time in steps.
const BATCH: u32 = 30;

/// Example 1 with μ = ν = 4 on an m × m grid, and vectors to sweep over.
const M: usize = 512;
const A: [f64; 5] = [-1.0, -1.0, 8.0, -1.0, -1.0];
const B: [f64; 5] = [0.0, -1.0, 8.0, -1.0, 0.0];

/// The arrays of a matrix in compressed sparse rows.
struct Arrays {
    offsets: Vec<u32>,
    columns: Vec<u32>,
    values: Vec<f64>,
}

impl Arrays {
    fn of(matrix: &Csr<'_, f64>) -> Self {
        let (offsets, columns, values) = matrix.arrays();
        let [offsets, columns] =
            [offsets, columns].map(|list| list.into_iter().map(|index| index as u32).collect());
        Self { offsets, columns, values: values.to_vec() }
    }
}

/// A half-step by hand on the arrays of A and B, with `q`, from `x` to `y`.
type Loop = fn([&Arrays; 2], &[f64], &[f64], &mut [f64]) -> f64;

/// The half-step of Gauss–Seidel for Ω = I as one would write it for two matrices in compressed
/// sparse rows, with ‖F(x)‖².
fn by_hand<const BACKWARD: bool, const ACCELERATED: bool>(
    [a, b]: [&Arrays; 2],
    q: &[f64],
    x: &[f64],
    y: &mut [f64],
) -> f64 {
    let n = x.len();
    let mut squares = 0.0;
    for step in 0..n {
        let i = if BACKWARD { n - 1 - step } else { step };
        let (mut f, mut moved, mut pivot) = (q[i], 0.0, 0.0);
        for (of, sign) in [(a, 1.0), (b, -1.0)] {
            for k in of.offsets[i] as usize..of.offsets[i + 1] as usize {
                let (j, entry) = (of.columns[k] as usize, of.values[k]);
                let x = x[j];
                f += entry * (x + sign * x.abs());
                if if BACKWARD { j > i } else { j < i } {
                    moved += entry * (y[j] - x);
                    if ACCELERATED {
                        moved += sign * entry * (y[j].abs() - x.abs());
                    }
                } else if j == i {
                    pivot += entry;
                }
            }
        }
        y[i] = x[i] - (f + moved) / pivot;
        squares += f * f;
    }
    squares
}

/// Seconds of processor time that this thread has had, where the system tells, and else the time.
fn clock(begun: Instant) -> f64 {
    let schedule = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds = schedule.split_whitespace().next().and_then(|word| word.parse::<f64>().ok());
    nanoseconds.map_or_else(|| begun.elapsed().as_secs_f64(), |ns| ns * 1e-9)
}

/// Compares two rivals by processor time.
fn row(
    [what, rival, target]: [&str; 3],
    n: usize,
    mut ours: impl FnMut(),
    mut theirs: impl FnMut(),
) {
    let begun = Instant::now();
    let seconds = |run: &mut dyn FnMut()| {
        let start = clock(begun);
        (0..BATCH).for_each(|_| run());
        (clock(begun) - start) / f64::from(BATCH)
    };
    common::row(what, rival, target, n, against(|| seconds(&mut ours), || seconds(&mut theirs)));
}

fn main() -> Result<(), Box<dyn Error>> {
    let n = M * M;
    let (a, b) = (FivePoint::new(M, M, A)?, FivePoint::new(M, M, B)?);
    let wave = |rate: f64, n: usize| (0..n).map(|i| (i as f64 * rate).sin()).collect::<Vec<_>>();
    let (q, x) = (wave(1.0, n), wave(1.7, n));
    let (mut y, mut other) = (vec![0.0; n], vec![0.0; n]);
    let (rhs, omega) = (Rhs::new(&q)?, Omega::Uniform(1.0));
    // With 32 bits an index, and with 64.
    let [csr_a, csr_b] = [&a, &b].map(Csr::from_rows);
    let [of_a, of_b] = [&csr_a, &csr_b].map(Arrays::of);
    let rows = Hlcp::new(&csr_a, &csr_b, omega.clone())?;
    let [wide_a, wide_b] = [&csr_a, &csr_b].map(|of| {
        let (offsets, columns, values) = of.arrays();
        Csr::new(offsets, columns, values)
    });
    let wide = Hlcp::new(wide_a?, wide_b?, omega.clone())?;
    let grid = Hlcp::new(a, b, omega.clone())?;
    let aor = Aor::gauss_seidel();

    println!("| what | against | ratio | target | ns per unknown |\n|---|---|---|---|---|");
    let ways = [
        ("assembled rows, MMS", aor, by_hand::<false, false> as Loop),
        ("the same backward", aor.backward(), by_hand::<true, false>),
        ("the same, AMMS", aor.accelerated(), by_hand::<false, true>),
    ];
    for (what, aor, by_hand) in ways {
        row(
            [what, "the loop by hand", "≤ 1.2"],
            n,
            || done(aor.step(&rows, &rhs, &x, &mut y, &mut vec![])),
            || done(by_hand([&of_a, &of_b], &q, &x, &mut other)),
        );
    }
    row(
        ["64-bit indices, MMS", "32-bit indices", ""],
        n,
        || done(aor.step(&wide, &rhs, &x, &mut y, &mut vec![])),
        || done(aor.step(&rows, &rhs, &x, &mut other, &mut vec![])),
    );
    row(
        ["assembled rows, MMS", "the same grid known as one", ""],
        n,
        || done(aor.step(&rows, &rhs, &x, &mut y, &mut vec![])),
        || done(aor.step(&grid, &rhs, &x, &mut other, &mut vec![])),
    );
    let coloured = Multicolour::new(aor, &rows);
    let (mut scratch, mut more) = (vec![], vec![]);
    row(
        ["multicolour order, MMS", "the order of the rows", ""],
        n,
        || done(coloured.step(&rows, &rhs, &x, &mut y, &mut scratch)),
        || done(aor.step(&rows, &rhs, &x, &mut other, &mut vec![])),
    );
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build()?;
    let together = rows.clone().in_parallel();
    let alone = || seconds(M, || done(coloured.step(&rows, &rhs, &x, &mut y, &mut scratch)));
    let shared = || {
        let step = || done(coloured.step(&together, &rhs, &x, &mut other, &mut more));
        pool.install(|| seconds(M, step))
    };
    common::row("one thread, multicolour", "2 threads", "≥ 1.6", n, against(alone, shared));

    let order = 1000;
    let entries: Vec<f64> = (0..order * order)
        .map(|k| if k % (order + 1) == 0 { order as f64 } else { (k as f64).sin() })
        .collect();
    let dense = Hlcp::new(RowMajor::new(order, &entries)?, Identity { order }, omega)?;
    let (q, x) = (wave(1.0, order), wave(1.7, order));
    let (rhs, mut y, mut other) = (Rhs::new(&q)?, vec![0.0; order], vec![0.0; order]);
    row(
        ["dense rows and I, n = 1000, MMS", "the loop by hand", ""],
        order,
        || done(aor.step(&dense, &rhs, &x, &mut y, &mut vec![])),
        || {
            for i in 0..order {
                let entries = &entries[i * order..(i + 1) * order];
                let (mut f, mut moved) = (q[i] - (x[i].abs() - x[i]), 0.0);
                for (j, &a) in entries.iter().enumerate() {
                    f += a * (x[j] + x[j].abs());
                    if j < i {
                        moved += a * (other[j] - x[j]);
                    }
                }
                other[i] = x[i] - (f + moved) / (entries[i] + 1.0);
            }
            black_box(&other);
        },
    );
    Ok(())
}
