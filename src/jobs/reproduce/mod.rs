//! The paper's tables, and ReferSplat's, one call each: every scene of a data set is trained, its objects are found,
//! and answers to queries are compared with its labels. Our rows stand beside the printed ones, and beside baselines
//! made of our own components.
//!
//! Each scene has a folder, and each of its stages leaves a file at its end: a stopped run is resumed, and no finished
//! stage is repeated. A folder holds the results of one set of settings only.

mod layout;
mod printed;
mod results;
mod rows;
mod scene;
mod table;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

pub(crate) use self::table::TableDocument;
use super::experiment::difference;
use super::{JobError, export};
use crate::io::files;
use crate::models::catalog::{self, ModelRole};
use crate::pipeline::observer::{Observer, Severity};
use crate::pipeline::semantics::lifting::build_map::REGIONS;
use crate::pipeline::train::TrainConfig;

/// A table of the paper, or of ReferSplat.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum, strum::IntoStaticStr)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub(crate) enum PaperTable {
    /// Localization and mean IoU on the LERF scenes
    LerfOvs,
    /// Masks of one object each
    SpinNerf,
    /// Masks of every class
    #[serde(rename = "3d-ovs")]
    #[value(name = "3d-ovs")]
    #[strum(serialize = "3d-ovs")]
    Ovs3d,
    /// Recall of parts as multilevel extraction, semantic deviation and multilevel localization are switched on
    PartAblation,
    /// Sentences about objects of the LERF scenes, ReferSplat's table; never tried on the real data set
    RefLerf,
}

/// Value of `masks` for masks from the labels themselves.
pub(crate) const LABELS: &str = "labels";
/// Name of the paper's encoder.
pub(crate) const PAPERS_ENCODER: &str = "clip-vit-b16";

/// Settings that the numbers depend on, besides the data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ReproduceSettings {
    pub(crate) table: PaperTable,
    /// Source of masks: [`LABELS`], [`REGIONS`], or a model that finds them.
    pub(crate) masks: String,
    pub(crate) encoder: String,
    /// True if labeled photos are trained on, as in the literature.
    pub(crate) labeled_in_training: bool,
    pub(crate) train: TrainConfig,
    /// Query by scene, if labels have no names; else the scene's name.
    pub(crate) queries: BTreeMap<String, String>,
}

#[derive(Clone, Debug)]
pub(crate) struct ReproduceRequest {
    /// The data set's folder.
    pub(crate) data: PathBuf,
    /// Folder of the results.
    pub(crate) out: PathBuf,
    /// Names of scenes; empty for all.
    pub(crate) scenes: Vec<String>,
    pub(crate) settings: ReproduceSettings,
    /// Results of other methods by scene, measured beside this program's; they change no setting.
    pub(crate) results: Vec<(String, PathBuf)>,
}

const SETTINGS_FILE: &str = "settings.json";

/// Returns the default source of masks: the best installed network.
pub(crate) fn usual_masks(observer: &mut dyn Observer) -> Result<String, JobError> {
    let mut warn = |text: String| observer.note(Severity::Warning, text);
    let here = catalog::usable(ModelRole::Segmenter, &mut warn)?.into_iter().next();
    here.ok_or_else(|| {
        let text = "no network that finds masks is on this machine: 'fmlgs models' lists them and 'fmlgs models \
                    fetch' brings one. Without: --masks regions (built in, rough) or --masks labels (which measures the \
                    carrying of masks and not their finding)";
        JobError::Protocol(text.into())
    })
}

/// Makes the table, and writes it as `table.json` and `table.md` into the folder of the results.
pub(crate) fn run(request: &ReproduceRequest, observer: &mut dyn Observer) -> Result<TableDocument, JobError> {
    let ReproduceRequest { data, out, settings, .. } = request;
    let scenes = layout::find(settings.table, data, &request.scenes)?;
    let unknown = settings.queries.keys().find(|name| !scenes.iter().any(|s| s.name == **name));
    if let Some(name) = unknown {
        return Err(JobError::Protocol(format!("--query {name}=...: {} has no scene '{name}'", data.display())));
    }
    check_models(settings)?;
    results::check(request, &scenes)?;
    claim(out, data, settings)?;
    let (mut results, mut notes) = (Vec::with_capacity(scenes.len()), Vec::new());
    for (k, input) in scenes.iter().enumerate() {
        observer.note(Severity::Info, format!("Scene {} of {}: {}", k + 1, scenes.len(), input.name));
        let mut result = scene::run(input, &out.join(&input.name), settings, observer)?;
        notes.extend(results::add(&mut result, input, request, observer)?);
        results.push(result);
    }
    let mut document = TableDocument::new(settings, results);
    document.notes.extend(notes);
    export::json(&out.join("table.json"), &document)?;
    export::text(&out.join("table.md"), &document.markdown())?;
    Ok(document)
}

/// Reports missing networks before hours of training, not after.
fn check_models(settings: &ReproduceSettings) -> Result<(), JobError> {
    let told = |what: &str, e: crate::models::ModelError, instead: &str| {
        JobError::Protocol(format!("{what}: {e}; 'fmlgs models fetch' brings it, or {instead}"))
    };
    let encoder = crate::models::encoder(&settings.encoder);
    let remedy = "use --encoder demo, which knows made-up things only";
    drop(encoder.map_err(|e| told("--encoder", e, remedy))?);
    if ![LABELS, REGIONS].contains(&settings.masks.as_str()) {
        let found = catalog::find(&settings.masks, ModelRole::Segmenter);
        found.map_err(|e| told("--masks", e, "use --masks regions or --masks labels"))?;
    }
    Ok(())
}

/// Claims the folder for results of these settings, unless it holds anything else.
fn claim(out: &Path, data: &Path, settings: &ReproduceSettings) -> Result<(), JobError> {
    export::check_folder(out, &[data])?;
    let file = out.join(SETTINGS_FILE);
    let refuse = |why: String| Err(JobError::Output(format!("{}: {why}; give another --out", out.display())));
    if file.exists() {
        let there: serde_json::Value = files::read_json(&file)?;
        let now = serde_json::json!(settings);
        return match difference(&there, &now) {
            Some(what) => refuse(format!("it holds results of other settings ({what})")),
            None => Ok(()),
        };
    }
    if std::fs::read_dir(out).is_ok_and(|mut entries| entries.next().is_some()) {
        return refuse("it is not empty, and what is in it was not made by this command".into());
    }
    export::make_folder(out)?;
    Ok(export::json(&file, settings)?)
}
