//! Masks of everything in a picture, as the official mask generators find them: a grid of points on the picture and
//! on crops of it. Masks are kept that have a high predicted IoU, are stable, and are not duplicates.

use rayon::prelude::*;

use super::grid_points::GridPoints;
use super::{Prompted, PromptedMasks, in_square};
use crate::math::grid::regions;
use crate::models::ModelError;
use crate::models::preprocess::{FitSide, enlarge};
use crate::models::tensor::Tensor;
use crate::scene::{Mask, PhotoPixels};

/// Settings; the defaults are LangSplat's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AutomaticOptions {
    /// Points along a side of the grid.
    pub points_per_side: usize,
    /// Points in one batch of the network.
    pub batch: usize,
    /// Least predicted IoU; 0 = any.
    pub predicted_iou: f32,
    /// Least stability: IoU of the masks at logits of 1 and of -1; 0 = any.
    pub stability: f32,
    /// IoU of boxes above which the worse of two masks is left out.
    pub box_nms: f64,
    /// Layers of crops besides the whole picture.
    pub crop_layers: u32,
    /// Points along a side of the grid are divided by this once per layer.
    pub crop_point_divisor: usize,
    /// IoU of boxes above which masks of larger crops are left out.
    pub crop_nms: f64,
    /// Holes and islands smaller than this are filled and removed; 0 = none. In px of the picture
    /// for SAM, of the low-resolution masks for SAM 2.
    pub least_region_px: usize,
    /// True if points are skipped between others that lie in one mask with them; the official generators prompt all.
    pub adaptive: bool,
}

impl Default for AutomaticOptions {
    fn default() -> Self {
        Self {
            points_per_side: 32,
            batch: 16,
            predicted_iou: 0.7,
            stability: 0.85,
            box_nms: 0.7,
            crop_layers: 1,
            crop_point_divisor: 1,
            crop_nms: 0.7,
            least_region_px: 100,
            adaptive: false,
        }
    }
}

/// Shift of the threshold in the measure of stability, logits.
const OFFSET: f32 = 1.0;
/// Distance to a crop's edge within which a box counts as cut off by it, px.
const EDGE_PX: f64 = 20.0;
/// Overlap of crops, as a share of the shorter side.
const CROP_OVERLAP: f64 = 512.0 / 1500.0;

/// Mask that was found in the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct AutomaticMask {
    /// Pixels.
    pub mask: Mask,
    /// Left, top, right and bottom pixel.
    pub bounds: [f64; 4],
    /// Predicted IoU.
    pub predicted_iou: f32,
    /// Stability against shifts of the threshold, 0 to 1.
    pub stability: f32,
    /// Point prompt that found it, px.
    pub point: [f64; 2],
    /// Crop in which it was found: left, top, right, bottom.
    pub(crate) crop: [usize; 4],
}

/// Returns the crops of a picture with their layers: the whole picture, then the crops of each layer.
pub fn crops(width: usize, height: usize, layers: u32) -> Vec<([usize; 4], u32)> {
    let mut boxes = vec![([0, 0, width, height], 0)];
    for layer in 1..=layers {
        let side = 1_usize << layer;
        let shared = (CROP_OVERLAP * width.min(height) as f64 * (2.0 / side as f64)) as usize;
        let of = |size: usize| (shared * (side - 1) + size).div_ceil(side);
        let (w, h) = (of(width), of(height));
        for i in 0..side {
            for j in 0..side {
                let (x, y) = (i * (w - shared), j * (h - shared));
                boxes.push(([x, y, (x + w).min(width), (y + h).min(height)], layer));
            }
        }
    }
    boxes
}

