//! Large zeroed buffers on large pages: page faults of small ones cost more than the running sum itself.

/// `len` zeros.
pub fn zeroed(len: usize) -> Vec<f64> {
    let buffer = vec![0.0; len];
    advise(&buffer);
    buffer
}

#[cfg(all(target_os = "linux", not(miri)))]
fn advise(buffer: &[f64]) {
    const PAGE: usize = 2 << 20;
    let bytes = std::mem::size_of_val(buffer);
    let start = buffer.as_ptr() as usize;
    let first = start.next_multiple_of(PAGE);
    let last = (start + bytes) / PAGE * PAGE;
    if last > first {
        // SAFETY: the range lies inside of the buffer; the advice changes how it is backed, not what it holds.
        // A refusal costs only speed.
        unsafe { libc::madvise(first as *mut libc::c_void, last - first, libc::MADV_HUGEPAGE) };
    }
}

#[cfg(not(all(target_os = "linux", not(miri))))]
fn advise(_: &[f64]) {}
