//! What a scene needs and what is left out, each with its reason and what it saves.
//!
//! [`SceneFacts`] are gathered from the data once; [`ScenePlan::new`] is a pure function of them and of
//! what the user wants instead. The program reads its decisions here and makes none of them itself.

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

/// When something is made or loaded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum When {
    /// There is nothing that it could be for.
    #[default]
    Never,
    /// When it is used first.
    Used,
    /// As soon as there is something that it could be for.
    Always,
}

impl When {
    /// Whether it is to be made now, where it is `used` or not.
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
    /// What it saves, or what it costs where the user wants it otherwise; empty for nothing.
    pub(crate) saving: String,
    /// What the user can have instead, where that makes a difference.
    pub(crate) alternative: Option<String>,
    /// Whether the user wants it otherwise.
    pub overridden: bool,
}

/// The decisions for a scene.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ScenePlan {
    pub(crate) facts: SceneFacts,
    pub(crate) overrides: Overrides,
    /// Highest spherical-harmonics degree that is drawn.
    pub sh_degree: u8,
    /// When maps of a view's identities are drawn.
    pub maps: When,
    /// Whether these maps have a level for parts.
    pub parts: bool,
    pub(crate) thumbnails: When,
    /// When the encoder of typed phrases is loaded.
    pub(crate) encoder: When,
    pub(crate) navigation: When,
    /// When depth is drawn: as it is used, or with every picture.
    pub(crate) depth: When,
    /// Longer side of the images to train on, px.
    pub(crate) train_side_px: u32,
    /// Every how-manieth photo is held out; 0 = none.
    pub(crate) holdout_every: usize,
    /// Longer side of the images in which objects are looked for, px.
    pub object_side_px: u32,
    /// Most Gaussians that training may use on this machine.
    pub(crate) max_gaussians: usize,
    /// Whether the CPU is to draw even where there is a GPU.
    pub(crate) on_cpu: bool,
    /// When the window is drawn: as something changes, or all the time.
    pub(crate) redraw: When,
    pub(crate) buffers: When,
    /// Whether levels of detail are built to move by.
    pub(crate) levels: bool,
    pub(crate) lines: Vec<PlanLine>,
}

impl ScenePlan {
    /// The plan for these facts, except for what the user wants otherwise.
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

    /// The line about this.
    pub fn line(&self, item: Item) -> Option<&PlanLine> {
        self.lines.iter().find(|l| l.item == item)
    }
}

/// Objects are never looked for in images smaller than this along their longer side.
pub(crate) const LEAST_SIDE_PX: u32 = 256;

/// Every how-manieth of `photos` is held out where every `wanted`-th was asked for: a single one is
/// all there is to train on.
pub(crate) fn holdout(photos: usize, wanted: usize) -> usize {
    if photos > 1 { wanted } else { 0 }
}
