//! Ends of surfaces by the trained Gaussians: at jumps of depth, and in hollow folds, at which one thing stands on or
//! leans at another. Bulging folds are within a thing.
//!
//! Inverse depth is linear in the picture on every plane. So its second difference distinguishes folds from slopes,
//! and its sign hollow folds from bulging ones.

use rayon::prelude::*;

use crate::math::blur::blur;
use crate::render::{Features, RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud};

/// Focal lengths per distance over which depths are compared.
const REACH: f64 = 1.0 / 205.0;
/// Width of the blur of inverse depth, in reaches.
const BLUR: f32 = 0.6;
/// Least opacity of a surface.
const SOLID: f32 = 0.3;
/// Change of slope of a fold that certainly ends a surface, in tangents.
const FOLD: f32 = 1.4;
/// Slopes, as relative depth per tangent, that may be and certainly are a jump to another surface behind.
const JUMP: [f32; 2] = [12.0, 37.0];

/// Draws a view, and returns the end of a surface at each of its pixels, 0 to 1; `None` if it cannot be drawn.
pub(crate) fn ends_of(
    renderer: &mut Renderer,
    cloud: &GaussianCloud,
    settings: &RenderSettings,
    camera: &Camera,
) -> Option<Vec<f32>> {
    let settings = RenderSettings { depth: true, sh_degree: 0, ..settings.clone() };
    let frame = renderer.render(cloud, Features::NONE, camera, &settings).ok()?;
    let depth = |(&d, &a): (&f32, &f32)| if a >= SOLID { d / a } else { 0.0 };
    let depth: Vec<f32> = frame.depth.iter().zip(&frame.alpha).map(depth).collect();
    Some(ends(&depth, frame.width_px, 0.5 * (camera.focal_px.x + camera.focal_px.y)))
}

