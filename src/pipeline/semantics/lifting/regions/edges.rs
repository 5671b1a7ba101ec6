//! Edge strength of a picture at each pixel, over several scales: a change at all of them is an edge, a change at the
//! finest only is texture.

use rayon::prelude::*;

/// Width of the blur at each scale, px, and its share of the strength.
const SCALES: [(f32, f32); 3] = [(0.8, 0.3), (1.6, 0.35), (3.2, 0.35)];

/// A picture's planes, row-major, and its width in px.
pub(crate) struct ImagePlanes<'a> {
    pub(crate) width: usize,
    pub(crate) channels: &'a [Vec<f32>],
}

/// Length of the gradient, in values per px times the width of the blur, at each pixel.
pub(crate) fn strength(planes: &ImagePlanes<'_>) -> Vec<f32> {
    let n = planes.channels.first().map_or(0, Vec::len);
    let mut total = vec![0.0_f32; n];
    for (sigma, share) in SCALES {
        let squares: Vec<Vec<f32>> =
            planes.channels.par_iter().map(|c| gradient_squared(&blur(c, planes.width, sigma), planes.width)).collect();
        // Across a step of height h the gradient of the blurred picture is h / (sigma sqrt(2 pi)).
        let scale = share * sigma * (2.0 * std::f32::consts::PI).sqrt();
        total.par_iter_mut().enumerate().for_each(|(i, t)| {
            *t += scale * squares.iter().map(|s| s[i]).sum::<f32>().sqrt();
        });
    }
    total
}

fn gradient_squared(plane: &[f32], width: usize) -> Vec<f32> {
    let height = plane.len() / width.max(1);
    let mut out = vec![0.0; plane.len()];
    for y in 0..height {
        let (up, down) = (y.saturating_sub(1) * width, (y + 1).min(height - 1) * width);
        for x in 0..width {
            let (left, right) = (x.saturating_sub(1), (x + 1).min(width - 1));
            let dx = plane[y * width + right] - plane[y * width + left];
            let dy = plane[down + x] - plane[up + x];
            out[y * width + x] = 0.25 * (dx * dx + dy * dy);
        }
    }
    out
}

/// Blurs a plane by a Gaussian; the border pixels repeat.
pub(crate) fn blur(plane: &[f32], width: usize, sigma: f32) -> Vec<f32> {
    let reach = (3.0 * sigma).ceil() as isize;
    let mut weights: Vec<f32> = (-reach..=reach).map(|d| (-0.5 * (d as f32 / sigma).powi(2)).exp()).collect();
    let sum: f32 = weights.iter().sum();
    weights.iter_mut().for_each(|w| *w /= sum);
    let height = plane.len() / width.max(1);
    let mut rows = vec![0.0; plane.len()];
    rows.par_chunks_mut(width.max(1)).zip(plane.par_chunks(width.max(1))).for_each(|(out, row)| {
        let inside = reach as usize..width.saturating_sub(reach as usize);
        for (x, out) in out.iter_mut().enumerate().filter(|(x, _)| !inside.contains(x)) {
            let at = |d: isize| row[(x as isize + d).clamp(0, width as isize - 1) as usize];
            *out = weights.iter().zip(-reach..).map(|(w, d)| w * at(d)).sum();
        }
        // Weight by weight, so that many pixels are summed at once, each in the order of the weights.
        for (k, w) in weights.iter().enumerate().filter(|_| !inside.is_empty()) {
            out[inside.clone()].iter_mut().zip(&row[k..]).for_each(|(o, v)| *o += w * v);
        }
    });
    let mut out = vec![0.0; plane.len()];
    out.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, out)| {
        for (w, d) in weights.iter().zip(-reach..) {
            let from = (y as isize + d).clamp(0, height as isize - 1) as usize * width;
            out.iter_mut().zip(&rows[from..from + width]).for_each(|(o, v)| *o += w * v);
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_blur_is_the_weighted_sum_of_each_row_and_column() {
        let (width, height, sigma) = (23, 9, 1.6_f32);
        let plane: Vec<f32> = (0..width * height).map(|i| (i * 7919 % 101) as f32).collect();
        let reach = (3.0 * sigma).ceil() as isize;
        let weight = |d: isize| (-0.5 * (d as f32 / sigma).powi(2)).exp();
        let all: f32 = (-reach..=reach).map(weight).sum();
        let at = |x: isize, y: isize| {
            plane[y.clamp(0, height as isize - 1) as usize * width + x.clamp(0, width as isize - 1) as usize]
        };
        let row = |x: isize, y: isize| (-reach..=reach).map(|d| weight(d) / all * at(x + d, y)).sum::<f32>();
        let both = |x: isize, y: isize| (-reach..=reach).map(|d| weight(d) / all * row(x, y + d)).sum::<f32>();
        let found = blur(&plane, width, sigma);
        for (i, v) in found.iter().enumerate() {
            let expected = both((i % width) as isize, (i / width) as isize);
            assert!((v - expected).abs() < 1e-3, "{i}: {v} {expected}");
        }
        let far = found.iter().zip(&plane).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(far > 10.0, "the control: it is blurred");
        // Narrower than the blur.
        assert_eq!(blur(&[3.0; 8], 2, sigma).len(), 8);
        assert!(blur(&[3.0; 8], 2, sigma).iter().all(|v| (v - 3.0).abs() < 1e-5));
    }

    fn strongest(picture: impl Fn(usize) -> f32) -> f32 {
        let plane: Vec<f32> = (0..64 * 32).map(|i| picture(i % 64)).collect();
        strength(&ImagePlanes { width: 64, channels: &[plane] }).into_iter().fold(0.0, f32::max)
    }

    #[test]
    fn a_step_counts_with_its_height_and_texture_with_less() {
        let step = strongest(|x| if x < 32 { 0.0 } else { 10.0 });
        assert!((step - 10.0).abs() < 3.0, "{step}");
        let stripes = strongest(|x| if x / 2 % 2 == 0 { 0.0 } else { 10.0 });
        assert!(stripes < 0.7 * step, "{stripes}");
        assert_eq!(strongest(|_| 7.0), 0.0);
    }
}
