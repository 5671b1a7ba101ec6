//! Which Gaussians go: those of the thing, its fringes, and what nobody ever saw and would be in sight then.

use glam::DVec3;

use crate::math::stats::quantile;
use crate::pipeline::observer::{Observer, Ticker};
use crate::render::{ContributionSink, RenderSettings, Renderer, TILE_PX};
use crate::scene::{Camera, GaussianCloud, IdentityId, NOBODY, SemanticMap};

use super::RemovalError;
use crate::math::lanes::Lane;

/// Share of a pixel from which a Gaussian is seen there.
const SEEN: f32 = 0.05;
/// Side at which that is looked at, px.
const SIDE_PX: u32 = 320;
/// Identities that are less sure than this may be those of a neighbor.
const UNSURE: f32 = 0.3;

/// The Gaussians of these identities and their pieces.
pub(super) fn members(map: &SemanticMap, ids: &[IdentityId]) -> Vec<bool> {
    let mut inside = vec![false; map.identity_of.len()];
    ids.iter().flat_map(|id| map.members(*id)).for_each(|i| inside[i] = true);
    inside
}

/// Where a thing is, a few stray Gaussians left out.
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

/// Adds what lies within the thing and is nobody's for sure, or nobody's at all; how many those are. Within is what lies
/// between the thing's ends along all of [`DIRECTIONS`], outliers by their quartiles left out.
pub(super) fn add_fringes(cloud: &GaussianCloud, map: &SemanticMap, gone: &mut [bool]) -> usize {
    let extents = DIRECTIONS.map(|d| {
        let along = DVec3::from(d);
        let mut at: Vec<f64> =
            (0..cloud.len()).filter(|i| gone[*i]).map(|i| cloud.world_position(i).dot(along)).collect();
        at.sort_by(f64::total_cmp);
        let (low, high) = (quantile(&at, 0.25), quantile(&at, 0.75));
        let reach = high - low;
        let within = |v: &&f64| **v >= low - reach && **v <= high + reach;
        let first = at.iter().find(within).copied().unwrap_or(low);
        let last = at.iter().rfind(within).copied().unwrap_or(high);
        (along, first, last)
    });
    let is_within = |p: DVec3| extents.iter().all(|(along, first, last)| (*first..=*last).contains(&p.dot(*along)));
    let unsure = |i: usize| map.margin[i] < UNSURE && (map.identity_of[i] == NOBODY || map.margin[i] < 0.5 * UNSURE);
    let found: Vec<usize> =
        (0..cloud.len()).filter(|&i| !gone[i] && unsure(i) && is_within(cloud.world_position(i))).collect();
    found.iter().for_each(|i| gone[*i] = true);
    found.len()
}

/// Adds Gaussians that no photo has seen and that are in sight once the others are gone: nothing says what they should
/// look like. How many those are.
pub(super) fn add_unseen(
    cloud: &GaussianCloud,
    gone: &mut [bool],
    cameras: &[Camera],
    settings: &RenderSettings,
    observer: &mut dyn Observer,
) -> Result<usize, RemovalError> {
    let mut renderer = Renderer::new();
    let mut ticker = Ticker::new("Looking for what no photo has seen", 2 * cameras.len());
    let mut largest = |cloud: &GaussianCloud, from: usize, observer: &mut dyn Observer| {
        let mut weight = vec![0.0_f32; cloud.len()];
        for (k, camera) in cameras.iter().enumerate() {
            ticker.tick(from + k, observer)?;
            let camera = camera.limited_to(SIDE_PX);
            let mut rows: Vec<Largest> = (0..camera.height_px.div_ceil(TILE_PX as u32)).map(|_| Largest::default()).collect();
            renderer.contributions(cloud, &camera, settings, &mut rows)?;
            rows.iter().flat_map(|r| &r.0).for_each(|(i, w)| weight[*i as usize] = weight[*i as usize].max(*w));
        }
        Ok::<_, RemovalError>(weight)
    };
    let before = largest(cloud, 0, observer)?;
    let kept: Vec<usize> = (0..cloud.len()).filter(|&i| !gone[i]).collect();
    let after = largest(&cloud.select(&kept), cameras.len(), observer)?;
    let found: Vec<usize> = kept.into_iter().zip(after).filter(|(i, w)| before[*i] < SEEN && *w >= SEEN).map(|f| f.0).collect();
    found.iter().for_each(|i| gone[*i] = true);
    Ok(found.len())
}

/// The largest share of a pixel that each Gaussian has in a row of tiles; one may stand there several times.
#[derive(Default)]
struct Largest(Vec<(u32, f32)>);

impl ContributionSink<f32> for Largest {
    fn add(&mut self, gaussian: u32, _: usize, _: usize, weights: &Lane<f32>) {
        let largest = weights.iter().fold(0.0_f32, |a, b| a.max(*b));
        match self.0.last_mut().filter(|last| last.0 == gaussian) {
            Some(last) => last.1 = last.1.max(largest),
            None => self.0.push((gaussian, largest)),
        }
    }
}
