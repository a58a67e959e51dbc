use std::iter;

use crate::{
    Aor, Error, Hlcp, Norms, Rhs, Rows, Scalar, Step,
    norms::{BLOCK, Meter, Part, Tally},
    rows::{Relaxed, Source, Visited},
    team::{self, Claims, Sum},
};

/// Rows that one thread relaxes in one go.
const PORTION: usize = 512;

/// An [`Aor`] splitting in a multicolour order: a splitting of its own, whose sweeps over any rows
/// run in parallel.
///
/// Each row has the least colour that no earlier row has which it is coupled to, in `A` or in `B`,
/// in either direction. With the permutation `P` that sorts by colour, and by index within a
/// colour, `M = Pᵀ M′P`, where `M′` is the AOR splitting of `P A Pᵀ` and `P B Pᵀ`: another method
/// than in the order of the rows, with iterates and counts of its own, but with the theorems that
/// hold for every pair of a class. Rows of one colour do not wait for one another, so all threads
/// relax them together; the bits are the same for any number of threads.
///
/// On a five-point grid there are two colours, and [`Aor::red_black`] is faster.
///
/// # Cost
///
/// The colours take a walk over the rows and, at set-up alone, 16 bytes an entry; they keep 12 to
/// 16 bytes a row. A step is one walk over the rows of `A` and of `B`, `n` numbers of scratch, and
/// a copy of the new values, which is not shared; rows that lie far apart are read in turn, which
/// on one thread costs more than the order of the rows.
///
/// ```
/// use hlcp_core::{Aor, FivePoint, Hlcp, Identity, Multicolour, Omega, Rhs, Step};
///
/// let a = FivePoint::new(3, 1, [0.0, -1.0, 3.0, -1.0, 0.0])?;
/// let problem = Hlcp::new(a, Identity { order: 3 }, Omega::Uniform(3.0))?;
/// let coloured = Multicolour::new(Aor::gauss_seidel(), &problem);
/// assert_eq!(coloured.colours(), 2);
/// let (q, mut y) = ([-6.0, 0.0, -12.0], [0.0; 3]);
/// coloured.step(&problem, &Rhs::new(&q)?, &[0.0; 3], &mut y, &mut vec![]);
/// assert_eq!(y, [1.0, 0.5, 2.0]); // the first and the last row, then the one between
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Multicolour<T> {
    aor: Aor<T>,
    /// The colour of each row.
    colours: Vec<u32>,
    /// The rows by colour, and by index within a colour.
    rows: Vec<usize>,
    /// Where each colour begins in `rows`, and the end.
    starts: Vec<usize>,
}

impl<T: Scalar> Multicolour<T> {
    /// The splitting with the parameters and the direction of `aor` in the colours of the problem's
    /// rows; a red–black order of `aor` is dropped.
    pub fn new<A: Rows<T>, B: Rows<T>>(aor: Aor<T>, problem: &Hlcp<T, A, B>) -> Self {
        let n = problem.order();
        // For each row its later neighbours: those that it names, or that name it.
        let mut pairs = vec![];
        for i in 0..n {
            let mut couple = |j: usize, entry: T| {
                if j != i && entry != T::zero() {
                    pairs.push((i.max(j), i.min(j)));
                }
            };
            problem.a().visit_row(i, &mut couple);
            problem.b().visit_row(i, &mut couple);
        }
        pairs.sort_unstable();
        let (mut colours, mut taken): (Vec<u32>, Vec<usize>) = (vec![], vec![]);
        let mut pairs = pairs.into_iter().peekable();
        for i in 0..n {
            while let Some((_, earlier)) = pairs.next_if(|&(later, _)| later == i) {
                taken[colours[earlier] as usize] = i + 1;
            }
            let free = taken.iter().position(|&by| by != i + 1).unwrap_or(taken.len());
            if free == taken.len() {
                taken.push(0);
            }
            colours.push(free as u32);
        }
        let mut rows: Vec<usize> = (0..n).collect();
        rows.sort_by_key(|&i| colours[i]);
        let starts = (0..=taken.len() as u32)
            .map(|colour| rows.partition_point(|&i| colours[i] < colour))
            .collect();
        Self { aor, colours, rows, starts }
    }

