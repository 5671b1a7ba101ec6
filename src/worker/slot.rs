//! A place for the latest value of something too big to queue.

use std::ops::Deref;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Holds the latest published value. Every value has a generation number, 1 for the first, so that
/// a reader sees at once whether there is something new. Readers never wait for writers longer than
/// it takes to swap a pointer.
#[derive(Debug)]
pub struct Slot<T> {
    latest: Mutex<(u64, Option<Arc<T>>)>,
}

impl<T> Default for Slot<T> {
    fn default() -> Self {
        Self { latest: Mutex::new((0, None)) }
    }
}

impl<T> Slot<T> {
    /// Replaces the value and returns its generation.
    pub(crate) fn publish(&self, value: T) -> u64 {
        let value = Arc::new(value);
        let (generation, old) = {
            let mut latest = self.lock();
            latest.0 += 1;
            (latest.0, latest.1.replace(value))
        };
        // A large value is freed after the lock is gone.
        drop(old);
        generation
    }

    /// The latest value and its generation, if it is newer than generation `seen`.
    pub fn newer_than(&self, seen: u64) -> Option<(u64, Arc<T>)> {
        let latest = self.lock();
        let value = latest.1.as_ref().filter(|_| latest.0 > seen)?;
        Some((latest.0, Arc::clone(value)))
    }

    // The lock is only ever held for a pointer swap, which cannot leave it half done.
    fn lock(&self) -> MutexGuard<'_, (u64, Option<Arc<T>>)> {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Generation of the next [`Versioned`] value.
static NEXT: AtomicU64 = AtomicU64::new(1);

/// A shared value with a generation that no other value of this run has. Values are compared by generation, never by
/// address, which a later value may be given again.
#[derive(Debug)]
pub struct Versioned<T> {
    generation: u64,
    value: Arc<T>,
}

impl<T> Versioned<T> {
    /// A value that is new.
    pub fn new(value: Arc<T>) -> Self {
        Self { generation: NEXT.fetch_add(1, Ordering::Relaxed), value }
    }

    /// Its generation, from 1.
    pub fn generation(&self) -> u64 {
        self.generation
    }
}

impl<T> Clone for Versioned<T> {
    fn clone(&self) -> Self {
        Self { generation: self.generation, value: Arc::clone(&self.value) }
    }
}

impl<T> Deref for Versioned<T> {
    type Target = Arc<T>;

    fn deref(&self) -> &Arc<T> {
        &self.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_copies_share_a_generation() {
        let value = Arc::new(1);
        let first = Versioned::new(Arc::clone(&value));
        let again = Versioned::new(value);
        assert_eq!(first.generation(), first.clone().generation());
        assert!(first.generation() != again.generation() && Arc::ptr_eq(&first, &again));
    }

    #[test]
    fn a_reader_sees_the_latest_value_once() {
        let slot = Slot::default();
        assert!(slot.newer_than(0).is_none());
        slot.publish('a');
        slot.publish('b');
        let (generation, value) = slot.newer_than(0).expect("a value");
        assert_eq!((generation, *value), (2, 'b'));
        assert!(slot.newer_than(generation).is_none());
        slot.publish('c');
        assert_eq!(*slot.newer_than(generation).expect("a value").1, 'c');
    }
}
