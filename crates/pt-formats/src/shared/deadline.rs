//! Abandoning of work that exceeds its time.

use std::io;
use std::sync::mpsc;
use std::thread::Builder;
use std::time::Duration;

/// Stack size of the main thread of a program on most systems, to which the nesting limits of
/// formats are adapted.
const STACK_BYTES: usize = 8 << 20;

/// Returns the result of `work`, which another thread executes, or `None` if it takes longer than
/// `most`. In that case the thread continues, and its result is lost.
///
/// # Errors
/// Returns an error if no thread can be started.
pub(crate) fn within<T: Send + 'static>(
    most: Duration,
    work: impl FnOnce() -> T + Send + 'static,
) -> io::Result<Option<T>> {
    let (give, take) = mpsc::channel();
    let thread = Builder::new().name("reader".to_owned()).stack_size(STACK_BYTES);
    // The receiver may have been dropped.
    thread.spawn(move || drop(give.send(work())))?;
    Ok(take.recv_timeout(most).ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_that_does_not_end_is_given_up() {
        let (end, ends) = mpsc::channel::<()>();
        let given_up = within(Duration::from_millis(20), move || ends.recv().is_err());
        assert_eq!(given_up.expect("a thread"), None);
        drop(end);
        assert_eq!(within(Duration::from_mins(10), || 7).expect("a thread"), Some(7));
    }

    /// The recursion depth equals that of the main thread.
    #[test]
    fn work_has_the_stack_of_a_program() {
        fn deep(levels: usize) -> usize {
            let frame = std::hint::black_box([levels; 128]);
            if levels == 0 { frame[0] } else { deep(levels - 1) + frame[127] / levels }
        }
        let given = within(Duration::from_mins(10), || deep(4000));
        assert_eq!(given.expect("a thread"), Some(4000));
    }
}
