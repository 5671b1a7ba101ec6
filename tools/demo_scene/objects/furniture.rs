//! Table and floor.

use glam::DVec2;

use super::super::glb::{Part, matt, painted, part};
use super::super::mesh::Mesh;
use super::super::paint;
use super::super::shapes::{lathe, rounded_box, turned_profile};
use super::TABLE_TOP;

/// Length, depth and thickness of the table's top.
const TOP: [f64; 3] = [1.2, 0.8, 0.034];

/// Top, frame and four legs.
pub fn table() -> Vec<Part> {
    let [length, depth, thick] = TOP;
    let wood = painted(paint::wood(512, 5, [214.0, 164.0, 108.0], [158.0, 104.0, 60.0], 3), 0.6);
    let top = rounded_box(length, thick, depth, 0.008, 2).at(0.0, TABLE_TOP - thick / 2.0, 0.0);
    let height = TABLE_TOP - thick;
    let rail = |x: f64, z: f64, at_x: f64, at_z: f64| rounded_box(x, 0.07, z, 0.004, 1).at(at_x, height - 0.035, at_z);
    let frame = rail(length - 0.2, 0.02, 0.0, depth / 2.0 - 0.07)
        .with(rail(length - 0.2, 0.02, 0.0, 0.07 - depth / 2.0))
        .with(rail(0.02, depth - 0.2, length / 2.0 - 0.07, 0.0))
        .with(rail(0.02, depth - 0.2, 0.07 - length / 2.0, 0.0));
    let leg = |sx: f64, sz: f64| -> Mesh {
        turned_profile(&[[0.0, 0.0], [0.017, 0.0], [0.019, 0.02], [0.021, 0.2], [0.027, 0.45], [0.034, height]], 3, 20)
            .at(sx * (length / 2.0 - 0.075), 0.0, sz * (depth / 2.0 - 0.075))
    };
    let painted_wood = matt([96, 62, 40]);
    vec![
        part("top", top, wood),
        part("frame", frame, painted_wood.clone()),
        part("front left leg", leg(-1.0, 1.0), painted_wood.clone()),
        part("front right leg", leg(1.0, 1.0), painted_wood.clone()),
        part("back left leg", leg(-1.0, -1.0), painted_wood.clone()),
        part("back right leg", leg(1.0, -1.0), painted_wood),
    ]
}

/// A round floor of boards with a round rug.
pub fn floor() -> Vec<Part> {
    let disc = |radius: f64, bottom: f64, top: f64| {
        lathe(
            &[
                DVec2::new(0.0, bottom),
                DVec2::new(radius, bottom),
                DVec2::new(radius, top - 0.004),
                DVec2::new(radius - 0.006, top),
                DVec2::new(radius * 0.5, top),
                DVec2::new(0.0, top),
            ],
            72,
        )
    };
    let boards = paint::wood(384, 12, [186.0, 178.0, 168.0], [142.0, 132.0, 122.0], 11);
    let rug = paint::weave(192, 32, [196.0, 92.0, 74.0], [226.0, 186.0, 150.0], 5);
    let border = paint::weave(96, 16, [58.0, 70.0, 92.0], [86.0, 100.0, 122.0], 6);
    vec![
        part("boards", disc(1.35, -0.05, 0.0).uv_from_above(2.7), painted(boards, 0.8)),
        part("rug", disc(0.86, 0.0, 0.014).uv_from_above(0.5), painted(rug, 1.0)),
        part("rug border", disc(0.95, 0.0, 0.009).uv_from_above(0.25), painted(border, 1.0)),
    ]
}
