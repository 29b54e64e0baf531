//! Large buffers that are reused between calls, because zeroing fresh pages costs more than a running sum.
//!
//! At most [`MAX_SPARES`] buffers are kept between calls. A kept buffer is smaller than twice the size its last user
//! asked for. The system may reclaim its pages at any time, and [`release`] frees all kept buffers at once.

use std::ops::{Deref, DerefMut};
use std::sync::Mutex;

use crate::Result;

/// Sizes in doubles of the buffers that are kept: 1 MiB to 256 MiB. The system may reclaim their pages at any time.
const KEPT_SIZES: std::ops::RangeInclusive<usize> = 1 << 17..=1 << 25;

/// Maximum number of kept buffers: one for a simulated record and one for its phase.
const MAX_SPARES: usize = 2;

static SPARE: Mutex<Vec<Vec<f64>>> = Mutex::new(Vec::new());

/// Frees all kept buffers and returns their total size in bytes.
pub fn release() -> usize {
    let spares = SPARE.lock().map_or_else(|_| Vec::new(), |mut spares| std::mem::take(&mut *spares));
    spares.iter().map(|spare| std::mem::size_of_val(spare.as_slice())).sum()
}

/// Doubles in memory that is reused. They are written when the buffer is made; see [`Buffer::written`].
#[derive(Debug)]
pub struct Buffer {
    all: Vec<f64>,
    len: usize,
}

impl Buffer {
    /// A buffer of `len` doubles that `write` has written, and the result of `write`.
    ///
    /// `write` must write every double before it reads it, because the doubles may be those of the previous user. No
    /// other code can see them. Builds with debug assertions, such as tests, fill them with NaN first.
    pub fn written<T>(len: usize, write: impl FnOnce(&mut [f64]) -> Result<T>) -> Result<(Self, T)> {
        let mut buffer = Self { all: Self::kept(len).unwrap_or_else(|| zeroed(len)), len };
        if cfg!(debug_assertions) {
            buffer.fill(f64::NAN);
        }
        let result = write(&mut buffer)?;
        Ok((buffer, result))
    }

    /// A kept vector of at least `len` and at most twice as many doubles.
    fn kept(len: usize) -> Option<Vec<f64>> {
        if !KEPT_SIZES.contains(&len) {
            return None;
        }
        let mut spares = SPARE.lock().ok()?;
        let place = spares.iter().position(|spare| spare.len() >= len && spare.len() / 2 <= len)?;
        Some(spares.remove(place))
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        let buffer = std::mem::take(&mut self.all);
        if KEPT_SIZES.contains(&buffer.len())
            && let Ok(mut spares) = SPARE.lock()
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
        // SAFETY: the range lies inside the buffer. `Large` changes only the page size. `Free` may turn the doubles
        // into zeros, but no user of a buffer reads a double before it has written it. A refusal costs only speed.
        unsafe { libc::madvise(first as *mut libc::c_void, last - first, advice) };
    }
}

#[cfg(not(all(target_os = "linux", not(miri))))]
fn advise(_: &[f64], _: Advice) {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Error;

    #[test]
    fn a_reused_buffer_shows_nothing_of_its_previous_user() {
        let len = *KEPT_SIZES.start();
        let earlier = Buffer::written(len, |all| {
            all.fill(7.0);
            Ok(())
        });
        drop(earlier);
        let (buffer, read) = Buffer::written(len, |all| {
            let before = all.to_vec();
            all.fill(1.0);
            Ok(before)
        })
        .unwrap();
        assert!(read.iter().all(|x| x.is_nan()) && buffer.iter().all(|x| *x == 1.0));
        assert!(matches!(
            Buffer::written(len, |_| Err::<(), _>(Error::Interrupted)),
            Err(Error::Interrupted)
        ));
    }
}
