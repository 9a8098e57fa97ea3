//! Detection of panics that readers convert into errors.

use std::panic::{set_hook, take_hook};
use std::sync::Once;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Number of panics so far, except those of the tests themselves.
static PANICS: AtomicUsize = AtomicUsize::new(0);

/// Runs `work`, in which no reader may panic.
///
/// # Panics
/// If one does.
pub fn without_panics(work: impl FnOnce()) {
    static WATCH: Once = Once::new();
    WATCH.call_once(|| {
        let usual = take_hook();
        set_hook(Box::new(move |info| {
            if !info.location().is_some_and(|at| at.file().contains("/tests/")) {
                PANICS.fetch_add(1, Ordering::Relaxed);
            }
            usual(info);
        }));
    });
    let before = PANICS.load(Ordering::Relaxed);
    work();
    assert_eq!(PANICS.load(Ordering::Relaxed), before, "a reader panics, as is shown above");
}
