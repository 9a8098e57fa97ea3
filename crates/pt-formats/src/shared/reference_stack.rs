//! The way down through what refers to others of its kind: nodes that show nodes, files that
//! include files, materials that are mixtures of materials.
//!
//! What is entered is bounded before it is read: how deep it lies, and how many there are, each as
//! often as it is referred to, so that what doubles at each step ends as soon as what does not; and
//! nothing leads to itself. What it takes in memory is asked of the ledger
//! ([`super::context::Context::reserve`]).

use std::path::{Path, PathBuf};

use super::limits::Limits;
use super::xml::quote;

/// How deep, and how many.
#[derive(Clone, Copy, Debug)]
pub(super) struct ReferenceLimits {
    /// Most things on the way at once.
    pub(super) deep: usize,
    /// Most things that are entered in all.
    pub(super) many: usize,
}

/// Why something is not entered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ReferenceError {
    /// It is on the way: it refers to itself, directly or by others.
    Circle,
    /// It would be deeper than that.
    Deep(usize),
    /// It would be one more than that.
    Many(usize),
}

/// What is being read, each referred to by the one before.
#[derive(Debug)]
pub(super) struct ReferenceStack<K> {
    open: Vec<K>,
    entered: usize,
    bounds: ReferenceLimits,
}

impl<K: PartialEq> ReferenceStack<K> {
    pub(super) fn new(bounds: ReferenceLimits) -> Self {
        Self { open: Vec::new(), entered: 0, bounds }
    }

    /// Returns the number of things are on the way.
    pub(super) fn len(&self) -> usize {
        self.open.len()
    }

    /// Goes on to something.
    ///
    /// # Errors
    /// If it is on the way, or beyond a bound.
    pub(super) fn enter(&mut self, key: K) -> Result<(), ReferenceError> {
        let ReferenceLimits { deep, many } = self.bounds;
        if self.open.contains(&key) {
            return Err(ReferenceError::Circle);
        }
        if self.open.len() >= deep {
            return Err(ReferenceError::Deep(deep));
        }
        if self.entered >= many {
            return Err(ReferenceError::Many(many));
        }
        self.entered += 1;
        self.open.push(key);
        Ok(())
    }

    /// Goes back to what referred to the last thing that was entered.
    pub(super) fn leave(&mut self) {
        self.open.pop();
    }
}

impl ReferenceStack<PathBuf> {
    /// The files of a scene, of which the first one is its own, with the bounds of a format or of
    /// the user.
    pub(super) fn of_files(limits: &Limits, deep: usize, many: usize) -> Self {
        let included =
            ReferenceLimits { deep: limits.include_depth(deep), many: limits.files(many) };
        Self::new(ReferenceLimits { deep: included.deep + 1, many: included.many + 1 })
    }

    /// Goes on to a file; a link is what it leads to.
    ///
    /// # Errors
    /// As [`Self::enter`].
    pub(super) fn enter_file(&mut self, path: &Path) -> Result<(), ReferenceError> {
        self.enter(path.canonicalize().unwrap_or_else(|_| path.to_owned()))
    }
}

impl ReferenceError {
    /// The message about a file of this name that is not included.
    pub(super) fn of_file(self, name: &str) -> String {
        match self {
            Self::Circle => format!("{} includes itself, directly or by others", quote(name)),
            Self::Deep(deep) => format!("files are included more than {} deep", deep - 1),
            Self::Many(many) => format!("more than {} files are included", many - 1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ways_end_at_circles_depths_and_numbers() {
        let mut way = ReferenceStack::new(ReferenceLimits { deep: 3, many: 6 });
        assert_eq!([1, 2, 3].map(|key| way.enter(key)), [Ok(()); 3]);
        assert_eq!(way.enter(1), Err(ReferenceError::Circle));
        assert_eq!(way.enter(4), Err(ReferenceError::Deep(3)));
        way.leave();
        // Twice is no circle.
        assert_eq!(way.enter(3), Ok(()));
        way.leave();
        way.leave();
        assert_eq!(way.len(), 1);
        assert_eq!([2, 3].map(|key| way.enter(key)), [Ok(()); 2]);
        way.leave();
        assert_eq!(way.enter(3), Err(ReferenceError::Many(6)));
    }

    /// Things that each refer twice to the next one are entered as often as they are bounded, and
    /// not 2⁴⁰ times.
    #[test]
    fn doublings_end() {
        fn all(
            way: &mut ReferenceStack<u32>,
            key: u32,
            entered: &mut usize,
        ) -> Result<(), ReferenceError> {
            way.enter(key)?;
            *entered += 1;
            for _ in 0..2 {
                if key < 40 {
                    all(way, key + 1, entered)?;
                }
            }
            way.leave();
            Ok(())
        }
        let mut entered = 0;
        let mut way = ReferenceStack::new(ReferenceLimits { deep: 100, many: 1000 });
        assert_eq!(all(&mut way, 0, &mut entered), Err(ReferenceError::Many(1000)));
        assert_eq!(entered, 1000);
    }
}
