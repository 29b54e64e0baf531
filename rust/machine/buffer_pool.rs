//! Reused huge-page buffers: zeroing fresh pages costs more than the running sum.
//!
//! At most [`SPARES`] are kept between calls, each with less than twice the memory that its last user took; the system may
//! take back what they hold at any time, and [`release`] gives them back at once.

use std::ops::{Deref, DerefMut};
use std::sync::Mutex;

/// Doubles of a buffer that is kept: from 1 MiB to 256 MiB, which the system may take back at any time.
const KEPT: std::ops::RangeInclusive<usize> = 1 << 17..=1 << 25;

/// Buffers kept: a simulated record and its phase.
const SPARES: usize = 2;

static SPARE: Mutex<Vec<Vec<f64>>> = Mutex::new(Vec::new());

/// Gives the buffers that are kept back to the system; returns their bytes.
pub fn release() -> usize {
    let spares = SPARE.lock().map_or_else(|_| Vec::new(), |mut spares| std::mem::take(&mut *spares));
    spares.iter().map(|spare| std::mem::size_of_val(spare.as_slice())).sum()
}

/// Gives what was freed, but is kept by the allocator of each thread for what comes next, back to the system.
pub fn trim() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: touches free memory alone, and may be called at any time from any thread.
    unsafe {
        libc::malloc_trim(0);
    }
}

/// From now on all threads allocate from two arenas: what is free in one of many is lost to the others.
///
/// For programs only, at their beginning: a library leaves the allocator alone.
pub fn few_arenas() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: sets a number of the allocator; a refusal costs only memory.
    unsafe {
        libc::mallopt(libc::M_ARENA_MAX, 2);
    }
}

/// Doubles that hold anything until they are written.
#[derive(Debug, Default)]
pub struct Buffer {
    all: Vec<f64>,
    len: usize,
}

impl Buffer {
    /// Room for `len` doubles.
    pub fn new(len: usize) -> Self {
        if !KEPT.contains(&len) {
            return Self { all: zeroed(len), len };
        }
        let fits = |spare: &Vec<f64>| spare.len() >= len && spare.len() / 2 <= len;
        let found = SPARE.lock().ok().and_then(|mut spares| {
            let place = spares.iter().position(fits)?;
            Some(spares.remove(place))
        });
        Self { all: found.unwrap_or_else(|| zeroed(len)), len }
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        let buffer = std::mem::take(&mut self.all);
        if KEPT.contains(&buffer.len())
            && let Ok(mut spares) = SPARE.lock()
        {
            advise(&buffer, Advice::Free);
            if spares.len() == SPARES {
                // The one that has waited longest.
                spares.remove(0);
            }
            spares.push(buffer);
        }
    }
}

impl Deref for Buffer {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.all[..self.len]
    }
}

impl DerefMut for Buffer {
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.all[..self.len]
    }
}

/// `len` zeros.
pub fn zeroed(len: usize) -> Vec<f64> {
    let buffer = vec![0.0; len];
    advise(&buffer, Advice::Large);
    buffer
}

#[derive(Clone, Copy)]
enum Advice {
    /// Ask for huge pages.
    Large,
    /// The content is not needed.
    Free,
}

#[cfg(all(target_os = "linux", not(miri)))]
fn advise(buffer: &[f64], advice: Advice) {
    const PAGE: usize = 2 << 20;
    let bytes = std::mem::size_of_val(buffer);
    let start = buffer.as_ptr() as usize;
    let first = start.next_multiple_of(PAGE);
    let last = (start + bytes) / PAGE * PAGE;
    if last > first {
        let advice = match advice {
            Advice::Large => libc::MADV_HUGEPAGE,
            Advice::Free => libc::MADV_FREE,
        };
        // SAFETY: the range lies inside of the buffer. The first advice changes how it is backed, the second may turn
        // its doubles, which are written before they are read, into zeros. A refusal costs only speed.
        unsafe { libc::madvise(first as *mut libc::c_void, last - first, advice) };
    }
}

#[cfg(not(all(target_os = "linux", not(miri))))]
fn advise(_: &[f64], _: Advice) {}
