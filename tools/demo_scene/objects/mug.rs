//! A mug of coffee.

use super::super::glb::{Part, glossy, painted, part};
use super::super::paint;
use super::super::shapes::{bent_tube, turned_profile};

/// Body, handle and content.
pub fn parts() -> Vec<Part> {
    let body = turned_profile(
        &[
            [0.0, 0.0],
            [0.034, 0.0],
            [0.040, 0.006],
            [0.044, 0.05],
            [0.045, 0.098],
            [0.0425, 0.101],
            [0.040, 0.098],
            [0.039, 0.06],
            [0.036, 0.012],
            [0.0, 0.008],
        ],
        3,
        44,
    );
    let handle = [
        [0.043, 0.082, 0.0],
        [0.062, 0.086, 0.0],
        [0.076, 0.070, 0.0],
        [0.072, 0.040, 0.0],
        [0.056, 0.024, 0.0],
        [0.041, 0.026, 0.0],
    ];
    let coffee = turned_profile(&[[0.0399, 0.084], [0.03, 0.0842], [0.0, 0.0842]], 1, 32);
    let glaze = painted(paint::speckle(128, [240.0, 232.0, 214.0], [60.0, 84.0, 140.0], 2).clone(), 0.4);
    vec![
        part("body", body.uv_scaled(2.0, 2.0), glaze),
        part("handle", bent_tube(&handle, 0.0065, 4, 14), glossy([52, 82, 148])),
        part("coffee", coffee, glossy([70, 40, 22])),
    ]
}
