use hlcp_core::{Error, Tridiagonal};
use hlcp_methods::Outcome;

use super::{
    FilmError, Settings,
    solve::{LEAST, ROUNDING, solve},
};

/// A film along a line above a plane that moves in the direction of x, in SI units.
///
/// Between two points the gap is a straight line. The film is full at the first point, and both
/// ends are at the ambient pressure.
///
/// # What is solved
///
/// The Reynolds equation with mass-conserving cavitation: with the pressure `p` above the
/// cavitation pressure and the void fraction `r`, what flows is `Φ = ½U(1 − r)h − h³/(12μ) dp/dx`,
/// the same everywhere, and `p, r ≥ 0`, `p r = 0`. On a straight line a full film's flux is known
/// exactly: with the harmonic mean `H = 2h₁h₂/(h₁ + h₂)`,
///
/// ```text
/// Φ = ½U (1 − r) H − (p₂ − p₁) H h₁h₂/(12μ Δx) ,    r of the point before.
/// ```
///
/// That what enters a point leaves it is its row of `A z − B r + q = 0`: `A` tridiagonal, `B`
/// bidiagonal, both M-matrices. Newton's method solves it in a few steps.
///
/// ```
/// use hlcp::film::{Profile, Settings};
///
/// // Rayleigh's step on a line of 20 mm, with a ramp of 20 nm.
/// let profile = Profile {
///     x: vec![0.0, 0.014, 0.014 + 2e-8, 0.02],
///     h: vec![4e-5, 4e-5, 2e-5, 2e-5],
///     speed: 2.0,
///     viscosity: 0.04,
///     ambient: 1e5,
///     cavitation: 0.0,
/// };
/// let line = profile.solve(&Settings::default())?;
/// let rise = 6.0 * 0.04 * 2.0 * 0.014 * 0.006 * 2e-5 / (0.006 * 64e-15 + 0.014 * 8e-15);
/// assert!((line.pressure[line.peak] / (1e5 + rise) - 1.0).abs() < 1e-5);
/// assert!((line.load / (rise * 0.01) - 1.0).abs() < 1e-5 && line.ruptures.is_empty());
/// # Ok::<(), hlcp::film::FilmError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// The places, in m, which increase.
    pub x: Vec<f64>,
    /// The gap at each, in m.
    pub h: Vec<f64>,
    /// The speed of the plane, in m/s.
    pub speed: f64,
    /// The viscosity, in Pa s.
    pub viscosity: f64,
    /// The pressure at both ends, in Pa.
    pub ambient: f64,
    /// The pressure in a broken film, in Pa.
    pub cavitation: f64,
}

/// What a [`Profile`] does, in SI units and per metre of width.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Line {
    /// What became of the solve.
    pub outcome: Outcome,
    /// The pressure at each point, in Pa.
    pub pressure: Vec<f64>,
    /// The void fraction of the piece that begins at a point, and last that at the end.
    pub void: Vec<f64>,
    /// The flow through each piece, in m²/s.
    pub flow: Vec<f64>,
    /// The integral of the pressure above the ambient one, in N/m, by its values at the points.
    pub load: f64,
    /// The drag on the plane, in N/m.
    pub friction: f64,
    /// The point of the largest pressure.
    pub peak: usize,
    /// The points where a full film has ruptured; the front itself is at most a piece away.
    pub ruptures: Vec<usize>,
    /// The points where a broken film has formed again.
    pub forms_again: Vec<usize>,
}

/// How far apart flows are over what the peak drives through the least gap: below, the pressures of
/// 1251 full films, with a part up to 3·10⁵ times as deep as that gap, are off by 2·10⁻⁵ at most.
const OFF_BALANCE: f64 = 1e-4;

impl Line {
    /// Returns the largest flow through a piece, and by how much the smallest is off it.
    pub fn through(&self) -> [f64; 2] {
        let [least, most] = [f64::min, f64::max]
            .map(|pick| self.flow.iter().copied().reduce(pick).unwrap_or(f64::NAN));
        [most, most - least]
    }
}

