//! Cutting a tile: the same arithmetic as `tools/encoder/tiles.py`, held equal by a test.

use super::Tile;
use crate::scene::Mask;

/// Weights of the pixels `first..` of a line for one pixel of the resized line.
struct Tap {
    first: usize,
    weights: Vec<f32>,
}

impl Tile {
    /// The region of a picture on black: its bounding box, padded to a square, resized. `None` for
    /// an empty mask, and for a picture that does not have the mask's size.
    pub fn cut(rgb: &[[f32; 3]], mask: &Mask, side_px: usize) -> Option<Self> {
        let bounds = mask.bounds()?;
        let width_px = mask.width_px();
        if rgb.len() != width_px * mask.height_px() || side_px == 0 {
            return None;
        }
        let (w, h) = (bounds.x.len(), bounds.y.len());
        let square = w.max(h);
        let (left, top) = ((square - w) / 2, (square - h) / 2);
        let taps = taps(square, side_px);
        // Rows first: only those of the box have anything in them.
        let mut wide = vec![[0.0_f32; 3]; h * side_px];
        for (y, row) in wide.chunks_exact_mut(side_px).enumerate() {
            let line = (bounds.y.start + y) * width_px + bounds.x.start;
            for (tap, out) in taps.iter().zip(row) {
                for (k, weight) in tap.weights.iter().enumerate() {
                    let x = (tap.first + k).wrapping_sub(left);
                    if x < w && mask.contains(line + x) {
                        add(out, rgb[line + x], *weight);
                    }
                }
            }
        }
        let mut out = vec![[0.0_f32; 3]; side_px * side_px];
        for (tap, row) in taps.iter().zip(out.chunks_exact_mut(side_px)) {
            for (k, weight) in tap.weights.iter().enumerate() {
                let y = (tap.first + k).wrapping_sub(top);
                if y < h {
                    let source = &wide[y * side_px..(y + 1) * side_px];
                    row.iter_mut().zip(source).for_each(|(out, from)| add(out, *from, *weight));
                }
            }
        }
        Some(Self { side_px, rgb: out })
    }
}

fn add(sum: &mut [f32; 3], value: [f32; 3], weight: f32) {
    sum.iter_mut().zip(value).for_each(|(s, v)| *s += v * weight);
}

/// A triangle filter from `from` pixels to `to`, as wide as an output pixel where it shrinks.
fn taps(from: usize, to: usize) -> Vec<Tap> {
    let scale = from as f64 / to as f64;
    let support = scale.max(1.0);
    let tap = |i: usize| {
        let centre = (i as f64 + 0.5) * scale;
        let first = (centre - support - 0.5).ceil().max(0.0) as usize;
        let end = ((centre + support - 0.5).floor().max(0.0) as usize + 1).min(from);
        let weights: Vec<f64> =
            (first..end).map(|j| (1.0 - (j as f64 + 0.5 - centre).abs() / support).max(0.0)).collect();
        let sum: f64 = weights.iter().sum();
        Tap { first, weights: weights.iter().map(|w| (w / sum) as f32).collect() }
    };
    (0..to).map(tap).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_masked_box_is_centred_on_black() {
        let rgb: Vec<[f32; 3]> = (0..200).map(|i| [i as f32 / 200.0, 0.5, 1.0]).collect();
        let inside = |i: usize| (3..11).contains(&(i % 20)) && (2..6).contains(&(i / 20)) && i != 2 * 20 + 3;
        let tile = Tile::cut(&rgb, &Mask::from_fn(20, 10, inside), 8).expect("not empty");
        // 8 x 4 px from row 2 on, centred in 8 x 8: row 2 again.
        for i in 0..64_usize {
            let (x, y) = (i % 8, i / 8);
            let seen = (2..6).contains(&y) && (x, y) != (0, 2);
            let expected = if seen { rgb[y * 20 + 3 + x] } else { [0.0; 3] };
            assert_eq!(tile.rgb[i], expected, "{x}, {y}");
        }
    }

    #[test]
    fn flat_colour_keeps_its_value_at_any_size() {
        let rgb = vec![[0.25, 0.5, 0.75]; 37 * 37];
        for side_px in [1, 5, 37, 64] {
            let tile = Tile::cut(&rgb, &Mask::from_fn(37, 37, |_| true), side_px).expect("not empty");
            assert_eq!(tile.rgb.len(), side_px * side_px);
            let off = |p: &[f32; 3]| (p[0] - 0.25).abs().max((p[2] - 0.75).abs());
            assert!(tile.rgb.iter().all(|p| off(p) < 1e-6), "{side_px}");
        }
    }

    #[test]
    fn nothing_gives_nothing() {
        assert_eq!(Tile::cut(&[[0.0; 3]; 12], &Mask::empty(4, 3), 8), None);
        assert_eq!(Tile::cut(&[[0.0; 3]; 11], &Mask::from_fn(4, 3, |_| true), 8), None);
        assert_eq!(Tile::cut(&[[0.0; 3]; 12], &Mask::from_fn(4, 3, |_| true), 0), None);
        let one = Tile::cut(&[[0.5; 3]; 12], &Mask::from_fn(4, 3, |i| i == 11), 4).expect("one pixel");
        assert!(one.rgb.iter().all(|p| *p == [0.5; 3]));
    }
}
