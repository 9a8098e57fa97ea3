//! Work that is given up when its time is over, wherever it is.

use std::io;
use std::sync::mpsc;
use std::thread::Builder;
use std::time::Duration;

/// That of the main thread of a program on most systems, for which the nesting of formats is
/// limited.
const STACK_BYTES: usize = 8 << 20;

/// What some work gives, which another thread does; `None` if that takes longer than it may. What
/// is under way then goes on, and what it gives is lost.
///
/// # Errors
/// If no thread can be started.
pub(super) fn within<T: Send + 'static>(
    most: Duration,
    work: impl FnOnce() -> T + Send + 'static,
) -> io::Result<Option<T>> {
    let (give, take) = mpsc::channel();
    let thread = Builder::new().name("reader".to_owned()).stack_size(STACK_BYTES);
    // Nobody may be there any more to take it.
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

    /// As deep as on the main thread.
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
