//! An enamel kettle.

use glam::DVec3;

use super::super::glb::{Part, glossy, matt, metal, part};
use super::super::shapes::{bent_tube, curve, sphere, tube, turned_profile};

/// Body, base, lid, knob, spout and handle.
pub fn parts() -> Vec<Part> {
    let body = turned_profile(
        &[[0.080, 0.012], [0.094, 0.030], [0.098, 0.062], [0.090, 0.100], [0.070, 0.130], [0.048, 0.144], [0.0, 0.147]],
        5,
        48,
    );
    let base = turned_profile(&[[0.0, 0.0], [0.078, 0.0], [0.086, 0.006], [0.083, 0.016]], 2, 40);
    let lid = turned_profile(
        &[[0.052, 0.1405], [0.055, 0.146], [0.050, 0.152], [0.034, 0.162], [0.014, 0.168], [0.0, 0.169]],
        3,
        36,
    );
    let spout_path: Vec<DVec3> =
        curve(&[[0.078, 0.050], [0.104, 0.066], [0.122, 0.098], [0.142, 0.132]].map(|[x, y]| DVec3::new(x, y, 0.0)), 5);
    let radii: Vec<f64> = (0..spout_path.len()).map(|i| 0.026 - 0.014 * i as f64 / 15.0).collect();
    let handle = [
        [-0.062, 0.128, 0.0],
        [-0.074, 0.180, 0.0],
        [-0.045, 0.226, 0.0],
        [0.0, 0.240, 0.0],
        [0.045, 0.226, 0.0],
        [0.074, 0.180, 0.0],
        [0.062, 0.128, 0.0],
    ];
    let enamel = glossy([32, 150, 146]);
    vec![
        part("body", body, enamel.clone()),
        part("base", base, metal([190, 192, 196])),
        part("lid", lid, glossy([24, 118, 118])),
        part("knob", sphere(0.013, 20).at(0.0, 0.180, 0.0), matt([40, 36, 34])),
        part("spout", tube(&spout_path, &radii, 20, false), enamel),
        part("handle", bent_tube(&handle, 0.0085, 5, 14), matt([58, 40, 30])),
    ]
}
