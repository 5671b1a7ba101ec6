//! Headphones, lying on the table.

use std::f64::consts::PI;

use glam::{DAffine3, DMat3, DVec3};

use super::super::glb::{Part, glossy, matt, part};
use super::super::mesh::Mesh;
use super::super::shapes::{torus, tube, turned_profile};

/// Half the distance between the cups.
const HALF: f64 = 0.076;
/// Radius of a cup, on whose rim they stand.
const CUP: f64 = 0.040;

/// Band, padding, cups and cushions.
pub fn parts() -> Vec<Part> {
    // The band is an arch that lies backwards on the table.
    let arch = |radius: f64, from: f64, to: f64| -> Vec<DVec3> {
        let at = |i: i32| from + (to - from) * f64::from(i) / 28.0;
        (0..=28).map(at).map(|a| DVec3::new(radius * a.cos(), 0.0, -1.15 * radius * a.sin())).collect()
    };
    let flat = |mesh: Mesh| mesh.mapped(DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(1.0, 2.1, 1.0))));
    let lying = |mesh: Mesh| mesh.turned(DVec3::X, 14.0).at(0.0, CUP, 0.0);
    let band = lying(flat(tube(&arch(HALF + 0.010, 0.0, PI), &[0.0055], 12, false)));
    let pad = lying(flat(tube(&arch(HALF + 0.0035, 0.28 * PI, 0.72 * PI), &[0.0062], 12, false)));
    // Made upright, then laid so that its axis points at the other cup.
    let side = |mesh: Mesh, sign: f64| mesh.turned(DVec3::Z, sign * 90.0).at(sign * HALF, CUP, 0.004);
    let cup = || {
        turned_profile(
            &[[0.0, -0.022], [0.020, -0.021], [0.034, -0.016], [0.0395, -0.006], [0.0395, 0.004], [0.0, 0.004]],
            3,
            36,
        )
    };
    let cushion = || torus(0.028, 0.0105, 36, 14).at(0.0, 0.009, 0.0);
    let shell = glossy([236, 112, 148]);
    vec![
        part("band", band, shell.clone()),
        part("band padding", pad, matt([52, 48, 58])),
        part("left cup", side(cup(), -1.0).scaled(1.0, 1.0, 1.0), shell.clone()),
        part("right cup", side(cup(), 1.0), shell),
        part("left cushion", side(cushion(), -1.0), matt([52, 48, 58])),
        part("right cushion", side(cushion(), 1.0), matt([52, 48, 58])),
    ]
}
