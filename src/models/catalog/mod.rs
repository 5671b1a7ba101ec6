//! List of the networks that the program can use (`assets/models.toml`), and their state on this machine. They lie in
//! one folder: `FMLGS_MODELS`, else `models` in the user's data folder. Each model has a description (JSON) with the
//! SHA-256 of its graphs; a graph that differs is refused.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::fetch::{self, FetchError, FileToFetch, Timeouts};
use super::{KnownAnswer, ModelError, folder, manifest};
use crate::io::files;

const LIST: &str = include_str!("../../../assets/models.toml");

/// Name of the model that tracks masks.
pub(crate) const SAM2: &str = "sam2.1-tiny";

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum ModelRole {
    /// Compares pictures with phrases.
    Encoder,
    Segmenter,
    /// Fills in missing pixels of a picture.
    Inpainter,
    /// Runs networks.
    Engine,
}

/// A model of the list.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelEntry {
    /// Name in commands.
    pub id: String,
    pub(crate) role: ModelRole,
    /// Display name.
    pub title: String,
    /// Purpose, in plain words.
    pub adds: String,
    /// License of its weights.
    pub license: String,
    pub(crate) source: String,
    /// Command of `tools/export` that makes its files.
    #[serde(default)]
    pub export: String,
    /// True if it is part of the program.
    #[serde(default)]
    pub built_in: bool,
    /// Name of the file that describes it; empty if it is built in.
    #[serde(default)]
    pub description: String,
    /// Address of the folder with its files, if there is one.
    #[serde(default)]
    pub(crate) url: Option<String>,
    /// Its graphs.
    #[serde(default)]
    pub file: Vec<ListedFile>,
    /// Official file that it can be made from.
    #[serde(default)]
    pub checkpoint: Option<OfficialFile>,
    /// Archives of an engine, by system: the one for this system becomes `checkpoint`.
    #[serde(default)]
    pub(crate) archive: Vec<SystemArchive>,
    /// Speed without a GPU, in words.
    #[serde(default)]
    pub speed: String,
    /// Published answer of the official weights.
    #[serde(default)]
    pub(crate) known: Option<KnownAnswer>,
    /// True if it is the first choice for its role.
    #[serde(default)]
    pub(crate) recommended: bool,
    /// Time in which a segmenter segments everything in a photo, or an encoder embeds one picture of an object.
    pub(crate) photo_seconds: Option<PhotoSeconds>,
    /// Seconds in which a tracker encodes a frame with ONNX Runtime, and tracks one mask into it.
    pub(crate) track_seconds: Option<[f64; 2]>,
}

/// Seconds on two cores, measured.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PhotoSeconds {
    /// With ONNX Runtime.
    pub(crate) onnx_runtime: f64,
    /// With the built-in engine.
    pub(crate) built_in: Option<f64>,
    /// With ONNX Runtime, for each object besides: its own tile is searched for parts.
    pub(crate) each_object: Option<f64>,
}

/// Archive with an engine for one system and architecture.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct SystemArchive {
    /// Operating system, as Rust names it.
    system: String,
    architecture: String,
    /// Library that is extracted from the archive.
    library: ListedFile,
    file: OfficialFile,
}

/// File with the weights of a model, as its authors publish it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OfficialFile {
    /// Address.
    pub url: String,
    /// Approximate size, MB.
    pub megabytes: u64,
    /// Published checksum, if there is one.
    #[serde(default)]
    pub sha256: Option<String>,
}

/// Graph of a listed model.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ListedFile {
    pub(crate) name: String,
    pub(crate) megabytes: u64,
    #[serde(default)]
    pub(crate) sha256: Option<String>,
}

#[derive(Deserialize)]
struct List {
    model: Vec<ModelEntry>,
}

/// State of a model on this machine.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ModelState {
    /// Part of the program.
    BuiltIn,
    /// All files are present.
    Here,
    /// These files are missing.
    Missing(Vec<String>),
    /// A file is damaged, or its description cannot be read.
    Broken(String),
}

impl ModelState {
    pub(crate) fn is_usable(&self) -> bool {
        matches!(self, Self::BuiltIn | Self::Here)
    }
}

