//! The networks that the program can use (`assets/models.toml`), and which of them are on this machine. They lie in one
//! folder: `FMLGS_MODELS`, else `models` in the user's data folder. Each model has a description (JSON) that holds the
//! SHA-256 of its graphs; a graph that differs is refused.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::fetch::{self, FetchError, FileToFetch, Patience};
use super::{KnownAnswer, ModelError, folder, manifest};
use crate::io::files;

const LIST: &str = include_str!("../../assets/models.toml");

/// Name of the model that follows masks.
pub(crate) const SAM2: &str = "sam2.1-tiny";

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum ModelRole {
    /// Compares pictures with phrases.
    Encoder,
    Segmenter,
    /// Paints what is missing of a picture.
    Inpainter,
    /// Runs networks.
    Engine,
}

/// A model of the list.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelEntry {
    /// Its name in commands.
    pub id: String,
    pub(crate) role: ModelRole,
    /// Its name for display.
    pub title: String,
    /// What it adds, in plain words.
    pub adds: String,
    /// License of its weights.
    #[serde(alias = "licence")]
    pub license: String,
    pub(crate) source: String,
    /// The command that makes its files, of those in `tools/export`.
    #[serde(default)]
    pub export: String,
    /// Whether it is part of the program.
    #[serde(default)]
    pub built_in: bool,
    /// Name of the file that describes it; empty if it is built in.
    #[serde(default)]
    pub description: String,
    /// Address of the folder with its files, where there is one.
    #[serde(default)]
    pub(crate) url: Option<String>,
    /// Its graphs.
    #[serde(default)]
    pub file: Vec<ListedFile>,
    /// The official file that it can be made of.
    #[serde(default)]
    pub checkpoint: Option<OfficialFile>,
    /// The same by system, for what is a program: that of this one becomes `checkpoint`.
    #[serde(default)]
    pub(crate) archive: Vec<SystemArchive>,
    /// How fast it is without a GPU.
    #[serde(default)]
    pub speed: String,
    /// What it is known to answer with the official weights.
    #[serde(default)]
    pub(crate) known: Option<KnownAnswer>,
    /// Whether it is what to begin with, of those with its role.
    #[serde(default)]
    pub(crate) recommended: bool,
    /// How long a segmenter looks for everything in a photo, an encoder at one picture of an object.
    pub(crate) photo_seconds: Option<PhotoSeconds>,
    /// How long one that follows masks looks at a frame with ONNX Runtime, and follows one mask into it.
    pub(crate) track_seconds: Option<[f64; 2]>,
}

/// Seconds on two cores, measured.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PhotoSeconds {
    /// With ONNX Runtime.
    pub(crate) onnx_runtime: f64,
    /// With the engine that is built in.
    pub(crate) built_in: Option<f64>,
    /// With ONNX Runtime, for each object in the photo besides: its own tile is searched for parts.
    pub(crate) each_object: Option<f64>,
}

/// An archive with a program for one kind of machine.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct SystemArchive {
    /// As Rust names it.
    system: String,
    architecture: String,
    /// What is taken out of it.
    library: ListedFile,
    file: OfficialFile,
}

/// A file with the weights of a model, as its makers publish it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OfficialFile {
    /// Its address.
    pub url: String,
    /// About how large it is, MB.
    pub megabytes: u64,
    /// Its checksum, if its makers publish one.
    #[serde(default)]
    pub sha256: Option<String>,
}

/// A graph of a listed model.
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

/// Whether a model can be used.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ModelState {
    /// Part of the program.
    BuiltIn,
    /// All files are here.
    Here,
    /// These files are not.
    Missing(Vec<String>),
    /// Something is wrong with a file.
    Broken(String),
}

impl ModelState {
    pub(crate) fn is_usable(&self) -> bool {
        matches!(self, Self::BuiltIn | Self::Here)
    }
}

/// Why a model could not be put in place.
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

/// All models of the list, in its order.
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
    // A program without an archive for this machine is nothing that could be had.
    all.retain(|entry| entry.archive.is_empty() || entry.checkpoint.is_some());
    Ok(all)
}

