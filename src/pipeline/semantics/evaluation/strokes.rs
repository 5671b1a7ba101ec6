//! `strokes`: a simulated user points at a thing in the view that shows most of it and corrects the selection there
//! with a second and a third stroke; all other views are scored. `corrections`: a simulated user corrects the known
//! Gaussians of a thing by three strokes, each in the view with most errors; all views are scored, and all other things.

use std::collections::VecDeque;

use super::LabeledPhoto;
use super::known_things::{KnownThings, NamedThings, WorstOther};
use crate::math::grid::{neighbors, regions};
use crate::pipeline::semantics::lifting::splat_tree::hierarchy::Hierarchy;
use crate::pipeline::semantics::lifting::splat_tree::marks::{Stroke, StrokeMarks};
use crate::pipeline::semantics::lifting::splat_tree::others::OtherIdentities;
use crate::pipeline::semantics::query::timing::ms_since;
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::{DrawError, RenderSettings, Renderer};
use crate::scene::{GaussianCloud, Identities, IdentityId, Level, Mask, SemanticMap};

/// Strokes for each thing.
pub(crate) const STROKES: usize = 3;
/// Half of a stroke's width, px.
const RADIUS_PX: usize = 3;
/// Least share of a thing that is wrong in one piece for a correction.
const SEEN: f64 = 0.02;
/// Least number of pixels of a thing for a test.
const LEAST_PX: usize = 60;

/// A thing with the scores of its selection.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub(crate) struct StrokeRow {
    pub(crate) name: String,
    pub(crate) level: Level,
    /// Name of the view of the first stroke.
    pub(crate) drawn_in: String,
    /// Number of views that it is scored in.
    pub(crate) views: usize,
    /// Mean IoU in them, before any stroke and after each.
    pub(crate) iou: [f64; STROKES + 1],
    /// Milliseconds from each stroke to the selected Gaussians.
    pub(crate) ms: [f64; STROKES],
    /// Largest loss of another thing by each stroke; empty if none is known.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) others: Vec<WorstOther>,
    /// Number of Gaussians that each stroke left to other identities, as it did not touch them.
    pub(crate) left: [usize; STROKES],
    /// True for each stroke that changed only what is along it.
    pub(crate) along: [bool; STROKES],
}

/// Selects every named thing of the views; with `known`, corrects the known Gaussians of its name.
pub(crate) fn rows(
    hierarchy: &Hierarchy,
    cloud: &GaussianCloud,
    settings: &RenderSettings,
    views: &[LabeledPhoto],
    known: Option<&SemanticMap>,
) -> Result<Vec<StrokeRow>, DrawError> {
    let mut things = NamedThings::new();
    for (k, view) in views.iter().enumerate() {
        let large = view.categories.iter().filter(|c| c.mask.area() >= LEAST_PX);
        large.for_each(|c| things.entry(&c.name).or_default().push((k, c)));
    }
    let mut renderer = Renderer::new();
    let mut watch = known.map(|map| KnownThings::new(map, (cloud, settings), (views, &things))).transpose()?;
    let mut rows = Vec::new();
    for (name, seen) in things.iter().filter(|(_, seen)| seen.len() > 1) {
        let mut draw = |selected: &[bool], k: usize| -> Result<Mask, DrawError> {
            let all = Identities::objects(1);
            let of: Vec<IdentityId> = selected.iter().map(|s| IdentityId::from(*s)).collect();
            Ok(ViewMap::render(&mut renderer, cloud, &of, &all, &views[k].camera, settings)?.mask(&all, 1))
        };
        watch.iter_mut().for_each(KnownThings::restart);
        let own = watch.as_ref().and_then(|watch| watch.find(name));
        let from = own.map_or_else(Vec::new, |(map, id)| map.members(id));
        let others = own.map_or_else(OtherIdentities::default, |(map, id)| OtherIdentities::new(map, id));
        let (mut marks, mut selected) = (StrokeMarks::default(), vec![false; cloud.len()]);
        from.iter().for_each(|&i| selected[i] = true);
        let mut row: Option<StrokeRow> = None;
        for k in 0..=STROKES {
            let drawn: Vec<Mask> = seen.iter().map(|(view, _)| draw(&selected, *view)).collect::<Result<_, _>>()?;
            let wrong = |at: usize| {
                let (now, truth) = (&drawn[at], &seen[at].1.mask);
                now.area() + truth.area() - 2 * now.overlap(truth)
            };
            let worst = (0..seen.len()).rev().max_by_key(|at| wrong(*at)).unwrap_or(0);
            let row = row.get_or_insert_with(|| StrokeRow {
                name: (*name).to_owned(),
                level: seen[0].1.level,
                drawn_in: views[seen[worst].0].name.clone(),
                views: seen.len() - usize::from(known.is_none()),
                iou: [0.0; STROKES + 1],
                ms: [0.0; STROKES],
                others: known.map_or_else(Vec::new, |_| vec![WorstOther::default(); STROKES]),
                left: [0; STROKES],
                along: [false; STROKES],
            });
            // A selection is corrected where it was begun.
            let begun = seen.iter().position(|(view, _)| views[*view].name == row.drawn_in).unwrap_or(0);
            let at = if known.is_none() { begun } else { worst };
            let judged = (0..seen.len()).filter(|i| known.is_some() || *i != begun);
            row.iou[k] = judged.map(|i| drawn[i].iou(&seen[i].1.mask)).sum::<f64>() / row.views as f64;
            let (view, truth) = seen[at];
            let stroke = correction(&truth.mask, &drawn[at]).filter(|_| k < STROKES);
            let Some((pixels, is_plus)) = stroke else { continue };
            let start = std::time::Instant::now();
            let stroke = Stroke { camera: views[view].camera.clone(), pixels, is_plus };
            marks.add(&mut Renderer::new(), cloud, settings, &stroke)?;
            let found = match known {
                Some(_) => hierarchy.correct(&marks, &from, &others),
                None => hierarchy.select(&marks, &from),
            };
            selected = found.is_in;
            row.ms[k] = ms_since(start);
            row.left[k] = found.effect.others.iter().filter(|c| c.is_left).map(|c| c.gaussians).sum();
            row.along[k] = found.effect.is_along;
            if let Some(watch) = &mut watch {
                row.others[k] = watch.worst_other(name, &selected)?;
            }
        }
        rows.extend(row);
    }
    Ok(rows)
}

