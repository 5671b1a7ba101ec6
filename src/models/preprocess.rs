//! Preprocessing of pictures: resized as Pillow does, which the networks were trained with, then normalized.

use super::tensor::Tensor;
use crate::math::resize::{Filter, resize};
use crate::scene::PhotoPixels;

/// Side of a picture that is fitted to the network's square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FitSide {
    /// Shorter side; the picture is center-cropped.
    Shorter,
    /// Longer side; padded with zeros to the right and below, after normalizing.
    Longer,
    /// Both sides: the picture is squeezed.
    Both,
}

/// Preprocessing settings of a network.
#[derive(Clone, Debug, PartialEq)]
pub struct Prepare {
    /// Side of the square, px.
    pub side_px: usize,
    /// Resampling filter.
    pub filter: Filter,
    /// Side that is fitted.
    pub side: FitSide,
    /// Subtracted from colors in 0..1.
    pub mean: [f32; 3],
    /// Divides the difference.
    pub std: [f32; 3],
}

impl Prepare {
    /// Returns a picture as `[1, 3, S, S]`; `None` for one without pixels.
    pub fn picture(&self, picture: &PhotoPixels) -> Option<Tensor> {
        let (w, h) = (picture.width_px as usize, picture.height_px as usize);
        let (to_w, to_h) = self.resized(w, h)?;
        let resized = resize(&picture.rgb, (w, h), (to_w, to_h), self.filter);
        if resized.is_empty() {
            return None;
        }
        let s = self.side_px;
        // Position of the square's first pixel in the resized picture; halves are rounded to even.
        let offset = |n: usize| ((n as f64 - s as f64) / 2.0).round_ties_even() as i64;
        let (left, top) = if self.side == FitSide::Shorter { (offset(to_w), offset(to_h)) } else { (0, 0) };
        let mut values = vec![0.0; 3 * s * s];
        for y in 0..s {
            for x in 0..s {
                let (from_x, from_y) = (x as i64 + left, y as i64 + top);
                let inside = (0..to_w as i64).contains(&from_x) && (0..to_h as i64).contains(&from_y);
                if !inside {
                    continue;
                }
                let pixel = resized[from_y as usize * to_w + from_x as usize];
                for c in 0..3 {
                    let value = f32::from(pixel[c]) / 255.0;
                    values[(c * s + y) * s + x] = (value - self.mean[c]) / self.std[c];
                }
            }
        }
        Some(Tensor::new(&[1, 3, s, s], values))
    }

    /// Size to which a picture is resized, px.
    pub(crate) fn resized(&self, w: usize, h: usize) -> Option<(usize, usize)> {
        if w == 0 || h == 0 {
            return None;
        }
        let s = self.side_px;
        Some(match self.side {
            FitSide::Both => (s, s),
            // The official code truncates here, ...
            FitSide::Shorter if w <= h => (s, (s * h / w).max(1)),
            FitSide::Shorter => ((s * w / h).max(1), s),
            // ... and rounds there.
            FitSide::Longer => {
                let scale = s as f64 / w.max(h) as f64;
                ((w as f64 * scale + 0.5) as usize, (h as f64 * scale + 0.5) as usize)
            }
        })
    }
}

/// Enlarges a network's plane of logits, `low` px a side, to the size of the picture, as the official code does. The
/// picture lies in the network's square of `square` px as `side` says.
pub fn enlarge(plane: &[f32], low: usize, square: usize, side: FitSide, to: (usize, usize)) -> Vec<f32> {
    if side != FitSide::Longer {
        return resize(plane, (low, low), to, Filter::Linear);
    }
    // The rest of the square is padding.
    let scale = square as f64 / to.0.max(to.1) as f64;
    let used = |n: usize| ((n as f64 * scale + 0.5) as usize).clamp(1, square);
    let (w, h) = (used(to.0), used(to.1));
    let full = resize(plane, (low, low), (square, square), Filter::Linear);
    let cut: Vec<f32> = full.chunks_exact(square).take(h).flat_map(|row| row[..w].iter().copied()).collect();
    resize(&cut, (w, h), to, Filter::Linear)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wide_picture_uses_the_upper_part_of_the_square() {
        // 8 x 4 px in a square of 8: the lower half of the logits is padding.
        let plane: Vec<f32> = (0..16).map(|i| if i / 4 < 2 { 1.0 } else { -9.0 }).collect();
        let out = enlarge(&plane, 4, 8, FitSide::Longer, (8, 4));
        assert!(out[..24].iter().all(|v| *v == 1.0), "{out:?}");
        assert!(enlarge(&plane, 4, 8, FitSide::Both, (8, 4))[24..].iter().all(|v| *v == -9.0));
    }
}
