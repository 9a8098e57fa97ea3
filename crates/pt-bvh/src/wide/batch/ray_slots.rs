//! Assignment of rays to the slots of a group.
//!
//! A few rays of a group take far more rounds than the others. So a group has sections: a section
//! whose rays are done is refilled while those of the others are still active.

use std::ops::Range;

use pt_math::{Ray, Rays};

use super::group::GROUP;

/// Number of rays in a section.
pub(super) const SECTION: usize = 64;

/// Number of sections in a group.
pub(super) const SECTIONS: usize = GROUP / SECTION;
const _: () = assert!(SECTIONS <= 4 && GROUP < 1 << 16);

#[derive(Clone, Copy)]
struct RaySlots<'a> {
    rays: Rays<'a>,
    /// Number of its first ray among all.
    first: usize,
    /// Number of rays in flight.
    active: usize,
}

/// Rays of all sections, and the rays that wait.
pub(super) struct RaySlotChunks<'a> {
    of: [RaySlots<'a>; SECTIONS],
    waiting: Rays<'a>,
    started: usize,
}

impl<'a> RaySlotChunks<'a> {
    /// Starts with all rays waiting.
    pub(super) fn new(rays: Rays<'a>) -> Self {
        let empty = RaySlots { rays: Rays::Rows(&[]), first: 0, active: 0 };
        Self { of: [empty; SECTIONS], waiting: rays, started: 0 }
    }

    /// Ray at a position of the group.
    #[inline(always)]
    pub(super) fn ray(&self, i: usize) -> Ray {
        self.of[i / SECTION % SECTIONS].rays.get(i % SECTION)
    }

    /// Rays of a section.
    pub(super) fn rays(&self, section: usize) -> Rays<'a> {
        self.of[section].rays
    }

    /// Range of the section's rays among all, if none of them is active and there is work to do: to
    /// report them, or to start others.
    pub(super) fn finished(&self, section: usize) -> Option<Range<usize>> {
        let RaySlots { rays, first, active } = self.of[section];
        let is_idle = rays.is_empty() && self.waiting.is_empty();
        (active == 0 && !is_idle).then(|| first..first + rays.len())
    }

    /// Assigns the next rays to a section.
    pub(super) fn refill(&mut self, section: usize) {
        let (rays, rest) = self.waiting.split_at(SECTION.min(self.waiting.len()));
        self.of[section] = RaySlots { rays, first: self.started, active: 0 };
        self.started += rays.len();
        self.waiting = rest;
    }

    /// Sets the number of active rays of a section.
    pub(super) fn set_active(&mut self, section: usize, active: usize) {
        self.of[section].active = active;
    }

    /// Marks the rays at these positions as done.
    pub(super) fn finish(&mut self, places: &[u32]) {
        // Counts per section, in sixteen bits each of one register.
        let of_section = |i: u32| 16 * (i / SECTION as u32 % SECTIONS as u32);
        let counts = places.iter().fold(0u64, |counts, &i| counts + (1 << of_section(i)));
        for (section, k) in self.of.iter_mut().zip(0..) {
            section.active -= (counts >> (16 * k)) as usize & 0xffff;
        }
    }
}
