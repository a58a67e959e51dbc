//! The loops over rows that are walked: relaxation, and residuals without rounding.

mod colours;
mod exact;
mod relax;
mod walk;

pub(crate) use self::{
    colours::Colours,
    exact::{ExactRows, ExactSum, Question, recovered},
    relax::{Order, Relaxation, Relaxed},
    walk::Visited,
};
