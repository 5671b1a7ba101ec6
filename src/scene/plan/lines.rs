//! A plan's decisions in words: choice, reason and saving.

use strum::VariantArray;

use super::{CloudFacts, Item, LEAST_SIDE_PX, PhotoFacts, PlanLine, ScenePlan};
use crate::math::format::{bytes, count, things};
use crate::math::sh;
use crate::scene::semantic_map::CODE_CHANNELS;

/// Bytes that a pixel of a view's map of identities takes.
const MAP_BYTES_PER_PX: u64 = 12;

/// Bytes of a tree for each of its Gaussians, about.
const LEVEL_BYTES: usize = 40;

/// The lines of a plan, in the order of the items; those that say nothing about a scene are not there.
pub(crate) fn of(plan: &ScenePlan) -> Vec<PlanLine> {
    Item::VARIANTS.iter().filter_map(|&item| line(item, plan)).collect()
}

fn line(item: Item, plan: &ScenePlan) -> Option<PlanLine> {
    let Said { choice, reason, saving, differs } = row(item, plan)?;
    let overridden = differs && plan.overrides.has(item);
    let alternative = item.alternative().filter(|_| differs);
    Some(PlanLine {
        item,
        subject: item.subject().into(),
        choice: if overridden { alternative.unwrap_or_default().into() } else { choice },
        reason: if overridden { format!("Set by the user. Automatic choice: {reason}") } else { reason },
        saving,
        alternative: alternative.map(str::to_owned),
        overridden,
    })
}

/// Texts on an item before overrides.
struct Said {
    choice: String,
    reason: String,
    saving: String,
    differs: bool,
}

/// A row where the alternative would make a difference.
fn or(choice: impl Into<String>, reason: impl Into<String>, saving: impl Into<String>) -> Option<Said> {
    Some(Said { choice: choice.into(), reason: reason.into(), saving: saving.into(), differs: true })
}

/// A row where there is nothing else to choose.
fn only(choice: impl Into<String>, reason: impl Into<String>, saving: impl Into<String>) -> Option<Said> {
    or(choice, reason, saving).map(|said| Said { differs: false, ..said })
}