    /// The number of colours: how often threads wait for one another in a sweep.
    pub fn colours(&self) -> usize {
        self.starts.len() - 1
    }

    fn sweep<A: Rows<T>, B: Rows<T>, const ACCELERATED: bool>(
        &self,
        problem: &Hlcp<T, A, B>,
        q: &Rhs<'_, T>,
        x: &[T],
        y: &mut [T],
        scratch: &mut Vec<T>,
    ) -> Norms {
        let (relaxed, meter) = (self.aor.relaxed(problem, q, x), q.meter(problem.gamma()));
        match problem.known() {
            Some([a, b]) => {
                let sweep = T::loops().sweep_colours[usize::from(ACCELERATED)];
                sweep(self, &relaxed, [a.rows(), b.rows()], meter, y, scratch)
            }
            None => {
                let pair = (Visited::new(problem.a()), Visited::new(problem.b()));
                self.walk::<ACCELERATED>(&relaxed, pair, meter, y, scratch)
            }
        }
    }

    /// The sweep over rows, colour by colour, and the norms of F(x)/γ.
    pub(crate) fn walk<const ACCELERATED: bool>(
        &self,
        relaxed: &Relaxed<'_, T>,
        (a, b): (impl Source<T> + Sync, impl Source<T> + Sync),
        meter: Meter,
        y: &mut [T],
        scratch: &mut Vec<T>,
    ) -> Norms {
        let threads = team::threads(relaxed.parallel, y.len());
        if scratch.len() < y.len() {
            scratch.resize(y.len(), T::zero());
        }
        let mut total = Part::default();
        for step in 0..self.colours() {
            let colour = if self.aor.is_backward() { self.colours() - 1 - step } else { step };
            let rows = &self.rows[self.starts[colour]..self.starts[colour + 1]];
            let values = &mut scratch[..rows.len()];
            let portions = rows.chunks(PORTION).zip(values.chunks_mut(PORTION)).enumerate();
            let (portions, sum, old) = (Claims::new(portions), Sum::new(), &*y);
            let passed = |j: usize| {
                let other = self.colours[j] as usize;
                if self.aor.is_backward() { other > colour } else { other < colour }
            };
            team::spread(threads, &|| {
                let (mut a, mut b) = (a.clone(), b.clone());
                while let Some((number, (rows, values))) = portions.next() {
                    let mut f = [T::zero(); PORTION];
                    for ((&i, value), f) in rows.iter().zip(values).zip(&mut f) {
                        (*f, *value) = relaxed.row::<ACCELERATED>(i, &mut a, &mut b, old, passed);
                    }
                    let mut tally = Tally::zero();
                    f[..rows.len()].chunks(BLOCK).for_each(|block| tally.add(meter, block));
                    sum.add(number, iter::once((0, tally.part())));
                }
            });
            total.add(sum.total().sum(None));
            for (&i, &value) in rows.iter().zip(&scratch[..rows.len()]) {
                y[i] = value;
            }
        }
        meter.norms_of(total, relaxed.gamma)
    }
}

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Step<T, A, B> for Multicolour<T> {
    /// Refuses, as [`Aor`] does, and [`Error::Order`] a problem of another order than the one whose
    /// rows have their colours here. Rows of one colour that are coupled in another problem are
    /// relaxed as Jacobi relaxes them.
    fn check(&self, problem: &Hlcp<T, A, B>) -> Result<(), Error> {
        let (found, expected) = (self.colours.len(), problem.order());
        if found != expected {
            return Err(Error::Order { what: "the multicolour order", found, expected });
        }
        problem.on_one_rank("a sweep in multicolour order")?;
        self.aor.check(problem)
    }

    fn step(
        &self,
        problem: &Hlcp<T, A, B>,
        q: &Rhs<'_, T>,
        x: &[T],
        y: &mut [T],
        scratch: &mut Vec<T>,
    ) -> Norms {
        problem.assert_orders([q.entries().len(), x.len(), y.len(), self.colours.len()]);
        if self.aor.is_accelerated() {
            self.sweep::<A, B, true>(problem, q, x, y, scratch)
        } else {
            self.sweep::<A, B, false>(problem, q, x, y, scratch)
        }
    }
}
