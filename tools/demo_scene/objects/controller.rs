//! Game controllers: same parts, same names, another color.

use glam::{DVec2, DVec3};

use super::super::glb::{Part, glossy, matt, part};
use super::super::mesh::Mesh;
use super::super::shapes::{cylinder, pillow, rounded_box, turned_profile};

/// Colours of one controller: body, sticks and pad.
pub struct Colors {
    body: [u8; 3],
    trigger: [u8; 3],
}

/// The red one.
pub const RED: Colors = Colors { body: [206, 36, 40], trigger: [120, 18, 24] };
/// The blue one.
pub const BLUE: Colors = Colors { body: [34, 88, 206], trigger: [18, 44, 120] };

/// Larger than life by a little, so that a button is a few pixels in a small photo.
const SIZE: f64 = 1.25;
/// Height of the body's widest place, and how far it bulges above and below.
const MIDDLE: f64 = 0.019;
const BULGE: [f64; 2] = [0.0185, 0.018];
const FULLNESS: f64 = 3.4;

/// Body, triggers, sticks, direction pad and buttons.
pub fn parts(colors: Colors) -> Vec<Part> {
    let body = pillow(outline, BULGE[0], BULGE[1], FULLNESS, 72).at(0.0, MIDDLE, 0.0);
    let dark = [38, 40, 46];
    let stick = || {
        turned_profile(&[[0.0, -0.004], [0.005, -0.004], [0.0048, 0.006]], 1, 20).with(turned_profile(
            &[
                [0.0, 0.006],
                [0.009, 0.0065],
                [0.0108, 0.009],
                [0.0102, 0.0112],
                [0.008, 0.0118],
                [0.005, 0.0104],
                [0.0, 0.0098],
            ],
            2,
            24,
        ))
    };
    let cross = rounded_box(0.030, 0.007, 0.010, 0.002, 1).with(rounded_box(0.010, 0.007, 0.030, 0.002, 1));
    let button = |dx: f64, dz: f64| on_top(cylinder(0.0062, 0.0075, 0.0016, 20), 0.043 + dx, -0.010 + dz, -0.003);
    let trigger = |side: f64| {
        let shape = rounded_box(0.036, 0.014, 0.014, 0.0055, 3).turned(DVec3::Y, side * 11.0);
        shape.at(side * 0.046, MIDDLE + 0.003, -0.0375)
    };
    let small = |x: f64| on_top(rounded_box(0.009, 0.004, 0.005, 0.0015, 1), x, -0.016, 0.0008);
    let list = [
        ("body", body, glossy(colors.body)),
        ("left trigger", trigger(-1.0), glossy(colors.trigger)),
        ("right trigger", trigger(1.0), glossy(colors.trigger)),
        ("left stick", on_top(stick(), -0.022, 0.014, 0.0), matt(dark)),
        ("right stick", on_top(stick(), 0.022, 0.014, 0.0), matt(dark)),
        ("direction pad", on_top(cross, -0.044, -0.010, 0.0015), matt(dark)),
        ("button a", button(0.0, 0.0125), glossy([58, 190, 84])),
        ("button b", button(0.0125, 0.0), glossy([240, 128, 30])),
        ("button x", button(-0.0125, 0.0), glossy([150, 90, 214])),
        ("button y", button(0.0, -0.0125), glossy([246, 206, 48])),
        ("menu button", small(-0.0095), matt([228, 228, 224])),
        ("start button", small(0.0095), matt([228, 228, 224])),
    ];
    list.into_iter().map(|(name, mesh, look)| part(name, mesh.scaled(SIZE, SIZE, SIZE), look)).collect()
}

/// The mesh set on the body's upper face at (x, z), `above` it.
fn on_top(mesh: Mesh, x: f64, z: f64, above: f64) -> Mesh {
    let p = DVec2::new(x, -z);
    let s = p.length() / outline(p.y.atan2(p.x));
    let lift = (1.0 - s.powf(FULLNESS)).max(0.0).powf(1.0 / FULLNESS.min(2.5));
    mesh.at(x, MIDDLE + BULGE[0] * lift + above, z)
}

/// Distance of the rim from the middle at an angle: a bar with two shoulders and two grips, run
/// together.
fn outline(angle: f64) -> f64 {
    let (sin, cos) = angle.sin_cos();
    let inside = |r: f64| shape(DVec2::new((r * cos).abs(), -r * sin)) < 0.0;
    let (mut low, mut high) = (0.01, 0.14);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if inside(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// Signed distance to the outline, by halves (x >= 0), z towards the player.
fn shape(p: DVec2) -> f64 {
    let circle = |x: f64, z: f64, r: f64| p.distance(DVec2::new(x, z)) - r;
    let q = (p - DVec2::new(0.0, -0.006)).abs() - DVec2::new(0.044, 0.016);
    let bar = q.max(DVec2::ZERO).length() + q.x.max(q.y).min(0.0) - 0.014;
    let blend = |a: f64, b: f64, k: f64| {
        let h = (0.5 + 0.5 * (b - a) / k).clamp(0.0, 1.0);
        b + (a - b) * h - k * h * (1.0 - h)
    };
    blend(blend(bar, circle(0.047, -0.006, 0.031), 0.01), circle(0.062, 0.034, 0.021), 0.03)
}
