//! The training loss `(1 - λ) L1 + λ (1 - SSIM)` and its gradient, and SSIM as a metric.
//!
//! SSIM as in Wang et al. 2004 with an 11-tap Gaussian window (sigma 1.5), zero padding, constants
//! for a peak of 1, mean over pixels and channels: the form the 3DGS literature reports. Filters
//! are separable: rows first, then columns, a row of the picture per task.

use rayon::prelude::*;

use crate::math::Real;

/// Taps of the window.
const TAPS: usize = 11;
const RADIUS: usize = TAPS / 2;
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;
/// Filtered quantities: x, y, x², y², x y.
const MAPS: usize = 5;
/// Partial derivatives of SSIM: by mean of x, mean of x², mean of x y.
const PARTIALS: usize = 3;

/// Buffers of the loss, to be kept from step to step.
#[derive(Debug, Default)]
pub struct PhotoLoss<R> {
    rows: Vec<R>,
    partials: Vec<R>,
    filtered: Vec<R>,
}

/// Parts of the loss, means over pixels and channels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LossParts {
    pub(crate) l1: f64,
    pub(crate) ssim: f64,
    pub(crate) mse: f64,
}

impl LossParts {
    /// `(1 - λ) L1 + λ (1 - SSIM)`.
    pub fn total(&self, lambda: f64) -> f64 {
        (1.0 - lambda) * self.l1 + lambda * (1.0 - self.ssim)
    }
}

fn window<R: Real>() -> [R; TAPS] {
    let raw: [f64; TAPS] = std::array::from_fn(|i| {
        let d = i as f64 - RADIUS as f64;
        (-d * d / (2.0 * 1.5 * 1.5)).exp()
    });
    let sum: f64 = raw.iter().sum();
    raw.map(|w| R::of(w / sum))
}

impl<R: Real> PhotoLoss<R> {
    /// Loss of one channel plane `x` against `y` (`width` values a row). Adds to `gradient`, where
    /// it is given (else pass an empty slice), the derivative of `total(lambda)` divided by the
    /// number of channels `channels`.
    pub fn channel(
        &mut self,
        x: &[R],
        y: &[R],
        width: usize,
        lambda: f64,
        channels: usize,
        gradient: &mut [R],
    ) -> LossParts {
        let pixels = x.len();
        let height = pixels / width;
        let taps = window::<R>();
        let wanted = !gradient.is_empty();
        self.rows.resize(pixels * MAPS, R::ZERO);
        self.partials.resize(if wanted { pixels * PARTIALS } else { height }, R::ZERO);
        self.rows
            .par_chunks_mut(width * MAPS)
            .zip(x.par_chunks(width))
            .zip(y.par_chunks(width))
            .for_each(|((out, x), y)| filter_products(out, x, y, &taps));
        let per_row = if wanted { width * PARTIALS } else { 1 };
        // Sums per row, added in order: the loss does not depend on the number of threads.
        let sums: Vec<[f64; 3]> = self
            .partials
            .par_chunks_mut(per_row)
            .zip(x.par_chunks(width))
            .zip(y.par_chunks(width))
            .enumerate()
            .map(|(row, ((out, x), y))| {
                let out = if wanted { out } else { &mut [] };
                let ssim = similarity(&self.rows, row, height, width, &taps, out);
                let (mut l1, mut mse) = (0.0, 0.0);
                for (a, b) in x.iter().zip(y) {
                    let d = (*a - *b).f64();
                    l1 += d.abs();
                    mse += d * d;
                }
                [ssim, l1, mse]
            })
            .collect();
        let mean = |k: usize| sums.iter().map(|s| s[k]).sum::<f64>() / pixels as f64;
        let parts = LossParts { ssim: mean(0), l1: mean(1), mse: mean(2) };
        if wanted {
            let scale = 1.0 / (pixels * channels) as f64;
            self.gradient(x, y, width, [(1.0 - lambda) * scale, -lambda * scale], &taps, gradient);
        }
        parts
    }

    fn gradient(&mut self, x: &[R], y: &[R], width: usize, weights: [f64; 2], taps: &[R; TAPS], out: &mut [R]) {
        let height = x.len() / width;
        self.filtered.resize(self.partials.len(), R::ZERO);
        self.filtered.par_chunks_mut(width * PARTIALS).zip(self.partials.par_chunks(width * PARTIALS)).for_each(
            |(out, partials)| {
                for k in 0..PARTIALS {
                    filter_row(&mut out[k * width..(k + 1) * width], &partials[k * width..(k + 1) * width], taps);
                }
            },
        );
        let filtered = &self.filtered;
        out.par_chunks_mut(width)
            .zip(x.par_chunks(width))
            .zip(y.par_chunks(width))
            .enumerate()
            .for_each(|(row, ((out, x), y))| combine(filtered, row, height, x, y, weights, taps, out));
    }
}

