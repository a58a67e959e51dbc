//! The loops over rows that are walked: relaxation, residuals, and residuals without rounding.

mod colours;
mod exact;
mod relax;
mod residual;
mod walk;

pub(crate) use self::{
    colours::Colours,
    exact::{ExactRows, ExactSum, Question, recovered},
    relax::{Order, Relaxation, Relaxed},
    residual::RowResidual,
    walk::{Known, Visited},
};
