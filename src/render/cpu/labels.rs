//! Label of each pixel, and the weights of competing labels: sums of `alpha * transmittance` over the Gaussians that
//! carry them.

use std::ops::Range;

use super::view_weights::ViewWeights;
use super::walk::SLOTS;
use crate::math::lanes::{LANES, Lane, Lanes, Plain};
use crate::render::{ContributionSink, RenderError, TILE_PX};

/// Labels that compete for one pixel at most; the least is dropped.
pub(crate) const COMPETITORS: usize = 8;
/// Unknown label, a group of its own.
pub(crate) const UNKNOWN: u32 = u32::MAX;

/// The label that wins a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LabelWinner {
    /// Heaviest label of the heaviest group; 0 where less than half of the light is blocked.
    pub label: u32,
    /// Share of the pixel's weight that belongs to its group.
    pub share: f32,
    /// Weight of all labels.
    pub alpha: f32,
}

/// Labels of a pixel with their accumulated weights. Unused places have weight 0.
pub type PixelWeights = [(u32, f32); COMPETITORS];

/// The labels of largest weight at each pixel, row-major; `of` has a label for each Gaussian.
pub(crate) fn label_weights(view: &mut ViewWeights<'_>, of: &[u32]) -> Result<Vec<PixelWeights>, RenderError> {
    of_pixels(view, of, &|places| *places)
}

/// The label that wins each pixel, row-major: `of` has one for each Gaussian, `groups` the group of each label.
pub(crate) fn label_winners(
    view: &mut ViewWeights<'_>,
    (of, groups): (&[u32], &[u32]),
) -> Result<Vec<LabelWinner>, RenderError> {
    of_pixels(view, of, &|places| winner(places, groups))
}

/// Makes something of the competitors of each pixel, row-major.
fn of_pixels<T: Copy + Send, F: Fn(&PixelWeights) -> T + Sync>(
    view: &mut ViewWeights<'_>,
    of: &[u32],
    make: &F,
) -> Result<Vec<T>, RenderError> {
    let [width, height] = view.size_px();
    let row = |top: usize| LabelRow::new(of, make, width, top..height.min(top + TILE_PX));
    let mut rows: Vec<LabelRow<'_, T, F>> = (0..height).step_by(TILE_PX).map(row).collect();
    view.give(&mut rows)?;
    let mut pixels = Vec::with_capacity(width * height);
    for mut row in rows {
        row.finish_tile();
        pixels.append(&mut row.pixels);
    }
    Ok(pixels)
}

/// Winner of a pixel. `groups` has the group of each label; a missing one is 0, unlabeled, but for [`UNKNOWN`], which
/// is a group of its own.
pub(crate) fn winner(places: &PixelWeights, groups: &[u32]) -> LabelWinner {
    let alpha: f32 = places.iter().map(|p| p.1).sum();
    if alpha < 0.5 {
        return LabelWinner { alpha, ..LabelWinner::default() };
    }
    // Most pixels have one label.
    if places[1..].iter().all(|p| p.1 <= 0.0) {
        return LabelWinner { label: places[0].0, share: places[0].1 / alpha, alpha };
    }
    let group_of =
        |label: u32| if label == UNKNOWN { UNKNOWN } else { groups.get(label as usize).copied().unwrap_or(0) };
    let together = |group: u32| places.iter().filter(|p| group_of(p.0) == group).map(|p| p.1).sum::<f32>();
    let (mut best, mut most) = (0, 0.0);
    for place in places.iter().filter(|p| p.1 > 0.0) {
        let group = group_of(place.0);
        let sum = together(group);
        if sum > most {
            (best, most) = (group, sum);
        }
    }
    let inner = places.iter().filter(|p| p.1 > 0.0 && group_of(p.0) == best);
    let label = inner.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |p| p.0);
    LabelWinner { label, share: most / alpha, alpha }
}

