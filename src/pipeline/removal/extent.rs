//! Extent of a thing: a ball around it, and the space that it takes.

use glam::DVec3;

use crate::math::stats::quantile;
use crate::scene::GaussianCloud;

/// Ball around a thing, without a few stray Gaussians.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ball {
    pub(super) center: DVec3,
    pub(super) radius: f64,
}

impl Ball {
    pub(super) fn of(cloud: &GaussianCloud, inside: &[bool]) -> Self {
        let at: Vec<DVec3> = (0..cloud.len()).filter(|i| inside[*i]).map(|i| cloud.world_position(i)).collect();
        let middle = |axis: usize| {
            let all: Vec<f64> = at.iter().map(|p| p[axis]).collect();
            0.5 * (quantile(&all, 0.02) + quantile(&all, 0.98))
        };
        let center = DVec3::new(middle(0), middle(1), middle(2));
        let far: Vec<f64> = at.iter().map(|p| p.distance(center)).collect();
        Self { center, radius: quantile(&far, 0.98).max(f64::MIN_POSITIVE) }
    }
}

/// Margin around the known Gaussians of a thing, as a share of its size.
pub(super) const MORE: f64 = 0.15;
/// Directions along which the extent of a thing is measured: the axes, and the diagonals of faces and of the box.
const DIRECTIONS: [[f64; 3]; 13] = [
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 1.0, 0.0],
    [1.0, -1.0, 0.0],
    [1.0, 0.0, 1.0],
    [1.0, 0.0, -1.0],
    [0.0, 1.0, 1.0],
    [0.0, 1.0, -1.0],
    [1.0, 1.0, 1.0],
    [1.0, 1.0, -1.0],
    [1.0, -1.0, 1.0],
    [1.0, -1.0, -1.0],
];

/// Space of a thing: between its ends along all of [`DIRECTIONS`], without outliers by their quartiles, plus a
/// margin.
pub(super) struct ThingExtent([(DVec3, f64, f64); 13]);

impl ThingExtent {
    pub(super) fn of(cloud: &GaussianCloud, inside: &[bool]) -> Self {
        Self(DIRECTIONS.map(|d| {
            let along = DVec3::from(d);
            let mut at: Vec<f64> =
                (0..cloud.len()).filter(|i| inside[*i]).map(|i| cloud.world_position(i).dot(along)).collect();
            at.sort_by(f64::total_cmp);
            let (low, high) = (quantile(&at, 0.25), quantile(&at, 0.75));
            let reach = high - low;
            let within = |v: &&f64| **v >= low - reach && **v <= high + reach;
            let first = at.iter().find(within).copied().unwrap_or(low);
            let last = at.iter().rfind(within).copied().unwrap_or(high);
            let more = MORE * (last - first);
            (along, first - more, last + more)
        }))
    }

    pub(super) fn contains(&self, p: DVec3) -> bool {
        self.0.iter().all(|(along, first, last)| (*first..=*last).contains(&p.dot(*along)))
    }
}
