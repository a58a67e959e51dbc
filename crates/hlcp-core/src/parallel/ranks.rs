//! Ranks: the processes that share a problem, or threads in their place.

use std::{
    fmt,
    sync::{
        Arc, Mutex,
        mpsc::{Receiver, SyncSender, TrySendError, sync_channel},
    },
    thread,
    time::{Duration, Instant},
};

/// One of several ranks that run the same program, each on its [`Strip`](crate::Strip) of a grid.
///
/// An engine passes numbers between two ranks, in order; everything else is made of that. `f32`
/// travels as `f64`, which holds it exactly. With the feature `mpi` the engine is MPI;
/// [`ranks_as_threads`] is one for tests.
///
/// ```
/// use hlcp_core::ranks_as_threads;
///
/// let received = ranks_as_threads(2, |ranks| {
///     let mut number = [ranks.rank() as f64];
///     match ranks.rank() {
///         0 => ranks.send(1, &[7.0]),
///         _ => ranks.receive(0, &mut number),
///     }
///     number[0]
/// });
/// assert_eq!(received, [0.0, 7.0]);
/// ```
pub trait Ranks: Send + Sync + fmt::Debug {
    /// Returns the number of ranks, at least 1.
    fn size(&self) -> usize;

    /// Returns the number of this one, below [`size`](Self::size).
    fn rank(&self) -> usize;

    /// Sends to another rank; may wait until that receives. Several threads may send and receive at
    /// once, but never two to the same rank or two from the same.
    fn send(&self, to: usize, numbers: &[f64]);

    /// Waits for what another rank sends next, which has as many numbers.
    fn receive(&self, from: usize, numbers: &mut [f64]);
}

/// How long a thread waits for another, before it says that the other does not come.
const PATIENCE: Duration = Duration::from_secs(30);

/// Runs `work` on each of `size` ranks, threads of this process, and returns what they return in
/// the order of the ranks.
///
/// A message waits until it is received, which is the least that an engine may offer.
///
/// # Panics
///
/// For `size` 0, when `work` panics on a rank, and when a rank waits for another for half a minute.
pub fn ranks_as_threads<R: Send>(size: usize, work: impl Fn(Arc<dyn Ranks>) -> R + Sync) -> Vec<R> {
    assert!(size > 0, "at least one rank");
    let mut ranks: Vec<Threads> =
        (0..size).map(|rank| Threads { rank, to: vec![], from: vec![] }).collect();
    for from in 0..size {
        for to in 0..size {
            let (sender, receiver) = sync_channel(0);
            ranks[from].to.push(sender);
            ranks[to].from.push(Mutex::new(receiver));
        }
    }
    thread::scope(|scope| {
        let spawn = |rank| scope.spawn(|| work(Arc::new(rank)));
        let running: Vec<_> = ranks.into_iter().map(spawn).collect();
        running.into_iter().map(|rank| rank.join().expect("a rank that does not panic")).collect()
    })
}

/// A rank that is a thread. One that panics closes its channels, so that nobody waits for it.
#[derive(Debug)]
struct Threads {
    rank: usize,
    to: Vec<SyncSender<Vec<f64>>>,
    from: Vec<Mutex<Receiver<Vec<f64>>>>,
}

impl Ranks for Threads {
    fn size(&self) -> usize {
        self.to.len()
    }

    fn rank(&self) -> usize {
        self.rank
    }

    fn send(&self, to: usize, numbers: &[f64]) {
        let (mut message, begun) = (numbers.to_vec(), Instant::now());
        while let Err(error) = self.to[to].try_send(message) {
            let TrySendError::Full(back) = error else { panic!("rank {to} has gone") };
            assert!(begun.elapsed() < PATIENCE, "rank {to} does not receive from {}", self.rank);
            message = back;
            thread::yield_now();
        }
    }

    fn receive(&self, from: usize, numbers: &mut [f64]) {
        let channel = self.from[from].lock().expect("one receiver at a time");
        match channel.recv_timeout(PATIENCE) {
            Ok(message) => numbers.copy_from_slice(&message),
            Err(error) => panic!("rank {} waits for rank {from}: {error}", self.rank),
        }
    }
}
