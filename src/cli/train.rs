//! `fmlgs train`: from posed photos to a trained scene.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use serde_json::json;

use super::plan::PlanArgs;
use super::progress::Console;
use super::serve::{AccessArgs, announce};
use super::{CliError, interrupt, number, output};
use crate::io::OpenError;
use crate::io::scene_files::CHECKPOINT_FILE;
use crate::io::unposed::Unposed;
use crate::jobs::open::{self, Contents};
use crate::jobs::poses::front_door::{self, PoseRequest};
use crate::jobs::presets;
use crate::jobs::train::{IfChanged, TrainStart, Trained};
use crate::jobs::{Folders, JobError, held_out, plan, train};
use crate::pipeline::observer::{Observer, Severity};
use crate::pipeline::train::checkpoint::CheckpointError;
use crate::pipeline::train::{TrainConfig, TrainError};
use crate::remote::{Server, bind_address, serve};
use crate::render::BackendChoice;
use crate::scene::{AlphaUse, Dataset};

/// Train 3D Gaussians from posed photos
///
/// Writes a trained scene: a folder with scene.json, point_cloud.ply and a checkpoint. The same
/// command run again resumes where it stopped, also after a crash; at most the checkpoint interval
/// is lost. Every eighth photo is held out and used to measure quality.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs train photos/ --out scene/\n  \
    fmlgs train walk.mp4 --out scene/        a video: photos, poses and training in one\n  \
    fmlgs train photos/ --out scene/ --steps 30000 --max-side 1600\n  \
    fmlgs train photos/ --out quick/ --steps 500 --max-side 256 --no-densify\n  \
    fmlgs train phone/ --out scene/ --refine-poses --exposure\n  \
    fmlgs train photos/ --serve              watch from another computer, see fmlgs connect\n  \
    fmlgs train other/ --preset scene/training.toml\n  \
    fmlgs train scene/                       resume a scene that was canceled, same settings")]
pub(crate) struct TrainArgs {
    /// Dataset folder or transforms.json; photos without poses or a video, whose poses are found first; or a trained
    /// scene, to resume it
    data: PathBuf,
    /// Folder of the trained scene [default: out/NAME, the name of the dataset; out/NAME-2 and so on where that
    /// was trained with other settings]
    #[arg(long)]
    out: Option<PathBuf>,
    #[command(flatten)]
    settings: TrainOverrides,
    /// Go on with a training that began with other photos, poses or sparse points; without it the change is named, and
    /// another training begun, or nothing done where --out names the folder
    #[arg(long)]
    anyway: bool,
    /// Go on where a training with the same settings and fewer --steps ended, instead of beginning another one
    #[arg(long, requires = "steps")]
    go_on: bool,
    /// Settings to start from, a TOML file as every trained scene has one ("training.toml"); others given here
    /// go before
    #[arg(long, value_name = "TOML")]
    preset: Option<PathBuf>,
    #[command(flatten)]
    plan: PlanArgs,
    /// Show the training to a window on another computer ('fmlgs connect'), listening at this address or port
    /// [default: 127.0.0.1:7070]
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = "127.0.0.1:7070",
        value_parser = bind_address)]
    serve: Option<SocketAddr>,
    #[command(flatten)]
    access: AccessArgs,
    /// Print one JSON document at the end
    #[arg(long)]
    json: bool,
}

