use std::cmp::Ordering;

use hlcp_core::{Csr, Error, Hlcp, Norms, Omega, Rhs, Rows, Scalar, assert_lengths};

use crate::{AutoTurn, Clock, Method, Status, Work, method::iterate};

/// A method that works on the problem with its unknowns in another order.
///
/// A sweep passes on along its rows what it finds, so the order of these matters: one along the
/// flow solves in a sweep what is carried along, and strings in theirs are tridiagonal. Where the
/// unknowns are numbered at random that is lost, and each row waits for memory.
/// [`cuthill_mckee`] finds a better order.
///
/// # Cost
///
/// A copy of `A` and `B`, the order and four vectors; a step moves three of them.
///
/// # Source
///
/// E. Cuthill and J. McKee, *Reducing the bandwidth of sparse symmetric matrices*, Proc. 24th
/// National Conference ACM (1969); from which row to begin: A. George and J. W. H. Liu, *An
/// implementation of a pseudoperipheral node finder*, ACM TOMS 5 (1979).
///
/// ```
/// use hlcp_methods::{Auto, Csr, Hlcp, Identity, Limits, Renumbered, Solver, cuthill_mckee};
///
/// // 1000 masses between two walls on springs, the k-th of which is called 367 k modulo 1000.
/// let n = 1000;
/// let mut rows = vec![vec![]; n];
/// for k in 0..n {
///     let name = |k: usize| 367 * k % n;
///     rows[name(k)].push((name(k), 2.0));
///     for near in [k.wrapping_sub(1), k + 1].into_iter().filter(|&near| near < n) {
///         rows[name(k)].push((name(near), -1.0));
///     }
///     rows[name(k)].sort_by_key(|entry| entry.0);
/// }
/// let (columns, values): (Vec<usize>, Vec<f64>) = rows.iter().flatten().copied().unzip();
/// let offsets: Vec<usize> =
///     (0..=n).map(|i| rows[..i].iter().map(Vec::len).sum()).collect();
/// let problem = Hlcp::lcp(Csr::new(offsets, columns, values)?)?;
///
/// let order = cuthill_mckee(&problem).expect("they are far from each other");
/// let mut solver = Solver::new(Renumbered::new(problem, order, Auto::new)?);
/// assert!(solver.solve(&vec![-1e-3; n], Limits::default())?.converged());
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Renumbered<T: Scalar, A, B, M> {
    problem: Hlcp<T, A, B>,
    /// The unknowns in the order that they are worked on.
    order: Vec<usize>,
    inner: M,
    q: Vec<T>,
    x: Vec<T>,
    y: Vec<T>,
    spare: Vec<T>,
}

/// Unknowns are numbered anew where those that are coupled are this part of the order from each
/// other in the mean, a third if they are numbered at random, and come nearer by this factor.
const QUARTER: f64 = 0.25;