/// Mean SSIM of two pictures given as channel planes of `width` values a row.
pub(crate) fn ssim<R: Real>(a: &[Vec<R>], b: &[Vec<R>], width: usize) -> f64 {
    let mut loss = PhotoLoss::default();
    let sum: f64 = a.iter().zip(b).map(|(x, y)| loss.channel(x, y, width, 0.0, 1, &mut []).ssim).sum();
    sum / a.len() as f64
}

/// `out = window * row`, zeros outside.
#[multiversion::multiversion(targets("x86_64+avx2+fma"))]
fn filter_row<R: Real>(out: &mut [R], row: &[R], taps: &[R; TAPS]) {
    let mut wide = vec![R::ZERO; row.len() + 2 * RADIUS];
    wide[RADIUS..RADIUS + row.len()].copy_from_slice(row);
    accumulate(out, &wide, taps);
}

#[inline(always)]
fn accumulate<R: Real>(out: &mut [R], wide: &[R], taps: &[R; TAPS]) {
    out.fill(R::ZERO);
    for (t, weight) in taps.iter().enumerate() {
        for (o, v) in out.iter_mut().zip(&wide[t..]) {
            *o += *v * *weight;
        }
    }
}

/// Row filters of x, y, x², y², x y, one after the other in `out`.
#[multiversion::multiversion(targets("x86_64+avx2+fma"))]
fn filter_products<R: Real>(out: &mut [R], x: &[R], y: &[R], taps: &[R; TAPS]) {
    let width = x.len();
    let mut wide = vec![R::ZERO; width + 2 * RADIUS];
    for k in 0..MAPS {
        let inner = &mut wide[RADIUS..RADIUS + width];
        for i in 0..width {
            inner[i] = match k {
                0 => x[i],
                1 => y[i],
                2 => x[i] * x[i],
                3 => y[i] * y[i],
                _ => x[i] * y[i],
            };
        }
        accumulate(&mut out[k * width..(k + 1) * width], &wide, taps);
    }
}

/// Column filter at `row` of the `k`-th of `maps` interleaved row-filtered planes.
#[inline(always)]
fn column<R: Real>(out: &mut [R], planes: &[R], [k, maps]: [usize; 2], [row, height]: [usize; 2], taps: &[R; TAPS]) {
    let width = out.len();
    out.fill(R::ZERO);
    for t in 0..TAPS {
        let Some(from) = (row + t).checked_sub(RADIUS).filter(|&r| r < height) else { continue };
        let at = (from * maps + k) * width;
        let weight = taps[t];
        for (o, v) in out.iter_mut().zip(&planes[at..at + width]) {
            *o += *v * weight;
        }
    }
}

/// SSIM summed over a row; its partial derivatives into `out` unless that is empty.
#[multiversion::multiversion(targets("x86_64+avx2+fma"))]
fn similarity<R: Real>(planes: &[R], row: usize, height: usize, width: usize, taps: &[R; TAPS], out: &mut [R]) -> f64 {
    let mut maps = vec![R::ZERO; width * MAPS];
    for (k, map) in maps.chunks_mut(width).enumerate() {
        column(map, planes, [k, MAPS], [row, height], taps);
    }
    let (c1, c2, two) = (R::of(C1), R::of(C2), R::of(2.0));
    let mut values = vec![R::ZERO; width];
    let mut partials = vec![R::ZERO; width * PARTIALS];
    {
        let [mx, my, xx, yy, xy]: [&[R]; MAPS] = std::array::from_fn(|k| &maps[k * width..(k + 1) * width]);
        let (by_mean, rest) = partials.split_at_mut(width);
        let (by_square, by_product) = rest.split_at_mut(width);
        let by_product = &mut by_product[..width];
        for i in 0..width {
            let (mx, my) = (mx[i], my[i]);
            let (vx, vy) = (xx[i] - mx * mx, yy[i] - my * my);
            let cov = xy[i] - mx * my;
            let (a1, a2) = (two * mx * my + c1, two * cov + c2);
            let (b1, b2) = (mx * mx + my * my + c1, vx + vy + c2);
            let inverse = R::ONE / (b1 * b2);
            let s = a1 * a2 * inverse;
            values[i] = s;
            let d_cov = two * a1 * inverse;
            let d_var = -s * inverse * b1;
            by_mean[i] = two * my * a2 * inverse - two * mx * s * inverse * b2 - two * mx * d_var - my * d_cov;
            by_square[i] = d_var;
            by_product[i] = d_cov;
        }
    }
    if !out.is_empty() {
        out.copy_from_slice(&partials);
    }
    values.iter().map(|s| s.f64()).sum()
}

