//! A bowl of fruit.

use glam::DVec3;

use super::super::glb::{Part, glossy, matt, painted, part};
use super::super::mesh::Mesh;
use super::super::paint;
use super::super::shapes::{bent_tube, turned_profile};

/// Bowl, an apple with its stalk, an orange, a lemon and a pear.
pub fn parts() -> Vec<Part> {
    let bowl = turned_profile(
        &[
            [0.0, 0.0],
            [0.032, 0.0],
            [0.036, 0.006],
            [0.066, 0.026],
            [0.088, 0.058],
            [0.0865, 0.061],
            [0.083, 0.058],
            [0.062, 0.032],
            [0.030, 0.012],
            [0.0, 0.010],
        ],
        3,
        48,
    );
    let apple: Mesh = turned_profile(
        &[
            [0.0, -0.028],
            [0.012, -0.031],
            [0.027, -0.018],
            [0.034, 0.004],
            [0.028, 0.026],
            [0.014, 0.032],
            [0.0, 0.024],
        ],
        3,
        32,
    );
    let stalk = bent_tube(&[[0.0, 0.022, 0.0], [0.001, 0.034, 0.0], [0.005, 0.043, 0.0]], 0.0016, 2, 8);
    let orange = turned_profile(&[[0.0, -0.031], [0.022, -0.022], [0.032, 0.0], [0.022, 0.022], [0.0, 0.031]], 4, 32);
    let lemon = turned_profile(
        &[[0.0, -0.039], [0.006, -0.034], [0.021, -0.018], [0.026, 0.0], [0.021, 0.018], [0.006, 0.034], [0.0, 0.039]],
        3,
        28,
    );
    let pear = turned_profile(
        &[
            [0.0, -0.030],
            [0.022, -0.026],
            [0.031, -0.006],
            [0.025, 0.014],
            [0.015, 0.032],
            [0.012, 0.046],
            [0.0, 0.053],
        ],
        3,
        30,
    );
    let peel = paint::speckle(64, [238.0, 134.0, 28.0], [214.0, 108.0, 16.0], 4);
    let skin = paint::speckle(64, [176.0, 196.0, 66.0], [140.0, 150.0, 48.0], 12);
    let apple_at = |mesh: Mesh| mesh.turned(DVec3::Z, -12.0).at(-0.034, 0.056, 0.022);
    vec![
        part("bowl", bowl, glossy([122, 84, 158])),
        part("apple", apple_at(apple), glossy([200, 30, 44])),
        part("stalk", apple_at(stalk), matt([80, 56, 34])),
        part("orange", orange.at(0.036, 0.056, 0.026), painted(peel, 0.6)),
        part(
            "lemon",
            lemon.turned(DVec3::Z, 90.0).turned(DVec3::Y, 22.0).at(0.004, 0.082, -0.002),
            glossy([246, 220, 58]),
        ),
        part("pear", pear.turned(DVec3::X, -48.0).at(-0.002, 0.064, -0.036), painted(skin, 0.6)),
    ]
}
