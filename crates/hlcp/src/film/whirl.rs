use std::f64::consts::PI;

use faer::{
    Mat, c64,
    linalg::solvers::Solve,
    sparse::{SparseColMat, Triplet},
};
use hlcp_core::Rows;
use hlcp_methods::Jacobian;
use hlcp_verify::Film;
use nalgebra::Matrix2;

use super::{
    Bearing, Coefficients, FilmError, Solved,
    solve::{modulus, posed, problem},
};

/// The most cells of a film that is eliminated in complex numbers: a grid of so many takes some 3
/// GB and half a minute.
const CELLS: usize = 300_000;

/// Threshold frequencies are looked for in this many parts of twice the running speed, and each is
/// found as nearly as this, over itself, by so many steps at most.
const PARTS: u8 = 16;
const NEAR: f64 = 1e-9;
const STEPS: usize = 60;

/// The threshold at which a rigid rotor on a journal bearing leaves its place by itself.
///
/// ```
/// use hlcp::film::Coefficients;
///
/// // The short bearing that runs in its middle: it whirls at half the speed, 100 rad/s here.
/// let found = Coefficients {
///     stiffness: vec![vec![0.0, 5e6], vec![-5e6, 0.0]],
///     damping: vec![vec![1e5, 0.0], vec![0.0, 1e5]],
/// };
/// assert_eq!(found.threshold().map(|found| (found.omega, found.mass)), Some((50.0, 0.0)));
///
/// // The film pushes the rotor away in one direction.
/// let found = Coefficients { stiffness: vec![vec![4e6, 0.0], vec![0.0, -1e5]], ..found };
/// assert_eq!(found.threshold().map(|found| (found.omega, found.mass)), Some((0.0, 0.0)));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Threshold {
    /// The mass on this bearing, in kg, above which it whirls (critical mass); 0 where a rotor of
    /// any mass leaves its place.
    pub mass: f64,
    /// The angular frequency of the whirl, in rad/s, where any rotor whirls that of a light one; 0
    /// where the film pushes the rotor away without a whirl (static instability).
    pub omega: f64,
}

impl Threshold {
    /// Searches for the threshold of a journal with the coefficients at its own frequency, up to
    /// twice the running speed; `None` where a rotor of any mass keeps its place as far as that
    /// tells, and for a journal that does not turn or a film of another kind.
    ///
    /// # Method
    ///
    /// A rotor without mass leaves its place where `det (K + sC)` has zeros with a positive real
    /// part. These are counted by the angle of `det (K + iωC)`, which rises from 0 to π without
    /// them, as the film with its walls at rest has no growing motions of its own. The least mass
    /// for which `m(iω)² + K + iωC` is singular at some frequency is then the threshold: a growing
    /// motion can only come to be where the real part of one is 0.
    ///
    /// # Cost
    ///
    /// Coefficients at 16 frequencies, and some six for each that makes a matrix singular.
    ///
    /// # Errors
    ///
    /// As [`Coefficients::at`].
    pub fn of(bearing: &Bearing, solved: &Solved) -> Result<Option<Self>, FilmError> {
        let part = 2.0 * bearing.running_speed() / f64::from(PARTS);
        if bearing.journal.is_none() || part == 0.0 {
            return Ok(None);
        }
        let at = |omega: f64| {
            let found = Coefficients::at(bearing, solved, omega)?;
            Ok::<_, FilmError>(found.rotor().expect("a journal moves along two coordinates"))
        };
        let mut before = at(0.0)?;
        if before.steady <= 0.0 {
            return Ok(Some(Self { mass: 0.0, omega: 0.0 }));
        }
        let (mut angle, mut nearest, mut found) = (0.0, [f64::INFINITY, 0.0], None::<Self>);
        for k in 1..=PARTS {
            let omega = f64::from(k) * part;
            let rotor = at(omega)?;
            let [one, two] = [before.at(omega - part), rotor.at(omega)];
            angle += (two / one).arg();
            if two.norm() < nearest[0] {
                nearest = [two.norm(), omega];
            }
            if (before.off(omega - part) < 0.0) != (rotor.off(omega) < 0.0) {
                let [mut far, mut near] = [(omega - part, before), (omega, rotor)];
                let [mut off, mut last] = [far, near].map(|(omega, rotor)| rotor.off(omega));
                let least = off.abs().min(last.abs());
                for _ in 0..STEPS {
                    // The secant through both ends; one that stays counts half (Illinois).
                    let way = last * (near.0 - far.0) / (last - off);
                    let next = (near.0 - way, at(near.0 - way)?);
                    let now = next.1.off(next.0);
                    if (now < 0.0) == (last < 0.0) {
                        off /= 2.0;
                    } else {
                        (far, off) = (near, last);
                    }
                    (near, last) = (next, now);
                    if way.abs() <= NEAR * near.0 || now == 0.0 {
                        break;
                    }
                }
                let (omega, mass) = (near.0, near.1.left / near.0.powi(2));
                // At a pole the sign changes as well, but nothing becomes small.
                let is_zero = last.abs() <= least;
                if is_zero && mass > 0.0 && found.is_none_or(|found| mass < found.mass) {
                    found = Some(Self { mass, omega });
                }
            }
            before = rotor;
        }
        // Of a negative determinant of C one zero is real and positive, and the angle is below π/2.
        if 0.0 < angle && angle < PI && before.damped > 0.0 {
            return Ok(found);
        }
        Ok(Some(Self { mass: 0.0, omega: nearest[1] }))
    }
}