/// Settings of a run as given; those left out keep their defaults.
#[derive(Debug, Default, clap::Args)]
pub(crate) struct TrainOverrides {
    /// Optimizer steps in all; every schedule scales with it [default: 7000]
    #[arg(long, value_parser = number::within(1..=1_000_000_000_u64))]
    pub(crate) steps: Option<u64>,
    /// Longer side of the training images in px; photos are never enlarged [default: 512]
    #[arg(long, value_parser = clap::value_parser!(u32).range(16..=16384))]
    pub(crate) max_side: Option<u32>,
    /// Hold out every n-th photo, 0 = none [default: 8]
    #[arg(long, value_parser = number::within(0..=1_000_000_usize))]
    pub(crate) held_out_every: Option<usize>,
    /// Highest degree of the spherical harmonics [default: 3]
    #[arg(long, value_parser = clap::value_parser!(u8).range(0..=3))]
    pub(crate) sh_degree: Option<u8>,
    /// Open all bands of color from the first step on
    #[arg(long)]
    pub(crate) sh_at_once: bool,
    /// Share of the steps, from the first on, that see the photos at half their size [default: 0]
    #[arg(long, value_parser = number::within(0.0..=1.0))]
    pub(crate) coarse_share: Option<f64>,
    /// Keep the number of Gaussians that training starts with
    #[arg(long)]
    pub(crate) no_densify: bool,
    /// Upper limit of Gaussians [default: one for each pixel of a photo up to
    /// 100,000, one for two beyond, if the memory holds them]
    #[arg(long, value_parser = number::within(1..=100_000_000_usize))]
    pub(crate) max_gaussians: Option<usize>,
    /// Gaussians to start from where the dataset has no sparse points [default: 20000]
    #[arg(long, value_parser = number::within(1..=10_000_000_usize))]
    pub(crate) random_points: Option<usize>,
    /// Meaning of transparent pixels of the photos [default: by the photos, see 'fmlgs info']
    #[arg(long, value_enum)]
    pub(crate) alpha: Option<AlphaUse>,
    /// Train with the 2-D filter of Mip-Splatting, as new trainings are, where the scene or the preset says otherwise
    #[arg(long, conflicts_with = "no_antialias")]
    pub(crate) antialias: bool,
    /// Train without that filter, for viewers that do not know it
    #[arg(long)]
    pub(crate) no_antialias: bool,
    /// Seed of every random choice [default: 0]
    #[arg(long)]
    pub(crate) seed: Option<u64>,
    /// Steps between held-out evaluations, 0 = only at the end [default: 500]
    #[arg(long)]
    pub(crate) eval_every: Option<u64>,
    /// Seconds between checkpoints, 0 = only at the end [default: 60]
    #[arg(long, value_parser = number::within(0.0..=1e9))]
    pub(crate) checkpoint_secs: Option<f64>,
    /// Renderer that trains [default: auto]
    #[arg(long, value_enum)]
    pub(crate) backend: Option<BackendChoice>,
    /// Train surfels, flat disks that lie on surfaces (2D Gaussian Splatting), for better depth;
    /// on the CPU only. A GPU or another viewer draws them as flat Gaussians
    #[arg(long)]
    pub(crate) surfels: bool,
    /// Weight of the term that holds normals and depth together; on the CPU only [default: 0, with
    /// --surfels 0.05]
    #[arg(long, value_parser = number::within(0.0..=1e6))]
    pub(crate) normal_weight: Option<f64>,
    /// Weight of the term that pulls surfels together along rays [default: 0.1]
    #[arg(long, value_parser = number::within(0.0..=1e6), requires = "surfels")]
    pub(crate) distortion_weight: Option<f64>,
    /// Refine the poses of the training photos while training, and tell how far they moved: for poses that are a
    /// little off (about 1 % of the scene's radius, half a degree), as those of phones and of video are. The given
    /// poses stay in their file; on the CPU only
    #[arg(long)]
    pub(crate) refine_poses: bool,
    /// Learn a gain and bias by channel for every training photo: for photos that differ in brightness or white
    /// balance; on the CPU only
    #[arg(long)]
    pub(crate) exposure: bool,
}

impl TrainOverrides {
    /// `base` with what was given on the command line.
    pub(crate) fn over(&self, base: TrainConfig) -> TrainConfig {
        TrainConfig {
            steps: self.steps.unwrap_or(base.steps),
            max_side_px: self.max_side.unwrap_or(base.max_side_px),
            holdout_every: self.held_out_every.unwrap_or(base.holdout_every),
            sh_degree: self.sh_degree.unwrap_or(base.sh_degree),
            sh_at_once: base.sh_at_once || self.sh_at_once,
            coarse_share: self.coarse_share.unwrap_or(base.coarse_share),
            densify: base.densify && !self.no_densify,
            max_gaussians: self.max_gaussians.or(base.max_gaussians),
            random_points: self.random_points.unwrap_or(base.random_points),
            alpha: self.alpha.or(base.alpha),
            antialias: (base.antialias || self.antialias) && !self.no_antialias,
            seed: self.seed.unwrap_or(base.seed),
            eval_every: self.eval_every.unwrap_or(base.eval_every),
            checkpoint_secs: self.checkpoint_secs.unwrap_or(base.checkpoint_secs),
            backend: self.backend.unwrap_or(base.backend),
            surfels: base.surfels || self.surfels,
            normal_weight: self.normal_weight.or(base.normal_weight),
            distortion_weight: self.distortion_weight.or(base.distortion_weight),
            refine_poses: base.refine_poses || self.refine_poses,
            exposure: base.exposure || self.exposure,
        }
    }
}