/// The table: choice, reason and saving of every item.
fn row(item: Item, plan: &ScenePlan) -> Option<Said> {
    let facts = &plan.facts;
    let (semantics, photos, machine) = (facts.semantics.as_ref(), facts.photos.as_ref(), &facts.machine);
    match (item, semantics) {
        (Item::Color, _) => color(plan),
        (Item::FeatureMaps, None) => only("off", "No objects are known in this scene", maps_saving()),
        (Item::FeatureMaps, Some(s)) => {
            let known = format!("{} and {} are known", things(s.objects, "object"), things(s.parts, "part"));
            or("from the first query", format!("{known}, but may never be queried"), maps_saving())
        }
        (Item::Parts, Some(s)) if s.parts > 0 => only("on", format!("{} are known", things(s.parts, "part")), ""),
        (Item::Parts, Some(_)) => {
            let half = CODE_CHANNELS / 2;
            or("off", "The objects have no parts", format!("{half} of {CODE_CHANNELS} channels of blended codes"))
        }
        (Item::Thumbnails, Some(s)) => {
            let saving = format!("{} at opening", things(s.objects + s.parts, "rendering"));
            or("when they are shown", "Only lists of objects show them", saving)
        }
        (Item::Encoder, s) => match s.and_then(|s| s.encoder.as_ref()) {
            None => only("off", "There are no embeddings to compare a phrase with", "loading a network"),
            Some(name) => {
                let choice = format!("'{name}', with the first query");
                or(choice, "Only typed phrases need it", "loading a network at opening")
            }
        },
        (Item::Precision, Some(s)) if s.numbers > 0 => {
            let reason = "Rounding changes their cosines by less than 0.001, answers differ by more";
            only("16-bit features in the file", reason, format!("{} of disk", bytes(s.numbers as u64 * 2)))
        }
        (Item::Navigation, s) => {
            let saving = "a grid of occupied space and a graph of keypoints";
            match (s, photos) {
                (None, _) => only("off", "There are no objects to go to", saving),
                (_, None) => only("off", "The scene has no cameras, so no reachable viewpoint is known", saving),
                _ => or("at the first flight", "Looking around by hand needs none", saving),
            }
        }
        (Item::Depth, _) => {
            let reason = "It is for picking points, which is not done while the camera moves";
            or("at rest", reason, "one of four channels of every frame in between")
        }
        (Item::Photos, _) => training_size(plan),
        (Item::Holdout, _) => match (photos?.photos, plan.holdout_every) {
            (all, _) if photos?.test_photos > 0 => {
                let choice = format!("{} of {}", photos?.test_photos, things(all, "photo"));
                only(choice, "The data set marks them as test; quality is measured on them", "")
            }
            (1, _) => only("none", "The only photo is needed for training", "evaluation, which has nothing left"),
            (_, 0) => only("none", "As set for training", "evaluation"),
            (_, n) => {
                only(format!("every {n}th photo"), "Quality is measured on photos that training does not see", "")
            }
        },
        (Item::Objects, _) => search_size(plan),
        (Item::Gaussians, _) => {
            photos?;
            let reason =
                format!("What fits into {} of free memory; small photos need fewer", bytes(machine.free_memory_bytes));
            only(format!("at most {}", count(plan.max_gaussians as u64)), reason, "")
        }
        (Item::Backend, _) => match &machine.gpu {
            Some(name) => or(format!("GPU, {name}"), "A hardware adapter is present", ""),
            None => {
                let reason = "No GPU: the only adapter is emulated or missing";
                only(format!("CPU, {} cores", machine.cores), reason, "the device's copy of the scene")
            }
        },
        (Item::Redraw, _) => or("on change", "A still scene needs no new frame", "all rendering while nothing moves"),
        (Item::Buffers, _) => {
            let saving = "working memory by Gaussians, tiles and pixels";
            or("freed at rest", "Nothing is rendered while the camera rests", saving)
        }
        (Item::Levels, _) => levels(plan),
        (Item::Parts | Item::Thumbnails | Item::Precision, _) => None,
    }
}

fn maps_saving() -> String {
    format!("a second rendering of every view, {MAP_BYTES_PER_PX} bytes per pixel")
}

fn color(plan: &ScenePlan) -> Option<Said> {
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
            or(choice, reason, format!("{} read for every frame", saved(sh_used)))
        }
    }
}

fn levels(plan: &ScenePlan) -> Option<Said> {
    let gaussians = plan.facts.cloud.as_ref()?.gaussians;
    let memory = bytes((gaussians * LEVEL_BYTES) as u64);
    if plan.facts.is_large(plan.on_cpu) {
        let reason = format!("{} Gaussians cannot be drawn in time; at rest all are", count(gaussians as u64));
        return only("while the camera moves", reason, "");
    }
    let reason = match plan.facts.machine.gpu.as_ref().filter(|_| !plan.on_cpu) {
        Some(_) => "A GPU draws all of them in time".to_owned(),
        None => format!("All {} Gaussians are drawn in time", count(gaussians as u64)),
    };
    or("off", reason, format!("{memory} of memory, building a tree"))
}

fn training_size(plan: &ScenePlan) -> Option<Said> {
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
    or(format!("{} x {} px", side(w), side(h)), reason, bytes((pixels - limited_pixels) * 3))
}

fn search_size(plan: &ScenePlan) -> Option<Said> {
    let longest = plan.facts.photos.as_ref()?.longest_px;
    let resolved = plan.facts.cloud.as_ref()?.resolved_side_px?.max(LEAST_SIDE_PX);
    let limit = plan.facts.limits.object_side_px.min(longest);
    if resolved >= limit {
        let reason = format!("The Gaussians resolve {} px along the longer side", resolved.min(longest));
        return only(format!("{limit} px"), reason, "");
    }
    let share = 1.0 - (f64::from(resolved) / f64::from(limit)).powi(2);
    let reason = format!("The Gaussians resolve no more of the {longest} px along the longer side");
    or(format!("{resolved} px"), reason, format!("{:.0} % of the pixels of every view", share * 100.0))
}
