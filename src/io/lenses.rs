//! Losses to the lenses of a data set: camera models that cannot be read, and the field of view that remains after
//! undistortion to a pinhole camera.

use std::path::Path;

use glam::{DVec2, DVec3};

use super::IoError;
use crate::math::format::things;
use crate::scene::distortion::Rays;
use crate::scene::{Camera, Distortion, Photo};

/// Name in COLMAP and nerfstudio of a full equirectangular panorama.
pub(super) const PANORAMA: &str = "EQUIRECTANGULAR";

const UNDISTORT: &str = "undistort the photos with COLMAP's image_undistorter first";
const CUT: &str = "a panorama is no pinhole photo: cut the panoramas into perspective photos, as COLMAP does with 'python \
     python/examples/panorama_sfm.py --input_image_path PANORAMAS --output_path NEW', and open NEW";

/// Share of a photo's pixels that a lens may lose without a warning.
const LOST: f64 = 0.1;
/// Samples across a photo at which the loss is measured.
const ACROSS: u32 = 48;

/// Makes the error of the camera model `model` in `path`, photos of which are not read.
pub(super) fn unsupported(model: &str, path: &Path) -> IoError {
    let panorama = [PANORAMA, "LATLONG", "VR180", "OMNIDIRECTIONALSTEREO"].iter().any(|name| model.starts_with(name));
    let remedy = if panorama { CUT } else { UNDISTORT };
    IoError::Unsupported { path: path.into(), what: format!("the camera model {model}"), remedy }
}

/// Returns the photos with a supported camera model. The others, of which only the model is known, are left out with a
/// warning; if there are no others, that is an error.
pub(super) fn readable<T>(
    listed: Vec<Result<T, String>>,
    source: &Path,
    warnings: &mut Vec<String>,
) -> Result<Vec<T>, IoError> {
    let all = listed.len();
    let (mut readable, mut others) = (Vec::new(), Vec::new());
    for photo in listed {
        match photo {
            Ok(photo) => readable.push(photo),
            Err(model) => others.push(model),
        }
    }
    let Some(first) = others.first() else { return Ok(readable) };
    let error = unsupported(first, source);
    if readable.is_empty() {
        return Err(error);
    }
    warnings.push(format!("{} of {all} photos were left out: {error}", others.len()));
    Ok(readable)
}

/// Reports the field of view and the pixels that remain after undistortion, a sentence for each lens that loses much.
pub(super) fn warnings(photos: &[Photo]) -> Vec<String> {
    let mut lenses: Vec<(&Camera, Distortion, usize)> = Vec::new();
    let same = |a: &Camera, b: &Camera| {
        let [a, b] = [a, b].map(|c| (c.width_px, c.height_px, c.focal_px, c.principal_px));
        a == b
    };
    for photo in photos {
        let Some(distortion) = photo.distortion else { continue };
        match lenses.iter_mut().find(|(camera, d, _)| *d == distortion && same(camera, &photo.camera)) {
            Some((.., count)) => *count += 1,
            None => lenses.push((&photo.camera, distortion, 1)),
        }
    }
    let mut told = Vec::new();
    for (camera, distortion, count) in lenses {
        let field = Field::of(camera, &distortion);
        if !distortion.is_wide() && field.share >= 1.0 - LOST {
            continue;
        }
        let [seen, left] =
            [field.seen, field.left].map(|[x, y]| format!("{:.0} x {:.0}", x.to_degrees(), y.to_degrees()));
        told.push(format!(
            "{} taken through a lens that sees {seen} degrees; undistorted to a pinhole, {left} degrees and {:.0} % of \
             the pixels remain",
            if count == 1 { "1 photo was".into() } else { format!("{} were", things(count, "photo")) },
            100.0 * field.share
        ));
    }
    told
}

/// Field of view of a lens, before and after undistortion.
struct Field {
    /// Angles of view through the axis, across and down, rad.
    seen: [f64; 2],
    /// Angles of the pinhole picture that the lens fills, rad.
    left: [f64; 2],
    /// Share of the photo's pixels that are in the pinhole's picture.
    share: f64,
}

