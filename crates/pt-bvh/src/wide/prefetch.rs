//! Prefetching of parts of a large tree that will be visited soon.
//!
//! In a tree that does not fit the caches, each step of a ray waits for memory. Deferred children
//! are known long before they are visited, so they can be fetched in the meantime. In a tree that
//! fits, prefetching is only a cost.

use super::{ChildRef, SizeClass, WIDTH, WideBvh, WideNode, lanes};

/// Trees of more bytes are large: some shared caches are not larger.
const LARGE: usize = 24 << 20;

/// Size of a cache line in bytes.
#[cfg(target_arch = "x86_64")]
const LINE: usize = 64;

impl WideBvh {
    /// Determines if prefetching pays. Single queries in small trees must not spend time on this
    /// decision: in a large tree, no ray is ordinary, and only rays that are not ordinary check it.
    pub(super) fn set_size(&mut self) {
        if self.bytes() > LARGE {
            self.make_large();
        } else if !self.nodes.is_empty() {
            self.size = SizeClass::Usual;
        }
    }

    /// Marks a nonempty tree as large.
    pub(crate) fn make_large(&mut self) {
        if !self.nodes.is_empty() {
            self.size = SizeClass::Large;
            self.scene.make_no_ray_ordinary();
        }
    }

    /// Prefetches the children of a node that are in a set.
    #[inline(always)]
    pub(super) fn prefetch_those(&self, node: &WideNode, set: u32) {
        lanes(set).for_each(|lane| self.prefetch(node.children[lane % WIDTH]));
    }

    /// Prefetches the node or block of a child.
    #[inline(always)]
    pub(super) fn prefetch(&self, child: ChildRef) {
        if child.0 < ChildRef::SPHERES {
            prefetch(&self.nodes, child.0 as usize);
        } else {
            // Blocks of spheres are not prefetched: they are rare and small.
            prefetch(&self.triangles, ChildRef::index(child.0));
        }
    }
}

/// Prefetches an element; an index out of range has no effect.
#[inline(always)]
#[cfg(target_arch = "x86_64")]
pub fn prefetch<T>(of: &[T], index: usize) {
    use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};

    let element = of.as_ptr().wrapping_add(index).cast::<i8>();
    for line in 0..size_of::<T>().div_ceil(LINE) {
        // SAFETY: nothing is read, and a prefetch may have any address.
        #[expect(unsafe_code, reason = "hints take pointers")]
        unsafe {
            _mm_prefetch::<_MM_HINT_T0>(element.wrapping_add(line * LINE));
        }
    }
}

/// No-op on other processors, which rely on their hardware prefetchers.
#[inline(always)]
#[cfg(not(target_arch = "x86_64"))]
pub fn prefetch<T>(_: &[T], _: usize) {}
