//! Comparison of found poses with given ones, after the similarity that brings the centers together best.

use std::collections::HashMap;

use glam::{DMat3, DQuat, DVec2, DVec3};
use serde::Serialize;

use crate::jobs::JobError;
use crate::math::rotation::{nearest_rotation, rotation_error};
use crate::math::stats::{mean, median, worst};
use crate::navigate::pose;
use crate::scene::{Camera, Dataset, Photo, rig};

/// Fewest photos that can be aligned.
const FEWEST: usize = 3;

/// Differences of found poses from given ones.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct PoseComparison {
    /// Number of photos of which both poses are known.
    pub(crate) photos: usize,
    /// Number of given poses.
    pub(crate) given: usize,
    /// Median and largest distance of the centers, in radii of the given ones.
    pub(crate) center: [f64; 2],
    /// Median and largest angle between the rotations, degrees, of the middles of the pictures.
    pub(crate) rotation_deg: [f64; 2],
    /// Median focal length of the found cameras over that of the given ones.
    pub(crate) focal_ratio: f64,
}

/// Compares poses of the same photos.
///
/// # Errors
/// If fewer than three photos are in both.
pub(crate) fn compare(found: &Dataset, given: &Dataset) -> Result<PoseComparison, JobError> {
    let pairs = pairs(&found.photos, &given.photos);
    let too_few = || {
        JobError::Output(format!(
            "only {} photos of '{}' are also in '{}'; they are compared by name, frames of a video by their number",
            pairs.len(),
            found.name,
            given.name
        ))
    };
    if pairs.len() < FEWEST {
        return Err(too_few());
    }
    let centers: Vec<[DVec3; 2]> = pairs.iter().map(|(f, g)| [f.center, g.center]).collect();
    // A pose far from all others is wrong; it counts, but would turn and shrink the others.
    let stray = rig::strays(&centers.iter().map(|[found, _]| *found).collect::<Vec<_>>());
    let usual: Vec<_> = centers.iter().zip(&stray).filter(|(_, stray)| !**stray).map(|(pair, _)| *pair).collect();
    let fit = Similarity::fit(&usual).ok_or_else(too_few)?;
    let (_, radius) = Camera::extent_of(pairs.iter().map(|(_, g)| *g));
    let distances: Vec<f64> = centers.iter().map(|[f, g]| fit.apply(*f).distance(*g) / radius).collect();
    let angle =
        |(f, g): &(&Camera, &Camera)| pose::angle(&(fit.rotation * toward_middle(f)), &toward_middle(g)).to_degrees();
    let angles: Vec<f64> = pairs.iter().map(angle).collect();
    let ratios: Vec<f64> = pairs
        .iter()
        .map(|(f, g)| f.focal_px.x / f64::from(f.width_px) * f64::from(g.width_px) / g.focal_px.x)
        .collect();
    Ok(PoseComparison {
        photos: pairs.len(),
        given: given.photos.len(),
        center: [median(&distances), worst(distances)],
        rotation_deg: [median(&angles), worst(angles)],
        focal_ratio: median(&ratios),
    })
}

/// Rotation of a camera, turned so that its axis goes through the middle of the picture. A principal point elsewhere is
/// the same as a turn, and makers that keep it in the middle are not wrong for that.
fn toward_middle(camera: &Camera) -> DMat3 {
    let middle = DVec2::new(f64::from(camera.width_px), f64::from(camera.height_px)) / 2.0;
    let ray = ((middle - camera.principal_px) / camera.focal_px).extend(1.0).normalize_or(DVec3::Z);
    camera.world_from_camera * DMat3::from_quat(DQuat::from_rotation_arc(DVec3::Z, ray))
}

/// Cameras of the same photo: of one name, or a frame of a video and the photo with its number in the list.
fn pairs<'a>(found: &'a [Photo], given: &'a [Photo]) -> Vec<(&'a Camera, &'a Camera)> {
    let stem = |photo: &Photo| {
        let name = photo.name.rsplit('/').next().unwrap_or(&photo.name);
        name.rsplit_once('.').map_or(name, |(stem, _)| stem).to_owned()
    };
    let by_name: HashMap<String, &Camera> = given.iter().map(|p| (stem(p), &p.camera)).collect();
    let named: Vec<_> = found.iter().filter_map(|p| Some((&p.camera, *by_name.get(&stem(p))?))).collect();
    if !named.is_empty() {
        return named;
    }
    let number = |photo: &Photo| stem(photo).strip_prefix("frame_")?.parse::<usize>().ok();
    found.iter().filter_map(|p| Some((&p.camera, &given.get(number(p)?)?.camera))).collect()
}

/// Scale, rotation and shift.
struct Similarity {
    scale: f64,
    rotation: DMat3,
    /// Middle of the points before and after.
    middles: [DVec3; 2],
}

