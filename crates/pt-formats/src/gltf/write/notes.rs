//! Notes about features of a scene that a format does not support.

use std::collections::{HashMap, HashSet};
use std::fmt::Display;

/// Distinct messages, each with its first location and the number of others.
#[derive(Default)]
pub(super) struct WriteNotes {
    /// Messages in the order of their first occurrence, and their locations.
    all: Vec<(String, Vec<String>)>,
    numbers: HashMap<String, usize>,
    reported: HashSet<(usize, String)>,
}

impl WriteNotes {
    /// Adds a message about a location, once.
    pub(super) fn note(&mut self, place: impl Display, message: impl Into<String>) {
        let (place, message) = (place.to_string(), message.into());
        let number = *self.numbers.entry(message).or_insert_with_key(|message| {
            self.all.push((message.clone(), Vec::new()));
            self.all.len() - 1
        });
        if self.reported.insert((number, place.clone())) {
            self.all[number].1.push(place);
        }
    }

    /// Returns a line for each message, with its number of locations.
    pub(super) fn finish(self) -> Vec<String> {
        let line = |(message, places): (String, Vec<String>)| {
            let first = places.first().map(String::as_str).unwrap_or_default();
            match places.len() - 1 {
                0 => format!("{first}: {message}"),
                1 => format!("{first}, and 1 other: {message}"),
                more => format!("{first}, and {more} others: {message}"),
            }
        };
        self.all.into_iter().map(line).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_of_many_places_is_one_note() {
        let mut notes = WriteNotes::default();
        for place in ["a", "b", "a"] {
            notes.note(place, "it is gone");
        }
        notes.note("a", "it is bent");
        assert_eq!(notes.finish(), ["a, and 1 other: it is gone", "a: it is bent"]);
    }
}
