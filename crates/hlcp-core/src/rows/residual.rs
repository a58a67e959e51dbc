use std::iter;

use crate::{
    numbers::{BLOCK, Compiled, Meter, Norms, Scalar, Tally},
    operators::{RowsOf, Source},
    parallel::{Claims, OrderedSum, team},
};

/// Rows whose residual one thread computes in one go.
const PORTION: usize = 1024;

/// The residual `A z − B r ± q` of operators whose rows are known.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RowResidual<'a, T> {
    pub(crate) rows: [RowsOf<'a, T>; 2],
    pub(crate) sign: T,
    pub(crate) q: &'a [T],
    pub(crate) z: &'a [T],
    pub(crate) r: &'a [T],
    pub(crate) parallel: bool,
}

impl<T: Scalar> RowResidual<'_, T> {
    /// Returns its norms, in one pass.
    pub(crate) fn norms(&self, meter: Meter) -> Norms {
        MEASURE.of::<Measure<T>>()(self, meter)
    }

    fn measure(&self, meter: Meter) -> Norms {
        let Self { rows: [a, b], sign, q, z, r, parallel } = *self;
        let portions = Claims::new(q.chunks(PORTION).enumerate());
        let sum = OrderedSum::new();
        team::spread(team::threads(parallel, z.len()), &|| {
            let (mut a, mut b, mut residual) = (a, b, [T::zero(); PORTION]);
            while let Some((number, q)) = portions.next() {
                let residual = &mut residual[..q.len()];
                for ((i, &q), residual) in (number * PORTION..).zip(q).zip(&mut *residual) {
                    let az = a.fold(i, T::zero(), |sum, j, a| sum + a * z[j]);
                    let br = b.fold(i, T::zero(), |sum, j, b| sum + b * r[j]);
                    *residual = az - br + sign * q;
                }
                let mut tally = Tally::zero();
                residual.chunks(BLOCK).for_each(|block| tally.add(meter, block));
                sum.add(number, iter::once((0, tally.part())));
            }
        });
        meter.norms_of(sum.total().sum(None), T::one())
    }
}

type Measure<T> = fn(&RowResidual<'_, T>, Meter) -> Norms;

static MEASURE: Compiled<Measure<f32>, Measure<f64>> =
    Compiled(|residual, meter| residual.measure(meter), |residual, meter| residual.measure(meter));
