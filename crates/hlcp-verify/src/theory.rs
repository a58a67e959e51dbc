//! The convergence theorems as code: `docs/theory.md` states and proves what the paper does not.

use std::fmt;

use hlcp_core::{Aor, Hlcp, Rows, Scalar};
use hlcp_methods::Clock;

use crate::{
    classes::{
        Answer, Failure, all_entries, is_h_plus, is_h_plus_within, radius, radius_below_one,
    },
    comparison::{Against, Coupled, merge},
    decimal::fixed,
    perron::{Bracket, Comparison, noda},
    rounding::sign,
    steps::{Contraction, Steps},
    uniqueness::{Found, Uniqueness, Witness, search, uniqueness_within},
};

/// The hypotheses of Theorem 1 of the paper, each with its own answer.
///
/// ```
/// use hlcp_core::{Aor, FivePoint, Hlcp};
/// use hlcp_verify::{classes::{Answer, Failure}, theorem_1};
///
/// let problem = Hlcp::lcp(FivePoint::new(2, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?)?;
/// let msor = theorem_1(&problem, &[Aor::new(1.2, 1.2)?]);
/// assert!(msor.a_is_h_plus.is_yes() && msor.signs_and_sizes.is_yes() && msor.omega.is_yes());
/// // What fails: a splitting is H-compatible on the diagonal for α ≤ 1 alone.
/// assert_eq!(msor.compatible, Answer::No(Failure::Entry { row: 0, column: 0 }));
/// assert!(!msor.applies());
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Theorem1 {
    /// `A` is an H₊-matrix.
    pub a_is_h_plus: Answer<Vec<f64>>,
    /// `B` is an H₊-matrix.
    pub b_is_h_plus: Answer<Vec<f64>>,
    /// (I): the splittings of `A` and `B` are H-compatible, in every step.
    pub compatible: Answer,
    /// (II): `|bᵢⱼ|ωⱼ ≤ |aᵢⱼ|` off the diagonal, and `bᵢⱼ` is zero or has the sign of `aᵢⱼ`.
    pub signs_and_sizes: Answer,
    /// (8), for some `D` with ⟨A⟩D strictly dominant: `D_BΩd > |C_A|d`. The witness is `d`.
    pub omega: Answer<Vec<f64>>,
}

impl Theorem1 {
    /// Returns whether all of them were proved.
    pub fn applies(&self) -> bool {
        self.a_is_h_plus.is_yes()
            && self.b_is_h_plus.is_yes()
            && self.compatible.is_yes()
            && self.signs_and_sizes.is_yes()
            && self.omega.is_yes()
    }
}

/// Checks Theorem 1 for the steps of a method (one for MMS, two for TMMS).
///
/// ```
/// use hlcp_core::{Aor, FivePoint, Hlcp, Omega};
/// use hlcp_verify::theorem_1;
///
/// let a = FivePoint::new(4, 4, [-1.0, -1.0, 8.0, -1.0, -1.0])?;
/// let b = FivePoint::new(4, 4, [0.0, -1.0, 8.0, -1.0, 0.0])?;
/// let problem = Hlcp::new(a, b, Omega::Uniform(0.8))?;
/// assert!(theorem_1(&problem, &[Aor::gauss_seidel()]).applies());
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn theorem_1<T: Scalar, A: Rows<T>, B: Rows<T>>(
    problem: &Hlcp<T, A, B>,
    steps: &[Aor<T>],
) -> Theorem1 {
    theorem_1_within(problem, steps, &mut Clock::endless())
}

fn theorem_1_within<T: Scalar, A: Rows<T>, B: Rows<T>>(
    problem: &Hlcp<T, A, B>,
    steps: &[Aor<T>],
    clock: &mut Clock<'_>,
) -> Theorem1 {
    Theorem1 {
        a_is_h_plus: is_h_plus_within(problem.a(), clock),
        b_is_h_plus: is_h_plus_within(problem.b(), clock),
        compatible: compatible(problem, steps),
        signs_and_sizes: signs_and_sizes(problem),
        omega: radius_below_one(&Coupled::of(problem, Against::Condition8), clock),
    }
}

