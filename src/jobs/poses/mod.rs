//! Camera poses of photos that have none: COLMAP and GLOMAP, run as separate programs.

mod process;
#[cfg(test)]
mod tests;

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use super::{Folders, JobError, export};
use crate::io::error::write_error;
use crate::io::unposed::Unposed;
use crate::io::{colmap, photo};
use crate::pipeline::observer::Observer;

/// Programs that find camera poses.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct PoseTools {
    colmap: PathBuf,
    /// Maps in place of COLMAP, several times faster.
    glomap: Option<PathBuf>,
}

/// A command to run.
#[derive(Clone, Debug, PartialEq, Eq)]
struct PoseStage {
    /// Its task, for display.
    title: &'static str,
    program: PathBuf,
    args: Vec<String>,
}

impl PoseTools {
    /// Returns the installed tools. GLOMAP needs matches of COLMAP, so `None` without that.
    pub(crate) fn installed() -> Option<Self> {
        Self::on(&std::env::var_os("PATH").unwrap_or_default())
    }

    fn on(path: &OsStr) -> Option<Self> {
        let find = |name: &str| {
            let places = std::env::split_paths(path).filter(|p| p.is_absolute());
            let names =
                if cfg!(windows) { vec![format!("{name}.exe"), format!("{name}.bat")] } else { vec![name.into()] };
            places.flat_map(|p| names.iter().map(move |n| p.join(n)).collect::<Vec<_>>()).find(|p| p.is_file())
        };
        Some(Self { colmap: find("colmap")?, glomap: find("glomap") })
    }

    /// Their names, for display.
    pub(crate) fn name(&self) -> &'static str {
        if self.glomap.is_some() { "COLMAP and GLOMAP" } else { "COLMAP" }
    }

    /// Returns the commands that compute the poses of photos in `out/images` into `out/sparse`.
    fn stages(&self, out: &Path, one_camera: bool, gpu: &Gpu) -> Vec<PoseStage> {
        let at = |name: &str| out.join(name).to_string_lossy().into_owned();
        let args = |command: &str, pairs: &[(&str, String)]| {
            let options = pairs.iter().flat_map(|(name, value)| [format!("--{name}"), value.clone()]);
            std::iter::once(command.to_owned()).chain(options).collect::<Vec<_>>()
        };
        let [database, images] = [("database_path", at("database.db")), ("image_path", at("images"))];
        let mut extraction = vec![database.clone(), images.clone()];
        let mut matching = vec![database.clone()];
        if one_camera {
            extraction.push(("ImageReader.single_camera", "1".into()));
        }
        if let Gpu::Off(option) = gpu {
            extraction.push((option.0, "0".into()));
            matching.push((option.1, "0".into()));
        }
        let mapping = [database, images, ("output_path", at("sparse"))];
        let colmap = |title, args| PoseStage { title, program: self.colmap.clone(), args };
        let mapper = PoseStage {
            title: "Finding camera poses",
            program: self.glomap.clone().unwrap_or_else(|| self.colmap.clone()),
            args: args("mapper", &mapping),
        };
        vec![
            colmap("Finding features", args("feature_extractor", &extraction)),
            colmap("Matching photos", args("exhaustive_matcher", &matching)),
            mapper,
        ]
    }
}

/// Use of a GPU for features; COLMAP asks for one even in builds without.
enum Gpu {
    AsItIs,
    /// Options of extraction and matching that turn it off; their names depend on the version.
    Off((&'static str, &'static str)),
}

impl Gpu {
    /// Reads it from COLMAP's help texts.
    fn of(general: &str, extraction: &str) -> Self {
        match (general.contains("with CUDA"), extraction.contains("--FeatureExtraction.use_gpu")) {
            (true, _) => Self::AsItIs,
            (false, true) => Self::Off(("FeatureExtraction.use_gpu", "FeatureMatching.use_gpu")),
            (false, false) if !extraction.contains("--SiftExtraction.use_gpu") => Self::AsItIs,
            (false, false) => Self::Off(("SiftExtraction.use_gpu", "SiftMatching.use_gpu")),
        }
    }
}

