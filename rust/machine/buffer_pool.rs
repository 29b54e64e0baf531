//! Large buffers that are reused between calls, because zeroing fresh pages costs more than a running sum.
//!
//! At most [`MAX_SPARES`] buffers are kept between calls. A kept buffer is smaller than twice the size its last user
//! asked for. The system may reclaim its pages at any time, and [`release`] frees all kept buffers at once.

use std::mem::take;
use std::ops::{Deref, DerefMut};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::{Error, Result};

/// Sizes in doubles of the buffers that are kept: 1 MiB to 256 MiB. The system may reclaim their pages at any time.
const KEPT_SIZES: std::ops::RangeInclusive<usize> = 1 << 17..=1 << 25;

/// Maximum number of kept buffers: one for a simulated record and one for its phase.
const MAX_SPARES: usize = 2;

/// The kept buffers. Nobody waits for the lock: a forked process may inherit it locked, without the thread that would
/// unlock it.
static SPARE: Mutex<Vec<Vec<f64>>> = Mutex::new(Vec::new());

/// Frees all kept buffers and returns their total size in bytes.
pub(crate) fn release() -> usize {
    let spares = SPARE.try_lock().map_or_else(|_| Vec::new(), |mut spares| take(&mut *spares));
    spares.iter().map(|spare| std::mem::size_of_val(spare.as_slice())).sum()
}

/// Doubles that can be written but not read, because they may be those of the previous user of the memory.
///
/// Every method consumes the value. The methods that write count the doubles, so that a buffer with a forgotten part is
/// an error.
#[derive(Debug)]
#[must_use]
pub struct Unwritten<'a> {
    doubles: &'a mut [f64],
    written: &'a AtomicUsize,
}

impl<'a> From<&'a mut [f64]> for Unwritten<'a> {
    fn from(doubles: &'a mut [f64]) -> Self {
        static UNUSED: AtomicUsize = AtomicUsize::new(0);
        Self { doubles, written: &UNUSED }
    }
}

impl<'a> Unwritten<'a> {
    /// Number of doubles.
    pub(crate) fn len(&self) -> usize {
        self.doubles.len()
    }

    /// The first `middle` doubles, and the others.
    pub(crate) fn split_at(self, middle: usize) -> (Self, Self) {
        let Self { doubles, written } = self;
        let (left, right) = doubles.split_at_mut(middle);
        (Self { doubles: left, written }, Self { doubles: right, written })
    }

    /// Chunks of `size` doubles; the last may be shorter.
    pub(crate) fn chunks(self, size: usize) -> impl ExactSizeIterator<Item = Self> + Send {
        let Self { doubles, written } = self;
        doubles.chunks_mut(size).map(move |doubles| Self { doubles, written })
    }

    /// The doubles, after all have been set to zero. This costs little for a chunk that fits into a cache and is
    /// written next.
    pub(crate) fn zeroed(self) -> &'a mut [f64] {
        let doubles = self.counted();
        doubles.fill(0.0);
        doubles
    }

    /// Copies the values, one for each double.
    pub(crate) fn copy_from(self, values: &[f64]) {
        self.counted().copy_from_slice(values);
    }

    /// The doubles, for code that overwrites all of them. Builds with debug assertions, such as tests, set them to NaN
    /// first.
    ///
    /// # Safety
    /// The caller writes each double before it is read.
    pub(crate) unsafe fn overwritten(self) -> &'a mut [f64] {
        let doubles = self.counted();
        if cfg!(debug_assertions) {
            doubles.fill(f64::NAN);
        }
        doubles
    }

    /// The doubles, counted as written.
    fn counted(self) -> &'a mut [f64] {
        self.written.fetch_add(self.len(), Ordering::Relaxed);
        self.doubles
    }
}

/// Doubles in memory that is reused. They are written when the buffer is made; see [`Buffer::written`].
#[derive(Debug)]
pub struct Buffer {
    all: Vec<f64>,
    len: usize,
}

impl Buffer {
    /// A buffer of `len` doubles that `write` has written, and the result of `write`. Error if `write` fails or forgets
    /// a part.
    pub(crate) fn written<T>(
        len: usize,
        write: impl FnOnce(Unwritten<'_>) -> Result<T>,
    ) -> Result<(Self, T)> {
        let mut buffer = Self { all: Self::kept(len).unwrap_or_else(|| zeroed(len)), len };
        let written = AtomicUsize::new(0);
        let result = write(Unwritten { doubles: &mut buffer, written: &written })?;
        match written.into_inner() {
            count if count == len => Ok((buffer, result)),
            count => Err(Error::Internal(format!("{count} of {len} doubles of a buffer were written"))),
        }
    }

    /// A kept vector of at least `len` and at most twice as many doubles.
    fn kept(len: usize) -> Option<Vec<f64>> {
        if !KEPT_SIZES.contains(&len) {
            return None;
        }
        let mut spares = SPARE.try_lock().ok()?;
        let place = spares.iter().position(|spare| spare.len() >= len && spare.len() / 2 <= len)?;
        Some(spares.remove(place))
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        let buffer = take(&mut self.all);
        if KEPT_SIZES.contains(&buffer.len())
            && let Ok(mut spares) = SPARE.try_lock()
        {
            advise(&buffer, Advice::Free);
            if spares.len() == MAX_SPARES {
                // Free the buffer that has been kept longest.
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

/// A new vector of `len` zeros, backed by huge pages where the system offers them.
pub(crate) fn zeroed(len: usize) -> Vec<f64> {
    let buffer = vec![0.0; len];
    advise(&buffer, Advice::Large);
    buffer
}

/// Advice to the system about the pages of a buffer.
#[derive(Clone, Copy)]
enum Advice {
    /// Back the pages by huge pages.
    Large,
    /// The contents are no longer needed.
    Free,
}

/// Passes advice about the whole pages inside a buffer to the system.
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
        // SAFETY: the range lies inside the buffer. `Large` changes only the page size. `Free` may turn doubles into
        // zeros until they are written; `Unwritten` keeps them from being read before. A refusal costs only speed.
        unsafe { libc::madvise(first as *mut libc::c_void, last - first, advice) };
    }
}

#[cfg(not(all(target_os = "linux", not(miri))))]
fn advise(_: &[f64], _: Advice) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reused_buffer_shows_nothing_of_its_previous_user() {
        let len = *KEPT_SIZES.start();
        let write = |value: f64| {
            Buffer::written(len, |all| {
                all.chunks(16).for_each(|part| part.copy_from(&[value; 16]));
                Ok(())
            })
        };
        drop(write(7.0));
        assert!(write(1.0).unwrap().0.iter().all(|x| *x == 1.0));
        drop(write(7.0));
        let (zeros, ()) = Buffer::written(len, |all| {
            all.zeroed();
            Ok(())
        })
        .unwrap();
        assert!(zeros.len() == len && zeros.iter().all(|x| *x == 0.0));
    }

    #[test]
    fn a_forgotten_part_and_a_failure_give_no_buffer() {
        let len = *KEPT_SIZES.start();
        let forgotten = Buffer::written(len, |all| {
            all.split_at(len / 2).0.zeroed();
            Ok(())
        });
        assert!(matches!(forgotten, Err(Error::Internal(_))));
        assert!(matches!(
            Buffer::written(len, |_| Err::<(), _>(Error::Interrupted)),
            Err(Error::Interrupted)
        ));
    }
}
