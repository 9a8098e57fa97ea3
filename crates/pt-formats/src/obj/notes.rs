//! Warnings about materials, without duplicates.

use std::collections::HashSet;

use pt_scene::{Span, Warning};

/// Maximum number of warnings.
const MAX: usize = 100;

/// Warnings about materials.
#[derive(Default)]
pub(super) struct MaterialNotes {
    kept: Vec<Warning>,
    known: HashSet<String>,
    left_out: usize,
}

impl MaterialNotes {
    /// Adds a warning, unless there is one with the same message.
    pub(super) fn add(&mut self, at: Span, message: String) {
        if self.kept.len() >= MAX {
            self.left_out += 1;
        } else if self.known.insert(message.clone()) {
            self.kept.push(Warning { at, message });
        }
    }

    /// Returns all warnings; `whole` is the location of one about the number of further ones.
    pub(super) fn finish(mut self, whole: Span) -> Vec<Warning> {
        if self.left_out > 0 {
            let message = format!("up to {} more notes about materials", self.left_out);
            self.kept.push(Warning { at: whole, message });
        }
        self.kept
    }
}
