//! A photo camera.

use glam::DVec3;

use super::super::glb::{Part, glossy, metal, painted, part};
use super::super::mesh::Mesh;
use super::super::paint;
use super::super::shapes::{cap, cylinder, rounded_box, turned_profile};

/// Body, top plate, lens, glass, viewfinder, flash, shutter button and dial.
pub fn parts() -> Vec<Part> {
    let leather = paint::speckle(96, [44.0, 40.0, 42.0], [70.0, 62.0, 60.0], 9);
    let forward = |mesh: Mesh, x: f64, y: f64, z: f64| mesh.turned(DVec3::X, 90.0).at(x, y, z);
    let lens = turned_profile(
        &[
            [0.031, 0.0],
            [0.031, 0.012],
            [0.028, 0.014],
            [0.028, 0.036],
            [0.0255, 0.040],
            [0.0215, 0.040],
            [0.019, 0.030],
        ],
        1,
        40,
    );
    vec![
        part(
            "body",
            rounded_box(0.136, 0.062, 0.042, 0.009, 3).at(0.0, 0.031, 0.0).uv_scaled(3.0, 1.5),
            painted(leather, 0.9),
        ),
        part("top plate", rounded_box(0.134, 0.020, 0.040, 0.006, 3).at(0.0, 0.070, 0.0), metal([206, 208, 212])),
        part("viewfinder", rounded_box(0.036, 0.020, 0.036, 0.006, 3).at(0.0, 0.086, 0.0), metal([190, 192, 198])),
        part("lens", forward(lens, 0.0, 0.034, 0.019), glossy([34, 34, 38])),
        part("glass", forward(cap(0.0195, 0.006, 32), 0.0, 0.034, 0.049), glossy([72, 56, 132])),
        part("flash", rounded_box(0.026, 0.012, 0.004, 0.0015, 1).at(0.046, 0.070, 0.0205), glossy([244, 244, 236])),
        part("shutter button", cylinder(0.0075, 0.008, 0.002, 20).at(-0.050, 0.079, 0.004), metal([226, 70, 60])),
        part("dial", cylinder(0.012, 0.010, 0.0015, 28).at(0.048, 0.079, 0.0), metal([80, 82, 88])),
    ]
}
