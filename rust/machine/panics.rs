//! Panics as errors with their messages and source locations.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;

use crate::parallel::locked;
use crate::{Error, Result};

/// Messages with source locations of the latest panics. A panic can start on a thread of the pool and be caught on
/// another thread, and two calls can panic at once. So a caught panic is found here by its text.
static LATEST: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// Length of `LATEST`: far more calls than panic at once.
const MAX_KEPT: usize = 64;

/// From now on, stores the message of each panic instead of printing it.
pub(crate) fn keep() {
    std::panic::set_hook(Box::new(|panic| store(panic.to_string())));
}

/// Result of `work`; a panic in it becomes [`Error::Internal`].
pub(crate) fn guarded<T>(work: impl FnOnce() -> Result<T>) -> Result<T> {
    // Data that a panic leaves incomplete are not used, because the error is a bug to report.
    catch_unwind(AssertUnwindSafe(work))
        .unwrap_or_else(|payload| Err(Error::Internal(taken(text(&*payload)))))
}

fn store(message: String) {
    let mut latest = locked(&LATEST);
    if latest.len() == MAX_KEPT {
        latest.remove(0);
    }
    latest.push(message);
}

/// Text of a panic without its source location.
fn text(payload: &(dyn Any + Send)) -> &str {
    let formatted = payload.downcast_ref::<String>().map(String::as_str);
    formatted.or_else(|| payload.downcast_ref::<&str>().copied()).unwrap_or("panic without a message")
}

/// Stored message that ends with this text, which is then no longer stored; `text` if none does.
fn taken(text: &str) -> String {
    let mut latest = locked(&LATEST);
    let place = latest.iter().rposition(|message| message.ends_with(text));
    place.map_or_else(|| text.to_string(), |place| latest.remove(place))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_caught_panic_gets_its_own_message_and_few_messages_are_kept() {
        let caught = guarded::<()>(|| {
            store("panicked at first.rs:1:1:\n1 of this test".into());
            store("panicked at second.rs:2:2:\n2 of this test".into());
            panic!("{} of this test", 1)
        });
        assert_eq!(caught, Err(Error::Internal("panicked at first.rs:1:1:\n1 of this test".into())));
        let caught = guarded::<()>(|| std::panic::panic_any("2 of this test"));
        assert_eq!(caught, Err(Error::Internal("panicked at second.rs:2:2:\n2 of this test".into())));
        let caught = guarded::<()>(|| panic!("2 of this test"));
        assert_eq!(caught, Err(Error::Internal("2 of this test".into())));
        for number in 0..=2 * MAX_KEPT {
            store(format!("kept {number}"));
        }
        assert_eq!(locked(&LATEST).len(), MAX_KEPT);
    }
}
