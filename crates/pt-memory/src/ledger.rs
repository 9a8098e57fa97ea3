//! Ledger of the process's memory: large allocations are requested in advance.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};

use crate::usage;

/// Allocations of fewer bytes need no request.
pub const SMALL: u64 = 1 << 20;

/// Fraction, as numerator and denominator, of the memory available when the program starts that it
/// may use by default.
const SHARE: [u64; 2] = [9, 10];

/// Limit in bytes; 0 if none is set.
static LIMIT: AtomicU64 = AtomicU64::new(0);
/// Granted bytes that may not be in use yet.
static PENDING: Mutex<u64> = Mutex::new(0);

/// Granted memory. Until it is dropped, it counts in addition to the memory used by the process.
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

/// Limit of the process, in bytes: the one that was set, or nine tenths of the memory available at
/// the first call of this function, plus the memory that the process used then. `None` if neither
/// is known.
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

/// True after a request was denied.
static IS_SHORT: AtomicBool = AtomicBool::new(false);

/// Returns true if a request was denied since the start of the process.
pub fn is_short() -> bool {
    IS_SHORT.load(Ordering::Relaxed)
}

/// Requests memory that is about to be allocated.
///
/// # Errors
/// If the process would exceed its limit; the message gives both numbers.
pub fn ask(bytes: u64) -> Result<Grant, String> {
    if bytes < SMALL {
        return Ok(Grant(0));
    }
    let mut pending = PENDING.lock().unwrap_or_else(PoisonError::into_inner);
    let held = usage::used_bytes().unwrap_or(0).saturating_add(*pending);
    if let Some(limit) = limit().filter(|limit| held.saturating_add(bytes) > *limit) {
        IS_SHORT.store(true, Ordering::Relaxed);
        return Err(format!(
            "it needs {} MB of memory, and {} MB of at most {} MB are in use",
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

    /// The limit is global to the process, so a single test covers everything.
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
