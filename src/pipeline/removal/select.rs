//! Selection of the Gaussians to remove: those of the thing, its fringes, and unseen ones that would come in sight.

use std::collections::HashMap;

use crate::math::lanes::Lane;
use crate::pipeline::observer::{Observer, Ticker};
use crate::render::{ContributionSink, RenderSettings, Renderer, TILE_PX};
use crate::scene::{Camera, GaussianCloud, IdentityId, NO_IDENTITY, SemanticMap};

use super::RemovalError;
use super::extent::{Ball, MORE, ThingExtent};
use super::views::TOUCHED;

/// Least share of a pixel for a Gaussian to be seen there.
const SEEN: f32 = 0.05;
/// Longer side of the views in which that is measured, px.
const SIDE_PX: u32 = 320;
/// Distance from its object at which a Gaussian is stray, in radii.
const STRAY: f64 = 1.5;
/// Margin below which a Gaussian may belong to a neighbor.
const UNSURE: f32 = 0.3;

/// Returns the Gaussians of these identities and their pieces.
pub(crate) fn members(map: &SemanticMap, ids: &[IdentityId]) -> Vec<bool> {
    let mut inside = vec![false; map.identity_of.len()];
    ids.iter().flat_map(|id| map.members(*id)).for_each(|i| inside[i] = true);
    inside
}

/// Adds Gaussians within the thing that are unlabeled or uncertain, and near ones with the label of a distant object;
/// returns their number.
pub(super) fn add_fringes(
    cloud: &GaussianCloud,
    map: &SemanticMap,
    (ball, extent): (&Ball, &ThingExtent),
    gone: &mut [bool],
) -> usize {
    let unsure =
        |i: usize| map.margin[i] < UNSURE && (map.identity_of[i] == NO_IDENTITY || map.margin[i] < 0.5 * UNSURE);
    let near = |i: &usize| !gone[*i] && cloud.world_position(*i).distance(ball.center) < (1.0 + MORE) * ball.radius;
    let near: Vec<usize> = (0..cloud.len()).filter(near).collect();
    let mut own: HashMap<IdentityId, Ball> = HashMap::new();
    let mut astray = |i: usize| {
        let object = map.identities.object_of(map.identity_of[i]);
        let of = || Ball::of(cloud, &members(map, &[object]));
        let far = |of: &Ball| cloud.world_position(i).distance(of.center) > STRAY * of.radius;
        object != NO_IDENTITY && far(own.entry(object).or_insert_with(of))
    };
    let within = |i: usize| extent.contains(cloud.world_position(i));
    let found: Vec<usize> = near.into_iter().filter(|&i| unsure(i) && within(i) || astray(i)).collect();
    found.iter().for_each(|i| gone[*i] = true);
    found.len()
}

/// Returns Gaussians that no photo has seen and that come in sight in the thing's place without the `gone` ones and
/// with the `new` ones: their looks are undefined.
pub(super) fn unseen(
    cloud: &GaussianCloud,
    gone: &[bool],
    new: Option<&GaussianCloud>,
    cameras: &[Camera],
    settings: &RenderSettings,
    observer: &mut dyn Observer,
) -> Result<Vec<usize>, RemovalError> {
    let kept: Vec<usize> = (0..cloud.len()).filter(|&i| !gone[i]).collect();
    let rest = new.cloned().unwrap_or_else(|| cloud.select(&kept));
    let mut renderer = Renderer::new();
    let mut ticker = Ticker::new("Finding hidden surfaces", cameras.len());
    let (mut before, mut after) = (vec![0.0_f32; cloud.len()], vec![0.0_f32; rest.len()]);
    for (k, camera) in cameras.iter().enumerate() {
        ticker.tick(k, observer)?;
        let camera = camera.limited_to(SIDE_PX);
        let width = camera.width_px as usize;
        let mut rows: Vec<Row<'_>> =
            (0..camera.height_px.div_ceil(TILE_PX as u32)).map(|_| Row::of(Look::At { gone, width })).collect();
        renderer.contributions(cloud, &camera, settings, &mut rows)?;
        rows.iter().for_each(|row| row.largest_into(&mut before));
        let thing: Vec<Vec<f32>> = rows.into_iter().map(|row| row.thing).collect();
        let mut rows: Vec<Row<'_>> = thing.iter().map(|thing| Row::of(Look::Behind { thing, width })).collect();
        renderer.contributions(&rest, &camera, settings, &mut rows)?;
        rows.iter().for_each(|row| row.largest_into(&mut after));
    }
    let unseen = |(i, weight): &(usize, f32)| before[*i] < SEEN && *weight >= SEEN;
    Ok(kept.into_iter().zip(after).filter(unseen).map(|f| f.0).collect())
}

/// Pixels at which weights are counted.
enum Look<'a> {
    /// All pixels; the share of `gone` Gaussians in each is recorded.
    At { gone: &'a [bool], width: usize },
    /// Pixels in which the thing had a share.
    Behind { thing: &'a [f32], width: usize },
}

/// A row of tiles.
struct Row<'a> {
    look: Look<'a>,
    /// Largest share of a pixel of each Gaussian, which may be listed several times.
    largest: Vec<(u32, f32)>,
    /// The thing's share of each pixel.
    thing: Vec<f32>,
}

impl<'a> Row<'a> {
    fn of(look: Look<'a>) -> Self {
        let pixels = if let Look::At { width, .. } = look { width * TILE_PX } else { 0 };
        Self { look, largest: Vec::new(), thing: vec![0.0; pixels] }
    }

    fn largest_into(&self, all: &mut [f32]) {
        self.largest.iter().for_each(|(i, w)| all[*i as usize] = all[*i as usize].max(*w));
    }
}

impl ContributionSink<f32> for Row<'_> {
    fn add(&mut self, gaussian: u32, x: usize, y: usize, weights: &Lane<f32>) {
        let mut largest = 0.0_f32;
        match self.look {
            Look::At { gone, width } => {
                largest = weights.iter().fold(largest, |a, b| a.max(*b));
                if gone[gaussian as usize] {
                    let from = y % TILE_PX * width + x;
                    let inside = width.saturating_sub(x).min(weights.len());
                    self.thing[from..from + inside].iter_mut().zip(weights).for_each(|(sum, w)| *sum += w);
                }
            }
            Look::Behind { thing, width } => {
                let from = y % TILE_PX * width + x;
                for (share, weight) in thing[from.min(thing.len())..].iter().zip(weights).take(width.saturating_sub(x))
                {
                    largest = if *share >= TOUCHED { largest.max(*weight) } else { largest };
                }
            }
        }
        match self.largest.last_mut().filter(|last| last.0 == gaussian) {
            Some(last) => last.1 = last.1.max(largest),
            None if largest > 0.0 => self.largest.push((gaussian, largest)),
            None => {}
        }
    }
}
