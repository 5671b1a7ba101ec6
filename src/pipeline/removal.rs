//! Takes objects or parts out of a scene and closes the surface that they hid.
//!
//! What was behind a thing and was seen in other photos is there already: taking its Gaussians away *uncovers* it. What
//! no photo ever saw has to be *invented*, and only that is. Where that is, is a matter of geometry: the point of a
//! surface is hidden if it lies behind the thing in every photo, seen if one shows it, and empty space if one looks
//! through it. So a surface near the thing is found as a plane ([`plane`]), divided into texels, each of which asks all
//! photos ([`sheet`]); hidden texels are painted from those that are seen ([`paint`]) and become flat Gaussians of
//! their own. The picture is painted on the surface, not in a view, so all views agree.
//!
//! Shadows and reflections of the thing on what stays are part of what the photos show, and stay, but for what touches
//! it.

mod extent;
mod paint;
mod plane;
pub(crate) mod score;
mod select;
mod sheet;
#[cfg(test)]
mod tests;
mod views;

use glam::{DMat3, DQuat, DVec3};
use serde::Serialize;

pub(crate) use paint::Paint;

use self::plane::Plane;
use self::sheet::{SurfaceSheet, Texel};
use self::views::SeenView;
use crate::math::grid;
use crate::math::sh::SH_C0;
use crate::pipeline::observer::{Interrupted, Observer, Ticker};
use crate::render::{RenderError, RenderSettings};
use crate::scene::{Camera, ExtraProperty, GaussianCloud, IdentityId, NOBODY, SemanticMap};

/// The extra property of Gaussians that were invented: 1, else 0.
pub(crate) const INVENTED: &str = "fmlgs_invented";

/// Surfaces that are closed at most.
const PLANES: usize = 4;
/// How far around a thing surfaces are looked for, in its radii.
const REACH: f64 = 3.0;
/// Standard deviation of a new Gaussian along the surface, in texels: neighbors overlap to an even cover.
const SPREAD: f64 = 0.6;
/// The same across the surface.
const THICKNESS: f64 = 0.1;
/// Opacity of 0.95, before the sigmoid.
const OPACITY_LOGIT: f32 = 2.944;

/// What is to be removed, and how.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RemovalOptions {
    /// Objects and parts.
    pub(crate) ids: Vec<IdentityId>,
    /// Whether its fringes go too: what is nobody's for sure within it, its foot on the surface and the shadow there.
    pub(crate) halo: bool,
    /// How hidden surfaces are painted; `None` = they stay open.
    pub(crate) paint: Option<Paint>,
    /// Seed of every random choice: another one gives another fill.
    pub(crate) seed: u64,
}

impl RemovalOptions {
    /// One identity with its fringes, painted as usual.
    pub(crate) fn of(id: IdentityId) -> Self {
        Self { ids: vec![id], halo: true, paint: Some(Paint::default()), seed: 0 }
    }
}

/// A surface that was closed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct ClosedSurface {
    /// New Gaussians.
    pub(crate) gaussians: usize,
    /// Their area, square scene units.
    pub(crate) area: f64,
    /// Distance of what is seen of the surface from the plane, median, scene units.
    pub(crate) unevenness: f64,
    /// The same as a share of the hole's diameter: from a tenth on the fill is a guess.
    pub(crate) roughness: f64,
}

/// What was done.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct RemovalReport {
    /// Gaussians of the thing.
    pub(crate) removed: usize,
    /// Gaussians of its fringes.
    pub(crate) fringes: usize,
    /// Gaussians that no photo has seen and that would be in sight now.
    pub(crate) unseen: usize,
    /// Gaussians that were of the thing for where they are: on the closed surfaces, and between them and the thing.
    pub(crate) left_over: usize,
    pub(crate) surfaces: Vec<ClosedSurface>,
    /// Seconds of each stage, in their order.
    pub(crate) secs: Vec<(String, f64)>,
}

impl RemovalReport {
    /// Gaussians that are not there any more.
    pub(crate) fn taken(&self) -> usize {
        self.removed + self.fringes + self.unseen + self.left_over
    }

    /// New Gaussians.
    pub(crate) fn invented(&self) -> usize {
        self.surfaces.iter().map(|s| s.gaussians).sum()
    }
}

