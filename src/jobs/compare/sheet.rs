//! The picture sheet of a comparison: a row for each phrase and view; the view's colors, then each scene's relevancy on
//! one scale, with the outline of its mask.

use image::{Rgb, RgbImage};

use super::cell::{ComparedCell, Comparison, RuledCell, ShownRelevancy};
use super::letters::{Lettering, TextStyle};
use super::tile::{CellTile, TilePicture, tile_size};
use crate::math::colormap::Colormap;

/// Rows of a sheet at most.
pub(super) const MOST_ROWS: usize = 40;

const LABEL_PX: u32 = 150;
const HEAD_PX: u32 = 64;
const CAPTION_PX: u32 = 20;
const GAP_PX: u32 = 10;
const LEGEND_PX: u32 = 64;
const PAPER: [u8; 3] = [250; 3];
const EMPTY: [u8; 3] = [222; 3];
const INK: [u8; 3] = [27, 27, 31];
const PALE_INK: [u8; 3] = [90, 90, 96];

/// Small pictures of a row.
pub(super) struct SheetRow {
    /// The view with the outline of the label.
    pub(super) view: TilePicture,
    /// One for each scene; `None` without an answer.
    pub(super) cells: Vec<Option<CellTile>>,
}

/// One range of relevancy for all cells.
pub(super) fn range_of(shown: ShownRelevancy, rows: &[SheetRow]) -> [f32; 2] {
    let ranges = rows.iter().flat_map(|row| &row.cells).flatten().filter_map(CellTile::range);
    let joined = ranges.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
    match (shown, joined) {
        (ShownRelevancy::Raw, Some(range)) => range,
        _ => [0.0, 1.0],
    }
}

/// Draws the sheet of these rows, which are the first of the comparison.
pub(super) fn sheet(comparison: &Comparison, rows: &[SheetRow]) -> RgbImage {
    let sizes: Vec<(usize, usize)> = rows.iter().map(|row| row.view.size).collect();
    let tile = |of: fn(&(usize, usize)) -> usize| sizes.iter().map(of).max().unwrap_or(tile_size((4, 3)).0) as u32;
    let (tile_w, columns) = (tile(|s| s.0), comparison.methods.len() as u32 + 1);
    let row_heights: Vec<u32> = sizes.iter().map(|s| s.1 as u32 + CAPTION_PX + GAP_PX).collect();
    let width = (LABEL_PX + columns * (tile_w + GAP_PX) + GAP_PX).max(760);
    let height = HEAD_PX + row_heights.iter().sum::<u32>() + LEGEND_PX;
    let mut drawing = Drawing { picture: RgbImage::from_pixel(width, height, Rgb(PAPER)), letters: Lettering::new() };
    let column = |k: u32| LABEL_PX + k * (tile_w + GAP_PX);
    drawing.head([column(0), 8], tile_w, "render", "label outlined in green");
    for (k, method) in (1..).zip(&comparison.methods) {
        drawing.head([column(k), 8], tile_w, &method.method, method.own_rule.unwrap_or("no rule of its own"));
    }
    let mut y = HEAD_PX;
    for (k, row) in rows.iter().enumerate() {
        let cells = comparison.row(k);
        let Some(first) = cells.first() else { break };
        drawing.label([GAP_PX, y], &first.phrase, &first.view);
        drawing.put([column(0), y], &row.view);
        for ((c, tile), cell) in (1..).zip(&row.cells).zip(cells) {
            match tile {
                Some(tile) => drawing.put([column(c), y], &tile.colors(comparison.range)),
                None => drawing.nothing([column(c), y], row.view.size, cell.problem.as_deref().unwrap_or("no answer")),
            }
            drawing.caption([column(c), y + row.view.size.1 as u32 + 2], tile_w, &caption(cell));
        }
        y += row_heights[k];
    }
    drawing.legend([GAP_PX, y], comparison);
    drawing.picture
}

