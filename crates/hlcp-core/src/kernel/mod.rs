//! One relaxation sweep over a pair of five-point operators, in one pass over memory.
//!
//! A forward sweep of the splitting reads, point by point,
//!
//! ```text
//! mᵢᵢ (yᵢ − xᵢ) = − Fᵢ(x) − Σ_{j passed} mᵢⱼ (yⱼ − xⱼ) ,
//! ```
//!
//! and only `yⱼ` of the western and the southern neighbour are new. So a row is done in two phases,
//!
//! ```text
//! tᵢ = xᵢ − Fᵢ(x)/mᵢᵢ + s(x_S) + w(x_W)     everything that depends on the old x: a vector loop,
//! yᵢ = tᵢ − s(y_S) − w(y_W)                 the recurrence: a chain along the row,
//! ```
//!
//! with `s(v) = mᵢⱼ v/mᵢᵢ`, and for the accelerated method `s(v) = (mᵢⱼ v + (aᵢⱼ − bᵢⱼωⱼ)|v|)/mᵢᵢ`.
//! The first phase meets every `Fᵢ(x)`, which is all that the norms of the input take. The chain is
//! as long as the row and each link waits for the one before; `ROWS` chains therefore run side by
//! side, row `k` one column behind row `k − 1`, whose last value is then the southern neighbour.
//! Nothing is reordered: every `yᵢ` is computed from the same numbers by the same operations as in
//! a loop over the points.
//!
//! The grid is worked through in bands of `ROWS` rows. Several threads claim them in order and
//! form a pipeline: the first phase of a band waits for nothing, and its recurrence enters a
//! stretch of columns when that of the band before has left it, taking over the last row's values.
//! Each band's sums of squares are added in the order of the bands. In red–black order, see
//! `red_black`, bands wait for nothing.
//!
//! Where the grid closes, the point at either end of a row is the other one's neighbour. What the
//! first point of a sweep takes from the last is old, and what the last takes from the first is
//! new: the first phase puts the old values into the place of those beyond the edge and moves both
//! shares to the side of M or N that they belong to, and the recurrence ends a row, and the last
//! row, with the new one.
//!
//! No `mul_add` and no reassociation: the same bits on every processor and for every number of
//! threads.

mod coefficients;
mod exact;
mod grid;
mod red_black;
mod smoother;
mod sweep;
#[cfg(test)]
mod tests;
mod tile;
mod transfer;

pub(crate) use self::sweep::Sweep;
pub use self::{smoother::Smoother, transfer::Transfer};
