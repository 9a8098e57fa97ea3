//! The ledger of memory: whoever makes something large asks before it does.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};

use crate::usage;

/// Bytes below which nobody needs to ask.
pub const SMALL: u64 = 1 << 20;

/// Share of the memory that is left when the program starts, of which it takes no more without
/// being told to.
const SHARE: [u64; 2] = [9, 10];

/// The limit in bytes; 0 while there is none.
static LIMIT: AtomicU64 = AtomicU64::new(0);
/// Bytes that were granted and may not be in use yet.
static PENDING: Mutex<u64> = Mutex::new(0);

/// Memory that was granted. Until it is dropped, it counts in addition to what the process holds.
#[derive(Debug)]
#[must_use = "what is granted counts until it is dropped"]
pub struct Grant(u64);

impl Drop for Grant {
    fn drop(&mut self) {
        *PENDING.lock().unwrap_or_else(PoisonError::into_inner) -= self.0;
    }
}

/// Sets the limit of the process, in bytes.
pub fn set_limit(bytes: u64) {
    LIMIT.store(bytes.max(1), Ordering::Relaxed);
}

/// The limit of the process, in bytes: what was set, or nine tenths of what the system had left
/// when this was asked first, and what the process held then. `None` where neither is known.
pub fn limit() -> Option<u64> {
    static DEFAULT: OnceLock<Option<u64>> = OnceLock::new();
    match LIMIT.load(Ordering::Relaxed) {
        0 => *DEFAULT.get_or_init(|| {
            let left = usage::available_bytes()?;
            Some(left / SHARE[1] * SHARE[0] + usage::used_bytes().unwrap_or(0))
        }),
        limit => Some(limit),
    }
}

/// Asks for memory that is about to be taken.
///
/// # Errors
/// If the process would hold more than its limit; the message gives both.
pub fn ask(bytes: u64) -> Result<Grant, String> {
    if bytes < SMALL {
        return Ok(Grant(0));
    }
    let mut pending = PENDING.lock().unwrap_or_else(PoisonError::into_inner);
    let held = usage::used_bytes().unwrap_or(0).saturating_add(*pending);
    if let Some(limit) = limit().filter(|limit| held.saturating_add(bytes) > *limit) {
        return Err(format!(
            "it needs {} MB of memory, and {} MB of at most {} MB are in use; allow more with --max-memory",
            bytes.div_ceil(1_000_000),
            held / 1_000_000,
            limit / 1_000_000
        ));
    }
    *pending += bytes;
    Ok(Grant(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The limit belongs to the process: one test for all of it.
    #[test]
    fn what_is_granted_counts_until_it_is_dropped() {
        let used = usage::used_bytes().unwrap_or(0);
        set_limit(used + (200 << 20));
        let first = ask(120 << 20).expect("there is room");
        let error = ask(120 << 20).expect_err("there is not");
        assert!(error.starts_with("it needs 126 MB of memory, and "), "{error}");
        drop(first);
        drop(ask(120 << 20).expect("there is room again"));
        drop(ask(SMALL - 1).expect("small things are not counted"));
        assert!(ask(u64::MAX).is_err());
    }
}