/// Finds the masks of everything in a picture, best first. `go_on` receives the fraction done and returns false to
/// stop; the masks found until then are returned.
pub fn everything(
    network: &mut dyn PromptedMasks,
    picture: &PhotoPixels,
    options: &AutomaticOptions,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<Vec<AutomaticMask>, ModelError> {
    let size = (picture.width_px as usize, picture.height_px as usize);
    let boxes = crops(size.0, size.1, options.crop_layers);
    let (side, fit) = (network.side_px(), network.fit());
    let mut collector = MaskCollector { size, side, fit, options, found: Vec::new() };
    for (done, (crop, layer)) in boxes.iter().enumerate() {
        let (w, h) = (crop[2] - crop[0], crop[3] - crop[1]);
        let share = |of_crop: f64| (done as f64 + of_crop) / boxes.len() as f64;
        if !go_on(share(0.0)) {
            break;
        }
        network.look(&cut(picture, crop))?;
        let per_side = (options.points_per_side / options.crop_point_divisor.max(1).pow(*layer)).max(1);
        let scale = in_square(network, [w, h]);
        let at_px = |[x, y]: [f64; 2]| [x * w as f64 + crop[0] as f64, y * h as f64 + crop[1] as f64];
        let mut points = GridPoints::new(per_side);
        let (mut of_crop, mut asked) = (Vec::new(), 0);
        for stage in points.stages(options.adaptive) {
            let holds = |i: usize, at| {
                let [x, y] = at_px(at);
                let mask: &AutomaticMask = &of_crop[i];
                mask.mask.contains(y as usize * size.0 + x as usize)
            };
            let open: Vec<usize> = stage.into_iter().filter(|k| !points.is_known(*k, &holds)).collect();
            for batch in open.chunks(options.batch.max(1)) {
                if !go_on(share(asked as f64 / points.len() as f64)) {
                    collector.keep(of_crop);
                    return Ok(collector.finish(boxes.len() > 1));
                }
                asked += batch.len();
                // The point, and a padding point (label -1) that marks the absence of a box.
                let coords = batch.iter().map(|k| points.at(*k));
                let coords = coords
                    .flat_map(|[x, y]| [(x * w as f64 * scale[0]) as f32, (y * h as f64 * scale[1]) as f32, 0.0, 0.0]);
                let n = batch.len();
                let coords = Tensor::new(&[n, 2, 2], coords.collect());
                let labels = Tensor::new(&[n, 2], [1.0, -1.0].repeat(n));
                let answer = network.masks(coords, labels, None)?;
                let answers: Vec<PointMasks<'_>> =
                    batch.iter().enumerate().map(|(p, k)| answer.of(p, at_px(points.at(*k)))).collect();
                for (k, found) in batch.iter().zip(collector.judge(&answers, *crop)) {
                    points.answer(*k, of_crop.len(), found.iter().map(|f| f.mask.area()));
                    of_crop.extend(found);
                }
            }
        }
        collector.keep(of_crop);
    }
    Ok(collector.finish(boxes.len() > 1))
}

impl Prompted {
    /// Returns the three masks of a point as an ambiguous prompt; `at_px` is its position in the picture.
    fn of(&self, point: usize, at_px: [f64; 2]) -> PointMasks<'_> {
        let (low, first) = (self.masks.shape[3], 4 * point + 1);
        let plane = |j: usize| &self.masks.values[(first + j) * low * low..(first + j + 1) * low * low];
        (std::array::from_fn(plane), std::array::from_fn(|j| self.iou.values[first + j]), at_px)
    }
}

/// Three planes of logits of a point, their predicted IoU, and the point, px.
pub type PointMasks<'a> = ([&'a [f32]; 3], [f32; 3], [f64; 2]);

/// Collects the masks that pass the thresholds.
pub struct MaskCollector<'a> {
    /// Size of the picture, px.
    pub size: (usize, usize),
    /// Side of the network's square, px.
    pub side: usize,
    /// Fit of the picture in that square.
    pub fit: FitSide,
    /// Settings.
    pub options: &'a AutomaticOptions,
    /// Masks so far.
    pub found: Vec<AutomaticMask>,
}