impl<T, A, B, M> Renumbered<T, A, B, M>
where
    T: Scalar,
    A: Rows<T>,
    B: Rows<T>,
    M: Method<T, A = Csr<'static, T>, B = Csr<'static, T>>,
{
    /// The method that `method` makes of the problem whose unknown `i` is `order[i]` of `problem`.
    ///
    /// # Errors
    ///
    /// What `method` refuses.
    ///
    /// # Panics
    ///
    /// Unless `order` has each of the problem's unknowns once.
    pub fn new(
        problem: Hlcp<T, A, B>,
        order: Vec<usize>,
        method: impl FnOnce(Hlcp<T, M::A, M::B>) -> Result<M, Error>,
    ) -> Result<Self, Error> {
        let n = problem.order();
        let mut places = vec![usize::MAX; n];
        order.iter().enumerate().for_each(|(place, &i)| places[i] = place);
        assert_lengths(n, [("order", order.len())]);
        assert!(!places.contains(&usize::MAX), "order has an unknown twice, not each once");
        let omega = match problem.omega() {
            Omega::Uniform(omega) => Omega::Uniform(*omega),
            Omega::Each(omega) => Omega::Each(order.iter().map(|&i| omega[i]).collect()),
        };
        let [a, b] =
            [permuted(problem.a(), &order, &places)?, permuted(problem.b(), &order, &places)?];
        let inner = Hlcp::new(a, b, omega)?.with_gamma(problem.gamma())?;
        #[cfg(feature = "rayon")]
        let inner = if problem.is_parallel() { inner.in_parallel() } else { inner };
        let inner = method(inner)?;
        let [q, x, y, spare] = [(); 4].map(|()| vec![T::zero(); n]);
        Ok(Self { problem, order, inner, q, x, y, spare })
    }

    /// Overwrites `q` and `x` with those of the problem in its other order.
    fn take_in(&mut self, q: &Rhs<'_, T>, x: &[T]) {
        // That problem is not an exchanged one.
        let sign = self.problem.q_factor().signum();
        for ((own_q, own_x), &i) in self.q.iter_mut().zip(&mut self.x).zip(&self.order) {
            *own_q = sign * q.entries()[i];
            *own_x = x[i];
        }
    }
}

/// The matrix of an operator, its rows and columns in `order`.
fn permuted<T: Scalar>(
    operator: &impl Rows<T>,
    order: &[usize],
    places: &[usize],
) -> Result<Csr<'static, T>, Error> {
    let (mut offsets, mut columns, mut values) = (vec![0], vec![], vec![]);
    let mut row = vec![];
    for &i in order {
        row.clear();
        operator.visit_row(i, &mut |j, a| row.push((places[j], a)));
        row.sort_unstable_by_key(|entry| entry.0);
        columns.extend(row.iter().map(|entry| entry.0));
        values.extend(row.iter().map(|entry| entry.1));
        offsets.push(columns.len());
    }
    Csr::new(offsets, columns, values)
}

/// Returns an order of the unknowns in which those that `A` or `B` couples are near each other; of
/// a problem whose own is as good as random, and if there is one.
///
/// They come as a walk reaches them that takes first those next to where it begins, then those next
/// to these. It begins at the last one of another walk, and goes along the flow if there is one:
/// rows take more from unknowns before their own.
///
/// # Cost
///
/// A walk over the rows, and if couplings are far, two more and eight bytes for each.
///
/// ```
/// use hlcp_methods::{FivePoint, Hlcp, cuthill_mckee};
///
/// // The lines of a grid are near each other.
/// let a = FivePoint::new(20, 20, [-1.0, -1.0, 4.0, -1.0, -1.0])?;
/// assert!(cuthill_mckee(&Hlcp::lcp(a)?).is_none());
/// # Ok::<(), hlcp_methods::Error>(())
/// ```
pub fn cuthill_mckee<T: Scalar, A: Rows<T>, B: Rows<T>>(
    problem: &Hlcp<T, A, B>,
) -> Option<Vec<usize>> {
    let n = problem.order();
    u32::try_from(n).ok()?;
    if problem.grid().is_ok() || problem.strip().is_some() {
        return None;
    }
    let visit = |each: &mut dyn FnMut(usize, usize)| {
        for i in 0..n {
            let mut off = |j, _| {
                if j != i {
                    each(i, j);
                }
            };
            problem.a().visit_row(i, &mut off);
            problem.b().visit_row(i, &mut off);
        }
    };
    // The neighbours of i, either way, end where those of i + 1 begin.
    let mut ends = vec![0; n + 1];
    let mut before = 0;
    visit(&mut |i, j| {
        ends[i] += 1;
        ends[j] += 1;
        before += i.abs_diff(j);
    });
    let mut count = 0;
    for end in &mut ends {
        count += *end;
        *end = count;
    }
    // Both sums are over couplings either way.
    before *= 2;
    if before as f64 <= QUARTER * n as f64 * count as f64 {
        return None;
    }
    let mut neighbours = vec![0_u32; count];
    visit(&mut |i, j| {
        for (i, j) in [(i, j), (j, i)] {
            ends[i] -= 1;
            neighbours[ends[i]] = j as u32;
        }
    });
    let near = |i: usize| neighbours[ends[i]..ends[i + 1]].iter().map(|&j| j as usize);

    let mut order = walk_through(n, near);
    let mut places = vec![0; n];
    order.iter().enumerate().for_each(|(place, &i)| places[i] = place);
    let apart = |i: usize| near(i).map(|j| places[i].abs_diff(places[j])).sum::<usize>();
    if (0..n).map(apart).sum::<usize>() as f64 > QUARTER * before as f64 {
        return None;
    }
    if downstream(problem.a(), &places) + downstream(problem.b(), &places) < 0.0 {
        order.reverse();
    }
    Some(order)
}