/// Reasons for which a model could not be installed.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum InstallError {
    #[error("there is no model called '{0}'; 'fmlgs models' lists them")]
    Unknown(String),
    #[error("'{0}' is part of the program")]
    BuiltIn(String),
    #[error("'{id}' cannot be made of a checkpoint here; give a folder with its files, made by tools/export/{export}")]
    NoTemplate { id: String, export: String },
    #[error(
        "no address is known for '{id}'. Make its files of the official checkpoint ({source_page}): python tools/export/{export} \
         --out FOLDER, then 'fmlgs models add {id} FOLDER'; or give the address of a folder that has them with --from"
    )]
    NoAddress { id: String, source_page: String, export: String },
    #[error("{folder} lacks {missing}, which '{id}' consists of; {remedy}")]
    Incomplete { id: String, folder: PathBuf, missing: String, remedy: String },
    #[error(transparent)]
    Fetch(#[from] FetchError),
    #[error(transparent)]
    Model(#[from] ModelError),
}

/// Returns all listed models, in the order of the list.
pub fn entries() -> Result<Vec<ModelEntry>, ModelError> {
    let damaged =
        |e: toml::de::Error| ModelError::Metadata { path: "assets/models.toml".into(), problem: e.to_string() };
    let mut all = toml::from_str::<List>(LIST).map_err(damaged)?.model;
    for entry in &mut all {
        let fits = |a: &&SystemArchive| a.system == std::env::consts::OS && a.architecture == std::env::consts::ARCH;
        if let Some(archive) = entry.archive.iter().find(fits) {
            entry.checkpoint = Some(archive.file.clone());
            entry.file = vec![archive.library.clone()];
        }
    }
    // An engine without an archive for this system cannot be installed.
    all.retain(|entry| entry.archive.is_empty() || entry.checkpoint.is_some());
    Ok(all)
}

/// Returns the model with this name.
pub fn entry(id: &str) -> Result<ModelEntry, InstallError> {
    entries()?.into_iter().find(|e| e.id == id).ok_or_else(|| InstallError::Unknown(id.to_owned()))
}

impl ModelEntry {
    /// Path of its description in `folder`.
    pub(crate) fn description_in(&self, folder: &Path) -> PathBuf {
        folder.join(&self.description)
    }

    /// Names of all its files, the description first.
    fn files(&self) -> Vec<&str> {
        std::iter::once(self.description.as_str()).chain(self.file.iter().map(|f| f.name.as_str())).collect()
    }

    /// Names of its files that are not in `folder`.
    fn missing_from(&self, folder: &Path) -> Vec<String> {
        let is_missing = |name: &&str| !folder.join(name).is_file();
        self.files().into_iter().filter(is_missing).map(str::to_owned).collect()
    }

    /// Approximate size, MB.
    pub fn megabytes(&self) -> u64 {
        self.file.iter().map(|f| f.megabytes).sum()
    }

    /// True if there is an address to fetch it from.
    pub(crate) fn is_hosted(&self) -> bool {
        self.url.is_some() || self.checkpoint.is_some()
    }

    /// Approximate size of the download, MB.
    pub(crate) fn download_megabytes(&self) -> u64 {
        self.checkpoint.as_ref().map_or_else(|| self.megabytes(), |c| c.megabytes)
    }

    /// Describes the source and the size of a model that is not installed.
    pub(crate) fn origin(&self) -> String {
        let (license, size) = (&self.license, crate::math::format::megabytes(self.megabytes()));
        match &self.checkpoint {
            Some(official) => format!(
                "From its makers ({}; {license}), made into {size} here. This address has not been tried yet.",
                official.url
            ),
            None if self.url.is_some() => String::new(),
            None => format!(
                "Its files are not hosted yet ({size}, {license}). tools/export creates them from the official \
                 checkpoint."
            ),
        }
    }

    /// Returns its state in `folder`. Compares sizes, not contents: see [`Self::verify`].
    pub fn state(&self, folder: &Path) -> ModelState {
        if self.built_in {
            return ModelState::BuiltIn;
        }
        let missing = self.missing_from(folder);
        if !missing.is_empty() {
            return ModelState::Missing(missing);
        }
        let sizes = manifest::graphs(&self.description_in(folder))
            .and_then(|graphs| graphs.iter().try_for_each(|graph| graph.check_size(folder)));
        match sizes {
            Ok(()) => ModelState::Here,
            Err(e) => ModelState::Broken(e.to_string()),
        }
    }

    /// Compares all its graphs in `folder` with their SHA-256.
    pub fn verify(&self, folder: &Path) -> Result<(), InstallError> {
        if self.built_in {
            return Ok(());
        }
        let graphs = manifest::graphs(&self.description_in(folder))?;
        for graph in graphs {
            graph.check(folder)?;
        }
        for file in &self.file {
            if let Some(sha256) = &file.sha256 {
                fetch::check(&folder.join(&file.name), sha256)?;
            }
        }
        Ok(())
    }

    /// Fetches missing files into `folder`, from its address or from the folder address `from`, and checks them.
    /// `progress` receives the file, the bytes so far and the total, and returns false to cancel.
    pub(super) fn fetch_files(
        &self,
        folder: &Path,
        from: Option<&str>,
        timeouts: Timeouts,
        progress: &mut dyn FnMut(&str, u64, Option<u64>) -> bool,
    ) -> Result<(), InstallError> {
        if self.built_in {
            return Err(InstallError::BuiltIn(self.id.clone()));
        }
        let base = from.or(self.url.as_deref()).ok_or_else(|| InstallError::NoAddress {
            id: self.id.clone(),
            source_page: self.source.clone(),
            export: self.export.clone(),
        })?;
        let address = |name: &str| format!("{}/{name}", base.trim_end_matches('/'));
        let mut get = |name: &str, bytes: Option<u64>, sha256: Option<&str>| {
            let to = folder.join(name);
            let most = fetch::MOST_UNPROMISED;
            let wanted = FileToFetch { url: &address(name), to: &to, bytes, most, sha256 };
            fetch::fetch(&wanted, timeouts, &mut |there, all| progress(name, there, all))
        };
        // The description fixes the graphs' checksums, so it is fetched first.
        let description = self.description_in(folder);
        if manifest::graphs(&description).is_err() {
            get(&self.description, None, None)?;
        }
        for graph in manifest::graphs(&description)? {
            if graph.check(folder).is_err() {
                get(&graph.file, Some(graph.bytes), Some(&graph.sha256))?;
            }
        }
        self.verify(folder)
    }

    /// Copies its files from a folder of the user. They are checked there before anything is changed.
    pub fn add(&self, folder: &Path, brought: &Path) -> Result<(), InstallError> {
        if self.built_in {
            return Err(InstallError::BuiltIn(self.id.clone()));
        }
        let missing = self.missing_from(brought);
        if !missing.is_empty() {
            let (id, export) = (self.id.clone(), &self.export);
            let remedy = match self.is_hosted() {
                true => format!("get it with 'fmlgs models fetch {id}', or give its official checkpoint instead"),
                false => format!("make it of the official checkpoint: python tools/export/{export} --out FOLDER"),
            };
            return Err(InstallError::Incomplete { id, folder: brought.into(), missing: missing.join(", "), remedy });
        }
        self.verify(brought)?;
        let failed = |path: &Path, source| FetchError::File { path: path.into(), source };
        fs::create_dir_all(folder).map_err(|e| failed(folder, e))?;
        let graphs = manifest::graphs(&self.description_in(brought))?;
        // The description last: without it, the model counts as missing.
        let names = graphs.iter().map(|g| g.file.as_str()).chain([self.description.as_str()]);
        for name in names {
            let (from, to) = (brought.join(name), folder.join(name));
            let part = folder.join(format!("{name}.part"));
            let copied =
                files::copy(&from, &part, failed).and_then(|()| fs::rename(&part, &to).map_err(|e| failed(&to, e)));
            copied.inspect_err(|_| drop(fs::remove_file(&part)))?;
        }
        self.verify(folder)
    }
}

/// Returns the description of an installed model by its name, or of an unlisted one by the path of its description.
pub(crate) fn find(name: &str, role: ModelRole) -> Result<PathBuf, ModelError> {
    let listed = entries()?.into_iter().find(|e| e.id == name && e.role == role && !e.built_in);
    if let Some(entry) = listed {
        let folder = folder();
        return match entry.state(&folder) {
            ModelState::Missing(_) => Err(ModelError::NotHere { id: entry.id }),
            ModelState::Broken(problem) => Err(ModelError::Metadata { path: entry.description_in(&folder), problem }),
            _ => Ok(entry.description_in(&folder)),
        };
    }
    let path = PathBuf::from(name);
    if path.extension().is_some_and(|e| e == "json") && path.is_file() {
        Ok(path)
    } else {
        Err(ModelError::Unknown(name.to_owned()))
    }
}

/// Names of the usable models of a role, best first; the built-in ones last. `on_warning` receives a warning for each
/// broken model.
pub(crate) fn usable(role: ModelRole, on_warning: &mut dyn FnMut(String)) -> Result<Vec<String>, ModelError> {
    Ok(usable_of(&entries()?, role, &folder(), on_warning))
}

fn usable_of(all: &[ModelEntry], role: ModelRole, folder: &Path, on_warning: &mut dyn FnMut(String)) -> Vec<String> {
    let (mut here, mut built_in) = (Vec::new(), Vec::new());
    for entry in all.iter().filter(|e| e.role == role) {
        match entry.state(folder) {
            ModelState::BuiltIn => built_in.push(entry.id.clone()),
            ModelState::Here => here.push(entry.id.clone()),
            ModelState::Missing(_) => {}
            ModelState::Broken(problem) => {
                let id = &entry.id;
                on_warning(format!(
                    "the model '{id}' is here but broken and is not used: {problem}; fetch or add it again"
                ));
            }
        }
    }
    here.append(&mut built_in);
    here
}

#[cfg(test)]
mod tests;
