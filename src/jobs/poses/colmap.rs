//! COLMAP as a program, with two mappers: an incremental one, and a global one (its own since version 4, else GLOMAP).

use std::path::{Path, PathBuf};

use super::maker::{MakerKind, MakerPlaces, PoseMaker};
use super::process::{self, PoseStage};
use super::{DATABASE, ENOUGH, IMAGES, MakerStep, PoseWork, SNAPSHOTS, SPARSE, findings::registered};
use crate::jobs::{JobError, export};
use crate::pipeline::observer::Observer;

/// Way to map with the incremental mapper: its command, and whether GLOMAP runs it.
const INCREMENTAL: (&str, bool) = ("mapper", false);
/// Option for the folder of its snapshots.
const SNAPSHOT_PATH: &str = "Mapper.snapshot_path";

/// Programs of COLMAP.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Colmap {
    pub(super) colmap: PathBuf,
    /// Maps in place of an older COLMAP, several times faster.
    pub(super) glomap: Option<PathBuf>,
}

/// Use of a GPU for features; COLMAP asks for one even in builds without.
pub(super) enum Gpu {
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

impl Colmap {
    /// Finds it; GLOMAP needs its matches, so `None` without it.
    pub(super) fn at(places: &MakerPlaces) -> Option<Self> {
        Some(Self { colmap: places.program("colmap")?, glomap: places.program("glomap") })
    }

    fn stage(&self, step: MakerStep, args: Vec<String>) -> PoseStage {
        PoseStage::new(step.title(), self.colmap.clone(), args)
    }

    /// Command that finds features, or matches them.
    pub(super) fn features(&self, step: MakerStep, work: &PoseWork<'_>, gpu: &Gpu) -> PoseStage {
        let is_extraction = step == MakerStep::Features;
        let mut options = vec![("database_path", text(&work.at(DATABASE)))];
        if is_extraction {
            options.push(("image_path", text(&work.at(IMAGES))));
            if work.one_camera {
                options.push(("ImageReader.single_camera", "1".into()));
            }
        } else if work.is_sequential() {
            options.push(("SequentialMatching.overlap", "15".into()));
        }
        if let Gpu::Off((extraction, matching)) = gpu {
            options.push((if is_extraction { *extraction } else { *matching }, "0".into()));
        }
        let command = match (is_extraction, work.is_sequential()) {
            (true, _) => "feature_extractor",
            (false, true) => "sequential_matcher",
            (false, false) => "exhaustive_matcher",
        };
        self.stage(step, args(command, &options))
    }

    /// Command that finds poses, with this command of COLMAP, or with GLOMAP.
    pub(super) fn mapping(&self, command: &str, with_glomap: bool, work: &PoseWork<'_>, sparse: &Path) -> PoseStage {
        let options = [
            ("database_path", text(&work.at(DATABASE))),
            ("image_path", text(&work.at(IMAGES))),
            ("output_path", text(sparse)),
        ];
        let mut stage = self.stage(MakerStep::Mapping, args(command, &options));
        if let Some(glomap) = self.glomap.as_ref().filter(|_| with_glomap) {
            stage.program.clone_from(glomap);
        }
        stage
    }

    /// Lets COLMAP's incremental mapper write snapshots, if this version does.
    fn add_snapshots(&self, stage: &mut PoseStage, work: &PoseWork<'_>) -> Result<(), JobError> {
        let Some(frequency) = snapshot_frequency(&process::output(&self.colmap, &["mapper", "-h"])) else {
            return Ok(());
        };
        let folder = work.at(SNAPSHOTS);
        export::make_folder(&folder)?;
        let pairs = [(SNAPSHOT_PATH, text(&folder)), (frequency, work.photos_per_snapshot().to_string())];
        stage.args.extend(options(&pairs));
        stage.snapshots = Some(folder);
        Ok(())
    }

    /// Ways to map, the better one for these photos first.
    fn ways(&self, general: &str, work: &PoseWork<'_>) -> Vec<(&'static str, bool)> {
        let has_global = general.split_whitespace().any(|word| word == "global_mapper");
        let global =
            if has_global { Some(("global_mapper", false)) } else { self.glomap.as_ref().map(|_| ("mapper", true)) };
        let mut ways: Vec<_> = std::iter::once(INCREMENTAL).chain(global).collect();
        if work.maps_globally() {
            ways.reverse();
        }
        ways
    }

