//! Search for the surfaces near a removed thing, removal of its shadow, and filling of the hidden areas.

use std::collections::HashMap;

use glam::{DMat3, DQuat, DVec3};

use super::extent::{Ball, ThingExtent};
use super::occlusion::Occluder;
use super::plane::{self, Plane};
use super::rebuild::{NewGaussian, SPREAD, shown};
use super::shade::Brightening;
use super::sheet::{SurfaceTexture, Texel};
use super::views::{self, SeenView};
use super::{ClosedSurface, Paint, RemovalError, RemovalOptions, RemovalReport};
use crate::math::grid;
use crate::math::rotation::matrix_from_quaternion;
use crate::models::lama::Lama;
use crate::pipeline::observer::{Observer, Ticker};
use crate::scene::{GaussianCloud, IdentityId, NO_IDENTITY, SemanticMap};

/// Most surfaces that are closed.
const PLANES: usize = 4;
/// Distance around a thing at which surfaces are searched, in its radii.
const REACH: f64 = 3.0;
/// Distance up to which the light of a surface is fitted, and up to which occluders are considered, in its radii.
const LIT_REACH: f64 = 5.0;
const SHADING_REACH: f64 = 10.0;
/// Radius of an occluder of light, in standard deviations.
const FOOTPRINT: f64 = 1.5;
/// Distance across a surface at which a Gaussian below it shows through, in standard deviations.
const PIERCING: f64 = 2.0;

/// Inputs for finding and closing the surfaces.
pub(super) struct HoleFilling<'a> {
    pub(super) cloud: &'a GaussianCloud,
    pub(super) map: &'a SemanticMap,
    pub(super) ball: Ball,
    pub(super) extent: &'a ThingExtent,
    pub(super) seen: &'a [SeenView],
    pub(super) paint: Paint,
    pub(super) options: &'a RemovalOptions,
}