/// The hypotheses of Theorem 2 and Corollary 1 of the paper, each with its own answer.
///
/// ```
/// use hlcp_core::{Aor, FivePoint, Hlcp};
/// use hlcp_verify::theorem_2;
///
/// let problem = Hlcp::lcp(FivePoint::new(2, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?)?;
/// // The bound (16) is 8/(4 + 1) = 1.6.
/// assert!(theorem_2(&problem, &[Aor::new(1.5, 1.0)?]).applies());
/// let large = theorem_2(&problem, &[Aor::new(1.7, 1.0)?]);
/// assert!(large.parameters.is_yes() && !large.alpha.is_yes() && !large.applies());
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Theorem2 {
    /// `A` is an H₊-matrix.
    pub a_is_h_plus: Answer<Vec<f64>>,
    /// `B` is an H₊-matrix.
    pub b_is_h_plus: Answer<Vec<f64>>,
    /// `|bᵢⱼ|ωⱼ ≤ |aᵢⱼ|` off the diagonal, and `bᵢⱼ` is zero or has the sign of `aᵢⱼ`.
    pub signs_and_sizes: Answer,
    /// `Ω ≥ D_A D_B⁻¹`.
    pub omega: Answer,
    /// One α for `A` and `B`, one β too, `0 < β ≤ α`, and one step that is not accelerated, or two
    /// of opposite directions.
    pub parameters: Answer,
    /// α below the bound of (16); yes with a `d` that proves it.
    pub alpha: Answer<Vec<f64>>,
}

impl Theorem2 {
    /// Returns whether all of them were proved.
    pub fn applies(&self) -> bool {
        self.a_is_h_plus.is_yes()
            && self.b_is_h_plus.is_yes()
            && self.signs_and_sizes.is_yes()
            && self.omega.is_yes()
            && self.parameters.is_yes()
            && self.alpha.is_yes()
    }
}

/// Checks Theorem 2 (two steps) and Corollary 1 (one step).
///
/// ```
/// use hlcp_core::{Aor, FivePoint, Hlcp, Omega};
/// use hlcp_verify::theorem_2;
///
/// let a = FivePoint::new(4, 4, [-1.0, -1.0, 8.0, -1.0, -1.0])?;
/// let b = FivePoint::new(4, 4, [0.0, -1.0, 8.0, -1.0, 0.0])?;
/// let tmaor = [Aor::new(1.2, 1.1)?, Aor::new(1.2, 1.1)?.backward()];
/// let at = |tau| Ok::<_, hlcp_core::Error>(Hlcp::new(a, b, Omega::diagonal_ratio(tau, &a, &b)?)?);
/// assert!(theorem_2(&at(1.0)?, &tmaor).applies());
/// // Above 1 the sizes fail, below 1 the diagonals do: the theorem covers τ = 1 alone.
/// assert!(!theorem_2(&at(1.2)?, &tmaor).signs_and_sizes.is_yes());
/// assert!(!theorem_2(&at(0.8)?, &tmaor).omega.is_yes());
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn theorem_2<T: Scalar, A: Rows<T>, B: Rows<T>>(
    problem: &Hlcp<T, A, B>,
    steps: &[Aor<T>],
) -> Theorem2 {
    let pairs = |step: &Aor<T>| step.pairs().map(|pair| pair.map(T::wide));
    let [alpha, beta] = steps.first().map_or([f64::NAN; 2], |step| pairs(step)[0]);
    let parameters = if !are_of_the_paper(steps) {
        let range = "one (alpha, beta) for A, B and the step of MMS, or the forward and the \
                     backward step of TMMS";
        Answer::No(Failure::Parameter(range))
    } else if !(0.0 < beta && beta <= alpha) {
        Answer::No(Failure::Parameter("0 < beta <= alpha"))
    } else {
        Answer::Yes(())
    };
    Theorem2 {
        a_is_h_plus: is_h_plus(problem.a()),
        b_is_h_plus: is_h_plus(problem.b()),
        signs_and_sizes: signs_and_sizes(problem),
        omega: omega_large(problem),
        parameters,
        alpha: below_bound(&Coupled::of(problem, Against::Paper), alpha, &mut Clock::endless()),
    }
}

