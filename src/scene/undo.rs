//! Earlier and later states of something that a user changes: undo and redo.
//!
//! States are kept, not inverse steps: undo restores the earlier state bit for bit.

/// States that are kept at most.
const MOST: usize = 200;

/// Undo and redo of a value that lives elsewhere.
#[derive(Clone, Debug)]
pub(crate) struct UndoHistory<T> {
    past: Vec<T>,
    future: Vec<T>,
}

impl<T> Default for UndoHistory<T> {
    fn default() -> Self {
        Self { past: Vec::new(), future: Vec::new() }
    }
}

impl<T> UndoHistory<T> {
    /// Records the state before a change. Clears the states to redo.
    pub(crate) fn record(&mut self, before: T) {
        self.future.clear();
        self.past.push(before);
        if self.past.len() > MOST {
            self.past.remove(0);
        }
    }

    /// Keeps the newest past states as long as `keep` holds for them.
    pub(crate) fn keep_newest_while(&mut self, keep: impl FnMut(&T) -> bool) {
        let mut keep = keep;
        let kept = self.past.iter().rev().take_while(|state| keep(state)).count();
        self.past.drain(..self.past.len() - kept);
    }

    pub(crate) fn last(&self) -> Option<&T> {
        self.past.last()
    }

    pub(crate) fn next(&self) -> Option<&T> {
        self.future.last()
    }

    /// Exchanges `now` for the state before it. Returns whether there is one.
    pub(crate) fn undo(&mut self, now: &mut T) -> bool {
        Self::step(&mut self.past, &mut self.future, now)
    }

    /// Exchanges `now` for the state that was undone last. Returns whether there is one.
    pub(crate) fn redo(&mut self, now: &mut T) -> bool {
        Self::step(&mut self.future, &mut self.past, now)
    }

    /// Removes and returns the state before; it cannot be redone.
    pub(crate) fn take(&mut self) -> Option<T> {
        self.past.pop()
    }

    fn step(from: &mut Vec<T>, to: &mut Vec<T>, now: &mut T) -> bool {
        let Some(other) = from.pop() else { return false };
        to.push(std::mem::replace(now, other));
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_undone_and_redone_in_order() {
        let (mut history, mut now) = (UndoHistory::default(), 0);
        assert!(!history.undo(&mut now) && !history.redo(&mut now));
        for next in 1..=3 {
            history.record(std::mem::replace(&mut now, next));
        }
        assert!(history.undo(&mut now) && history.undo(&mut now) && now == 1);
        assert!(history.redo(&mut now) && now == 2);
        assert_eq!((history.last(), history.next()), (Some(&1), Some(&3)));
        history.record(std::mem::replace(&mut now, 9));
        assert!(!history.redo(&mut now), "a change ends what could be redone");
        assert!(history.undo(&mut now) && now == 2);
        assert_eq!((history.take(), history.take(), history.take()), (Some(1), Some(0), None));
    }

    #[test]
    fn it_is_bounded() {
        let mut history = UndoHistory::default();
        (0..3 * MOST).for_each(|i| history.record(i));
        assert_eq!((history.past.len(), history.past[0]), (MOST, 2 * MOST));
    }
}
