//! Selection by clicks and strokes: the selected Gaussians, and a preview of objects and parts with them.

use std::sync::Arc;
use std::time::Instant;

use glam::DMat3;

use super::JobError;
use crate::pipeline::observer::Observer;
use crate::pipeline::semantics::lifting::edit::{self, Edit};
use crate::pipeline::semantics::lifting::splat_tree::hierarchy::Hierarchy;
pub use crate::pipeline::semantics::lifting::splat_tree::marks::Stroke;
use crate::pipeline::semantics::lifting::splat_tree::marks::StrokeMarks;
use crate::pipeline::semantics::query::timing::ms_since;
use crate::render::{RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud, HomeView, Identities, IdentityId, NO_IDENTITY, SemanticMap};

/// Purpose of a selection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SelectFor {
    /// A new part of this identity; for `NO_IDENTITY`, a new object.
    New(IdentityId),
    /// The extent of this identity, which is the initial selection.
    Extent(IdentityId),
}

/// Action of a selection step.
#[derive(Clone, Debug)]
pub enum SelectStep {
    /// Prepare for the first stroke.
    Prepare,
    /// Add a stroke.
    Stroke(Stroke),
    /// Undo the last stroke.
    TakeBack,
}

/// A step of a selection.
#[derive(Clone, Debug)]
pub struct SelectRequest {
    pub(crate) cloud: Arc<GaussianCloud>,
    pub(crate) settings: RenderSettings,
    /// The photos' cameras, possibly none.
    pub(crate) cameras: Vec<Camera>,
    pub(crate) home: HomeView,
    /// Current objects and parts.
    pub(crate) map: Arc<SemanticMap>,
    pub(crate) purpose: SelectFor,
    /// Preparations and strokes of earlier steps.
    pub(crate) before: Option<Arc<Selected>>,
    pub(crate) step: SelectStep,
}

/// Result of clicks and strokes.
#[derive(Clone, Debug)]
pub struct Selected {
    hierarchy: Arc<Hierarchy>,
    /// The selected scene's Gaussians.
    cloud: Arc<GaussianCloud>,
    marks: StrokeMarks,
    /// Indices of the selected Gaussians, ascending.
    pub(crate) gaussians: Vec<u32>,
    /// Objects and parts with the selection, and its identity among them; `NO_IDENTITY` if nothing is selected.
    pub(crate) preview: Arc<SemanticMap>,
    pub(crate) id: IdentityId,
    /// Milliseconds from the stroke to the Gaussians, once all is prepared.
    pub(crate) ms: f64,
}

impl Selected {
    /// Number of strokes so far.
    pub(crate) fn strokes(&self) -> usize {
        self.marks.len()
    }

    /// Returns an empty selection with all preparations.
    pub(crate) fn begun_anew(&self) -> Self {
        Self { marks: StrokeMarks::default(), gaussians: Vec::new(), id: NO_IDENTITY, ..self.clone() }
    }

    /// Returns whether it was prepared for these Gaussians.
    pub(crate) fn is_of(&self, cloud: &Arc<GaussianCloud>) -> bool {
        Arc::ptr_eq(&self.cloud, cloud)
    }

    /// Returns whether both share one preparation.
    pub(crate) fn shares(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.hierarchy, &other.hierarchy)
    }
}

/// Adds the stroke, or undoes the last one.
pub(crate) fn run(request: &SelectRequest, observer: &mut dyn Observer) -> Result<Selected, JobError> {
    let SelectRequest { cloud, settings, map, purpose, before, step, .. } = request;
    // If the Gaussians have changed meanwhile, their hierarchy is built anew.
    let hierarchy = match before.as_ref().filter(|before| before.is_of(cloud)) {
        Some(before) => Arc::clone(&before.hierarchy),
        None => Arc::new(Hierarchy::new(cloud, &views(&request.cameras, &request.home), settings, observer)?),
    };
    let start = Instant::now();
    // Strokes refer to Gaussians by number.
    let before = before.as_ref().filter(|before| before.hierarchy.gaussians() == cloud.len());
    let mut marks = before.map(|b| b.marks.clone()).unwrap_or_default();
    match step {
        SelectStep::Prepare => {
            let (cloud, preview) = (Arc::clone(cloud), Arc::clone(map));
            return Ok(Selected { hierarchy, cloud, marks, gaussians: Vec::new(), preview, id: NO_IDENTITY, ms: 0.0 });
        }
        SelectStep::Stroke(stroke) => marks.add(&mut Renderer::new(), cloud, settings, stroke)?,
        SelectStep::TakeBack => marks.remove_last(),
    }
    let from = match purpose {
        SelectFor::Extent(id) => map.members(*id).into_iter().filter(|i| *i < cloud.len()).collect(),
        SelectFor::New(_) => Vec::new(),
    };
    let selected = hierarchy.select(&marks, &from);
    let gaussians: Vec<u32> = (0..cloud.len() as u32).filter(|i| selected[*i as usize]).collect();
    let ms = ms_since(start);
    let (preview, id) = if gaussians.is_empty() {
        (Arc::clone(map), NO_IDENTITY)
    } else {
        let preview = edit::apply(map, cloud, &kept_as(purpose, String::new(), gaussians.clone()))?;
        let id = match purpose {
            SelectFor::Extent(id) => *id,
            SelectFor::New(_) => preview.identities.len() as IdentityId,
        };
        (Arc::new(preview), id)
    };
    Ok(Selected { hierarchy, cloud: Arc::clone(cloud), marks, gaussians, preview, id, ms })
}

/// Returns the edit that stores the selection.
pub(crate) fn kept_as(purpose: &SelectFor, name: String, gaussians: Vec<u32>) -> Edit {
    match purpose {
        SelectFor::New(of) => Edit::AddPiece { of: *of, name, gaussians },
        SelectFor::Extent(id) => Edit::Reshape { id: *id, gaussians },
    }
}

/// Returns a map of a scene without objects and parts.
pub(crate) fn empty_map(cloud: &GaussianCloud) -> SemanticMap {
    let n = cloud.len();
    SemanticMap::from_identities(Identities::default(), vec![NO_IDENTITY; n], vec![0.0; n], Vec::new())
}

/// Number of views all around, if there are no photos.
const AROUND: u32 = 24;

fn views(cameras: &[Camera], home: &HomeView) -> Vec<Camera> {
    if !cameras.is_empty() {
        return cameras.to_vec();
    }
    let first = HomeView::overview(&home.bounds, home.up, [640, 480]);
    let middle = home.bounds.center();
    let turned = |k: u32| {
        let turn = DMat3::from_axis_angle(home.up, std::f64::consts::TAU * f64::from(k) / f64::from(AROUND));
        Camera {
            center: middle + turn * (first.center - middle),
            world_from_camera: turn * first.world_from_camera,
            ..first.clone()
        }
    };
    (0..AROUND).map(turned).collect()
}