/// `ρ[(D_A + D_BΩ)⁻¹(D_BΩ + |C_A|)]`, whose reciprocal is the bound on α of (16), to about six
/// digits of the distance of the bound from 1.
///
/// The diagonals must be positive; the upper end is infinite otherwise.
///
/// ```
/// use hlcp_core::{FivePoint, Hlcp, Omega};
///
/// let a = FivePoint::new(128, 128, [-1.0, -1.0, 8.0, -1.0, -1.0])?;
/// let b = FivePoint::new(128, 128, [0.0, -1.0, 8.0, -1.0, 0.0])?;
/// let [lower, upper] =
///     hlcp_verify::alpha_bound(&Hlcp::new(a, b, Omega::Uniform(1.0))?).reciprocal();
/// assert!(1.33346 < lower && lower <= upper && upper < 1.33347); // Table 2 prints 1.33
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn alpha_bound<T: Scalar, A: Rows<T>, B: Rows<T>>(problem: &Hlcp<T, A, B>) -> Bracket {
    narrow(&Coupled::of(problem, Against::Paper))
}

/// `ρ[(D_A + D_BΩ)⁻¹(max(D_A, D_BΩ) + max(|C_A|, |C_B|Ω))]`, whose reciprocal bounds α in the
/// relaxed theorem.
///
/// Where the reciprocal is below 1, it proves convergence for no α > 1, and not for α ≤ 1 either.
/// As precise as [`alpha_bound`], with which it agrees under the hypotheses of Theorem 2.
///
/// ```
/// use hlcp_core::{FivePoint, Hlcp, Identity, Omega};
/// use hlcp_verify::{alpha_bound, relaxed_alpha_bound};
///
/// let a = FivePoint::new(2, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?;
/// let at = |omega| Hlcp::new(a, Identity { order: 2 }, Omega::Uniform(omega));
/// assert_eq!(relaxed_alpha_bound(&at(4.0)?), alpha_bound(&at(4.0)?)); // Theorem 2's Ω: 8/(4 + 1)
/// let [lower, upper] = relaxed_alpha_bound(&at(2.0)?).reciprocal();
/// assert!(lower <= 1.2 && 1.2 <= upper); // a smaller one: (4 + 2)/(4 + 1)
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn relaxed_alpha_bound<T: Scalar, A: Rows<T>, B: Rows<T>>(problem: &Hlcp<T, A, B>) -> Bracket {
    narrow(&Coupled::of(problem, Against::Pair))
}

fn narrow(z: &impl Comparison) -> Bracket {
    let enough =
        |bracket: &Bracket| bracket.upper - bracket.lower <= 1e-6 * (1.0 - bracket.upper).abs();
    noda(z, enough, &mut Clock::endless())
}

/// The relaxed theorem: `C − max(0, 1 − 1/α)(D_A + D_BΩ)` is a nonsingular M-matrix for the largest
/// α of the steps.
///
/// Each step must have one `0 ≤ β ≤ α` for `A` and `B`; steps may differ, and be accelerated. The
/// witness is a `d` for which all of them contract.
///
/// ```
/// use hlcp_core::{Aor, FivePoint, Hlcp, Omega};
/// use hlcp_verify::relaxed_theorem;
///
/// let a = FivePoint::new(4, 4, [-1.0, -1.0, 8.0, -1.0, -1.0])?;
/// let b = FivePoint::new(4, 4, [0.0, 1.0, 8.0, 1.0, 0.0])?; // no sign condition
/// let problem = Hlcp::new(a, b, Omega::Uniform(1.2))?; //       nor Ω = D_A D_B⁻¹
/// assert!(relaxed_theorem(&problem, &[Aor::new(1.2, 0.0)?]).is_yes());
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn relaxed_theorem<T: Scalar, A: Rows<T>, B: Rows<T>>(
    problem: &Hlcp<T, A, B>,
    steps: &[Aor<T>],
) -> Answer<Vec<f64>> {
    relaxed_theorem_within(problem, steps, &mut Clock::endless())
}

