//! Marks of identities that are hard to see: an arrow at the border of the view if outside, a dashed outline if
//! occluded, a ring if small. A click flies there.

use std::collections::HashMap;
use std::sync::Arc;

use egui::{Color32, FontId, Galley, Painter, Pos2, Rect, Sense, Shape, Stroke, Ui, Vec2, pos2, vec2};
use glam::DVec3;

use super::apart::labels_apart;
use super::numbers;
use super::query::Queries;
use super::visible::Visibility;
use crate::navigate::target::Side;
use crate::scene::{Bounds, Camera, GaussianCloud, IdentityId, SemanticMap, text};
use crate::ui::actions::Action;
use crate::ui::ctx::Ctx;
use crate::ui::theme;
use crate::worker::Versioned;

/// Gaussians sampled per identity.
const POINTS: usize = 256;
/// Masks up to this width and height are hard to see, points.
const SMALL: f32 = 16.0;
/// Least share of its points in view for an identity to count as in view.
const IN_VIEW: f32 = 0.1;
/// Largest number of marked identities.
const MOST: usize = 6;
/// Largest number of things with a number in the view.
const MOST_NUMBERS: usize = 24;
/// Halo under every line.
const HALO: Stroke = Stroke { width: 4.0, color: Color32::from_black_alpha(150) };

/// Sampled points of marked identities, by number.
#[derive(Default)]
pub(super) struct Marks {
    /// Generations of their Gaussians and objects.
    of: (u64, u64),
    known: HashMap<IdentityId, Arc<[DVec3]>>,
}

/// The scene whose identities are marked.
pub(super) struct MarkedScene<'a> {
    pub(super) cloud: &'a Versioned<GaussianCloud>,
    pub(super) semantics: &'a Versioned<SemanticMap>,
    pub(super) visibility: &'a Visibility,
    pub(super) selected: Option<IdentityId>,
    /// Camera of the frame.
    pub(super) eye: Camera,
}

/// Kind of mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mark {
    None,
    Arrow,
    Ghost,
    Ring,
}

/// A mark in the view.
struct DrawnMark {
    id: IdentityId,
    name: String,
    /// Arrow or ring; nothing for an outline.
    sign: Rect,
    /// The label, with the center that it should have.
    label: Option<(Arc<Galley>, Pos2)>,
}

impl Marks {
    /// Marks found and selected identities that are hard to see in the frame in `shown`.
    pub(super) fn show(
        &mut self,
        ui: &Ui,
        shown: Rect,
        scene: &MarkedScene<'_>,
        queries: &mut Queries,
        cx: &mut Ctx<'_>,
    ) {
        let MarkedScene { cloud, semantics, visibility, selected, eye } = scene;
        let numbers = queries.numbers().into_iter().take(MOST_NUMBERS).filter_map(|(id, n)| {
            let center = semantics.identities.shapes.get(id)?.center();
            let at = place(shown, eye.project(center)?);
            shown.contains(at).then_some((id, at, n))
        });
        let numbers: Vec<(IdentityId, Pos2, usize)> = numbers.collect();
        let mut targets = queries.found_colors();
        targets.extend(selected.map(|id| (id, theme::accent())).filter(|t| targets.iter().all(|f| f.0 != t.0)));
        targets.retain(|(id, _)| {
            semantics.identities.get(*id).is_some() && visibility.draws(&semantics.identities, *id) != Some(false)
        });
        let painter = ui.painter_at(shown);
        let mut drawn = Vec::new();
        for (id, color) in targets.into_iter().take(MOST) {
            let points = self.points(cloud, semantics, id);
            if points.is_empty() {
                continue;
            }
            let places: Vec<Pos2> = points.iter().filter_map(|p| eye.project(*p)).map(|p| place(shown, p)).collect();
            let inside = places.iter().filter(|p| shown.contains(**p)).count();
            let size = queries.span_of(semantics, id).map(|span| span.map(|span| span * shown.size()));
            let name = text::elided(&cx.state.labels.full_name(&semantics.identities, id), 40);
            let label = |text: String| painter.layout_no_wrap(text, FontId::proportional(12.5), theme::text());
            let (sign, label) = match mark(inside as f32 / points.len() as f32, size) {
                Mark::None => continue,
                Mark::Arrow => {
                    let label = label(name.clone());
                    let (sign, beside) = arrow(&painter, shown, way(eye, &points), color, label.size());
                    (sign, Some((label, beside)))
                }
                Mark::Ghost => {
                    let why = visibility.why_not_drawn(&semantics.identities, id).unwrap_or("occluded");
                    let label = label(format!("{name} ({why})"));
                    let over = ghost(&painter, &hull(places), color, label.size());
                    (Rect::NOTHING, Some((label, over)))
                }
                // A number says where it is, and a ring would lie over the numbers beside it.
                Mark::Ring => {
                    let is_numbered = numbers.iter().any(|(numbered, ..)| *numbered == id);
                    (ring(&painter, middle(&places), color, is_numbered), None)
                }
            };
            drawn.push(DrawnMark { id, name, sign, label });
        }
        let areas = show_labels(&painter, &drawn);
        numbers::show(&painter, &numbers.iter().map(|(_, at, n)| (*at, *n)).collect::<Vec<_>>());
        for (mark, area) in drawn.iter().zip(areas) {
            let button = ui.interact(area, ui.scope_id().with(("mark", mark.id, queries.is_second())), Sense::click());
            button.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, format!("Fly to {}", mark.name)));
            if button.on_hover_text("Click to fly there").on_hover_cursor(egui::CursorIcon::PointingHand).clicked() {
                cx.ask(Action::GoToTarget(mark.id, Side::Best));
            }
        }
    }

    /// Bounds of an identity without outliers, if it has Gaussians.
    pub(super) fn bounds(
        &mut self,
        cloud: &Versioned<GaussianCloud>,
        semantics: &Versioned<SemanticMap>,
        id: IdentityId,
    ) -> Option<Bounds> {
        Bounds::of(self.points(cloud, semantics, id).iter().copied())
    }

    /// Samples the Gaussians of an identity, without outliers.
    fn points(
        &mut self,
        cloud: &Versioned<GaussianCloud>,
        semantics: &Versioned<SemanticMap>,
        id: IdentityId,
    ) -> Arc<[DVec3]> {
        let of = (cloud.generation(), semantics.generation());
        if self.of != of {
            (self.of, self.known) = (of, HashMap::new());
        }
        let sampled = || sample(cloud, semantics, id);
        Arc::clone(self.known.entry(id).or_insert_with(sampled))
    }
}

