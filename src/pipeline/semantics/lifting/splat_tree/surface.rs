//! Gaussians as a surface: their neighbors, their colors, and the visible borders between them in the views of a
//! scene.

use glam::DVec2;
use rayon::prelude::*;

use super::super::error::FindError;
use super::super::nearest::NearestGaussians;
use super::super::regions::edges::{ImagePlanes, strength};
use super::super::regions::lab::{lab, planes};
use super::super::regions::shape::ends;
use super::super::regions::tree::{Border, Piece};
use super::super::renderers::Renderers;
use super::super::view_votes::to_square_units;
use crate::math::lanes::Lane;
use crate::pipeline::observer::{Observer, Ticker};
use crate::render::{ContributionSink, Features, RenderError, RenderSettings, Renderer, TILE_PX};
use crate::scene::{Camera, GaussianCloud};

/// Number of neighbors searched for each Gaussian.
pub(crate) const NEIGHBORS: usize = 10;
/// Largest distance of two neighbors, as a multiple of the distance to the last neighbor of either.
const FAR: f64 = 10.0;
/// Longer side of the views, px.
const SIDE_PX: u32 = 448;
/// Most views that are rendered.
const MOST_VIEWS: usize = 32;
/// Least share of its area in its best view for a Gaussian to count as seen in a view.
const LEAST_SEEN: f32 = 0.1;
/// Least opacity of a surface.
const SOLID: f32 = 0.3;

/// A cloud's surface.
pub(crate) struct SplatSurface {
    /// Area of each Gaussian, square units, and the sum of its color's planes over that.
    pub(super) pieces: Vec<Piece>,
    /// Neighbors, the smaller index first.
    pub(super) edges: Vec<(u32, u32)>,
    /// Border between the two Gaussians of each edge.
    pub(super) borders: Vec<Border>,
}

/// Evidence of one view.
struct Look {
    camera: Camera,
    strength: Vec<f32>,
    ends: Vec<f32>,
    /// Area of each Gaussian, square units.
    areas: Vec<f32>,
}

impl SplatSurface {
    /// Renders the Gaussians, whose [`NEIGHBORS`] are `near`, through some of these cameras.
    pub(crate) fn new(
        renderers: &mut Renderers,
        cloud: &GaussianCloud,
        near: &NearestGaussians,
        cameras: &[Camera],
        settings: &RenderSettings,
        observer: &mut dyn Observer,
    ) -> Result<Self, FindError> {
        let chosen: Vec<usize> = spread(cameras.len(), MOST_VIEWS).collect();
        let mut ticker = Ticker::new("Preparing selection", chosen.len() + 1);
        let mut colors = vec![[0.0_f32; 4]; cloud.len()];
        let mut looks: Vec<Look> = Vec::with_capacity(chosen.len());
        let draw = |renderer: &mut Renderer, i: &usize| {
            let seen = look(renderer, cloud, &cameras[*i].limited_to(SIDE_PX), settings);
            seen.map_err(|e| FindError::Render((i + 1).to_string(), e.into()))
        };
        renderers.each(&chosen, draw, |_, (look, sums)| {
            for (gaussian, sums) in sums.iter().flatten() {
                colors[*gaussian as usize].iter_mut().zip(sums).for_each(|(c, s)| *c += s);
            }
            looks.push(look);
            Ok(ticker.tick(looks.len(), observer)?)
        })?;
        let mut best = vec![0.0_f32; cloud.len()];
        for look in &looks {
            best.iter_mut().zip(&look.areas).for_each(|(b, a)| *b = b.max(*a));
        }
        let edges = neighbors(near);
        let colors = own_colors(cloud, &colors);
        let borders = edges.par_iter().map(|&edge| border(cloud, &looks, &best, &colors, edge)).collect();
        let piece = |(color, area): (&[f32; 3], &f32)| {
            let area = f64::from(area.max(f32::MIN_POSITIVE));
            Piece { area, sums: color.iter().map(|c| f64::from(*c) * area).collect() }
        };
        let pieces = colors.iter().zip(&best).map(piece).collect();
        Ok(Self { pieces, edges, borders })
    }
}

/// Returns at most `most` of `n` indices, evenly spread.
fn spread(n: usize, most: usize) -> impl Iterator<Item = usize> {
    let taken = n.min(most);
    (0..taken).map(move |k| (2 * k + 1) * n / (2 * taken))
}

/// By row of tiles: Gaussian, and the sums of its weight and its colors.
type ColorSums = Vec<Vec<(u32, [f32; 4])>>;

fn look(
    renderer: &mut Renderer,
    cloud: &GaussianCloud,
    camera: &Camera,
    settings: &RenderSettings,
) -> Result<(Look, ColorSums), RenderError> {
    let frame = renderer.render(cloud, Features::NONE, camera, &RenderSettings { depth: true, ..settings.clone() })?;
    let (width, height) = (frame.width_px, frame.height_px);
    let channels = planes(&lab(&frame.to_rgb8()));
    let depth = |(&d, &a): (&f32, &f32)| if a >= SOLID { d / a } else { 0.0 };
    let depth: Vec<f32> = frame.depth.iter().zip(&frame.alpha).map(depth).collect();
    let [l, a, b] = &channels;
    let pixels: Vec<[f32; 4]> = l.iter().zip(a).zip(b).map(|((l, a), b)| [1.0, *l, *a, *b]).collect();
    let row = || Row { pixels: &pixels, width, gaussian: u32::MAX, sums: [0.0; 4], found: Vec::new() };
    let mut rows: Vec<Row<'_>> = (0..height.div_ceil(TILE_PX)).map(|_| row()).collect();
    renderer.weights_of_picture(cloud, camera, settings).give(&mut rows)?;
    rows.iter_mut().for_each(Row::finish);
    let sums: ColorSums = rows.into_iter().map(|row| row.found).collect();
    let mut areas = vec![0.0_f32; cloud.len()];
    sums.iter().flatten().for_each(|(gaussian, sums)| areas[*gaussian as usize] += sums[0]);
    to_square_units(&mut areas, cloud, camera);
    let look = Look {
        strength: strength(&ImagePlanes { width, channels: &channels }),
        ends: ends(&depth, width, 0.5 * (camera.focal_px.x + camera.focal_px.y)),
        camera: camera.clone(),
        areas,
    };
    Ok((look, sums))
}

