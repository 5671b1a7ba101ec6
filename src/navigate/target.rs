//! Best views of a target: much of it, large, from its front, from near photos, with room around the camera, and from
//! the side that was asked for.

use glam::DVec3;
use rayon::prelude::*;

use super::occupancy::OccupancyGrid;
use super::pose::Pose;
pub use super::preference::Side;
pub(crate) use super::preference::ViewPreference;
use super::preference::{fit, wanted};
use crate::render::{Features, RenderError, RenderSettings, Renderer};
use crate::scene::{Bounds, Camera, GaussianCloud};

/// Directions that are tried.
const DIRECTIONS: usize = 160;
/// Points of the target that are tested for visibility.
const POINTS: usize = 96;
/// Share of the picture's shorter side that the target fills.
const FILL: f64 = 0.5;
/// Distances that are tried, as multiples of the one at which the target fills that.
const DISTANCES: [f64; 6] = [0.5, 0.7, 1.0, 1.4, 2.0, 3.0];
/// Candidates that are drawn to be compared.
const DRAWN: usize = 8;
/// Longer side of those pictures, px.
const DRAWN_PX: u32 = 128;
/// Angle to the nearest photo at which a view is trusted half as much, radians.
const PHOTO_ANGLE: f64 = 0.6;

/// Gaussians of a target.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TargetGaussians {
    /// Gaussians of it by number, rising.
    pub(crate) members: Vec<usize>,
    /// Middle of the object that it is a part of, if it is one.
    pub(crate) whole: Option<DVec3>,
}

/// A view of a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TargetView {
    pub(crate) pose: Pose,
    /// Share of its picture alone that is still seen in the scene, 0 to 1.
    pub(crate) visible: f64,
    /// Share of the picture that it covers, 0 to 1.
    pub(crate) covers: f64,
    /// Distance of the eye to occupied space, scene units.
    pub(crate) clearance: f64,
    /// Score of all criteria together; comparable within one search.
    pub(crate) score: f64,
}

/// Inputs of a search for views.
pub(crate) struct Search<'a> {
    pub(crate) cloud: &'a GaussianCloud,
    /// Settings that the Gaussians are drawn with.
    pub(crate) settings: &'a RenderSettings,
    /// Occupied space.
    pub(crate) occupancy: &'a OccupancyGrid,
    /// The photos' cameras.
    pub(crate) cameras: &'a [Camera],
    /// World up direction.
    pub(crate) up: DVec3,
    /// Distance to occupied space that the eye keeps.
    pub(crate) clearance: f64,
}

