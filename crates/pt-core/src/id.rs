//! Typed indices: four bytes that mean the same on every backend, and cannot be mixed up.

use std::fmt;
use std::marker::PhantomData;

/// Index into a [`Table`] of `T`.
#[repr(transparent)]
pub struct Id<T>(u32, PhantomData<fn() -> T>);

impl<T> Id<T> {
    /// The position in the table.
    #[inline]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

impl<T> Clone for Id<T> {
    #[inline]
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Id<T> {}

impl<T> PartialEq for Id<T> {
    fn eq(&self, other: &Self) -> bool {
        self.0 == other.0
    }
}

impl<T> fmt::Debug for Id<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{}", self.0)
    }
}

/// Records indexed by [`Id`].
#[derive(Debug)]
pub struct Table<T>(Vec<T>);

impl<T> Default for Table<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> Table<T> {
    /// Appends a record.
    ///
    /// # Panics
    /// Beyond 2³² records, which the checks of `compile` rule out.
    pub fn push(&mut self, record: T) -> Id<T> {
        let id = u32::try_from(self.0.len()).expect("tables hold fewer than 2^32 records");
        self.0.push(record);
        Id(id, PhantomData)
    }

    /// All records in order.
    #[inline]
    pub fn as_slice(&self) -> &[T] {
        &self.0
    }

    /// All records with their ids.
    pub fn iter(&self) -> impl Iterator<Item = (Id<T>, &T)> {
        self.0.iter().enumerate().map(|(i, r)| (Id(i as u32, PhantomData), r))
    }
}

impl<T> std::ops::Index<Id<T>> for Table<T> {
    type Output = T;
    #[inline]
    fn index(&self, id: Id<T>) -> &T {
        &self.0[id.index()]
    }
}

impl<T> std::ops::IndexMut<Id<T>> for Table<T> {
    #[inline]
    fn index_mut(&mut self, id: Id<T>) -> &mut T {
        &mut self.0[id.index()]
    }
}
