//! Initialization of the Gaussians.

use glam::{DVec2, DVec3};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use rstar::RTree;

use super::{TrainView, sweep};
use crate::math::sh::{SH_C0, coefficients};
use crate::math::stats::quantile;
use crate::render::{Features, RenderSettings, Renderer};
use crate::scene::{Bounds, Camera, Dataset, GaussianCloud, SparsePoint};

/// Opacity of a new Gaussian.
const OPACITY: f64 = 0.1;
/// Longer side of the pictures in which holes are detected, px.
const HOLE_SIDE_PX: u32 = 128;
/// Side of the squares that are tested for coverage, px.
const HOLE_CELL_PX: usize = 8;
/// Fewest sparse points that training starts from.
const FEWEST_POINTS: usize = 100;
/// Depth of filled holes, relative to nearly the farthest depth of the view.
const HOLE_DEPTH: f64 = 1.3;

/// Initializes a cloud at the dataset's sparse points, or, without these, at `random` points where the photos agree.
pub(crate) fn initial_cloud(
    dataset: &Dataset,
    views: &[TrainView],
    degree: u8,
    random: usize,
    rng: &mut Pcg64Mcg,
) -> GaussianCloud {
    // A camera far from all others has a wrong pose, or sees little.
    let strays: Vec<&str> = dataset.strays().into_iter().map(|i| dataset.photos[i].name.as_str()).collect();
    let views: Vec<&TrainView> = views.iter().filter(|v| !strays.contains(&v.name.as_str())).collect();
    let finite: Vec<SparsePoint> = dataset.points.iter().copied().filter(|p| p.position.is_finite()).collect();
    if lacks_points(dataset) {
        return from_points(&sweep::points(dataset.focus(), &views, dataset.background, random, rng), degree);
    }
    let mut cloud = from_points(&finite, degree);
    fill_holes(&mut cloud, dataset, &views);
    cloud
}

/// Returns whether there are too few sparse points to start from.
pub(super) fn lacks_points(dataset: &Dataset) -> bool {
    dataset.points.iter().filter(|p| p.position.is_finite()).count() < FEWEST_POINTS
}

/// Adds Gaussians where photos show a region without sparse points: walls, sky, the rest of the room. They lie a
/// little behind the rest of the view, in the colors of its photo, and training moves them from there. Views that
/// already see such a Gaussian add none.
fn fill_holes(cloud: &mut GaussianCloud, dataset: &Dataset, views: &[&TrainView]) {
    let stride = cloud.sh_stride();
    let near = Camera::near_plane(dataset.camera_extent().1);
    let settings = RenderSettings { sh_degree: 0, depth: true, near, ..RenderSettings::default() };
    let mut renderer = Renderer::new();
    // The cloud made nearly opaque, so that its alpha shows the coverage of the picture.
    let mut solid = cloud.clone();
    solid.opacity_logits.fill(3.0);
    for view in views {
        let camera = view.camera.limited_to(HOLE_SIDE_PX);
        let Ok(frame) = renderer.render(&solid, Features::NONE, &camera, &settings) else { continue };
        let seen = frame.depth.iter().zip(&frame.alpha).filter(|(_, a)| **a > 0.5);
        let depths: Vec<f64> = seen.map(|(d, a)| f64::from(d / a)).collect();
        let focus = camera.center.distance(dataset.focus());
        let depth = HOLE_DEPTH * if depths.is_empty() { focus } else { quantile(&depths, 0.9) };
        let (width, height) = (camera.width_px as usize, camera.height_px as usize);
        for y in (0..height).step_by(HOLE_CELL_PX) {
            for x in (0..width).step_by(HOLE_CELL_PX) {
                let (right, bottom) = ((x + HOLE_CELL_PX).min(width), (y + HOLE_CELL_PX).min(height));
                let cell = || (y..bottom).flat_map(|v| (x..right).map(move |u| v * width + u));
                let covered: f32 = cell().map(|i| frame.alpha[i]).sum::<f32>() / cell().count() as f32;
                if covered > 0.4 {
                    continue;
                }
                let at = DVec2::new((x + right) as f64, (y + bottom) as f64) * 0.5;
                let scale = f64::from(view.pixels.width_px) / width as f64;
                let (u, v) = ((at.x * scale) as u32, (at.y * scale) as u32);
                let (u, v) = (u.min(view.pixels.width_px - 1), v.min(view.pixels.height_px - 1));
                let pixel = (v * view.pixels.width_px + u) as usize;
                let is_clear = |plane: &Option<Vec<u8>>| plane.as_ref().is_some_and(|p| p[pixel] == 0);
                if is_clear(&view.pixels.coverage) || is_clear(&view.pixels.alpha) {
                    continue;
                }
                let position = camera.center + camera.ray(at) * depth - cloud.origin;
                let size = depth * HOLE_CELL_PX as f64 / camera.focal_px.x * 0.5;
                for (c, opacity) in [(&mut *cloud, logit(OPACITY)), (&mut solid, 3.0)] {
                    c.positions.push(position.as_vec3().to_array());
                    c.log_scales.push([size.ln() as f32; 3]);
                    c.quaternions.push([1.0, 0.0, 0.0, 0.0]);
                    c.opacity_logits.push(opacity);
                    c.sh.push(constant_color(view.pixels.rgb[pixel]));
                    c.sh.extend(std::iter::repeat_n([0.0; 3], stride - 1));
                }
            }
        }
    }
}

