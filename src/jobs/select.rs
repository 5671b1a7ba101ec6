//! Selection of Gaussians by clicks, strokes and areas: the selected ones, and a preview of objects and parts with them.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DMat3;

use super::{JobError, export};
use crate::io::{atomic, files};
use crate::math::format::capital;
use crate::pipeline::cleaning::neighbors::SplatNeighbors;
use crate::pipeline::observer::{Observer, Severity};
use crate::pipeline::semantics::lifting::edit::{self, Edit};
use crate::pipeline::semantics::lifting::splat_tree::hierarchy::Hierarchy;
pub use crate::pipeline::semantics::lifting::splat_tree::marks::Stroke;
use crate::pipeline::semantics::lifting::splat_tree::marks::StrokeMarks;
use crate::pipeline::semantics::lifting::splat_tree::others::OtherIdentities;
pub(crate) use crate::pipeline::semantics::lifting::splat_tree::selection::MarkEffect;
use crate::pipeline::semantics::lifting::splat_tree::selection::MarkedSplats;
use crate::pipeline::semantics::lifting::splat_tree::stored;
use crate::render::{RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud, HomeView, Identities, IdentityId, NO_IDENTITY, SemanticMap};

/// Largest kept preparation, bytes.
const MAX_KEPT_BYTES: u64 = 4 << 30;

/// Purpose of a selection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SelectFor {
    /// A new part of this identity; for `NO_IDENTITY`, a new object.
    New(IdentityId),
    /// The extent of this identity, which is the initial selection.
    Extent(IdentityId),
}

/// Change of a selection.
#[derive(Clone, Debug)]
pub enum SelectStep {
    /// A click or line on what to add or remove; the only one that needs a preparation.
    Stroke(Stroke),
    /// These Gaussians (indices) are added.
    Add(Vec<u32>),
    /// These Gaussians are removed.
    Remove(Vec<u32>),
    /// The neighbors of the selected Gaussians are added.
    Grow,
    /// Gaussians with an unselected neighbor are removed.
    Shrink,
    /// The last change is undone.
    TakeBack,
}

/// Request to prepare a scene for strokes.
#[derive(Clone, Debug)]
pub struct PrepareRequest {
    pub(crate) cloud: Arc<GaussianCloud>,
    pub(crate) settings: RenderSettings,
    /// The photos' cameras, possibly none.
    pub(crate) cameras: Vec<Camera>,
    pub(crate) home: HomeView,
    /// File that keeps the preparation, if the scene has a place for it.
    pub(crate) file: Option<PathBuf>,
}

/// Preparation of a scene for strokes.
#[derive(Clone, Debug)]
pub struct PreparedScene {
    hierarchy: Arc<Hierarchy>,
    /// The scene's Gaussians.
    cloud: Arc<GaussianCloud>,
    /// True if it was kept from before.
    pub(crate) is_kept: bool,
}

impl PreparedScene {
    /// Returns whether it was made for these Gaussians.
    pub(crate) fn is_of(&self, cloud: &Arc<GaussianCloud>) -> bool {
        Arc::ptr_eq(&self.cloud, cloud)
    }
}

/// A step of a selection.
#[derive(Clone, Debug)]
pub struct SelectRequest {
    pub(crate) cloud: Arc<GaussianCloud>,
    pub(crate) settings: RenderSettings,
    /// Current objects and parts.
    pub(crate) map: Arc<SemanticMap>,
    pub(crate) purpose: SelectFor,
    /// Preparation for these Gaussians; a stroke needs it.
    pub(crate) prepared: Option<Arc<PreparedScene>>,
    /// The selection so far.
    pub(crate) before: Option<Arc<Selected>>,
    pub(crate) step: SelectStep,
}

/// A selection: Gaussians that were given or added, and strokes since.
#[derive(Clone, Debug, Default)]
struct Marked {
    from: Arc<Vec<usize>>,
    marks: StrokeMarks,
}

/// Result of the steps of a selection.
#[derive(Clone, Debug)]
pub struct Selected {
    now: Marked,
    /// Selections before each step other than a stroke.
    earlier: Vec<Marked>,
    /// Number of the scene's Gaussians.
    of: usize,
    /// Neighbors of the Gaussians, once it has grown or shrunk.
    neighbors: Option<Arc<SplatNeighbors>>,
    /// Indices of the selected Gaussians, ascending.
    pub(crate) gaussians: Vec<u32>,
    /// Effect of the last of the strokes beside the selection itself; nothing without strokes.
    pub(crate) effect: MarkEffect,
    /// Objects and parts with the selection, and its identity among them; `NO_IDENTITY` if nothing is selected.
    pub(crate) preview: Arc<SemanticMap>,
    pub(crate) id: IdentityId,
}

impl Selected {
    /// Number of steps so far.
    pub(crate) fn steps(&self) -> usize {
        self.now.marks.len() + self.earlier.iter().map(|m| m.marks.len() + 1).sum::<usize>()
    }
}