/// Gradient of a row from the row-filtered partials, plus that of L1.
#[multiversion::multiversion(targets("x86_64+avx2+fma"))]
#[allow(clippy::too_many_arguments)]
fn combine<R: Real>(
    filtered: &[R],
    row: usize,
    height: usize,
    x: &[R],
    y: &[R],
    [l1, ssim]: [f64; 2],
    taps: &[R; TAPS],
    out: &mut [R],
) {
    let width = x.len();
    let mut maps = vec![R::ZERO; width * PARTIALS];
    for (k, map) in maps.chunks_mut(width).enumerate() {
        column(map, filtered, [k, PARTIALS], [row, height], taps);
    }
    let (l1, ssim, two) = (R::of(l1), R::of(ssim), R::of(2.0));
    for i in 0..width {
        let d = x[i] - y[i];
        let sign = if d > R::ZERO {
            l1
        } else if d < R::ZERO {
            -l1
        } else {
            R::ZERO
        };
        out[i] = sign + ssim * (maps[i] + two * x[i] * maps[width + i] + y[i] * maps[2 * width + i]);
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    fn noise(n: usize, seed: u64) -> Vec<f64> {
        let mut r = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
        (0..n).map(|_| r.random_range(0.0..1.0)).collect()
    }

    #[test]
    fn gradient_matches_central_differences() {
        let (w, h) = (17, 13);
        let (mut x, y) = (noise(w * h, 1), noise(w * h, 2));
        let mut gradient = vec![0.0; w * h];
        let mut loss = PhotoLoss::default();
        loss.channel(&x, &y, w, 0.2, 3, &mut gradient);
        let scale = gradient.iter().fold(0.0_f64, |m, g| m.max(g.abs()));
        for i in 0..w * h {
            let at = x[i];
            let mut value = |v: f64| {
                x[i] = v;
                loss.channel(&x, &y, w, 0.2, 3, &mut []).total(0.2) / 3.0
            };
            let numeric = (value(at + 1e-6) - value(at - 1e-6)) / 2e-6;
            x[i] = at;
            assert!((numeric - gradient[i]).abs() < 1e-6 * scale, "{i}: {numeric} {}", gradient[i]);
        }
        // Negative control: the gradient at another picture is not this one.
        let mut other = vec![0.0; w * h];
        loss.channel(&noise(w * h, 3), &y, w, 0.2, 3, &mut other);
        assert!(gradient.iter().zip(&other).any(|(a, b)| (a - b).abs() > 1e-3 * scale));
    }

    #[test]
    fn constant_and_equal_pictures_are_defined() {
        let n = noise(400, 5);
        assert!((ssim(std::slice::from_ref(&n), std::slice::from_ref(&n), 20) - 1.0).abs() < 1e-12);
        let black = [vec![0.0; 400]];
        assert!((ssim(&black, &black, 20) - 1.0).abs() < 1e-12);
        let s = ssim(&black, &[vec![1.0; 400]], 20);
        assert!(s.is_finite() && s < 0.01, "{s}");
        let f: Vec<f32> = n.iter().map(|&v| v as f32).collect();
        let g: Vec<f32> = noise(400, 6).iter().map(|&v| v as f32).collect();
        assert!((ssim(&[f], &[g], 20) - ssim(&[n], &[noise(400, 6)], 20)).abs() < 1e-5);
    }

    #[test]
    fn one_window_equals_the_definition() {
        // In the middle of an 11 x 11 picture the window sees all of it.
        let (x, y) = (noise(121, 7), noise(121, 8));
        let w = window::<f64>();
        let e = |f: &dyn Fn(usize) -> f64| (0..121).map(|i| w[i / 11] * w[i % 11] * f(i)).sum::<f64>();
        let (mx, my) = (e(&|i| x[i]), e(&|i| y[i]));
        let (vx, vy) = (e(&|i| (x[i] - mx).powi(2)), e(&|i| (y[i] - my).powi(2)));
        let cov = e(&|i| (x[i] - mx) * (y[i] - my));
        let want = (2.0 * mx * my + C1) * (2.0 * cov + C2) / ((mx * mx + my * my + C1) * (vx + vy + C2));
        let mut rows = vec![0.0; 121 * MAPS];
        for (row, out) in rows.chunks_mut(11 * MAPS).enumerate() {
            filter_products(out, &x[row * 11..row * 11 + 11], &y[row * 11..row * 11 + 11], &w);
        }
        let mut maps = [0.0; MAPS];
        for (k, m) in maps.iter_mut().enumerate() {
            let mut out = vec![0.0; 11];
            column(&mut out, &rows, [k, MAPS], [5, 11], &w);
            *m = out[5];
        }
        let cov2 = maps[4] - maps[0] * maps[1];
        let (vx2, vy2) = (maps[2] - maps[0] * maps[0], maps[3] - maps[1] * maps[1]);
        let got = (2.0 * maps[0] * maps[1] + C1) * (2.0 * cov2 + C2)
            / ((maps[0].powi(2) + maps[1].powi(2) + C1) * (vx2 + vy2 + C2));
        assert!((got - want).abs() < 1e-9, "{got} {want}");
    }
}
