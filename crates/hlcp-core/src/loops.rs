//! The loops over grids and over assembled rows, compiled in this crate for both precisions.

use pulp::Arch;

use crate::{
    Aor, Multicolour, Norms, Rhs, Scalar, Smoother, Transfer,
    kernel::{Multiple, Order, Relaxation, Sweep},
    norms::{Meter, Part},
    rounding::{ABOVE_ROUNDING, BOUND, ExactRows, NOT_NEGATIVE, NOT_POSITIVE},
    rows::{Relaxed, RowResidual, RowsOf},
};

/// What depends on the scalar alone, and not on the types of a problem's operators.
///
/// These loops are most of a program's code, since each is compiled for several widths of vector.
/// A generic function is compiled in every crate that calls it. What is called through a static of
/// this crate is compiled once, here. Pairs are of the plain and of the accelerated method.
#[derive(Debug)]
pub struct Loops<T: 'static> {
    pub(crate) sweep: [SweepGrid<T>; 2],
    pub(crate) sweep_rows: [SweepRows<T>; 2],
    pub(crate) sweep_colours: [SweepColours<T>; 2],
    pub(crate) residual: Residual<T>,
    pub(crate) exact: [Exact<T>; 4],
    pub(crate) exact_rows: [fn(&ExactRows<'_, T>, Meter) -> Part; 4],
    pub(crate) row_residual: fn(&RowResidual<'_, T>, Meter) -> Norms,
    pub(crate) smooth: Smooth<T>,
    pub(crate) norms: fn(&Smoother<'_, T>, &Rhs<'_, T>, &[T]) -> Norms,
    pub(crate) subtract: fn(&Smoother<'_, T>, &[T], &mut [T]),
    pub(crate) restrict: Restrict<T>,
    pub(crate) interpolate: fn(&Transfer<T>, Order, &[T], &mut [T], bool),
}

type SweepGrid<T> = fn(&Sweep<'_, T>, [Relaxation<T>; 2], &Rhs<'_, T>, &[T], &mut [T]) -> Norms;

type SweepRows<T> = fn(&Aor<T>, &Relaxed<'_, T>, [RowsOf<'_, T>; 2], Meter, &mut [T]) -> Norms;

/// The last argument is scratch.
type SweepColours<T> =
    fn(&Multicolour<T>, &Relaxed<'_, T>, [RowsOf<'_, T>; 2], Meter, &mut [T], &mut Vec<T>) -> Norms;

type Residual<T> = fn(&Sweep<'_, T>, &Rhs<'_, T>, &[T], &[T], Meter) -> Norms;

type Exact<T> = fn(&Sweep<'_, T>, &Rhs<'_, T>, &[T], Meter) -> Part;

type Smooth<T> = fn(&Sweep<'_, T>, Multiple<'_, T>, &[T], &mut [T]);

type Restrict<T> = fn(&Smoother<'_, T>, Multiple<'_, T>, &[T], &Transfer<T>, &mut [T]);

impl<T: Scalar> Loops<T> {
    const fn new() -> Self {
        Self {
            sweep: [
                |sweep, relaxation, q, x, y| {
                    sweep.run_on::<false>(Arch::new(), relaxation, q, x, y)
                },
                |sweep, relaxation, q, x, y| sweep.run_on::<true>(Arch::new(), relaxation, q, x, y),
            ],
            sweep_rows: [
                |aor, relaxed, [a, b], meter, y| aor.walk::<false>(relaxed, a, b, meter, y),
                |aor, relaxed, [a, b], meter, y| aor.walk::<true>(relaxed, a, b, meter, y),
            ],
            sweep_colours: [
                |colours, relaxed, [a, b], meter, y, scratch| {
                    colours.walk::<false>(relaxed, (a, b), meter, y, scratch)
                },
                |colours, relaxed, [a, b], meter, y, scratch| {
                    colours.walk::<true>(relaxed, (a, b), meter, y, scratch)
                },
            ],
            residual: |sweep, q, z, r, meter| sweep.measure(q, z, r, meter),
            exact: [
                |sweep, q, x, meter| sweep.exact::<BOUND>(q, x, meter),
                |sweep, q, x, meter| sweep.exact::<ABOVE_ROUNDING>(q, x, meter),
                |sweep, q, x, meter| sweep.exact::<NOT_POSITIVE>(q, x, meter),
                |sweep, q, x, meter| sweep.exact::<NOT_NEGATIVE>(q, x, meter),
            ],
            exact_rows: [
                |rows, meter| rows.sum::<BOUND>(meter),
                |rows, meter| rows.sum::<ABOVE_ROUNDING>(meter),
                |rows, meter| rows.sum::<NOT_POSITIVE>(meter),
                |rows, meter| rows.sum::<NOT_NEGATIVE>(meter),
            ],
            row_residual: |residual, meter| residual.measure(meter),
            smooth: |sweep, f, x, y| sweep.smooth_on(Arch::new(), f, x, y),
            norms: |smoother, q, x| smoother.measure(q, x),
            subtract: |smoother, x, f| smoother.subtract_all(x, f),
            restrict: |smoother, f, x, transfer, coarse| {
                smoother.restrict_all(f, x, transfer, coarse)
            },
            interpolate: Transfer::run,
        }
    }
}

/// The loops in single precision.
pub(crate) static F32: Loops<f32> = Loops::new();

/// The loops in double precision.
pub(crate) static F64: Loops<f64> = Loops::new();