/// Scores of a cell in a line.
fn caption(cell: &ComparedCell) -> String {
    let text = |what: &str, ruled: &Option<RuledCell>| {
        let ruled = ruled.as_ref()?;
        let score = ruled.iou.map_or_else(|| format!("{:.1} %", 100.0 * ruled.share), |iou| format!("IoU {iou:.3}"));
        Some(format!("{what} {score}"))
    };
    let both = [text("own", &cell.own), text("common", &cell.common)];
    both.into_iter().flatten().collect::<Vec<_>>().join(" \u{b7} ")
}

/// A sheet that is drawn.
struct Drawing {
    picture: RgbImage,
    letters: Lettering,
}

impl Drawing {
    fn text(&mut self, at: [u32; 2], text: &str, (size_px, color): (f32, [u8; 3]), (width, rows): (u32, usize)) -> u32 {
        let style = TextStyle { size_px, color, width_px: width as f32, rows };
        self.letters.write(&mut self.picture, at, text, style)
    }

    fn head(&mut self, at: [u32; 2], width: u32, name: &str, rule: &str) {
        let height = self.text(at, name, (16.0, INK), (width, 1));
        self.text([at[0], at[1] + height], rule, (11.0, PALE_INK), (width, 2));
    }

    fn label(&mut self, at: [u32; 2], phrase: &str, view: &str) {
        let height = self.text(at, phrase, (15.0, INK), (LABEL_PX - 2 * GAP_PX, 4));
        self.text([at[0], at[1] + height + 2], view, (11.0, PALE_INK), (LABEL_PX - 2 * GAP_PX, 3));
    }

    fn caption(&mut self, at: [u32; 2], width: u32, text: &str) {
        self.text(at, text, (12.0, INK), (width, 1));
    }

    fn put(&mut self, at: [u32; 2], tile: &TilePicture) {
        for (i, rgb) in tile.rgb.iter().enumerate() {
            let (x, y) = ((i % tile.size.0) as u32, (i / tile.size.0) as u32);
            if let Some(pixel) = self.picture.get_pixel_mut_checked(at[0] + x, at[1] + y) {
                *pixel = Rgb(*rgb);
            }
        }
    }

    /// A gray field that says why it is empty.
    fn nothing(&mut self, at: [u32; 2], size: (usize, usize), why: &str) {
        self.put(at, &TilePicture { size, rgb: vec![EMPTY; size.0 * size.1] });
        self.text([at[0] + 10, at[1] + 10], why, (13.0, INK), ((size.0 as u32).saturating_sub(20).max(40), 8));
    }

    fn legend(&mut self, at: [u32; 2], comparison: &Comparison) {
        const BAR: (usize, usize) = (256, 12);
        let color = |i: usize| Colormap::Turbo.color((i % BAR.0) as f32 / (BAR.0 - 1) as f32);
        let [least, most] = comparison.range.map(|v| format!("{v:.2}"));
        self.text(at, &least, (13.0, INK), (40, 1));
        self.put([at[0] + 40, at[1] + 2], &TilePicture { size: BAR, rgb: (0..BAR.0 * BAR.1).map(color).collect() });
        self.text([at[0] + 40 + BAR.0 as u32 + 8, at[1]], &most, (13.0, INK), (40, 1));
        let what = match comparison.shown {
            ShownRelevancy::Raw => "relevancy as it is, one scale for all",
            ShownRelevancy::Lerf => "relevancy on LERF's scale: from 0.5 to the largest of the view",
            ShownRelevancy::Own => "what each method's own rule cuts",
        };
        let text = format!(
            "{what}; outlined: the mask by the method's own rule, or by the common one where it has none. Own: {}.",
            "the method's rule; common: the same rule for all"
        );
        let width = self.picture.width().saturating_sub(2 * GAP_PX);
        self.text([at[0], at[1] + 22], &text, (12.0, PALE_INK), (width, 2));
    }
}
