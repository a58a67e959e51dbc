//! Oracles, planted instances and scenes with known answers for horizontal linear complementarity
//! problems: find `z, r ≥ 0` with `zᵀ r = 0` and `A z − B r + q = 0`.
//!
//! * [`oracle`]: the paper's methods, dense and from its formulas, and all solutions of a small problem.
//! * [`Planted`]: a problem built around a solution.
//! * [`Example`]: the paper's Examples 1 and 2, and [`Slider`]: its Example 3, matrix-free.
//!
//! Nothing here depends on `hlcp-methods`: what judges is independent of what is judged.

mod disc;
pub mod oracle;
mod planted;
mod scene;
mod slider;

pub use disc::Disc;
pub use planted::Planted;
pub use scene::{Example, Posed};
pub use slider::Slider;
