//! Hints that a part of a large tree will be visited soon.
//!
//! A tree that does not fit the caches keeps each ray waiting for memory at every step. What a ray
//! puts off is known long before it is visited, so it can be on its way meanwhile. In a tree that
//! fits, the hints only cost.

use super::traverse::lanes;
use super::{Child, Size, WIDTH, WideBvh, WideNode};

/// Trees of more bytes are large: some caches that cores share are not larger.
const LARGE: usize = 24 << 20;

/// Bytes that memory hands over at once.
#[cfg(target_arch = "x86_64")]
const LINE: usize = 64;

impl WideBvh {
    /// Tells whether hints pay. Single queries in small trees must not spend time on the question:
    /// in a large one, no ray is ordinary, and those that are not ask.
    pub(super) fn set_size(&mut self) {
        if self.bytes() > LARGE {
            self.make_large();
        } else if !self.nodes.is_empty() {
            self.size = Size::Usual;
        }
    }

    /// Takes a tree with nodes for a large one.
    pub(crate) fn make_large(&mut self) {
        if !self.nodes.is_empty() {
            self.size = Size::Large;
            self.scene.make_no_ray_ordinary();
        }
    }

    /// The children of a node that are in a set will be visited.
    #[inline(always)]
    pub(super) fn prefetch_those(&self, node: &WideNode, set: u32) {
        lanes(set).for_each(|lane| self.prefetch(node.children[lane % WIDTH]));
    }

    /// What a child refers to will be visited.
    #[inline(always)]
    pub(super) fn prefetch(&self, child: Child) {
        if child.0 < Child::SPHERES {
            prefetch(&self.nodes, child.0 as usize);
        } else {
            // Spheres are as rare as they are small.
            prefetch(&self.triangles, Child::index(child.0));
        }
    }
}

/// The processor fetches an element, or nothing where there is none.
#[inline(always)]
#[cfg(target_arch = "x86_64")]
pub fn prefetch<T>(of: &[T], index: usize) {
    use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};

    let element = of.as_ptr().wrapping_add(index).cast::<i8>();
    for line in 0..size_of::<T>().div_ceil(LINE) {
        // SAFETY: nothing is read, and a hint may have any address.
        #[expect(unsafe_code, reason = "hints take pointers")]
        unsafe {
            _mm_prefetch::<_MM_HINT_T0>(element.wrapping_add(line * LINE));
        }
    }
}

/// Elsewhere, processors find out by themselves.
#[inline(always)]
#[cfg(not(target_arch = "x86_64"))]
pub fn prefetch<T>(_: &[T], _: usize) {}