fn relaxed_theorem_within<T: Scalar, A: Rows<T>, B: Rows<T>>(
    problem: &Hlcp<T, A, B>,
    steps: &[Aor<T>],
    clock: &mut Clock<'_>,
) -> Answer<Vec<f64>> {
    let fits = |step: &Aor<T>| {
        let [of_a, of_b] = step.pairs();
        of_a == of_b && T::zero() <= of_a[1] && of_a[1] <= of_a[0]
    };
    if steps.is_empty() || !steps.iter().all(fits) {
        return Answer::No(Failure::Parameter("one 0 <= beta <= alpha for A and B in each step"));
    }
    let alpha = steps.iter().map(|step| step.pairs()[0][0].wide()).fold(1.0, f64::max);
    below_bound(&Coupled::of(problem, Against::Pair), alpha, clock)
}

/// Returns whether `α ρ < 1`, from one product with the vector that comes with yes.
fn below_bound(z: &impl Comparison, alpha: f64, clock: &mut Clock<'_>) -> Answer<Vec<f64>> {
    if alpha <= 0.0 || alpha.is_nan() {
        return Answer::No(Failure::Parameter("alpha > 0"));
    }
    let below = |upper: f64| (alpha * upper).next_up() < 1.0;
    let above = |lower: f64| (alpha * lower).next_down() >= 1.0;
    radius(z, below, above, clock)
}

/// By what convergence to the only solution was proved.
///
/// ```
/// use hlcp_core::{Aor, FivePoint, Hlcp, Identity, Omega};
/// use hlcp_verify::{Convergence, Proof, convergence};
///
/// let a = FivePoint::new(2, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?;
/// let proof = |omega, step| -> Result<Option<Proof>, hlcp_core::Error> {
///     let problem = Hlcp::new(a, Identity { order: 2 }, Omega::Uniform(omega))?;
///     Ok(match convergence(&problem, &[step]) {
///         Convergence::Proved(proof, _) => Some(proof),
///         Convergence::NotProved(_) => None,
///     })
/// };
/// let gs = Aor::gauss_seidel();
/// assert_eq!(proof(4.0, gs)?, Some(Proof::Theorem2));
/// assert_eq!(proof(4.0, gs.accelerated())?, Some(Proof::Relaxed));
/// assert_eq!(proof(2.0, gs)?, Some(Proof::Relaxed)); // Ω < D_A D_B⁻¹
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Proof {
    /// Theorem 1 of the paper.
    Theorem1,
    /// Theorem 2 or Corollary 1 of the paper.
    Theorem2,
    /// The relaxed theorem.
    Relaxed,
    /// A vector `d > 0` with `(⟨M⟩ − |N| − |BΩ − A|)d > 0` for every step.
    Witness,
    /// The column theorem, for steps that solve one scalar equation after the other.
    Columns,
}

/// The statement proved of a method on a problem, for every `q` and every start.
///
/// ```
/// use hlcp_core::{Aor, FivePoint, Hlcp, Identity, Omega};
/// use hlcp_verify::convergence;
///
/// let a = FivePoint::new(2, 1, [0.0, -1.0, 4.0, -1.0, 0.0])?;
/// let problem = Hlcp::new(a, Identity { order: 2 }, Omega::Uniform(4.0))?;
/// let said = |aor| convergence(&problem, &[aor]).to_string();
/// // ⟨M⟩d = (8, 7) and (|N| + |BΩ − A|)d = (2, 1) for d = (1, 1).
/// assert_eq!(said(Aor::gauss_seidel()), "convergence: proved by Theorem 2 (factor 0.250001)");
/// let large = said(Aor::new(2.0, 1.0)?); // 2·5/8 > 1
/// assert!(large.contains("not proved, because a spectral radius is at least 0.624999"));
/// # Ok::<(), hlcp_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub enum Convergence {
    /// It converges, and the contraction says how fast.
    Proved(Proof, Contraction),
    /// Nothing is proved: no witness was found, and this is where the relaxed theorem fails.
    NotProved(Answer),
}

