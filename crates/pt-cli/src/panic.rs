//! Internal errors, which are panics: one message, and an exit status of their own.

use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind, set_hook, take_hook};
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};

/// Exit status of an internal error.
const FAULT: u8 = 101;

/// Message and location of the latest panic.
static LATEST: Mutex<String> = Mutex::new(String::new());

/// Silences the panic hook, so that a panic that becomes an error has one message; with
/// `RUST_BACKTRACE`, each panic is also printed as usual.
pub(crate) fn silence() {
    let usual = take_hook();
    let is_shown = std::env::var_os("RUST_BACKTRACE").is_some_and(|value| value != "0");
    set_hook(Box::new(move |info| {
        *LATEST.lock().unwrap_or_else(PoisonError::into_inner) = described(info);
        if is_shown {
            usual(info);
        }
    }));
}

/// Runs the program. A panic, on this thread or on a thread that it joins, is reported as an
/// internal error.
pub(crate) fn guarded(run: impl FnOnce() -> ExitCode) -> ExitCode {
    // State that the panic left inconsistent is not used afterwards.
    catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|_| {
        let latest = LATEST.lock().unwrap_or_else(PoisonError::into_inner).clone();
        report!("error: {}", message(&latest));
        ExitCode::from(FAULT)
    })
}

fn described(info: &PanicHookInfo<'_>) -> String {
    let place = info.location().map(ToString::to_string).unwrap_or_default();
    format!("{} at {place}", info.payload_as_str().unwrap_or("no reason given"))
}

fn message(latest: &str) -> String {
    format!(
        "internal error: {latest}; please report it with the command line and the scene. Renders with \
         a film can be continued with \"pathtracer resume\""
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panics_are_an_exit_status() {
        let of_thread = guarded(|| {
            let worker = std::thread::spawn(|| panic!("a fault for a test"));
            worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        });
        assert_eq!(of_thread, ExitCode::from(FAULT));
        assert_eq!(guarded(|| ExitCode::from(3)), ExitCode::from(3));
        assert!(message("x at a.rs:3:1").contains("error: x at a.rs:3:1; please report it"));
    }
}
