//! Normals: those of Gaussians, those of drawn depth, and the loss that holds them together.
//!
//! The loss of a view is the mean over its pixels of `sum(w_i (1 - n_i . s)) = alpha - N . s`, with
//! `N` the composited normals and `s` the normal of the surface that depth describes (2D Gaussian
//! Splatting's normal consistency).

use glam::DVec2;
use rayon::prelude::*;

use super::project_backward::quaternion_gradient;
use crate::math::{Real, rotation};
use crate::render::{Frame, FrameGradient};
use crate::scene::{Camera, Gaussian, GaussianCloud};

/// Depth that describes the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceDepth {
    /// `sum(w z) / alpha`.
    Expected,
    /// The median depth; its gradient reaches surfels only.
    Median,
}

/// The axis along which a Gaussian is thinnest, the last of equals.
#[inline(always)]
fn thinnest<R: Real>(log_scale: [R; 3]) -> usize {
    (0..3).fold(0, |best, k| if log_scale[k] <= log_scale[best] { k } else { best })
}

/// The thinnest axis of a Gaussian, its number and the sign that turns it toward `eye`, which is
/// the camera's center relative to the cloud's origin; `None` for a degenerate rotation.
#[inline(always)]
fn facing<R: Real>(gaussian: &Gaussian<'_, R>, eye: [R; 3]) -> Option<([R; 3], usize, R)> {
    let rotation = rotation::matrix_from_quaternion(gaussian.quaternion)?;
    let k = thinnest(gaussian.log_scale);
    let axis = [rotation[0][k], rotation[1][k], rotation[2][k]];
    let away = (0..3).fold(R::ZERO, |s, r| s + axis[r] * (gaussian.position[r] - eye[r]));
    let sign = if away > R::ZERO { -R::ONE } else { R::ONE };
    Some((axis.map(|c| c * sign), k, sign))
}

/// A camera's center relative to a cloud's origin.
pub fn eye<R: Real>(camera: &Camera, cloud: &GaussianCloud<R>) -> [R; 3] {
    (camera.center - cloud.origin).to_array().map(R::of)
}

/// Unit normals of all Gaussians in world axes, as three extra channels: the thinnest axis, toward
/// the camera; 0 for a degenerate rotation.
pub fn of_gaussians<R: Real>(cloud: &GaussianCloud<R>, camera: &Camera, out: &mut Vec<R>) {
    let eye = eye(camera, cloud);
    out.resize(cloud.len() * 3, R::ZERO);
    out.par_chunks_mut(3).enumerate().for_each(|(i, out)| {
        let normal = facing(&cloud.gaussian(i), eye).map_or([R::ZERO; 3], |(n, ..)| n);
        out.copy_from_slice(&normal);
    });
}

/// Gradient of a Gaussian's raw quaternion from that of its normal.
#[inline(always)]
pub fn backward<R: Real>(gaussian: &Gaussian<'_, R>, eye: [R; 3], d_normal: [R; 3]) -> [R; 4] {
    let Some((_, k, sign)) = facing(gaussian, eye) else { return [R::ZERO; 4] };
    let mut d_rotation = [[R::ZERO; 3]; 3];
    for r in 0..3 {
        d_rotation[r][k] = sign * d_normal[r];
    }
    quaternion_gradient(gaussian.quaternion, &d_rotation).unwrap_or([R::ZERO; 4])
}

/// Depth per pixel, 0 where there is none.
fn surface<R: Real>(frame: &Frame<R>, depth: SurfaceDepth) -> Vec<R> {
    match depth {
        SurfaceDepth::Expected => frame.expected_depth(),
        SurfaceDepth::Median => frame.median_depth.clone(),
    }
}

/// Direction of the ray through each pixel's center, world axes, depth 1.
struct Rays<R> {
    first: [R; 3],
    right: [R; 3],
    down: [R; 3],
}

impl<R: Real> Rays<R> {
    fn new(camera: &Camera) -> Self {
        let first = camera.ray(DVec2::splat(0.5));
        let step = |pixel: DVec2| (camera.ray(pixel) - first).to_array().map(R::of);
        Self { first: first.to_array().map(R::of), right: step(DVec2::new(1.5, 0.5)), down: step(DVec2::new(0.5, 1.5)) }
    }

    #[inline(always)]
    fn at(&self, x: usize, y: usize) -> [R; 3] {
        let (x, y) = (R::of(x as f64), R::of(y as f64));
        std::array::from_fn(|k| self.first[k] + x * self.right[k] + y * self.down[k])
    }
}