impl TrainArgs {
    /// Returns the photos, the settings and the folders to try: the given one, or the usual ones in order, of which the
    /// first without a training with other settings is taken.
    fn check(&self, console: &mut Console) -> Result<(Dataset, TrainConfig, Vec<PathBuf>), CliError> {
        let contents = match open::contents(&self.data, None) {
            Err(JobError::Open(OpenError::NoPoses(photos))) => Contents::Photos(posed(*photos, console)?),
            contents => contents?,
        };
        let (dataset, base, own) = match contents {
            Contents::Photos(dataset) => (dataset, TrainConfig::default(), None),
            Contents::Scene(scene) if scene.folder.is_some() => {
                let Some(photos) = &scene.dataset_path else {
                    return Err(CliError::failed(format!(
                        "{}: its photos are no longer where they were; give their folder instead of the scene",
                        self.data.display()
                    )));
                };
                (open::dataset(photos)?, scene.config, scene.folder)
            }
            Contents::Scene(_) => {
                return Err(CliError::failed(format!(
                    "{} is a finished splat without photos; a folder of posed photos is needed to train",
                    self.data.display()
                )));
            }
        };
        if self.settings.held_out_every.is_some() {
            held_out::refuse_holdout(&dataset)?;
        }
        if self.settings.random_points.is_some() && !dataset.points.is_empty() {
            let (data, points) = (self.data.display(), dataset.points.len());
            return Err(CliError::Usage(format!(
                "--random-points has no effect here: {data} has {points} sparse points to start from"
            )));
        }
        let base = self.preset.as_deref().map(presets::read).transpose()?.unwrap_or(base);
        let config = plan::planned(&dataset, self.settings.over(base), &self.plan.overrides());
        let mut folders = match self.out.clone().or(own) {
            Some(out) => vec![out],
            None => usual_folders(&PathBuf::from("out").join(&dataset.name)),
        };
        if self.go_on {
            folders.retain(|folder| folder.join(CHECKPOINT_FILE).is_file());
            if folders.is_empty() {
                return Err(CliError::failed("--go-on: there is no training yet that could go on"));
            }
        }
        Ok((dataset, config, folders))
    }
}

/// Photos of which the poses are found first, or were found before.
fn posed(photos: Unposed, console: &mut Console) -> Result<Dataset, CliError> {
    let name = front_door::name_of(&photos);
    let request = PoseRequest { photos, ..PoseRequest::default() };
    let found = front_door::find_here(&request, &Folders::of_user(), console)?;
    found.tell(console);
    Ok(Dataset { name, ..open::dataset(&found.out)? })
}

/// Folders `first`, `first-2` and so on that exist, and the next one.
fn usual_folders(first: &Path) -> Vec<PathBuf> {
    let folder = |n: usize| if n == 1 { first.to_owned() } else { PathBuf::from(format!("{}-{n}", first.display())) };
    let there = (1..).take_while(|n| folder(*n).exists()).count();
    (1..=there + 1).map(folder).collect()
}