/// What a rigid rotor sees of coefficients.
#[derive(Clone, Copy)]
struct Rotor {
    /// The determinants of stiffness and damping, and what stands with `s` in `det (K + sC)`.
    steady: f64,
    damped: f64,
    crossed: f64,
    /// What a whirl leaves of the stiffness, and the determinant of the stiffness without that.
    left: f64,
    rest: f64,
}

impl Rotor {
    /// `det (K + iωC)`.
    fn at(&self, omega: f64) -> c64 {
        c64::new(self.steady - omega * omega * self.damped, omega * self.crossed)
    }

    /// What is off in a whirl with the mass that fits, which is 0 at a threshold.
    fn off(&self, omega: f64) -> f64 {
        self.rest - omega * omega * self.damped
    }
}

impl Coefficients {
    /// Computes those of a solved film for motions of this angular frequency, in rad/s, which is 0
    /// or more.
    ///
    /// While the wall moves by `δ exp(iωt)` the force against it is `(K + iωC) δ exp(iωt)`. It is
    /// answered by the matrix of the last step of Newton's method with `iω` times what full and
    /// broken cells store. For slow motions these are [`new`](Self::new).
    ///
    /// # Cost
    ///
    /// One complex elimination, and a solve for each coordinate.
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new), and [`FilmError::Large`] for more than 300,000 cells.
    ///
    /// ```
    /// use hlcp::film::{Bearing, Coefficients, Film, Settings, Solved};
    ///
    /// // A full film stores nothing but its gap: the same at all frequencies.
    /// let film = Film::new([50, 30], [0.05, 0.03], 3.0, 0.04).with_gap(|x, _| 4e-5 - 4e-4 * x);
    /// let pad = Bearing::pad(film);
    /// let solved = Solved::new(pad.here().expect("it is open"), None, &Settings::default())?;
    /// let [slow, fast] = [0.0, 600.0].map(|omega| Coefficients::at(&pad, &solved, omega));
    /// let (slow, fast) = (slow?.damping[0][0], fast?.damping[0][0]);
    /// assert!((slow - fast).abs() <= 1e-9 * slow);
    /// # Ok::<(), hlcp::film::FilmError>(())
    /// ```
    pub fn at(bearing: &Bearing, solved: &Solved, omega: f64) -> Result<Self, FilmError> {
        if omega == 0.0 {
            return Self::new(bearing, solved);
        }
        solved.check_steady()?;
        let found = answer(bearing, solved, c64::new(0.0, omega))?;
        let part = |of: &dyn Fn(&c64) -> f64| {
            let rows = found.iter().map(|row| row.iter().map(of).collect());
            bearing.against_load(solved, rows.collect())
        };
        Ok(Self { stiffness: part(&|entry| entry.re), damping: part(&|entry| entry.im / omega) })
    }

    /// Returns the threshold of a rigid rotor on a journal with these coefficients at all
    /// frequencies, by the criterion of Routh and Hurwitz; `None` if a rotor of any mass keeps its
    /// place, or the coefficients are no journal's.
    ///
    /// # Source
    ///
    /// J. W. Lund, *Review of the concept of dynamic coefficients for fluid film journal bearings*,
    /// J. Tribology 109 (1987) 37–41.
    pub fn threshold(&self) -> Option<Threshold> {
        let rotor = self.rotor()?;
        let Rotor { steady, damped, crossed, left, rest } = rotor;
        // The trace of the damping has the sign of crossed/left.
        if steady > 0.0 && damped > 0.0 && crossed > 0.0 && left > 0.0 {
            let square = rest / damped;
            let found = Threshold { mass: left / square, omega: square.sqrt() };
            return (square > 0.0).then_some(found);
        }
        // The frequency of a light rotor, a zero of det (K + sC).
        let square = steady / damped - (crossed / (2.0 * damped)).powi(2);
        let whirls = steady > 0.0 && square > 0.0;
        Some(Threshold { mass: 0.0, omega: if whirls { square.sqrt() } else { 0.0 } })
    }

    fn rotor(&self) -> Option<Rotor> {
        let (k, c) = (square(&self.stiffness)?, square(&self.damping)?);
        let crossed = k.m11 * c.m22 + k.m22 * c.m11 - k.m12 * c.m21 - k.m21 * c.m12;
        let left = crossed / c.trace();
        let rest = (k - Matrix2::from_diagonal_element(left)).determinant();
        Some(Rotor { steady: k.determinant(), damped: c.determinant(), crossed, left, rest })
    }
}

