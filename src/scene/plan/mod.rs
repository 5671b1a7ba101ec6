//! Decisions on what a scene needs, each with its reason and its saving.
//!
//! [`SceneFacts`] are gathered from the data once; [`ScenePlan::new`] is a pure function of them and of the user's
//! overrides. The program reads its decisions here and makes none of them itself.

mod facts;
mod item;
mod lines;
#[cfg(test)]
mod tests;

use serde::Serialize;

pub use facts::{
    CloudFacts, Limits, Machine, NOISE_FLOOR, PhotoFacts, SceneFacts, SemanticFacts, resolved_side_px, used_degree,
    visible_degree,
};
pub use item::{Item, Overrides, PlanOverride};

/// Time at which something is made or loaded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
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
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct PlanLine {
    /// Its stable name: "color", "feature-maps", ...
    pub(crate) item: &'static str,
    /// Its name for the user: "Color", "Feature maps", ...
    pub(crate) subject: &'static str,
    pub(crate) choice: String,
    pub(crate) reason: String,
    /// Saving, or the cost if the user overrides it; empty for nothing.
    pub(crate) saving: String,
    /// Item that the user may override, if that makes a difference.
    pub(crate) overridable: Option<Item>,
    /// True if the user chose the alternative.
    pub overridden: bool,
}

/// The decisions for a scene.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ScenePlan {
    pub(crate) facts: SceneFacts,
    pub(crate) overrides: Overrides,
    /// Highest spherical-harmonics degree that is drawn.
    pub sh_degree: u8,
    /// Time at which identity maps of a view are drawn.
    pub maps: When,
    /// True if these maps have a level for parts.
    pub parts: bool,
    /// Time at which the text encoder is loaded.
    pub(crate) encoder: When,
    /// Longer side of the images to train on, px.
    pub(crate) train_side_px: u32,
    /// Interval of held-out photos; 0 = none.
    pub(crate) holdout_every: usize,
    /// Longer side of the images in which objects are searched for, px.
    pub object_side_px: u32,
    /// True if the CPU is to draw even on a machine with a GPU.
    pub(crate) on_cpu: bool,
    /// True if levels of detail are built, for moving cameras.
    pub(crate) levels: bool,
    pub(crate) lines: Vec<PlanLine>,
}

impl ScenePlan {
    /// Plan for these facts and the user's overrides.
    pub fn new(facts: SceneFacts, overrides: &Overrides) -> Self {
        let when = |needed: bool, item: Item| match (needed, overrides.has(item)) {
            (false, _) => When::Never,
            (true, false) => When::Used,
            (true, true) => When::Always,
        };
        let (limits, semantics, photos) = (facts.limits, facts.semantics.as_ref(), facts.photos.as_ref());
        let resolved = facts.cloud.as_ref().and_then(|c| c.resolved_side_px).unwrap_or(u32::MAX);
        let full_side = photos.filter(|_| overrides.has(Item::Photos)).map_or(0, |p| p.longest_px);
        let on_cpu = overrides.has(Item::Backend);
        let mut plan = Self {
            sh_degree: facts.cloud.as_ref().map_or(limits.sh_degree, |c| c.sh_visible),
            maps: when(semantics.is_some(), Item::FeatureMaps),
            parts: semantics.is_some_and(|s| s.parts > 0),
            encoder: when(semantics.is_some_and(|s| s.encoder.is_some()), Item::Encoder),
            train_side_px: limits.train_side_px.max(full_side),
            holdout_every: holdout(photos.map_or(0, |p| p.photos), limits.holdout_every),
            object_side_px: limits.object_side_px.min(resolved.max(LEAST_SIDE_PX)),
            on_cpu,
            levels: facts.is_large(on_cpu) || overrides.has(Item::Levels),
            overrides: overrides.clone(),
            facts,
            lines: Vec::new(),
        };
        plan.lines = lines::of(&plan);
        plan
    }

    /// Line about an item, by its stable name.
    pub fn line(&self, item: &str) -> Option<&PlanLine> {
        self.lines.iter().find(|l| l.item == item)
    }
}

/// Least longer side of the images in which objects are searched for.
pub(crate) const LEAST_SIDE_PX: u32 = 256;

/// Interval of held-out photos if every `wanted`-th is asked for; 0 for a single photo, which training needs.
pub(crate) fn holdout(photos: usize, wanted: usize) -> usize {
    if photos > 1 { wanted } else { 0 }
}
