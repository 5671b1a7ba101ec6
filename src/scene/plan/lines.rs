//! A plan's decisions in words: what was decided, why, and what it saves.

use super::{CloudFacts, Item, PhotoFacts, PlanLine, ScenePlan, SemanticFacts, bytes, count};
use crate::math::sh;
use crate::scene::semantic_map::CODE_CHANNELS;

/// Bytes that a pixel of a view's map of identities takes.
const MAP_BYTES_PER_PX: u64 = 12;

/// The lines of a plan, in the order of [`Item::ALL`]; those that say nothing about a scene are not
/// there.
pub fn of(plan: &ScenePlan) -> Vec<PlanLine> {
    Item::ALL.into_iter().filter_map(|item| line(item, plan)).collect()
}

/// What is said of an item as the data suggest it.
struct Said {
    choice: String,
    reason: String,
    saving: String,
    /// Whether the alternative would make a difference.
    differs: bool,
}

fn said(
    choice: impl Into<String>,
    reason: impl Into<String>,
    saving: impl Into<String>,
    differs: bool,
) -> Option<Said> {
    Some(Said { choice: choice.into(), reason: reason.into(), saving: saving.into(), differs })
}

fn line(item: Item, plan: &ScenePlan) -> Option<PlanLine> {
    let said = match item {
        Item::Colour => colour(plan),
        Item::Maps => maps(plan),
        Item::Parts => parts(plan.facts.semantics.as_ref()?),
        Item::Portraits => portraits(plan.facts.semantics.as_ref()?),
        Item::Encoder => encoder(plan),
        Item::Precision => precision(plan.facts.semantics.as_ref()?),
        Item::Navigation => navigation(plan),
        Item::Depth => said(
            "when the eye rests",
            "It is for picking points, which nobody does while the eye moves",
            "one of four channels of every picture in between",
            true,
        ),
        Item::Photos => photos(plan),
        Item::Held => held(plan),
        Item::Objects => objects(plan),
        Item::Gaussians => {
            plan.facts.photos.as_ref()?;
            let free = plan.facts.machine.free_memory_bytes;
            let reason = format!("What fits into the {} of free memory", bytes(free));
            said(format!("at most {}", count(plan.max_gaussians as u64)), reason, "", false)
        }
        Item::Backend => match &plan.facts.machine.gpu {
            Some(name) => said(format!("GPU, {name}"), "A real adapter is present", "", true),
            None => {
                let cores = plan.facts.machine.cores;
                let reason = "No GPU: the only adapter is emulated or missing";
                said(format!("CPU, {cores} cores"), reason, "the device's copy of the scene", false)
            }
        },
        Item::Redraw => {
            said("on change", "A still scene needs no new picture", "all drawing while nothing moves", true)
        }
        Item::Buffers => said(
            "given back at rest",
            "Nothing is drawn while the eye rests",
            "working memory by Gaussians, tiles and pixels",
            true,
        ),
    }?;
    let overridden = said.differs && plan.overrides.has(item);
    let wanted = item.alternative().filter(|_| said.differs);
    Some(PlanLine {
        item,
        subject: item.subject().into(),
        choice: if overridden { wanted.unwrap_or_default().into() } else { said.choice },
        reason: if overridden { format!("Wanted so; else {}", lowered(&said.reason)) } else { said.reason },
        saving: said.saving,
        alternative: wanted.map(str::to_owned),
        overridden,
    })
}

/// A sentence as it stands within another.
fn lowered(sentence: &str) -> String {
    let mut letters = sentence.chars();
    let first = letters.next().map(|c| c.to_lowercase().to_string()).unwrap_or_default();
    // Names and abbreviations keep their capitals.
    if letters.clone().next().is_some_and(char::is_uppercase) { sentence.into() } else { first + letters.as_str() }
}

fn colour(plan: &ScenePlan) -> Option<Said> {
    let Some(CloudFacts { gaussians, sh_stored, sh_used, sh_visible, .. }) = plan.facts.cloud else {
        let all = sh::coefficients(plan.sh_degree);
        let reason = "Early training has no use for view-dependent colour";
        return said(
            format!("SH degree {}, opened in steps", plan.sh_degree),
            reason,
            format!("{} of {all} coefficients at the start", all - 1),
            false,
        );
    };
    let saved = |from: u8| {
        let dropped = sh::coefficients(from) - sh::coefficients(sh_visible);
        bytes((gaussians * dropped * size_of::<[f32; 3]>()) as u64)
    };
    match (sh_visible == sh_stored, sh_visible == sh_used) {
        (true, _) => said(format!("SH degree {sh_visible}"), "Every band can be seen", "", false),
        (_, true) => said(
            format!("SH degree {sh_visible} of {sh_stored}"),
            "The higher bands are zero",
            format!("{} of memory", saved(sh_stored)),
            false,
        ),
        _ => said(
            format!("SH degree {sh_visible} of {sh_stored}"),
            "The higher bands change no pixel by half an 8-bit step",
            format!("{} read for every picture", saved(sh_used)),
            true,
        ),
    }
}

