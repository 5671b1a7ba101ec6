//! The next step of the work on a scene: its button is the main one, wherever it is.

use super::state::AppState;
use crate::ui::actions::Action;

/// Returns what comes next for the open scene: training, then finding objects, then queries. `None` without a scene, and
/// while a job runs.
pub(crate) fn next_step(state: &AppState) -> Option<Action> {
    let scene = state.scene.as_ref().filter(|_| state.job.is_none())?;
    let has_photos = scene.dataset.is_some() && scene.remote.is_none();
    let is_finished = state.resumable.as_ref().is_none_or(|(config, step)| *step >= config.steps);
    if has_photos && (!state.is_trained() || !is_finished) {
        return Some(Action::StartTraining);
    }
    match state.semantics.is_some() {
        true => Some(Action::TypeQuery),
        false => has_photos.then_some(Action::FindObjects),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::jobs::OpenedScene;
    use crate::pipeline::train::TrainConfig;
    use crate::scene::{Dataset, Identities, SemanticMap};
    use crate::worker::{Event, JobId, JobInfo};

    #[test]
    fn training_comes_first_then_objects_then_queries() {
        let mut state = AppState::default();
        assert_eq!(next_step(&state), None, "nothing is open");
        let photos = OpenedScene { dataset: Some(Arc::new(Dataset::default())), ..OpenedScene::default() };
        state.scene = Some(Arc::new(photos.clone()));
        assert_eq!(next_step(&state), Some(Action::StartTraining));
        state.scene = Some(Arc::new(OpenedScene { trained: true, ..photos }));
        let config = TrainConfig { steps: 600, ..TrainConfig::default() };
        state.resumable = Some((config.clone(), 130));
        assert_eq!(next_step(&state), Some(Action::StartTraining), "it was stopped at step 130 of 600");
        state.resumable = Some((config, 600));
        assert_eq!(next_step(&state), Some(Action::FindObjects));
        let map = SemanticMap::from_identities(Identities::default(), Vec::new(), Vec::new(), Vec::new());
        state.set_semantics(Some(Arc::new(map)));
        assert_eq!(next_step(&state), Some(Action::TypeQuery));
        state.apply(Event::Started(JobId::Local(1), JobInfo::long("Exporting")));
        assert_eq!(next_step(&state), None, "something runs");
        // Gaussians without photos can be neither trained nor searched.
        let splat = OpenedScene { trained: true, ..OpenedScene::default() };
        let mut state = AppState::default();
        state.scene = Some(Arc::new(splat));
        assert_eq!(next_step(&state), None);
    }
}
