//! Training from the window: continues the current training, or begins a new one beside it.

use super::actions::Action;
use super::app::App;
use super::dialogs::Question;
use super::labels::sentence;
use super::state::Tone;
use crate::jobs::train::{IfChanged, TrainStart};
use crate::worker::Command;

impl App {
    /// Continues the current training if its settings allow it and `anew` is false; else begins a new one.
    pub(super) fn start_training(&mut self, anew: bool, if_changed: IfChanged) {
        let scene = self.state.scene.as_ref();
        let Some((dataset, out)) = scene.and_then(|s| Some((s.dataset.clone()?, s.out.clone()))) else {
            self.state.toast(Tone::Warning, "Open a folder of posed photos first: training needs them.");
            return;
        };
        if let Some(job) = &self.state.job {
            let text = format!("{} is still running; cancel it first (Esc).", job.title);
            self.state.toast(Tone::Warning, text);
            return;
        }
        let config = self.state.next_training(&self.layout.config);
        self.state.antialias = config.render_settings(None, 1.0).antialias;
        let reached = self.state.continues_at(&config).filter(|_| !anew);
        self.state.resumable = Some((config.clone(), reached.unwrap_or(0)));
        let from = TrainStart { more_steps: reached.is_some(), objects_of: Some(out.clone()), if_changed };
        let out = Some(out).filter(|_| !anew);
        self.submit(Command::Train { dataset, config, out, from });
    }

    /// Asks whether to continue a training with photos that have changed since it began.
    pub(super) fn ask_how_to_train(&mut self, changes: &str) {
        let text = format!(
            "{}.\n\nTrain anew in a folder of its own, or go on with the photos as they are now? The training so \
             far stays as it is if you train anew.",
            sentence(changes)
        );
        let action = Action::TrainChanged(IfChanged::Anew);
        let other = Some(("Go on", Action::TrainChanged(IfChanged::GoOn)));
        self.question = Some(Question { text, yes: "Train anew", other, no: "Leave it", action });
    }
}
