use std::{
    fmt, panic, process,
    sync::{Arc, Once},
};

use mpi::{
    Threading,
    environment::Universe,
    topology::{Communicator, SimpleCommunicator},
    traits::{Destination, Source},
};

use super::Ranks;

/// All processes that `mpirun` has started, as ranks; one, where it has not.
///
/// Dropped, it leaves MPI, which waits for the other ranks. A panic ends all ranks at once.
///
/// ```
/// use hlcp_core::World;
///
/// let world = World::join()?;
/// assert!(world.ranks().rank() < world.ranks().size());
/// assert!(World::join().is_err()); // once in a process
/// # Ok::<(), hlcp_core::NotJoined>(())
/// ```
pub struct World {
    _universe: Universe,
    ranks: Arc<Processes>,
}

/// The reason why a process cannot join the others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NotJoined {
    /// MPI is in use in this process, or was.
    #[error("this process has joined MPI before, which it can once only")]
    Again,
    /// The installed MPI lets one thread of a process call it.
    #[error("the installed MPI does not let several threads of a process send and receive")]
    Threads,
}

impl World {
    /// Joins the other processes, once in the life of this one.
    ///
    /// # Errors
    ///
    /// [`NotJoined`].
    pub fn join() -> Result<Self, NotJoined> {
        let (universe, threading) =
            mpi::initialize_with_threading(Threading::Multiple).ok_or(NotJoined::Again)?;
        if threading < Threading::Multiple {
            return Err(NotJoined::Threads);
        }
        let world = universe.world();
        let ranks = Processes { size: world.size() as usize, rank: world.rank() as usize };
        if ranks.size > 1 {
            end_all_on_panic();
        }
        Ok(Self { _universe: universe, ranks: Arc::new(ranks) })
    }

    /// Returns the ranks.
    pub fn ranks(&self) -> Arc<dyn Ranks> {
        self.ranks.clone()
    }

    /// Ends all ranks with an exit status, whatever they are doing.
    ///
    /// ```no_run
    /// let world = hlcp_core::World::join()?;
    /// world.end_all(1);
    /// # Ok::<(), hlcp_core::NotJoined>(())
    /// ```
    pub fn end_all(&self, status: u8) -> ! {
        SimpleCommunicator::world().abort(status.into())
    }
}

impl fmt::Debug for World {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("World").field("ranks", &self.ranks).finish_non_exhaustive()
    }
}

/// Makes a panic end all ranks: unwinding would leave MPI, and wait for ranks that wait for this.
fn end_all_on_panic() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let say = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            say(info);
            process::abort();
        }));
    });
}

/// The ranks of the world. A communicator is no value that threads may share, but asking for it
/// costs nothing.
#[derive(Debug)]
struct Processes {
    size: usize,
    rank: usize,
}

impl Ranks for Processes {
    fn size(&self) -> usize {
        self.size
    }

    fn rank(&self) -> usize {
        self.rank
    }

    fn send(&self, to: usize, numbers: &[f64]) {
        SimpleCommunicator::world().process_at_rank(to as i32).send(numbers);
    }

    fn receive(&self, from: usize, numbers: &mut [f64]) {
        SimpleCommunicator::world().process_at_rank(from as i32).receive_into(numbers);
    }
}