/// Collects weights and weighted colors of one row of tiles.
struct Row<'a> {
    /// 1 and the color of each pixel.
    pixels: &'a [[f32; 4]],
    width: usize,
    gaussian: u32,
    sums: [f32; 4],
    found: Vec<(u32, [f32; 4])>,
}

impl Row<'_> {
    fn finish(&mut self) {
        if self.sums[0] > 0.0 {
            self.found.push((self.gaussian, self.sums));
        }
        self.sums = [0.0; 4];
    }
}

impl ContributionSink<f32> for Row<'_> {
    #[inline(always)]
    fn add(&mut self, gaussian: u32, x: usize, y: usize, weights: &Lane<f32>) {
        if gaussian != self.gaussian {
            self.finish();
            self.gaussian = gaussian;
        }
        let (first, mut sums) = (y * self.width + x, self.sums);
        let pixels = &self.pixels[first..(y + 1) * self.width];
        // Without a branch for zeros, which change no sum.
        for (weight, pixel) in weights.iter().zip(pixels) {
            sums.iter_mut().zip(pixel).for_each(|(sum, value)| *sum += weight * value);
        }
        self.sums = sums;
    }
}

/// Returns the color of each Gaussian in the views; its own if no view shows it.
fn own_colors(cloud: &GaussianCloud, seen: &[[f32; 4]]) -> Vec<[f32; 3]> {
    let stride = cloud.sh_stride();
    let own = |i: usize| -> [u8; 3] {
        std::array::from_fn(|c| {
            let v = 0.5 + crate::math::sh::SH_C0 as f32 * cloud.sh[i * stride][c];
            (255.0 * v.clamp(0.0, 1.0)) as u8
        })
    };
    let dark = planes(&lab(&(0..cloud.len()).map(own).collect::<Vec<_>>()));
    let color = |(i, s): (usize, &[f32; 4])| match s[0] > 1e-3 {
        true => [s[1] / s[0], s[2] / s[0], s[3] / s[0]],
        false => [dark[0][i], dark[1][i], dark[2][i]],
    };
    seen.iter().enumerate().map(color).collect()
}

/// Returns the nearest neighbors of all Gaussians, each pair once.
fn neighbors(around: &NearestGaussians) -> Vec<(u32, u32)> {
    let reach: Vec<f64> = around.iter().map(|near| near.last().map_or(0.0, |(_, far2)| *far2)).collect();
    let near = |(a, b, far2): &(usize, usize, f64)| *far2 <= FAR.powi(2) * reach[*a].min(reach[*b]);
    let pairs = around.iter().enumerate().flat_map(|(p, near)| near.iter().map(move |&(q, far2)| (p, q, far2)));
    let mut edges: Vec<(u32, u32)> = pairs.filter(near).map(|(p, q, _)| (p.min(q) as u32, p.max(q) as u32)).collect();
    edges.par_sort_unstable();
    edges.dedup();
    edges
}

fn border(cloud: &GaussianCloud, looks: &[Look], best: &[f32], colors: &[[f32; 3]], (a, b): (u32, u32)) -> Border {
    let (a, b) = (a as usize, b as usize);
    let (mut seen, mut strength, mut ends) = (0.0, 0.0, 0.0);
    for look in looks {
        let sees = |i: usize| look.areas[i] > 0.0 && look.areas[i] >= LEAST_SEEN * best[i];
        if !(sees(a) && sees(b)) {
            continue;
        }
        let at = |i: usize| look.camera.project(cloud.world_position(i));
        let (Some(from), Some(to)) = (at(a), at(b)) else { continue };
        let [s, e] = look.strongest_between(from, to);
        seen += 1.0;
        strength += f64::from(s);
        ends += f64::from(e);
    }
    if seen > 0.0 {
        return Border { length: 1.0, strength: strength / seen, ends: ends / seen };
    }
    // No view shows both: they are as far apart as their colors.
    let apart = colors[a].iter().zip(&colors[b]).map(|(p, q)| (p - q).powi(2)).sum::<f32>().sqrt();
    Border { length: 1.0, strength: f64::from(apart), ends: 0.5 }
}

impl Look {
    /// Returns the strongest edge and the clearest end of a surface between two places, px.
    fn strongest_between(&self, from: DVec2, to: DVec2) -> [f32; 2] {
        let (w, h) = (self.camera.width_px as usize, self.camera.height_px as usize);
        let steps = (from.distance(to).ceil() as usize).clamp(1, 12);
        let mut found = [0.0_f32; 2];
        for k in 0..=steps {
            let p = from.lerp(to, k as f64 / steps as f64);
            let x = (p.x.max(0.0) as usize).min(w - 1);
            let y = (p.y.max(0.0) as usize).min(h - 1);
            let i = y * w + x;
            found = [found[0].max(self.strength[i]), found[1].max(self.ends[i])];
        }
        found
    }
}