/// Returns the stroke of a user who sees `now` and means `truth`: through the largest wrong region.
fn correction(truth: &Mask, now: &Mask) -> Option<(Mask, bool)> {
    let largest = |a: &Mask, b: &Mask| {
        let mut wrong = a.clone();
        wrong.subtract(b);
        let (w, n) = (wrong.width_px(), wrong.width_px() * wrong.height_px());
        let (label, areas) = regions(w, n, |i| wrong.contains(i));
        let (number, area) = (1..).zip(areas).max_by_key(|(_, area)| *area)?;
        Some((Mask::from_fn(w, wrong.height_px(), |i| label[i] == number), area))
    };
    let (missing, extra) = (largest(truth, now), largest(now, truth));
    let is_plus = missing.as_ref().map_or(0, |m| m.1) >= extra.as_ref().map_or(0, |e| e.1);
    let (region, area) = if is_plus { missing? } else { extra? };
    if (area as f64) < SEEN * truth.area() as f64 {
        return None;
    }
    Some((stroke_through(&region), is_plus))
}

/// Returns a stroke from the middle of a region to its far end, away from its borders.
fn stroke_through(region: &Mask) -> Mask {
    let (w, h) = (region.width_px(), region.height_px());
    let depth = walk(w, h, |i| !region.contains(i) || is_rim(i, w, h), |_| true);
    let depth: Vec<u32> = depth.into_iter().map(|(far, _)| far).collect();
    let inside = |i: &usize| region.contains(*i);
    let Some(middle) = (0..w * h).filter(inside).max_by_key(|&i| (depth[i], usize::MAX - i)) else {
        return region.clone();
    };
    let deep = |i: usize| region.contains(i) && 2 * depth[i] >= depth[middle];
    let way = walk(w, h, |i| i == middle, deep);
    let end = (0..w * h).filter(|&i| deep(i) && way[i].0 != u32::MAX).max_by_key(|&i| (way[i].0, usize::MAX - i));
    let mut stroke = Mask::empty(w, h);
    let mut at = end.unwrap_or(middle);
    loop {
        let r = RADIUS_PX.min(depth[at].saturating_sub(1) as usize);
        let (x, y) = (at % w, at / w);
        for y in y.saturating_sub(r)..(y + r + 1).min(h) {
            (x.saturating_sub(r)..(x + r + 1).min(w)).for_each(|x| stroke.insert(y * w + x));
        }
        if at == middle {
            stroke.intersect(region);
            return stroke;
        }
        at = way[at].1;
    }
}

fn is_rim(i: usize, w: usize, h: usize) -> bool {
    i % w == 0 || i % w + 1 == w || i / w == 0 || i / w + 1 == h
}

/// Returns, for each pixel, the steps from the nearest `start` over `open` pixels, and the previous pixel on that
/// path.
fn walk(w: usize, h: usize, start: impl Fn(usize) -> bool, open: impl Fn(usize) -> bool) -> Vec<(u32, usize)> {
    let mut way = vec![(u32::MAX, usize::MAX); w * h];
    let mut next: VecDeque<usize> = (0..w * h).filter(|&i| start(i)).collect();
    next.iter().for_each(|&i| way[i] = (0, i));
    while let Some(i) = next.pop_front() {
        for j in neighbors(i, w, w * h).filter(|&j| open(j)) {
            if way[j].0 == u32::MAX {
                way[j] = (way[i].0 + 1, i);
                next.push_back(j);
            }
        }
    }
    way
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stroke_goes_through_the_middle_of_what_is_wrong() {
        let (w, h) = (60, 40);
        let bar = |i: usize| (10..50).contains(&(i % w)) && (15..25).contains(&(i / w));
        let truth = Mask::from_fn(w, h, bar);
        let (stroke, is_plus) = correction(&truth, &Mask::empty(w, h)).expect("everything is missing");
        assert!(is_plus && stroke.overlap(&truth) == stroke.area());
        let bounds = stroke.bounds().expect("a line");
        assert!(bounds.x.end - bounds.x.start >= 15 && bounds.y.end - bounds.y.start <= 10, "{bounds:?}");
        // Half of it is there, and something else that is larger than what is missing.
        let now = Mask::from_fn(w, h, |i| bar(i) && i % w < 45 || i / w < 10);
        let (stroke, is_plus) = correction(&truth, &now).expect("something is wrong");
        assert!(!is_plus && stroke.bounds().expect("a line").y.end <= 10);
        assert_eq!(correction(&truth, &truth), None);
    }
}