impl Field {
    fn of(camera: &Camera, distortion: &Distortion) -> Self {
        let (rays, reach) = (distortion.rays(), distortion.reach());
        let size = DVec2::new(f64::from(camera.width_px), f64::from(camera.height_px));
        let (focal, principal) = (camera.focal_px, camera.principal_px);
        let ray = |px: DVec2| rays.at((px - principal) / focal);
        let remains = |ray: DVec3| {
            let q = ray.truncate() / ray.z;
            let px = q * focal + principal;
            ray.z > 0.0 && q.length() < reach && px.cmpge(DVec2::ZERO).all() && px.cmple(size).all()
        };
        let down = (ACROSS as f64 * size.y / size.x).ceil().clamp(1.0, 256.0) as u32;
        let center = |i: u32, n: u32| (f64::from(i) + 0.5) / f64::from(n);
        let places = (0..down).flat_map(|y| (0..ACROSS).map(move |x| DVec2::new(center(x, ACROSS), center(y, down))));
        let kept = places.filter(|place| ray(*place * size).is_some_and(remains)).count();
        let along = |axis: DVec2| {
            let (start, end) = (principal * (DVec2::ONE - axis), principal + axis * (size - principal));
            [start, end].map(|edge| angles(&rays, reach, (edge - principal) / focal))
        };
        let [x, y] = [DVec2::X, DVec2::Y].map(along);
        let sum = |of: fn(&[f64; 2]) -> f64| [&x, &y].map(|sides| sides.iter().map(of).sum());
        Self { seen: sum(|a| a[0]), left: sum(|a| a[1]), share: kept as f64 / f64::from(down * ACROSS) }
    }
}

/// Returns the angle from the axis of the lens at `edge` of its picture, and the angle that remains there, rad.
fn angles(rays: &Rays, reach: f64, edge: DVec2) -> [f64; 2] {
    let seen = rays.at(edge).map_or(rays.most_angle, |ray| ray.z.clamp(-1.0, 1.0).acos());
    [seen, edge.length().min(reach).atan().min(seen)]
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;
    use crate::scene::Projection;

    fn photo(distortion: Distortion, [width_px, height_px]: [u32; 2], focal: f64) -> Photo {
        let principal_px = DVec2::new(f64::from(width_px), f64::from(height_px)) * 0.5;
        let (world_from_camera, center) = (DMat3::IDENTITY, DVec3::ZERO);
        let focal_px = DVec2::splat(focal);
        let camera = Camera { width_px, height_px, focal_px, principal_px, world_from_camera, center };
        Photo { distortion: Some(distortion), ..Photo::new("a", "a", camera) }
    }

    #[test]
    fn the_field_of_a_fisheye_is_told_in_degrees_and_pixels() {
        let fisheye = Distortion { projection: Projection::Fisheye, ..Distortion::default() };
        // 180 degrees across, 90 down: 57.5 and 38.1 to each side remain.
        let half = photo(fisheye, [600, 300], 600.0 / std::f64::consts::PI);
        let told = warnings(&[half.clone(), half, photo(Distortion::default(), [600, 300], 500.0)]);
        assert_eq!(told.len(), 1, "{told:?}");
        assert!(told[0].starts_with("2 photos were taken through a lens that sees 180 x 90 degrees"), "{told:?}");
        assert!(told[0].contains("115 x 76 degrees and "), "{told:?}");
        // The share by the area of what a pinhole sees on a fisheye's picture, summed independently.
        let (n, mut inside) = (1000, 0);
        for i in 0..n * n {
            let x = (f64::from(i % n) + 0.5) / f64::from(n) - 0.5;
            let y = 0.5 * ((f64::from(i / n) + 0.5) / f64::from(n) - 0.5);
            let (a, b) = (x * std::f64::consts::PI, y * std::f64::consts::PI);
            let angle = a.hypot(b);
            let tan = if angle < 70.0_f64.to_radians() { angle.tan() / angle } else { 9e9 };
            inside += i32::from(
                (a * tan).abs() < 0.5 * std::f64::consts::PI && (b * tan).abs() < 0.25 * std::f64::consts::PI,
            );
        }
        let share = 100.0 * f64::from(inside) / f64::from(n * n);
        let said: f64 = told[0]
            .split(" degrees and ")
            .nth(1)
            .expect("a share")
            .split(' ')
            .next()
            .expect("a number")
            .parse()
            .expect("a number");
        assert!((said - share).abs() <= 2.0, "{said} for {share}");
    }

    #[test]
    fn a_lens_that_loses_little_is_not_told() {
        let slight = Distortion { k1: -0.05, ..Distortion::default() };
        assert!(warnings(&[photo(slight, [600, 400], 500.0)]).is_empty());
        // A pincushion's corners that are not in the photo cost none of its pixels; a barrel's are cut off.
        let strong = Distortion { k1: -0.3, ..Distortion::default() };
        let cut = warnings(&[photo(strong, [600, 400], 300.0)]);
        assert!(cut.len() == 1 && cut[0].starts_with("1 photo was"), "{cut:?}");
    }
}
