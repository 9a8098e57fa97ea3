//! Computation of values on several threads before they are requested, for images, which take long
//! to decode.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::hash::Hash;
use std::sync::{Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;

/// Values by key. A request also computes those that will probably be requested next.
#[derive(Debug)]
pub(crate) struct Prefetcher<K, T> {
    state: Mutex<PrefetchState<K, T>>,
}

#[derive(Debug)]
struct PrefetchState<K, T> {
    /// Keys that will probably be requested, in this order.
    expected: Vec<K>,
    /// Positions in `expected` of the keys whose values are not computed yet.
    places: HashMap<K, usize>,
    /// Values that were computed and not requested yet.
    made: HashMap<K, T>,
}

impl<K, T> Default for Prefetcher<K, T> {
    fn default() -> Self {
        let state =
            PrefetchState { expected: Vec::new(), places: HashMap::new(), made: HashMap::new() };
        Self { state: Mutex::new(state) }
    }
}

impl<K: Clone + Eq + Hash + Send + Sync, T: Send> Prefetcher<K, T> {
    /// Appends keys that will probably be requested.
    pub(crate) fn expect(&self, keys: impl IntoIterator<Item = K>) {
        let mut state = self.state();
        for key in keys {
            let place = state.expected.len();
            if let Entry::Vacant(entry) = state.places.entry(key.clone()) {
                entry.insert(place);
                state.expected.push(key);
            }
        }
    }

    /// Returns the value of a key, which is computed here or was computed before, by `make` from
    /// the result of `prepare`; `prepare` is called in the order of the keys. Twice as many values
    /// are computed at once as there are threads, so that few are in memory before they are needed.
    pub(crate) fn get<P: Send>(
        &self,
        key: &K,
        prepare: impl Fn(&K) -> P,
        make: impl Fn(P) -> T + Sync,
    ) -> T {
        let next = {
            let mut state = self.state();
            if let Some(made) = state.made.remove(key) {
                return made;
            }
            state.after(key, 2 * rayon::current_num_threads() - 1)
        };
        let wanted = prepare(key);
        let others: Vec<P> = next.iter().map(prepare).collect();
        let others = || others.into_par_iter().map(&make).collect::<Vec<_>>();
        let (wanted, others) = rayon::join(|| make(wanted), others);
        self.state().made.extend(next.into_iter().zip(others));
        wanted
    }

    fn state(&self) -> MutexGuard<'_, PrefetchState<K, T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<K: Clone + Eq + Hash, T> PrefetchState<K, T> {
    /// Returns those of the `count` keys after a key whose values are not computed yet. The caller
    /// must compute them, and that of the key itself.
    fn after(&mut self, key: &K, count: usize) -> Vec<K> {
        let Some(place) = self.places.remove(key) else { return Vec::new() };
        let next = self.expected[place + 1..].iter().take(count);
        next.filter(|key| self.places.remove(*key).is_some()).cloned().collect()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    #[test]
    fn each_thing_is_made_once_and_the_next_ones_beside_it() {
        let ahead = Prefetcher::default();
        ahead.expect([3, 1, 4, 1, 5, 9, 2, 6].into_iter().chain(10..100));
        let made = AtomicUsize::new(0);
        let square = |key: u32| {
            made.fetch_add(1, Ordering::Relaxed);
            key * key
        };
        assert_eq!(ahead.get(&3, |key| *key, square), 9);
        let first = 2 * rayon::current_num_threads();
        assert_eq!(made.load(Ordering::Relaxed), first.min(97));
        for key in [3, 1, 4, 5, 9, 2, 6].into_iter().chain(10..100) {
            assert_eq!(ahead.get(&key, |key| *key, square), key * key);
        }
        // The first key was requested twice.
        assert_eq!(made.load(Ordering::Relaxed), 98);
    }

    #[test]
    fn what_nobody_expects_is_made_alone() {
        let ahead = Prefetcher::default();
        ahead.expect([1, 2]);
        let made = AtomicUsize::new(0);
        let make = |key: u32| made.fetch_add(1, Ordering::Relaxed) as u32 + key;
        assert_eq!(ahead.get(&7, |key| *key, make), 7);
        assert_eq!(made.into_inner(), 1);
    }
}
