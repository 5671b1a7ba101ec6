//! Numbers of things that were found together: each at its thing, moved aside where it would cover another.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Stroke, Vec2};

use super::apart::apart;

/// Radius of a number's disk, points.
const RADIUS: f32 = 9.0;
/// Least distance of two centers, points.
const APART: f32 = 2.0 * RADIUS + 2.0;

/// Draws numbers at these places.
pub(super) fn show(painter: &Painter, numbers: &[(Pos2, usize)]) {
    let at: Vec<Pos2> = numbers.iter().map(|n| n.0).collect();
    let moved = places(&at, painter.clip_rect().shrink(RADIUS));
    let line = Stroke::new(1.0, Color32::from_white_alpha(160));
    for (from, to) in at.iter().zip(&moved).filter(|(from, to)| from.distance(**to) > 1.0) {
        painter.line_segment([*from, *to], line);
        painter.circle_filled(*from, 2.5, Color32::WHITE);
    }
    for (at, (_, n)) in moved.into_iter().zip(numbers) {
        painter.circle(at, RADIUS, Color32::from_black_alpha(170), line);
        painter.text(at, Align2::CENTER_CENTER, n, FontId::proportional(12.0), Color32::WHITE);
    }
}

/// Places near the wanted ones, within `area`, none of which covers another or another's thing.
fn places(wanted: &[Pos2], area: Rect) -> Vec<Pos2> {
    apart(
        wanted,
        |_| area,
        Vec2::splat(APART),
        |k, at, placed| {
            let covers_thing = wanted.iter().enumerate().any(|(i, other)| i != k && other.distance(at) < RADIUS);
            placed.iter().all(|other| other.distance(at) >= APART) && !(at != wanted[k] && covers_thing)
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::pos2;

    use super::super::apart::RINGS;

    #[test]
    fn numbers_of_close_things_stand_apart_and_others_stay() {
        let area = Rect::from_min_max(pos2(0.0, 0.0), pos2(400.0, 300.0));
        let far = [pos2(50.0, 50.0), pos2(200.0, 60.0), pos2(90.0, 250.0)];
        assert_eq!(places(&far, area), far);
        // Six buttons within a few points, beside an edge.
        let close: Vec<Pos2> = (0..6).map(|i| pos2(8.0 + 5.0 * (i % 3) as f32, 150.0 + 6.0 * (i / 3) as f32)).collect();
        let placed = places(&close, area);
        for i in 0..6 {
            assert!((0..i).all(|k| placed[i].distance(placed[k]) >= APART), "{placed:?}");
            assert!(placed[i].distance(close[i]) <= APART * RINGS as f32);
        }
        assert!(placed.iter().skip(1).all(|p| area.contains(*p)));
        assert_eq!(placed[0], close[0], "the first stays");
    }
}
