//! Installs networks, and checks installed ones.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::JobError;
use crate::io::memory;
use crate::math::stats::median;
use crate::models::catalog;
pub(crate) use crate::models::catalog::{ModelEntry, ModelRole, ModelState, SAM2};
use crate::models::engine;
use crate::models::fetch::Timeouts;
use crate::models::official::WEIGHTS;
use crate::models::{self, IdentityCrop, KnownResult, ModelError};
use crate::pipeline::observer::{Observer, Ticker};

/// Engine and models of this machine.
#[derive(Clone, Debug)]
pub struct ModelList {
    /// Engine and its device; `None` if it cannot be used.
    pub(crate) engine: Option<[String; 2]>,
    /// True if it is the fast engine; `is_settled` if it stays until the program ends.
    pub(crate) is_fast: bool,
    pub(crate) is_settled: bool,
    /// Cores of this machine.
    pub(crate) cores: usize,
    /// Problem of the engine, or a hint to improve it.
    pub(crate) note: Option<String>,
    /// Folder of the models.
    pub(crate) folder: PathBuf,
    pub(crate) models: Vec<(ModelEntry, ModelState)>,
    /// Downloads that were cut off: received MB.
    pub(crate) arrived: BTreeMap<String, u64>,
}

impl ModelList {
    /// Returns the model of this name.
    pub(crate) fn get(&self, id: &str) -> Option<&(ModelEntry, ModelState)> {
        self.models.iter().find(|(e, _)| e.id == id)
    }

    /// Returns about how many MB remain to be downloaded for it, and how many were received.
    pub(crate) fn to_load(&self, entry: &ModelEntry) -> [u64; 2] {
        let arrived = self.arrived.get(&entry.id).copied().unwrap_or(0);
        [entry.download_megabytes().saturating_sub(arrived), arrived]
    }

    /// Returns the models for one purpose.
    pub(crate) fn of(&self, role: ModelRole) -> impl Iterator<Item = (&ModelEntry, &ModelState)> {
        self.models.iter().filter(move |(e, _)| e.role == role).map(|(e, s)| (e, s))
    }

    /// Returns the model to propose: an installed one, else a recommended one, else a built-in one.
    pub(crate) fn best(&self, role: ModelRole) -> Option<&ModelEntry> {
        let rank = |(e, s): &(&ModelEntry, &ModelState)| match s {
            ModelState::Here => 0,
            ModelState::Missing(_) if e.recommended => 1,
            ModelState::BuiltIn => 2,
            _ => 3,
        };
        self.of(role).filter(|m| rank(m) < 3).min_by_key(rank).map(|(e, _)| e)
    }
}

/// Lists the models, installed or not: reads and verifies files.
pub(crate) fn list() -> ModelList {
    let found = engine::facts();
    let [is_fast, is_settled] = found.as_ref().map_or([false, true], |e| [e.is_fast, e.is_settled]);
    let (engine, mut note) = match found {
        Ok(engine) => (Some([engine.name, engine.device.to_owned()]), engine.note),
        Err(e) => (None, Some(e.to_string())),
    };
    let folder = models::folder();
    let models = catalog::entries().unwrap_or_else(|e| {
        note = Some(e.to_string());
        Vec::new()
    });
    let arrived = models.iter().map(|e| (e.id.clone(), e.arrived_megabytes(&folder))).collect();
    let models = models.into_iter().map(|e| (e.clone(), e.state(&folder))).collect();
    ModelList { engine, is_fast, is_settled, cores: memory::cores(), note, folder, models, arrived }
}