/// Sums of the labels in one row of tiles, tile after tile. Each lane of a sum is a pixel, so that the weights of a label
/// are added front to back, eight pixels at a time.
struct LabelRow<'a, T, F> {
    of: &'a [u32],
    make: &'a F,
    width: usize,
    /// Rows of pixels.
    span: Range<usize>,
    /// The finished pixels.
    pixels: Vec<T>,
    /// Column of the tile whose labels are summed.
    column: usize,
    gaussian: u32,
    /// Number of that Gaussian's label in the tile.
    seat: usize,
    /// Labels of the tile.
    labels: Vec<u32>,
    /// Their sums by slot; 0 where a label is no competitor. 1 KiB each.
    sums: Vec<[Lane<f32>; SLOTS]>,
    /// Competitors of each pixel by their number in the tile, in the order in which they came, and how many there are.
    places: [[u32; COMPETITORS]; SLOTS * LANES],
    taken: [u8; SLOTS * LANES],
}

impl<'a, T: Copy, F: Fn(&PixelWeights) -> T> LabelRow<'a, T, F> {
    fn new(of: &'a [u32], make: &'a F, width: usize, span: Range<usize>) -> Self {
        Self {
            of,
            make,
            width,
            pixels: vec![make(&[(0, 0.0); COMPETITORS]); width * span.len()],
            span,
            column: 0,
            gaussian: u32::MAX,
            seat: 0,
            labels: Vec::new(),
            sums: Vec::new(),
            places: [[0; COMPETITORS]; SLOTS * LANES],
            taken: [0; SLOTS * LANES],
        }
    }

    /// Number of a label in the tile.
    fn seat_of(&mut self, label: u32) -> usize {
        if let Some(seat) = self.labels.iter().position(|l| *l == label) {
            return seat;
        }
        let seat = self.labels.len();
        self.labels.push(label);
        match self.sums.get_mut(seat) {
            Some(sums) => *sums = [[0.0; LANES]; SLOTS],
            None => self.sums.push([[0.0; LANES]; SLOTS]),
        }
        seat
    }

    /// Makes the label in turn a competitor of the `new` pixels of a slot, one bit each. Returns the weights that count:
    /// the lightest competitor of many gives way to a heavier one only.
    #[inline(never)]
    fn enter(&mut self, slot: usize, new: u32, mut weights: Lane<f32>) -> Lane<f32> {
        for lane in (0..LANES).filter(|lane| new >> lane & 1 == 1) {
            let (places, taken) = (&mut self.places[slot * LANES + lane], &mut self.taken[slot * LANES + lane]);
            if usize::from(*taken) < COMPETITORS {
                places[usize::from(*taken)] = self.seat as u32;
                *taken += 1;
                continue;
            }
            let sums = &mut self.sums;
            let weight = |seat: &u32| sums[*seat as usize][slot][lane];
            let least = places.iter_mut().min_by(|a, b| weight(a).total_cmp(&weight(b)));
            match least.filter(|seat| weight(seat) < weights[lane]) {
                Some(seat) => {
                    sums[*seat as usize][slot][lane] = 0.0;
                    *seat = self.seat as u32;
                }
                None => weights[lane] = 0.0,
            }
        }
        weights
    }

    /// Finishes the pixels of the tile.
    fn finish_tile(&mut self) {
        if self.labels.is_empty() {
            return;
        }
        let left = self.column * TILE_PX;
        for row in 0..self.span.len() {
            for x in 0..TILE_PX.min(self.width - left) {
                let (slot, lane) = (x / LANES * TILE_PX + row, x % LANES);
                let pixel = slot * LANES + lane;
                let mut weights: PixelWeights = [(0, 0.0); COMPETITORS];
                let taken = &self.places[pixel][..usize::from(self.taken[pixel])];
                for (weight, seat) in weights.iter_mut().zip(taken) {
                    *weight = (self.labels[*seat as usize], self.sums[*seat as usize][slot][lane]);
                }
                self.pixels[row * self.width + left + x] = (self.make)(&weights);
            }
        }
        self.labels.clear();
        self.taken.fill(0);
        self.gaussian = u32::MAX;
    }
}

