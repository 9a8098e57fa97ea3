//! Notes about materials, each kind once.

use std::collections::HashSet;

use crate::{Span, Warning};

/// Most notes that are kept.
const MAX: usize = 100;

/// Notes about reading materials.
#[derive(Default)]
pub(super) struct Notes {
    kept: Vec<Warning>,
    known: HashSet<String>,
    left_out: usize,
}

impl Notes {
    /// Adds a note, unless the same was noted of another place.
    pub(super) fn add(&mut self, at: Span, message: String) {
        if self.kept.len() >= MAX {
            self.left_out += 1;
        } else if self.known.insert(message.clone()) {
            self.kept.push(Warning { at, message });
        }
    }

    /// All of them; `whole` is the place of one that says how many more there were.
    pub(super) fn finish(mut self, whole: Span) -> Vec<Warning> {
        if self.left_out > 0 {
            let message = format!("there are up to {} more notes about materials", self.left_out);
            self.kept.push(Warning { at: whole, message });
        }
        self.kept
    }
}