    /// Maps one way, and another way too if few photos got a pose; the result of most photos stays.
    fn map(&self, general: &str, work: &PoseWork<'_>, observer: &mut dyn Observer) -> Result<(), JobError> {
        let (enough, beside) = (ENOUGH * work.photos.len() as f64, work.sparse.with_extension("second"));
        let mut failed = None;
        for (command, with_glomap) in self.ways(general, work) {
            super::remove(&beside)?;
            export::make_folder(&beside)?;
            let mut stage = self.mapping(command, with_glomap, work, &beside);
            if observer.wants_poses() && (command, with_glomap) == INCREMENTAL {
                self.add_snapshots(&mut stage, work)?;
            }
            match process::run(&stage, work.photos.len(), observer) {
                Err(e) if e.is_cancelled() => return Err(e),
                Err(e) => failed = failed.or(Some(e)),
                Ok(()) if registered(&beside) > registered(&work.sparse) => {
                    super::remove(&work.sparse)?;
                    std::fs::rename(&beside, &work.sparse)
                        .map_err(|e| crate::io::error::write_error(&work.sparse, e))?;
                }
                Ok(()) => {}
            }
            if registered(&work.sparse) as f64 >= enough {
                break;
            }
        }
        super::remove(&beside)?;
        failed.filter(|_| registered(&work.sparse) == 0).map_or(Ok(()), Err)
    }
}

impl PoseMaker for Colmap {
    fn kind(&self) -> MakerKind {
        MakerKind::Colmap
    }

    fn name(&self) -> String {
        if self.glomap.is_some() { "COLMAP and GLOMAP" } else { "COLMAP" }.into()
    }

    fn run(&self, step: MakerStep, work: &PoseWork<'_>, observer: &mut dyn Observer) -> Result<(), JobError> {
        let help = |args: &[&str]| process::output(&self.colmap, args);
        let general = help(&["help"]);
        match step {
            MakerStep::Mapping => self.map(&general, work, observer),
            _ => {
                let gpu = Gpu::of(&general, &help(&["feature_extractor", "-h"]));
                process::run(&self.features(step, work, &gpu), work.photos.len(), observer)
            }
        }
    }
}

/// Commands for finding the poses of photos in `out/images` by hand, as words.
pub(super) fn by_hand(out: &Path) -> Vec<Vec<String>> {
    let tools = Colmap { colmap: "colmap".into(), glomap: None };
    let sparse = out.join(SPARSE);
    let work = PoseWork { out, photos: &[], one_camera: false, is_video: false, sparse: sparse.clone() };
    let gpu = Gpu::AsItIs;
    let stages = [
        tools.features(MakerStep::Features, &work, &gpu),
        tools.features(MakerStep::Matches, &work, &gpu),
        tools.mapping("mapper", false, &work, &sparse),
    ];
    stages.into_iter().map(|stage| std::iter::once("colmap".to_owned()).chain(stage.args).collect()).collect()
}

fn text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

fn args(command: &str, pairs: &[(&str, String)]) -> Vec<String> {
    std::iter::once(command.to_owned()).chain(options(pairs)).collect()
}

fn options(pairs: &[(&str, String)]) -> impl Iterator<Item = String> {
    pairs.iter().flat_map(|(name, value)| [format!("--{name}"), value.clone()])
}

/// Option for the number of photos between two snapshots, by the mapper's help text; its name depends on the version.
fn snapshot_frequency(help: &str) -> Option<&'static str> {
    let has = |name: &str| help.contains(&format!("--{name}"));
    let names = ["Mapper.snapshot_frames_freq", "Mapper.snapshot_images_freq"];
    names.into_iter().find(|name| has(name)).filter(|_| has(SNAPSHOT_PATH))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_photos_are_mapped_globally_first() {
        let ways = |photos: usize, general: &str, glomap: Option<&str>| {
            let tools = Colmap { colmap: "colmap".into(), glomap: glomap.map(Into::into) };
            let (names, sparse) = (vec![String::new(); photos], PathBuf::new());
            let work = PoseWork { out: Path::new(""), photos: &names, one_camera: false, is_video: false, sparse };
            tools.ways(general, &work)
        };
        let [one_by_one, globally, glomap] = [INCREMENTAL, ("global_mapper", false), ("mapper", true)];
        assert_eq!(ways(150, "global_mapper", None), [one_by_one, globally]);
        assert_eq!(ways(151, "global_mapper", Some("glomap")), [globally, one_by_one]);
        assert_eq!(ways(151, "", Some("glomap")), [glomap, one_by_one]);
        assert_eq!(ways(151, "", None), [one_by_one]);
    }

    #[test]
    fn snapshots_are_asked_for_by_the_name_of_the_version_or_not_at_all() {
        let [path, new, old] = [
            "--Mapper.snapshot_path arg",
            "--Mapper.snapshot_frames_freq arg (=0)",
            "--Mapper.snapshot_images_freq arg",
        ];
        assert_eq!(snapshot_frequency(&format!("{path}\n  {new}")), Some("Mapper.snapshot_frames_freq"));
        assert_eq!(snapshot_frequency(&format!("{old}\n  {path}")), Some("Mapper.snapshot_images_freq"));
        for help in ["", path, new, old, "--Mapper.fix_existing_frames arg (=0)"] {
            assert_eq!(snapshot_frequency(help), None, "{help}");
        }
    }
}
