//! Stack of open references between items of the same kind: nodes that instance nodes, files that
//! include files, materials that are mixtures of materials.
//!
//! Limits are checked before an item is read: the depth of the stack, and the number of items,
//! counted once per reference, so that references that double at each level end as early as others;
//! and cycles are errors. Memory is requested from the ledger
//! ([`super::context::LoadContext::reserve`]).

use std::path::{Path, PathBuf};

use super::limits::Limits;
use super::names::quote;

/// Limits of references.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReferenceLimits {
    /// Maximum number of items on the stack.
    pub(crate) deep: usize,
    /// Maximum number of items entered in total.
    pub(crate) many: usize,
}

/// Error of [`ReferenceStack::enter`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ReferenceError {
    /// The item is on the stack: it refers to itself, directly or through others.
    Circle,
    /// The stack would be deeper than this.
    Deep(usize),
    /// More than this number of items would be entered.
    Many(usize),
}

/// Items that are being read, each referred to by the previous one.
#[derive(Debug)]
pub(crate) struct ReferenceStack<K> {
    open: Vec<K>,
    entered: usize,
    bounds: ReferenceLimits,
}

impl<K: PartialEq> ReferenceStack<K> {
    pub(crate) fn new(bounds: ReferenceLimits) -> Self {
        Self { open: Vec::new(), entered: 0, bounds }
    }

    /// Returns the number of items on the stack.
    pub(crate) fn len(&self) -> usize {
        self.open.len()
    }

    /// Pushes an item.
    ///
    /// # Errors
    /// Returns an error if it is on the stack, or exceeds a limit.
    pub(crate) fn enter(&mut self, key: K) -> Result<(), ReferenceError> {
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

    /// Pops the last item.
    pub(crate) fn leave(&mut self) {
        self.open.pop();
    }
}

impl ReferenceStack<PathBuf> {
    /// Creates a stack of files, starting with the scene file, with the limits of a format or of
    /// the user.
    pub(crate) fn of_files(limits: &Limits, deep: usize, many: usize) -> Self {
        let included =
            ReferenceLimits { deep: limits.include_depth(deep), many: limits.files(many) };
        Self::new(ReferenceLimits { deep: included.deep + 1, many: included.many + 1 })
    }

    /// Pushes a file, after symbolic links are resolved.
    ///
    /// # Errors
    /// Returns the errors of [`Self::enter`].
    pub(crate) fn enter_file(&mut self, path: &Path) -> Result<(), ReferenceError> {
        self.enter(path.canonicalize().unwrap_or_else(|_| path.to_owned()))
    }
}

impl ReferenceError {
    /// Returns the message about a file of this name that is not included.
    pub(crate) fn of_file(self, name: &str) -> String {
        match self {
            Self::Circle => format!("{} includes itself, directly or indirectly", quote(name)),
            Self::Deep(deep) => format!("includes nested deeper than {}", deep - 1),
            Self::Many(many) => format!("more than {} included files", many - 1),
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
        // A second reference is no cycle.
        assert_eq!(way.enter(3), Ok(()));
        way.leave();
        way.leave();
        assert_eq!(way.len(), 1);
        assert_eq!([2, 3].map(|key| way.enter(key)), [Ok(()); 2]);
        way.leave();
        assert_eq!(way.enter(3), Err(ReferenceError::Many(6)));
    }

    /// Items that each refer to the next one twice are entered up to the limit, and not 2⁴⁰ times.
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
