//! `fmlgs eval`: PSNR and SSIM on held-out photos, with pictures side by side.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::progress::Console;
use super::recipe::RecipeArgs;
use super::scene_args::open_scene;
use super::{CliError, eval_depth, eval_language, eval_masks, eval_removal, eval_results, number, output, table_args};
use crate::io::results::ResultOptions;
use crate::jobs::batch::BatchEvaluation;
use crate::jobs::compare::protocol::ResultEvaluation;
use crate::jobs::compare::subject::CompareSubject;
use crate::jobs::compare::views::WantedViews;
use crate::jobs::evaluate::{self, EvaluateOptions, PhotoComparison};
use crate::jobs::evaluate_masks::Protocol;
use crate::jobs::export;
use crate::pipeline::observer::{Evaluation, ViewScore};
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::scene::FittedParts;

/// Measure PSNR and SSIM of a scene on held-out photos
///
/// The held-out photos are those that training left out; for a splat that was trained elsewhere,
/// give the photos with --photos. SSIM is that of the 3D Gaussian Splatting literature (11 x 11
/// Gaussian window). Photos are undistorted and scaled as in training. What training saw is marked "trained on"
/// and has a mean of its own. A splat is drawn before the photos' background.
///
/// With --masks, the scene may be the result of another method: the protocols masks, langsplat, 3d-ovs and part-recall
/// then have a row for each rule that makes masks, the method's own among them.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs eval scene/\n  \
    fmlgs eval scene/ --pictures compare/       photo | render | difference x 4, one PNG per view\n  \
    fmlgs eval scene/ --depth                   depth, on photos made by 'fmlgs synth'\n  \
    fmlgs eval scene/ --removal behind/         what 'fmlgs remove' uncovers and invents\n  \
    fmlgs eval scene/ --masks photos/           objects and parts against labels\n  \
    fmlgs eval scene/ --masks photos/ --protocol part-recall\n  \
    fmlgs eval langsplat/output --masks label/ --photos figurines/ --protocol langsplat\n  \
    fmlgs eval splat.ply --photos photos/ --max-side 1600 --json")]
pub(crate) struct EvalArgs {
    /// Trained scene or splat file
    scene: PathBuf,
    /// Dataset with the photos [default: where the scene's photos are]
    #[arg(long)]
    photos: Option<PathBuf>,
    /// Longer side of the compared images in px [default: as in training, else 512]
    #[arg(long, value_parser = clap::value_parser!(u32).range(16..=16384))]
    max_side: Option<u32>,
    /// Photos that count as held out: every n-th, 0 = all photos [default: as in training, else 8]
    #[arg(long, value_parser = number::within(0..=1_000_000_usize))]
    held_out_every: Option<usize>,
    /// Compare the black borders of photos that were undistorted elsewhere, too
    #[arg(long)]
    keep_borders: bool,
    /// Folder for images: photo, render and difference side by side
    #[arg(long)]
    pictures: Option<PathBuf>,
    /// Score each photo a second time with its pose aligned to the scene by the colors, as where training refined
    /// poses (--refine-poses); the first score stays
    #[arg(long)]
    align_poses: bool,
    /// Score each photo a second time after the best gain and bias of each channel, as where training learned
    /// exposures (--exposure)
    #[arg(long)]
    fit_exposure: bool,
    /// Compare objects and parts instead, with these labels: each named region of a held-out photo
    /// is asked for by its name
    #[arg(long)]
    masks: Option<PathBuf>,
    /// Protocol that compares objects and parts
    #[arg(long, value_enum, default_value_t = Protocol::Masks, requires = "masks")]
    protocol: Protocol,
    /// Query to ask, where labels do not name it (spin-nerf)
    #[arg(long, requires = "masks")]
    query: Option<String>,
    /// Decoder, codebook or index of another method's result, where it is not found beside it
    #[arg(long, requires = "masks")]
    decoder: Option<PathBuf>,
    /// Text encoder that another method's result was trained with, of 'fmlgs models' [default: that of its authors]
    #[arg(long, value_name = "NAME", requires = "masks")]
    encoder: Option<String>,
    /// Compare depth instead, with the true depths that came with synthetic photos
    #[arg(long, conflicts_with = "masks")]
    depth: bool,
    /// Remove things instead and compare with what is really behind them: a folder of 'fmlgs synth --without', or one
    /// that holds several
    #[arg(long, conflicts_with_all = ["masks", "depth"])]
    removal: Option<PathBuf>,
    /// Ask sentences with known answers instead: a list (.jsonl), or sentences generated from the meshes that the photos
    /// were rendered from (.glb, .gltf)
    #[arg(long, value_name = "FILE", conflicts_with_all = ["masks", "depth", "removal"])]
    questions: Option<PathBuf>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    recipe: RecipeArgs,
}

/// The table `[eval]` of a batch.
pub(super) fn of_table(table: &toml::Table) -> Result<BatchEvaluation, String> {
    const LEFT_OUT: [&str; 13] = [
        "photos",
        "held-out-every",
        "pictures",
        "align-poses",
        "fit-exposure",
        "masks",
        "decoder",
        "encoder",
        "query",
        "depth",
        "removal",
        "questions",
        "json",
    ];
    // Labels are those of each scene.
    let args: EvalArgs = table_args::parse("batch eval", table, &["scene", "--masks=labels"], &LEFT_OUT)?;
    let EvalArgs { max_side, keep_borders, protocol, recipe, .. } = args;
    Ok(BatchEvaluation { max_side_px: max_side, keep_borders, protocol, recipe: recipe.recipe() })
}