/// The model with this name.
pub fn entry(id: &str) -> Result<ModelEntry, InstallError> {
    entries()?.into_iter().find(|e| e.id == id).ok_or_else(|| InstallError::Unknown(id.to_owned()))
}

impl ModelEntry {
    /// The file that describes it, if it were in `folder`.
    pub(crate) fn description_in(&self, folder: &Path) -> PathBuf {
        folder.join(&self.description)
    }

    /// Names of all its files: the description first.
    fn files(&self) -> Vec<&str> {
        std::iter::once(self.description.as_str()).chain(self.file.iter().map(|f| f.name.as_str())).collect()
    }

    /// Names of its files that are not in `folder`.
    fn missing_from(&self, folder: &Path) -> Vec<String> {
        let is_missing = |name: &&str| !folder.join(name).is_file();
        self.files().into_iter().filter(is_missing).map(str::to_owned).collect()
    }

    /// About how large it is, MB.
    pub fn megabytes(&self) -> u64 {
        self.file.iter().map(|f| f.megabytes).sum()
    }

    /// Whether there is an address that it can be fetched from.
    pub(crate) fn is_hosted(&self) -> bool {
        self.url.is_some() || self.checkpoint.is_some()
    }

    /// About how much is fetched, MB.
    pub(crate) fn download_megabytes(&self) -> u64 {
        self.checkpoint.as_ref().map_or_else(|| self.megabytes(), |c| c.megabytes)
    }

    /// Where it comes from and what it becomes, of one that is not here.
    pub(crate) fn origin(&self) -> String {
        let (license, megabytes) = (&self.license, self.megabytes());
        match &self.checkpoint {
            Some(official) => format!(
                "From its makers ({}; {license}), made into {megabytes} MB here. This address has not been tried yet.",
                official.url
            ),
            None if self.url.is_some() => String::new(),
            None => format!(
                "Its files are not hosted yet ({megabytes} MB, {license}). tools/export creates them from the official \
                 checkpoint."
            ),
        }
    }

    /// Whether it can be used from `folder`. Sizes are compared, contents are not: see
    /// [`Self::verify`].
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

    /// Fetches what is not here yet from its address, or from that of another `from` folder, into
    /// `folder`, and checks it. `progress` is told the file, its bytes that are there and those that
    /// there will be, and says whether to go on.
    pub(super) fn fetch_files(
        &self,
        folder: &Path,
        from: Option<&str>,
        patience: Patience,
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
            fetch::fetch(&wanted, patience, &mut |there, all| progress(name, there, all))
        };
        // The description says what the graphs must be; fetched anew, it is that of these graphs.
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

    /// Takes over its files from a folder that somebody brings. They are checked there before
    /// anything here changes.
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
        // The description last: without it, the model is not here.
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

/// The description of a model that is here, by its name in the list; of any other, by the path of
/// its description.
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

/// Names of the models of a role that can be used now, best first; the built-in ones last. `told` hears of
/// each that is here and cannot be used.
pub(crate) fn usable(role: ModelRole, told: &mut dyn FnMut(String)) -> Result<Vec<String>, ModelError> {
    Ok(usable_of(&entries()?, role, &folder(), told))
}

fn usable_of(all: &[ModelEntry], role: ModelRole, folder: &Path, told: &mut dyn FnMut(String)) -> Vec<String> {
    let (mut here, mut built_in) = (Vec::new(), Vec::new());
    for entry in all.iter().filter(|e| e.role == role) {
        match entry.state(folder) {
            ModelState::BuiltIn => built_in.push(entry.id.clone()),
            ModelState::Here => here.push(entry.id.clone()),
            ModelState::Missing(_) => {}
            ModelState::Broken(problem) => {
                let id = &entry.id;
                told(format!("the model '{id}' is here but broken and is not used: {problem}; fetch or add it again"));
            }
        }
    }
    here.append(&mut built_in);
    here
}

#[cfg(test)]
mod tests;
