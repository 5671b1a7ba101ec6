//! Gray pictures, as signatures and features see them. Pixel centers are at half integers.

use crate::math::blur::blur;
use crate::math::resize::{Filter, resize};
use crate::scene::PhotoPixels;

/// Shares of red, green and blue in gray.
const LUMA: [f32; 3] = [0.299, 0.587, 0.114];

/// A gray picture, row by row.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct GrayPlane {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) values: Vec<f32>,
}

impl GrayPlane {
    pub(super) fn of_photo(photo: &PhotoPixels) -> Self {
        let gray = |p: &[u8; 3]| (0..3).map(|c| LUMA[c] * f32::from(p[c])).sum::<f32>() / 255.0;
        Self {
            width: photo.width_px as usize,
            height: photo.height_px as usize,
            values: photo.rgb.iter().map(gray).collect(),
        }
    }

    /// The gray of color planes; each color is clamped to what a photo can hold.
    pub(super) fn of_planes(planes: &[Vec<f32>; 3], width: usize) -> Self {
        let values: Vec<f32> =
            (0..planes[0].len()).map(|i| (0..3).map(|c| LUMA[c] * planes[c][i].clamp(0.0, 1.0)).sum()).collect();
        Self { width, height: values.len() / width.max(1), values }
    }

    pub(super) fn resized(&self, width: usize, height: usize) -> Self {
        let filter = if width < self.width { Filter::Area } else { Filter::Bilinear };
        let values = resize(&self.values, (self.width, self.height), (width, height), filter);
        Self { width, height, values }
    }

    /// The picture turned by a quarter, clockwise.
    pub(super) fn turned(&self) -> Self {
        let (width, height) = (self.height, self.width);
        let at = |i: usize| self.values[(self.height - 1 - i % width) * self.width + i / width];
        Self { width, height, values: (0..width * height).map(at).collect() }
    }

    /// The picture under a Gaussian blur.
    pub(super) fn blurred(&self, sigma_px: f32) -> Self {
        Self { values: blur(&self.values, self.width, sigma_px), ..*self }
    }

    /// Central differences along x and y, per px.
    pub(super) fn slopes(&self) -> [Self; 2] {
        slopes(&self.values, self.width).map(|values| Self { values, ..*self })
    }

    /// The value between pixel centers; beyond the border that of the border.
    pub(super) fn sample(&self, x: f32, y: f32) -> f32 {
        let along = |at: f32, size: usize| {
            let at = (at - 0.5).clamp(0.0, (size - 1) as f32);
            let low = (at as usize).min(size.saturating_sub(2));
            (low, (low + 1).min(size - 1), at - low as f32)
        };
        let ((x0, x1, u), (y0, y1, v)) = (along(x, self.width), along(y, self.height));
        let row = |y: usize| self.values[y * self.width + x0] * (1.0 - u) + self.values[y * self.width + x1] * u;
        row(y0) * (1.0 - v) + row(y1) * v
    }
}

/// Central differences along x and y of a picture, per px; one-sided at the border.
pub(super) fn slopes(values: &[f32], width: usize) -> [Vec<f32>; 2] {
    let height = values.len() / width.max(1);
    let between = |low: usize, high: usize, steps: usize| (values[high] - values[low]) / steps.max(1) as f32;
    let along_x = |i: usize| {
        let (x, row) = (i % width, i - i % width);
        let (low, high) = (x.saturating_sub(1), (x + 1).min(width - 1));
        between(row + low, row + high, high - low)
    };
    let along_y = |i: usize| {
        let (x, y) = (i % width, i / width);
        let (low, high) = (y.saturating_sub(1), (y + 1).min(height - 1));
        between(low * width + x, high * width + x, high - low)
    };
    [(0..values.len()).map(along_x).collect(), (0..values.len()).map(along_y).collect()]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp() -> GrayPlane {
        let values = (0..12).map(|i| (i % 4) as f32 + 10.0 * (i / 4) as f32).collect();
        GrayPlane { width: 4, height: 3, values }
    }

    #[test]
    fn a_ramp_has_its_slopes_and_samples() {
        let [x, y] = ramp().slopes();
        assert!(x.values.iter().all(|v| *v == 1.0) && y.values.iter().all(|v| *v == 10.0));
        assert_eq!(ramp().sample(2.0, 1.0), 1.5 + 5.0);
        assert_eq!(ramp().sample(-9.0, 99.0), 20.0);
    }

    #[test]
    fn four_quarter_turns_are_none() {
        let once = ramp().turned();
        assert_eq!((once.width, once.height), (3, 4));
        assert_eq!(once.values[0], 20.0, "the lower left corner comes to the upper left");
        assert_eq!(once.turned().turned().turned(), ramp());
    }
}
