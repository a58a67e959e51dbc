//! The convergence theorems at sizes up to a few hundred, on grids and on scattered matrices, for
//! the methods themselves.
//!
//! The pairs are built around the vector d of the theorems, so that every bound has a closed form
//! and its edge can be approached; inequalities with inverses are checked by substitution with the
//! triangular comparison matrices.

use crate::common::{Lists, parts, planted_q};
use hlcp_core::{Aor, Diagonal, FivePoint, Hlcp, Omega, Rhs, Rows, Step};
use hlcp_methods::{BoxedMethod, Clock, Limits, Method, Mms, Options, Solver, Tmms};
use hlcp_verify::{
    Contraction, Convergence, Proof, alpha_bound,
    classes::{Answer, is_m},
    convergence, relaxed_alpha_bound, relaxed_theorem, theorem_1, theorem_2,
};
use nalgebra::DMatrix;
use proptest::{collection::vec, prelude::*};

/// Rows of the same pattern in both matrices: the diagonal, and up to four columns beside it.
#[derive(Debug, Clone)]
struct Pair {
    grid: Option<[usize; 2]>,
    a: Lists<f64>,
    b: Lists<f64>,
    omega: Vec<f64>,
    gamma: f64,
    signed: Vec<f64>,
    /// The vector of the theorems, and C d.
    d: Vec<f64>,
    gaps: Vec<f64>,
    /// The bound on α, by construction.
    bound: f64,
}

/// What of (II) and Ω ≥ D_A D_B⁻¹ a pair satisfies.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    /// Both.
    Theorem2,
    /// (II), and Ω below D_A D_B⁻¹ by this factor.
    Theorem1(f64),
    /// Neither.
    Relaxed,
}

type Numbers = (Vec<f64>, Vec<f64>, Vec<f64>, Vec<f64>);

/// Orders 12 to 324. C d = (1 − `edge`)·diag(C)·d for a d over 6 binary orders, and the larger of
/// D_A and D_BΩ is 1 + δ times the smaller, so that ρ[D⁻¹(D − C)] = (1 + δ + edge)/(2 + δ).
fn pairs(kind: Kind, edge: f64) -> impl Strategy<Value = Pair> {
    let sizes = (3..19_usize, 4..19_usize, any::<bool>(), 0.0..0.7, 0.5..4.0);
    sizes.prop_flat_map(move |(nx, ny, on_grid, delta, gamma)| {
        let n = nx * ny;
        let numbers = (
            vec(-1.0..1.0, 4 * n),
            vec(-1.5..1.5, 4 * n),
            vec(-3.0..3.0, 3 * n),
            vec(-8.0..8.0, n),
        );
        numbers.prop_map(move |(of_a, of_b, free, signed): Numbers| {
            let d: Vec<f64> = free[..n].iter().map(|f| f.exp2()).collect();
            let omega: Vec<f64> = free[2 * n..].iter().map(|f| f.exp2()).collect();
            let beyond = if kind == Kind::Theorem2 { 1.0 - 1e-12 } else { 1.0 };
            let (mut a, mut b, mut gaps) = (vec![], vec![], vec![]);
            for i in 0..n {
                let (mut row_a, mut row_b, mut sum) = (vec![], vec![], 0.0);
                let columns = neighbours(i, nx, ny, on_grid).into_iter().enumerate();
                for (k, j) in columns.filter(|(_, j)| *j != i) {
                    // No row of A without any entry beside the diagonal: then no bound is closed.
                    let first = row_a.is_empty();
                    let kept =
                        |s: f64| if s.abs() < 0.1 { if first { 0.3 } else { 0.0 } } else { s };
                    let [x, y] = [of_a[4 * i + k], of_b[4 * i + k]].map(kept);
                    let y = match kind {
                        Kind::Relaxed => y,
                        _ => x * (0.5 + y).clamp(0.0, 1.0 - 1e-12),
                    };
                    row_a.push((j, x));
                    row_b.push((j, y / omega[j]));
                    sum += x.abs().max(y.abs()) * d[j];
                }
                let least = sum / (edge * d[i]);
                gaps.push((1.0 - edge) * least * d[i]);
                let swap =
                    matches!(kind, Kind::Theorem1(_)) || kind == Kind::Relaxed && free[n + i] > 0.0;
                let larger =
                    least * if let Kind::Theorem1(low) = kind { 1.0 / low } else { 1.0 + delta };
                let [on_a, on_b] = if swap { [larger, least] } else { [least, larger] };
                row_a.push((i, on_a));
                row_b.push((i, on_b / (omega[i] * beyond)));
                for (rows, mut row) in [(&mut a, row_a), (&mut b, row_b)] {
                    row.sort_by_key(|(j, _)| *j);
                    rows.push(row);
                }
            }
            let grid = on_grid.then_some([nx, ny]);
            let bound = (2.0 + delta) / (1.0 + delta + edge);
            Pair { grid, a: Lists(a), b: Lists(b), omega, gamma, signed, d, gaps, bound }
        })
    })
}

