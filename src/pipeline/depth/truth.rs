//! True depths of a photo.

use std::path::Path;

use crate::io::{IoError, npy};
use crate::math::grid::{grown, neighbors};
use crate::math::resize::between;

/// Neighboring depths whose ratio is larger belong to different surfaces.
pub(crate) const EDGE_JUMP: f32 = 1.05;
/// Pixels within this distance of a jump, along rows and columns, are edges.
pub(crate) const EDGE_PX: usize = 2;

/// Depths along the camera's axis at pixel centers, row by row; 0 = empty.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TrueDepth {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Scene units.
    pub(crate) values: Vec<f32>,
}

impl TrueDepth {
    /// Reads an `.npy` file.
    pub(crate) fn read(path: &Path) -> Result<Self, IoError> {
        let (width, height, values) = npy::read_map(path)?;
        Ok(Self { width, height, values })
    }

    /// Resamples the depths at the pixel centers of a smaller (or larger) picture. Inverse depth is interpolated
    /// between four pixels of one surface, which is exact on planes; next to a jump the nearest pixel counts.
    pub(crate) fn resampled(&self, width: usize, height: usize) -> Self {
        if (width, height) == (self.width, self.height) {
            return self.clone();
        }
        let at = |x: usize, y: usize| self.values[y * self.width + x];
        let value = |x: usize, y: usize| {
            let ((x0, x1, u), (y0, y1, v)) = (between(x, self.width, width), between(y, self.height, height));
            let four = [at(x0, y0), at(x1, y0), at(x0, y1), at(x1, y1)];
            let (near, far) = four.iter().fold((f32::INFINITY, 0.0_f32), |(n, f), &z| (n.min(z), f.max(z)));
            if near > 0.0 && far <= near * EDGE_JUMP {
                let [a, b, c, d] = four.map(f32::recip);
                let (top, bottom) = (a + (b - a) * u, c + (d - c) * u);
                return (top + (bottom - top) * v).recip();
            }
            at(if u < 0.5 { x0 } else { x1 }, if v < 0.5 { y0 } else { y1 })
        };
        let values = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| value(x, y)).collect();
        Self { width, height, values }
    }

    /// Marks the pixels within [`EDGE_PX`] of a jump, including a jump to empty pixels.
    pub(crate) fn edges(&self) -> Vec<bool> {
        let n = self.values.len();
        let jump = |a: f32, b: f32| a.max(b) > a.min(b) * EDGE_JUMP;
        let beside = |i: usize| neighbors(i, self.width, n).any(|j| jump(self.values[i], self.values[j]));
        // Both pixels at a jump are 1 px from it or nearer.
        grown(self.width, (0..n).map(beside).collect(), EDGE_PX - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_survive_resampling_and_jumps_stay_sharp() {
        // 1 / z = 0.2 + 0.01 x, seen at pixel centers; from column 12 on a far surface.
        let inverse = |x: f32| 0.2 + 0.01 * x;
        let depth = |x: f32| if x < 12.0 { inverse(x).recip() } else { 90.0 };
        let map = |width: usize| {
            let scale = 24.0 / width as f32;
            let values = (0..width / 2).flat_map(|_| (0..width).map(move |x| depth((x as f32 + 0.5) * scale)));
            TrueDepth { width, height: width / 2, values: values.collect() }
        };
        let small = map(24).resampled(8, 4);
        for (a, b) in small.values.iter().zip(&map(8).values) {
            assert!((a / b - 1.0).abs() < 1e-5, "{a} {b}");
        }
        // Two sizes whose pixel centers differ.
        for (i, z) in map(24).resampled(10, 5).values.iter().enumerate() {
            let x = (i % 10) as f32 * 2.4 + 1.2;
            let expected = depth(x);
            assert!((z / expected - 1.0).abs() < 0.02 || (x - 12.0).abs() < 1.3, "{i}: {z} {expected}");
        }
    }

    #[test]
    fn edges_are_two_pixels_wide_on_both_sides() {
        let values = (0..12).map(|x| if x < 6 { 1.0 } else { 1.2 }).collect();
        let t = TrueDepth { width: 12, height: 1, values };
        let edges: Vec<usize> = (0..12).filter(|&i| t.edges()[i]).collect();
        assert_eq!(edges, [4, 5, 6, 7]);
        // A slope is no edge.
        let slope = TrueDepth { width: 12, height: 1, values: (0..12).map(|x| 1.0 + 0.04 * x as f32).collect() };
        assert!(!slope.edges().contains(&true));
    }
}
