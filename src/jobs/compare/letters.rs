//! Text in pictures that are files, in the window's typeface.

use egui::epaint::text::{FontDefinitions, Fonts, LayoutJob, TextOptions};
use egui::{Color32, FontId};
use image::{Rgb, RgbImage};

/// Looks of a text.
#[derive(Clone, Copy, Debug)]
pub(super) struct TextStyle {
    /// Height of a row, px.
    pub(super) size_px: f32,
    pub(super) color: [u8; 3],
    /// Width at which rows break, px.
    pub(super) width_px: f32,
    /// Rows at most; what is left out ends in an ellipsis.
    pub(super) rows: usize,
}

/// Writes text into pictures.
pub(super) struct Lettering(Fonts);

impl Lettering {
    pub(super) fn new() -> Self {
        Self(Fonts::new(TextOptions::default(), FontDefinitions::default()))
    }

    /// Writes a text with its upper left corner at `at`; returns its height in px.
    pub(super) fn write(&mut self, picture: &mut RgbImage, at: [u32; 2], text: &str, style: TextStyle) -> u32 {
        let font = FontId::proportional(style.size_px);
        let mut job = LayoutJob::simple(text.to_owned(), font, Color32::WHITE, style.width_px);
        job.wrap.max_rows = style.rows;
        let mut fonts = self.0.with_pixels_per_point(1.0);
        let galley = fonts.layout_job(job);
        let atlas = fonts.image();
        for row in &galley.rows {
            for glyph in &row.row.glyphs {
                let from = glyph.uv_rect;
                let corner = row.pos + glyph.pos.to_vec2() + from.offset;
                for y in from.min[1]..from.max[1] {
                    for x in from.min[0]..from.max[0] {
                        let share = atlas.pixels[usize::from(y) * atlas.size[0] + usize::from(x)].a();
                        let to = [corner.x.round() as i64, corner.y.round() as i64];
                        let to = [to[0] + i64::from(x - from.min[0]), to[1] + i64::from(y - from.min[1])];
                        blend(picture, [i64::from(at[0]) + to[0], i64::from(at[1]) + to[1]], style.color, share);
                    }
                }
            }
        }
        galley.rect.height().ceil() as u32
    }
}

/// Mixes a color into a pixel, if it is in the picture.
fn blend(picture: &mut RgbImage, at: [i64; 2], color: [u8; 3], share: u8) {
    let [Ok(x), Ok(y)] = at.map(u32::try_from) else { return };
    if let Some(Rgb(pixel)) = picture.get_pixel_mut_checked(x, y) {
        let share = f32::from(share) / 255.0;
        for (old, new) in pixel.iter_mut().zip(color) {
            *old = (f32::from(*old) * (1.0 - share) + f32::from(new) * share + 0.5) as u8;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_written_where_it_belongs_and_cut_where_room_ends() {
        let mut letters = Lettering::new();
        let style = TextStyle { size_px: 16.0, color: [0; 3], width_px: 100.0, rows: 2 };
        let dark = |picture: &RgbImage, rows: std::ops::Range<u32>| {
            picture.enumerate_pixels().filter(|(_, y, p)| rows.contains(y) && p.0[0] < 100).count()
        };
        let mut picture = RgbImage::from_pixel(140, 80, Rgb([255; 3]));
        let height = letters.write(&mut picture, [10, 20], "mug", style);
        assert!((12..30).contains(&height), "{height}");
        assert!(dark(&picture, 20..20 + height) > 20 && dark(&picture, 0..20) == 0);
        let long = "a long sentence about the red mug on the table ".repeat(8);
        let mut other = RgbImage::from_pixel(140, 80, Rgb([255; 3]));
        let both = letters.write(&mut other, [10, 0], &long, style);
        assert!(both > height && both < 60, "{both}");
        assert!(other.enumerate_pixels().all(|(x, _, p)| x < 115 || p.0 == [255; 3]));
        let mut tiny = RgbImage::from_pixel(4, 4, Rgb([255; 3]));
        letters.write(&mut tiny, [2, 0], "mug", style);
    }
}
