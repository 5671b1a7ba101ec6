//! Removal of objects or parts from a scene, and completion of the surfaces that they hid.
//!
//! Background behind the object that other photos show is in the scene already: removing the object's Gaussians
//! *uncovers* it. Only regions that no photo shows are *invented*. Geometry decides: a point of a surface is hidden if
//! it lies behind the object in every photo, seen if one photo shows it, and empty space if one looks through it. So a
//! surface near the object is fitted as a plane ([`plane`]) and divided into texels, each tested in all photos
//! ([`sheet`]). Hidden texels are painted from the seen ones ([`paint`]) and become flat Gaussians of their own. The
//! texture is painted on the surface, not in a view, so all views agree.
//!
//! The object's shadow on a flat surface is lifted, as far as its blocking of the light explains it ([`shade`]). Where
//! the shadow is deep, the surface is drawn anew from the photos' lifted colors. The object's other shadows and
//! its reflections stay.
//!
//! New Gaussians of hidden surfaces are marked as invented in the cloud. The scene from which a thing is removed is
//! never written to.

mod close;
mod extent;
mod light;
mod occlusion;
mod paint;
mod plane;
mod rebuild;
pub(crate) mod score;
mod select;
mod shade;
mod sheet;
#[cfg(test)]
mod tests;
mod views;

use serde::Serialize;

pub(crate) use paint::Paint;
pub(crate) use rebuild::{INVENTED, invented_flags};
pub(crate) use select::members;

use self::close::HoleFilling;
use self::rebuild::{brighten, with_new};
use crate::models::ModelError;
use crate::models::lama::Lama;
use crate::pipeline::observer::{Interrupted, Observer};
use crate::render::{RenderError, RenderSettings};
use crate::scene::{Camera, GaussianCloud, IdentityId, SemanticMap};

/// Settings of a removal.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct RemovalOptions {
    /// Objects and parts.
    pub(crate) ids: Vec<IdentityId>,
    /// True if fringes go too: unlabeled Gaussians within the object, and its foot and shadow on the surface.
    pub(crate) halo: bool,
    /// True if its shadow on flat surfaces is lifted.
    pub(crate) lift_shadow: bool,
    /// Inpainting method of hidden surfaces; `None` = they stay open.
    pub(crate) paint: Option<Paint>,
    /// Random seed; another seed gives another fill.
    pub(crate) seed: u64,
}

impl RemovalOptions {
    /// Default settings for these identities: with fringes and shadows, and default inpainting.
    pub(crate) fn of(ids: &[IdentityId]) -> Self {
        Self { ids: ids.to_vec(), halo: true, lift_shadow: true, paint: Some(Paint::default()), seed: 0 }
    }
}

/// Completed surface.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct ClosedSurface {
    /// New Gaussians of its hidden pieces.
    pub(crate) gaussians: usize,
    /// Their area, square scene units.
    pub(crate) area: f64,
    /// Median distance of the seen surface from the plane, scene units.
    pub(crate) unevenness: f64,
    /// Unevenness as a fraction of the hole's diameter; from a tenth on the fill is a guess.
    pub(crate) roughness: f64,
}

/// Report of a removal.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct RemovalReport {
    /// Gaussians of the removed identities.
    pub(crate) removed: usize,
    /// Gaussians of their fringes.
    pub(crate) fringes: usize,
    /// Gaussians that no photo shows and that would be visible now.
    pub(crate) unseen: usize,
    /// Gaussians that go by position: on the surfaces that are drawn anew, at their back, and between them and the
    /// object.
    pub(crate) left_over: usize,
    /// New Gaussians of surfaces that the photos show, in the deep shadow of the object.
    pub(crate) redrawn: usize,
    /// Gaussians that were brightened to lift the shadow.
    pub(crate) brightened: usize,
    pub(crate) surfaces: Vec<ClosedSurface>,
    /// Seconds of each stage, in order.
    pub(crate) secs: Vec<(String, f64)>,
}

impl RemovalReport {
    /// Number of removed Gaussians.
    pub(crate) fn taken(&self) -> usize {
        self.removed + self.fringes + self.unseen + self.left_over
    }

    /// New Gaussians of hidden pieces.
    pub(crate) fn invented(&self) -> usize {
        self.surfaces.iter().map(|s| s.gaussians).sum()
    }
}

/// Scene after a removal.
#[derive(Clone, Debug)]
pub(crate) struct RemovalResult {
    /// Kept Gaussians in their order, then the new ones.
    pub(crate) cloud: GaussianCloud,
    /// Indices of the kept Gaussians.
    pub(crate) kept: Vec<usize>,
    /// Identity of each Gaussian.
    pub(crate) identity_of: Vec<IdentityId>,
    pub(crate) report: RemovalReport,
}