impl Search<'_> {
    /// Views of a target, best first; none if it is visible from no free place. `eye` is the present pose, `aspect`
    /// width by height of the picture.
    ///
    /// # Errors
    /// If a view cannot be drawn.
    pub(crate) fn views(
        &self,
        target: &TargetGaussians,
        preference: ViewPreference,
        eye: &Pose,
        aspect: f64,
    ) -> Result<Vec<TargetView>, RenderError> {
        let place = |i: &usize| self.cloud.world_position(*i);
        let inside = target.members.iter().filter(|i| **i < self.cloud.len());
        let Some(bounds) = Bounds::robust(inside.clone().map(place)) else { return Ok(Vec::new()) };
        let center = bounds.center();
        let members: Vec<DVec3> = inside.map(place).collect();
        let stride = members.len().div_ceil(POINTS).max(1);
        let points: Vec<DVec3> = members.into_iter().step_by(stride).collect();
        let half = 0.5 * eye.fov_y_rad;
        let narrow = half.min((half.tan() * aspect).atan());
        let radius = bounds.radius().max(0.5 * self.occupancy.voxel());
        let usual = radius / (FILL * narrow.tan());
        // No camera may be nearer than this.
        let least = self.clearance + 0.5 * self.occupancy.voxel();
        let now = (eye.center - center).try_normalize().unwrap_or(-eye.forward());
        let front = self.front(target, center);
        let wanted = wanted(preference.side, now, front, self.up);
        let distance = usual * preference.distance.clamp(0.05, 50.0);
        let directions = directions(DIRECTIONS).chain(wanted).chain([now]);
        let mut rough: Vec<(f64, DVec3)> = directions
            .collect::<Vec<_>>()
            .into_par_iter()
            .flat_map_iter(|d| DISTANCES.iter().map(move |k| (d, (k * distance).max(least))))
            .filter_map(|(direction, distance)| {
                let at = center + direction * distance;
                let fits = fit(preference.side, wanted, now, direction)?;
                let clearance = self.occupancy.clearance(at);
                if clearance < self.clearance {
                    return None;
                }
                let skip = 1.5 * self.occupancy.voxel();
                let light = |p: &DVec3| self.occupancy.transmittance(at, *p, skip);
                let visible = points.iter().map(light).sum::<f64>() / points.len() as f64;
                let size = usual * preference.distance / distance;
                let size = size.min(1.0 / size);
                let facing = front.map_or(0.5, |f| 0.5 + 0.5 * f.dot(direction));
                let room = (clearance / (4.0 * self.clearance.max(1e-9))).min(1.0);
                let near = self.seen_by_photos(center, at);
                let score = fits
                    * visible
                    * (0.3 + 0.7 * near)
                    * (0.6 + 0.4 * facing)
                    * (0.4 + 0.6 * size)
                    * (0.8 + 0.2 * room);
                (score > 0.0).then_some((score, at))
            })
            .collect();
        rough.sort_by(|a, b| b.0.total_cmp(&a.0));
        let (width, height) = if aspect >= 1.0 {
            (DRAWN_PX, (f64::from(DRAWN_PX) / aspect).round().max(1.0) as u32)
        } else {
            ((f64::from(DRAWN_PX) * aspect).round().max(1.0) as u32, DRAWN_PX)
        };
        let mut drawing = Drawing::new(self, target);
        let mut views = Vec::with_capacity(DRAWN);
        for (score, at) in spread_out(&rough, center) {
            let pose = Pose::looking_at(at, center, self.up, eye.fov_y_rad, &eye.world_from_camera);
            let (visible, covers) = drawing.look(&pose.camera(width, height))?;
            // The picture shows what the grid is too coarse for.
            let score = score * (0.05 + visible);
            views.push(TargetView { pose, visible, covers, clearance: self.occupancy.clearance(at), score });
        }
        views.sort_by(|a, b| b.score.total_cmp(&a.score));
        Ok(views)
    }

    /// The direction in which a target faces.
    fn front(&self, target: &TargetGaussians, center: DVec3) -> Option<DVec3> {
        if let Some(outwards) = target.whole.and_then(|whole| (center - whole).try_normalize()) {
            return Some(outwards);
        }
        let sum: DVec3 = self.cameras.iter().filter_map(|c| (c.center - center).try_normalize()).sum();
        // Photos from all around have no front.
        (sum.length() > 0.2 * self.cameras.len() as f64).then(|| sum.normalize_or_zero())
    }

    /// Nearness of a photo to the view of `center` from `at`, 0 to 1; 1 without photos.
    fn seen_by_photos(&self, center: DVec3, at: DVec3) -> f64 {
        if self.cameras.is_empty() {
            return 1.0;
        }
        let angle = |c: &Camera| (c.center - center).angle_between(at - center);
        let least = self.cameras.iter().map(angle).filter(|a| a.is_finite()).fold(std::f64::consts::PI, f64::min);
        1.0 / (1.0 + (least / PHOTO_ANGLE).powi(2))
    }
}

/// The best candidates of the list, no two of them alike.
fn spread_out(rough: &[(f64, DVec3)], center: DVec3) -> Vec<(f64, DVec3)> {
    let mut chosen: Vec<(f64, DVec3)> = Vec::new();
    for &(score, at) in rough {
        let alike = |c: &(f64, DVec3)| {
            let apart = (c.1 - center).angle_between(at - center);
            apart < 0.15 && (c.1.distance(center) / at.distance(center)).ln().abs() < 0.2
        };
        if !chosen.iter().any(alike) {
            chosen.push((score, at));
        }
        if chosen.len() == DRAWN {
            break;
        }
    }
    chosen
}

/// Directions evenly spread over the sphere (Fibonacci's).
fn directions(n: usize) -> impl Iterator<Item = DVec3> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    (0..n).map(move |i| {
        let z = 1.0 - 2.0 * (i as f64 + 0.5) / n as f64;
        let r = (1.0 - z * z).sqrt();
        let angle = golden * i as f64;
        DVec3::new(r * angle.cos(), r * angle.sin(), z)
    })
}

/// Draws a target in the scene and alone.
struct Drawing<'a> {
    renderer: Renderer,
    scene: &'a GaussianCloud,
    settings: RenderSettings,
    alone: GaussianCloud,
    /// 1 for Gaussians of the target.
    inside: Vec<f32>,
}

impl<'a> Drawing<'a> {
    fn new(search: &Search<'a>, target: &TargetGaussians) -> Self {
        let mut inside = vec![0.0; search.cloud.len()];
        let members: Vec<usize> = target.members.iter().copied().filter(|i| *i < inside.len()).collect();
        members.iter().for_each(|i| inside[*i] = 1.0);
        let settings = RenderSettings { sh_degree: 0, depth: false, ..search.settings.clone() };
        let alone = search.cloud.select(&members);
        Self { renderer: Renderer::new(), scene: search.cloud, settings, alone, inside }
    }

