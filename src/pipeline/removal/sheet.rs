//! A piece of a plane in texels, each of which is seen, hidden or empty by the photos.

use glam::DVec3;
use rayon::prelude::*;

use super::extent::Ball;
use super::paint::{self, Paint};
use super::plane::Plane;
use super::views::{SeenView, TOUCHED};
use crate::math::grid;
use crate::math::srgb::{self, brighter};
use crate::math::stats::median;
use crate::models::ModelError;
use crate::models::lama::Lama;

/// Texels of the coarse sheet along a radius of the thing, and of a fine sheet along a side at most.
const COARSE: f64 = 16.0;
const MOST: usize = 400;
/// Visible margin around a hole to paint from, as a share of its larger side.
const MARGIN: f64 = 0.75;
/// Least cosine of a view: those along the surface say little.
const LEAST_COSINE: f64 = 0.1;
/// Least number of photos that see a texel, or see through it.
const AGREE: u32 = 2;
/// Least texels of a hole, and least share of the largest one; smaller holes are noise.
const SPECK: (usize, f64) = (12, 0.02);
/// Texels around a hole that are painted, too, because the thing's rim may have touched their color.
const RIM: usize = 2;

/// Reach of the thing's foot and its shadow around a hole, as a share of the hole's diameter.
const FOOT: f64 = 0.25;
/// Least difference of a foot's color from the surface, absolute and as a multiple of the surface's own variation.
const DIFFERENT: (f32, f32) = (0.03, 4.0);

/// Gain from which seen texels are drawn anew: Gaussians there mix surface, shadow and thing.
const DRAWN_ANEW: f32 = 1.5;
/// Least texels of an area with an edge, such as empty space, and texels beside it whose colors are mixed.
const OPEN: usize = 30;
const EDGE: usize = 3;

/// State of a texel by the photos.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Texel {
    /// Not seen, or hidden by something else.
    Unknown,
    /// Surface is seen.
    Seen,
    /// Surface is seen, in the thing's deep shadow.
    Shaded,
    /// Empty: the photos look through it.
    Free,
    /// Hidden by the thing in all of them.
    Hidden,
}

impl Texel {
    /// Returns whether the photos show the surface.
    pub(super) fn is_surface(self) -> bool {
        matches!(self, Self::Seen | Self::Shaded)
    }

    /// Returns whether it becomes a Gaussian.
    pub(super) fn is_drawn(self) -> bool {
        matches!(self, Self::Hidden | Self::Shaded)
    }
}

/// Texels in row-major order.
pub(super) struct SurfaceTexture<'a> {
    plane: &'a Plane,
    /// Place of the first texel's corner along the plane.
    corner: [f64; 2],
    /// Side of a texel, scene units.
    pub(super) step: f64,
    pub(super) size: [usize; 2],
    pub(super) state: Vec<Texel>,
    /// Colors of seen texels; after painting, of hidden ones as well.
    pub(super) color: Vec<[f32; 3]>,
    /// Drawn texels with none but drawn ones around them.
    deep: Vec<bool>,
}

impl<'a> SurfaceTexture<'a> {
    /// Samples the plane up to `reach` radii around the thing, in coarse texels.
    pub(super) fn around(plane: &'a Plane, ball: &Ball, seen: &[SeenView], reach: f64) -> Self {
        let middle = ball.center - plane.origin;
        let side = 2.0 * reach * ball.radius;
        let corner = [plane.u, plane.v].map(|along| middle.dot(along) - 0.5 * side);
        let step = ball.radius / COARSE;
        Self::looked_at(plane, corner, step, [(side / step).ceil() as usize; 2], seen)
    }

