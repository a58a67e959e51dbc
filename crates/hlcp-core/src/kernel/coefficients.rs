use std::ops::Range;

use super::grid::{COLUMNS, Grid, PAD};
use crate::{numbers::Scalar, operators::Coefficients, rows::Relaxation};

/// The factors of `v` and of `|v|`.
pub(super) type Pair<T> = [T; 2];

/// Returns the share of `t` that a passed neighbour of value `v` takes.
#[inline(always)]
pub(super) fn part<T: Scalar, const ACCELERATED: bool>(factor: Pair<T>, v: T) -> T {
    if ACCELERATED { factor[0] * v + factor[1] * v.abs() } else { factor[0] * v }
}

/// Returns what a neighbour of value `x` adds to F.
#[inline(always)]
fn share<T: Scalar>(factor: [T; 2], x: T) -> T {
    x * if x > T::zero() { factor[0] } else { factor[1] }
}

/// One row of the system as the sweep uses it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Row<T> {
    /// 2aᵢⱼ and 2bᵢⱼωⱼ for the five neighbours: what multiplies xⱼ in F where xⱼ is positive and
    /// where not.
    defect: [[T; 2]; 5],
    /// 1/mᵢᵢ.
    over_pivot: T,
    /// The factors with which the southern, western, eastern and northern neighbour enter `t` once
    /// they have been passed.
    passed: [Pair<T>; 4],
}

impl<T: Scalar> Row<T> {
    #[inline(always)]
    pub(super) fn new<const ACCELERATED: bool>(
        [of_a, of_b]: [Relaxation<T>; 2],
        a: [T; 5],
        b_omega: [T; 5],
    ) -> Self {
        let over_pivot = (a[2] * of_a.diagonal + b_omega[2] * of_b.diagonal).recip();
        let passed = |j: usize| {
            let m = of_a.triangle * a[j] + of_b.triangle * b_omega[j];
            let d = if ACCELERATED { a[j] - b_omega[j] } else { T::zero() };
            [m * over_pivot, d * over_pivot]
        };
        let defect = |j: usize| [a[j] + a[j], b_omega[j] + b_omega[j]];
        Self {
            defect: [defect(0), defect(1), defect(2), defect(3), defect(4)],
            over_pivot,
            passed: [passed(0), passed(1), passed(3), passed(4)],
        }
    }

    /// Returns the functions s and w of the module's formula; those of the other direction are the
    /// shares of neighbours that the sweep has not passed, should they lie across a grid that
    /// closes.
    #[inline(always)]
    pub(super) fn passed(&self, backward: bool) -> [Pair<T>; 2] {
        let [south, west, east, north] = self.passed;
        if backward { [north, east] } else { [south, west] }
    }

    /// Returns F, from the old values around the point and from γq.
    #[inline(always)]
    pub(super) fn defect(&self, x: [T; 5], gamma_q: T) -> T {
        let mut f = gamma_q;
        for (x, factor) in x.into_iter().zip(self.defect) {
            f += share(factor, x);
        }
        f
    }

    /// Returns F and `t` of a sweep in lexicographic order.
    #[inline(always)]
    pub(super) fn relaxed<const BACKWARD: bool, const ACCELERATED: bool>(
        &self,
        x: [T; 5],
        gamma_q: T,
    ) -> (T, T) {
        let f = self.defect(x, gamma_q);
        let [of_across, of_along] = self.passed(BACKWARD);
        let [across, along] = if BACKWARD { [x[4], x[3]] } else { [x[0], x[1]] };
        let passed =
            part::<T, ACCELERATED>(of_across, across) + part::<T, ACCELERATED>(of_along, along);
        (f, (x[2] - f * self.over_pivot) + passed)
    }

    /// Returns `t` of a sweep with α = β = 1 that knows `f`, where no neighbour has been passed
    /// yet.
    ///
    /// With Ω = D_A D_B⁻¹ the diagonal of F is `mᵢᵢ xᵢ`, so F needs no old value of the point, and
    /// an accelerated sweep takes all that a passed neighbour contributes in the recurrence.
    #[inline(always)]
    pub(super) fn solved<const BACKWARD: bool>(&self, [across, along]: [T; 2], f: T) -> T {
        let [of_across, of_along] = if BACKWARD {
            [self.defect[0], self.defect[1]]
        } else {
            [self.defect[4], self.defect[3]]
        };
        -(f + share(of_across, across) + share(of_along, along)) * self.over_pivot
    }