impl Profile {
    /// Returns into how many pieces each stretch between two places is cut: into so many, or so
    /// that none is longer than 1/400 of the film.
    ///
    /// Load and peak take the pressures at the points alone. With 400 pieces the load of a plane
    /// wedge is 7e-6 off if the gap narrows to 2/3, 5e-5 for a tenth and 2e-3 for a hundredth, and
    /// a rupture is known to 1/400 of the film.
    ///
    /// ```
    /// use hlcp::film::Profile;
    ///
    /// let x = [0.0, 1.0, 4.0];
    /// assert_eq!(Profile::pieces(&x, None), [100, 300]);
    /// let pieces = Profile::pieces(&x, Some(2));
    /// assert_eq!(Profile::cut(&x, &pieces), [0.0, 0.5, 1.0, 2.5, 4.0]);
    /// ```
    pub fn pieces(x: &[f64], into: Option<u16>) -> Vec<usize> {
        let length = x[x.len() - 1] - x[0];
        let by_length = |x: &[f64]| ((x[1] - x[0]) / length * 400.0).ceil().max(1.0) as usize;
        x.windows(2).map(|x| into.map_or_else(|| by_length(x), usize::from)).collect()
    }

    /// Returns the values on straight lines between these, each cut into so many pieces.
    pub fn cut(v: &[f64], pieces: &[usize]) -> Vec<f64> {
        let inner = v.windows(2).zip(pieces).flat_map(|(ends, &pieces)| {
            (0..pieces).map(move |k| ends[0] + (ends[1] - ends[0]) * k as f64 / pieces as f64)
        });
        inner.chain(v.last().copied()).collect()
    }

    /// What makes the figures of a line uncertain although the solve converged: parts so deep that
    /// rounding in what flows there is as much as what pressures drive through the least gap.
    pub(super) fn doubt(&self, line: &Line) -> Option<String> {
        let [length, thin, unit] = self.units();
        let peak = (line.pressure[line.peak] - self.cavitation).max(1e-4 * unit);
        let off = line.through()[1] / (peak * thin.powi(3) / (12.0 * self.viscosity * length));
        (off > OFF_BALANCE).then(|| {
            format!(
                "what flows through the pieces differs by {off:.0e} of what the peak drives through \
                 the least gap, because the film has parts too deep for double precision; load, \
                 friction, flow and peak are uncertain; make no part deeper than some hundred times \
                 the least gap, which changes pressures little"
            )
        })
    }

    /// The length of the film, the least gap and a pressure of both.
    pub(super) fn units(&self) -> [f64; 3] {
        let length = self.x[self.x.len() - 1] - self.x[0];
        let thin = self.h.iter().copied().fold(f64::INFINITY, f64::min);
        [length, thin, 6.0 * self.viscosity * self.speed * length / (thin * thin)]
    }

