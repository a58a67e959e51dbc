//! Portions that threads claim in order, and values that they hand on in order.
//!
//! Nothing here depends on how many threads there are. One thread claims every portion in order and
//! finds every value already its own; several threads see the same values in the same order. A
//! thread waits only for what comes before the portion it has claimed, and that has been claimed by
//! a thread that is running: no number of threads can wait for itself, not even more than there are
//! processors. Where a thread panics, those that wait for it do too.
//! `tests/model` tries every interleaving of what this file does.

use super::sync::{
    AtomicBool, AtomicUsize, Mutex, MutexGuard, Ordering, panicking, spin_loop, yield_now,
};
use crate::numbers::{Part, Totals};

/// How often a thread looks for its turn before it lets others run.
const LOOKS: usize = 200;

/// Portions of work, claimed in order.
pub(crate) struct Claims<I>(Mutex<I>);

impl<I: Iterator> Claims<I> {
    pub(crate) fn new(portions: I) -> Self {
        Self(Mutex::new(portions))
    }

    /// Returns the next portion that nobody has claimed.
    pub(crate) fn next(&self) -> Option<I::Item> {
        self.0.lock().expect("no claim panics").next()
    }
}

/// A value that portions 0, 1, … of the work have in turn.
pub(crate) struct Turns<V> {
    next: AtomicUsize,
    broken: AtomicBool,
    value: Mutex<V>,
}

impl<V> Turns<V> {
    pub(crate) fn new(value: V) -> Self {
        Self { next: AtomicUsize::new(0), broken: AtomicBool::new(false), value: Mutex::new(value) }
    }

    /// Returns the value, once the portions before `number` have passed it on.
    ///
    /// # Panics
    ///
    /// When another thread has panicked.
    pub(crate) fn wait(&self, number: usize) -> Turn<'_, V> {
        let mut looks = 0;
        while self.next.load(Ordering::Acquire) != number {
            assert!(!self.broken.load(Ordering::Relaxed), "another thread has panicked");
            if looks < LOOKS {
                looks += 1;
                spin_loop();
            } else {
                yield_now();
            }
        }
        Turn { turns: self, number, value: self.value.lock().expect("a turn that was passed on") }
    }
}

/// Breaks turns when the thread that holds it panics: nobody shall wait for what it had claimed.
pub(crate) struct Breaker<'a, V>(pub(crate) &'a [Turns<V>]);

impl<V> Drop for Breaker<'_, V> {
    fn drop(&mut self) {
        if panicking() {
            self.0.iter().for_each(|turns| turns.broken.store(true, Ordering::Relaxed));
        }
    }
}

/// The turn of one portion.
pub(crate) struct Turn<'a, V> {
    turns: &'a Turns<V>,
    number: usize,
    pub(crate) value: MutexGuard<'a, V>,
}

impl<V> Turn<'_, V> {
    /// Passes the value on to the next portion.
    pub(crate) fn pass(self) {
        // Unlocked first, so that whose turn it is next finds it so.
        drop(self.value);
        self.turns.next.store(self.number + 1, Ordering::Release);
    }
}

/// Sums by stretches over all portions of the work, in their order; a thread that comes early
/// leaves its parts and goes on.
pub(crate) struct OrderedSum(Mutex<Parts>);

struct Parts {
    next: usize,
    totals: Totals,
    early: Vec<(usize, Vec<(usize, Part)>)>,
}

impl OrderedSum {
    pub(crate) fn new() -> Self {
        Self(Mutex::new(Parts { next: 0, totals: Totals::zero(), early: Vec::new() }))
    }

    /// Adds what portion `number` has summed, by stretches.
    pub(crate) fn add(&self, number: usize, parts: impl Iterator<Item = (usize, Part)>) {
        let Parts { next, totals, early } = &mut *self.0.lock().expect("no addition panics");
        if number != *next {
            early.push((number, parts.collect()));
            return;
        }
        parts.for_each(|(stretch, part)| totals.add(stretch, part));
        *next += 1;
        while let Some(at) = early.iter().position(|(number, _)| number == next) {
            let (_, parts) = early.swap_remove(at);
            parts.into_iter().for_each(|(stretch, part)| totals.add(stretch, part));
            *next += 1;
        }
    }

    /// Returns the whole sums.
    pub(crate) fn total(self) -> Totals {
        self.0.into_inner().expect("no addition panics").totals
    }
}