pub(crate) fn run(args: TrainArgs, quiet: bool) -> Result<(), CliError> {
    let mut console = Console::new(quiet);
    let (dataset, config, folders) = args.check(&mut console)?;
    let changed = if args.anyway { IfChanged::GoOn } else { IfChanged::Anew };
    for warning in &dataset.warnings {
        console.note(Severity::Warning, warning.clone());
    }
    let from = TrainStart { more_steps: args.go_on, objects_of: None, if_changed: changed };
    let server = match args.serve {
        Some(bind) => Some(serve::training(&dataset, &config, args.access.options(bind, false)?)?),
        None => None,
    };
    let done = match &server {
        Some(server) => {
            announce(server, quiet, args.access.has_new_token());
            served(server, (&dataset, &config), folders, &from, &mut console)
        }
        None => train::run(&dataset, &config, folders, &from, &mut console),
    };
    let done = done.map_err(|e| with_remedy(e, &args));
    let farewell = || {
        let Some(server) = &server else { return };
        if !quiet && server.watchers().1 > 0 {
            output::note("Whoever watches is sent the result ...");
        }
        // Where it was canceled from here, another signal ends the program at once.
        let canceled = interrupt::asked_to_stop();
        server.see_off(|| !canceled && interrupt::asked_to_stop());
    };
    let done = done.inspect_err(|_| farewell())?;
    let (outcome, finished) = (&done.outcome, done.is_finished());
    let out = done.out.display();
    if args.json {
        output::print_json(&json!({
            "end": if finished { "finished" } else { "cancelled" },
            "out": done.out,
            "config": config,
            "steps": outcome.steps,
            "secs": outcome.secs,
            "gaussians": outcome.cloud.len(),
            "evaluations": outcome.evaluations,
        }))?;
    } else if finished {
        if let Some(last) = outcome.evaluations.last() {
            output::print(&last.line())?;
        }
        output::print(&format!("trained scene: {out} (look at it with 'fmlgs {out}')"))?;
    }
    farewell();
    if finished {
        return Ok(());
    }
    let (steps, all) = (outcome.steps, config.steps);
    Err(CliError::Cancelled(format!("{steps} of {all} steps are saved in {out}; the same command resumes from there")))
}

/// The error of a training, with what can be done about other photos here.
fn with_remedy(error: JobError, args: &TrainArgs) -> CliError {
    match error {
        JobError::Train(TrainError::Checkpoint(e @ CheckpointError::OtherInputs { .. })) => {
            let anew = if args.out.is_some() { "another --out" } else { "--out" };
            CliError::Usage(format!("{e}. Train anew in another folder ({anew}), or go on with --anyway"))
        }
        other => other.into(),
    }
}

/// Trains while others watch.
fn served(
    server: &Server,
    (dataset, config): (&Dataset, &TrainConfig),
    folders: Vec<PathBuf>,
    from: &TrainStart,
    console: &mut Console,
) -> Result<Trained, JobError> {
    let mut observer = server.observe(console);
    let done = train::run(dataset, config, folders, from, &mut observer);
    match &done {
        Ok(done) => {
            if let Err(e) = server.finished(&done.out, done.is_finished()) {
                output::warn(format!("Whoever watches does not get the result: {e}"));
            }
        }
        Err(e) => server.failed(e.to_string()),
    }
    done
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_given_keeps_its_value() {
        let base = TrainConfig { steps: 3, seed: 9, densify: false, ..TrainConfig::default() };
        assert_eq!(TrainOverrides::default().over(base.clone()), base);
        let given =
            TrainOverrides { steps: Some(5), no_densify: true, no_antialias: true, ..TrainOverrides::default() };
        let config = given.over(TrainConfig::default());
        assert_eq!((config.steps, config.densify, config.antialias), (5, false, false));
    }

    #[test]
    fn the_help_states_the_real_defaults() {
        let d = TrainConfig::default();
        let command = <TrainOverrides as clap::Args>::augment_args(clap::Command::new("x"));
        let stated = |id: &str| {
            let argument = command.get_arguments().find(|a| a.get_id() == id).expect("argument");
            let help = argument.get_help().expect("help").to_string();
            help.split("[default: ").nth(1).expect("default").trim_end_matches(']').to_owned()
        };
        assert_eq!(stated("steps"), d.steps.to_string());
        assert_eq!(stated("max_side"), d.max_side_px.to_string());
        assert_eq!(stated("held_out_every"), d.holdout_every.to_string());
        assert_eq!(stated("sh_degree"), d.sh_degree.to_string());
        assert_eq!(stated("random_points"), d.random_points.to_string());
        assert_eq!(stated("seed"), d.seed.to_string());
        assert_eq!(stated("eval_every"), d.eval_every.to_string());
        assert_eq!(stated("checkpoint_secs"), d.checkpoint_secs.to_string());
    }

    #[test]
    fn a_training_with_other_settings_gets_a_folder_of_its_own() {
        let folder = tempfile::tempdir().expect("folder");
        let first = folder.path().join("fox");
        let second = PathBuf::from(format!("{}-2", first.display()));
        assert_eq!(usual_folders(&first), std::slice::from_ref(&first));
        std::fs::create_dir(&first).expect("create");
        assert_eq!(usual_folders(&first), [first, second]);
    }
}
