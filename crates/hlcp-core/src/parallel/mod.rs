//! Work that threads or processes share, with the same bits for any number of them.

#[cfg(feature = "mpi")]
mod mpi;
mod ranks;
mod strip;
pub(crate) mod team;
mod turns;

/// The standard library's, in the place of which a model puts its own.
mod sync {
    pub(super) use std::{
        hint::spin_loop,
        sync::{
            Mutex, MutexGuard,
            atomic::{AtomicBool, AtomicUsize, Ordering},
        },
        thread::{panicking, yield_now},
    };
}

#[cfg(feature = "mpi")]
pub use self::mpi::{NotJoined, World};
pub use self::{
    ranks::{Ranks, ranks_as_threads},
    strip::Strip,
};
pub(crate) use self::{
    strip::Shared,
    team::totals,
    turns::{Breaker, Claims, OrderedSum, Turns},
};