/// South, west, east, north, with the point itself for what is off the grid; or four scattered
/// columns.
fn neighbours(k: usize, nx: usize, ny: usize, on_grid: bool) -> Vec<usize> {
    let (n, i, j) = (nx * ny, k % nx, k / nx);
    if !on_grid {
        let mut columns = vec![(k + 1) % n, (k + n - 2) % n, (7 * k + 3) % n, (k + n / 2) % n];
        for at in 1..4 {
            if columns[..at].contains(&columns[at]) {
                columns[at] = k;
            }
        }
        return columns;
    }
    vec![
        if j > 0 { k - nx } else { k },
        if i > 0 { k - 1 } else { k },
        if i + 1 < nx { k + 1 } else { k },
        if j + 1 < ny { k + nx } else { k },
    ]
}

type Posed = Hlcp<f64, Box<dyn Rows<f64>>, Box<dyn Rows<f64>>>;

impl Pair {
    fn order(&self) -> usize {
        self.omega.len()
    }

    /// The entries of row `i` off the diagonal: column, `A`, `B`.
    fn off(&self, i: usize) -> impl Iterator<Item = (usize, f64, f64)> {
        let entries = self.a.0[i].iter().zip(&self.b.0[i]);
        entries.filter(move |((j, _), _)| *j != i).map(|(&(j, a), &(_, b))| (j, a, b))
    }

    /// The diagonal entries of row `i`, of `A` and of `BΩ`.
    fn diagonals(&self, i: usize) -> [f64; 2] {
        [self.a.diagonal_entry(i), self.b.diagonal_entry(i) * self.omega[i]]
    }

    fn solution(&self) -> [Vec<f64>; 2] {
        parts(&self.signed)
    }

    fn x(&self) -> Vec<f64> {
        let [z, r] = self.solution();
        (0..z.len()).map(|i| self.gamma / 2.0 * (z[i] - r[i] / self.omega[i])).collect()
    }

    fn q(&self) -> Vec<f64> {
        let [z, r] = self.solution();
        planted_q(&self.a, &self.b, [&z, &r])
    }

    fn posed(&self) -> Posed {
        let operator = |lists: &Lists<f64>| -> Box<dyn Rows<f64>> {
            match self.grid {
                Some([nx, ny]) => Box::new(FivePoint::from_rows(nx, ny, lists).unwrap()),
                None => Box::new(lists.clone()),
            }
        };
        let omega = Omega::Each(self.omega.clone());
        let problem = Hlcp::new(operator(&self.a), operator(&self.b), omega).unwrap();
        problem.with_gamma(self.gamma).unwrap()
    }

