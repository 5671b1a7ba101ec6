//! A marble cookie jar.

use super::super::glb::{Part, metal, painted, part};
use super::super::paint;
use super::super::shapes::{sphere, turned_profile};

/// Jar, lid, rim and knob.
pub fn parts() -> Vec<Part> {
    let jar = turned_profile(
        &[[0.0, 0.0], [0.050, 0.0], [0.058, 0.008], [0.066, 0.045], [0.064, 0.095], [0.054, 0.122], [0.051, 0.130]],
        4,
        44,
    );
    let rim = turned_profile(&[[0.050, 0.126], [0.0545, 0.128], [0.0545, 0.135], [0.050, 0.137]], 2, 40);
    let lid = turned_profile(&[[0.053, 0.1355], [0.055, 0.141], [0.048, 0.150], [0.026, 0.161], [0.0, 0.165]], 3, 40);
    let stone = painted(paint::marble(160, [238.0, 236.0, 234.0], [104.0, 110.0, 124.0], 6), 0.45);
    let brass = metal([214, 174, 92]);
    vec![
        part("jar", jar.uv_scaled(2.0, 1.0), stone.clone()),
        part("rim", rim, brass.clone()),
        part("lid", lid, stone),
        part("knob", sphere(0.0115, 20).at(0.0, 0.174, 0.0), brass),
    ]
}
