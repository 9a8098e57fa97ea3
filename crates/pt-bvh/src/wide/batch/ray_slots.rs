//! The rays that are in a group.
//!
//! A few rays of a group take far more rounds than the others. So a group has sections: one whose
//! rays are done takes the next rays, while those of the others are on their way.

use std::ops::Range;

use pt_math::{Ray, Rays};

use super::group::GROUP;

/// Rays that are taken together.
pub(super) const SECTION: usize = 64;

/// Sections of a group.
pub(super) const SECTIONS: usize = GROUP / SECTION;
const _: () = assert!(SECTIONS <= 4 && GROUP < 1 << 16);

#[derive(Clone, Copy)]
struct RaySlots<'a> {
    rays: Rays<'a>,
    /// Number of its first ray among all.
    first: usize,
    /// Number in flight.
    active: usize,
}

/// The rays of all sections, and those that wait.
pub(super) struct RaySlotChunks<'a> {
    of: [RaySlots<'a>; SECTIONS],
    waiting: Rays<'a>,
    started: usize,
}

impl<'a> RaySlotChunks<'a> {
    /// All rays wait.
    pub(super) fn new(rays: Rays<'a>) -> Self {
        let empty = RaySlots { rays: Rays::Rows(&[]), first: 0, active: 0 };
        Self { of: [empty; SECTIONS], waiting: rays, started: 0 }
    }

    /// The ray at a place of the group.
    #[inline(always)]
    pub(super) fn ray(&self, i: usize) -> Ray {
        self.of[i / SECTION % SECTIONS].rays.get(i % SECTION)
    }

    /// The rays of a section.
    pub(super) fn rays(&self, section: usize) -> Rays<'a> {
        self.of[section].rays
    }

    /// Which of all rays the section has, if none of them is on its way and there is something to
    /// do: to report them, or to start others.
    pub(super) fn finished(&self, section: usize) -> Option<Range<usize>> {
        let RaySlots { rays, first, active } = self.of[section];
        let is_idle = rays.is_empty() && self.waiting.is_empty();
        (active == 0 && !is_idle).then(|| first..first + rays.len())
    }

    /// Gives a section the next rays.
    pub(super) fn refill(&mut self, section: usize) {
        let (rays, rest) = self.waiting.split_at(SECTION.min(self.waiting.len()));
        self.of[section] = RaySlots { rays, first: self.started, active: 0 };
        self.started += rays.len();
        self.waiting = rest;
    }

    /// So many of a section's rays are on their way.
    pub(super) fn set_active(&mut self, section: usize, active: usize) {
        self.of[section].active = active;
    }

    /// The rays at these places are done.
    pub(super) fn finish(&mut self, places: &[u32]) {
        // So many of each section, in sixteen bits each: a number that stays in a register.
        let of_section = |i: u32| 16 * (i / SECTION as u32 % SECTIONS as u32);
        let counts = places.iter().fold(0u64, |counts, &i| counts + (1 << of_section(i)));
        for (section, k) in self.of.iter_mut().zip(0..) {
            section.active -= (counts >> (16 * k)) as usize & 0xffff;
        }
    }
}
