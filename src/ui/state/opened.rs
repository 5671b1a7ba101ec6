//! State of an opened scene, and of its objects and parts.

use std::sync::Arc;

use super::{AppState, Tone, TrainHistory};
use crate::jobs::OpenedScene;
use crate::scene::SemanticMap;
use crate::worker::Versioned;

impl AppState {
    /// Sets objects and parts, with their counts.
    pub(super) fn set_semantics(&mut self, map: Option<Arc<SemanticMap>>) {
        self.facts = map.as_ref().map_or_else(Vec::new, |m| m.facts());
        self.sizes = self.facts.iter().map(|f| f.gaussians).collect();
        self.set_facts(self.plan.facts.clone().with_semantics(map.as_deref()));
        self.semantics = map.map(Versioned::new);
    }

    pub(super) fn opened(&mut self, scene: OpenedScene, is_demo: bool) {
        for warning in scene.dataset.iter().flat_map(|d| d.warnings.clone()) {
            self.toast(Tone::Warning, warning);
        }
        self.history =
            TrainHistory { steps: scene.history.steps.clone(), evaluations: scene.history.evaluations.clone() };
        self.training_job = None;
        self.previous = TrainHistory::default();
        let reached = self.history.steps.last().map(|s| s.step);
        self.resumable = scene.resumable.clone().zip(reached);
        self.photos.clear();
        if !is_demo && scene.remote.is_none() {
            self.remember(scene.path.clone());
        }
        self.scene_number += 1;
        (self.explored, self.visited, self.beside, self.removed) = (None, None, None, None);
        self.set_facts(scene.facts.clone());
        self.antialias = scene.render.antialias;
        self.set_semantics(scene.semantics.clone());
        (self.labels, self.phrases) = Default::default();
        self.scene = Some(Arc::new(scene));
    }
}
