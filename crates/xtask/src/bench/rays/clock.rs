//! Processor time of a thread.

use std::time::Duration;

/// Processor time of this thread, so that other programs on the machine matter only by their use of
/// its caches.
#[cfg(unix)]
pub(super) fn now() -> Duration {
    use rustix::time::{ClockId, clock_gettime};
    let time = clock_gettime(ClockId::ThreadCPUTime);
    Duration::new(time.tv_sec.unsigned_abs(), time.tv_nsec.unsigned_abs() as u32)
}

/// Wall-clock time since the first call, on systems that do not report processor time.
#[cfg(not(unix))]
pub(super) fn now() -> Duration {
    static START: std::sync::OnceLock<std::time::Instant> = std::sync::OnceLock::new();
    START.get_or_init(std::time::Instant::now).elapsed()
}

#[cfg(test)]
mod tests {
    #[test]
    fn work_takes_time() {
        let before = super::now();
        let sum: u64 = (0..10_000_000u64).map(std::hint::black_box).sum();
        assert!(sum > 0 && super::now() > before);
    }
}