fn maps(plan: &ScenePlan) -> Option<Said> {
    let saving = format!("a second drawing of every view, {MAP_BYTES_PER_PX} bytes per pixel");
    match &plan.facts.semantics {
        None => said("off", "No objects are known in this scene", saving, false),
        Some(s) => {
            let known = format!("{} and {}", things(s.objects, "object"), things(s.parts, "part"));
            said("from the first question", format!("{known} are known, and nobody may ask for them"), saving, true)
        }
    }
}

fn parts(s: &SemanticFacts) -> Option<Said> {
    if s.parts > 0 {
        return said("on", format!("{} are known", things(s.parts, "part")), "", false);
    }
    let half = CODE_CHANNELS / 2;
    said("off", "The objects have no parts", format!("{half} of {CODE_CHANNELS} channels of blended codes"), true)
}

fn portraits(s: &SemanticFacts) -> Option<Said> {
    let saving = things(s.objects + s.parts, "drawing");
    said("when they are shown", "Only the lists of objects show them", format!("{saving} at opening"), true)
}

fn encoder(plan: &ScenePlan) -> Option<Said> {
    match plan.facts.semantics.as_ref().and_then(|s| s.encoder.as_ref()) {
        None => said("off", "There are no features that a phrase could be compared with", "loading a network", false),
        Some(name) => said(
            format!("'{name}', with the first question"),
            "Only typed phrases need it",
            "loading a network at opening",
            true,
        ),
    }
}

fn precision(s: &SemanticFacts) -> Option<Said> {
    if s.numbers == 0 {
        return None;
    }
    let reason = "Rounding changes their cosines by less than 0.001, answers differ by more";
    said("16-bit features in the file", reason, format!("{} of disk", bytes(s.numbers as u64 * 2)), false)
}

fn navigation(plan: &ScenePlan) -> Option<Said> {
    let saving = "a grid of matter and a graph of keypoints";
    match (&plan.facts.semantics, &plan.facts.photos) {
        (None, _) => said("off", "There are no objects that one could go to", saving, false),
        (_, None) => said("off", "The scene came without cameras, so there is nowhere to stand", saving, false),
        _ => said("at the first flight", "Looking around by hand needs none", saving, true),
    }
}

fn photos(plan: &ScenePlan) -> Option<Said> {
    let Some(PhotoFacts { size_px: [w, h], longest_px, pixels, limited_pixels, .. }) = plan.facts.photos else {
        let reason = "It came without photos";
        return said("none", reason, "thumbnails, training, the search for objects", false);
    };
    let limit = plan.facts.limits.train_side_px;
    if longest_px <= limit {
        return said(format!("{w} x {h} px"), "Their full size", "", false);
    }
    let scale = f64::from(limit) / f64::from(w.max(h));
    let side = |s: u32| ((f64::from(s) * scale.min(1.0)).round() as u32).max(1);
    said(
        format!("{} x {} px", side(w), side(h)),
        format!("Training is set to {limit} px; the files have {w} x {h}"),
        bytes((pixels - limited_pixels) * 3),
        true,
    )
}

fn held(plan: &ScenePlan) -> Option<Said> {
    let photos = plan.facts.photos.as_ref()?;
    match (photos.photos, plan.holdout_every) {
        (1, _) => said("none", "The only photo is needed for training", "evaluations that nothing is left for", false),
        (_, 0) => said("none", "As set for training", "evaluations", false),
        (_, n) => said(format!("every {n}th photo"), "Quality is measured on what training has not seen", "", false),
    }
}

fn objects(plan: &ScenePlan) -> Option<Said> {
    let longest = plan.facts.photos.as_ref()?.longest_px;
    let resolved = plan.facts.cloud.as_ref()?.resolved_side_px?.max(super::LEAST_SIDE_PX);
    let limit = plan.facts.limits.object_side_px.min(longest);
    if resolved >= limit {
        let reason = format!("The Gaussians resolve {} px along the longer side", resolved.min(longest));
        return said(format!("{limit} px"), reason, "", false);
    }
    let share = 1.0 - (f64::from(resolved) / f64::from(limit)).powi(2);
    said(
        format!("{resolved} px"),
        format!("The Gaussians resolve no more of the {longest} px along the longer side"),
        format!("{:.0} % of the pixels of every view", share * 100.0),
        true,
    )
}

/// "3 parts", "1 part".
fn things(n: usize, what: &str) -> String {
    format!("{} {what}{}", count(n as u64), if n == 1 { "" } else { "s" })
}
