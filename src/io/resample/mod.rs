//! Undistortion and reduction of a picture in one pass.
//!
//! Every output pixel is the mean over its square in the full-size pinhole picture. Without distortion that mean is
//! exact. With distortion it is taken over a grid of samples at least as dense as the full-size pixels, each a bilinear
//! look-up in the picture on disk.

use glam::{DVec2, Vec2};
use rayon::prelude::*;

use crate::math::resize::{Filter, Tap, taps};
use crate::scene::distortion::fold;
use crate::scene::{Camera, Distortion, PhotoPixels};

pub(super) struct Pixels {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// 3 (RGB) or 4 (RGBA).
    pub(crate) channels: usize,
    /// Row-major, channels interleaved.
    pub(crate) data: Vec<u8>,
}

/// Color times weight, and weight.
type Sum = [f32; 4];

/// Resamples `pixels`, taken through a lens of `distortion` with `camera`'s intrinsics, to the view of `target` (the
/// same camera, possibly smaller).
pub(super) fn resample(
    pixels: &Pixels,
    camera: &Camera,
    distortion: Option<&Distortion>,
    target: &Camera,
) -> PhotoPixels {
    let (width_px, height_px) = (target.width_px, target.height_px);
    let (w, h) = (width_px as usize, height_px as usize);
    let mut rgb = vec![[0_u8; 3]; w * h];
    let mut coverage = vec![0_u8; w * h];
    let lens = distortion.map(|d| Lens::new(camera, d));
    let [columns, rows] = [(pixels.width, w), (pixels.height, h)].map(|(from, to)| taps(from, to, Filter::Area));
    rgb.par_chunks_exact_mut(w).zip(coverage.par_chunks_exact_mut(w)).enumerate().for_each(|(y, (rgb, coverage))| {
        let sums = match (&lens, pixels.channels) {
            (None, 3) => area_row::<3>(pixels, &columns, &rows[y]),
            (None, _) => area_row::<4>(pixels, &columns, &rows[y]),
            (Some(lens), 3) => lens.row::<3>(pixels, w, h, y),
            (Some(lens), _) => lens.row::<4>(pixels, w, h, y),
        };
        for ((rgb, coverage), [r, g, b, weight]) in rgb.iter_mut().zip(coverage).zip(sums) {
            *coverage = (weight * 255.0 + 0.5) as u8;
            if *coverage > 0 {
                *rgb = [r, g, b].map(|c| (c / weight + 0.5) as u8);
            }
        }
    });
    let partial = coverage.iter().any(|&c| c != u8::MAX);
    PhotoPixels { width_px, height_px, rgb, coverage: partial.then_some(coverage), alpha: None }
}

/// Color (0 to 255) times alpha, and alpha, of the pixel at `index`.
#[inline(always)]
fn texel<const C: usize>(data: &[u8], index: usize) -> Sum {
    let p = &data[index * C..index * C + C];
    let a = if C == 4 { f32::from(p[C - 1]) / 255.0 } else { 1.0 };
    [f32::from(p[0]) * a, f32::from(p[1]) * a, f32::from(p[2]) * a, a]
}

#[inline(always)]
fn add(sum: &mut Sum, value: Sum, weight: f32) {
    for (s, v) in sum.iter_mut().zip(value) {
        *s += v * weight;
    }
}

/// A row of the picture of exact area means, each divided by the area.
fn area_row<const C: usize>(pixels: &Pixels, columns: &[Tap<Sum>], row: &Tap<Sum>) -> Vec<Sum> {
    let at = |x: usize, y: usize| texel::<C>(&pixels.data, y * pixels.width + x);
    let line: Vec<Sum> = (0..pixels.width).map(|x| row.mix(|y| at(x, y))).collect();
    columns.iter().map(|tap| tap.mix(|x| line[x])).collect()
}

/// Reduces a photo to the view of `target` (the same camera, smaller) by area means over covered pixels.
pub(super) fn shrink(photo: &PhotoPixels, camera: &Camera, target: &Camera) -> PhotoPixels {
    let (width, height) = (photo.width_px as usize, photo.height_px as usize);
    let (channels, data) = match &photo.coverage {
        None => (3, photo.rgb.as_flattened().to_vec()),
        Some(coverage) => (4, photo.rgb.iter().zip(coverage).flat_map(|(&[r, g, b], &a)| [r, g, b, a]).collect()),
    };
    resample(&Pixels { width, height, channels, data }, camera, None, target)
}

/// Finds the pixel of the stored picture, of `camera`'s size, at the center of each pixel of the undistorted picture of
/// `width` by `height` px, row-major; `None` beyond its border.
pub(super) fn centers(camera: &Camera, distortion: &Distortion, [width, height]: [usize; 2]) -> Vec<Option<usize>> {
    let size = Vec2::new(camera.width_px as f32, camera.height_px as f32);
    let (lens, step) = (Lens::new(camera, distortion), size / Vec2::new(width as f32, height as f32));
    let row = |y: usize| {
        let mut at = vec![Vec2::ZERO; width];
        lens.source_row((y as f32 + 0.5) * step.y, step.x, &mut at);
        // Written so that NaN is outside.
        let inside = |p: &Vec2| p.x >= 0.0 && p.x < size.x && p.y >= 0.0 && p.y < size.y;
        at.into_iter().map(move |p| inside(&p).then_some(p.y as usize * size.x as usize + p.x as usize))
    };
    (0..height).into_par_iter().flat_map_iter(row).collect()
}