/// The same from depths along the camera's axis, 0 for empty pixels, for a focal length in px.
pub(crate) fn ends(depth: &[f32], width: usize, focal_px: f64) -> Vec<f32> {
    let farthest = depth.iter().copied().filter(|d| d.is_finite()).fold(0.0, f32::max);
    if farthest <= 0.0 {
        return vec![0.0; depth.len()];
    }
    // Empty pixels lie behind everything.
    let inverse = |&d: &f32| if d > 0.0 && d.is_finite() { 1.0 / d } else { 0.66 / farthest };
    let reach = (focal_px * REACH).clamp(1.0, 16.0);
    let step = reach.round() as isize;
    let near = blur(&depth.iter().map(inverse).collect::<Vec<_>>(), width, BLUR * reach as f32);
    let (w, h) = (width as isize, (depth.len() / width.max(1)) as isize);
    let at = |x: isize, y: isize| near[(y.clamp(0, h - 1) * w + x.clamp(0, w - 1)) as usize];
    let mut out = vec![0.0_f32; depth.len()];
    out.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, row)| {
        for (x, out) in row.iter_mut().enumerate() {
            let (x, y) = (x as isize, y as isize);
            let here = at(x, y);
            for (dx, dy) in [(1, 0), (0, 1), (1, 1), (1, -1)] {
                let (a, b) = (at(x - step * dx, y - step * dy), at(x + step * dx, y + step * dy));
                let tangent = step as f32 * ((dx * dx + dy * dy) as f32).sqrt() / focal_px as f32;
                // Nearer on both sides than a plane through here: hollow.
                let fold = (a + b - 2.0 * here) / (2.0 * here * tangent) / FOLD;
                // The logarithm of a ratio is at most the ratio minus one, so small ones are no jump.
                let jump = match (a - b).abs() < 1.98 * tangent * JUMP[0] * a.min(b) {
                    true => 0.0,
                    false => ((a / b).ln().abs() / (2.0 * tangent) - JUMP[0]) / (JUMP[1] - JUMP[0]),
                };
                *out = out.max(fold.max(jump).clamp(0.0, 1.0));
            }
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    const W: usize = 120;

    /// Largest value in the columns, of surfaces whose depth depends on the column.
    fn found(depth: impl Fn(f32) -> f32, columns: std::ops::Range<usize>) -> f32 {
        let depths: Vec<f32> = (0..W * 20).map(|i| depth((i % W) as f32 - 60.0)).collect();
        let ends = ends(&depths, W, 820.0);
        ends.chunks(W).flat_map(|row| &row[columns.clone()]).copied().fold(0.0, f32::max)
    }

    #[test]
    fn surfaces_end_at_jumps_and_in_hollow_folds() {
        // A plane seen askew, 1 / z linear in the picture.
        let plane = |slope: f32| move |x: f32| 1.0 / (0.5 + slope * x / 820.0);
        for slope in [0.0, 1.0, -2.0] {
            assert!(found(plane(slope), 20..100) < 0.05, "{slope}: {}", found(plane(slope), 20..100));
        }
        let jump = |x: f32| if x < 0.0 { 1.0 } else { 2.0 };
        assert!(found(jump, 58..62) > 0.9 && found(jump, 20..40) < 0.01);
        // Two walls that meet at right angles: seen from inside, and from outside.
        let corner = |hollow: f32| move |x: f32| 1.0 / (0.5 + hollow * 0.5 * x.abs() / 820.0);
        assert!(found(corner(1.0), 57..63) > 0.3, "{}", found(corner(1.0), 57..63));
        assert!(found(corner(-1.0), 20..100) < 0.05);
        // Nothing lies behind everything.
        assert!(found(|x| if x < 0.0 { 1.0 } else { 0.0 }, 58..62) > 0.9);
        assert_eq!(found(|_| 0.0, 0..W), 0.0);
        assert_eq!(found(|_| f32::NAN, 0..W), 0.0);
        assert!(ends(&[], 0, 1.0).is_empty());
    }

    #[test]
    fn the_value_of_a_jump_is_that_of_its_slope() {
        // A jump from depth 1 to depth r, far wider than the blur: ln r over twice the tangent of the
        // reach, scaled from 12 to 37.
        let focal = 820.0;
        let step = (focal * REACH).clamp(1.0, 16.0).round();
        for r in [1.6_f64, 1.9] {
            let slope = r.ln() / (2.0 * step / focal);
            let expected = ((slope - 12.0) / 25.0).clamp(0.0, 1.0) as f32;
            let seen = found(|x| if x < 0.0 { 1.0 } else { r as f32 }, 58..62);
            assert!((seen - expected).abs() < 0.25, "{r}: {seen} {expected}");
        }
        // Rows as columns: the picture turned gives the same.
        let turned: Vec<f32> = (0..20 * W).map(|i| if i / 20 < 60 { 1.0 } else { 2.0 }).collect();
        let ends = ends(&turned, 20, focal);
        assert!(ends[60 * 20 + 10] > 0.9 && ends[20 * 20 + 10] < 0.01);
    }

    #[test]
    fn a_drawn_scene_ends_where_its_surfaces_do() {
        let cloud = GaussianCloud::isotropic(vec![[0.0; 3]], -1.0, 6.0);
        let camera =
            Camera::look_at(glam::DVec3::new(0.0, 0.0, -4.0), glam::DVec3::ZERO, glam::DVec3::NEG_Y, 0.8, 90, 60)
                .expect("valid");
        let ends = ends_of(&mut Renderer::new(), &cloud, &RenderSettings::default(), &camera).expect("drawn");
        let frame = Renderer::new().render(&cloud, Features::NONE, &camera, &RenderSettings::default()).expect("drawn");
        let last = (0..90).rfind(|x| frame.alpha[30 * 90 + x] >= SOLID).expect("seen");
        assert!((50..80).contains(&last), "{last}");
        let row = &ends[30 * 90..31 * 90];
        let edge = row[last - 1..last + 4].iter().copied().fold(0.0, f32::max);
        assert!(edge > 0.9 && row[45] < 0.05 && row[88] < 0.05, "{last}: {row:?}");
        let mut broken = camera;
        broken.width_px = 0;
        assert_eq!(ends_of(&mut Renderer::new(), &cloud, &RenderSettings::default(), &broken), None);
    }
}