impl MaskCollector<'_> {
    /// Returns the masks of each point of a crop that pass the thresholds.
    pub fn judge(&self, answers: &[PointMasks<'_>], crop: [usize; 4]) -> Vec<Vec<AutomaticMask>> {
        let of_point = |(planes, iou, point): &PointMasks<'_>| {
            planes.iter().zip(iou).filter_map(|(plane, iou)| self.judge_one(plane, *iou, *point, crop)).collect()
        };
        answers.par_iter().map(of_point).collect()
    }

    /// Adds the masks of a crop, without duplicates of better ones there.
    pub fn keep(&mut self, found: Vec<AutomaticMask>) {
        let boxes: Vec<[f64; 4]> = found.iter().map(|f| f.bounds).collect();
        let scores: Vec<f32> = found.iter().map(|f| f.predicted_iou).collect();
        let kept = suppress(&boxes, &scores, self.options.box_nms);
        self.found.extend(kept.into_iter().map(|i| found[i].clone()));
    }

    fn judge_one(&self, plane: &[f32], iou: f32, point: [f64; 2], crop: [usize; 4]) -> Option<AutomaticMask> {
        let options = self.options;
        if options.predicted_iou > 0.0 && !(iou > options.predicted_iou) {
            return None;
        }
        let low = plane.len().isqrt();
        let (w, h) = (crop[2] - crop[0], crop[3] - crop[1]);
        // SAM 2 cleans the low-resolution mask, SAM the enlarged one.
        let full = if self.fit == FitSide::Longer || options.least_region_px == 0 {
            enlarge(plane, low, self.side, self.fit, (w, h))
        } else {
            enlarge(&cleaned_logits(plane, low, options.least_region_px), low, self.side, self.fit, (w, h))
        };
        let above = |threshold: f32| full.iter().filter(|v| **v > threshold).count();
        let (inner, outer) = (above(OFFSET), above(-OFFSET));
        let stability = inner as f32 / outer as f32;
        if options.stability > 0.0 && !(stability >= options.stability) {
            return None;
        }
        let inside = Mask::from_fn(w, h, |i| full[i] > 0.0);
        let [x0, y0] = [crop[0], crop[1]];
        let [l, t, r, b] = corners(&inside);
        let bounds = [l + x0 as f64, t + y0 as f64, r + x0 as f64, b + y0 as f64];
        let ends = [0, 0, self.size.0, self.size.1];
        // A box at an edge of the crop that is no edge of the picture is cut off.
        let cut_off =
            |k: usize| (bounds[k] - crop[k] as f64).abs() <= EDGE_PX && (bounds[k] - ends[k] as f64).abs() > EDGE_PX;
        if (0..4).any(cut_off) {
            return None;
        }
        let mut mask = Mask::empty(self.size.0, self.size.1);
        inside.pixels().for_each(|i| mask.insert((y0 + i / w) * self.size.0 + x0 + i % w));
        Some(AutomaticMask { mask, bounds, predicted_iou: iou, stability, point, crop })
    }

    /// Returns the masks after suppressing duplicates between crops and cleaning small regions.
    pub fn finish(self, with_crops: bool) -> Vec<AutomaticMask> {
        let Self { options, mut found, fit, .. } = self;
        let boxes = |found: &[AutomaticMask]| found.iter().map(|f| f.bounds).collect::<Vec<_>>();
        if with_crops {
            // Smaller crops show more detail.
            let area = |f: &AutomaticMask| ((f.crop[2] - f.crop[0]) * (f.crop[3] - f.crop[1])) as f32;
            let scores: Vec<f32> = found.iter().map(|f| 1.0 / area(f)).collect();
            found = suppress(&boxes(&found), &scores, options.crop_nms).into_iter().map(|i| found[i].clone()).collect();
        }
        if fit == FitSide::Longer && options.least_region_px > 0 {
            let mut untouched = Vec::with_capacity(found.len());
            for f in &mut found {
                let (filled, changed) = cleaned(&f.mask, options.least_region_px, true);
                let (removed, changed_again) = cleaned(&filled, options.least_region_px, false);
                f.bounds = corners(&removed);
                f.mask = removed;
                untouched.push(if changed || changed_again { 0.0 } else { 1.0 });
            }
            let threshold = options.box_nms.max(options.crop_nms);
            found = suppress(&boxes(&found), &untouched, threshold).into_iter().map(|i| found[i].clone()).collect();
        }
        found
    }
}