    /// Share of the target that is seen, and share of the picture that it covers.
    fn look(&mut self, camera: &Camera) -> Result<(f64, f64), RenderError> {
        let features = Features { channels: 1, values: &self.inside };
        let frame = self.renderer.render(self.scene, features, camera, &self.settings)?;
        let seen: f64 = frame.features[0].iter().map(|v| f64::from(*v)).sum();
        let alone = self.renderer.render(&self.alone, Features::NONE, camera, &self.settings)?;
        let all: f64 = alone.alpha.iter().map(|v| f64::from(*v)).sum();
        let pixels = (frame.width_px * frame.height_px) as f64;
        Ok((if all > 0.0 { (seen / all).min(1.0) } else { 0.0 }, seen / pixels.max(1.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigate::testing::{camera_at, cloud_of_wall, joined};
    use glam::DMat3;

    /// A ball of Gaussians behind a wall, seen from its side of the wall only.
    fn scene() -> (GaussianCloud, TargetGaussians, Vec<Camera>) {
        let mut ball = GaussianCloud::default();
        for d in directions(120) {
            ball.positions.push((d * 0.2 + DVec3::Z * 1.0).to_array().map(|v| v as f32));
            ball.log_scales.push([0.03_f32.ln(); 3]);
            ball.quaternions.push([1.0, 0.0, 0.0, 0.0]);
            ball.opacity_logits.push(4.0);
            ball.sh.push([0.5; 3]);
        }
        let wall = cloud_of_wall(0.0);
        let members = (wall.len()..wall.len() + 120).collect();
        let cameras = [[0.0, 0.0, 3.0], [1.5, 0.0, 2.0], [-1.5, 0.3, 2.0], [0.0, 0.0, -2.0]];
        (
            joined(&wall, &ball),
            TargetGaussians { members, whole: None },
            cameras.map(|c| camera_at(DVec3::from_array(c))).to_vec(),
        )
    }

    fn best(preference: ViewPreference, from: DVec3) -> TargetView {
        let (cloud, target, cameras) = scene();
        let eyes: Vec<DVec3> = cameras.iter().map(|c| c.center).collect();
        let occupancy = OccupancyGrid::of(&cloud, &eyes, 0.05);
        let settings = RenderSettings::default();
        let search = Search {
            cloud: &cloud,
            settings: &settings,
            occupancy: &occupancy,
            cameras: &cameras,
            up: DVec3::NEG_Y,
            clearance: 0.05,
        };
        let eye = Pose::looking_at(from, DVec3::Z, DVec3::NEG_Y, 0.8, &DMat3::IDENTITY);
        *search.views(&target, preference, &eye, 4.0 / 3.0).expect("drawn").first().expect("a view")
    }

    #[test]
    fn the_target_is_seen_from_its_side_of_the_wall() {
        let view = best(ViewPreference::default(), DVec3::new(0.0, 0.0, -2.0));
        assert!(view.visible > 0.8, "{view:?}");
        assert!(view.pose.center.z > 0.1, "beyond the wall: {view:?}");
        assert!(view.pose.forward().angle_between(DVec3::Z - view.pose.center) < 0.1);
        assert!(view.covers > 0.02 && view.covers < 0.6, "{view:?}");
    }

    #[test]
    fn sides_and_distances_are_as_wished() {
        let eye = DVec3::new(0.0, 0.0, 3.0);
        let side =
            |side: Side| (best(ViewPreference { side, distance: 1.0 }, eye).pose.center - DVec3::Z).normalize_or_zero();
        assert!(side(Side::Same).z > 0.8);
        assert!(side(Side::Above).y < -0.5, "{}", side(Side::Above));
        // The eye looks along -z with -y upwards: its left is +x... seen from behind the camera.
        let (left, right) = (side(Side::Left), side(Side::Right));
        assert!(left.x * right.x < 0.0 && left.x.abs() > 0.5, "{left} {right}");
        let pose = Pose::looking_at(eye, DVec3::Z, DVec3::NEG_Y, 0.8, &DMat3::IDENTITY);
        assert!(left.dot(pose.world_from_camera.x_axis) < -0.5, "left is left in the picture");
        let far = best(ViewPreference { side: Side::Same, distance: 1.2 }, eye).pose.center.distance(DVec3::Z);
        let near = best(ViewPreference { side: Side::Same, distance: 0.6 }, eye).pose.center.distance(DVec3::Z);
        assert!(far > 1.4 * near, "{far} {near}");
    }

    #[test]
    fn a_target_without_gaussians_has_no_view() {
        let (cloud, _, cameras) = scene();
        let occupancy = OccupancyGrid::of(&cloud, &[DVec3::Z], 0.05);
        let settings = RenderSettings::default();
        let search = Search {
            cloud: &cloud,
            settings: &settings,
            occupancy: &occupancy,
            cameras: &cameras,
            up: DVec3::Z,
            clearance: 0.05,
        };
        let eye = Pose::of(&cameras[0]);
        for members in [vec![], vec![usize::MAX]] {
            let none = search
                .views(&TargetGaussians { members, whole: None }, ViewPreference::default(), &eye, 1.0)
                .expect("drawn");
            assert!(none.is_empty());
        }
    }
}