/// The matrix, if it is one of two by two.
fn square(matrix: &[Vec<f64>]) -> Option<Matrix2<f64>> {
    let is_square = matrix.len() == 2 && matrix.iter().all(|row| row.len() == 2);
    is_square.then(|| Matrix2::from_fn(|k, l| matrix[k][l]))
}

/// The derivatives of the forces for motions that grow as `exp(st)`.
fn answer(bearing: &Bearing, solved: &Solved, s: c64) -> Result<Vec<Vec<c64>>, FilmError> {
    let (film, n) = (&solved.film, solved.r.len());
    if n > CELLS {
        return Err(FilmError::Large { cells: n, most: CELLS });
    }
    let (operators, _) = posed(film)?;
    let problem = problem(&operators)?;
    let x = modulus(&solved.r);
    let jacobian = Jacobian::new(&problem, &x);
    let lu = factors(film, &jacobian, s).ok_or(FilmError::Derivatives(f64::NAN))?;
    let mut found = vec![vec![c64::new(0.0, 0.0); bearing.modes.len()]; bearing.modes.len()];
    let unit = film.pressure_unit() * film.cell();
    for (column, mode) in bearing.modes.iter().enumerate() {
        let steady = solved.widened(mode, &solved.r);
        let stored = film.storing(&solved.r, mode, &vec![0.0; n]);
        let mut y = Mat::from_fn(n, 1, |k, _| c64::new(steady[k], 0.0) + s * stored[k]);
        lu.solve_in_place(y.as_mut());
        for (row, mode) in found.iter_mut().zip(&bearing.modes) {
            // J has the columns 2A of full cells.
            let pressed = (0..n).filter(|&k| jacobian.is_active(k));
            row[column] = pressed.map(|k| y[(k, 0)] * (-2.0 * unit * mode[k])).sum();
        }
        if !found[0][column].re.is_finite() {
            return Err(FilmError::Derivatives(f64::NAN));
        }
    }
    Ok(found)
}

