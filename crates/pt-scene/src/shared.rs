//! Lists that clones share.

use std::fmt::{self, Debug, Formatter};
use std::mem;
use std::ops::{Deref, DerefMut};
use std::slice;
use std::sync::Arc;
use std::vec;

/// A list that clones share until one of them is changed.
pub struct Shared<T>(Storage<T>);

enum Storage<T> {
    Own(Arc<Vec<T>>),
    /// Memory of another owner.
    Lent(Arc<dyn AsRef<[T]> + Send + Sync>),
}

impl<T> Shared<T> {
    /// Returns a list in the memory of `owner`, which is dropped with the last clone. The memory
    /// does not change until then.
    pub fn lent(owner: impl AsRef<[T]> + Send + Sync + 'static) -> Self {
        Self(Storage::Lent(Arc::new(owner)))
    }

    /// Returns all items.
    pub fn as_slice(&self) -> &[T] {
        self
    }

    /// Returns true if the lists are one list in memory.
    pub fn is_one_with(&self, other: &Self) -> bool {
        match (&self.0, &other.0) {
            (Storage::Own(ours), Storage::Own(theirs)) => Arc::ptr_eq(ours, theirs),
            (Storage::Lent(_), Storage::Lent(_)) => {
                std::ptr::eq(&raw const **self, &raw const **other)
            }
            _ => false,
        }
    }
}

impl<T: Clone> Shared<T> {
    /// Returns the list to be changed. It is copied first if other clones share it, or if its
    /// memory is lent.
    pub fn to_mut(&mut self) -> &mut Vec<T> {
        if let Storage::Lent(_) = self.0 {
            *self = mem::take(self).into_vec().into();
        }
        match &mut self.0 {
            Storage::Own(list) => Arc::make_mut(list),
            Storage::Lent(_) => unreachable!("the copy is not lent"),
        }
    }

    /// Returns the list. It is copied if other clones share it, or if its memory is lent.
    pub fn into_vec(self) -> Vec<T> {
        match self.0 {
            Storage::Own(list) => Arc::unwrap_or_clone(list),
            Storage::Lent(owner) => (*owner).as_ref().to_vec(),
        }
    }

    /// Appends an item, as [`Vec::push`] does.
    pub fn push(&mut self, item: T) {
        self.to_mut().push(item);
    }
}

impl<T> Clone for Shared<T> {
    fn clone(&self) -> Self {
        Self(match &self.0 {
            Storage::Own(list) => Storage::Own(Arc::clone(list)),
            Storage::Lent(owner) => Storage::Lent(Arc::clone(owner)),
        })
    }
}

impl<T: Debug> Debug for Shared<T> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}

impl<T: PartialEq> PartialEq for Shared<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<T: PartialEq, const N: usize> PartialEq<[T; N]> for Shared<T> {
    fn eq(&self, other: &[T; N]) -> bool {
        **self == *other
    }
}

impl<T: PartialEq> PartialEq<Vec<T>> for Shared<T> {
    fn eq(&self, other: &Vec<T>) -> bool {
        **self == **other
    }
}

impl<T> Default for Shared<T> {
    fn default() -> Self {
        Vec::new().into()
    }
}

impl<T> Deref for Shared<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        match &self.0 {
            Storage::Own(list) => list,
            Storage::Lent(owner) => (**owner).as_ref(),
        }
    }
}

/// Copies as [`Shared::to_mut`] does.
impl<T: Clone> DerefMut for Shared<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        self.to_mut()
    }
}

impl<T> From<Vec<T>> for Shared<T> {
    fn from(list: Vec<T>) -> Self {
        Self(Storage::Own(Arc::new(list)))
    }
}

impl<T> FromIterator<T> for Shared<T> {
    fn from_iter<I: IntoIterator<Item = T>>(items: I) -> Self {
        Vec::from_iter(items).into()
    }
}

impl<T: Clone> Extend<T> for Shared<T> {
    fn extend<I: IntoIterator<Item = T>>(&mut self, items: I) {
        self.to_mut().extend(items);
    }
}

impl<'a, T> IntoIterator for &'a Shared<T> {
    type Item = &'a T;
    type IntoIter = slice::Iter<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<'a, T: Clone> IntoIterator for &'a mut Shared<T> {
    type Item = &'a mut T;
    type IntoIter = slice::IterMut<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter_mut()
    }
}

impl<T: Clone> IntoIterator for Shared<T> {
    type Item = T;
    type IntoIter = vec::IntoIter<T>;

    fn into_iter(self) -> Self::IntoIter {
        self.into_vec().into_iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_leaves_other_clones_as_they_are() {
        let first = Shared::from(vec![1, 2]);
        let mut second = first.clone();
        assert!(first.is_one_with(&second));
        second.push(3);
        assert_eq!((&*first, &*second), (&[1, 2][..], &[1, 2, 3][..]));
        assert!(!first.is_one_with(&second));
    }

    #[test]
    fn a_change_leaves_lent_memory_as_it_is() {
        let owner: Arc<[u32]> = Arc::from([1, 2]);
        let first = Shared::lent(Arc::clone(&owner));
        let mut second = first.clone();
        assert!(first.is_one_with(&second));
        assert_eq!(first.as_ptr(), owner.as_ptr());
        second[0] = 3;
        assert_eq!((&*first, &*second), (&[1, 2][..], &[3, 2][..]));
        assert_eq!(Arc::strong_count(&owner), 2);
        drop(first);
        assert_eq!(Arc::strong_count(&owner), 1);
    }
}
