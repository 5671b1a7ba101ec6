//! A plan's decisions in words: choice, reason and saving.

use super::{CloudFacts, Item, LEAST_SIDE_PX, Machine, PhotoFacts, PlanLine, SceneFacts, ScenePlan, SemanticFacts};
use crate::math::format::{bytes, count, things};
use crate::math::sh;
use crate::scene::semantic_map::CODE_CHANNELS;

/// Bytes that a pixel of a view's map of identities takes.
const MAP_BYTES_PER_PX: u64 = 12;

/// Bytes of a tree for each of its Gaussians, about.
const LEVEL_BYTES: usize = 40;

/// The lines of a plan, one row an item; rows that say nothing about a scene are left out.
pub(super) fn of(plan: &ScenePlan) -> Vec<PlanLine> {
    let SceneFacts { semantics, photos, machine, .. } = &plan.facts;
    let (semantics, photos) = (semantics.as_ref(), photos.as_ref());
    let rows = [
        ("color", "Color", Some(color(plan))),
        ("feature-maps", "Feature maps", Some(feature_maps(semantics))),
        ("parts", "Part level", semantics.map(parts)),
        ("thumbnails", "Thumbnails", semantics.map(thumbnails)),
        ("encoder", "Text encoder", Some(encoder(semantics))),
        ("precision", "Precision", semantics.filter(|s| s.numbers > 0).map(precision)),
        ("navigation", "Navigation graph", Some(navigation(semantics.is_some(), photos.is_some()))),
        ("depth", "Depth", Some(only("at rest", "It is for picking points", "one of four channels of moving frames"))),
        ("photos", "Photos", Some(training_size(plan))),
        ("holdout", "Holdout", photos.map(|p| holdout(p, plan.holdout_every))),
        ("objects", "Object search", search_size(plan)),
        ("gaussians", "Gaussians", photos.map(|_| gaussians(machine))),
        ("backend", "Backend", Some(backend(machine))),
        ("redraw", "Redraw", Some(only("on change", "A still scene needs no new frame", "all rendering at rest"))),
        ("buffers", "Render buffers", Some(only("freed at rest", "Nothing is drawn at rest", "working memory"))),
        ("levels", "Levels of detail", levels(plan)),
    ];
    let named = |(item, subject, line): (_, _, Option<PlanLine>)| Some(PlanLine { item, subject, ..line? });
    rows.into_iter().filter_map(named).map(|line| overridden(line, plan)).collect()
}

/// A line where there is nothing else to choose.
fn only(choice: impl Into<String>, reason: impl Into<String>, saving: impl Into<String>) -> PlanLine {
    PlanLine { choice: choice.into(), reason: reason.into(), saving: saving.into(), ..PlanLine::default() }
}

/// A line where the alternative would make a difference.
fn or(item: Item, choice: impl Into<String>, reason: impl Into<String>, saving: impl Into<String>) -> PlanLine {
    PlanLine { overridable: Some(item), ..only(choice, reason, saving) }
}

/// The line, with the alternative if the user chose it.
fn overridden(line: PlanLine, plan: &ScenePlan) -> PlanLine {
    let Some(item) = line.overridable.filter(|item| plan.overrides.has(*item)) else { return line };
    let reason = format!("Set by the user. Automatic choice: {}", line.reason);
    PlanLine { choice: item.alternative().into(), reason, overridden: true, ..line }
}

fn color(plan: &ScenePlan) -> PlanLine {
    let Some(CloudFacts { gaussians, sh_stored, sh_used, sh_visible, .. }) = plan.facts.cloud else {
        let all = sh::coefficients(plan.sh_degree);
        let saving = format!("{} of {all} coefficients at the start", all - 1);
        let reason = "Early training has no use for view-dependent color";
        return only(format!("SH degree {}, raised in steps", plan.sh_degree), reason, saving);
    };
    let saved = |from: u8| {
        let dropped = sh::coefficients(from) - sh::coefficients(sh_visible);
        bytes((gaussians * dropped * size_of::<[f32; 3]>()) as u64)
    };
    let choice = format!("SH degree {sh_visible} of {sh_stored}");
    match (sh_visible == sh_stored, sh_visible == sh_used) {
        (true, _) => only(format!("SH degree {sh_visible}"), "Every band is visible", ""),
        (_, true) => only(choice, "The higher bands are zero", format!("{} of memory", saved(sh_stored))),
        _ => {
            let reason = "The higher bands change no pixel by half an 8-bit step";
            only(choice, reason, format!("{} read for every frame", saved(sh_used)))
        }
    }
}

fn feature_maps(semantics: Option<&SemanticFacts>) -> PlanLine {
    let saving = format!("a second rendering of every view, {MAP_BYTES_PER_PX} bytes per pixel");
    let Some(s) = semantics else { return only("off", "No objects are known in this scene", saving) };
    let known = format!("{} and {} are known", things(s.objects, "object"), things(s.parts, "part"));
    or(Item::FeatureMaps, "from the first query", format!("{known}, but may never be queried"), saving)
}

fn parts(semantics: &SemanticFacts) -> PlanLine {
    match semantics.parts {
        0 => {
            let saving = format!("{} of {CODE_CHANNELS} channels of blended codes", CODE_CHANNELS / 2);
            only("off", "The objects have no parts", saving)
        }
        n => only("on", format!("{} are known", things(n, "part")), ""),
    }
}