impl<T: Copy + Send, F: Fn(&PixelWeights) -> T + Sync> ContributionSink<f32> for LabelRow<'_, T, F> {
    fn add(&mut self, gaussian: u32, x: usize, y: usize, weights: &Lane<f32>) {
        self.add_lanes(Plain, gaussian, x, y, *weights);
    }

    #[inline(always)]
    fn add_lanes<L: Lanes<f32>>(&mut self, l: L, gaussian: u32, x: usize, y: usize, weights: L::V) {
        if x / TILE_PX != self.column {
            self.finish_tile();
            self.column = x / TILE_PX;
        }
        if gaussian != self.gaussian {
            self.gaussian = gaussian;
            self.seat = self.seat_of(self.of[gaussian as usize]);
        }
        let slot = x % TILE_PX / LANES * TILE_PX + (y - self.span.start);
        let (sum, zero) = (l.load(&self.sums[self.seat][slot]), l.splat(0.0));
        let new = l.bits(l.both(l.ge(zero, sum), l.gt(weights, zero)));
        let weights = if new == 0 { weights } else { l.load(&self.enter(slot, new, l.store(weights))) };
        self.sums[self.seat][slot] = l.store(l.add(sum, weights));
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::render::RenderSettings;
    use crate::render::cpu::CpuRenderer;
    use crate::scene::{Camera, GaussianCloud};

    /// A pixel with these places taken.
    fn pixel(taken: &[(u32, f32)]) -> PixelWeights {
        std::array::from_fn(|k| taken.get(k).copied().unwrap_or_default())
    }

    #[test]
    fn the_group_wins_before_its_label() {
        let groups = [0, 1, 2, 1, 1];
        let three = winner(&pixel(&[(3, 0.25), (4, 0.2), (2, 0.4)]), &groups);
        assert_eq!(three.label, 3);
        assert!((three.share - 0.45 / 0.85).abs() < 1e-6 && (three.alpha - 0.85).abs() < 1e-6);
        assert_eq!(winner(&pixel(&[(3, 0.25), (4, 0.2), (UNKNOWN, 0.5)]), &groups).label, UNKNOWN);
        assert_eq!(winner(&[(1, 0.05); COMPETITORS], &groups).label, 0, "mostly see-through");
    }

    #[test]
    fn of_two_that_are_equal_the_first_wins() {
        let groups = [0, 1, 2];
        let half = winner(&pixel(&[(2, 0.25), (1, 0.25)]), &groups);
        assert_eq!(half, LabelWinner { label: 2, share: 0.5, alpha: 0.5 }, "half of the light is enough");
        assert_eq!(winner(&pixel(&[(2, 0.25), (1, 0.24)]), &groups).label, 0);
        let found = winner(&pixel(&[(99, 0.6), (1, 0.3)]), &groups);
        assert!(found.label == 99 && (found.share - 0.6 / 0.9).abs() < 1e-6, "a label without a group is nobody's");
        assert_eq!(winner(&pixel(&[]), &groups), LabelWinner::default());
    }

    /// Competitors of one row of pixels, added up one after the other.
    struct Reference<'a> {
        of: &'a [u32],
        width: usize,
        top: usize,
        pixels: Vec<PixelWeights>,
    }

    impl ContributionSink<f32> for Reference<'_> {
        fn add(&mut self, gaussian: u32, x: usize, y: usize, weights: &Lane<f32>) {
            let label = self.of[gaussian as usize];
            let first = (y - self.top) * self.width + x;
            let end = weights.len().min(self.width - x);
            for (places, &weight) in self.pixels[first..first + end].iter_mut().zip(weights).filter(|p| *p.1 > 0.0) {
                // Free places have no weight.
                match places.iter_mut().find(|p| p.0 == label && p.1 > 0.0) {
                    Some(place) => place.1 += weight,
                    None => {
                        let least = places.iter_mut().min_by(|a, b| a.1.total_cmp(&b.1));
                        least.filter(|p| p.1 < weight).into_iter().for_each(|least| *least = (label, weight));
                    }
                }
            }
        }
    }

    fn reference(cloud: &GaussianCloud, of: &[u32], camera: &Camera) -> Vec<PixelWeights> {
        let (width, height) = (camera.width_px as usize, camera.height_px as usize);
        let row = |top: usize| Reference {
            of,
            width,
            top,
            pixels: vec![[(0, 0.0); COMPETITORS]; TILE_PX.min(height - top) * width],
        };
        let mut rows: Vec<Reference<'_>> = (0..height).step_by(TILE_PX).map(row).collect();
        let mut renderer = CpuRenderer::forward_only();
        renderer.contributions(cloud, camera, &RenderSettings::default(), &mut rows).expect("drawn");
        rows.into_iter().flat_map(|r| r.pixels).collect()
    }

    #[test]
    fn sums_of_eight_pixels_are_those_of_each() {
        let mut random = 5_u32;
        let mut next = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 8) as f32 / (1 << 24) as f32
        };
        let places = (0..600).map(|_| [next() * 2.0 - 1.0, next() * 2.0 - 1.0, next()]).collect();
        let cloud = GaussianCloud::isotropic(places, -2.2, -1.5);
        let from = |x: f64| {
            let camera = Camera::look_at(DVec3::new(x, 0.2, -3.0), DVec3::ZERO, DVec3::NEG_Y, 0.7, 45, 37);
            camera.expect("valid")
        };
        let settings = RenderSettings::default();
        let mut renderer = CpuRenderer::forward_only();
        // Two labels and none, and so many that a pixel cannot keep them all.
        for labels in [3, 40] {
            let of: Vec<u32> = (0..600).map(|i| if i % labels == 2 { UNKNOWN } else { i * 7 % labels }).collect();
            let expected = reference(&cloud, &of, &from(0.0));
            let most = expected.iter().map(|p| p.iter().filter(|p| p.1 > 0.0).count()).max();
            assert_eq!(most, Some(COMPETITORS.min(labels as usize)));
            let (camera, apart) = (from(0.0), from(0.3));
            let mut view = ViewWeights::drawn(&mut renderer, &cloud, &camera, &settings, false);
            let found = label_weights(&mut view, &of).expect("drawn");
            assert!(found == expected, "{labels} labels, bit by bit");
            let groups: Vec<u32> = (0..labels).map(|label| label % 5).collect();
            let winners = label_winners(&mut view, (&of, &groups)).expect("drawn again");
            assert_eq!(winners, expected.iter().map(|p| winner(p, &groups)).collect::<Vec<_>>());
            let mut view = ViewWeights::drawn(&mut renderer, &cloud, &apart, &settings, false);
            let other = label_weights(&mut view, &of).expect("drawn");
            assert!(other != expected, "the control, of another camera");
        }
    }

    #[test]
    fn a_pixel_keeps_the_heaviest_of_many() {
        let of: Vec<u32> = (1..=10).collect();
        let keep = |places: &PixelWeights| *places;
        let mut row = LabelRow::new(&of, &keep, 12, 4..6);
        let only = |lane: usize, w: f32| -> Lane<f32> { std::array::from_fn(|l| if l == lane { w } else { 0.0 }) };
        // Ten labels, ever heavier, for the pixel at column 9 of row 5; the first twice.
        (0..10).for_each(|g| row.add(g, 8, 5, &only(1, 0.01 * (g + 1) as f32)));
        row.add(9, 8, 5, &only(1, 0.5));
        row.add(0, 8, 5, &only(1, 0.005));
        row.finish_tile();
        let at = row.pixels[12 + 9];
        assert!(at.iter().any(|p| p.0 == 10 && (p.1 - 0.6).abs() < 1e-6), "{at:?}");
        let mut labels: Vec<u32> = at.iter().map(|p| p.0).collect();
        labels.sort_unstable();
        assert_eq!(labels, [3, 4, 5, 6, 7, 8, 9, 10], "the two lightest were dropped, and do not come back");
        assert!(row.pixels.iter().enumerate().all(|(i, p)| i == 21 || p.iter().all(|p| p.1 == 0.0)));
        // Weights beyond the right edge are not the next row's.
        let mut row = LabelRow::new(&of, &keep, 12, 4..6);
        row.add(0, 8, 4, &[1.0; 8]);
        row.finish_tile();
        let reached: Vec<usize> = (0..24).filter(|i| row.pixels[*i].iter().any(|p| p.0 == 1)).collect();
        assert_eq!(reached, [8, 9, 10, 11]);
    }
}
