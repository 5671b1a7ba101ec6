//! Training Gaussians on posed photos.

use std::path::PathBuf;
use std::sync::Arc;

use super::presets;
use super::{JobError, Scene, open};
use crate::io::{semantic_map, splat_ply, trained};
use crate::pipeline::observer::{Observer, Severity};
use crate::pipeline::train::checkpoint::CheckpointError;
use crate::pipeline::train::{self, FolderUse, TrainConfig, TrainEnd, TrainError, TrainOutcome};
use crate::scene::{Dataset, SemanticMap};

#[derive(Clone, Debug)]
pub(crate) struct Trained {
    pub(crate) outcome: TrainOutcome,
    pub(crate) out: PathBuf,
    /// Id of its save.
    pub(crate) state: Option<String>,
    /// Objects and parts that were carried over from the scene before.
    pub(crate) semantics: Option<Arc<SemanticMap>>,
}

impl Trained {
    /// Whether all steps are done; else the observer has stopped it.
    pub(crate) fn is_finished(&self) -> bool {
        self.outcome.end == TrainEnd::Finished
    }
}

/// What is done where a training in a folder began with other photos or poses than there are now.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum IfChanged {
    /// Somebody is asked: it is an error that names what has changed.
    #[default]
    Ask,
    /// It stays, and another training begins in the next folder; without one it is that error.
    Anew,
    /// It goes on with what there is now.
    GoOn,
    /// As [`Self::Ask`], in a folder that others take away where they go on with it.
    AskClaimed,
}

/// Trains into the first of these `folders` that holds no training with other settings: that is another training,
/// and the earlier one stays. A training that was stopped there goes on.
pub(crate) fn run(
    dataset: &Dataset,
    config: &TrainConfig,
    folders: impl IntoIterator<Item = PathBuf>,
    changed: IfChanged,
    observer: &mut dyn Observer,
) -> Result<Trained, JobError> {
    let may = FolderUse { anyway: changed == IfChanged::GoOn, remake: changed != IfChanged::AskClaimed };
    let mut folders = folders.into_iter().peekable();
    let mut earlier: Option<String> = None;
    while let Some(out) = folders.next() {
        if let Some(earlier) = earlier.take() {
            observer.note(Severity::Info, format!("{earlier}, so this is a new training; the earlier one stays"));
        }
        match train::run_on(dataset, config, Some(&out), may, observer) {
            Err(TrainError::Checkpoint(e)) if folders.peek().is_some() && makes_another(&e, changed) => {
                let settings = || format!("The settings are not those of the training in {}", out.display());
                let is_other = matches!(e, CheckpointError::OtherInputs { .. });
                earlier = Some(if is_other { sentence(&e) } else { settings() });
            }
            result => {
                let outcome = result?;
                if trained::is_scene(&out)
                    && let Err(e) = presets::keep(&out, config)
                {
                    observer.note(Severity::Warning, format!("The settings could not be saved to a file: {e}"));
                }
                return finished(outcome, out, observer);
            }
        }
    }
    Err(TrainError::Config("there is no folder to train into".into()).into())
}

/// Whether a folder that holds this is left alone for the next one.
fn makes_another(error: &CheckpointError, changed: IfChanged) -> bool {
    match error {
        CheckpointError::OtherRun { .. } | CheckpointError::Missing { .. } => true,
        CheckpointError::OtherInputs { .. } => changed == IfChanged::Anew,
        _ => false,
    }
}

/// The error as the beginning of a sentence.
fn sentence(error: &CheckpointError) -> String {
    let text = error.to_string();
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Objects are carried over to Gaussians that went on, and have to be read with their state.
fn finished(outcome: TrainOutcome, out: PathBuf, observer: &mut dyn Observer) -> Result<Trained, JobError> {
    let mut done = Trained { outcome, out, state: None, semantics: None };
    if trained::is_scene(&done.out) {
        done.state = splat_ply::state(&done.out.join(trained::CLOUD_FILE))?;
    }
    if done.out.join(semantic_map::FILE).exists() {
        // Whose each Gaussian is stands in their file.
        let cloud = Arc::new(trained::load(&done.out)?.cloud);
        let (folder, state) = (Some(done.out.clone()), done.state.clone());
        let scene = Scene { path: done.out.clone(), folder, cloud, state, ..Scene::default() };
        done.semantics = open::known_objects(&scene, observer);
    }
    if !done.is_finished() && done.semantics.is_some() {
        let text = "Its objects are stored with the Gaussians as they are now; open the scene again to see them";
        observer.note(Severity::Info, text.into());
    }
    Ok(done)
}