/// The factors of `J` with `s` times what broken cells store.
fn factors<A: Rows<f64>, B: Rows<f64>>(
    film: &Film,
    jacobian: &Jacobian<'_, f64, A, B>,
    s: c64,
) -> Option<faer::sparse::linalg::solvers::Lu<usize, c64>> {
    let n = film.gap.len();
    let emptied = film.storing(&vec![0.0; n], &vec![0.0; n], &vec![-1.0; n]);
    let mut entries = vec![];
    for (k, emptied) in emptied.into_iter().enumerate() {
        jacobian.visit_row(k, |j, entry| entries.push(Triplet::new(k, j, c64::new(entry, 0.0))));
        if !jacobian.is_active(k) {
            let by = 2.0 * jacobian.problem().omega().entry(k) * emptied;
            entries.push(Triplet::new(k, k, s * by));
        }
    }
    SparseColMat::try_new_from_triplets(n, n, &entries).ok()?.sp_lu().ok()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use proptest::prelude::*;

    use super::*;
    use crate::film::{Drive, Journal, Motion, Settings};

    /// What the forces gain per displacement along a coordinate in the last of eight turns of small
    /// whirls, by implicit steps in time, so many in a turn; none where a cell fills or breaks on
    /// the way, for there forces have no derivative.
    fn transient(bearing: &Bearing, column: usize, omega: f64, steps: usize) -> Option<[c64; 2]> {
        let (settings, size) = (Settings::default(), 1e-9);
        let mut motion = Motion::new(bearing.clone(), &settings).unwrap();
        let forces = |motion: &Motion| {
            let solved = motion.solved.as_ref().unwrap();
            bearing.forces(&solved.film, &solved.z)
        };
        let full = |motion: &Motion| {
            let solved = motion.solved.as_ref().unwrap();
            solved.z.iter().zip(&solved.r).map(|(z, r)| z > r).collect::<Vec<_>>()
        };
        let (before, full_before) = (forces(&motion), full(&motion));
        let mut found = [c64::new(0.0, 0.0); 2];
        for k in 1..=8 * steps {
            let (sin, cos) = (TAU * (k % steps) as f64 / steps as f64).sin_cos();
            let mut to = bearing.position.clone();
            to[column] += size * sin;
            motion.step(TAU / omega / steps as f64, &Drive::To(to), &settings).unwrap();
            if full(&motion) != full_before {
                return None;
            }
            if k > 7 * steps {
                let gains =
                    forces(&motion).into_iter().zip(&before).map(|(now, before)| now - before);
                for (found, gain) in found.iter_mut().zip(gains) {
                    *found += c64::new(sin, cos) * (2.0 * gain / (size * steps as f64));
                }
            }
        }
        Some(found)
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(3) })]

        /// Implicit steps answer as exp(st) does with the `s` of their difference quotient.
        #[test]
        fn whirls_in_steps_are_answered_exactly(
            (ecc, turn, speed) in (0.1..0.8_f64, 0.0..TAU, 8.0..20.0),
            (ratio, steps) in (0.25..1.5, 16..40_usize),
        ) {
            let journal = Journal::round(0.1, 0.05, 1e-4);
            let mut bearing = Bearing::journal(journal, [36, 6]);
            bearing.film.speeds = [speed, 0.0];
            bearing.film.viscosity = vec![0.02];
            bearing.film.supplies = vec![journal.groove(0.0, [0.0, 0.05], 1e5)];
            bearing.position = vec![ecc * 1e-4 * turn.cos(), ecc * 1e-4 * turn.sin()];
            let settings = Settings::default();
            let solved = Solved::new(bearing.here().unwrap(), None, &settings).unwrap();
            let omega = ratio * bearing.running_speed();
            let angle = TAU / steps as f64;
            // (3 − 4 exp(−iφ) + exp(−2iφ))/2 over the length of a step.
            let [once, twice] = [angle, 2.0 * angle].map(|by| c64::new(by.cos(), -by.sin()));
            let s = (3.0 - 4.0 * once + twice) * (0.5 * omega / angle);
            let exact = answer(&bearing, &solved, s).unwrap();
            let size = exact.concat().into_iter().map(|entry| entry.norm()).fold(0.0, f64::max);
            for column in 0..2 {
                let found = transient(&bearing, column, omega, steps);
                prop_assume!(found.is_some());
                for (found, exact) in found.iter().flatten().zip(&exact) {
                    // A displacement of 1e-5 clearances: solves leave 1e-7 of what it does.
                    let off = (found - exact[column]).norm();
                    prop_assert!(off <= 1e-4 * size, "{found} {}", exact[column]);
                }
            }
        }
    }

    /// The largest real part of the motions of a rotor of this mass: of the eigenvalues of
    /// `(e, v)' = (v, −(K e + C v)/m)`, in units in which K and C are near 1.
    fn growth(found: &Coefficients, mass: f64) -> f64 {
        let entry = |matrix: &[Vec<f64>], k: usize, l: usize| -matrix[k][l] / mass;
        let motion = nalgebra::Matrix4::from_fn(|row, column| match (row, column) {
            (0 | 1, _) => f64::from(u8::from(column == row + 2)),
            (_, 0 | 1) => entry(&found.stiffness, row - 2, column),
            _ => entry(&found.damping, row - 2, column - 2),
        });
        motion.complex_eigenvalues().iter().map(|s| s.re).fold(f64::NEG_INFINITY, f64::max)
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Heavier rotors than the threshold leave their place, and lighter ones keep it.
        #[test]
        fn a_threshold_is_where_eigenvalues_cross(
            k in prop::array::uniform4(-1.0..1.0_f64),
            c in prop::array::uniform4(-1.0..1.0_f64),
            (stiff, damped) in (0.0..1.5_f64, 0.5..1.5),
        ) {
            let found = Coefficients {
                stiffness: vec![vec![k[0] + stiff, k[1]], vec![k[2], k[3] + stiff]],
                damping: vec![vec![c[0] + damped, c[1]], vec![c[2], c[3] + damped]],
            };
            let grows = |mass: f64| growth(&found, mass);
            match found.threshold() {
                None => prop_assert!([0.01, 1.0, 100.0].map(grows).iter().all(|growth| *growth < 1e-9)),
                Some(Threshold { mass, .. }) if mass > 0.0 => {
                    prop_assert!(grows(0.99 * mass) < 1e-9 && grows(1.01 * mass) > -1e-9);
                }
                Some(Threshold { omega, .. }) => {
                    prop_assert!(grows(1e-6) > -1e-9);
                    // Where it is pushed away without a whirl, a real motion grows.
                    let stiffness = square(&found.stiffness).unwrap();
                    prop_assert!(omega == 0.0 || stiffness.determinant() > 0.0);
                }
            }
        }
    }
}
