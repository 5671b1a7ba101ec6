//! Training from the window: it goes on where the one on screen ended, or begins anew beside it.

use super::app::App;
use super::state::Tone;
use crate::jobs::train::TrainStart;
use crate::worker::Command;

impl App {
    /// Goes on with the training on screen where its settings allow it and it is not to begin `anew`.
    pub(super) fn start_training(&mut self, anew: bool) {
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
        self.state.antialias = config.render_settings(None).antialias;
        let reached = self.state.continues_at(&config).filter(|_| !anew);
        self.state.resumable = Some((config.clone(), reached.unwrap_or(0)));
        let from = TrainStart { more_steps: reached.is_some(), objects_of: Some(out.clone()) };
        let out = Some(out).filter(|_| !anew);
        self.submit(Command::Train { dataset, config, out, from });
    }
}
