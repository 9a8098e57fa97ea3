//! Typed 32-bit indices, which mean the same on every backend and cannot be mixed up.

use std::fmt;
use std::marker::PhantomData;

/// Index into a [`Table`] of `T`.
#[repr(transparent)]
pub struct Id<T>(u32, PhantomData<fn() -> T>);

impl<T> Id<T> {
    /// Returns the position in the table.
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

/// Marker of the ids of surfaces, which modules below that of the records use.
#[derive(Clone, Copy, Debug)]
pub enum SurfaceMarker {}

/// Index of a [`SurfaceRecord`](crate::surface::SurfaceRecord).
pub type SurfaceId = Id<SurfaceMarker>;

/// Records indexed by [`Id`]s of `K`, usually of the records themselves.
#[derive(Clone, Debug)]
pub struct Table<T, K = T>(Vec<T>, PhantomData<fn() -> K>);

impl<T, K> Default for Table<T, K> {
    fn default() -> Self {
        Self(Vec::new(), PhantomData)
    }
}

impl<T, K> Table<T, K> {
    /// Appends a record.
    ///
    /// # Panics
    /// If the table has 2³² records, which the checks of `compile` rule out.
    pub fn push(&mut self, record: T) -> Id<K> {
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
    pub fn iter(&self) -> impl Iterator<Item = (Id<K>, &T)> {
        self.0.iter().enumerate().map(|(i, r)| (Id(i as u32, PhantomData), r))
    }
}

impl<T, K> std::ops::Index<Id<K>> for Table<T, K> {
    type Output = T;
    #[inline]
    fn index(&self, id: Id<K>) -> &T {
        &self.0[id.index()]
    }
}

impl<T, K> std::ops::IndexMut<Id<K>> for Table<T, K> {
    #[inline]
    fn index_mut(&mut self, id: Id<K>) -> &mut T {
        &mut self.0[id.index()]
    }
}
