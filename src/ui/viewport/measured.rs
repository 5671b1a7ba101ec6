//! Measurements drawn over the view, with labels that do not cover each other.

use egui::{Color32, Context, FontId, Order, Painter, Pos2, Rect, Shape, Stroke, Ui, Vec2, vec2};
use glam::DVec3;

use crate::math::format;
use crate::scene::Camera;
use crate::scene::measurement::{Measurement, MeasurementKind};
use crate::scene::upright_box::UprightBox;
use crate::ui::theme;

/// Distance of a label from its place, points.
const BESIDE: f32 = 12.0;
/// Most sections of a line with labels of their own.
const MOST_SECTIONS: usize = 8;

/// A measurement to draw.
pub(super) struct DrawnMeasurement {
    kind: MeasurementKind,
    points: Vec<DVec3>,
    /// Text at its middle.
    label: Option<String>,
    /// True if it is being made.
    is_new: bool,
}

impl DrawnMeasurement {
    /// A measurement that is being made, of some points so far.
    pub(super) fn new(kind: MeasurementKind, points: Vec<DVec3>, meters: Option<f64>) -> Self {
        let label = kind.value(&points).ok().map(|value| value.text(meters));
        Self { kind, points, label, is_new: true }
    }

    /// A kept measurement.
    pub(super) fn kept(of: &Measurement, meters: Option<f64>) -> Self {
        let label = Some(format!("{}: {}", of.name, of.text(meters)));
        Self { kind: of.kind, points: of.points.clone(), label, is_new: false }
    }

    /// True if it is the same as a kept one.
    pub(super) fn is_of(&self, kept: &Measurement) -> bool {
        self.kind == kept.kind && self.points == kept.points
    }

    /// Its lines in the world.
    fn lines(&self) -> Vec<[DVec3; 2]> {
        match (self.kind, self.points.as_slice()) {
            (MeasurementKind::Box, [corner, a, b, c]) => edges(&UprightBox::of_ends([*corner, *a, *b, *c])),
            (kind, points) => {
                let closing =
                    (kind == MeasurementKind::Area && points.len() > 2).then(|| [points[points.len() - 1], points[0]]);
                points.windows(2).map(|pair| [pair[0], pair[1]]).chain(closing).collect()
            }
        }
    }

    /// Place of its label.
    fn middle(&self) -> Option<DVec3> {
        let mean = |points: &[DVec3]| points.iter().sum::<DVec3>() / points.len().max(1) as f64;
        Some(match (self.kind, self.points.as_slice()) {
            (MeasurementKind::Length, [.., a, b]) if self.points.len() > 2 && self.is_new => b + (b - a) * 0.05,
            (MeasurementKind::Length, points) => {
                let pair = points.get((points.len().max(2) - 2) / 2..)?;
                mean(pair.get(..2)?)
            }
            (MeasurementKind::Angle, [_, vertex, ..]) => *vertex,
            (MeasurementKind::Box, [corner, a, b, c]) => {
                *a + (*b - *corner) * 0.5 - (*a - *corner) * 0.5 + (*c - *corner)
            }
            (_, points) => mean(points),
        })
    }

    /// Labels with their places in the world: of sections of a new line, and of the whole.
    fn labels(&self, meters: Option<f64>) -> Vec<(DVec3, String)> {
        let mut labels = Vec::new();
        let sections = self.points.len().saturating_sub(1);
        if self.is_new && self.kind == MeasurementKind::Length && (2..=MOST_SECTIONS).contains(&sections) {
            let of = |pair: &[DVec3]| ((pair[0] + pair[1]) * 0.5, format::length(pair[0].distance(pair[1]), meters));
            labels.extend(self.points.windows(2).map(of));
        }
        let total = if labels.is_empty() { "" } else { "total " };
        labels.extend(self.middle().zip(self.label.as_ref().map(|label| format!("{total}{label}"))));
        labels
    }
}

/// The twelve edges of a box.
fn edges(of: &UprightBox) -> Vec<[DVec3; 2]> {
    let [a, b, c] = of.edges;
    let along =
        |edge: DVec3, p: DVec3, q: DVec3| [DVec3::ZERO, p, q, p + q].map(|v| [of.corner + v, of.corner + v + edge]);
    [along(a, b, c), along(b, a, c), along(c, a, b)].concat()
}