/// Returns the commands for finding the poses by hand, and for opening the result.
pub(crate) fn commands(photos: &Unposed) -> Vec<String> {
    let out = if photos.images == photos.folder {
        let name = photos.folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        photos.folder.with_file_name(format!("{name}-posed"))
    } else {
        photos.folder.clone()
    };
    let tools = PoseTools { colmap: "colmap".into(), glomap: None };
    let quoted = |text: &str| {
        let plain = |c: char| c.is_alphanumeric() || "-_./,:+".contains(c);
        if !text.is_empty() && text.chars().all(plain) {
            text.to_owned()
        } else {
            format!("'{}'", text.replace('\'', "'\\''"))
        }
    };
    let at = |path: &Path| quoted(&path.to_string_lossy());
    let mut lines = vec![format!("mkdir -p {}", at(&out.join("sparse")))];
    if out.join("images") != photos.images {
        lines.push(format!("cp -r {} {}", at(&photos.images), at(&out.join("images"))));
    }
    lines.extend(tools.stages(&out, false, &Gpu::AsItIs).iter().map(|stage| {
        let words = std::iter::once("colmap".to_owned()).chain(stage.args.iter().map(|a| quoted(a)));
        words.collect::<Vec<_>>().join(" ")
    }));
    lines.push(format!("fmlgs train {}", at(&out)));
    lines
}

/// Finds the poses of photos with these tools, in their own folder; returns that. Earlier work there is reused.
///
/// # Errors
/// If a tool fails or finds nothing, or the observer asks to stop.
pub(crate) fn find(
    photos: &Unposed,
    tools: &PoseTools,
    folders: &Folders,
    observer: &mut dyn Observer,
) -> Result<PathBuf, JobError> {
    let out = folders.poses(&photos.folder);
    export::make_folder(&out.join("sparse"))?;
    export::make_folder(&out.join("images"))?;
    let mut sizes = Vec::new();
    for name in &photos.photos {
        let (from, to) = (photos.images.join(name), out.join("images").join(name));
        sizes.push(photo::size(&from)?);
        if !to.exists() {
            // A hard link on the same disk, so that nothing outside the folder is needed.
            fs::hard_link(&from, &to).or_else(|_| fs::copy(&from, &to).map(drop)).map_err(|e| write_error(&to, e))?;
        }
    }
    let one_camera = sizes.windows(2).all(|s| s[0] == s[1]);
    let help = |args: &[&str]| process::output(&tools.colmap, args);
    let gpu = Gpu::of(&help(&["help"]), &help(&["feature_extractor", "-h"]));
    for stage in tools.stages(&out, one_camera, &gpu) {
        process::run(&stage, photos.photos.len(), observer)?;
    }
    largest_first(&out.join("sparse"))?;
    if colmap::is_colmap(&out) { Ok(out) } else { Err(JobError::NoPosesFound(photos.folder.clone())) }
}

/// Makes the reconstruction of most photos `0`: photos without overlap become several reconstructions.
fn largest_first(sparse: &Path) -> Result<(), JobError> {
    let size = |folder: &Path| fs::metadata(folder.join("images.bin")).map_or(0, |m| m.len());
    let all = fs::read_dir(sparse).into_iter().flatten().flatten().map(|e| e.path()).filter(|p| p.is_dir());
    let (first, spare) = (sparse.join("0"), sparse.join("swapped"));
    let Some(largest) = all.max_by_key(|p| (size(p), *p == first)).filter(|p| *p != first && size(p) > 0) else {
        return Ok(());
    };
    let swap = || {
        if first.exists() {
            fs::rename(&first, &spare)?;
        }
        fs::rename(&largest, &first)?;
        if spare.exists() { fs::rename(&spare, &largest) } else { Ok(()) }
    };
    Ok(swap().map_err(|e| write_error(sparse, e))?)
}
