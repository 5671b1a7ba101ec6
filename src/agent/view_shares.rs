//! What a scene is made of, and which share of a view each identity covers: drawn small and counted, once per
//! view.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use glam::DVec3;

use crate::jobs::go_to::Explored;
use crate::jobs::query;
use crate::navigate::Pose;
use crate::pipeline::semantics::recipe::Recipe;
use crate::render::RenderSettings;
use crate::scene::{Bounds, Camera, GaussianCloud, IdentityId, SemanticMap};

/// What a scene is made of.
pub struct Parts {
    pub cloud: Arc<GaussianCloud>,
    pub settings: RenderSettings,
    pub map: Arc<SemanticMap>,
    pub cameras: Vec<Camera>,
    pub up: DVec3,
    /// Length of a unit in meters, if that is known.
    pub meters: Option<f64>,
    pub exports: PathBuf,
    /// Folder of the trained scene, if it is one.
    pub folder: Option<PathBuf>,
    /// How questions are answered.
    pub recipe: Recipe,
    /// What is known of moving about, if the scene was looked at before.
    pub explored: Option<Arc<Explored>>,
}

impl Parts {
    /// The boxes of all identities, by number.
    pub(super) fn bounds(&self) -> Vec<Option<Bounds>> {
        let Self { cloud, map, .. } = self;
        let mut places: Vec<Vec<DVec3>> = vec![Vec::new(); map.identities.len() + 1];
        for (i, &id) in map.identity_of.iter().enumerate().take(cloud.len()) {
            map.identities.ancestors(id).for_each(|id| places[id as usize].push(cloud.world_position(i)));
        }
        places.into_iter().map(Bounds::robust).collect()
    }
}

/// Longer side of the picture in which pixels of identities are counted, px.
const COUNT_SIDE_PX: f64 = 256.0;

/// The shares of the last view that was asked about.
#[derive(Default)]
pub(super) struct ViewShares(Mutex<Option<Counted>>);

/// Shares by number, with their view.
struct Counted {
    eye: Pose,
    hidden: Vec<bool>,
    shares: Vec<f64>,
}

impl ViewShares {
    /// The share of the view from `eye` that an identity covers, pieces included; 0 of one that is not known.
    pub(crate) fn of(&self, parts: &Parts, eye: Pose, aspect: f64, hidden: &[bool], id: IdentityId) -> f64 {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let is_new = known.as_ref().is_none_or(|k| k.eye != eye || k.hidden != hidden);
        if is_new {
            *known = Some(Counted { eye, hidden: hidden.to_vec(), shares: count(parts, eye, aspect, hidden) });
        }
        known.as_ref().and_then(|k| k.shares.get(id as usize)).copied().unwrap_or(0.0)
    }
}

fn count(parts: &Parts, eye: Pose, aspect: f64, hidden: &[bool]) -> Vec<f64> {
    let Parts { cloud, settings, map, .. } = parts;
    let [w, h] = [aspect.min(1.0), 1.0 / aspect.max(1.0)].map(|s| (COUNT_SIDE_PX * s).max(1.0) as u32);
    let (camera, identities) = (eye.camera(w, h), &map.identities);
    let mut shares = vec![0.0; identities.len() + 1];
    let view = if hidden.contains(&true) {
        let is_kept = |i: &usize| map.identity_of.get(*i).is_none_or(|id| hidden.get(*id as usize) != Some(&true));
        let kept: Vec<usize> = (0..cloud.len()).filter(is_kept).collect();
        query::identities_in_view((&cloud.select(&kept), settings), &map.select(&kept), &camera)
    } else {
        query::identities_in_view((cloud, settings), map, &camera)
    };
    // A view that cannot be drawn shows nothing.
    for id in view.map(|v| v.identity).unwrap_or_default() {
        identities.ancestors(id).for_each(|i| shares[i as usize] += 1.0);
    }
    shares.iter_mut().for_each(|s| *s /= f64::from(w * h));
    shares
}