/// Draws measurements over the frame in `shown`, as `eye` sees them. Labels of the first ones come first: one that has
/// no place, or whose place is under a card, is left out.
pub(super) fn show(ui: &Ui, shown: Rect, eye: &Camera, all: &[DrawnMeasurement], meters: Option<f64>) {
    let painter = ui.painter_at(shown);
    let place = |p: DVec3| eye.project(p).map(|q| shown.min + vec2(q.x as f32, q.y as f32)).filter(|p| p.is_finite());
    let (mut labels, cards) = (Vec::new(), cards_over(ui.ctx(), shown));
    for one in all {
        let color = if one.is_new { theme::warning() } else { theme::accent() };
        for [a, b] in one.lines() {
            let (Some(a), Some(b)) = (place(a), place(b)) else { continue };
            for stroke in [Stroke::new(4.5, Color32::from_black_alpha(150)), Stroke::new(2.0, color)] {
                painter.line_segment([a, b], stroke);
            }
        }
        if one.kind != MeasurementKind::Box {
            let radius = if one.is_new { 5.0 } else { 3.5 };
            for at in one.points.iter().filter_map(|p| place(*p)) {
                painter.circle(at, radius, color, Stroke::new(1.5, Color32::from_black_alpha(200)));
            }
        }
        let seen = one.labels(meters).into_iter().filter_map(|(p, text)| Some((place(p)?, text, color)));
        labels.extend(seen.filter(|(at, ..)| shown.contains(*at) && !cards.iter().any(|card| card.contains(*at))));
    }
    show_labels(&painter, shown, cards, labels);
}

/// Rectangles of the cards over the view, as of the last frame.
pub(super) fn cards_over(ctx: &Context, shown: Rect) -> Vec<Rect> {
    ctx.memory(|m| {
        let all = m.areas().visible_layer_ids().into_iter();
        let cards = all.filter(|layer| matches!(layer.order, Order::Middle | Order::Foreground));
        cards.filter_map(|layer| m.area_rect(layer.id)).filter(|card| card.intersects(shown)).collect()
    })
}

fn show_labels(painter: &Painter, shown: Rect, cards: Vec<Rect>, labels: Vec<(Pos2, String, Color32)>) {
    let ink = Color32::from_gray(240);
    let galleys: Vec<_> = labels
        .iter()
        .map(|(_, text, _)| painter.layout_no_wrap(text.clone(), FontId::proportional(13.0), ink))
        .collect();
    let wanted: Vec<(Pos2, Vec2)> =
        labels.iter().zip(&galleys).map(|((at, ..), galley)| (*at, galley.size() + vec2(10.0, 6.0))).collect();
    let places = beside(&wanted, shown.shrink(4.0), cards);
    for ((rect, galley), (at, _, color)) in places.into_iter().zip(galleys).zip(labels) {
        let Some(rect) = rect else { continue };
        let nearest = rect.clamp(at);
        if nearest.distance(at) > BESIDE + 2.0 {
            painter.add(Shape::line_segment([at, nearest], Stroke::new(1.0, color)));
        }
        painter.rect_filled(rect, 5.0, Color32::from_black_alpha(235));
        painter.galley(rect.min + vec2(5.0, 3.0), galley, ink);
    }
}

/// Rectangles of these sizes beside their places, within `room`, none over another or over one that is `taken`; `None`
/// where there is no room.
fn beside(wanted: &[(Pos2, Vec2)], room: Rect, mut taken: Vec<Rect>) -> Vec<Option<Rect>> {
    const WAYS: [Vec2; 8] = [
        vec2(1.0, 0.0),
        vec2(0.0, 1.0),
        vec2(0.0, -1.0),
        vec2(-1.0, 0.0),
        vec2(1.0, 1.0),
        vec2(1.0, -1.0),
        vec2(-1.0, 1.0),
        vec2(-1.0, -1.0),
    ];
    let place = |(at, size): &(Pos2, Vec2)| {
        let near = |way: Vec2, gap: f32| Rect::from_center_size(*at + way * (0.5 * *size + Vec2::splat(gap)), *size);
        let places = (0..12).flat_map(|ring| WAYS.map(|way| near(way, BESIDE + 20.0 * ring as f32)));
        let is_free =
            |rect: &Rect| room.contains_rect(*rect) && taken.iter().all(|other| !other.expand(1.0).intersects(*rect));
        let found = places.into_iter().find(is_free);
        taken.extend(found);
        found
    };
    wanted.iter().map(place).collect()
}

