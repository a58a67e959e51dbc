//! Every interleaving of threads that share a sweep, up to a number of preemptions: each portion is
//! claimed once, values are handed on in order, sums are the same, and nobody waits for ever.
//!
//! ```text
//! cargo run --manifest-path tests/model/Cargo.toml
//! ```
//!
//! Prints how many interleavings there were. The file under test is that of `hlcp-core`, with the
//! locks and atomic numbers of a model of memory in the place of the standard library's.

#[path = "../../../crates/hlcp-core/src/parallel/turns.rs"]
mod turns;

use std::{
    iter::once,
    panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook},
    sync::{
        Arc as Shared,
        atomic::{AtomicUsize as Count, Ordering::Relaxed},
    },
};

use loom::{model::Builder, sync::Arc, thread};
use turns::{Breaker, Claims, OrderedSum, Turns};

/// What `turns.rs` imports.
mod sync {
    pub(crate) use loom::{
        hint::spin_loop,
        sync::{
            Mutex, MutexGuard,
            atomic::{AtomicBool, AtomicUsize, Ordering},
        },
        thread::yield_now,
    };

    loom::thread_local! {
        /// Whether the thread panics, or seems to: unwinding is not modelled.
        pub(crate) static PANICS: std::cell::Cell<bool> = std::cell::Cell::new(false);
    }

    pub(crate) fn panicking() -> bool {
        PANICS.with(std::cell::Cell::get)
    }
}

/// Numbers whose sum depends on the order.
mod numbers {
    pub(crate) type Part = f64;

    pub(crate) struct Totals(pub(crate) f64);

    impl Totals {
        pub(crate) fn zero() -> Self {
            Self(0.0)
        }

        pub(crate) fn add(&mut self, _: usize, part: Part) {
            self.0 += part;
        }
    }
}

const PARTS: [f64; 4] = [1e16, 1.0, -1e16, 3.0];

/// Tries the interleavings with at most so many preemptions, and returns how many there were.
fn interleavings(preemptions: Option<usize>, run: impl Fn() + Send + Sync + 'static) -> usize {
    let count = Shared::new(Count::new(0));
    let counted = Shared::clone(&count);
    let mut builder = Builder::new();
    builder.preemption_bound = preemptions;
    builder.max_branches = 100_000;
    builder.check(move || {
        counted.fetch_add(1, Relaxed);
        run();
    });
    count.load(Relaxed)
}

/// Runs `work` on so many threads, this one among them.
fn spread(threads: usize, work: impl Fn() + Clone + Send + 'static) {
    let others: Vec<_> = (1..threads).map(|_| thread::spawn(work.clone())).collect();
    work();
    others.into_iter().for_each(|thread| thread.join().expect("no thread panics"));
}

/// A sweep: portions in the order of a pipeline over so many stretches, each with its edge.
fn sweep(threads: usize, portions: usize, stretches: usize) {
    let edges: Vec<_> = (0..stretches).map(|_| Turns::new(vec![])).collect();
    let shared = Arc::new((Claims::new(0..portions), edges, OrderedSum::new()));
    let of_thread = Arc::clone(&shared);
    spread(threads, move || {
        let (claims, edges, sum) = &*of_thread;
        let _breaker = Breaker(edges);
        while let Some(number) = claims.next() {
            for edge in edges {
                let mut turn = edge.wait(number);
                turn.value.push(number);
                turn.pass();
            }
            sum.add(number, once((0, PARTS[number])));
        }
    });
    let Ok((_, edges, sum)) = Arc::try_unwrap(shared) else { panic!("all threads have ended") };
    for edge in edges {
        assert_eq!(*edge.wait(portions).value, (0..portions).collect::<Vec<_>>());
    }
    let in_order = PARTS[..portions].iter().fold(0.0, |sum, part| sum + part);
    assert_eq!(sum.total().0, in_order);
}

/// The thread with the first portion panics: the other one does too, or has nothing to do.
fn broken_sweep() {
    let shared = Arc::new((Claims::new(0..2), [Turns::new(())]));
    let of_thread = Arc::clone(&shared);
    spread(2, move || {
        let (claims, edges) = &*of_thread;
        let breaker = Breaker(edges);
        match claims.next() {
            Some(0) => {
                sync::PANICS.with(|panics| panics.set(true));
                drop(breaker);
                sync::PANICS.with(|panics| panics.set(false));
            }
            Some(number) => {
                let waited = catch_unwind(AssertUnwindSafe(|| edges[0].wait(number).pass()));
                assert!(waited.is_err(), "a turn that nobody has passed on");
            }
            None => {}
        }
    });
}

fn main() {
    for (threads, portions, stretches, preemptions) in [
        (2, 3, 1, None),
        (2, 4, 0, None),
        (2, 3, 2, Some(4)),
        (3, 3, 0, Some(3)),
        (3, 3, 1, Some(1)),
    ] {
        let count = interleavings(preemptions, move || sweep(threads, portions, stretches));
        assert!(count > 1, "threads that never meet");
        let bound = preemptions.map_or("any number of".into(), |most| format!("at most {most}"));
        println!(
            "{threads} threads, {portions} portions, {stretches} stretches, {bound} preemptions: {count} interleavings"
        );
    }
    let hook = take_hook();
    set_hook(Box::new(|_| ()));
    let broken = catch_unwind(|| interleavings(None, broken_sweep));
    set_hook(hook);
    let count = broken.expect("the other one panics too");
    assert!(count > 1, "threads that never meet");
    println!("a thread that panics: {count} interleavings");
}