    /// Solves for the film at all points but the ends.
    ///
    /// # Errors
    ///
    /// [`FilmError::Input`] for fewer than three points, another number of gaps, and an ambient
    /// pressure below that of cavitation; [`FilmError::Range`] for places that do not increase,
    /// gaps that are not positive, and a unit of pressure, `6μUL/h²`, that is no positive number.
    pub fn solve(&self, settings: &Settings<'_>) -> Result<Line, FilmError> {
        let Self { x, h, speed, viscosity, ambient, cavitation } = self;
        let (expected, found) = (x.len(), h.len());
        if expected < 3 {
            return Err(Error::Empty { what: "the line between the ends" }.into());
        } else if found != expected {
            return Err(Error::Order { what: "the gap", found, expected }.into());
        }
        // Lengths in those of the film, gaps in the smallest.
        let [length, thin, unit] = self.units();
        let rises = x.windows(2).all(|x| x[1] > x[0]) && length.is_finite();
        let is_sound = rises && thin > 0.0 && h.iter().all(|h| h.is_finite());
        if !(is_sound && unit > 0.0 && unit.is_finite()) {
            return Err(FilmError::Range { length, thin });
        }
        let ends = (ambient - cavitation) / unit;
        if !(ends >= 0.0 && ends.is_finite()) {
            let (name, range) =
                ("the ambient pressure", "finite, and not below that of cavitation");
            return Err(Error::Parameter { name, value: *ambient, range }.into());
        }
        let scaled = |v: &[f64], by: f64| -> Vec<f64> { v.iter().map(|v| v / by).collect() };
        let ([z, void, flow], outcome) =
            pieces(&scaled(x, length), &scaled(h, thin), ends, settings)?;
        let pressure: Vec<f64> = z.iter().map(|z| z * unit + cavitation).collect();
        let p = &pressure;
        // On the plane, with the middle gap of each piece.
        let shear = |k: usize| {
            let middle = (h[k] + h[k + 1]) / 2.0;
            (1.0 - void[k]) * viscosity * speed / middle * (x[k + 1] - x[k])
                + middle / 2.0 * (p[k + 1] - p[k])
        };
        let over = |k: usize| ((p[k] + p[k + 1]) / 2.0 - ambient) * (x[k + 1] - x[k]);
        let full = |i: usize| void[i] == 0.0;
        let fronts = |opens: bool| {
            (1..x.len()).filter(|&i| full(i) != full(i - 1) && full(i) != opens).collect()
        };
        Ok(Line {
            load: (0..flow.len()).map(over).sum(),
            friction: (0..flow.len()).map(shear).sum(),
            peak: (0..p.len()).fold(0, |peak, i| if p[i] > p[peak] { i } else { peak }),
            ruptures: fronts(true),
            forms_again: fronts(false),
            flow: flow.iter().map(|flow| flow * speed * thin / 2.0).collect(),
            outcome,
            pressure,
            void,
        })
    }
}

/// Solves for gaps in the smallest one, places in the film's length and the pressure `ends` at both
/// ends; returns pressure and void at the points, and what flows through the pieces.
fn pieces(
    x: &[f64],
    h: &[f64],
    ends: f64,
    settings: &Settings<'_>,
) -> Result<([Vec<f64>; 3], Outcome), FilmError> {
    // Row i is the balance of point i + 1, between the pieces i and i + 1.
    let gap: Vec<f64> = h.windows(2).map(|h| 2.0 * h[0] * h[1] / (h[0] + h[1])).collect();
    let n = gap.len() - 1;
    let c: Vec<f64> = (0..=n).map(|k| gap[k] * h[k] * h[k + 1] / (x[k + 1] - x[k])).collect();
    let mut q: Vec<f64> = gap.windows(2).map(|gap| gap[1] - gap[0]).collect();
    q[0] -= c[0] * ends;
    q[n - 1] -= c[n] * ends;
    let (of_c, of_gap) = (c.clone(), gap.clone());
    let a = Tridiagonal::new(n, move |i| [-of_c[i], of_c[i] + of_c[i + 1], -of_c[i + 1]])?;
    let b = Tridiagonal::new(n, move |i| [-of_gap[i], of_gap[i + 1], 0.0])?;
    // A solution at every other point says where about the film is full: without it Newton's method
    // takes thousands of steps where fronts are many.
    let begin = if n > 60 {
        let coarse = |v: &[f64]| -> Vec<f64> {
            let kept = (0..v.len()).filter(|i| i % 2 == 0 || i + 1 == v.len());
            kept.map(|i| v[i]).collect()
        };
        let ([z, r, _], _) = pieces(&coarse(x), &coarse(h), ends, settings)?;
        let fine = |v: &[f64]| (1..=n).map(|i| (v[i / 2] + v[i.div_ceil(2)]) / 2.0).collect();
        Some([fine(&z), fine(&r)])
    } else {
        None
    };
    let asked = (("NEWTON", usize::MAX), LEAST, ROUNDING);
    let (z, r, outcome) = solve(&[Box::new(a), Box::new(b)], &q, begin, asked, settings)?;

    let z = [&[ends][..], &z, &[ends]].concat();
    // The film is full at the inlet, and at the outlet if there is pressure.
    let last = if ends > 0.0 { 0.0 } else { r[n - 1] };
    let r = [&[0.0][..], &r, &[last]].concat();
    let flow = (0..=n).map(|k| (1.0 - r[k]) * gap[k] - c[k] * (z[k + 1] - z[k])).collect();
    Ok(([z, r, flow], outcome))
}
