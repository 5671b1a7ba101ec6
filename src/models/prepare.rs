//! Pictures as networks take them: resized as Pillow does, which the networks were trained with,
//! then normalised.

use fast_image_resize::images::{Image, ImageRef};
use fast_image_resize::{FilterType, PixelType, ResizeAlg, ResizeOptions, Resizer};

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

/// A picture of another size; `None` if that has no pixels.
pub fn resize(picture: &PhotoPixels, to_w: usize, to_h: usize, filter: Filter) -> Option<Vec<[u8; 3]>> {
    if (to_w, to_h) == (picture.width_px as usize, picture.height_px as usize) {
        return Some(picture.rgb.clone());
    }
    let bytes = picture.rgb.as_flattened();
    let source = ImageRef::new(picture.width_px, picture.height_px, bytes, PixelType::U8x3).ok()?;
    let mut target = Image::new(u32::try_from(to_w).ok()?, u32::try_from(to_h).ok()?, PixelType::U8x3);
    let filter = match filter {
        Filter::Bilinear => FilterType::Bilinear,
        Filter::Bicubic => FilterType::CatmullRom,
    };
    let options = ResizeOptions::new().resize_alg(ResizeAlg::Convolution(filter));
    Resizer::new().resize(&source, &mut target, &options).ok()?;
    Some(target.buffer().chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect())
}
