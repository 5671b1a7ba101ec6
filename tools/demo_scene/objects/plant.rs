//! A plant in a clay pot.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::super::glb::{Part, matt, painted, part};
use super::super::mesh::Mesh;
use super::super::paint;
use super::super::shapes::turned_profile;

/// Leaves of the plant.
const LEAVES: usize = 17;

/// Saucer, pot, soil and leaves.
pub fn parts() -> Vec<Part> {
    let saucer =
        turned_profile(&[[0.0, 0.0], [0.052, 0.0], [0.064, 0.010], [0.061, 0.012], [0.05, 0.005], [0.0, 0.005]], 2, 40);
    let pot = turned_profile(&[[0.0, 0.006], [0.040, 0.006], [0.054, 0.082]], 1, 40).with(turned_profile(
        &[[0.054, 0.078], [0.061, 0.080], [0.063, 0.100], [0.060, 0.104], [0.055, 0.102], [0.053, 0.088]],
        2,
        40,
    ));
    let soil = turned_profile(&[[0.054, 0.092], [0.03, 0.096], [0.0, 0.097]], 2, 32);
    let clay = paint::bands(64, &[[196.0, 104.0, 70.0], [188.0, 96.0, 62.0], [204.0, 112.0, 78.0]], 2);
    let leaves = (0..LEAVES).map(leaf).fold(Mesh::default(), Mesh::with);
    let green = painted(paint::leaf(96, [66.0, 138.0, 58.0], [176.0, 208.0, 130.0], 7), 0.7);
    vec![
        part("saucer", saucer, matt([150, 78, 50])),
        part("pot", pot, painted(clay, 1.0)),
        part("soil", soil, matt([58, 42, 32])),
        part("leaves", leaves, green),
    ]
}

/// A leaf on its stalk: it rises, bends over and ends in a point; the outer ones lie lower.
fn leaf(i: usize) -> Mesh {
    let share = i as f64 / (LEAVES - 1) as f64;
    let azimuth = TAU * 0.381_966 * i as f64;
    let rise = 74.0_f64.to_radians() - 38.0_f64.to_radians() * share;
    let length = 0.20 - 0.05 * share + 0.012 * ((i * 7 % 5) as f64 - 2.0);
    let (rows, columns) = (13, 7);
    let spine = |t: f64| {
        // Direction falls from `rise` to below the horizon along the leaf.
        let steps = 24.0;
        let mut p = DVec2::ZERO;
        let mut s = 0.0;
        while s < t * steps {
            let part = (t * steps - s).min(1.0);
            let a = rise - 1.35 * ((s + 0.5 * part) / steps).powi(2) * (0.7 + 0.6 * share);
            p += DVec2::new(a.cos(), a.sin()) * (length * part / steps);
            s += 1.0;
        }
        p
    };
    Mesh::sheet(rows, columns, |r, c| {
        let (t, side) = (r as f64 / (rows - 1) as f64, 2.0 * c as f64 / (columns - 1) as f64 - 1.0);
        let blade = ((t - 0.18) / 0.82).clamp(0.0, 1.0);
        let width = 0.0022 + 0.027 * (PI * blade.powf(0.75)).sin().max(0.0);
        let p = spine(t);
        let fold = 0.30 * width * side * side;
        (DVec3::new(0.006 + p.x, 0.092 + p.y + fold, side * width), DVec2::new(0.5 + 0.5 * side, 1.0 - t))
    })
    .turned(DVec3::Y, azimuth.to_degrees())
}
