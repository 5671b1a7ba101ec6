//! `fmlgs info`: what a folder or file is, and what would be left out for it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::plan::PlanArgs;
use super::preprocess::identities;
use super::scene_args::AxesArgs;
use super::{CliError, output};
use crate::io::scene_files::MAP_FILE;
use crate::io::trained::CLOUD_FILE;
use crate::jobs::open::{self, Contents};
use crate::jobs::{Scene, ask_result, measurements, plan};
use crate::pipeline::train::TrainConfig;
use crate::scene::measurement::Measurement;
use crate::scene::{Bounds, Dataset, PlanLine, ScenePlan, SemanticMap};

/// Say what a folder or file holds, and the plan for it
///
/// Works on everything that can be opened: posed photos (COLMAP, transforms.json, Blender, LLFF),
/// splats, trained scenes and results of other methods. The scene plan lists what the program leaves out for this scene on
/// this machine, why, and what that saves.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  fmlgs info photos/\n  fmlgs info scene.ply --json | jq .gaussians\n  \
    fmlgs info photos/ --plan photos=full")]
pub(crate) struct InfoArgs {
    /// Dataset folder, transforms.json, splat file or trained scene
    path: PathBuf,
    /// Training images are limited to this many px along the longer side; the plan depends on it [default: 512]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=16384))]
    max_side: Option<u32>,
    #[command(flatten)]
    axes: AxesArgs,
    #[command(flatten)]
    plan: PlanArgs,
    /// Print one JSON document, with every camera
    #[arg(long)]
    json: bool,
}

/// Properties of a splat that are listed by name.
const EXTRAS: usize = 8;