impl EvalArgs {
    /// The scene, if it is the result of another method.
    fn result(&self) -> Result<Option<CompareSubject>, CliError> {
        let (decoder, encoder) = (self.decoder.clone(), self.encoder.clone());
        let options = ResultOptions { decoder, encoder, ..ResultOptions::default() };
        Ok(CompareSubject::of_another_method(&self.scene, &options)?)
    }

    /// Choices for another method's result; options of this program's own answers have no effect there.
    fn of_result(&self, labels: &Path) -> Result<ResultEvaluation, CliError> {
        let idle = [
            (self.recipe.recipe() != QueryConfig::default(), "the recipe"),
            (self.pictures.is_some(), "--pictures"),
            (self.held_out_every.is_some(), "--held-out-every"),
        ];
        if let Some((_, what)) = idle.iter().find(|(given, _)| *given) {
            let text = format!("{what} has no effect on another method's result; 'fmlgs compare' draws pictures of it");
            return Err(CliError::Usage(text));
        }
        Ok(ResultEvaluation {
            labels: labels.to_owned(),
            views: WantedViews::Labeled,
            photos: self.photos.clone(),
            max_side_px: self.max_side,
            protocol: self.protocol,
        })
    }

    fn check(&self) -> Result<PhotoComparison, CliError> {
        let scene = open_scene(&self.scene)?;
        let photos = scene.photos(self.photos.as_deref())?;
        if let Some(folder) = &self.pictures {
            export::check_folder(folder, &[&photos])?;
        }
        let options = EvaluateOptions {
            max_side_px: self.max_side,
            holdout_every: self.held_out_every,
            keep_borders: self.keep_borders,
            pictures: self.pictures.clone(),
            fit: FittedParts { pose: self.align_poses, exposure: self.fit_exposure },
        };
        Ok(PhotoComparison::new(&scene, &photos, options)?)
    }
}

pub(crate) fn run(args: EvalArgs, quiet: bool) -> Result<(), CliError> {
    if let Some(file) = &args.questions {
        return eval_language::run(&open_scene(&args.scene)?, file, &args.recipe.recipe(), args.json);
    }
    if let Some(labels) = &args.masks
        && let Some(result) = args.result()?
    {
        return eval_results::run(result, &args.of_result(labels)?, args.json, quiet);
    }
    if let Some((_, option)) =
        [(args.decoder.is_some(), "--decoder"), (args.encoder.is_some(), "--encoder")].iter().find(|(given, _)| *given)
    {
        let text = format!("{option} has no effect here: '{}' is no result of another method", args.scene.display());
        return Err(CliError::Usage(text));
    }
    let comparison = args.check()?;
    if let Some(labels) = &args.masks {
        let how = (args.protocol, args.query.as_deref(), &args.recipe.recipe());
        return eval_masks::run(&args.scene, labels, how, &comparison, args.json);
    }
    let mut console = Console::new(quiet);
    if let Some(truth) = &args.removal {
        return eval_removal::run(&open_scene(&args.scene)?, truth, &comparison, args.json, &mut console);
    }
    if args.depth {
        return eval_depth::run(&args.scene, &comparison, args.json, &mut console);
    }
    let found = evaluate::photometric(&comparison, &mut console).map_err(CliError::of_views)?;
    drop(console);
    // A mean over photos that training saw says nothing about those that it did not see.
    let seen = &comparison.trained_on;
    let of = |trained_on: bool| -> Option<Evaluation> {
        let own = found.views.iter().zip(seen).filter(|(_, seen)| **seen == trained_on).map(|(view, _)| view.clone());
        let views: Vec<ViewScore> = own.collect();
        (!views.is_empty()).then(|| Evaluation::of(views, found.gaussians, found.step, found.secs))
    };
    let [held_out, trained_on] = [of(false), of(true)];
    if args.json {
        let view = |(view, seen): (&ViewScore, &bool)| {
            let mut view = json!(view);
            view["trained_on"] = json!(seen);
            view
        };
        let means = |of: &Option<Evaluation>| {
            of.as_ref().map(|e| json!({ "views": e.views.len(), "psnr": e.psnr, "ssim": e.ssim }))
        };
        return output::print_json(&json!({
            "scene": args.scene,
            "gaussians": found.gaussians,
            "max_side_px": comparison.max_side_px,
            "psnr": found.psnr,
            "ssim": found.ssim,
            "held_out": means(&held_out),
            "trained_on": means(&trained_on),
            "fitted": found.fitted,
            "views": found.views.iter().zip(seen).map(view).collect::<Vec<_>>(),
        }));
    }
    let row = |name: String, psnr: f64, ssim: f64| vec![name, format!("{psnr:.2}"), format!("{ssim:.4}")];
    let mut rows = vec![vec!["view".to_owned(), "PSNR dB".to_owned(), "SSIM".to_owned()]];
    rows.extend(
        found.views.iter().zip(seen).map(|(s, seen)| {
            row(if *seen { format!("{} (trained on)", s.name) } else { s.name.clone() }, s.psnr, s.ssim)
        }),
    );
    let mut mean =
        |what: &str, e: &Evaluation| rows.push(row(format!("mean of {}{what}", e.views.len()), e.psnr, e.ssim));
    match (&held_out, &trained_on) {
        (Some(held_out), Some(trained_on)) => {
            mean(" held out", held_out);
            mean(" trained on", trained_on);
        }
        (None, Some(trained_on)) => mean(" trained on", trained_on),
        _ => mean("", &found),
    }
    output::print(&output::table(&rows))?;
    found.fitted.as_ref().map_or(Ok(()), |fitted| output::print(&format!("the same: {}", fitted.line())))
}
