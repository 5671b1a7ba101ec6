//! A wooden toy car.

use glam::DVec3;

use super::super::glb::{Part, glossy, matt, part};
use super::super::shapes::{cap, cylinder, rounded_box, sphere};

/// Body, roof, windows, bumpers, lights and four wheels.
pub fn parts() -> Vec<Part> {
    let body = rounded_box(0.150, 0.036, 0.070, 0.014, 4).at(0.0, 0.036, 0.0);
    let cabin = rounded_box(0.082, 0.036, 0.058, 0.012, 4).at(-0.008, 0.060, 0.0);
    let roof = rounded_box(0.072, 0.010, 0.056, 0.0045, 3).at(-0.008, 0.0805, 0.0);
    let wheel = |x: f64, side: f64| {
        let tyre = cylinder(0.019, 0.014, 0.004, 28).with(cap(0.009, 0.003, 20).at(0.0, 0.0135, 0.0));
        tyre.turned(DVec3::X, side * 90.0).at(x, 0.019, side * 0.027)
    };
    let lights = sphere(0.0075, 16).scaled(0.6, 1.0, 1.0).at(0.0745, 0.040, 0.021);
    let bumper = |x: f64| rounded_box(0.010, 0.010, 0.066, 0.004, 2).at(x, 0.024, 0.0);
    let rubber = matt([40, 40, 44]);
    vec![
        part("body", body, glossy([248, 196, 36])),
        part("windows", cabin, glossy([96, 160, 200])),
        part("roof", roof, glossy([248, 196, 36])),
        part("headlights", lights.clone().with(lights.scaled(1.0, 1.0, -1.0)), glossy([255, 250, 228])),
        part("bumpers", bumper(0.076).with(bumper(-0.076)), matt([150, 152, 156])),
        part("front left wheel", wheel(0.044, -1.0), rubber.clone()),
        part("front right wheel", wheel(0.044, 1.0), rubber.clone()),
        part("back left wheel", wheel(-0.044, -1.0), rubber.clone()),
        part("back right wheel", wheel(-0.044, 1.0), rubber),
    ]
}
