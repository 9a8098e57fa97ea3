//! Large arrays on huge pages, and a ledger of the process's memory.
//!
//! Random rays in a tree of 100 MB visit more pages of 4 KiB than the TLB of a processor covers. A
//! build that fills new memory faults at each page, as does a reader of large meshes. If the system
//! supports huge pages by request (Linux, 2 MiB), the large arrays created here use them.

mod ledger;
mod usage;

use bytemuck::Zeroable;
pub use ledger::{Grant, SMALL, ask, is_short, limit, set_limit};
pub use usage::{available_bytes, peak_bytes, used_bytes};

/// Creates an empty vector with the given capacity.
#[cfg(target_os = "linux")]
pub fn with_capacity<T>(capacity: usize) -> Vec<T> {
    let mut vector = Vec::with_capacity(capacity);
    on_large_pages(vector.spare_capacity_mut());
    vector
}

/// Creates an empty vector with the given capacity.
#[cfg(not(target_os = "linux"))]
pub fn with_capacity<T>(capacity: usize) -> Vec<T> {
    Vec::with_capacity(capacity)
}

/// Creates a vector of `len` zeros, whose memory is first touched on use.
pub fn zeros<T: Zeroable>(len: usize) -> Vec<T> {
    #[cfg_attr(not(target_os = "linux"), expect(unused_mut, reason = "only Linux takes advice"))]
    let mut vector = bytemuck::zeroed_vec(len);
    #[cfg(target_os = "linux")]
    on_large_pages(&mut vector);
    vector
}

/// Requests huge pages for memory that has not been written yet. Failure has no effect.
#[cfg(target_os = "linux")]
fn on_large_pages<T>(room: &mut [T]) {
    use rustix::mm::{Advice, madvise};
    use rustix::param::page_size;

    /// Below this number of bytes, arrays have few pages of any size.
    const MIN: usize = 4 << 20;

    if size_of_val(room) < MIN {
        return;
    }
    // Advice is for whole pages: those inside.
    let page = page_size();
    let bytes = room.as_mut_ptr().cast::<u8>();
    let before = bytes.addr().next_multiple_of(page) - bytes.addr();
    let whole = (size_of_val(room) - before) / page * page;
    #[expect(unsafe_code, reason = "advice takes a pointer")]
    // SAFETY: the pages lie inside of `room`, and this advice changes neither their contents nor
    // their access rights.
    let _ = unsafe { madvise(bytes.add(before).cast(), whole, Advice::LinuxHugepage) };
}

/// Makes the allocator return arrays of 4 MiB and more to the system as soon as they are freed, if
/// supported (GNU C library). Otherwise it would eventually keep freed blocks of up to 32 MiB,
/// which other arrays do not fill.
pub fn return_large_arrays() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        #[expect(unsafe_code, reason = "it is a function of the C library")]
        // SAFETY: the call takes only numbers, and affects only later allocations.
        let _ = unsafe { libc::mallopt(libc::M_MMAP_THRESHOLD, 4 << 20) };
    }
}

/// Makes the allocator return free pages between allocations to the system, if supported (GNU C
/// library): many small arrays that were freed occupy as much as before.
pub fn trim() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        #[expect(unsafe_code, reason = "it is a function of the C library")]
        // SAFETY: allocations in use are not moved.
        let _ = unsafe { libc::malloc_trim(0) };
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn vectors_of_any_size_hold_what_is_put_into_them() {
        for len in [0, 1, 1000, 3_000_001] {
            let mut numbers = super::with_capacity(len);
            assert!(numbers.is_empty() && numbers.capacity() >= len);
            numbers.extend(0..len as u32);
            assert!(numbers.iter().copied().eq(0..len as u32));
        }
    }
}