    /// Returns the part of this sheet that the thing in `ball` hid from all views, in fine texels, with its visible
    /// surroundings; `None` if it hid nothing.
    pub(super) fn hidden_part(&self, ball: &Ball, seen: &[SeenView]) -> Option<Self> {
        let (plane, step) = (self.plane, self.step);
        let hidden = || (0..self.state.len()).filter(|i| self.state[*i] == Texel::Hidden);
        let ends = |axis: usize| {
            let all = hidden().map(|i| [i % self.size[0], i / self.size[0]][axis]);
            Some((all.clone().min()?, all.max()? + 1))
        };
        let (x, y) = (ends(0)?, ends(1)?);
        let larger = (x.1 - x.0).max(y.1 - y.0) as f64 * step;
        let pad = MARGIN * larger + step;
        let corner = [x.0, y.0].map(|t| t as f64 * step - pad);
        let corner = [corner[0] + self.corner[0], corner[1] + self.corner[1]];
        let extent = [x, y].map(|(from, to)| (to - from) as f64 * step + 2.0 * pad);
        let fine = pixel_size(plane, ball, seen).max(extent[0].max(extent[1]) / MOST as f64);
        let size = extent.map(|e| (e / fine).ceil().max(1.0) as usize);
        let sheet = Self::looked_at(plane, corner, fine, size, seen);
        sheet.state.contains(&Texel::Hidden).then_some(sheet)
    }

    fn looked_at(plane: &'a Plane, corner: [f64; 2], step: f64, size: [usize; 2], seen: &[SeenView]) -> Self {
        let n = size[0] * size[1];
        let mut sheet = Self { plane, corner, step, size, state: Vec::new(), color: Vec::new(), deep: Vec::new() };
        let agree = AGREE.min(seen.len() as u32);
        (sheet.state, sheet.color) = (0..n).into_par_iter().map(|i| asked(plane, sheet.center(i), seen, agree)).unzip();
        sheet.clean();
        sheet
    }

    /// Opens hidden areas nearer to empty space than to surface, as behind an edge; areas with more empty space than
    /// surface around them, as below a removed table, whose own surface they are; and specks.
    fn clean(&mut self) {
        let (width, n) = (self.size[0], self.state.len());
        let known = (0..n).filter_map(|i| match self.state[i] {
            Texel::Seen => Some((i, true)),
            Texel::Free => Some((i, false)),
            _ => None,
        });
        let surface = grid::spread(width, n, known, |_| true);
        let (label, areas) = grid::regions(width, n, |i| self.state[i] == Texel::Hidden && surface[i] == Some(true));
        let largest = areas.iter().copied().max().unwrap_or(0);
        let least = ((SPECK.1 * largest as f64) as usize).max(SPECK.0);
        // Texels of surface and of empty space at the border of each.
        let mut border = vec![[0_usize; 2]; areas.len() + 1];
        for i in (0..n).filter(|i| self.state[*i] == Texel::Seen || surface[*i] == Some(false)) {
            for of in grid::neighbors(i, width, n).map(|j| label[j] as usize).filter(|of| *of > 0) {
                border[of][usize::from(surface[i] == Some(false))] += 1;
            }
        }
        let count = |state: Texel| self.state.iter().filter(|s| **s == state).count();
        // More is hidden than seen: below a removed table there are feet of things that stood on it, and no surface.
        let is_none = count(Texel::Hidden) > count(Texel::Seen);
        let is_open = |of: usize| is_none || of == 0 || areas[of - 1] < least || border[of][0] <= border[of][1];
        for i in 0..n {
            if self.state[i] == Texel::Hidden && is_open(label[i] as usize) {
                self.state[i] = Texel::Unknown;
            }
        }
        self.find_deep();
    }

    fn hidden(&self) -> Vec<bool> {
        self.state.iter().map(|s| *s == Texel::Hidden).collect()
    }

    /// Returns the texels for which `is` holds and their neighbors, as far as they belong to the surface.
    fn with_seam(&self, is: impl Fn(Texel) -> bool) -> Vec<bool> {
        let grown = grid::grown(self.size[0], self.state.iter().map(|s| is(*s)).collect(), 1);
        grown.iter().zip(&self.state).map(|(is, s)| *is && (s.is_surface() || *s == Texel::Hidden)).collect()
    }

    /// Returns the texels in areas where `is` holds, without specks, and those beside them.
    fn beside(&self, is: impl Fn(usize) -> bool) -> Vec<bool> {
        let (label, areas) = grid::regions(self.size[0], self.state.len(), is);
        let inside = label.iter().map(|of| *of > 0 && areas[*of as usize - 1] >= OPEN).collect();
        grid::grown(self.size[0], inside, EDGE)
    }

    fn find_deep(&mut self) {
        let open = self.state.iter().map(|s| !s.is_drawn()).collect();
        self.deep = grid::grown(self.size[0], open, RIM).iter().map(|open| !open).collect();
    }

