//! Pictures as networks take them: resized as Pillow does, which the networks were trained with,
//! then normalised.

use rayon::prelude::*;

use super::network::Array;
use crate::scene::PhotoPixels;

/// How pixels are mixed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// Triangle.
    Bilinear,
    /// Cubic with a = -1/2.
    Bicubic,
}

impl Filter {
    /// By the name in a model's metadata.
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "bilinear" => Some(Self::Bilinear),
            "bicubic" => Some(Self::Bicubic),
            _ => None,
        }
    }
}

/// What of a picture becomes the side of the network's square.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The shorter; the rest is cut off around the middle.
    Shorter,
    /// The longer; zeros fill up to the right and below, after normalising.
    Longer,
    /// Both: the picture is squashed.
    Both,
}

/// How pictures become inputs.
#[derive(Clone, Debug, PartialEq)]
pub struct Prepare {
    /// Side of the square, px.
    pub side_px: usize,
    /// How pixels are mixed.
    pub filter: Filter,
    /// What is fitted.
    pub side: Side,
    /// Subtracted from colours in 0..1.
    pub mean: [f32; 3],
    /// Divides what is left.
    pub std: [f32; 3],
}

impl Prepare {
    /// A picture as `[1, 3, S, S]`; `None` for one without pixels.
    pub fn picture(&self, picture: &PhotoPixels) -> Option<Array> {
        let (w, h) = (picture.width_px as usize, picture.height_px as usize);
        let (to_w, to_h) = self.resized(w, h)?;
        let resized = resize(picture, to_w, to_h, self.filter)?;
        let s = self.side_px;
        // Where the square's first pixel is in what was resized; halves are rounded to even.
        let offset = |n: usize| ((n as f64 - s as f64) / 2.0).round_ties_even() as i64;
        let (left, top) = if self.side == Side::Shorter { (offset(to_w), offset(to_h)) } else { (0, 0) };
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
        Some(Array::new(&[1, 3, s, s], values))
    }

    /// The size to which a picture is resized.
    pub fn resized(&self, w: usize, h: usize) -> Option<(usize, usize)> {
        if w == 0 || h == 0 {
            return None;
        }
        let s = self.side_px;
        Some(match self.side {
            Side::Both => (s, s),
            // The official code truncates here, ...
            Side::Shorter if w <= h => (s, (s * h / w).max(1)),
            Side::Shorter => ((s * w / h).max(1), s),
            // ... and rounds there.
            Side::Longer => {
                let scale = s as f64 / w.max(h) as f64;
                ((w as f64 * scale + 0.5) as usize, (h as f64 * scale + 0.5) as usize)
            }
        })
    }
}

/// A picture of another size, bit by bit as Pillow's 8-bit resampling has it; `None` if that has no
/// pixels, or the picture has not as many as it says.
pub fn resize(picture: &PhotoPixels, to_w: usize, to_h: usize, filter: Filter) -> Option<Vec<[u8; 3]>> {
    let (w, h) = (picture.width_px as usize, picture.height_px as usize);
    if w == 0 || h == 0 || to_w == 0 || to_h == 0 || picture.rgb.len() != w * h {
        return None;
    }
    // Columns first; what has the size already is left as it is.
    let wide = match w == to_w {
        true => picture.rgb.clone(),
        false => {
            let taps = taps(w, to_w, filter);
            let row = |row: &[[u8; 3]]| taps.iter().map(|tap| tap.mix(|i| row[i])).collect::<Vec<_>>();
            picture.rgb.par_chunks_exact(w).flat_map_iter(row).collect()
        }
    };
    if h == to_h {
        return Some(wide);
    }
    let taps = taps(h, to_h, filter);
    let line = |tap: &Tap| (0..to_w).map(|x| tap.mix(|i| wide[i * to_w + x])).collect::<Vec<_>>();
    Some(taps.par_iter().flat_map_iter(line).collect())
}

/// Bits after the point of a weight.
const PRECISION_BITS: u32 = 22;

/// The pixels of a line that one pixel of the resized line is made of, with fixed-point weights.
struct Tap {
    first: usize,
    weights: Vec<i64>,
}

impl Tap {
    fn mix(&self, pixel: impl Fn(usize) -> [u8; 3]) -> [u8; 3] {
        let mut sums = [1_i64 << (PRECISION_BITS - 1); 3];
        for (k, weight) in self.weights.iter().enumerate() {
            let pixel = pixel(self.first + k);
            sums.iter_mut().zip(pixel).for_each(|(sum, p)| *sum += weight * i64::from(p));
        }
        sums.map(|sum| (sum >> PRECISION_BITS).clamp(0, 255) as u8)
    }
}

fn taps(from: usize, to: usize, filter: Filter) -> Vec<Tap> {
    let scale = from as f64 / to as f64;
    let stretch = scale.max(1.0);
    let (reach, weight): (f64, fn(f64) -> f64) = match filter {
        Filter::Bilinear => (1.0, |x| (1.0 - x.abs()).max(0.0)),
        Filter::Bicubic => (2.0, cubic),
    };
    let support = reach * stretch;
    let tap = |i: usize| {
        let centre = (i as f64 + 0.5) * scale;
        let first = (centre - support + 0.5).max(0.0) as usize;
        let end = ((centre + support + 0.5) as usize).min(from);
        let weights: Vec<f64> = (first..end).map(|j| weight((j as f64 - centre + 0.5) / stretch)).collect();
        let sum: f64 = weights.iter().sum();
        let fixed = |w: &f64| (w / sum * f64::from(1_u32 << PRECISION_BITS)).round() as i64;
        Tap { first, weights: weights.iter().map(fixed).collect() }
    };
    (0..to).map(tap).collect()
}

/// The cubic filter with a = -1/2.
fn cubic(x: f64) -> f64 {
    const A: f64 = -0.5;
    let x = x.abs();
    if x < 1.0 {
        ((A + 2.0) * x - (A + 3.0)) * x * x + 1.0
    } else if x < 2.0 {
        (((x - 5.0) * x + 8.0) * x - 4.0) * A
    } else {
        0.0
    }
}