fn logit(opacity: f64) -> f32 {
    (opacity / (1.0 - opacity)).ln() as f32
}

fn constant_color(rgb: [u8; 3]) -> [f32; 3] {
    rgb.map(|c| ((f64::from(c) / 255.0 - 0.5) / SH_C0) as f32)
}

/// Makes one Gaussian per point, as wide as the root mean square distance to its three nearest neighbors.
pub(crate) fn from_points(points: &[SparsePoint], degree: u8) -> GaussianCloud {
    let origin = Bounds::robust(points.iter().map(|p| p.position)).map_or(DVec3::ZERO, |b| b.center());
    let local: Vec<[f64; 3]> = points.iter().map(|p| (p.position - origin).to_array()).collect();
    let tree = RTree::bulk_load(local.clone());
    let spacing: Vec<f64> = local
        .par_iter()
        .map(|p| {
            // The first neighbor is the point itself.
            let near: Vec<f64> =
                tree.nearest_neighbor_iter_with_distance_2(*p).skip(1).take(3).map(|(_, d)| d).collect();
            (near.iter().sum::<f64>() / near.len().max(1) as f64).sqrt()
        })
        .collect();
    // Coincident points get a small size instead of zero; the size of isolated ones is limited.
    let typical = crate::math::stats::median(&spacing.iter().copied().filter(|s| *s > 0.0).collect::<Vec<_>>());
    let typical = if typical.is_finite() { typical } else { 1.0 };
    let stride = coefficients(degree);
    let mut cloud = GaussianCloud { origin, sh_degree: degree, ..GaussianCloud::default() };
    for ((p, at), s) in points.iter().zip(&local).zip(&spacing) {
        cloud.positions.push(at.map(|v| v as f32));
        cloud.log_scales.push([s.clamp(typical * 1e-3, typical * 30.0).ln() as f32; 3]);
        cloud.quaternions.push([1.0, 0.0, 0.0, 0.0]);
        cloud.opacity_logits.push(logit(OPACITY));
        cloud.sh.push(constant_color(p.rgb));
        cloud.sh.extend(std::iter::repeat_n([0.0; 3], stride - 1));
    }
    cloud
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::PhotoPixels;

    #[test]
    fn scales_follow_the_spacing() {
        let points: Vec<SparsePoint> = (0..1000)
            .map(|i| SparsePoint {
                position: DVec3::new(f64::from(i % 10), f64::from(i / 10 % 10), f64::from(i / 100)) * 0.5,
                rgb: [255, 0, 128],
            })
            .collect();
        let cloud = from_points(&points, 2);
        cloud.validate().expect("valid");
        for s in &cloud.log_scales {
            assert!((s[0].exp() - 0.5).abs() < 1e-4);
        }
        let red = 0.5 + SH_C0 * f64::from(cloud.sh[0][0]);
        assert!((red - 1.0).abs() < 1e-6);
    }

    #[test]
    fn what_photos_show_without_points_is_filled_once() {
        let photo = |eye: DVec3| {
            let camera = Camera::look_at(eye, DVec3::ZERO, DVec3::Z, 0.8, 128, 96).expect("valid");
            let pixels = PhotoPixels {
                width_px: 128,
                height_px: 96,
                rgb: vec![[200, 30, 30]; 128 * 96],
                coverage: None,
                alpha: None,
            };
            TrainView { name: String::new(), camera, pixels }
        };
        let views = [photo(DVec3::new(0.0, -4.0, 0.1)), photo(DVec3::new(0.01, -4.0, 0.1))];
        let points: Vec<SparsePoint> = (0..200)
            .map(|i| SparsePoint {
                position: DVec3::new(f64::from(i % 20) * 0.02, 0.0, f64::from(i / 20) * 0.02),
                rgb: [0; 3],
            })
            .collect();
        let dataset = Dataset { points, ..Dataset::default() };
        let mut rng = <Pcg64Mcg as rand::SeedableRng>::seed_from_u64(1);
        let cloud = initial_cloud(&dataset, &views, 1, 0, &mut rng);
        cloud.validate().expect("valid");
        let one = initial_cloud(&dataset, &views[..1], 1, 0, &mut rng);
        assert!(one.len() > 200 + 100, "a picture of 16 x 12 squares is mostly empty: {}", one.len());
        // The second view has the pose of the first one and finds nothing left to fill.
        assert!(cloud.len() - one.len() < 20, "{} {}", one.len(), cloud.len());
    }

    #[test]
    fn coincident_and_lonely_points_are_defined() {
        let p = SparsePoint { position: DVec3::ONE, rgb: [9; 3] };
        from_points(&[p; 50], 0).validate().expect("valid");
        from_points(&[p], 0).validate().expect("valid");
        assert!(from_points(&[], 0).is_empty());
    }
}