fn sample(cloud: &GaussianCloud, semantics: &SemanticMap, id: IdentityId) -> Arc<[DVec3]> {
    let inside = semantics.identities.descendants(id);
    let own = semantics.identity_of.iter().enumerate().filter(|(_, of)| inside.get(**of as usize) == Some(&true));
    let own: Vec<usize> = own.map(|(i, _)| i).filter(|i| *i < cloud.len()).collect();
    let step = own.len().div_ceil(POINTS).max(1);
    let points: Vec<DVec3> = own.iter().step_by(step).map(|i| cloud.world_position(*i)).collect();
    let bounds = Bounds::robust(points.iter().copied());
    points
        .iter()
        .filter(|p| bounds.as_ref().is_none_or(|b| p.cmpge(b.min).all() && p.cmple(b.max).all()))
        .copied()
        .collect()
}

/// Mark of an identity with a share of its points `in_view` and a span of `size` points, if known; `Some(None)` if it
/// has no pixels.
fn mark(in_view: f32, size: Option<Option<Vec2>>) -> Mark {
    match size {
        Some(Some(size)) if size.max_elem() <= SMALL => Mark::Ring,
        Some(Some(_)) => Mark::None,
        _ if in_view < IN_VIEW => Mark::Arrow,
        Some(None) => Mark::Ghost,
        None => Mark::None,
    }
}

fn place(shown: Rect, p: glam::DVec2) -> Pos2 {
    shown.min + vec2(p.x as f32, p.y as f32)
}

fn middle(places: &[Pos2]) -> Pos2 {
    let sum = places.iter().fold(Vec2::ZERO, |sum, p| sum + p.to_vec2());
    (sum / places.len().max(1) as f32).to_pos2()
}

/// Direction to turn for the points to come into view: right and down in the view, length 1.
fn way(eye: &Camera, points: &[DVec3]) -> Vec2 {
    let sum: DVec3 = points.iter().map(|p| eye.camera_from_world(*p)).sum();
    let way = sum.truncate().normalize_or(glam::DVec2::Y);
    vec2(way.x as f32, way.y as f32)
}

/// Draws the labels of marks, none over another or another's arrow. Returns the clickable area of each mark.
fn show_labels(painter: &Painter, marks: &[DrawnMark]) -> Vec<Rect> {
    const MARGIN: Vec2 = vec2(6.0, 3.0);
    let size = |label: &(Arc<Galley>, Pos2)| label.0.size() + 2.0 * MARGIN;
    // One without a label takes no room.
    let wanted = marks.iter().map(|mark| mark.label.as_ref().map_or((Pos2::ZERO, Vec2::ZERO), |l| (l.1, size(l))));
    let wanted: Vec<(Pos2, Vec2)> = wanted.collect();
    let signs: Vec<Rect> = marks.iter().map(|mark| mark.sign).collect();
    let placed = labels_apart(&wanted, &signs, painter.clip_rect());
    let show = |((mark, at), (before, size)): ((&DrawnMark, Pos2), &(Pos2, Vec2))| {
        let Some((galley, _)) = &mark.label else { return mark.sign };
        let area = Rect::from_center_size(at, *size);
        let is_moved = at != *before;
        if is_moved && mark.sign.is_positive() {
            painter.line_segment([mark.sign.center(), at], Stroke::new(1.0, Color32::from_white_alpha(160)));
        }
        painter.rect_filled(area, 5.0, Color32::from_black_alpha(190));
        painter.galley(area.min + MARGIN, Arc::clone(galley), theme::text());
        // With its arrow, a moved label would take the clicks of others.
        if is_moved { area } else { area.union(mark.sign) }
    };
    marks.iter().zip(placed).zip(&wanted).map(show).collect()
}