#[inline(always)]
fn dot<R: Real>(a: [R; 3], b: [R; 3]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn cross<R: Real>(a: [R; 3], b: [R; 3]) -> [R; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Central differences of the points that `depth` describes, along x and y, at an inner pixel whose
/// four neighbors all have a depth.
#[inline(always)]
fn differences<R: Real>(depth: &[R], rays: &Rays<R>, width: usize, x: usize, y: usize) -> Option<[[R; 3]; 2]> {
    let height = depth.len() / width;
    if x == 0 || y == 0 || x + 1 >= width || y + 1 >= height {
        return None;
    }
    let point = |x: usize, y: usize| {
        let z = depth[y * width + x];
        (z > R::ZERO).then(|| rays.at(x, y).map(|c| c * z))
    };
    let minus = |a: [R; 3], b: [R; 3]| std::array::from_fn(|k| a[k] - b[k]);
    let along_x = minus(point(x + 1, y)?, point(x - 1, y)?);
    Some([along_x, minus(point(x, y + 1)?, point(x, y - 1)?)])
}

/// Unit normals of the surface that `depth` describes, toward the camera in world axes, row by
/// row; 0 at the picture's border and where a neighbor has no depth.
pub(crate) fn of_depth<R: Real>(depth: &[R], camera: &Camera) -> Vec<[R; 3]> {
    let (width, rays) = (camera.width_px as usize, Rays::new(camera));
    let normal = |i: usize| {
        let [a, b] = differences(depth, &rays, width, i % width, i / width)?;
        let c = cross(b, a);
        let length = dot(c, c).sqrt();
        (length > R::ZERO).then(|| c.map(|v| v / length))
    };
    (0..depth.len()).into_par_iter().map(|i| normal(i).unwrap_or([R::ZERO; 3])).collect()
}

/// The loss of a frame with composited normals `normals`, times `weight`. Adds to the gradient of
/// alpha and depth and sets `d_normals`; planes that are empty are made.
pub fn consistency<R: Real>(
    frame: &Frame<R>,
    normals: [&[R]; 3],
    camera: &Camera,
    depth: SurfaceDepth,
    weight: f64,
    gradient: &mut FrameGradient<R>,
    d_normals: &mut [Vec<R>; 3],
) -> f64 {
    let (width, n) = (frame.width_px, frame.alpha.len());
    let rays = Rays::<R>::new(camera);
    let z = surface(frame, depth);
    let scale = R::of(weight / n.max(1) as f64);
    let composited = |i: usize| normals.map(|plane| plane[i]);
    // Of each pixel: loss, surface normal, gradient of the two differences.
    let pixel = |i: usize| -> Option<(R, [R; 3], [[R; 3]; 2])> {
        let [a, b] = differences(&z, &rays, width, i % width, i / width)?;
        let c = cross(b, a);
        let length = dot(c, c).sqrt();
        if !(length > R::ZERO) {
            return None;
        }
        let normal = c.map(|v| v / length);
        let own = composited(i);
        let along = dot(own, normal);
        // The part of -N across the surface's normal is what turns it.
        let d_c: [R; 3] = std::array::from_fn(|k| (normal[k] * along - own[k]) * scale / length);
        Some((frame.alpha[i] - along, normal, [cross(d_c, b), cross(a, d_c)]))
    };
    let pixels: Vec<_> = (0..n).into_par_iter().map(pixel).collect();
    let ensure = |plane: &mut Vec<R>| plane.resize(n, R::ZERO);
    d_normals.iter_mut().for_each(ensure);
    ensure(&mut gradient.alpha);
    ensure(match depth {
        SurfaceDepth::Expected => &mut gradient.depth,
        SurfaceDepth::Median => &mut gradient.median_depth,
    });
    let mut loss = 0.0;
    for (i, pixel) in pixels.iter().enumerate() {
        let normal = pixel.as_ref().map_or([R::ZERO; 3], |(_, normal, _)| *normal);
        for (plane, c) in d_normals.iter_mut().zip(normal) {
            plane[i] = -scale * c;
        }
        if let Some((own, ..)) = pixel {
            loss += own.f64();
            gradient.alpha[i] += scale;
        }
    }
    let side = |i: Option<usize>, k: usize| {
        i.and_then(|i| pixels[i].as_ref()).map_or([R::ZERO; 3], |(.., differences)| differences[k])
    };
    for i in (0..n).filter(|&i| z[i] > R::ZERO) {
        let (x, y) = (i % width, i / width);
        let left = side((x > 0).then(|| i - 1), 0);
        let right = side((x + 1 < width).then_some(i + 1), 0);
        let above = side(i.checked_sub(width), 1);
        let below = side(Some(i + width).filter(|j| *j < n), 1);
        let d_point = std::array::from_fn(|k| left[k] - right[k] + above[k] - below[k]);
        let d_z = dot(rays.at(x, y), d_point);
        match depth {
            SurfaceDepth::Expected => {
                let alpha = frame.alpha[i];
                gradient.depth[i] += d_z / alpha;
                gradient.alpha[i] -= d_z * z[i] / alpha;
            }
            SurfaceDepth::Median => gradient.median_depth[i] += d_z,
        }
    }
    loss * weight / n.max(1) as f64
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    fn camera() -> Camera {
        Camera::look_at(DVec3::new(0.3, -3.0, 0.8), DVec3::ZERO, DVec3::Z, 0.8, 24, 18).expect("valid")
    }

    /// Depth of the plane through the origin with this normal.
    fn plane(normal: DVec3) -> Vec<f64> {
        let c = camera();
        let at = |i: usize| {
            let ray = c.ray(DVec2::new((i % 24) as f64 + 0.5, (i / 24) as f64 + 0.5));
            -c.center.dot(normal) / ray.dot(normal)
        };
        (0..24 * 18).map(at).collect()
    }

    #[test]
    fn a_plane_has_its_normal() {
        let normal = DVec3::new(0.2, -0.9, 0.4).try_normalize().expect("long");
        let found = of_depth(&plane(normal), &camera());
        for (i, n) in found.iter().enumerate() {
            let (x, y) = (i % 24, i / 24);
            if x == 0 || y == 0 || x == 23 || y == 17 {
                assert_eq!(*n, [0.0; 3]);
            } else {
                assert!((DVec3::from_array(*n) - normal).length() < 1e-9, "{x}, {y}: {n:?}");
            }
        }
        let mut hole = plane(normal);
        hole[9 * 24 + 12] = 0.0;
        assert_eq!(of_depth(&hole, &camera())[9 * 24 + 11], [0.0; 3]);
    }

    #[test]
    fn gaussians_face_the_camera_with_their_thinnest_axis() {
        let cloud = GaussianCloud::<f64> {
            positions: vec![[0.0; 3]; 3],
            log_scales: vec![[0.0, -3.0, 0.0], [-1.0, 0.0, -1.5], [0.0; 3]],
            quaternions: vec![[1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0; 4]],
            opacity_logits: vec![0.0; 3],
            sh: vec![[0.0; 3]; 3],
            ..GaussianCloud::default()
        };
        let mut normals = Vec::new();
        of_gaussians(&cloud, &camera(), &mut normals);
        assert_eq!(normals, [0.0, -1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    }

    /// Disturbs one number of the loss's input.
    type Change<'a> = dyn Fn(&mut Frame<f64>, &mut [Vec<f64>; 3], f64) + 'a;

    #[test]
    fn the_loss_is_zero_on_a_consistent_plane_and_its_gradient_right() {
        let normal = DVec3::new(0.2, -0.9, 0.4).try_normalize().expect("long");
        let n = 24 * 18;
        let flat = |v: f64| vec![v; n];
        let mut frame = Frame::<f64> {
            width_px: 24,
            height_px: 18,
            alpha: flat(0.8),
            depth: plane(normal).iter().map(|z| z * 0.8).collect(),
            median_depth: plane(normal),
            ..Frame::default()
        };
        let mut normals = normal.to_array().map(|c| flat(0.8 * c));
        let run = |frame: &Frame<f64>, normals: &[Vec<f64>; 3], depth| {
            let (mut g, mut d) = (FrameGradient::default(), Default::default());
            let planes = normals.each_ref().map(Vec::as_slice);
            let loss = consistency(frame, planes, &camera(), depth, 0.7, &mut g, &mut d);
            (loss, g, d)
        };
        assert!(run(&frame, &normals, SurfaceDepth::Expected).0.abs() < 1e-12);
        // Disturbed in every input.
        let wave = |i: usize, f: f64| (i as f64 * f).sin();
        for i in 0..n {
            frame.alpha[i] += 0.1 * wave(i, 0.7);
            frame.depth[i] += 0.02 * wave(i, 1.3);
            frame.median_depth[i] += 0.02 * wave(i, 2.1);
            normals.iter_mut().for_each(|plane| plane[i] += 0.2 * wave(i, 0.9));
        }
        for depth in [SurfaceDepth::Expected, SurfaceDepth::Median] {
            let (loss, g, d) = run(&frame, &normals, depth);
            assert!(loss > 1e-3, "{loss}");
            let h = 1e-6;
            let slope = |change: &Change<'_>| {
                let at = |h: f64| {
                    let (mut f, mut v) = (frame.clone(), normals.clone());
                    change(&mut f, &mut v, h);
                    run(&f, &v, depth).0
                };
                (at(h) - at(-h)) / (2.0 * h)
            };
            let zero = flat(0.0);
            let or_zero = |plane: &Vec<f64>, i: usize| plane.get(i).copied().unwrap_or(zero[i]);
            let mut errors = Vec::new();
            for i in [0, 25, 30, 24 * 9 + 12, 24 * 9 + 13, 24 * 16 + 22, n - 1] {
                let pairs = [
                    (slope(&|f, _, h| f.alpha[i] += h), g.alpha[i]),
                    (slope(&|f, _, h| f.depth[i] += h), or_zero(&g.depth, i)),
                    (slope(&|f, _, h| f.median_depth[i] += h), or_zero(&g.median_depth, i)),
                    (slope(&|_, v, h| v[1][i] += h), d[1][i]),
                ];
                errors.extend(pairs.map(|(numeric, analytic)| (numeric - analytic).abs()));
            }
            let worst = crate::math::stats::worst(errors);
            assert!(worst < 1e-8, "{depth:?}: {worst:e}");
            // Negative control: the gradient of another pixel.
            let i = 24 * 9 + 12;
            assert!((slope(&|_, v, h| v[1][i] += h) - d[1][i + 30]).abs() > 1e-6);
        }
    }
}
