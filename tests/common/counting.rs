//! An allocator that counts: what a piece of work takes, and how much of it at once.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
};

/// The system's allocator, counting this thread's calls and bytes.
pub(crate) struct Counting;

thread_local! {
    /// Calls of this thread.
    pub(crate) static CALLS: Cell<usize> = const { Cell::new(0) };
    /// Bytes this thread holds.
    pub(crate) static LIVE: Cell<isize> = const { Cell::new(0) };
    /// The most bytes it held since this was set.
    pub(crate) static PEAK: Cell<isize> = const { Cell::new(0) };
}

#[allow(unsafe_code, reason = "a global allocator cannot be written without")]
// SAFETY: every call is passed on to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        CALLS.set(CALLS.get() + 1);
        LIVE.set(LIVE.get() + layout.size() as isize);
        PEAK.set(PEAK.get().max(LIVE.get()));
        // SAFETY: the caller's obligations are the system allocator's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // Below zero where a thread frees what another one took.
        LIVE.set(LIVE.get() - layout.size() as isize);
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;