    /// Returns F, `t` of a point of the first colour, and what `t` of the second colour has more.
    #[inline(always)]
    pub(super) fn coloured<const ACCELERATED: bool>(&self, x: [T; 5], gamma_q: T) -> (T, T, T) {
        let f = self.defect(x, gamma_q);
        let beside = self.beside::<ACCELERATED>([x[0], x[1], x[3], x[4]]);
        (f, x[2] - f * self.over_pivot, beside)
    }

    /// Returns the share of `t` that all four neighbours take.
    #[inline(always)]
    pub(super) fn beside<const ACCELERATED: bool>(&self, [south, west, east, north]: [T; 4]) -> T {
        let [s, w, e, n] = self.passed;
        let (s, w) = (part::<T, ACCELERATED>(s, south), part::<T, ACCELERATED>(w, west));
        let (e, n) = (part::<T, ACCELERATED>(e, east), part::<T, ACCELERATED>(n, north));
        (s + w) + (e + n)
    }
}

/// Where the rows of the system come from.
pub(super) trait Source<T>: Copy + Sync {
    /// True if the sweep solves each scalar equation and measures nothing, see [`Row::solved`].
    const LEAN: bool;
    /// The most columns of a row that are done in one go, at most [`COLUMNS`].
    const CHUNK: usize;
    /// How many columns the first phase is ahead of the recurrence.
    const WIDTH: usize;
    /// The coefficients of a stretch of a row.
    type Loaded;
    /// The factors of the passed neighbours in one row of a tile.
    type Kept;

    fn loaded(&self) -> Self::Loaded;
    fn kept(&self) -> Self::Kept;

    /// Loads a stretch of row `j`.
    fn load(&self, j: usize, columns: Range<usize>, loaded: &mut Self::Loaded);

    /// Returns the row of the stretch's point `i`.
    fn row<const ACCELERATED: bool>(&self, loaded: &Self::Loaded, i: usize) -> Row<T>;

    /// Keeps what the recurrence needs at point `i`.
    fn keep<const ACCELERATED: bool>(&self, kept: &mut Self::Kept, i: usize, passed: [Pair<T>; 2]);

    /// Returns the factors that were kept.
    fn passed<const BACKWARD: bool>(&self, kept: &Self::Kept, i: usize) -> [Pair<T>; 2];
}

/// The same row everywhere.
#[derive(Debug, Clone, Copy)]
pub(super) struct ConstantRows<T, const LEAN: bool>(Row<T>);

impl<T: Scalar, const LEAN: bool> ConstantRows<T, LEAN> {
    pub(super) fn new<const ACCELERATED: bool>(
        relaxation: [Relaxation<T>; 2],
        a: [T; 5],
        b_omega: [T; 5],
    ) -> Self {
        Self(Row::new::<ACCELERATED>(relaxation, a, b_omega))
    }
}

impl<T: Scalar, const LEAN: bool> Source<T> for ConstantRows<T, LEAN> {
    const LEAN: bool = LEAN;
    const CHUNK: usize = COLUMNS;
    const WIDTH: usize = usize::MAX;
    type Loaded = ();
    type Kept = ();

    #[inline(always)]
    fn loaded(&self) {}

    #[inline(always)]
    fn kept(&self) {}

    #[inline(always)]
    fn load(&self, _: usize, _: Range<usize>, (): &mut ()) {}

    #[inline(always)]
    fn row<const ACCELERATED: bool>(&self, (): &(), _: usize) -> Row<T> {
        self.0
    }

    #[inline(always)]
    fn keep<const ACCELERATED: bool>(&self, (): &mut (), _: usize, _: [Pair<T>; 2]) {}

    #[inline(always)]
    fn passed<const BACKWARD: bool>(&self, (): &(), _: usize) -> [Pair<T>; 2] {
        self.0.passed(BACKWARD)
    }
}

