//! A table lamp.

use super::super::glb::{Look, Part, glossy, metal, painted, part};
use super::super::paint;
use super::super::shapes::{bent_tube, cylinder, sphere, turned_profile};

/// Base, stem, bulb, shade and switch.
pub fn parts() -> Vec<Part> {
    let base = turned_profile(
        &[[0.0, 0.0], [0.070, 0.0], [0.074, 0.006], [0.066, 0.016], [0.030, 0.024], [0.012, 0.034], [0.0, 0.036]],
        3,
        40,
    );
    let stem = bent_tube(&[[0.0, 0.02, 0.0], [0.0, 0.12, 0.0], [0.0, 0.30, 0.0]], 0.0075, 3, 14);
    let shade = turned_profile(
        &[
            [0.108, 0.235],
            [0.104, 0.250],
            [0.080, 0.320],
            [0.058, 0.385],
            [0.055, 0.384],
            [0.077, 0.319],
            [0.101, 0.249],
            [0.108, 0.235],
        ],
        3,
        48,
    );
    let cloth =
        paint::bands(96, &[[244.0, 196.0, 70.0], [250.0, 214.0, 110.0], [240.0, 186.0, 58.0], [250.0, 210.0, 96.0]], 4);
    let warm = Look { glow: [0.16, 0.10, 0.03], ..painted(cloth, 1.0) };
    let lit = Look { glow: [1.0, 0.86, 0.6], ..glossy([255, 240, 210]) };
    vec![
        part("base", base, glossy([44, 48, 58])),
        part("stem", stem, metal([206, 170, 96])),
        part("bulb", sphere(0.026, 20).scaled(1.0, 1.15, 1.0).at(0.0, 0.315, 0.0), lit),
        part("shade", shade.uv_scaled(1.0, 3.0), warm),
        part("switch", cylinder(0.009, 0.008, 0.002, 16).at(0.042, 0.018, 0.0), glossy([214, 60, 52])),
    ]
}
