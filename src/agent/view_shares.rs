//! Components of a scene, and the share of a view that each identity covers: counted in a small render, once per view.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use glam::DVec3;

use crate::jobs::go_to::Explored;
use crate::jobs::query;
use crate::navigate::Pose;
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::render::RenderSettings;
use crate::scene::{Camera, GaussianCloud, IdentityId, SemanticMap};

/// Components of a scene.
pub struct AgentScene {
    pub cloud: Arc<GaussianCloud>,
    pub settings: RenderSettings,
    pub map: Arc<SemanticMap>,
    pub cameras: Vec<Camera>,
    pub up: DVec3,
    /// Length of a scene unit in meters, if known.
    pub meters: Option<f64>,
    pub exports: PathBuf,
    /// Folder of a trained scene.
    pub folder: Option<PathBuf>,
    /// Recipe of queries.
    pub recipe: QueryConfig,
    /// Occupied space of the scene, if it was computed before.
    pub explored: Option<Arc<Explored>>,
}

impl AgentScene {
    /// Indices of the Gaussians without the `hidden` ones; `None` if nothing is hidden.
    pub(super) fn drawn(&self, hidden: &[bool]) -> Option<Vec<usize>> {
        let of = &self.map.identity_of;
        let is_drawn = |i: &usize| of.get(*i).is_none_or(|id| hidden.get(*id as usize) != Some(&true));
        hidden.contains(&true).then(|| (0..self.cloud.len()).filter(is_drawn).collect())
    }
}

/// Longer side of the picture in which pixels of identities are counted, in px.
const COUNT_SIDE_PX: f64 = 256.0;

/// Cache of the shares in the last view.
#[derive(Default)]
pub(super) struct ViewShares(Mutex<Option<Counted>>);

/// Shares by identity, with their view.
struct Counted {
    eye: Pose,
    aspect: f64,
    hidden: Vec<bool>,
    shares: Vec<f64>,
}

impl ViewShares {
    /// Share of the view from `eye` that an identity covers, parts included; 0 for an unknown one.
    pub(crate) fn of(&self, parts: &AgentScene, eye: Pose, aspect: f64, hidden: &[bool], id: IdentityId) -> f64 {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let is_new = known.as_ref().is_none_or(|k| k.eye != eye || k.aspect != aspect || k.hidden != hidden);
        if is_new {
            *known = Some(Counted { eye, aspect, hidden: hidden.to_vec(), shares: count(parts, eye, aspect, hidden) });
        }
        known.as_ref().and_then(|k| k.shares.get(id as usize)).copied().unwrap_or(0.0)
    }
}

fn count(parts: &AgentScene, eye: Pose, aspect: f64, hidden: &[bool]) -> Vec<f64> {
    let AgentScene { cloud, settings, map, .. } = parts;
    let [w, h] = [aspect.min(1.0), 1.0 / aspect.max(1.0)].map(|s| (COUNT_SIDE_PX * s).max(1.0) as u32);
    let (camera, identities) = (eye.camera(w, h), &map.identities);
    let mut shares = vec![0.0; identities.len() + 1];
    let view = match parts.drawn(hidden) {
        Some(kept) => query::identities_in_view((&cloud.select(&kept), settings), &map.select(&kept), &camera),
        None => query::identities_in_view((cloud, settings), map, &camera),
    };
    // A view that cannot be rendered shows nothing.
    for id in view.map(|v| v.identity).unwrap_or_default() {
        identities.ancestors(id).for_each(|i| shares[i as usize] += 1.0);
    }
    shares.iter_mut().for_each(|s| *s /= f64::from(w * h));
    shares
}