/// Prepares a scene for strokes, once: the result is kept in its file.
pub(crate) fn prepare(request: &PrepareRequest, observer: &mut dyn Observer) -> Result<PreparedScene, JobError> {
    let PrepareRequest { cloud, settings, cameras, home, file } = request;
    let views = views(cameras, home);
    let of = stored::digest(cloud, &views, settings);
    let kept = file.as_ref().and_then(|file| files::read(file, MAX_KEPT_BYTES).ok());
    let kept = kept.and_then(|bytes| Hierarchy::decode(&bytes, &of, cloud.len()));
    let is_kept = kept.is_some();
    let hierarchy = match kept {
        Some(kept) => kept,
        None => {
            let made = Hierarchy::new(cloud, &views, settings, observer)?;
            if let Some((file, bytes)) = file.as_ref().zip(made.encode(&of))
                && let Err(e) = export::make_parent(file).map_err(JobError::from).and_then(|()| keep(file, &bytes))
            {
                observer.note(Severity::Warning, format!("the preparation is not kept for the next time: {e}"));
            }
            made
        }
    };
    Ok(PreparedScene { hierarchy: Arc::new(hierarchy), cloud: Arc::clone(cloud), is_kept })
}

fn keep(file: &Path, bytes: &[u8]) -> Result<(), JobError> {
    Ok(atomic::write(file, |w| w.write_all(bytes))?)
}

/// Carries out a step of a selection.
pub(crate) fn run(request: &SelectRequest, observer: &mut dyn Observer) -> Result<Selected, JobError> {
    let SelectRequest { cloud, settings, map, purpose, prepared, before, step } = request;
    // Steps refer to Gaussians by number.
    let (mut now, mut earlier, mut neighbors) = match before.as_ref().filter(|before| before.of == cloud.len()) {
        Some(before) => (before.now.clone(), before.earlier.clone(), before.neighbors.clone()),
        None => (Marked { from: Arc::new(extent(map, purpose, cloud)), ..Marked::default() }, Vec::new(), None),
    };
    let hierarchy = prepared.as_ref().filter(|p| p.is_of(cloud)).map(|p| &*p.hierarchy);
    let others = match purpose {
        SelectFor::Extent(id) => OtherIdentities::new(map, *id),
        SelectFor::New(_) => OtherIdentities::default(),
    };
    let marked = |now: &Marked| match (hierarchy.filter(|_| now.marks.len() > 0), purpose) {
        (Some(hierarchy), SelectFor::Extent(_)) => hierarchy.correct(&now.marks, &now.from, &others),
        (Some(hierarchy), SelectFor::New(_)) => hierarchy.select(&now.marks, &now.from),
        (None, _) => MarkedSplats { is_in: mask(cloud.len(), &now.from), ..MarkedSplats::default() },
    };
    let selected = |now: &Marked| marked(now).is_in;
    let change = match step {
        SelectStep::Stroke(stroke) => {
            now.marks.add(&mut Renderer::new(), cloud, settings, stroke)?;
            None
        }
        SelectStep::TakeBack => {
            match now.marks.len() {
                0 => now = earlier.pop().unwrap_or(now),
                _ => now.marks.remove_last(),
            }
            None
        }
        SelectStep::Add(these) | SelectStep::Remove(these) => {
            let mut of = selected(&now);
            let is_in = matches!(step, SelectStep::Add(_));
            these.iter().for_each(|i| of.get_mut(*i as usize).into_iter().for_each(|of| *of = is_in));
            Some(of)
        }
        SelectStep::Grow | SelectStep::Shrink => {
            let near = match neighbors.take() {
                Some(near) => near,
                None => Arc::new(SplatNeighbors::new(cloud, observer)?),
            };
            let of = selected(&now);
            let of = if matches!(step, SelectStep::Grow) { near.grown(&of) } else { near.shrunk(&of) };
            neighbors = Some(near);
            Some(of)
        }
    };
    if let Some(of) = change {
        earlier.push(now);
        now = Marked { from: Arc::new((0..of.len()).filter(|i| of[*i]).collect()), ..Marked::default() };
    }
    let MarkedSplats { is_in: of, effect } = marked(&now);
    if matches!(step, SelectStep::Stroke(_)) {
        let told = effect.sentences(&|id| map.identities.full_name(id));
        told.into_iter().flatten().for_each(|text| observer.note(Severity::Info, capital(&text)));
    }
    let gaussians: Vec<u32> = (0..cloud.len() as u32).filter(|i| of[*i as usize]).collect();
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
    Ok(Selected { now, earlier, of: cloud.len(), neighbors, gaussians, effect, preview, id })
}

/// Returns the Gaussians with which a selection begins, indices.
fn extent(map: &SemanticMap, purpose: &SelectFor, cloud: &GaussianCloud) -> Vec<usize> {
    match purpose {
        SelectFor::Extent(id) => map.members(*id).into_iter().filter(|i| *i < cloud.len()).collect(),
        SelectFor::New(_) => Vec::new(),
    }
}

/// Returns a mask of `n` with the Gaussians `of`.
fn mask(n: usize, of: &[usize]) -> Vec<bool> {
    let mut mask = vec![false; n];
    of.iter().for_each(|i| mask[*i] = true);
    mask
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