/// Returns whether any of the picture remains after undistortion: at least one point of a grid.
pub(super) fn covers(camera: &Camera, distortion: &Distortion) -> bool {
    const ACROSS: usize = 32;
    let size = Vec2::new(camera.width_px as f32, camera.height_px as f32);
    let lens = Lens::new(camera, distortion);
    let mut row = [Vec2::ZERO; ACROSS];
    (0..ACROSS).any(|y| {
        lens.source_row((y as f32 + 0.5) / ACROSS as f32 * size.y, size.x / ACROSS as f32, &mut row);
        row.iter().any(|p| p.x >= 0.0 && p.x <= size.x && p.y >= 0.0 && p.y <= size.y)
    })
}

/// A distorting lens.
struct Lens {
    plain: Plain,
    /// Lens beyond k1, k2, p1 and p2, if it has more, and the squared distance from the axis that it reaches.
    full: Option<(Distortion, f64)>,
}

/// The lens of four coefficients in single precision (a few 1e-4 px at 10,000 px).
struct Plain {
    focal: Vec2,
    principal: Vec2,
    k: [f32; 2],
    p: [f32; 2],
    /// Squared distance from the axis beyond which the model folds back on itself.
    fold: f32,
}

impl Lens {
    fn new(camera: &Camera, d: &Distortion) -> Self {
        let plain = Plain {
            focal: camera.focal_px.as_vec2(),
            principal: camera.principal_px.as_vec2(),
            k: [d.k1 as f32, d.k2 as f32],
            p: [d.p1 as f32, d.p2 as f32],
            fold: fold(d.k1, d.k2) as f32,
        };
        Self { plain, full: (!d.is_plain()).then(|| (*d, d.reach().powi(2))) }
    }

    /// Row `y` of the undistorted `w x h` picture.
    fn row<const C: usize>(&self, pixels: &Pixels, w: usize, h: usize, y: usize) -> Vec<Sum> {
        let (across, down) = (pixels.width.div_ceil(w), pixels.height.div_ceil(h));
        let n = w * across;
        let mut sums = vec![[0.0; 4]; w];
        let mut at = vec![Vec2::ZERO; n];
        let step = Vec2::new(pixels.width as f32 / n as f32, pixels.height as f32 / (h * down) as f32);
        let weight = 1.0 / (across * down) as f32;
        for sub in 0..down {
            let v = ((y * down + sub) as f32 + 0.5) * step.y;
            self.source_row(v, step.x, &mut at);
            for (sum, samples) in sums.iter_mut().zip(at.chunks_exact(across)) {
                for &p in samples {
                    if let Some(value) = bilinear::<C>(pixels, p) {
                        add(sum, value, weight);
                    }
                }
            }
        }
        sums
    }

    /// Maps the row of pinhole positions `((i + 0.5) * step, v)` to the picture on disk; NaN beyond the lens's field.
    fn source_row(&self, v: f32, step: f32, out: &mut [Vec2]) {
        let Some((lens, reach2)) = &self.full else { return self.plain.source_row(v, step, out) };
        let [focal, principal] = [self.plain.focal, self.plain.principal].map(Vec2::as_dvec2);
        let y = (f64::from(v) - principal.y) / focal.y;
        for (i, out) in out.iter_mut().enumerate() {
            let q = DVec2::new(((i as f64 + 0.5) * f64::from(step) - principal.x) / focal.x, y);
            let shown = q.length_squared() < *reach2;
            *out = if shown { (lens.bend(q) * focal + principal).as_vec2() } else { Vec2::NAN };
        }
    }
}

impl Plain {
    /// As [`Lens::source_row`]. No branches, so that the loop vectorizes.
    fn source_row(&self, v: f32, step: f32, out: &mut [Vec2]) {
        let y = (v - self.principal.y) / self.focal.y;
        let yy = y * y;
        let ([k1, k2], [p1, p2]) = (self.k, self.p);
        for (i, out) in out.iter_mut().enumerate() {
            let x = ((i as f32 + 0.5) * step - self.principal.x) / self.focal.x;
            let r2 = x * x + yy;
            let radial = 1.0 + r2 * (k1 + r2 * k2);
            let xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
            let yd = y * radial + p1 * (r2 + 2.0 * yy) + 2.0 * p2 * x * y;
            let sx = xd * self.focal.x + self.principal.x;
            *out = Vec2::new(if r2 < self.fold { sx } else { f32::NAN }, yd * self.focal.y + self.principal.y);
        }
    }
}

/// Samples the picture bilinearly at pixel position `p`; `None` outside of it.
#[inline(always)]
fn bilinear<const C: usize>(pixels: &Pixels, p: Vec2) -> Option<Sum> {
    let (w, h) = (pixels.width as f32, pixels.height as f32);
    // Written so that NaN is outside.
    if !(p.x >= 0.0 && p.x <= w && p.y >= 0.0 && p.y <= h) {
        return None;
    }
    // Pixel centers are at halves; the outermost half pixel repeats the border.
    let x = (p.x - 0.5).clamp(0.0, w - 1.0);
    let y = (p.y - 0.5).clamp(0.0, h - 1.0);
    let (x0, y0) = (x as usize, y as usize);
    let (fx, fy) = (x - x0 as f32, y - y0 as f32);
    let x1 = (x0 + 1).min(pixels.width - 1);
    let y1 = (y0 + 1).min(pixels.height - 1);
    let (top, bottom) = (y0 * pixels.width, y1 * pixels.width);
    let mut sum = [0.0; 4];
    add(&mut sum, texel::<C>(&pixels.data, top + x0), (1.0 - fx) * (1.0 - fy));
    add(&mut sum, texel::<C>(&pixels.data, top + x1), fx * (1.0 - fy));
    add(&mut sum, texel::<C>(&pixels.data, bottom + x0), (1.0 - fx) * fy);
    add(&mut sum, texel::<C>(&pixels.data, bottom + x1), fx * fy);
    Some(sum)
}

#[cfg(test)]
mod tests;