    /// Marks the thing's foot and the shadow at it as hidden: seen texels beside a hole with another color than the
    /// surface has farther away.
    pub(super) fn add_foot(&mut self) {
        let (width, n) = (self.size[0], self.state.len());
        let hidden = self.hidden();
        let steps = (FOOT * (hidden.iter().filter(|h| **h).count() as f64).sqrt()).ceil() as usize;
        let beside = grid::grown(width, hidden.clone(), steps);
        let known: Vec<bool> = (0..n).map(|i| self.state[i].is_surface() && !beside[i]).collect();
        let expected = paint::smooth(&self.color, self.size, &known, &beside);
        let off = |i: usize| (0..3).map(|c| (self.color[i][c] - expected[i][c]).abs()).fold(0.0, f32::max);
        let usual: Vec<f64> = (0..n).filter(|i| known[*i]).map(|i| f64::from(off(i))).collect();
        if usual.is_empty() {
            return;
        }
        let limit = DIFFERENT.0.max(DIFFERENT.1 * median(&usual) as f32);
        // Low parts of things hide the surface there, too.
        let is_foot = |i: usize| match self.state[i] {
            Texel::Seen | Texel::Shaded => beside[i] && off(i) > limit,
            Texel::Unknown => beside[i],
            _ => false,
        };
        // From the hole outward: different colors farther away are something else.
        let from = (0..n).filter(|i| hidden[*i]).map(|i| (i, ()));
        let reached = grid::spread(width, n, from, is_foot);
        for i in (0..n).filter(|i| reached[*i].is_some()) {
            self.state[i] = Texel::Hidden;
        }
        self.find_deep();
    }

    /// Returns the linear light of these texels in channel `c`.
    pub(super) fn linear(&self, texels: &[usize], c: usize) -> Vec<f32> {
        texels.iter().map(|&i| srgb::linear(self.color[i][c].max(0.0))).collect()
    }

    /// Returns the center of texel `i` in the world.
    pub(super) fn center(&self, i: usize) -> DVec3 {
        let at = |axis: usize, t: usize| self.corner[axis] + (t as f64 + 0.5) * self.step;
        self.plane.origin + self.plane.u * at(0, i % self.size[0]) + self.plane.v * at(1, i / self.size[0])
    }

    /// Returns the place of a point along the sheet, in texels.
    pub(super) fn place(&self, p: DVec3) -> [f64; 2] {
        let d = p - self.plane.origin;
        [(d.dot(self.plane.u) - self.corner[0]) / self.step, (d.dot(self.plane.v) - self.corner[1]) / self.step]
    }