/// Source of a model's files.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Source<'a> {
    /// Download from an address; `None` = the one in the list.
    Fetch(Option<&'a str>),
    /// A folder with its files, or the description in it, or its official checkpoint.
    Brought(&'a Path),
}

/// Stage of converting a checkpoint.
const WRITING: &str = "Writing the weights";

/// Installs the model called `id`.
pub(crate) fn install(id: &str, source: Source<'_>, observer: &mut dyn Observer) -> Result<ModelEntry, JobError> {
    let (folder, mut ticker) = (models::folder(), Ticker::new("", 0));
    let entry = catalog::entry(id)?;
    match source {
        Source::Brought(file) if file.extension().is_some_and(|e| e == "json") => {
            entry.add(&folder, file.parent().unwrap_or(file))?;
        }
        Source::Brought(file) if file.is_file() => entry.add_checkpoint(&folder, file, &mut |done, all| {
            ticker.enter(WRITING, 0, all);
            ticker.tick(done as usize, observer).is_ok()
        })?,
        Source::Brought(brought) => entry.add(&folder, brought)?,
        Source::Fetch(from) => entry.fetch(&folder, from, Timeouts::default(), &mut |what, there, all| {
            let (stage, unit) = match what {
                WEIGHTS => (WRITING.to_owned(), 1),
                name => (format!("Downloading {name} (MB)"), 1_000_000),
            };
            ticker.enter(&stage, there / unit, all.unwrap_or(there) / unit);
            ticker.tick((there / unit) as usize, observer).is_ok()
        })?,
    }
    Ok(entry)
}

/// Compares all installed files with their checksums; returns each model with its error, if any.
pub fn check() -> Result<Vec<(String, Option<String>)>, JobError> {
    let folder = models::folder();
    let here = |e: &ModelEntry| !matches!(e.state(&folder), ModelState::Missing(_));
    let check = |e: ModelEntry| (e.id.clone(), e.verify(&folder).err().map(|e| e.to_string()));
    Ok(catalog::entries()?.into_iter().filter(here).map(check).collect())
}

/// Outcome of asking a model a known question.
pub(crate) enum KnownCheck {
    Answer(KnownResult),
    /// The model has no published answer.
    NothingKnown,
    /// The picture is neither installed nor given.
    NoPicture {
        address: String,
    },
}

/// Compares the files of one model with their checksums, and its answer with the published one, for `picture` instead
/// of the installed one.
pub(crate) fn ask_known(id: &str, picture: Option<&Path>) -> Result<KnownCheck, JobError> {
    let (entry, folder) = (catalog::entry(id)?, models::folder());
    entry.verify(&folder)?;
    let Some(known) = &entry.known else { return Ok(KnownCheck::NothingKnown) };
    let path = picture.map_or_else(|| known.picture_in(&folder), Path::to_path_buf);
    if picture.is_none() && !path.is_file() {
        return Ok(KnownCheck::NoPicture { address: known.picture.clone() });
    }
    let pixels = crate::io::photo::open(&path)?;
    Ok(KnownCheck::Answer(known.ask(&entry.description_in(&folder), &pixels)?))
}

#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub(crate) struct EncoderTimes {
    pub(crate) id: String,
    /// Milliseconds of loading it and its first use.
    pub(crate) load_ms: f64,
    pub(crate) picture_ms: f64,
    pub(crate) phrase_ms: f64,
    pub(crate) picture: Vec<f32>,
    pub(crate) phrase: Vec<f32>,
}

/// Times every installed encoder on a picture and a phrase: medians over `runs`. `on_warning` receives a
/// report of each that cannot be used.
pub(crate) fn time_encoders(runs: usize, on_warning: &mut dyn FnMut(String)) -> Result<Vec<EncoderTimes>, JobError> {
    const PHRASE: &str = "a red wooden chair";
    let times = |run: &mut dyn FnMut() -> Result<(), ModelError>| -> Result<f64, ModelError> {
        let mut ms = Vec::with_capacity(runs);
        for _ in 0..runs {
            let start = Instant::now();
            run()?;
            ms.push(start.elapsed().as_secs_f64() * 1e3);
        }
        Ok(median(&ms))
    };
    let mut list = Vec::new();
    for id in catalog::usable(ModelRole::Encoder, on_warning)? {
        let start = Instant::now();
        let mut encoder = models::encoder(&id)?;
        let side_px = encoder.tile_side_px().unwrap_or(224);
        let color = |i: usize| {
            let (x, y) = (i % side_px, i / side_px);
            [x as f32 / side_px as f32, y as f32 / side_px as f32, ((x / 8 + y / 8) % 2) as f32]
        };
        let tile = IdentityCrop { side_px, rgb: (0..side_px * side_px).map(color).collect() };
        // The first run prepares the networks.
        let (picture, phrase) = (encoder.image(&tile)?, encoder.text(PHRASE)?);
        let load_ms = start.elapsed().as_secs_f64() * 1e3;
        let picture_ms = times(&mut || encoder.image(&tile).map(drop))?;
        let phrase_ms = times(&mut || encoder.text(PHRASE).map(drop))?;
        list.push(EncoderTimes { id, load_ms, picture_ms, phrase_ms, picture, phrase });
    }
    Ok(list)
}