    /// Not less than |x⁺ − x*| for |x − x*| = `e`: substitution in ⟨M⟩ y = (|N| + |BΩ − A|) e, of
    /// (14) and (15), with
    /// |BΩ − A| on the left in the swept triangle for AMMS.
    fn majorant(&self, step: &Aor<f64>, e: &[f64]) -> Vec<f64> {
        let n = self.order();
        let ([[alpha, beta], _], backward) = (step.pairs(), step.precedes(1, 0));
        let mut y = vec![0.0; n];
        for k in 0..n {
            let i = if backward { n - 1 - k } else { k };
            let [a, w] = self.diagonals(i);
            let mut sum = ((1.0 / alpha - 1.0).abs() * (a + w) + (w - a).abs()) * e[i];
            for (j, a, b) in self.off(i) {
                let w = b * self.omega[j];
                let modulus = (w - a).abs();
                if (j < i) == backward {
                    sum += ((a + w).abs() + modulus) * e[j];
                } else {
                    sum += (beta / alpha - 1.0).abs() * (a + w).abs() * e[j]
                        + beta / alpha * (a + w).abs() * y[j];
                    sum += modulus * if step.is_accelerated() { y[j] } else { e[j] };
                }
            }
            y[i] = sum / ((a + w) / alpha);
        }
        y
    }
}

fn norm(x: &[f64], y: &[f64], d: &[f64]) -> f64 {
    (0..d.len()).map(|i| (x[i] - y[i]).abs() / d[i]).fold(0.0, f64::max)
}

/// What a proof of convergence says, asked of the steps, the methods and the solver.
fn holds(
    p: &Pair,
    steps: &[Aor<f64>],
    Contraction { factor, weights: d }: &Contraction,
    enough: u64,
) -> Result<(), TestCaseError> {
    let (n, star, q, problem) = (p.order(), p.x(), p.q(), p.posed());
    let rhs = Rhs::new(&q).unwrap();
    let start: Vec<f64> = star.iter().map(|x| 7.0 * x.cos() - 40.0 * x.sin()).collect();
    let first = norm(&start, &star, d);
    // A step loses at most some 30 roundings of terms that (⟨M⟩ + |N| + |BΩ − A|)d bounds, and so
    // does q.
    let size = first + norm(&star, &vec![0.0; n], d);
    let floor = 128.0 * f64::EPSILON * size / (1.0 - factor);

    let (mut x, mut y) = (start.clone(), vec![0.0; n]);
    for _ in 0..6 {
        let before = norm(&x, &star, d);
        for step in steps {
            let e: Vec<f64> = x.iter().zip(&star).map(|(x, star)| (x - star).abs()).collect();
            step.step(&problem, &rhs, &x, &mut y, &mut vec![]);
            std::mem::swap(&mut x, &mut y);
            for (i, bound) in p.majorant(step, &e).into_iter().enumerate() {
                prop_assert!((x[i] - star[i]).abs() <= bound + floor * d[i], "row {i} of {n}");
            }
        }
        prop_assert!(norm(&x, &star, d) <= factor * before + floor);
    }

    // ρ(P₂P₁) ≤ maxᵢ (P₂P₁d)ᵢ/dᵢ for every positive d (Collatz and Wielandt).
    let image = steps.iter().fold(d.clone(), |e, step| p.majorant(step, &e));
    let radius = norm(&image, &vec![0.0; n], d);
    prop_assert!(radius < 1.0 && radius <= factor * (1.0 + 1e-12), "{radius} {factor}");

    let mut method: BoxedMethod<'_, f64, _, _> = match steps {
        [step] => Box::new(Mms::new(problem, *step).unwrap()),
        [one, two] => Box::new(Tmms::new(problem, *one, *two).unwrap()),
        _ => unreachable!(),
    };
    let mut x = start.clone();
    for _ in 0..enough {
        method.step(&rhs, &x, &mut y, &mut Clock::endless());
        method.complete(&rhs, &mut y, &mut x);
        std::mem::swap(&mut x, &mut y);
        // Where rounding is all that is left, the remaining iterations, at times millions, change
        // nothing.
        if norm(&x, &star, d) <= floor {
            break;
        }
    }
    prop_assert!(norm(&x, &star, d) <= 1e-6 * first + floor, "{enough} iterations");

    // |z − z*| ≤ |δ| and |r − r*| ≤ ω|δ| with C|δ| ≤ |A z − B r + q|.
    let mut solver = Solver::new(method);
    let limits = Limits::relative(1e-9);
    let outcome = solver.solve(&q, Options::from_x(&start).limits(limits)).unwrap();
    prop_assert!(outcome.converged(), "{outcome}");
    let worst = p.gaps.iter().map(|gap| outcome.residual.linf / gap).fold(0.0, f64::max);
    let [z, r] = p.solution();
    for i in 0..n {
        let bound = (worst + 2.0 / p.gamma * norm(&star, &vec![0.0; n], &p.d) * 1e-10) * p.d[i];
        prop_assert!((solver.z()[i] - z[i]).abs() <= bound);
        prop_assert!((solver.r()[i] - r[i]).abs() <= bound * p.omega[i]);
    }
    Ok(())
}

