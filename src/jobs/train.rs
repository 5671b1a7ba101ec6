//! Training Gaussians on posed photos.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::presets;
use super::{JobError, Scene, open};
use crate::io::{IoError, SceneFolder, semantic_map, splat_ply, trained};
use crate::math::format::things;
use crate::pipeline::observer::{Interrupted, Observer, Severity};
use crate::pipeline::semantics::lifting::carry;
use crate::pipeline::train::checkpoint::CheckpointError;
use crate::pipeline::train::{self, FolderUse, TrainConfig, TrainEnd, TrainError, TrainOutcome};
use crate::scene::{Dataset, SemanticMap};

#[derive(Clone, Debug)]
pub(crate) struct Trained {
    pub(crate) outcome: TrainOutcome,
    pub(crate) out: PathBuf,
    /// Id of its save.
    pub(crate) state: Option<String>,
    /// Objects and parts that were carried over from the previous scene.
    pub(crate) semantics: Option<Arc<SemanticMap>>,
}

impl Trained {
    /// Returns whether all steps are done; else the observer has stopped it.
    pub(crate) fn is_finished(&self) -> bool {
        self.outcome.end == TrainEnd::Finished
    }

    /// Returns the outcome if all steps are done.
    pub(crate) fn finished(self) -> Result<TrainOutcome, Interrupted> {
        if self.is_finished() { Ok(self.outcome) } else { Err(Interrupted) }
    }
}

/// Action if a training run in a folder began with photos or poses that have changed since.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum IfChanged {
    /// The user is asked: it is an error that names the changes.
    #[default]
    Ask,
    /// Keep that run, and start another one in the next folder; without one it is that error.
    Anew,
    /// Resume with the changed photos.
    GoOn,
    /// As [`Self::Ask`], in a folder that another process takes away when it resumes the run.
    AskClaimed,
}

/// Start of a training run.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TrainStart {
    /// Continue a finished run with the same settings and fewer steps.
    pub more_steps: bool,
    /// Scene whose objects and parts are carried over, by position, to a training run in another folder.
    pub objects_of: Option<PathBuf>,
    /// Action for a run that began with other photos.
    pub if_changed: IfChanged,
}

impl From<IfChanged> for TrainStart {
    fn from(if_changed: IfChanged) -> Self {
        Self { if_changed, ..Self::default() }
    }
}
/// Trains into the first of these `folders` that holds no training run with other settings: that is another run, and
/// the earlier one stays. A stopped run there is resumed.
pub(crate) fn run(
    dataset: &Dataset,
    config: &TrainConfig,
    folders: impl IntoIterator<Item = PathBuf>,
    from: &TrainStart,
    observer: &mut dyn Observer,
) -> Result<Trained, JobError> {
    let changed = from.if_changed;
    let may = FolderUse {
        anyway: changed == IfChanged::GoOn,
        remake: changed != IfChanged::AskClaimed,
        more_steps: from.more_steps,
    };
    let mut folders = folders.into_iter().peekable();
    let mut earlier: Option<(String, PathBuf)> = None;
    while let Some(out) = folders.next() {
        if let Some(earlier) = earlier.take() {
            let objects = match semantic_map::identities(&earlier.1).len() {
                0 => String::new(),
                n => format!(", with its {}", things(n, "object or part")),
            };
            let text = format!("{}, so this is a new training; the earlier one{objects} stays", earlier.0);
            observer.note(Severity::Info, text);
        }
        match train::run_on(dataset, config, Some(&out), may, observer) {
            Err(TrainError::Checkpoint(e)) if folders.peek().is_some() && makes_another(&e, changed) => {
                let settings = || format!("The settings are not those of the training in {}", out.display());
                let is_other = matches!(e, CheckpointError::OtherInputs { .. });
                earlier = Some((if is_other { sentence(&e) } else { settings() }, out));
            }
            result => {
                let outcome = result?;
                if trained::is_scene(&out)
                    && let Err(e) = presets::keep(&out, config)
                {
                    observer.note(Severity::Warning, format!("The settings could not be saved to a file: {e}"));
                }
                if let Some(other) = &from.objects_of
                    && let Err(e) = carry_over(other, &out, observer)
                {
                    observer
                        .note(Severity::Warning, format!("The earlier objects and parts are not carried over: {e}"));
                }
                return finished(outcome, out, observer);
            }
        }
    }
    Err(TrainError::Config("there is no folder to train into".into()).into())
}

/// Returns whether a folder with this error is skipped for the next one.
fn makes_another(error: &CheckpointError, changed: IfChanged) -> bool {
    match error {
        CheckpointError::OtherRun { .. } | CheckpointError::Missing { .. } => true,
        CheckpointError::OtherInputs { .. } => changed == IfChanged::Anew,
        _ => false,
    }
}

/// Returns the error as the beginning of a sentence.
fn sentence(error: &CheckpointError) -> String {
    let text = error.to_string();
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Gives the scene in the folder `to` the objects and parts of the scene in `from`, unless it has some.
fn carry_over(from: &Path, to: &Path, observer: &mut dyn Observer) -> Result<(), IoError> {
    let has_objects = |folder: &Path| trained::is_scene(folder) && folder.join(semantic_map::FILE).exists();
    if from == to || !has_objects(from) || has_objects(to) || !trained::is_scene(to) {
        return Ok(());
    }
    let old = trained::load(from)?;
    let Some(map) = semantic_map::load(from, old.state.as_deref(), &old.cloud)? else { return Ok(()) };
    let new = trained::load(to)?;
    let (carried, share) = carry::carry(&map, &old.cloud, &new.cloud);
    SceneFolder::hold(to, "carrying objects over")?.save_map(new.state.as_deref(), &carried, &new.cloud)?;
    let text = format!(
        "{} of the training in {} were carried over to {:.1} % of the Gaussians, by place",
        map.identities.counted(),
        from.display(),
        100.0 * share
    );
    observer.note(Severity::Info, text);
    Ok(())
}

/// Returns the outcome with the scene's state and its objects. Those are carried over to Gaussians that were trained
/// further, and have to be read with their state.
fn finished(outcome: TrainOutcome, out: PathBuf, observer: &mut dyn Observer) -> Result<Trained, JobError> {
    let mut done = Trained { outcome, out, state: None, semantics: None };
    if trained::is_scene(&done.out) {
        done.state = splat_ply::state(&done.out.join(trained::CLOUD_FILE))?;
    }
    if done.out.join(semantic_map::FILE).exists() {
        // The identity of each Gaussian is in their file.
        let cloud = Arc::new(trained::load(&done.out)?.cloud);
        let (folder, state) = (Some(done.out.clone()), done.state.clone());
        let scene = Scene { path: done.out.clone(), folder, cloud, state, ..Scene::default() };
        done.semantics = open::known_objects(&scene, observer);
    }
    Ok(done)
}