/// Reasons for which nothing was removed.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum RemovalError {
    #[error("'{0}' has no Gaussians")]
    Nothing(String),
    #[error("'{0}' is all that the scene consists of; nothing would be left")]
    Everything(String),
    #[error("none of the scene's photos looks at '{0}', so what it hides is not known; remove it with --fill none")]
    Unseen(String),
    #[error(transparent)]
    Network(#[from] ModelError),
    #[error(transparent)]
    Render(#[from] RenderError),
    #[error("canceled")]
    Interrupted(#[from] Interrupted),
}

/// Full names of identities, separated by commas.
pub(crate) fn names(map: &SemanticMap, ids: &[IdentityId]) -> String {
    ids.iter().map(|id| map.identities.full_name(*id)).collect::<Vec<_>>().join(", ")
}

/// Removes `options.ids` from a scene with the camera poses `photos`. `network` is the inpainter for [`Paint::Lama`].
pub(crate) fn remove(
    cloud: &GaussianCloud,
    map: &SemanticMap,
    photos: &[Camera],
    settings: &RenderSettings,
    options: &RemovalOptions,
    network: Option<&mut Lama>,
    observer: &mut dyn Observer,
) -> Result<RemovalResult, RemovalError> {
    let name = || names(map, &options.ids);
    let mut clock = Clock::default();
    let thing = select::members(map, &options.ids);
    let removed = thing.iter().filter(|is| **is).count();
    if removed == 0 {
        return Err(RemovalError::Nothing(name()));
    }
    let ball = extent::Ball::of(cloud, &thing);
    let extent = extent::ThingExtent::of(cloud, &thing);
    let mut gone = thing;
    let fringes = if options.halo { select::add_fringes(cloud, map, (&ball, &extent), &mut gone) } else { 0 };
    clock.stop("select");
    let mut report = RemovalReport { removed, fringes, ..RemovalReport::default() };
    let (mut new, mut gains) = (Vec::new(), vec![[1.0; 3]; cloud.len()]);
    if options.paint.is_some() || !photos.is_empty() {
        let cameras = views::choose(photos, &ball);
        if cameras.is_empty() && options.paint.is_some() {
            return Err(RemovalError::Unseen(name()));
        }
        let mut unseen = select::unseen(cloud, &gone, None, &cameras, settings, observer)?;
        // Unseen Gaussians inside the object would be taken for background.
        let inside: Vec<usize> = unseen.extract_if(.., |i| extent.contains(cloud.world_position(*i))).collect();
        inside.iter().for_each(|i| gone[*i] = true);
        report.unseen = inside.len();
        clock.stop("unseen");
        if let Some(paint) = options.paint {
            let seen = views::look(cloud, &gone, &cameras, settings, observer)?;
            clock.stop("look");
            let work = HoleFilling { cloud, map, ball, extent: &extent, seen: &seen, paint, options };
            new = work.run(&mut gone, &mut gains, &mut report, network, observer)?;
            clock.stop("close");
        }
        if !unseen.is_empty() {
            // Closed surfaces may hide the rest of it as well.
            let kept: Vec<usize> = (0..cloud.len()).filter(|&i| !gone[i]).collect();
            let now = with_new(cloud, &kept, &new);
            unseen = select::unseen(cloud, &gone, Some(&now), &cameras, settings, observer)?;
            unseen.iter().for_each(|i| gone[*i] = true);
            report.unseen += unseen.len();
            clock.stop("unseen again");
        }
    }
    let kept: Vec<usize> = (0..cloud.len()).filter(|&i| !gone[i]).collect();
    if kept.is_empty() {
        return Err(RemovalError::Everything(name()));
    }
    report.secs = clock.0;
    let identity_of = kept.iter().map(|&i| map.identity_of[i]).chain(new.iter().map(|n| n.identity)).collect();
    let mut left = with_new(cloud, &kept, &new);
    for (k, gain) in kept.iter().map(|i| gains[*i]).enumerate().filter(|(_, gain)| *gain != [1.0; 3]) {
        report.brightened += 1;
        brighten(&mut left, k, gain);
    }
    Ok(RemovalResult { cloud: left, kept, identity_of, report })
}

/// Timer of successive stages, seconds.
struct Clock(Vec<(String, f64)>, std::time::Instant);

impl Default for Clock {
    fn default() -> Self {
        Self(Vec::new(), std::time::Instant::now())
    }
}

impl Clock {
    fn stop(&mut self, stage: &str) {
        let start = std::mem::replace(&mut self.1, std::time::Instant::now());
        self.0.push((stage.to_owned(), start.elapsed().as_secs_f64()));
    }
}
