//! A sitting teddy bear.

use glam::DVec3;

use super::super::glb::{Part, glossy, matt, painted, part};
use super::super::mesh::Mesh;
use super::super::paint;
use super::super::shapes::{sphere, torus};

/// Body, head, ears, muzzle, nose, eyes, limbs and scarf.
pub fn parts() -> Vec<Part> {
    let fur = painted(paint::fur(128, [206.0, 152.0, 96.0], [150.0, 100.0, 56.0], 8), 1.0);
    let light = matt([236, 208, 168]);
    let ball = |x: f64, y: f64, z: f64, segments| -> Mesh { sphere(1.0, segments).scaled(x, y, z) };
    let ear = |side: f64| ball(0.021, 0.021, 0.011, 20).at(side * 0.040, 0.207, -0.006);
    let arm = |side: f64| {
        let shape = ball(0.019, 0.046, 0.020, 20).turned(DVec3::Z, side * 34.0).turned(DVec3::X, -28.0);
        shape.at(side * 0.062, 0.092, 0.020)
    };
    let leg = |side: f64| {
        let shape = ball(0.024, 0.024, 0.050, 24).turned(DVec3::Y, side * 24.0);
        shape.at(side * 0.046, 0.024, 0.056)
    };
    let sole = |side: f64| {
        let shape = ball(0.017, 0.018, 0.005, 16).turned(DVec3::Y, side * 24.0);
        shape.at(side * (0.046 + 0.0195), 0.025, 0.056 + 0.0445)
    };
    let eye = ball(0.0062, 0.0068, 0.005, 14).at(0.019, 0.184, 0.0435);
    let scarf = torus(0.036, 0.011, 36, 12).scaled(1.0, 0.9, 1.0).at(0.0, 0.131, 0.003);
    let tail = ball(0.012, 0.030, 0.007, 14).turned(DVec3::Z, 14.0).at(0.020, 0.103, 0.052);
    let knit =
        paint::bands(64, &[[196.0, 44.0, 60.0], [240.0, 232.0, 220.0], [196.0, 44.0, 60.0], [40.0, 74.0, 120.0]], 3);
    vec![
        part("body", ball(0.060, 0.070, 0.052, 32).at(0.0, 0.070, 0.0), fur.clone()),
        part("belly", ball(0.038, 0.046, 0.012, 24).at(0.0, 0.068, 0.043), light.clone()),
        part("head", ball(0.052, 0.047, 0.046, 32).at(0.0, 0.173, 0.004), fur.clone()),
        part("left ear", ear(-1.0), fur.clone()),
        part("right ear", ear(1.0), fur.clone()),
        part("muzzle", ball(0.024, 0.019, 0.019, 24).at(0.0, 0.162, 0.042), light.clone()),
        part("nose", ball(0.0095, 0.0068, 0.006, 16).at(0.0, 0.1705, 0.0595), glossy([34, 26, 26])),
        part("eyes", eye.mirrored_pair(), glossy([24, 20, 22])),
        part("left arm", arm(-1.0), fur.clone()),
        part("right arm", arm(1.0), fur.clone()),
        part("left leg", leg(-1.0), fur.clone()),
        part("right leg", leg(1.0), fur),
        part("soles", sole(1.0).with(sole(-1.0)), light),
        part("scarf", scarf.with(tail).uv_scaled(1.0, 6.0), painted(knit, 1.0)),
    ]
}
