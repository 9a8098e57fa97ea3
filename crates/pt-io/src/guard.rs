//! Conversion of panics of decoders, which are bugs of the program or of a library, to errors.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Returns the result of `read`.
///
/// # Errors
/// Returns a message if `read` panics, on this thread or on another one whose result it awaits. The
/// message states that this is no fault of the file's author. `what` is the name of the format,
/// such as "PNG".
pub fn guarded<T>(what: &str, read: impl FnOnce() -> T) -> Result<T, String> {
    // Its state is dropped with the closure.
    catch_unwind(AssertUnwindSafe(read)).map_err(|panic| {
        format!(
            "the reader of {what} fails by an error of its own ({}); please report this to the makers of pathtracer, with \
             the file",
            words(&*panic)
        )
    })
}

/// Returns the message of a panic.
fn words(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("it gives no reason")
}

#[cfg(test)]
mod tests {
    use rayon::prelude::*;

    use super::*;

    #[test]
    fn panics_are_errors_on_whichever_thread_they_are() {
        let own = guarded("PNG", || -> u32 { panic!("the {}th row", 7) });
        assert!(
            own.unwrap_err().contains("of PNG fails by an error of its own (the 7th row); please")
        );
        let of_pool = guarded("OpenEXR", || {
            (0..1000)
                .into_par_iter()
                .map(|i| if i == 700 { panic!("no block") } else { i })
                .sum::<u32>()
        });
        assert!(of_pool.unwrap_err().contains("(no block)"));
        let of_thread = guarded("JPEG", || {
            let worker = std::thread::spawn(|| std::panic::panic_any(3));
            worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        });
        assert!(of_thread.unwrap_err().contains("(it gives no reason)"));
        assert_eq!(guarded("PNG", || 3), Ok(3));
    }
}