impl Similarity {
    /// The one that brings the first points nearest to the second ones in least squares (Umeyama 1991); `None` if they
    /// lie on a line or are mirrored.
    fn fit(pairs: &[[DVec3; 2]]) -> Option<Self> {
        let middle = |k: usize| pairs.iter().map(|p| p[k]).sum::<DVec3>() / pairs.len() as f64;
        let middles = [middle(0), middle(1)];
        let of = |p: &[DVec3; 2]| [p[0] - middles[0], p[1] - middles[1]];
        let spread = mean(&pairs.iter().map(|p| of(p)[0].length_squared()).collect::<Vec<_>>());
        let mut covariance = DMat3::ZERO;
        for pair in pairs {
            let [a, b] = of(pair);
            covariance += DMat3::from_cols(b * a.x, b * a.y, b * a.z) * (1.0 / pairs.len() as f64);
        }
        // Centers in a plane leave the third axis open; the cross product closes it.
        let rotation = proper(&covariance)?;
        let along: f64 = pairs.iter().map(|p| of(p)[1].dot(rotation * of(p)[0])).sum::<f64>() / pairs.len() as f64;
        let scale = along / spread;
        (scale.is_finite() && scale > 0.0).then_some(Self { scale, rotation, middles })
    }

    fn apply(&self, p: DVec3) -> DVec3 {
        self.middles[1] + self.scale * (self.rotation * (p - self.middles[0]))
    }
}

/// The rotation that a covariance is nearest to.
fn proper(covariance: &DMat3) -> Option<DMat3> {
    let (values, axes) = crate::math::eigen::axes(&(covariance.transpose() * *covariance));
    let [u, v] = [0, 1].map(|k| (*covariance * axes.col(k)).normalize_or_zero());
    if !(values.y > 1e-12 * values.x) {
        return None;
    }
    let v = (v - u * u.dot(v)).normalize_or_zero();
    let rotation = nearest_rotation(&(DMat3::from_cols(u, v, u.cross(v)) * axes.transpose()));
    (rotation_error(&rotation) < 1e-6).then_some(rotation)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dataset(turn: DMat3, scale: f64, shift: DVec3, noise: f64, planar: bool) -> Dataset {
        let photos = (0..12)
            .map(|i| {
                let a = f64::from(i) * 0.5;
                let height = if planar { 1.0 } else { 1.0 + 0.3 * (3.0 * a).sin() };
                let eye = DVec3::new(4.0 * a.cos(), 4.0 * a.sin(), height);
                let mut camera = Camera::look_at(eye, DVec3::ZERO, DVec3::Z, 0.8, 64, 48).expect("valid");
                let off = DVec3::new((7.0 * a).sin(), (5.0 * a).cos(), (11.0 * a).sin()) * noise;
                camera.center = shift + scale * (turn * (camera.center + off));
                camera.world_from_camera = turn * camera.world_from_camera;
                Photo::new(format!("images/{i:04}.jpg"), "", camera)
            })
            .collect();
        Dataset { photos, ..Dataset::default() }
    }

    #[test]
    fn a_similarity_is_no_difference_and_noise_is_one() {
        let turn = DMat3::from_rotation_y(2.0) * DMat3::from_rotation_x(-0.7);
        for planar in [false, true] {
            let given = dataset(DMat3::IDENTITY, 1.0, DVec3::ZERO, 0.0, planar);
            let same = compare(&dataset(turn, 0.3, DVec3::new(5.0, -2.0, 9.0), 0.0, planar), &given).expect("compared");
            assert!(same.center[1] < 1e-9 && same.rotation_deg[1] < 1e-6, "{planar}: {same:?}");
            assert_eq!((same.photos, same.given, same.focal_ratio), (12, 12, 1.0));
            let noisy = compare(&dataset(turn, 0.3, DVec3::ZERO, 0.1, planar), &given).expect("compared");
            assert!((0.003..0.1).contains(&noisy.center[0]), "{planar}: {noisy:?}");
        }
    }

    #[test]
    fn a_stray_counts_and_spoils_no_other() {
        let given = dataset(DMat3::IDENTITY, 1.0, DVec3::ZERO, 0.0, false);
        let mut found = given.clone();
        found.photos[3].camera.center *= 200.0;
        let off = compare(&found, &given).expect("compared");
        assert!(off.center[0] < 1e-9 && off.center[1] > 10.0 && off.photos == 12, "{off:?}");
    }

    #[test]
    fn another_principal_point_is_a_turn() {
        let given = dataset(DMat3::IDENTITY, 1.0, DVec3::ZERO, 0.0, false);
        let mut shifted = given.clone();
        for photo in &mut shifted.photos {
            let camera = &mut photo.camera;
            camera.principal_px.x += 5.0;
            let turn = DMat3::from_rotation_y((5.0 / camera.focal_px.x).atan());
            camera.world_from_camera *= turn;
        }
        let turned = compare(&shifted, &given).expect("compared").rotation_deg[0];
        shifted.photos.iter_mut().for_each(|p| p.camera.principal_px.x -= 5.0);
        let control = compare(&shifted, &given).expect("compared").rotation_deg[0];
        assert!(turned < 1e-6 && control > 3.0, "{turned} {control}");
    }

    #[test]
    fn frames_are_found_by_their_number_and_strangers_refused() {
        let given = dataset(DMat3::IDENTITY, 1.0, DVec3::ZERO, 0.0, false);
        let mut frames = given.clone();
        frames.photos.iter_mut().enumerate().for_each(|(i, p)| p.name = format!("frame_{i:06}.jpg"));
        frames.photos.remove(4);
        let found = compare(&frames, &given).expect("compared");
        assert!(found.photos == 11 && found.center[1] < 1e-9, "{found:?}");
        frames.photos.iter_mut().for_each(|p| p.name = format!("other{}", p.name));
        assert!(compare(&frames, &given).is_err());
    }
}
