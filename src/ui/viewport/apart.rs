//! Places for what would else be drawn over each other: each near its own thing, moved aside where it covers another.

use egui::{Pos2, Rect, Vec2};

/// Directions in which something is moved.
const DIRECTIONS: usize = 12;
/// Rings of places around a thing that are tried.
pub(super) const RINGS: usize = 6;

/// Places near the wanted ones, each the nearest that is free. `is_free` tells whether the one of a number may be drawn
/// at a place, beside those that were placed before it. The places in the area of a number lie `steps` apart.
pub(super) fn apart(
    wanted: &[Pos2],
    area: impl Fn(usize) -> Rect,
    steps: Vec2,
    is_free: impl Fn(usize, Pos2, &[Pos2]) -> bool,
) -> Vec<Pos2> {
    let mut placed: Vec<Pos2> = Vec::with_capacity(wanted.len());
    for (k, at) in wanted.iter().enumerate() {
        let area = area(k);
        let around = (1..=RINGS).flat_map(|ring| {
            (0..DIRECTIONS).map(move |d| {
                let angle = std::f32::consts::TAU * d as f32 / DIRECTIONS as f32;
                *at + Vec2::angled(angle) * steps * ring as f32
            })
        });
        let mut all = std::iter::once(*at).chain(around.filter(|p| area.contains(*p)));
        let free = all.find(|p| is_free(k, *p, &placed));
        placed.push(free.unwrap_or(*at));
    }
    placed
}

/// Centers of labels of these sizes near the wanted ones: moved up or down until none covers another, or one of the
/// `signs`. A label's own sign has its number.
pub(super) fn labels_apart(wanted: &[(Pos2, Vec2)], signs: &[Rect], area: Rect) -> Vec<Pos2> {
    /// Gap between two labels, points.
    const GAP: f32 = 2.0;
    let rect = |k: usize, at: Pos2| Rect::from_center_size(at, wanted[k].1);
    let centers: Vec<Pos2> = wanted.iter().map(|label| label.0).collect();
    let tallest = wanted.iter().map(|label| label.1.y).fold(0.0, f32::max);
    // A label that is wider than its area stays where it is.
    let room = |k: usize| area.shrink2(0.5 * wanted[k].1);
    apart(&centers, room, Vec2::new(0.0, tallest + GAP), |k, at, placed| {
        let own = rect(k, at);
        let is_clear = placed.iter().enumerate().all(|(other, at)| !own.intersects(rect(other, *at)));
        is_clear && signs.iter().enumerate().all(|(other, sign)| other == k || !own.intersects(*sign))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{pos2, vec2};

    #[test]
    fn labels_of_close_things_stand_apart_and_others_stay() {
        let area = Rect::from_min_max(pos2(0.0, 0.0), pos2(800.0, 600.0));
        let size = vec2(140.0, 21.0);
        let rects = |placed: &[Pos2]| placed.iter().map(|p| Rect::from_center_size(*p, size)).collect::<Vec<_>>();
        let overlaps = |rects: &[Rect]| (0..rects.len()).any(|i| (0..i).any(|k| rects[i].intersects(rects[k])));
        // Six arrows at the right border, a few points apart.
        let close: Vec<(Pos2, Vec2)> = (0..6).map(|i| (pos2(690.0, 480.0 + 4.0 * i as f32), size)).collect();
        let wanted: Vec<Pos2> = close.iter().map(|label| label.0).collect();
        assert!(overlaps(&rects(&wanted)), "the control: they would cover each other");
        let placed = labels_apart(&close, &[], area);
        assert!(!overlaps(&rects(&placed)), "{placed:?}");
        assert_eq!(placed[0], wanted[0], "the first stays");
        assert!(rects(&placed).iter().all(|rect| area.contains_rect(*rect)), "{placed:?}");
        let far = [(pos2(100.0, 50.0), size), (pos2(100.0, 300.0), size)];
        assert_eq!(labels_apart(&far, &[], area), [far[0].0, far[1].0]);
        // One over the arrow of another makes room; over its own it does not.
        let arrows = [Rect::NOTHING, Rect::from_center_size(far[0].0, vec2(26.0, 26.0))];
        assert_ne!(labels_apart(&far, &arrows, area)[0], far[0].0);
        assert_eq!(labels_apart(&far, &[arrows[1], arrows[0]], area)[0], far[0].0);
    }
}
