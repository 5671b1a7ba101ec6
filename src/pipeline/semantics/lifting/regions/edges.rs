//! Edge strength of a picture at each pixel, over several scales: a change at all of them is an edge, a change at the
//! finest only is texture.

use rayon::prelude::*;

use crate::math::blur::blur;

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

#[cfg(test)]
mod tests {
    use super::*;

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
