//! Work that threads or processes share, with the same bits for any number of them.

#[cfg(feature = "mpi")]
mod mpi;
mod ranks;
mod strip;
pub(crate) mod team;

#[cfg(feature = "mpi")]
pub use self::mpi::{NotJoined, World};
pub use self::{
    ranks::{Ranks, ranks_as_threads},
    strip::Strip,
};
pub(crate) use self::{
    strip::Shared,
    team::{Breaker, Claims, OrderedSum, Turns, totals},
};