impl HoleFilling<'_> {
    pub(super) fn run(
        &self,
        gone: &mut [bool],
        gains: &mut [[f32; 3]],
        report: &mut RemovalReport,
        mut network: Option<&mut Lama>,
        observer: &mut dyn Observer,
    ) -> Result<Vec<NewGaussian>, RemovalError> {
        let points = views::around(self.seen, &self.ball, REACH);
        let toward = self.seen.iter().map(|v| v.camera.center).sum::<DVec3>() / self.seen.len() as f64;
        let planes = plane::planes(&points, toward, self.ball.radius, PLANES, self.options.seed);
        let mut ticker = Ticker::new("Closing surfaces", planes.len());
        let mut new = Vec::new();
        for (k, plane) in planes.iter().enumerate() {
            ticker.tick(k, observer)?;
            let wide = SurfaceTexture::around(plane, &self.ball, self.seen, LIT_REACH);
            let brightening = if self.options.lift_shadow { self.brightening(&wide, plane, gone) } else { None };
            if let Some(brightening) = &brightening {
                for (i, gain) in gains.iter_mut().enumerate() {
                    // Larger planes come first; at an edge, a Gaussian is brightened by one of them only.
                    if !gone[i] && *gain == [1.0; 3] && self.lies_on(plane, i) {
                        *gain = brightening.at(self.cloud.world_position(i), shown(self.cloud, i));
                    }
                }
            }
            let Some(mut sheet) = wide.hidden_part(&self.ball, self.seen) else { continue };
            let owners = self.owners(&sheet, plane, gone);
            let of = self.main_object(&sheet, &owners);
            let own: Vec<bool> = owners.iter().map(|id| Some(self.map.identities.object_of(*id)) == of).collect();
            if let Some(brightening) = &brightening {
                sheet.brighten(&own, |point, rgb| brightening.at(point, rgb));
            }
            if self.options.halo {
                sheet.add_foot();
            }
            sheet.paint(self.paint, &own, self.options.seed, network.as_deref_mut())?;
            let drawn: Vec<(usize, bool)> = sheet.drawn().collect();
            let hole = drawn.iter().filter(|d| d.1).count();
            let area = hole as f64 * sheet.step * sheet.step;
            report.surfaces.push(ClosedSurface {
                gaussians: hole,
                area,
                unevenness: plane.residual,
                roughness: plane.residual / area.sqrt(),
            });
            report.redrawn += drawn.len() - hole;
            for (i, gone) in gone.iter_mut().enumerate() {
                if !*gone && self.is_left_over(i, plane, &sheet, &owners) {
                    *gone = true;
                    report.left_over += 1;
                }
            }
            let rotation = DQuat::from_mat3(&DMat3::from_cols(plane.u, plane.v, plane.normal));
            new.extend(drawn.into_iter().map(|(i, is_invented)| NewGaussian {
                position: sheet.center(i),
                rotation,
                scale: sheet.step * SPREAD,
                rgb: sheet.color[i],
                identity: owners[i],
                is_invented,
            }));
        }
        Ok(new)
    }

    /// Returns the brightening of a surface without the thing's shadow, if a shadow is found on it.
    fn brightening<'s>(&self, wide: &'s SurfaceTexture<'s>, plane: &Plane, gone: &[bool]) -> Option<Brightening<'s>> {
        let cloud = self.cloud;
        let is_near = |at: DVec3| at.distance(self.ball.center) < SHADING_REACH * self.ball.radius;
        let occluder = |i: usize| {
            let at = cloud.world_position(i);
            let opaque = cloud.opacity_logits[i] > 0.0 && is_near(at) && plane.height(at) > plane.tolerance;
            let mut sd = cloud.log_scales[i].map(|s| f64::from(s.exp()));
            sd.sort_by(f64::total_cmp);
            opaque.then_some(Occluder { at, radius: FOOTPRINT * sd[1], is_thing: gone[i] })
        };
        let occluders: Vec<Occluder> = (0..cloud.len()).filter_map(occluder).collect();
        let owners = self.owners(wide, plane, gone);
        let of = self.main_object(wide, &owners)?;
        let same = |i: usize| self.map.identities.object_of(owners[i]) == of;
        let near = |i: usize| wide.center(i).distance(self.ball.center) < REACH * self.ball.radius;
        Brightening::find(plane, wide, same, near, &occluders)
    }

    /// Returns the object that most of the seen texels belong to.
    fn main_object(&self, sheet: &SurfaceTexture<'_>, owners: &[IdentityId]) -> Option<IdentityId> {
        let mut count: HashMap<IdentityId, usize> = HashMap::new();
        let seen = owners.iter().zip(&sheet.state).filter(|(_, state)| **state == Texel::Seen);
        seen.for_each(|(id, _)| *count.entry(self.map.identities.object_of(*id)).or_default() += 1);
        count.into_iter().max_by_key(|(id, n)| (*n, *id)).map(|most| most.0)
    }

    /// Returns whether a Gaussian is a piece of a surface, which is seen at its near side.
    fn lies_on(&self, plane: &Plane, i: usize) -> bool {
        let thickness = self.cloud.log_scales[i].iter().fold(f32::INFINITY, |a, b| a.min(*b)).exp();
        plane.height(self.cloud.world_position(i)).abs() <= plane.tolerance + f64::from(thickness)
    }

    /// Returns the standard deviation of a Gaussian across a surface, scene units.
    fn deviation_across(&self, plane: &Plane, i: usize) -> f64 {
        let Some(rows) = matrix_from_quaternion(self.cloud.quaternions[i].map(f64::from)) else { return 0.0 };
        let sd = DVec3::from(self.cloud.log_scales[i].map(|s| f64::from(s.exp())));
        // The rows of the rotation as columns are its inverse.
        (DMat3::from_cols_array_2d(&rows) * plane.normal * sd).length()
    }

    /// Returns whether a Gaussian has to go by its place: on a part of the surface that is drawn anew, below it so that
    /// it would show through, or between a hidden part and the thing's own surface. Gaussians of another object than
    /// the surface's, such as an apple in a bowl, stay.
    fn is_left_over(&self, i: usize, plane: &Plane, sheet: &SurfaceTexture<'_>, owners: &[IdentityId]) -> bool {
        let at = self.cloud.world_position(i);
        let Some(texel) = sheet.texel(at).filter(|t| sheet.state[*t].is_drawn()) else { return false };
        let object = |id: IdentityId| self.map.identities.object_of(id);
        let (of, height) = (object(self.map.identity_of[i]), plane.height(at));
        let is_others = of != NO_IDENTITY && of != object(owners[texel]);
        if is_others && sheet.state[texel] == Texel::Shaded {
            return false;
        }
        if height < 0.0 && height + PIERCING * self.deviation_across(plane, i) > 0.0 && sheet.is_deep(texel) {
            return true;
        }
        if self.lies_on(plane, i) {
            let largest = self.cloud.log_scales[i].iter().fold(f32::NEG_INFINITY, |a, b| a.max(*b)).exp();
            // A large Gaussian at the border covers the area beside it.
            return sheet.is_deep(texel) || f64::from(largest) < sheet.step;
        }
        height > 0.0 && self.extent.contains(at) && !is_others
    }

    /// Returns the identity of each texel: that of the nearest Gaussian on the surface.
    fn owners(&self, sheet: &SurfaceTexture, plane: &Plane, gone: &[bool]) -> Vec<IdentityId> {
        let on_it = (0..self.cloud.len()).filter(|i| !gone[*i]).filter_map(|i| {
            let texel = sheet.texel(self.cloud.world_position(i)).filter(|t| sheet.state[*t].is_surface())?;
            self.lies_on(plane, i).then_some((texel, self.map.identity_of[i]))
        });
        let found = grid::spread(sheet.size[0], sheet.state.len(), on_it, |_| true);
        found.into_iter().map(|owner| owner.unwrap_or_default()).collect()
    }
}