/// The unknowns of each part that is connected, as the last of three walks reaches them, each of
/// which begins where the one before ended.
fn walk_through<I: Iterator<Item = usize>>(n: usize, near: impl Fn(usize) -> I) -> Vec<usize> {
    let mut order = Vec::with_capacity(n);
    let mut walked = vec![0_u8; n];
    for first in 0..n {
        let begin = order.len();
        for walk in 1..=3 {
            let from = if walk == 1 { first } else { order[order.len() - 1] };
            if walk == 1 && walked[from] > 0 {
                break;
            }
            order.truncate(begin);
            order.push(from);
            walked[from] = walk;
            let mut at = begin;
            while at < order.len() {
                for j in near(order[at]) {
                    if walked[j] < walk {
                        walked[j] = walk;
                        order.push(j);
                    }
                }
                at += 1;
            }
        }
    }
    order
}

/// What rows take from unknowns before their own, less what they take from those after it, in units
/// of their diagonals.
fn downstream<T: Scalar>(operator: &impl Rows<T>, places: &[usize]) -> f64 {
    let mut sum = 0.0;
    for i in 0..operator.order() {
        let diagonal = operator.diagonal_entry(i).wide();
        operator.visit_row(i, &mut |j, a| {
            let part = (a.wide() / diagonal).abs();
            match places[j].cmp(&places[i]) {
                Ordering::Less => sum += part,
                Ordering::Greater => sum -= part,
                Ordering::Equal => {}
            }
        });
    }
    sum
}

impl<T, A, B, M> Method<T> for Renumbered<T, A, B, M>
where
    T: Scalar,
    A: Rows<T>,
    B: Rows<T>,
    M: Method<T, A = Csr<'static, T>, B = Csr<'static, T>>,
{
    type A = A;
    type B = B;

    fn problem(&self) -> &Hlcp<T, A, B> {
        &self.problem
    }

    fn step(&mut self, q: &Rhs<'_, T>, x: &[T], y: &mut Vec<T>, clock: &mut Clock<'_>) -> Norms {
        self.take_in(q, x);
        let rhs = self.inner.problem().rhs(&self.q).expect("what was a right-hand side before");
        let norms = iterate(&mut self.inner, &rhs, &self.x, &mut self.y, &mut self.spare, clock);
        self.order.iter().zip(&self.y).for_each(|(&i, &own)| y[i] = own);
        norms
    }

    fn restart(&mut self) {
        self.inner.restart();
    }

    fn has_memory(&self) -> bool {
        self.inner.has_memory()
    }

    fn turn(&mut self, end: Status) -> bool {
        self.inner.turn(end)
    }

    fn turns(&self) -> &[AutoTurn] {
        self.inner.turns()
    }

    fn work(&self) -> Option<Work> {
        self.inner.work()
    }

    fn residual(&mut self, q: &Rhs<'_, T>, x: &[T]) -> Option<Norms> {
        self.take_in(q, x);
        let rhs = self.inner.problem().rhs(&self.q).ok()?;
        self.inner.residual(&rhs, &self.x)
    }
}