/// One step, or it and its mirror image.
fn steps(alpha: f64, share: f64, two: bool) -> Vec<Aor<f64>> {
    let step = Aor::new(alpha, alpha * share).unwrap();
    if two { vec![step, step.backward()] } else { vec![step] }
}

/// Asks `theorem` about the problem on its own operators, and `holds` about what it proves.
fn judge(
    p: &Pair,
    steps: &[Aor<f64>],
    theorem: impl Fn(&Posed) -> Result<Proof, TestCaseError>,
) -> Result<(), TestCaseError> {
    let problem = p.posed();
    let expected = theorem(&problem)?;
    let Convergence::Proved(proof, contraction) = convergence(&problem, steps) else {
        return Err(TestCaseError::fail("not proved"));
    };
    prop_assert_eq!(proof, expected);
    let enough = contraction.iterations(1e-6).unwrap();
    holds(p, steps, &contraction, enough)
}

/// The bracket encloses the bound by construction, up to the rounding of the construction.
fn encloses([lower, upper]: [f64; 2], bound: f64) -> Result<(), TestCaseError> {
    let is_within = lower <= bound * (1.0 + 1e-11) && bound * (1.0 - 1e-11) <= upper;
    prop_assert!(is_within, "{lower} {bound} {upper}");
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Theorem 2 and Corollary 1 up to 0.995 of the bound.
    #[test]
    fn theorem_2_to_its_edge(
        p in pairs(Kind::Theorem2, 0.96),
        share in 0.1..1.0,
        near in 0.4..0.995,
        two in any::<bool>(),
    ) {
        let [inside, beyond] = [near, 1.001].map(|part| steps(part * p.bound, share, two));
        judge(&p, &inside, |problem| {
            encloses(alpha_bound(problem).reciprocal(), p.bound)?;
            encloses(relaxed_alpha_bound(problem).reciprocal(), p.bound)?;
            prop_assert!(theorem_2(problem, &inside).applies());
            prop_assert!(!theorem_2(problem, &beyond).alpha.is_yes());
            Ok(Proof::Theorem2)
        })?;
    }

    /// The relaxed theorem, without (II) and Ω ≥ D_A D_B⁻¹, for AMMS too.
    #[test]
    fn the_relaxed_theorem_to_its_edge(
        p in pairs(Kind::Relaxed, 0.96),
        share in 0.0..1.0,
        near in 0.4..0.995,
        two in any::<bool>(),
        fast in any::<bool>(),
    ) {
        let beyond = steps(1.001 * p.bound, share, two);
        let mut inside = steps(near * p.bound, share, two && !fast);
        if fast {
            let step = inside[0].accelerated();
            inside[0] = if two { step.backward() } else { step };
        }
        judge(&p, &inside, |problem| {
            encloses(relaxed_alpha_bound(problem).reciprocal(), p.bound)?;
            prop_assert!(relaxed_theorem(problem, &inside).is_yes());
            prop_assert!(!relaxed_theorem(problem, &beyond).is_yes());
            Ok(Proof::Relaxed)
        })?;
    }

    /// Theorem 1 at the edge of (8), with Ω below D_A D_B⁻¹.
    #[test]
    fn theorem_1_to_its_edge(
        p in pairs(Kind::Theorem1(0.7), 0.97),
        alpha in 0.3..1.0,
        share in 0.0..1.0,
        two in any::<bool>(),
    ) {
        let inside = steps(alpha, share, two);
        judge(&p, &inside, |problem| {
            prop_assert!(theorem_1(problem, &inside).applies());
            prop_assert!(!theorem_2(problem, &inside).omega.is_yes());
            Ok(Proof::Relaxed)
        })?;
    }

    /// One percent beyond the edge, C is no M-matrix and nothing may be proved.
    #[test]
    fn nothing_is_proved_beyond_the_edge(
        p in pairs(Kind::Relaxed, 1.01),
        alpha in 0.3..1.0,
        two in any::<bool>(),
    ) {
        let proved = convergence(&p.posed(), &steps(alpha, 0.7, two));
        prop_assert!(matches!(proved, Convergence::NotProved(_)));
    }

    /// Lemma 3: for a Z-matrix, an M-matrix, a D with AD strictly dominant, and ρ(M⁻¹N) < 1 for A =
    /// M − N with M⁻¹, N ≥ 0 (here M a triangle with a part of the entries) are one thing.
    #[test]
    fn lemma_3_holds(p in pairs(Kind::Relaxed, 1.0), edge in prop_oneof![0.9..0.995, 1.005..1.1], kept in 0.0..1.0) {
        let n = p.order().min(60);
        // The leading block of C with a diagonal that makes ρ(D⁻¹|off|) = edge, d being the vector.
        let mut a = DMatrix::zeros(n, n);
        for i in 0..n {
            let off: Vec<_> = p.off(i).filter(|entry| entry.0 < n).collect();
            off.iter().for_each(|&(j, x, b)| a[(i, j)] = -x.abs().max(b.abs() * p.omega[j]));
            let ring = (i + 1) % n; // keeps the block irreducible
            a[(i, ring)] -= 0.1;
            a[(i, i)] = -(0..n).filter(|&j| j != i).map(|j| a[(i, j)] * p.d[j]).sum::<f64>() / (edge * p.d[i]);
        }
        let triangle = DMatrix::from_fn(n, n, |i, j| if i == j { a[(i, j)] } else if i > j { kept * a[(i, j)] } else { 0.0 });
        let inverse = triangle.clone().try_inverse().unwrap();
        prop_assert!(inverse.min() >= -1e-12 * inverse.amax() && (&triangle - &a).min() >= 0.0);
        // Below the edge the sum of the 2048th power is at most 64 n edge²⁰⁴⁸, and beyond it ρ²⁰⁴⁸
        // or more, without a search for eigenvalues, which may take for ever.
        let mut power = inverse * (&triangle - &a);
        (0..11).for_each(|_| power = &power * &power);
        prop_assert_eq!(power.sum() < 1.0, edge < 1.0);
        let answer = is_m(&a);
        prop_assert_eq!(answer.is_yes(), edge < 1.0);
        if let Answer::Yes(d) = answer {
            prop_assert!(d.iter().all(|&d| d > 0.0) && (a * nalgebra::DVector::from_vec(d)).min() > 0.0);
        }
    }

    /// Lemma 4, from its formula: below the bound of (16) the witness makes its matrix strictly
    /// dominant; above it the vector d, which that matrix maps to a negative one, shows that none
    /// can.
    #[test]
    fn lemma_4_gives_the_witness(p in pairs(Kind::Theorem2, 0.96), near in prop_oneof![0.4..0.995, 1.005..1.5]) {
        let alpha: f64 = near * p.bound;
        let row = |i: usize, d: &[f64]| {
            let [a, b] = p.diagonals(i);
            let bend = (1.0 - alpha).abs();
            let diagonal = ((1.0 + alpha - bend) * a + (1.0 - alpha - bend) * b) / alpha;
            p.off(i).fold(diagonal * d[i], |sum, (j, a, _)| sum - 2.0 * a.abs() * d[j])
        };
        let theorem = theorem_2(&p.posed(), &steps(alpha, 0.5, true));
        prop_assert_eq!(theorem.alpha.is_yes(), near < 1.0);
        // Up to α = 1 the matrix is 2⟨A⟩, and (16) holds for any H₊-matrix.
        match if alpha <= 1.0 { theorem.a_is_h_plus } else { theorem.alpha } {
            Answer::Yes(d) => prop_assert!((0..p.order()).all(|i| row(i, &d) > 0.0)),
            _ => prop_assert!((0..p.order()).all(|i| row(i, &p.d) < 0.0)),
        }
    }
}