    /// Interpolates the values of the four texels around a point; `None` beyond the sheet.
    pub(super) fn sample(&self, p: DVec3, of: impl Fn(usize) -> [f32; 3]) -> Option<[f32; 3]> {
        self.texel(p)?;
        let [x, y] = self.place(p).map(|t| t - 0.5);
        let mut sum = [0.0; 3];
        for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let (tx, ty) = (x.floor() + dx, y.floor() + dy);
            let weight = (1.0 - (x - tx).abs()) * (1.0 - (y - ty).abs());
            let [tx, ty] = [(tx, self.size[0]), (ty, self.size[1])].map(|(t, n)| t.clamp(0.0, n as f64 - 1.0) as usize);
            let value = of(ty * self.size[0] + tx);
            (0..3).for_each(|c| sum[c] += weight as f32 * value[c]);
        }
        Some(sum)
    }

    /// Makes the seen texels brighter. Those of the surface itself, `own`, change their state in deep shadow.
    pub(super) fn brighten(&mut self, own: &[bool], gain: impl Fn(DVec3, [f32; 3]) -> [f32; 3]) {
        let edge = self.beside(|i| self.state[i] == Texel::Free);
        for i in (0..self.state.len()).filter(|i| self.state[*i] == Texel::Seen).collect::<Vec<_>>() {
            let gain = gain(self.center(i), self.color[i]);
            self.color[i] = brighter(self.color[i], gain);
            if own[i] && !edge[i] && gain.iter().any(|g| *g >= DRAWN_ANEW) {
                self.state[i] = Texel::Shaded;
            }
        }
        self.find_deep();
    }

    /// Returns the texel below or above a point.
    pub(super) fn texel(&self, p: DVec3) -> Option<usize> {
        let [x, y] = self.place(p).map(f64::floor);
        let inside = x >= 0.0 && y >= 0.0 && x < self.size[0] as f64 && y < self.size[1] as f64;
        inside.then(|| y as usize * self.size[0] + x as usize)
    }

    /// Returns whether a texel and all around it are drawn.
    pub(super) fn is_deep(&self, texel: usize) -> bool {
        self.deep[texel]
    }

    /// Returns the texels that become Gaussians: the hidden ones and those in deep shadow, and a seam around them;
    /// with each, whether it is invented.
    pub(super) fn drawn(&self) -> impl Iterator<Item = (usize, bool)> {
        let invented = self.with_seam(|s| s == Texel::Hidden);
        self.with_seam(Texel::is_drawn)
            .into_iter()
            .zip(invented)
            .enumerate()
            .filter(|(_, t)| t.0)
            .map(|(i, t)| (i, t.1))
    }

    /// Paints the hidden texels, by the network if there is one. `own` = texels of the surface itself.
    pub(super) fn paint(
        &mut self,
        how: Paint,
        own: &[bool],
        seed: u64,
        network: Option<&mut Lama>,
    ) -> Result<(), ModelError> {
        let hole = grid::grown(self.size[0], self.hidden(), RIM);
        let known: Vec<bool> = (0..hole.len()).map(|i| self.state[i].is_surface() && !hole[i]).collect();
        let Some(network) = network else {
            paint::fill(&mut self.color, self.size, &known, &hole, how, seed);
            if how == Paint::Patches {
                let others = self.beside(|i| !self.state[i].is_surface() && !hole[i]);
                let shade: Vec<bool> = (0..hole.len()).map(|i| self.state[i] == Texel::Shaded && !hole[i]).collect();
                let plain: Vec<bool> = (0..hole.len()).map(|i| known[i] && own[i] && !others[i] && !shade[i]).collect();
                paint::continue_lines(&mut self.color, self.size, &plain, &hole, &shade);
            }
            return Ok(());
        };
        let painted = network.paint(&self.color, self.size, &known)?;
        (0..hole.len()).filter(|i| hole[*i]).for_each(|i| self.color[i] = painted[i]);
        Ok(())
    }
}

/// Side of a photo's pixel on the plane, scene units, median over the views.
fn pixel_size(plane: &Plane, ball: &Ball, seen: &[SeenView]) -> f64 {
    let foot = ball.center - plane.normal * plane.height(ball.center);
    let sizes: Vec<f64> = seen
        .iter()
        .map(|v| v.camera.camera_from_world(foot).z / v.camera.focal_px.max_element())
        .filter(|size| *size > 0.0)
        .collect();
    if sizes.is_empty() { ball.radius / 64.0 } else { median(&sizes) }
}

/// Returns the state of a point of the plane by the views, and its color.
fn asked(plane: &Plane, point: DVec3, seen: &[SeenView], agree: u32) -> (Texel, [f32; 3]) {
    let (mut shown, mut free, mut exposed) = (0, 0, false);
    let (mut color, mut total) = ([0.0_f64; 3], 0.0);
    for view in seen {
        let Some(i) = view.pixel(point) else { continue };
        let from = view.camera.center - point;
        let cosine = from.dot(plane.normal) / from.length();
        if !(cosine.abs() >= LEAST_COSINE) {
            continue;
        }
        // Positive on the side of the camera.
        let height = |depth: f32| plane.height(view.point(i, depth)) * cosine.signum();
        let covered = view.thing[i] >= TOUCHED;
        let depth = if covered { view.after[i] } else { view.before[i] };
        let behind = depth == 0.0 || height(depth) < -plane.tolerance;
        let on_it = !behind && height(depth) <= plane.tolerance;
        match covered {
            true => exposed |= behind || on_it,
            false if behind => free += 1,
            false if on_it => {
                shown += 1;
                let weight = cosine.powi(4);
                total += weight;
                (0..3).for_each(|c| color[c] += weight * f64::from(view.rgb[c][i]));
            }
            false => {}
        }
    }
    let rgb = color.map(|c| if total > 0.0 { (c / total) as f32 } else { 0.0 });
    let state = match () {
        () if shown >= agree && shown >= free => Texel::Seen,
        () if free >= agree => Texel::Free,
        () if exposed => Texel::Hidden,
        () => Texel::Unknown,
    };
    (state, rgb)
}
