//! Distances between surfaces, and which thing stands on which.

use glam::DVec3;

use super::clarity::Clarity;
use super::mesh::MeshSolid;
use super::shape::MeshShape;

/// Points of each surface for a first look, and for a close one.
const FEW: usize = 150;
const MANY: usize = 4000;
/// Distance in sizes below which a close look is taken.
const CLOSE: f64 = 0.1;
/// Share of the height, from the bottom, that touches what a thing stands on.
const FEET: f64 = 0.03;
/// Distances in sizes, from the feet to what surely carries them and to what surely does not.
const CARRIED: f64 = 0.06;
const FREE: f64 = 0.12;
/// Distance in sizes by which feet may sink in.
const SUNK: f64 = 0.05;
/// Share of the feet that surely carries a thing, and that surely does not.
const ENOUGH: f64 = 0.3;
const HARDLY: f64 = 0.02;

/// Smallest distance between two surfaces; `size` is that of the smaller thing.
pub(super) fn gap(a: &MeshSolid, b: &MeshSolid, size: f64) -> f64 {
    let both = |most: usize| one_way(a, b, most).min(one_way(b, a, most));
    let rough = both(FEW);
    if rough < CLOSE * size { rough.min(both(MANY)) } else { rough }
}

fn one_way(from: &MeshSolid, to: &MeshSolid, most: usize) -> f64 {
    let points = spread(&from.corners, most).chain(spread(&from.points, most));
    points.filter_map(|p| to.nearest(*p).map(|q| q.distance(*p))).fold(f64::INFINITY, f64::min)
}

/// At most about `most` of the points, from all over the list.
fn spread(points: &[DVec3], most: usize) -> impl Iterator<Item = &DVec3> {
    points.iter().step_by(points.len().div_ceil(most).max(1))
}

/// Answers whether `a`, of this shape, stands directly on `b`: the lowest points of `a` have `b` right below.
pub(super) fn stands(a: &MeshSolid, shape: &MeshShape, b: &MeshSolid) -> Clarity {
    let size = shape.longest();
    let top = shape.bounds.min.y + FEET * shape.height;
    let low: Vec<DVec3> = a.corners.iter().chain(&a.points).copied().filter(|p| p.y <= top).collect();
    let sunk = (SUNK * size).min(0.5 * shape.height);
    let fall = |p: &DVec3| {
        let q = b.nearest(*p)?;
        let apart = *p - q;
        let below = apart.x.hypot(apart.z) <= apart.y.abs() + 0.01 * size && apart.y >= -sunk;
        below.then(|| apart.length())
    };
    let feet = spread(&low, FEW).map(fall).collect::<Vec<_>>();
    let share = |most: f64| {
        let near = feet.iter().flatten().filter(|d| **d <= most * size).count();
        near as f64 / feet.len().max(1) as f64
    };
    Clarity::of(share(CARRIED) >= ENOUGH, share(FREE) <= HARDLY)
}
