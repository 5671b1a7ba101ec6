//! A path that was set to repeat in place of another one: undo ends the repetition, redo brings it back.

use crate::scene::CameraPath;

/// The path, and what there was before.
pub(super) struct RepeatedPath {
    pub(super) path: CameraPath,
    pub(super) before: CameraPath,
    pub(super) was_looped: bool,
}

impl RepeatedPath {
    /// Repetition after the path `from` is replaced by `to`, if that brings or ends it.
    pub(super) fn loops(&self, from: &CameraPath, to: &CameraPath) -> Option<bool> {
        match (*from == self.path, *to == self.path) {
            (true, false) if *to == self.before => Some(self.was_looped),
            (false, true) if *from == self.before => Some(true),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn undo_of_a_repeated_path_ends_the_repetition_and_redo_brings_it_back() {
        let path = |seconds| CameraPath { keys: Vec::new(), closed: false, fps: 30.0, seconds };
        let [before, turn, other] = [1.0, 2.0, 3.0].map(path);
        let repeated = |was_looped| RepeatedPath { path: turn.clone(), before: before.clone(), was_looped };
        assert_eq!(repeated(false).loops(&turn, &before), Some(false));
        assert_eq!(repeated(true).loops(&turn, &before), Some(true), "it was on before");
        assert_eq!(repeated(false).loops(&before, &turn), Some(true), "again");
        // Controls: other changes leave the choice alone.
        assert_eq!(repeated(false).loops(&turn, &other), None);
        assert_eq!(repeated(false).loops(&turn, &turn), None);
        assert_eq!(repeated(false).loops(&other, &before), None);
    }
}