impl fmt::Display for Convergence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("convergence: ")?;
        match self {
            Self::Proved(proof, contraction) => {
                let by = match proof {
                    Proof::Theorem1 => "Theorem 1",
                    Proof::Theorem2 => "Theorem 2",
                    Proof::Relaxed => "the relaxed theorem",
                    Proof::Witness => "witness",
                    Proof::Columns => "the column theorem",
                };
                let factor = fixed(contraction.factor, 6, true);
                write!(f, "proved by {by} (factor {factor})")
            }
            Self::NotProved(Answer::No(failure)) => write!(f, "not proved, because {failure}"),
            Self::NotProved(_) => f.write_str("not proved, because no witness was found"),
        }
    }
}

/// Proves convergence by Theorem 2, the relaxed theorem, Theorem 1, a witness or the column
/// theorem, whichever applies first.
///
/// `steps` are the steps of one iteration.
///
/// ```
/// use hlcp_core::{Aor, FivePoint, Hlcp, Omega};
/// use hlcp_verify::{Convergence, Proof, convergence};
///
/// let a = FivePoint::new(4, 4, [-1.0, -1.0, 8.0, -1.0, -1.0])?;
/// let b = FivePoint::new(4, 4, [0.0, -1.0, 8.0, -1.0, 0.0])?;
/// let problem = Hlcp::new(a, b, Omega::Uniform(1.2))?;
/// let Convergence::Proved(by, contraction) = convergence(&problem, &[Aor::gauss_seidel()]) else {
///     panic!("gamma and the start do not matter")
/// };
/// assert_eq!(by, Proof::Relaxed);
/// assert!(contraction.factor < 0.7 && contraction.iterations(1e-10).unwrap() < 60);
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn convergence<T: Scalar, A: Rows<T>, B: Rows<T>>(
    problem: &Hlcp<T, A, B>,
    steps: &[Aor<T>],
) -> Convergence {
    convergence_within(problem, steps, &mut Clock::endless())
}

/// As [`convergence`], with what is proved until the clock is up.
///
/// ```
/// use hlcp_core::{Aor, FivePoint, Hlcp};
/// use hlcp_methods::Clock;
/// use hlcp_verify::{Convergence, convergence_within};
///
/// // Ones are no witness, so one has to be searched for.
/// let problem = Hlcp::lcp(FivePoint::new(40, 40, [-1.0, -1.0, 4.0, -1.0, -1.0])?)?;
/// let mut late = || true;
/// let found = convergence_within(&problem, &[Aor::gauss_seidel()], &mut Clock::new(&mut late));
/// assert!(matches!(found, Convergence::NotProved(_)));
/// # Ok::<(), hlcp_core::Error>(())
/// ```
pub fn convergence_within<T: Scalar, A: Rows<T>, B: Rows<T>>(
    problem: &Hlcp<T, A, B>,
    steps: &[Aor<T>],
    clock: &mut Clock<'_>,
) -> Convergence {
    let all = Steps { problem, steps };
    // The relaxed theorem contains Theorem 2, so its witness is Theorem 2's too, and is searched
    // for once.
    let relaxed = relaxed_theorem_within(problem, steps, clock);
    if let Answer::Yes(d) = &relaxed
        && let Some(contraction) = all.contraction(d.clone())
    {
        // An H₊-matrix A follows from C, which is ⟨A⟩ where these two hold.
        let hypotheses = [signs_and_sizes(problem), omega_large(problem)];
        let paper = steps[0].pairs()[0][1] > T::zero()
            && are_of_the_paper(steps)
            && hypotheses.iter().all(Answer::is_yes)
            && is_h_plus_within(problem.b(), clock).is_yes();
        let proof = if paper { Proof::Theorem2 } else { Proof::Relaxed };
        return Convergence::Proved(proof, contraction);
    }
    let witness = match steps {
        [] => None,
        [_] => match radius_below_one(&all, clock) {
            Answer::Yes(d) => Some(d),
            _ => None,
        },
        // That of two steps is tried on all.
        _ => match search(&all, clock) {
            Found::Common(d) => Some(d),
            _ => None,
        },
    };
    if let Some(d) = witness
        && let Some(contraction) = all.contraction(d)
    {
        let paper = theorem_1_within(problem, steps, clock).applies();
        let proof = if paper { Proof::Theorem1 } else { Proof::Witness };
        return Convergence::Proved(proof, contraction);
    }
    if all.solve_scalars()
        && let Ok(Uniqueness::Proved(Witness::Left { v })) =
            uniqueness_within(problem.a(), problem.b(), clock)
        && let Some(contraction) = all.contraction_of_sums(v)
    {
        return Convergence::Proved(Proof::Columns, contraction);
    }
    Convergence::NotProved(relaxed.then(|| Answer::Undecided))
}