/// Facts in two forms: label and text for display, and a JSON object.
struct Facts {
    lines: Vec<(&'static str, String)>,
    json: serde_json::Map<String, Value>,
    warnings: Vec<String>,
}

pub(crate) fn run(args: InfoArgs) -> Result<(), CliError> {
    let defaults = TrainConfig::default();
    let config = TrainConfig { max_side_px: args.max_side.unwrap_or(defaults.max_side_px), ..defaults.clone() };
    let machine = plan::machine();
    let contents = open::contents(&args.path, args.axes.axes)?;
    if let (Some(_), Contents::Scene(scene)) = (args.max_side, &contents)
        && scene.cameras.is_empty()
    {
        let text = "--max-side has no effect here: a splat file does not say which photos it could be trained on";
        return Err(CliError::Usage(text.into()));
    }
    let (mut facts, planned) = match contents {
        Contents::Photos(d) => (of_dataset(&d, defaults.holdout_every), plan::facts(&machine, Some(&d), None, &config)),
        Contents::Scene(s) => {
            let planned = plan::scene_facts(&machine, &s, &config);
            match &s.folder {
                Some(folder) => {
                    let (facts, map) = of_trained(&s, folder);
                    (facts, planned.with_semantics(map.as_ref()))
                }
                None => (of_splat(&s), planned),
            }
        }
    };
    let plan = ScenePlan::new(planned, &args.plan.overrides());
    if args.json {
        facts.json.insert("path".into(), json!(args.path));
        facts.json.insert("warnings".into(), json!(facts.warnings));
        facts.json.insert("plan".into(), serde_json::to_value(&plan)?);
        return output::print_json(&facts.json);
    }
    output::print(&text(&args.path, &facts, &plan))
}

fn text(path: &Path, facts: &Facts, plan: &ScenePlan) -> String {
    let mut out = format!("{}\n", path.display());
    for (label, value) in &facts.lines {
        out.push_str(&format!("  {label:<16} {value}\n"));
    }
    for warning in &facts.warnings {
        out.push_str(&format!("  warning: {warning}\n"));
    }
    out.push_str("\nScene plan\n");
    for line in &plan.lines {
        let word = if line.overridden { "costs" } else { "saves" };
        let saving = if line.saving.is_empty() { String::new() } else { format!(" ({word} {})", line.saving) };
        let PlanLine { subject, item, choice, reason, .. } = line;
        out.push_str(&format!("  {subject:<16} {item:<12} {choice}: {reason}{saving}\n"));
    }
    out.trim_end().to_owned()
}

fn of_dataset(d: &Dataset, holdout_every: usize) -> Facts {
    let (train, held_out) = d.split(holdout_every);
    let mut sizes: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    for p in &d.photos {
        *sizes.entry([p.camera.width_px, p.camera.height_px]).or_default() += 1;
    }
    let size_text = sizes.iter().map(|([w, h], n)| format!("{n} of {w} x {h} px")).collect::<Vec<_>>().join(", ");
    let distorted = d.photos.iter().filter(|p| p.distortion.is_some()).count();
    let points = d.points.len();
    let (center, extent) = d.camera_extent();
    let mut lines = vec![
        ("kind", format!("posed photos, {}", d.format)),
        ("photos", format!("{} ({} to train on, {} held out)", d.photos.len(), train.len(), held_out.len())),
        ("sizes", size_text),
        ("lens distortion", if distorted > 0 { format!("on {distorted}, undone on load") } else { "none".into() }),
        (
            "sparse points",
            if points > 0 { points.to_string() } else { "none: training starts where photos agree".into() },
        ),
        ("camera extent", format!("{extent:.3} scene units around {}", vector(center))),
    ];
    if let Some(alpha) = d.alpha {
        lines.push(("transparency", format!("{} (fmlgs train --alpha)", alpha.title())));
    }
    let masked = d.masked();
    if masked > 0 {
        lines.push(("masks", format!("of {masked} photos; what is black there does not count")));
    }
    let json = json!({
        "kind": "dataset",
        "name": d.name,
        "format": d.format,
        "photos": d.photos.len(),
        "train": train.len(),
        "held_out": held_out.len(),
        "distorted": distorted,
        "points": points,
        "camera_extent": extent,
        "background": d.background,
        "alpha": d.alpha,
        "masks": masked,
        "cameras": open::cameras(d, holdout_every),
    });
    facts(lines, json, d.warnings.clone())
}

fn of_splat(s: &Scene) -> Facts {
    let (mut lines, json) = cloud_facts(s);
    let result = ask_result::facts(s);
    let kind = result.as_ref().map_or_else(|| "Gaussian splat".to_owned(), |r| format!("result of {}", r.method));
    lines.insert(0, ("kind", kind));
    if !s.cameras.is_empty() {
        let held_out = s.cameras.iter().filter(|c| c.held_out).count();
        lines.push(("cameras", format!("{} ({held_out} held out), beside it", s.cameras.len())));
    }
    lines.extend(s.dataset_path.as_ref().map(|path| ("photos", path.display().to_string())));
    let known = s.known_semantics().ok().flatten().map(|map| map.identities.len());
    if let Some(r) = &result {
        lines.extend(r.levels.iter().map(|level| ("level", level.clone())));
        lines.extend(r.encoder.map(|encoder| ("text encoder", format!("{encoder} (see 'fmlgs models')"))));
        lines.extend(known.map(|n| ("objects and parts", n.to_string())));
        lines.push(("answers", r.answers.into()));
        lines.push(("does not answer", r.refuses.into()));
        lines.extend(r.problem.as_ref().map(|why| ("cannot be read", why.clone())));
    }
    let mut facts = facts(lines, json, s.warnings.clone());
    facts.json.insert("kind".into(), json!(if result.is_some() { "result" } else { "splat" }));
    facts.json.insert("result".into(), json!(result));
    facts.json.insert("identities".into(), json!(known));
    facts.json.insert("cameras".into(), json!(s.cameras));
    facts.json.insert("dataset".into(), json!(s.dataset_path));
    facts.json.insert("up".into(), json!(s.home().up));
    facts
}

fn of_trained(s: &Scene, folder: &Path) -> (Facts, Option<SemanticMap>) {
    let (cloud_lines, json) = cloud_facts(s);
    let held_out = s.cameras.iter().filter(|c| c.held_out).count();
    let photos = match (&s.dataset_path, &s.photos) {
        (Some(path), _) => path.display().to_string(),
        (None, Some(gone)) => format!("{} (not found)", gone.display()),
        (None, None) => "not known".into(),
    };
    let mut lines = vec![
        ("kind", format!("trained scene '{}'", s.name)),
        ("cameras", format!("{} ({held_out} held out)", s.cameras.len())),
        ("photos", photos),
    ];
    lines.extend(cloud_lines);
    if let Some(e) = s.history.evaluations.last() {
        lines.push((
            "held-out PSNR",
            format!("{:.2} dB, SSIM {:.3} after step {}, {:.0} s", e.psnr, e.ssim, e.step, e.secs),
        ));
    }
    let map = s.known_semantics();
    let of_others = matches!(map, Ok(None)) && folder.join(MAP_FILE).exists();
    let warning = match &map {
        Err(e) => Some(format!("its objects cannot be read ('fmlgs preprocess' finds them again): {e}")),
        Ok(None) if of_others => Some(format!(
            "{} is of other Gaussians than {}, so no objects are known; 'fmlgs preprocess' finds them again",
            MAP_FILE, CLOUD_FILE
        )),
        Ok(_) => None,
    };
    let map = map.ok().flatten();
    let known = map.as_ref().map(|m| m.identities.len());
    lines.push(("objects and parts", known.map_or_else(|| "none known".into(), |n| n.to_string())));
    let measured = measurements::load(folder);
    let unread = measured.as_ref().err().map(|e| format!("its measurements cannot be read: {e}"));
    let measured = measured.unwrap_or_default();
    if !measured.is_empty() {
        let one = |m: &Measurement| format!("{}: {}", m.name, m.text(s.meters_per_unit));
        lines.push(("measurements", measured.iter().map(one).collect::<Vec<_>>().join("; ")));
    }
    let warnings = s.warnings.iter().cloned().chain(warning).chain(unread).collect();
    let mut facts = facts(lines, json, warnings);
    facts.json.insert("kind".into(), json!("trained"));
    facts.json.insert("name".into(), json!(s.name));
    facts.json.insert("dataset".into(), json!(s.dataset_path));
    facts.json.insert("cameras".into(), json!(s.cameras));
    facts.json.insert("history".into(), json!(s.history));
    facts.json.insert("identities".into(), json!(known));
    facts.json.insert("measured".into(), measurements::as_json(&measured, s.meters_per_unit));
    facts.json.insert("objects".into(), json!(map.as_ref().map(identities)));
    facts.json.insert("unknown".into(), json!(map.as_ref().and_then(|m| m.findings.as_ref()?.unknown())));
    (facts, map)
}

fn cloud_facts(s: &Scene) -> (Vec<(&'static str, String)>, Value) {
    let c = &s.cloud;
    let bounds = Bounds::robust((0..c.len()).map(|i| c.world_position(i)));
    let extras: Vec<&str> = c.extras.iter().map(|e| e.name.as_str()).collect();
    let mut lines =
        vec![("Gaussians", c.len().to_string()), ("color", format!("spherical harmonics of degree {}", s.sh_stored))];
    if let Some(b) = bounds {
        lines.push(("middle 96 %", format!("{} to {} scene units", vector(b.min), vector(b.max))));
    }
    if let Some(up) = c.up {
        lines.push(("upwards", vector(up)));
    }
    if !extras.is_empty() {
        let shown = extras.iter().take(EXTRAS).copied().collect::<Vec<_>>().join(", ");
        let more = extras.len().saturating_sub(EXTRAS);
        lines.push(("kept besides", if more > 0 { format!("{shown} and {more} more") } else { shown }));
    }
    (lines, json!({ "gaussians": c.len(), "sh_degree": s.sh_stored, "bounds": bounds, "extras": extras }))
}

fn facts(lines: Vec<(&'static str, String)>, json: Value, warnings: Vec<String>) -> Facts {
    let json = match json {
        Value::Object(map) => map,
        other => serde_json::Map::from_iter([("value".to_owned(), other)]),
    };
    Facts { lines, json, warnings }
}

fn vector(v: glam::DVec3) -> String {
    format!("({:.3}, {:.3}, {:.3})", v.x, v.y, v.z)
}
