//! Two books, one on the other.

use super::super::glb::{Part, painted, part};
use super::super::mesh::Mesh;
use super::super::paint::{self, Picture, mix, step};
use super::super::shapes::rounded_box;

/// Thickness of a book in meters.
pub const THICKNESS: f64 = 0.030;
const WIDTH: f64 = 0.150;
const LENGTH: f64 = 0.205;
const BOARD: f64 = 0.0035;

/// Cover and pages of the lower and of the upper book.
pub fn stack() -> [(Part, Part); 2] {
    let book = |cover: Picture, scale: f64| {
        let (w, l) = (WIDTH * scale, LENGTH * scale);
        let board = |y: f64| rounded_box(w, BOARD, l, 0.0015, 1).at(0.0, y, 0.0);
        let spine = rounded_box(BOARD, THICKNESS, l, 0.0015, 1).at((BOARD - w) / 2.0, THICKNESS / 2.0, 0.0);
        let covers: Mesh = board(BOARD / 2.0).with(board(THICKNESS - BOARD / 2.0)).with(spine);
        let block =
            rounded_box(w - 0.011, THICKNESS - 2.0 * BOARD, l - 0.010, 0.001, 1).at(-0.002, THICKNESS / 2.0, 0.0);
        let leaves = paint::bands(64, &[[246.0, 238.0, 216.0], [224.0, 214.0, 190.0]].repeat(10), 1);
        (part("cover", covers, painted(cover, 0.7)), part("pages", block, painted(leaves, 1.0)))
    };
    [
        book(cover([34.0, 104.0, 70.0], [236.0, 220.0, 160.0], 1), 1.0),
        book(cover([226.0, 112.0, 36.0], [250.0, 240.0, 224.0], 2), 0.84),
    ]
}

/// A frame, a sun over hills or a moon over waves, and lines of lettering.
fn cover(ground: [f32; 3], ink: [f32; 3], motif: u32) -> Picture {
    Picture::paint(192, |u, v| {
        let rim = (u.min(1.0 - u) * 0.75).min(v.min(1.0 - v));
        let frame = step(0.045, 0.050, rim) - step(0.060, 0.065, rim);
        let disc = 1.0 - step(0.105, 0.115, ((u - 0.5) * (u - 0.5) * 0.56 + (v - 0.42) * (v - 0.42)).sqrt());
        let swell = paint::noise(u * 4.0, 2.0, 64, 40 + motif) * 0.16;
        let hill = step(0.50, 0.505, v - swell + 0.04) * (1.0 - step(0.70, 0.705, v));
        let row = (v - 0.76) / 0.055;
        let letter = paint::hash((u * 30.0) as i32, row as i32, motif) > 0.28;
        let text = (0.0..3.0).contains(&row) && row - row.floor() < 0.5 && (0.2..0.8).contains(&u) && letter;
        let within = step(0.066, 0.07, rim);
        let base = mix(ground, ink, frame);
        let sun = mix(base, mix(ink, [255.0, 190.0, 60.0], 0.6), disc * within);
        let land = mix(sun, ground.map(|c| c * 0.55), hill * within);
        mix(land, ink, f32::from(u8::from(text)))
            .map(|c| c * (0.94 + 0.1 * paint::cloud(u * 24.0, v * 24.0, 24, motif)))
    })
}
