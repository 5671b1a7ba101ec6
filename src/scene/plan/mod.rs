//! Decisions on what a scene needs, each with its reason and its saving.
//!
//! [`SceneFacts`] are gathered from the data once; [`ScenePlan::new`] is a pure function of them and of the user's
//! overrides. The program reads its decisions here and makes none of them itself.

mod facts;
mod item;
mod lines;
#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};

pub use facts::{
    CloudFacts, Limits, Machine, NOISE_FLOOR, PhotoFacts, SceneFacts, SemanticFacts, resolved_side_px, used_degree,
    visible_degree,
};
pub use item::{Item, Overrides, PlanOverride};

/// Time at which something is made or loaded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum When {
    /// Never: nothing in the scene can need it.
    #[default]
    Never,
    /// At first use.
    Used,
    /// As soon as something in the scene can need it.
    Always,
}

impl When {
    /// Returns whether it is to be made now, given whether it is `used`.
    pub fn now(self, used: bool) -> bool {
        match self {
            Self::Never => false,
            Self::Used => used,
            Self::Always => true,
        }
    }
}

/// One decision about a scene, for the user.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlanLine {
    pub(crate) item: Item,
    /// Its name: "Color", "Feature maps", ...
    pub(crate) subject: String,
    pub(crate) choice: String,
    pub(crate) reason: String,
    /// Saving, or the cost if the user overrides it; empty for nothing.
    pub(crate) saving: String,
    /// Alternative for the user, if it makes a difference.
    pub(crate) alternative: Option<String>,
    /// True if the user chose the alternative.
    pub overridden: bool,
}

/// The decisions for a scene.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ScenePlan {
    pub(crate) facts: SceneFacts,
    pub(crate) overrides: Overrides,
    /// Highest spherical-harmonics degree that is drawn.
    pub sh_degree: u8,
    /// Time at which identity maps of a view are drawn.
    pub maps: When,
    /// True if these maps have a level for parts.
    pub parts: bool,
    pub(crate) thumbnails: When,
    /// Time at which the text encoder is loaded.
    pub(crate) encoder: When,
    pub(crate) navigation: When,
    /// Time at which depth is drawn: at use, or with every picture.
    pub(crate) depth: When,
    /// Longer side of the images to train on, px.
    pub(crate) train_side_px: u32,
    /// Interval of held-out photos; 0 = none.
    pub(crate) holdout_every: usize,
    /// Longer side of the images in which objects are searched for, px.
    pub object_side_px: u32,
    /// Most Gaussians that training may use on this machine.
    pub(crate) max_gaussians: usize,
    /// True if the CPU is to draw even on a machine with a GPU.
    pub(crate) on_cpu: bool,
    /// Time at which the window is drawn: on change, or continuously.
    pub(crate) redraw: When,
    pub(crate) buffers: When,
    /// True if levels of detail are built, for moving cameras.
    pub(crate) levels: bool,
    pub(crate) lines: Vec<PlanLine>,
}

impl ScenePlan {
    /// Plan for these facts and the user's overrides.
    pub fn new(facts: SceneFacts, overrides: &Overrides) -> Self {
        let wants = |item: Item| overrides.has(item);
        let when = |there: bool, item: Item| match (there, wants(item)) {
            (false, _) => When::Never,
            (true, false) => When::Used,
            (true, true) => When::Always,
        };
        let semantics = facts.semantics.as_ref();
        let limits = facts.limits;
        let cameras = facts.photos.as_ref().map_or(0, |p| p.photos);
        let longest = facts.photos.as_ref().map_or(0, |p| p.longest_px);
        let resolved = facts.cloud.as_ref().and_then(|c| c.resolved_side_px).unwrap_or(u32::MAX);
        let mut plan = Self {
            sh_degree: match &facts.cloud {
                Some(c) if wants(Item::Color) => c.sh_used,
                Some(c) => c.sh_visible,
                None => limits.sh_degree,
            },
            maps: when(semantics.is_some(), Item::FeatureMaps),
            parts: semantics.is_some_and(|s| s.parts > 0 || wants(Item::Parts)),
            thumbnails: when(semantics.is_some(), Item::Thumbnails),
            encoder: when(semantics.is_some_and(|s| s.encoder.is_some()), Item::Encoder),
            navigation: when(semantics.is_some() && cameras > 0, Item::Navigation),
            depth: when(true, Item::Depth),
            train_side_px: if wants(Item::Photos) { longest.max(limits.train_side_px) } else { limits.train_side_px },
            holdout_every: holdout(cameras, limits.holdout_every),
            object_side_px: if wants(Item::Objects) {
                limits.object_side_px
            } else {
                limits.object_side_px.min(resolved.max(LEAST_SIDE_PX))
            },
            max_gaussians: facts.machine.max_gaussians,
            on_cpu: wants(Item::Backend),
            redraw: when(true, Item::Redraw),
            buffers: when(true, Item::Buffers),
            levels: facts.is_large(wants(Item::Backend)) || wants(Item::Levels),
            overrides: overrides.clone(),
            facts,
            lines: Vec::new(),
        };
        plan.lines = lines::of(&plan);
        plan
    }

    /// Line about an item.
    pub fn line(&self, item: Item) -> Option<&PlanLine> {
        self.lines.iter().find(|l| l.item == item)
    }
}

/// Least longer side of the images in which objects are searched for.
pub(crate) const LEAST_SIDE_PX: u32 = 256;

/// Interval of held-out photos if every `wanted`-th is asked for; 0 for a single photo, which training needs.
pub(crate) fn holdout(photos: usize, wanted: usize) -> usize {
    if photos > 1 { wanted } else { 0 }
}