/// Rows of coefficients that vary from point to point, or some of which do.
#[derive(Debug, Clone, Copy)]
pub(super) struct VaryingRows<'a, T, const LEAN: bool> {
    pub(super) grid: Grid,
    pub(super) relaxation: [Relaxation<T>; 2],
    pub(super) a: [Coefficients<'a, T>; 5],
    pub(super) b: [Coefficients<'a, T>; 5],
    pub(super) omega: Coefficients<'a, T>,
    /// Ω west and east of the grid, where other ranks have it go on.
    pub(super) omega_beside: [&'a [T]; 2],
}

/// Columns of varying coefficients that are done in one go: what is kept of them must fit the
/// cache.
const VARYING: usize = 128;
/// A stretch of a row.
type Lane<T> = [T; VARYING + PAD];

/// A stretch of a row: the coefficients, and Ω in the rows south of it, at it and north of it.
pub(super) struct Stretch<T> {
    a: [Lane<T>; 5],
    b: [Lane<T>; 5],
    omega: [Lane<T>; 3],
}

impl<T: Scalar, const LEAN: bool> Source<T> for VaryingRows<'_, T, LEAN> {
    const LEAN: bool = LEAN;
    const CHUNK: usize = VARYING;
    const WIDTH: usize = VARYING;
    type Loaded = Stretch<T>;
    type Kept = [Lane<T>; 4];

    #[inline(always)]
    fn loaded(&self) -> Stretch<T> {
        // The constants are filled in here, once.
        let fill = |c: Coefficients<'_, T>| match c {
            Coefficients::Uniform(c) => [c; VARYING + PAD],
            Coefficients::Each(_) => [T::zero(); VARYING + PAD],
        };
        let omega = match self.omega {
            Coefficients::Uniform(omega) => omega,
            Coefficients::Each(_) => T::zero(),
        };
        Stretch { a: self.a.map(fill), b: self.b.map(fill), omega: [[omega; VARYING + PAD]; 3] }
    }

    #[inline(always)]
    fn kept(&self) -> Self::Kept {
        [[T::zero(); VARYING + PAD]; 4]
    }

    #[inline(always)]
    fn load(&self, j: usize, columns: Range<usize>, loaded: &mut Stretch<T>) {
        let Grid { nx, ny, round: [_, round], .. } = self.grid;
        let stretch = j * nx + columns.start..j * nx + columns.end;
        let pairs = self.a.iter().zip(&mut loaded.a).chain(self.b.iter().zip(&mut loaded.b));
        for (from, to) in pairs {
            if let Coefficients::Each(from) = from {
                to[..stretch.len()].copy_from_slice(&from[stretch.clone()]);
            }
        }
        if let Coefficients::Each(omega) = self.omega {
            // Beyond the grid's edge any number serves, unless it closes.
            for (k, to) in loaded.omega.iter_mut().enumerate() {
                let row = match (j + k, round) {
                    (0, true) => ny - 1,
                    (above, true) if above > ny => 0,
                    (row, _) => row.clamp(1, ny) - 1,
                };
                let row = &omega[row * nx..(row + 1) * nx];
                let (start, end) = (columns.start.max(1) - 1, (columns.end + 1).min(nx));
                let (at, count) = (start + 1 - columns.start, end - start);
                to[at..at + count].copy_from_slice(&row[start..end]);
            }
            let [west, east] = self.grid.ends(omega, self.omega_beside, j, &columns);
            west.into_iter().for_each(|omega| loaded.omega[1][0] = omega);
            east.into_iter().for_each(|omega| loaded.omega[1][stretch.len() + 1] = omega);
        }
    }

    #[inline(always)]
    fn row<const ACCELERATED: bool>(&self, l: &Stretch<T>, i: usize) -> Row<T> {
        let [south, here, north] = &l.omega;
        let a = [l.a[0][i], l.a[1][i], l.a[2][i], l.a[3][i], l.a[4][i]];
        let b = [
            l.b[0][i] * south[i + 1],
            l.b[1][i] * here[i],
            l.b[2][i] * here[i + 1],
            l.b[3][i] * here[i + 2],
            l.b[4][i] * north[i + 1],
        ];
        Row::new::<ACCELERATED>(self.relaxation, a, b)
    }

    #[inline(always)]
    fn keep<const ACCELERATED: bool>(&self, kept: &mut Self::Kept, i: usize, passed: [Pair<T>; 2]) {
        let [[across, across_modulus], [along, along_modulus]] = passed;
        kept[0][i] = across;
        kept[1][i] = along;
        if ACCELERATED {
            kept[2][i] = across_modulus;
            kept[3][i] = along_modulus;
        }
    }

    #[inline(always)]
    fn passed<const BACKWARD: bool>(&self, kept: &Self::Kept, i: usize) -> [Pair<T>; 2] {
        [[kept[0][i], kept[2][i]], [kept[1][i], kept[3][i]]]
    }
}