/// Left, top, right and bottom pixel of a mask; zeros for an empty one.
fn corners(mask: &Mask) -> [f64; 4] {
    mask.bounds().map_or([0.0; 4], |b| [b.x.start, b.y.start, b.x.end - 1, b.y.end - 1].map(|v| v as f64))
}

/// Non-maximum suppression: indices of the boxes whose IoU with no better one exceeds `threshold`, best first (equal
/// ones in their order).
fn suppress(boxes: &[[f64; 4]], scores: &[f32], threshold: f64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..boxes.len()).collect();
    order.sort_by(|&a, &b| scores[b].total_cmp(&scores[a]));
    let area = |b: &[f64; 4]| (b[2] - b[0]) * (b[3] - b[1]);
    let overlap = |a: &[f64; 4], b: &[f64; 4]| {
        let both = (a[2].min(b[2]) - a[0].max(b[0])).max(0.0) * (a[3].min(b[3]) - a[1].max(b[1])).max(0.0);
        let all = area(a) + area(b) - both;
        if all > 0.0 { both / all } else { 0.0 }
    };
    let mut kept: Vec<usize> = Vec::new();
    for i in order {
        if kept.iter().all(|&j| !(overlap(&boxes[i], &boxes[j]) > threshold)) {
            kept.push(i);
        }
    }
    kept
}

/// Fills small holes of a mask, or removes its small islands, and returns whether anything changed. The largest
/// island stays, however small.
fn cleaned(mask: &Mask, least: usize, holes: bool) -> (Mask, bool) {
    let (w, h) = (mask.width_px(), mask.height_px());
    let (label, areas) = regions(w, w * h, |i| mask.contains(i) != holes);
    if areas.iter().all(|a| *a >= least) {
        return (mask.clone(), false);
    }
    // `max_by_key` returns the last of equals; reversed, it is the first.
    let largest = (0..areas.len()).rev().max_by_key(|k| areas[*k]);
    let any_large = areas.iter().any(|a| *a >= least);
    let stays = |k: usize| areas[k] >= least || (!holes && !any_large && Some(k) == largest);
    let inside = |i: usize| match (label[i], holes) {
        (0, holes) => holes,
        (k, true) => !stays(k as usize - 1),
        (k, false) => stays(k as usize - 1),
    };
    (Mask::from_fn(w, h, inside), true)
}

/// Fills holes of at most `most` px in a plane of logits, and removes islands of at most that size.
fn cleaned_logits(plane: &[f32], low: usize, most: usize) -> Vec<f32> {
    let mut out = plane.to_vec();
    for (background, value) in [(true, 10.0), (false, -10.0)] {
        let (label, areas) = regions(low, plane.len(), |i| (plane[i] <= 0.0) == background);
        for (v, label) in out.iter_mut().zip(label) {
            if label > 0 && areas[label as usize - 1] <= most {
                *v = value;
            }
        }
    }
    out
}

fn cut(picture: &PhotoPixels, crop: &[usize; 4]) -> PhotoPixels {
    let [x0, y0, x1, y1] = *crop;
    let rows = picture.rgb.chunks_exact((picture.width_px as usize).max(1)).skip(y0).take(y1 - y0);
    let rgb = rows.flat_map(|row| row[x0..x1].iter().copied()).collect();
    PhotoPixels { width_px: (x1 - x0) as u32, height_px: (y1 - y0) as u32, rgb, coverage: None, alpha: None }
}
