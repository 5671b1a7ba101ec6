//! The things of the demo scene, one file per kind.

mod books;
mod bowl;
mod camera;
mod controller;
mod furniture;
mod headphones;
mod jar;
mod kettle;
mod lamp;
mod mug;
mod plant;
mod teddy;
mod toy_car;

use glam::DVec3;

use super::glb::{Object, Part};

/// Height of the table's upper face in meters.
const TABLE_TOP: f64 = 0.74;

/// Everything, where it stands.
pub fn all() -> Vec<Object> {
    let floor = |name, turn_deg, parts| Object { name, position: DVec3::ZERO, turn_deg, parts };
    let [(lower, pages_lower), (upper, pages_upper)] = books::stack();
    let book = |name, height: f64, turn, parts| on_table(name, [0.235, 0.0], height, turn, parts);
    vec![
        floor("floor", 0.0, furniture::floor()),
        floor("table", 0.0, furniture::table()),
        on_table("red controller", [-0.13, 0.20], 0.0, 18.0, controller::parts(controller::RED)),
        on_table("blue controller", [0.135, 0.235], 0.0, -24.0, controller::parts(controller::BLUE)),
        on_table("kettle", [-0.20, -0.245], 0.0, 28.0, kettle::parts()),
        on_table("mug", [-0.445, 0.005], 0.0, -35.0, mug::parts()),
        on_table("lamp", [0.44, -0.235], 0.0, -30.0, lamp::parts()),
        on_table("teddy bear", [0.025, -0.075], 0.0, 8.0, teddy::parts()),
        on_table("cookie jar", [0.185, -0.275], 0.0, 0.0, jar::parts()),
        book("green book", 0.0, 14.0, vec![lower, pages_lower]),
        book("orange book", books::THICKNESS, -9.0, vec![upper, pages_upper]),
        on_table("pot plant", [-0.455, -0.25], 0.0, 0.0, plant::parts()),
        on_table("camera", [0.385, 0.265], 0.0, 32.0, camera::parts()),
        on_table("headphones", [0.445, 0.045], 0.0, -20.0, headphones::parts()),
        on_table("toy car", [-0.42, 0.245], 0.0, 35.0, toy_car::parts()),
        on_table("fruit bowl", [-0.225, -0.005], 0.0, 0.0, bowl::parts()),
    ]
}

fn on_table(name: &'static str, [x, z]: [f64; 2], above: f64, turn_deg: f64, parts: Vec<Part>) -> Object {
    Object { name, position: DVec3::new(x, TABLE_TOP + above, z), turn_deg, parts }
}
