//! Large arrays on large pages, and the ledger of the memory that the process takes.
//!
//! Random rays in a tree of 100 MB visit more pages of 4 KiB than a processor keeps the places of,
//! and a build that fills new memory stops at each of them, as does a reader of large meshes. Where
//! the system has larger pages for those who ask (Linux, 2 MiB), the large arrays that are made
//! here do.

mod ledger;
mod usage;

use bytemuck::Zeroable;

pub use ledger::{Grant, SMALL, ask, limit, set_limit};
pub use usage::{available_bytes, peak_bytes, used_bytes};

/// An empty vector with room for so many.
#[cfg(target_os = "linux")]
pub fn with_capacity<T>(capacity: usize) -> Vec<T> {
    let mut vector = Vec::with_capacity(capacity);
    on_large_pages(vector.spare_capacity_mut());
    vector
}

/// An empty vector with room for so many.
#[cfg(not(target_os = "linux"))]
pub fn with_capacity<T>(capacity: usize) -> Vec<T> {
    Vec::with_capacity(capacity)
}

/// A vector of so many zeros, which is written where it is first used.
pub fn zeros<T: Zeroable>(len: usize) -> Vec<T> {
    #[cfg_attr(not(target_os = "linux"), expect(unused_mut, reason = "only Linux takes advice"))]
    let mut vector = bytemuck::zeroed_vec(len);
    #[cfg(target_os = "linux")]
    on_large_pages(&mut vector);
    vector
}

/// Asks for large pages where this memory is first written. Nothing depends on whether there are
/// any.
#[cfg(target_os = "linux")]
fn on_large_pages<T>(room: &mut [T]) {
    use rustix::mm::{Advice, madvise};
    use rustix::param::page_size;

    /// Arrays of fewer bytes have few pages of any size.
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
    // SAFETY: the pages lie inside of `room`, and this advice changes neither what they hold nor
    // who may use them.
    let _ = unsafe { madvise(bytes.add(before).cast(), whole, Advice::LinuxHugepage) };
}

/// Has the allocator of the process give arrays of 4 MiB and more back to the system as soon as
/// they are freed, where it may be asked to (the GNU C library). Otherwise it comes to keep freed
/// memory of up to 32 MiB in one piece, which other arrays do not fill.
pub fn return_large_arrays() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        #[expect(unsafe_code, reason = "it is a function of the C library")]
        // SAFETY: the call takes numbers alone, and has effect on later allocations only.
        let _ = unsafe { libc::mallopt(libc::M_MMAP_THRESHOLD, 4 << 20) };
    }
}

/// Has the allocator give pages between what is in use back to the system, where it may be asked to
/// (the GNU C library): many small arrays that were freed leave as much as they took.
pub fn trim() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        #[expect(unsafe_code, reason = "it is a function of the C library")]
        // SAFETY: what is in use stays where it is.
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
