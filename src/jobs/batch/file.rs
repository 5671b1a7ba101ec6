//! The file of a batch, `jobs.toml`: scenes, settings and seeds, all combined with one another.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::io::{IoError, files};
use crate::jobs::evaluate_masks::Protocol;
use crate::jobs::find_objects::FindSettings;
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::pipeline::train::TrainConfig;
use crate::scene::Overrides;

/// Longest name of a scene or of settings, in letters.
const LONGEST_NAME: usize = 100;

/// A batch as its file states it.
#[derive(Clone, Debug)]
pub(crate) struct BatchFile {
    pub(crate) path: PathBuf,
    /// Folder of the results, if the file names one.
    pub(crate) out: Option<PathBuf>,
    pub(super) scenes: Vec<BatchScene>,
    pub(super) settings: Vec<BatchSetting>,
    pub(super) seeds: Vec<u64>,
    /// Settings of finding objects, if any are to be found.
    pub(super) objects: Option<FindSettings>,
    pub(super) eval: BatchEvaluation,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct BatchScene {
    pub(super) name: String,
    pub(super) path: PathBuf,
    /// Labels: those of training photos find the objects, the others are compared with them.
    pub(super) masks: Option<PathBuf>,
    /// Query of the object, if labels do not name it.
    pub(super) query: Option<String>,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct BatchSetting {
    pub(super) name: String,
    pub(super) train: BatchTraining,
}

/// Settings of training runs without their seed.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct BatchTraining {
    pub(crate) config: TrainConfig,
    pub(crate) plan: Overrides,
}

/// Settings of the comparison of scenes with held-out photos, and of their objects with labels.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BatchEvaluation {
    pub(crate) max_side_px: Option<u32>,
    pub(crate) keep_borders: bool,
    pub(crate) protocol: Protocol,
    pub(crate) recipe: QueryConfig,
}

/// Readers of the file's tables, by the names and rules of the command line, which stands above this module. Each error
/// says what is wrong and with which key.
#[derive(Clone, Copy)]
pub(crate) struct TableReaders {
    /// A `[[setting]]` without its name; files that it names are relative to the folder.
    pub(crate) training: fn(&toml::Table, &Path) -> Result<BatchTraining, String>,
    pub(crate) objects: fn(&toml::Table) -> Result<FindSettings, String>,
    pub(crate) eval: fn(&toml::Table) -> Result<BatchEvaluation, String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    out: Option<PathBuf>,
    seeds: Option<Vec<u64>>,
    #[serde(default)]
    scene: Vec<SceneTable>,
    #[serde(default)]
    setting: Vec<toml::Table>,
    objects: Option<toml::Table>,
    #[serde(default)]
    eval: toml::Table,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneTable {
    path: PathBuf,
    name: Option<String>,
    masks: Option<PathBuf>,
    query: Option<String>,
}

impl BatchFile {
    /// Reads a batch. Its paths are relative to the file's folder.
    ///
    /// # Errors
    /// If it cannot be read, is not TOML, has unknown keys or values, or gives two units the same folder.
    pub(crate) fn read(path: &Path, readers: TableReaders) -> Result<Self, IoError> {
        let text = files::read_text(path)?;
        let wrong = |place: String, reason: String| IoError::syntax(path, place, reason);
        let document: Document = toml::from_str(&text).map_err(|e| {
            let before = e.span().map_or("", |span| text.get(..span.start).unwrap_or_default());
            wrong(format!("line {}", 1 + before.matches('\n').count()), e.message().to_owned())
        })?;
        let folder = files::folder_of(path);
        let scenes: Vec<BatchScene> = document.scene.into_iter().map(|s| BatchScene::of(s, folder)).collect();
        let mut settings = Vec::new();
        for (k, mut table) in document.setting.into_iter().enumerate() {
            let name = match table.remove("name") {
                Some(toml::Value::String(name)) => name,
                _ => {
                    let reason = "it needs a name, as text: name = \"fast\"";
                    return Err(wrong(format!("[[setting]] number {}", k + 1), reason.into()));
                }
            };
            let train =
                (readers.training)(&table, folder).map_err(|why| wrong(format!("[[setting]] '{name}'"), why))?;
            settings.push(BatchSetting { name, train });
        }
        if settings.is_empty() {
            settings.push(BatchSetting { name: "default".into(), train: BatchTraining::default() });
        }
        let objects = document.objects.as_ref().map(|table| (readers.objects)(table)).transpose();
        let batch = Self {
            path: path.into(),
            out: document.out.map(|out| folder.join(out)),
            scenes,
            settings,
            seeds: document.seeds.unwrap_or_else(|| vec![0]),
            objects: objects.map_err(|why| wrong("[objects]".into(), why))?,
            eval: (readers.eval)(&document.eval).map_err(|why| wrong("[eval]".into(), why))?,
        };
        batch.check().map_err(|(place, reason)| wrong(place, reason))?;
        Ok(batch)
    }

    /// Returns the first error of the batch, as its place and reason.
    fn check(&self) -> Result<(), (String, String)> {
        let bad = |place: String, reason: &str| Err((place, reason.to_owned()));
        if self.scenes.is_empty() {
            return bad("[[scene]]".into(), "there is none; name one: [[scene]] path = \"photos\"");
        }
        if self.seeds.is_empty() {
            return bad("'seeds'".into(), "there is none; leave the line out for the seed 0");
        }
        let seeds = self.seeds.iter().map(|seed| ("seeds", seed.to_string()));
        let scenes = self.scenes.iter().map(|s| ("[[scene]]", s.name.clone()));
        let settings = self.settings.iter().map(|s| ("[[setting]]", s.name.clone()));
        let mut seen = BTreeMap::new();
        for (of, name) in seeds.chain(scenes).chain(settings) {
            if let Some(why) = unfit(&name) {
                return bad(format!("{of} '{name}'"), &format!("{why}, so it cannot be a folder's; give it a 'name'"));
            }
            // Some file systems do not distinguish capital letters.
            if seen.insert((of, name.to_lowercase()), ()).is_some() {
                let remedy = "it is there twice, and two units would have one folder; give one another 'name'";
                return bad(format!("{of} '{name}'"), if of == "seeds" { "it is there twice" } else { remedy });
            }
        }
        let labeled = self.scenes.iter().find(|s| s.masks.is_some() || s.query.is_some());
        match labeled {
            Some(scene) if self.objects.is_none() => bad(
                format!("[[scene]] '{}'", scene.name),
                "'masks' and 'query' are for objects, and none are to be found; add a table [objects], which may be empty",
            ),
            _ => Ok(()),
        }
    }
}

impl BatchScene {
    fn of(table: SceneTable, folder: &Path) -> Self {
        let path = folder.join(table.path);
        Self {
            name: table.name.unwrap_or_else(|| files::folder_name(&path)),
            path,
            masks: table.masks.map(|masks| folder.join(masks)),
            query: table.query,
        }
    }
}

/// Returns the reason that a name cannot be a folder's on every system.
fn unfit(name: &str) -> Option<&'static str> {
    let bad = |c: char| c.is_control() || "/\\:*?\"<>|".contains(c);
    match name {
        "" => Some("the name is empty"),
        _ if name.chars().count() > LONGEST_NAME => Some("the name is longer than 100 letters"),
        _ if name.starts_with(['.', ' ', '-']) || name.ends_with(['.', ' ']) => {
            Some("the name begins or ends with a dot, a space or a dash")
        }
        _ if name.contains(bad) => Some("the name has one of / \\ : * ? \" < > | or a control character in it"),
        _ => None,
    }
}