#[cfg(test)]
mod tests {
    use egui::pos2;

    use super::*;

    #[test]
    fn labels_at_one_place_do_not_cover_each_other() {
        let room = Rect::from_min_size(Pos2::ZERO, vec2(400.0, 300.0));
        let crowd = vec![(pos2(200.0, 150.0), vec2(90.0, 20.0)); 12];
        let placed: Vec<Rect> = beside(&crowd, room, Vec::new()).into_iter().flatten().collect();
        let overlaps = |all: &[Rect]| {
            (0..all.len())
                .flat_map(|i| (0..i).map(move |k| (i, k)))
                .filter(|(i, k)| all[*i].intersects(all[*k]))
                .count()
        };
        assert_eq!((placed.len(), overlaps(&placed)), (12, 0));
        assert!(placed.iter().all(|rect| room.contains_rect(*rect)));
        // Control: each alone would stand where the first one does.
        let alone: Vec<Rect> = crowd.iter().filter_map(|one| beside(&[*one], room, Vec::new())[0]).collect();
        assert_eq!(overlaps(&alone), 66);
        let corner = beside(&[(pos2(398.0, 1.0), vec2(90.0, 20.0))], room, Vec::new());
        assert!(corner[0].is_some_and(|corner| room.contains_rect(corner)), "at the border");
    }

    #[test]
    fn labels_keep_off_cards_and_those_without_room_are_left_out() {
        let room = Rect::from_min_size(Pos2::ZERO, vec2(400.0, 300.0));
        let (one, card) =
            ((pos2(200.0, 150.0), vec2(90.0, 20.0)), Rect::from_min_size(pos2(205.0, 0.0), vec2(195.0, 300.0)));
        let free = beside(&[one], room, Vec::new())[0].expect("there is room");
        assert!(free.intersects(card), "control: without the card it would stand there");
        let kept_off = beside(&[one], room, vec![card])[0].expect("there is room on the other side");
        assert!(!kept_off.intersects(card) && room.contains_rect(kept_off));
        // In a narrow room the first ones have places.
        let narrow = Rect::from_center_size(one.0, vec2(200.0, 100.0));
        let placed = beside(&[one; 40], narrow, Vec::new());
        assert!(placed[0].is_some() && placed.iter().flatten().count() < 10, "{placed:?}");
        assert_eq!(beside(&[one], narrow, vec![room]), [None]);
    }

    #[test]
    fn a_measurement_that_was_kept_is_known_again() {
        let points = vec![DVec3::ZERO, DVec3::X];
        let drawn = DrawnMeasurement::new(MeasurementKind::Length, points.clone(), None);
        let kept = |kind, points| Measurement { id: 1, name: "a".into(), kind, points, hidden: false };
        assert!(drawn.is_of(&kept(MeasurementKind::Length, points.clone())));
        assert!(!drawn.is_of(&kept(MeasurementKind::Area, points)));
        assert!(!drawn.is_of(&kept(MeasurementKind::Length, vec![DVec3::ZERO, DVec3::Y])), "another line");
    }

    #[test]
    fn a_box_has_twelve_edges_and_a_polygon_is_closed() {
        let points = vec![DVec3::ZERO, DVec3::X * 3.0, DVec3::Y * 2.0, DVec3::Z];
        let drawn = |kind, n: usize| DrawnMeasurement::new(kind, points[..n].to_vec(), None).lines();
        let lengths: f64 = drawn(MeasurementKind::Box, 4).iter().map(|[a, b]| a.distance(*b)).sum();
        assert_eq!((drawn(MeasurementKind::Box, 4).len(), lengths), (12, 24.0));
        assert_eq!((drawn(MeasurementKind::Area, 4).len(), drawn(MeasurementKind::Area, 2).len()), (4, 1));
        assert_eq!(drawn(MeasurementKind::Length, 4).len(), 3, "control: a line is not closed");
        let top = DrawnMeasurement::new(MeasurementKind::Box, points, None).middle();
        assert_eq!(top, Some(DVec3::new(1.5, 1.0, 1.0)));
    }
}
