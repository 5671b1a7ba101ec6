//! Selecting by clicks and strokes: the Gaussians that are meant, and objects and parts as they would be with them.

use std::sync::Arc;
use std::time::Instant;

use glam::DMat3;

use super::JobError;
use crate::pipeline::observer::Observer;
use crate::pipeline::semantics::edit::{self, Edit};
use crate::pipeline::semantics::splat_tree::hierarchy::Hierarchy;
pub use crate::pipeline::semantics::splat_tree::marks::Stroke;
use crate::pipeline::semantics::splat_tree::marks::StrokeMarks;
use crate::pipeline::semantics::timing::ms_since;
use crate::render::{RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud, HomeView, Identities, IdentityId, NOBODY, SemanticMap};

/// What the selection is to become.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SelectFor {
    /// A new part of this identity; of nobody, an object.
    New(IdentityId),
    /// The extent of this identity, which it begins with.
    Extent(IdentityId),
}

/// What is to be done for a selection.
#[derive(Clone, Debug)]
pub enum SelectStep {
    /// Make ready for the first stroke.
    Prepare,
    /// Take in a further stroke.
    Stroke(Stroke),
    /// Take the last one back.
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
    /// Objects and parts as they are.
    pub(crate) map: Arc<SemanticMap>,
    pub(crate) purpose: SelectFor,
    /// What was made ready for these Gaussians before, and what was marked.
    pub(crate) before: Option<Arc<Selected>>,
    pub(crate) step: SelectStep,
}

/// What clicks and strokes select.
#[derive(Clone, Debug)]
pub struct Selected {
    hierarchy: Arc<Hierarchy>,
    /// The Gaussians that it is of.
    cloud: Arc<GaussianCloud>,
    marks: StrokeMarks,
    /// Indices, rising.
    pub(crate) gaussians: Vec<u32>,
    /// Objects and parts as they would be with it, and which of them it would be; `NOBODY` if nothing is selected.
    pub(crate) preview: Arc<SemanticMap>,
    pub(crate) id: IdentityId,
    /// Milliseconds from the stroke to the Gaussians, where everything was ready.
    pub(crate) ms: f64,
}

impl Selected {
    /// Strokes so far.
    pub(crate) fn strokes(&self) -> usize {
        self.marks.len()
    }

    /// Nothing selected, with all that was made ready.
    pub(crate) fn begun_anew(&self) -> Self {
        Self { marks: StrokeMarks::default(), gaussians: Vec::new(), id: NOBODY, ..self.clone() }
    }

    /// Whether it was made ready for these Gaussians.
    pub(crate) fn is_of(&self, cloud: &Arc<GaussianCloud>) -> bool {
        Arc::ptr_eq(&self.cloud, cloud)
    }

    /// Whether the other was made ready with it, once for both.
    pub(crate) fn shares(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.hierarchy, &other.hierarchy)
    }
}

/// Adds the stroke, or takes the last one back.
pub(crate) fn run(request: &SelectRequest, observer: &mut dyn Observer) -> Result<Selected, JobError> {
    let SelectRequest { cloud, settings, map, purpose, before, step, .. } = request;
    // Where the Gaussians have changed meanwhile, what hangs together is looked at anew.
    let hierarchy = match before.as_ref().filter(|before| before.is_of(cloud)) {
        Some(before) => Arc::clone(&before.hierarchy),
        None => Arc::new(Hierarchy::new(cloud, &views(&request.cameras, &request.home), settings, observer)?),
    };
    let start = Instant::now();
    // Marks name Gaussians by number.
    let before = before.as_ref().filter(|before| before.hierarchy.gaussians() == cloud.len());
    let mut marks = before.map(|b| b.marks.clone()).unwrap_or_default();
    match step {
        SelectStep::Prepare => {
            let (cloud, preview) = (Arc::clone(cloud), Arc::clone(map));
            return Ok(Selected { hierarchy, cloud, marks, gaussians: Vec::new(), preview, id: NOBODY, ms: 0.0 });
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
        (Arc::clone(map), NOBODY)
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

/// The edit that keeps what is selected.
pub(crate) fn kept_as(purpose: &SelectFor, name: String, gaussians: Vec<u32>) -> Edit {
    match purpose {
        SelectFor::New(of) => Edit::AddPiece { of: *of, name, gaussians },
        SelectFor::Extent(id) => Edit::Reshape { id: *id, gaussians },
    }
}

/// Objects and parts of a scene in which none were found.
pub(crate) fn empty_map(cloud: &GaussianCloud) -> SemanticMap {
    let n = cloud.len();
    SemanticMap::from_identities(Identities::default(), vec![NOBODY; n], vec![0.0; n], Vec::new())
}

/// Views from all around where there are no photos.
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
