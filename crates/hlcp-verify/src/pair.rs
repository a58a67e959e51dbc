//! The rows of a pair as the certificate uses them: as stencils where both operators are, by
//! walking where not.

use hlcp_core::{Coefficients::Constant, FivePointView, Rows, Scalar};

use crate::{
    comparison::{Against, Coupled, Weights, visit},
    rounding::{Sum, mul_down, mul_up, up},
};

/// `A` and `B` with positive diagonals, and an Ω chosen for a proof.
pub(crate) struct Pair<'a, T, A, B> {
    /// The matrix `C`, row by row.
    pub(crate) coupled: Coupled<'a, T, A, B>,
    stencil: Option<Stencil>,
}

impl<'a, T: Scalar, A: Rows<T>, B: Rows<T>> Pair<'a, T, A, B> {
    pub(crate) fn new(a: &'a A, b: &'a B, omega: &'a [f64]) -> Self {
        let stencil = Stencil::of(a, b, omega);
        let omega = Weights::Chosen(omega);
        Self { coupled: Coupled { a, b, omega, against: Against::Pair }, stencil }
    }

    /// How many rows [`couplings`](Self::couplings) does in one go.
    pub(crate) fn stretch(&self) -> usize {
        self.stencil.as_ref().map_or(1, |stencil| stencil.nx)
    }

    /// Overwrites `pivots` with the diagonal of `C` and `y` with what is not less than
    /// `(D_C − C)x`, for `x ≥ 0` and the stretch of rows that begins at row `from`.
    pub(crate) fn couplings(
        &self,
        from: usize,
        x: &[f64],
        [pivots, y]: [&mut [f64]; 2],
        g: &mut Vec<(usize, f64)>,
    ) {
        if let Some(Stencil { nx, coupling, pivot, .. }) = &self.stencil {
            pivots.fill(*pivot);
            y.fill(0.0);
            coupling.add_product(*nx, from / nx, 0, x, y);
            // Four products, and up to three additions to each.
            y.iter_mut().for_each(|y| *y = up(*y, 4.0));
        } else {
            for (k, (pivot, y)) in pivots.iter_mut().zip(y).enumerate() {
                *pivot = self.coupled.coupled_row(from + k, g);
                let mut sum = Sum::default();
                g.iter().for_each(|&(j, g)| sum.add(g, x[j]));
                *y = sum.interval().upper;
            }
        }
    }

    /// Not less than `|A z − B r + q|`, entry by entry, for `z, r ≥ 0`.
    pub(crate) fn defect(&self, q: &[T], [z, r]: [&[f64]; 2]) -> Vec<f64> {
        if let Some(stencil) = &self.stencil {
            return stencil.defect(q, [z, r]);
        }
        let row = |(i, &q): (usize, &T)| {
            let mut sum = Sum::default();
            sum.add(q.wide(), 1.0);
            visit(self.coupled.a, i, |j, a| sum.add(a, z[j]));
            visit(self.coupled.b, i, |j, b| sum.add(-b, r[j]));
            sum.interval().magnitude()
        };
        q.iter().enumerate().map(row).collect()
    }
}

/// Two five-point operators with constant coefficients on one grid.
struct Stencil {
    nx: usize,
    /// The factors of `z` and `r` in the positive terms of `A z − B r`: the positive part of A, the
    /// negative one of B.
    plus: [FivePointView<'static, f64>; 2],
    /// The same in the negative terms.
    minus: [FivePointView<'static, f64>; 2],
    /// Not less than the off-diagonal moduli of `C`.
    coupling: FivePointView<'static, f64>,
    /// Not more than its diagonal.
    pivot: f64,
}

impl Stencil {
    fn of<T: Scalar>(a: &impl Rows<T>, b: &impl Rows<T>, omega: &[f64]) -> Option<Self> {
        let (of_a, of_b) = (a.as_five_point()?, b.as_five_point()?);
        if [of_a, of_b].iter().any(|view| view.round() != [false; 2]) {
            return None;
        }
        let [nx, ny] = match (of_a.grid(), of_b.grid()) {
            (Some(a), Some(b)) if a != b => return None,
            (Some(grid), _) | (None, Some(grid)) => grid,
            (None, None) => [a.order(), 1],
        };
        assert_eq!(nx * ny, a.order(), "a grid of the operators' order");
        let (of_a, of_b) = (constant(of_a)?, constant(of_b)?);
        let (first, [.., centre, _, _]) = (*omega.first()?, of_b);
        let omega = omega.iter().all(|&omega| omega == first).then_some(first)?;
        let mut coupling = [0, 1, 2, 3, 4].map(|k| of_a[k].abs().max(mul_up(of_b[k].abs(), omega)));
        coupling[2] = 0.0;
        let view = |c: [f64; 5]| FivePointView::new(nx, ny, c.map(Constant));
        let part = |c: [f64; 5], sign: f64| view(c.map(|c| (sign * c).max(0.0)));
        Some(Self {
            nx,
            plus: [part(of_a, 1.0), part(of_b, -1.0)],
            minus: [part(of_a, -1.0), part(of_b, 1.0)],
            coupling: view(coupling),
            pivot: of_a[2].min(mul_down(centre, omega)),
        })
    }

    /// The positive terms `P` and the negative ones `N` are summed apart.
    ///
    /// Of the ten products and the q none meets more than 11 roundings, so the computed `p` and `n`
    /// have `|p − P| ≤ 12u p` up to underflow, and likewise `n`. Then
    /// `|P − N| ≤ |p − n| + 12u(p + n)`, where the code takes 16u, and [`up`] covers the four
    /// operations of that and the underflow.
    fn defect<T: Scalar>(&self, q: &[T], [z, r]: [&[f64]; 2]) -> Vec<f64> {
        let nx = self.nx;
        let (mut p, mut n) = (vec![0.0; nx], vec![0.0; nx]);
        let mut defect = Vec::with_capacity(q.len());
        for (j, q) in q.chunks_exact(nx).enumerate() {
            for ((p, n), &q) in p.iter_mut().zip(&mut n).zip(q) {
                let q = q.wide();
                (*p, *n) = (q.max(0.0), (-q).max(0.0));
            }
            for (x, k) in [(z, 0), (r, 1)] {
                self.plus[k].add_product(nx, j, 0, x, &mut p);
                self.minus[k].add_product(nx, j, 0, x, &mut n);
            }
            defect.extend(p.iter().zip(&n).map(|(&p, &n)| {
                let bound = up((p - n).abs() + 8.0 * f64::EPSILON * (p + n), 4.0);
                if bound.is_nan() { f64::INFINITY } else { bound }
            }));
        }
        defect
    }
}

/// The coefficients in double precision, if all are constant and finite: `max` would drop a NaN.
fn constant<T: Scalar>(view: FivePointView<'_, T>) -> Option<[f64; 5]> {
    let all = view.constants()?.map(T::wide);
    all.iter().all(|value| value.is_finite()).then_some(all)
}