fn thumbnails(semantics: &SemanticFacts) -> PlanLine {
    let saving = format!("{} at opening", things(semantics.objects + semantics.parts, "rendering"));
    only("when they are shown", "Only lists of objects show them", saving)
}

fn encoder(semantics: Option<&SemanticFacts>) -> PlanLine {
    let Some(name) = semantics.and_then(|s| s.encoder.as_ref()) else {
        return only("off", "There are no embeddings to compare a phrase with", "loading a network");
    };
    let choice = format!("'{name}', with the first query");
    or(Item::Encoder, choice, "Only typed phrases need it", "loading a network at opening")
}

fn precision(semantics: &SemanticFacts) -> PlanLine {
    let reason = "Rounding changes their cosines by less than 0.001, answers differ by more";
    only("16-bit features in the file", reason, format!("{} of disk", bytes(semantics.numbers as u64 * 2)))
}

fn navigation(has_objects: bool, has_cameras: bool) -> PlanLine {
    let (choice, reason) = match (has_objects, has_cameras) {
        (false, _) => ("off", "There are no objects to go to"),
        (_, false) => ("off", "The scene has no cameras, so no reachable viewpoint is known"),
        _ => ("at the first flight", "Looking around by hand needs none"),
    };
    only(choice, reason, "a grid of occupied space and a graph of keypoints")
}

fn training_size(plan: &ScenePlan) -> PlanLine {
    let Some(PhotoFacts { size_px: [w, h], longest_px, pixels, limited_pixels, .. }) = plan.facts.photos else {
        return only("none", "The scene has no photos", "thumbnails, training, the search for objects");
    };
    let limit = plan.facts.limits.train_side_px;
    if longest_px <= limit {
        return only(format!("{w} x {h} px"), "Their full size", "");
    }
    let scale = (f64::from(limit) / f64::from(w.max(h))).min(1.0);
    let side = |s: u32| ((f64::from(s) * scale).round() as u32).max(1);
    let reason = format!("Training is set to {limit} px; the files have {w} x {h}");
    or(Item::Photos, format!("{} x {} px", side(w), side(h)), reason, bytes((pixels - limited_pixels) * 3))
}

fn holdout(photos: &PhotoFacts, every: usize) -> PlanLine {
    match (photos.test_photos, photos.photos, every) {
        (test @ 1.., all, _) => {
            let choice = format!("{test} of {}", things(all, "photo"));
            only(choice, "The data set marks them as test; quality is measured on them", "")
        }
        (_, 1, _) => only("none", "The only photo is needed for training", "evaluation, which has nothing left"),
        (_, _, 0) => only("none", "As set for training", "evaluation"),
        (_, _, n) => only(format!("every {n}th photo"), "Quality is measured on photos that training does not see", ""),
    }
}

fn search_size(plan: &ScenePlan) -> Option<PlanLine> {
    let longest = plan.facts.photos.as_ref()?.longest_px;
    let resolved = plan.facts.cloud.as_ref()?.resolved_side_px?.max(LEAST_SIDE_PX);
    let limit = plan.facts.limits.object_side_px.min(longest);
    if resolved >= limit {
        let reason = format!("The Gaussians resolve {} px along the longer side", resolved.min(longest));
        return Some(only(format!("{limit} px"), reason, ""));
    }
    let share = 1.0 - (f64::from(resolved) / f64::from(limit)).powi(2);
    let reason = format!("The Gaussians resolve no more of the {longest} px along the longer side");
    Some(only(format!("{resolved} px"), reason, format!("{:.0} % of the pixels of every view", share * 100.0)))
}

fn gaussians(machine: &Machine) -> PlanLine {
    let free = bytes(machine.free_memory_bytes);
    let reason = format!("What fits into {free} of free memory; small photos need fewer");
    only(format!("at most {}", count(machine.max_gaussians as u64)), reason, "")
}

fn backend(machine: &Machine) -> PlanLine {
    match &machine.gpu {
        Some(name) => or(Item::Backend, format!("GPU, {name}"), "A hardware adapter is present", ""),
        None => {
            let reason = "No GPU: the only adapter is emulated or missing";
            only(format!("CPU, {} cores", machine.cores), reason, "the device's copy of the scene")
        }
    }
}

fn levels(plan: &ScenePlan) -> Option<PlanLine> {
    let gaussians = plan.facts.cloud.as_ref()?.gaussians;
    if plan.facts.is_large(plan.on_cpu) {
        let reason = format!("{} Gaussians cannot be drawn in time; at rest all are", count(gaussians as u64));
        return Some(only("while the camera moves", reason, ""));
    }
    let reason = match plan.facts.machine.gpu.as_ref().filter(|_| !plan.on_cpu) {
        Some(_) => "A GPU draws all of them in time".to_owned(),
        None => format!("All {} Gaussians are drawn in time", count(gaussians as u64)),
    };
    let saving = format!("{} of memory, building a tree", bytes((gaussians * LEVEL_BYTES) as u64));
    Some(or(Item::Levels, "off", reason, saving))
}