/// Returns whether the steps are those of Theorem 2, or the one of Corollary 1: one (α, β) for A
/// and B, not accelerated, in one direction and then in the other.
fn are_of_the_paper<T: Scalar>(steps: &[Aor<T>]) -> bool {
    let plain = |step: &Aor<T>| {
        let [of_a, of_b] = step.pairs();
        of_a == of_b && !step.is_accelerated()
    };
    match steps {
        [one] => plain(one),
        [one, other] => plain(one) && one != other && one.forward() == other.forward(),
        _ => false,
    }
}

/// (I) for AOR splittings, entry by entry: `⟨A⟩ = ⟨M⟩ − |N|` holds on the diagonal for α ≤ 1, in
/// the swept triangle for 0 ≤ β ≤ α, and always in the other one.
fn compatible<T: Scalar, A: Rows<T>, B: Rows<T>>(
    problem: &Hlcp<T, A, B>,
    steps: &[Aor<T>],
) -> Answer {
    if steps.is_empty() {
        return Answer::No(Failure::Parameter("those of one step or more"));
    }
    for step in steps {
        if step.is_accelerated() {
            return Answer::No(Failure::Parameter("those of a step of MMS or TMMS"));
        }
        let fits = |[alpha, beta]: [T; 2], i: usize, j: usize, entry: f64| {
            entry == 0.0
                || if i == j {
                    alpha <= T::one()
                } else {
                    !step.precedes(j, i) || T::zero() <= beta && beta <= alpha
                }
        };
        let [of_a, of_b] = step.pairs();
        let fit = all_entries(problem.a(), |i, j, entry| fits(of_a, i, j, entry))
            .then(|| all_entries(problem.b(), |i, j, entry| fits(of_b, i, j, entry)));
        if !fit.is_yes() {
            return fit;
        }
    }
    Answer::Yes(())
}

/// (II), compared exactly.
fn signs_and_sizes<T: Scalar, A: Rows<T>, B: Rows<T>>(problem: &Hlcp<T, A, B>) -> Answer {
    let mut entries = vec![];
    for row in 0..problem.order() {
        merge((problem.a(), problem.b()), row, &mut entries);
        if entries.iter().any(|(_, [a, _])| a.is_nan()) {
            return Answer::Undecided;
        }
        for &(column, [a, b]) in &entries {
            if column == row || b == 0.0 {
                continue;
            }
            let omega = problem.omega().entry(column).wide();
            let size = sign([(b.abs(), omega), (-a.abs(), 1.0)].into_iter());
            // The product of the two might underflow.
            if a < 0.0 && b > 0.0 || a > 0.0 && b < 0.0 || size.is_some_and(|order| order.is_gt()) {
                return Answer::No(Failure::Entry { row, column });
            }
            if size.is_none() {
                return Answer::Undecided;
            }
        }
    }
    Answer::Yes(())
}

/// `Ω ≥ D_A D_B⁻¹`, compared exactly.
fn omega_large<T: Scalar, A: Rows<T>, B: Rows<T>>(problem: &Hlcp<T, A, B>) -> Answer {
    for row in 0..problem.order() {
        let [a, b] =
            [problem.a().diagonal_entry(row).wide(), problem.b().diagonal_entry(row).wide()];
        match sign([(problem.omega().entry(row).wide(), b), (-a, 1.0)].into_iter()) {
            Some(order) if order.is_ge() && b > 0.0 => {}
            Some(_) => return Answer::No(Failure::Entry { row, column: row }),
            None => return Answer::Undecided,
        }
    }
    Answer::Yes(())
}
