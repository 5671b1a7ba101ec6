//! Perceptual colors: CIELAB, D65.

use rayon::prelude::*;

use crate::math::srgb::linear as linear_light;

/// Fewest pixels that are worth a task.
const SOME_PX: usize = 4_096;

/// L* a* b* of sRGB bytes.
pub(crate) fn lab(rgb: &[[u8; 3]]) -> Vec<[f32; 3]> {
    let linear: Vec<f32> = (0..=255_u8).map(|v| linear_light(f32::from(v) / 255.0)).collect();
    rgb.par_iter()
        .with_min_len(SOME_PX)
        .map(|p| {
            let [r, g, b] = p.map(|v| linear[usize::from(v)]);
            let x = (0.412_456_4 * r + 0.357_576_1 * g + 0.180_437_5 * b) / 0.950_47;
            let y = 0.212_672_9 * r + 0.715_152_2 * g + 0.072_175 * b;
            let z = (0.019_333_9 * r + 0.119_192 * g + 0.950_304_1 * b) / 1.088_83;
            let [x, y, z] = [x, y, z].map(root);
            [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
        })
        .collect()
}

/// Weight of lightness beside the two color axes: shadows change it within a thing.
const LIGHTNESS: f32 = 0.7;

/// Returns the planes for edge detection, in which lightness has less weight.
pub(crate) fn planes(colors: &[[f32; 3]]) -> [Vec<f32>; 3] {
    let weights = [LIGHTNESS, 1.0, 1.0];
    [0, 1, 2].map(|c| colors.iter().map(|p| weights[c] * p[c]).collect())
}

/// Cube root, linear near zero.
fn root(t: f32) -> f32 {
    if t > 0.008_856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_colors() {
        let found = lab(&[[255, 255, 255], [0, 0, 0], [255, 0, 0], [0, 0, 255]]);
        let want = [[100.0, 0.0, 0.0], [0.0, 0.0, 0.0], [53.24, 80.09, 67.2], [32.3, 79.19, -107.86]];
        for (found, want) in found.iter().flatten().zip(want.iter().flatten()) {
            assert!((found - want).abs() < 0.05, "{found} {want}");
        }
    }
}