/// A scene without a thing.
#[derive(Clone, Debug)]
pub(crate) struct Removed {
    /// The Gaussians that stay, in their order, then those that were invented.
    pub(crate) cloud: GaussianCloud,
    /// Indices of those that stay.
    pub(crate) kept: Vec<usize>,
    /// Whose each Gaussian is.
    pub(crate) identity_of: Vec<IdentityId>,
    pub(crate) report: RemovalReport,
}

/// Why nothing was removed.
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
    Render(#[from] RenderError),
    #[error("canceled")]
    Interrupted(#[from] Interrupted),
}

/// The full names of identities, one after the other.
pub(crate) fn names(map: &SemanticMap, ids: &[IdentityId]) -> String {
    ids.iter().map(|id| map.identities.full_name(*id)).collect::<Vec<_>>().join(", ")
}

/// Takes `options.ids` out of the scene that `photos` were taken of.
pub(crate) fn remove(
    cloud: &GaussianCloud,
    map: &SemanticMap,
    photos: &[Camera],
    settings: &RenderSettings,
    options: &RemovalOptions,
    observer: &mut dyn Observer,
) -> Result<Removed, RemovalError> {
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
    let mut new = Vec::new();
    if options.paint.is_some() || !photos.is_empty() {
        let cameras = views::choose(photos, &ball);
        if cameras.is_empty() && options.paint.is_some() {
            return Err(RemovalError::Unseen(name()));
        }
        let mut unseen = select::unseen(cloud, &gone, None, &cameras, settings, observer)?;
        // What is inside it would be taken for what is behind it.
        let inside: Vec<usize> = unseen.extract_if(.., |i| extent.contains(cloud.world_position(*i))).collect();
        inside.iter().for_each(|i| gone[*i] = true);
        report.unseen = inside.len();
        clock.stop("unseen");
        if let Some(paint) = options.paint {
            let seen = views::look(cloud, &gone, &cameras, settings, observer)?;
            clock.stop("look");
            let work = Closing {
                cloud,
                map,
                ball,
                extent: &extent,
                seen: &seen,
                paint,
                halo: options.halo,
                seed: options.seed,
            };
            new = work.run(&mut gone, &mut report, observer)?;
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
    Ok(Removed { cloud: with_new(cloud, &kept, &new), kept, identity_of, report })
}

/// A Gaussian that closes a piece of a surface.
struct Invented {
    position: DVec3,
    rotation: DQuat,
    /// Standard deviation along the surface, scene units.
    scale: f64,
    rgb: [f32; 3],
    identity: IdentityId,
}

/// The Gaussians at `kept`, and new ones.
fn with_new(cloud: &GaussianCloud, kept: &[usize], new: &[Invented]) -> GaussianCloud {
    let mut all = cloud.select(kept);
    if !all.extras.iter().any(|e| e.name == INVENTED) {
        all.extras.push(ExtraProperty { name: INVENTED.into(), values: vec![0.0; kept.len()] });
    }
    let stride = all.sh_stride();
    for one in new {
        all.positions.push((one.position - all.origin).as_vec3().to_array());
        let along = one.scale.ln() as f32;
        all.log_scales.push([along, along, (one.scale * THICKNESS / SPREAD).ln() as f32]);
        all.quaternions.push([one.rotation.w, one.rotation.x, one.rotation.y, one.rotation.z].map(|v| v as f32));
        all.opacity_logits.push(OPACITY_LOGIT);
        all.sh.push(one.rgb.map(|c| ((f64::from(c) - 0.5) / SH_C0) as f32));
        all.sh.extend(std::iter::repeat_n([0.0; 3], stride - 1));
    }
    for extra in &mut all.extras {
        let value = if extra.name == INVENTED { 1.0 } else { 0.0 };
        extra.values.resize(kept.len() + new.len(), value);
    }
    all
}

/// Finding the surfaces near a thing and closing what it hid of them.
struct Closing<'a> {
    cloud: &'a GaussianCloud,
    map: &'a SemanticMap,
    ball: extent::Ball,
    extent: &'a extent::ThingExtent,
    seen: &'a [SeenView],
    paint: Paint,
    halo: bool,
    seed: u64,
}

impl Closing<'_> {
    fn run(
        &self,
        gone: &mut [bool],
        report: &mut RemovalReport,
        observer: &mut dyn Observer,
    ) -> Result<Vec<Invented>, RemovalError> {
        let points = views::around(self.seen, &self.ball, REACH);
        let toward = self.seen.iter().map(|v| v.camera.center).sum::<DVec3>() / self.seen.len() as f64;
        let planes = plane::planes(&points, toward, self.ball.radius, PLANES, self.seed);
        let mut ticker = Ticker::new("Closing surfaces", planes.len());
        let mut new = Vec::new();
        for (k, plane) in planes.iter().enumerate() {
            ticker.tick(k, observer)?;
            let Some(mut sheet) = SurfaceSheet::find(plane, &self.ball, self.seen, REACH) else { continue };
            if self.halo {
                sheet.add_foot();
            }
            sheet.paint(self.paint, self.seed);
            let hole = sheet.hole().count();
            let area = hole as f64 * sheet.step * sheet.step;
            report.surfaces.push(ClosedSurface {
                gaussians: hole,
                area,
                unevenness: plane.residual,
                roughness: plane.residual / area.sqrt(),
            });
            let owners = self.owners(&sheet, plane, gone);
            for (i, gone) in gone.iter_mut().enumerate() {
                if !*gone && self.is_left_over(i, plane, &sheet, &owners) {
                    *gone = true;
                    report.left_over += 1;
                }
            }
            let rotation = DQuat::from_mat3(&DMat3::from_cols(plane.u, plane.v, plane.normal));
            new.extend(sheet.hole().map(|i| Invented {
                position: sheet.center(i),
                rotation,
                scale: sheet.step * SPREAD,
                rgb: sheet.color[i],
                identity: owners[i],
            }));
        }
        Ok(new)
    }

    /// Whether a Gaussian is a piece of a surface, which is seen where its near side is.
    fn lies_on(&self, plane: &Plane, i: usize) -> bool {
        let thickness = self.cloud.log_scales[i].iter().fold(f32::INFINITY, |a, b| a.min(*b)).exp();
        plane.height(self.cloud.world_position(i)).abs() <= plane.tolerance + f64::from(thickness)
    }

    /// Whether a Gaussian is of the thing for where it is: on the hidden part of the surface, where nobody has seen it and
    /// it would shine through, or between that and the thing's own surface, unless it is known to be of another object
    /// than the surface, such as an apple in a bowl.
    fn is_left_over(&self, i: usize, plane: &Plane, sheet: &SurfaceSheet<'_>, owners: &[IdentityId]) -> bool {
        let at = self.cloud.world_position(i);
        let Some(texel) = sheet.texel(at).filter(|t| sheet.state[*t] == Texel::Hidden) else { return false };
        if self.lies_on(plane, i) {
            let largest = self.cloud.log_scales[i].iter().fold(f32::NEG_INFINITY, |a, b| a.max(*b)).exp();
            // A large one at the border closes what is beside it.
            return sheet.is_deep(texel) || f64::from(largest) < sheet.step;
        }
        let object = |id: IdentityId| self.map.identities.object_of(id);
        let of = object(self.map.identity_of[i]);
        let above = plane.height(at) > 0.0 && self.extent.contains(at);
        above && (of == NOBODY || of == object(owners[texel]))
    }

    /// Whose each texel is: of the nearest Gaussian that lies on the surface.
    fn owners(&self, sheet: &SurfaceSheet, plane: &Plane, gone: &[bool]) -> Vec<IdentityId> {
        let on_it = (0..self.cloud.len()).filter(|i| !gone[*i]).filter_map(|i| {
            let texel = sheet.texel(self.cloud.world_position(i)).filter(|t| sheet.state[*t] == Texel::Seen)?;
            self.lies_on(plane, i).then_some((texel, self.map.identity_of[i]))
        });
        let found = grid::spread(sheet.size[0], sheet.state.len(), on_it, |_| true);
        found.into_iter().map(|owner| owner.unwrap_or_default()).collect()
    }
}

/// Seconds of stages, one after the other.
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
