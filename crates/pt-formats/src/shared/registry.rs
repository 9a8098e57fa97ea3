//! Definitions of a file by name.

use std::collections::{BTreeMap, BTreeSet};

use crate::LoadError;
use crate::shared::names::did_you_mean;

/// Definitions by name, and the names of definitions with errors.
#[derive(Debug)]
pub(crate) struct Registry<T> {
    definitions: BTreeMap<String, T>,
    failed: BTreeSet<String>,
}

impl<T> Default for Registry<T> {
    fn default() -> Self {
        Self { definitions: BTreeMap::new(), failed: BTreeSet::new() }
    }
}

impl<T> Registry<T> {
    /// Returns a definition; `None` if the name is not defined, or with an error.
    pub(crate) fn find(&self, name: &str) -> Option<&T> {
        self.definitions.get(name)
    }

    /// Adds a definition. Returns false if the name is defined already; the first definition
    /// remains.
    pub(crate) fn define(&mut self, name: String, definition: T) -> bool {
        let is_new = self.find(&name).is_none();
        if is_new {
            self.definitions.insert(name, definition);
        }
        is_new
    }

    /// Records that a definition has an error, which was reported.
    pub(crate) fn fail(&mut self, name: String) {
        self.failed.insert(name);
    }

    /// Returns a definition.
    ///
    /// # Errors
    /// [`LoadError::AlreadyReported`] if the definition has an error, and otherwise the error of
    /// `undefined`, which receives a hint at similar names.
    pub(crate) fn get(
        &self,
        name: &str,
        undefined: impl FnOnce(&str) -> LoadError,
    ) -> Result<&T, LoadError> {
        self.find(name).ok_or_else(|| {
            if self.failed.contains(name) {
                return LoadError::AlreadyReported;
            }
            undefined(&did_you_mean(name, self.definitions.keys().map(String::as_str)))
        })
    }
}

#[cfg(test)]
mod tests {
    use pt_scene::Span;

    use super::*;

    #[test]
    fn names_are_defined_once_and_failures_are_reported_once() {
        let mut registry = Registry::default();
        assert!(registry.define("red".into(), 1) && !registry.define("red".into(), 2));
        registry.fail("blue".into());
        let get = |name| {
            registry.get(name, |hint| LoadError::Content {
                at: Span::default(),
                message: format!("undefined{hint}"),
            })
        };
        assert!(matches!(get("red"), Ok(1)));
        assert!(matches!(get("blue"), Err(LoadError::AlreadyReported)));
        let error = get("rad").expect_err("it is not defined").to_string();
        assert!(error.contains("undefined (did you mean \"red\"?)"), "{error}");
    }
}
