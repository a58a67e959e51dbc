//! Sweeps that solve one scalar equation after the other, by rows.

use crate::{Hlcp, Rows, Scalar, strip::Shared};

impl<T: Scalar, A: Rows<T>, B: Rows<T>> Hlcp<T, A, B> {
    /// Overwrites `x` by a sweep of the nonlinear Gauss–Seidel method, forward or backward: each
    /// row of `F(x) = (A + BΩ)x + (A − BΩ)|x| + γq` in turn is solved for its own unknown.
    ///
    /// # Cost
    ///
    /// A walk over the rows of `A` and `B`, on one thread. A pivot that is zero makes an entry that
    /// is not finite.
    ///
    /// # Panics
    ///
    /// Unless `q` and `x` have length `n`; where ranks share operators that are no five-point ones.
    ///
    /// ```
    /// use hlcp_core::{FivePoint, Hlcp};
    ///
    /// let problem = Hlcp::lcp(FivePoint::new(3, 1, [0.0, -1.0, 2.0, -1.0, 0.0])?)?;
    /// let (q, mut x) = ([-4.0, 4.0, 0.0], [0.0; 3]);
    /// problem.solve_rows(&q, &mut x, false);
    /// // 2z₁ = 4; −2 + 2z₂ + 4 > 0 for all z₂ ≥ 0, so that r₂ = 2 with Ω = 2; 2z₃ = 0
    /// assert_eq!(x, [1.0, -0.5, 0.0]);
    /// # Ok::<(), hlcp_core::Error>(())
    /// ```
    pub fn solve_rows(&self, q: &[T], x: &mut [T], backward: bool) {
        self.assert_orders([q.len(), x.len()]);
        if let Some(shared) = &self.shared {
            return self.solve_shared_rows(shared, q, x, backward);
        }
        for i in turns(x.len(), backward) {
            let mut equation = Equation::new(self.q_factor() * q[i]);
            self.a.visit_row(i, &mut |j, a| equation.add_a(a, x[j], i == j));
            self.b.visit_row(i, &mut |j, b| {
                equation.add_b(self.omega.entry(j) * b, x[j], i == j);
            });
            x[i] = equation.solution();
        }
    }

    /// A rank enters a row when the one before has left it.
    fn solve_shared_rows(&self, shared: &Shared<T>, q: &[T], x: &mut [T], backward: bool) {
        let Shared { strip, omega, .. } = shared;
        let ([nx, ny], mut beside) = (strip.grid(), strip.beside(1, |k| x[k]));
        let five = "operators of ranks are five-point ones";
        let a = self.a.as_five_point().expect(five).coefficients();
        let b = self.b.as_five_point().expect(five).coefficients();
        let [from, to] = if backward { [1, 0] } else { [0, 1] };
        for j in turns(ny, backward) {
            if let Some(before) = beside[from].get_mut(j) {
                let mut last = [*before];
                strip.take(from, &mut last);
                *before = last[0];
            }
            for i in turns(nx, backward) {
                let k = j * nx + i;
                let at = |k: usize| (x[k], self.omega.entry(k));
                let side = |side: usize| Some((*beside[side].get(j)?, omega[side][j]));
                let around = [
                    (j > 0).then(|| at(k - nx)),
                    if i > 0 { Some(at(k - 1)) } else { side(0) },
                    Some(at(k)),
                    if i + 1 < nx { Some(at(k + 1)) } else { side(1) },
                    (j + 1 < ny).then(|| at(k + nx)),
                ];
                let mut equation = Equation::new(self.q_factor() * q[k]);
                // In the order of a row's entries, zeros left out, as it is visited.
                for (d, (a, around)) in a.iter().map(|a| a.at(k)).zip(around).enumerate() {
                    if let Some((x, _)) = around.filter(|_| a != T::zero()) {
                        equation.add_a(a, x, d == 2);
                    }
                }
                for (d, (b, around)) in b.iter().map(|b| b.at(k)).zip(around).enumerate() {
                    if let Some((x, omega)) = around.filter(|_| b != T::zero()) {
                        equation.add_b(omega * b, x, d == 2);
                    }
                }
                x[k] = equation.solution();
            }
            strip.pass(to, &[x[j * nx + if backward { 0 } else { nx - 1 }]]);
        }
    }
}

/// The indices below `count` in the order of a sweep.
fn turns(count: usize, backward: bool) -> impl Iterator<Item = usize> {
    (0..count).map(move |k| if backward { count - 1 - k } else { k })
}

/// The equation `t + pᵢ(x)x = 0` of one unknown, with a pivot for each sign.
struct Equation<T> {
    t: T,
    pivots: [T; 2],
}

impl<T: Scalar> Equation<T> {
    fn new(t: T) -> Self {
        Self { t, pivots: [T::zero(); 2] }
    }

    fn add_a(&mut self, a: T, x: T, own: bool) {
        if own {
            self.pivots[0] = a + a;
        } else {
            self.t += a * (x.abs() + x);
        }
    }

    fn add_b(&mut self, b_omega: T, x: T, own: bool) {
        if own {
            self.pivots[1] = b_omega + b_omega;
        } else {
            self.t -= b_omega * (x.abs() - x);
        }
    }

    fn solution(&self) -> T {
        -self.t / if self.t <= T::zero() { self.pivots[0] } else { self.pivots[1] }
    }
}