/// Draws an arrow at the border of the view. Returns its area, and the center of a label of this size beside it.
fn arrow(painter: &Painter, shown: Rect, way: Vec2, color: Color32, label: Vec2) -> (Rect, Pos2) {
    let room = shown.shrink(26.0);
    let half = room.size() / 2.0;
    let reach = (half.x / way.x.abs().max(1e-6)).min(half.y / way.y.abs().max(1e-6));
    let tip = room.center() + way * reach;
    let (back, across) = (tip - way * 20.0, way.rot90() * 10.0);
    let corners = vec![tip, back + across, back - across];
    painter.add(Shape::convex_polygon(corners, color, Stroke::new(2.0, HALO.color)));
    let beside = back - way * (14.0 + 0.5 * label.x * way.x.abs());
    (Rect::from_center_size(tip - way * 10.0, Vec2::splat(26.0)), beside)
}

/// Draws a dashed outline. Returns the center of a label of this size over it.
fn ghost(painter: &Painter, outline: &[Pos2], color: Color32, label: Vec2) -> Pos2 {
    let closed: Vec<Pos2> = outline.iter().chain(outline.first()).copied().collect();
    painter.add(Shape::line(closed.clone(), HALO));
    painter.extend(Shape::dashed_line(&closed, Stroke::new(2.0, color), 7.0, 5.0));
    let over = Rect::from_points(outline);
    let room = painter.clip_rect().shrink(6.0);
    let at = pos2(over.center().x - 0.5 * label.x, over.top() - label.y - 8.0);
    at.clamp(room.min, (room.max - label).max(room.min)) + 0.5 * label
}

/// Draws a ring around something small, unless a number is there. Returns the clickable area.
fn ring(painter: &Painter, at: Pos2, color: Color32, is_numbered: bool) -> Rect {
    if !is_numbered {
        painter.circle_stroke(at, 17.0, HALO);
        painter.circle_stroke(at, 17.0, Stroke::new(2.0, color));
    }
    Rect::from_center_size(at, Vec2::splat(36.0))
}

/// The convex hull of points, in order (Andrew's monotone chain).
fn hull(mut points: Vec<Pos2>) -> Vec<Pos2> {
    points.retain(|p| p.is_finite());
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let turns_left = |a: Pos2, b: Pos2, c: Pos2| (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x) > 0.0;
    let chain = |points: &mut dyn Iterator<Item = &Pos2>| {
        let mut chain: Vec<Pos2> = Vec::new();
        for &p in points {
            while chain.len() > 1 && !turns_left(chain[chain.len() - 2], chain[chain.len() - 1], p) {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut around = chain(&mut points.iter());
    around.extend(chain(&mut points.iter().rev()));
    around
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_seen_well_is_not_marked() {
        let size = |w: f32| Some(Some(vec2(w, w)));
        assert_eq!((mark(1.0, size(80.0)), mark(0.0, size(80.0))), (Mark::None, Mark::None), "a corner of it is seen");
        assert_eq!(mark(1.0, size(5.0)), Mark::Ring);
        assert_eq!((mark(1.0, Some(None)), mark(0.05, Some(None))), (Mark::Ghost, Mark::Arrow));
        assert_eq!((mark(1.0, None), mark(0.0, None)), (Mark::None, Mark::Arrow), "while the eye moves");
    }

    #[test]
    fn arrows_point_where_one_has_to_turn() {
        let eye = Camera::look_at(DVec3::ZERO, DVec3::X, DVec3::Z, 0.8, 100, 100).expect("valid");
        // For a camera along x with z up, right is -y.
        let at = |x: f64, y: f64, z: f64| way(&eye, &[DVec3::new(x, y, z)]);
        assert!((at(1.0, -9.0, 0.0) - vec2(1.0, 0.0)).length() < 1e-6);
        assert!((at(-5.0, -1.0, 0.0) - vec2(1.0, 0.0)).length() < 1e-6, "behind, to the right");
        assert!((at(1.0, 0.0, 9.0) - vec2(0.0, -1.0)).length() < 1e-6, "above");
        assert!(at(-5.0, 0.0, 0.0).is_finite(), "straight behind");
    }

    #[test]
    fn a_hull_goes_around_all_points_once() {
        let p = |x: f32, y: f32| pos2(x, y);
        let around =
            hull(vec![p(1.0, 1.0), p(0.0, 0.0), p(2.0, 0.0), p(2.0, 2.0), p(0.0, 2.0), p(1.0, 0.0), p(2.0, 0.0)]);
        assert_eq!(around, [p(0.0, 0.0), p(2.0, 0.0), p(2.0, 2.0), p(0.0, 2.0)]);
        assert_eq!(hull(vec![p(1.0, 1.0), p(1.0, 1.0)]), [p(1.0, 1.0)]);
        assert_eq!(hull(vec![p(f32::NAN, 1.0)]), []);
    }
}
