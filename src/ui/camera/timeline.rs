//! The timeline: the current time, and keyframes that can be dragged to other times.

use egui::{Align2, CursorIcon, FontId, Rect, Sense, Stroke, Ui, pos2, vec2};

use super::super::theme;
use super::CameraPane;
use super::player::Clip;
use crate::math::ticks::round_step;
use crate::navigate::Pose;

/// Height of the timeline, points.
const HEIGHT: f32 = 40.0;
/// Largest distance of the pointer from a keyframe that it picks, points.
const REACH: f32 = 7.0;

/// Draws the timeline. Returns the pose at the time that the user chose.
pub(crate) fn show(ui: &mut Ui, pane: &mut CameraPane) -> Option<Pose> {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, "Timeline"));
    let line = rect.shrink2(vec2(8.0, 0.0));
    let painter = ui.painter_at(rect);
    let track = rect.with_max_y(rect.top() + 24.0);
    painter.rect_filled(track.shrink2(vec2(0.0, 4.0)), 6.0, theme::canvas());
    // A flight is separate from the path below, so its title replaces the keyframes.
    if let Some(flight) = pane.flight() {
        painter.rect_filled(track.shrink2(vec2(0.0, 4.0)), 6.0, theme::accent().gamma_multiply(0.2));
        painter.text(track.center(), Align2::CENTER_CENTER, flight, FontId::proportional(11.0), theme::text());
    }
    let seconds = pane.player.clip().map_or(0.0, Clip::seconds).max(1e-3);
    let x = |time: f64| line.left() + (time / seconds).clamp(0.0, 1.0) as f32 * line.width();
    let time = |x: f32| f64::from(((x - line.left()) / line.width().max(1.0)).clamp(0.0, 1.0)) * seconds;
    ticks(&painter, line, seconds, x);
    let times: Vec<[f64; 2]> = match pane.player.clip() {
        Some(Clip::Path(spline)) => spline.times.clone(),
        _ => Vec::new(),
    };
    let count = pane.path.keys.len();
    let near = |at: egui::Pos2| {
        let apart = |t: &[f64; 2]| (x(t[0]) - at.x).abs();
        let found = times.iter().take(count).enumerate();
        found.min_by(|a, b| apart(a.1).total_cmp(&apart(b.1))).filter(|(_, t)| apart(t) < REACH).map(|(i, _)| i)
    };
    let dragged = ui.scope_id().with("dragged key");
    let mut wanted = None;
    if response.drag_started()
        && let Some(at) = response.interact_pointer_pos()
    {
        let key = near(at).filter(|i| *i > 0);
        ui.data_mut(|d| d.insert_temp(dragged, key));
        pane.selected = near(at).or(pane.selected);
    }
    if let Some(at) = response.interact_pointer_pos() {
        let held: Option<usize> = ui.data(|d| d.get_temp(dragged)).flatten();
        match held.filter(|_| response.dragged()) {
            Some(key) => {
                let t = between_neighbors(pane, key, time(at.x), &times);
                if let Some(key) = pane.path.keys.get_mut(key) {
                    key.time_secs = Some(t);
                }
            }
            None if response.dragged() || response.clicked() => {
                pane.selected = near(at).or(pane.selected);
                wanted = pane.player.seek(time(at.x));
            }
            None => {}
        }
    }
    for (i, [arrives, leaves]) in times.iter().take(pane.path.keys.len()).enumerate() {
        let (a, b) = (x(*arrives), x(*leaves));
        if b - a > 1.0 {
            let wait = Rect::from_min_max(pos2(a, track.center().y - 2.0), pos2(b, track.center().y + 2.0));
            painter.rect_filled(wait, 2.0, theme::warning());
        }
        let chosen = pane.selected == Some(i);
        let (size, color) = if chosen { (7.0, theme::accent()) } else { (5.0, theme::text()) };
        let c = pos2(a, track.center().y);
        let corners = [vec2(0.0, -size), vec2(size, 0.0), vec2(0.0, size), vec2(-size, 0.0)].map(|v| c + v);
        painter.add(egui::Shape::convex_polygon(corners.to_vec(), color, Stroke::new(1.0, theme::panel())));
    }
    if pane.player.clip().is_some() {
        let at = x(pane.player.time);
        painter.line_segment([pos2(at, track.top()), pos2(at, track.bottom())], Stroke::new(2.0, theme::accent()));
    }
    if let Some(at) = response.hover_pos() {
        let over = near(at);
        ui.ctx().set_cursor_icon(if over.is_some() { CursorIcon::ResizeHorizontal } else { CursorIcon::PointingHand });
        let text = match over.and_then(|i| pane.path.keys.get(i).map(|k| (i, k))) {
            Some((i, k)) => {
                format!("Keyframe {}{}", i + 1, k.name.as_ref().map_or(String::new(), |n| format!(": {n}")))
            }
            None => format!("{:.2} s", time(at.x)),
        };
        response.on_hover_text_at_pointer(text);
    }
    wanted
}

/// Ticks below the track at round times, with seconds where they fit.
fn ticks(painter: &egui::Painter, line: Rect, seconds: f64, x: impl Fn(f64) -> f32) {
    /// Room of a number, points.
    const ROOM: f64 = 52.0;
    let step = round_step((seconds * ROOM / f64::from(line.width().max(1.0))).max(0.1));
    // A fifth of 1 and of 5 is round, as is a quarter of 2.
    let parts: u32 = if round_step(step / 5.0) < step / 4.5 { 5 } else { 4 };
    let small = step / f64::from(parts);
    for i in 0..=(seconds / small + 1e-6) as u32 {
        let (time, has_number) = (f64::from(i) * small, i.is_multiple_of(parts));
        let stroke = Stroke::new(1.0, theme::weak().gamma_multiply(if has_number { 0.9 } else { 0.4 }));
        painter.line_segment([pos2(x(time), line.top() + 24.0), pos2(x(time), line.top() + 28.0)], stroke);
        if has_number {
            let text = if step < 1.0 { format!("{time:.1} s") } else { format!("{time:.0} s") };
            // The first and the last number stay within the track.
            let galley = painter.layout_no_wrap(text, FontId::proportional(10.5), theme::weak());
            let half = 0.5 * galley.size().x;
            let left = x(time).clamp(line.left() - 8.0 + half, line.right() + 8.0 - half) - half;
            painter.galley(pos2(left, line.top() + 27.0), galley, theme::weak());
        }
    }
}

/// The time, kept between the neighboring keyframes.
fn between_neighbors(pane: &CameraPane, key: usize, time: f64, times: &[[f64; 2]]) -> f64 {
    const GAP: f64 = 0.02;
    let lowest = times.get(key.wrapping_sub(1)).map_or(0.0, |t| t[1] + GAP);
    let wait = pane.path.keys.get(key).map_or(0.0, |k| k.dwell_secs);
    let highest = times.get(key + 1).map_or(f64::INFINITY, |t| t[0] - wait - GAP);
    time.clamp(lowest, highest.max(lowest))
}

impl CameraPane {
    /// True if a flight plays, waits, or is paused on its way.
    pub(crate) fn is_on_way(&self) -> bool {
        let is_paused = matches!(self.player.clip(), Some(clip @ Clip::Flight(_)) if self.player.time < clip.seconds());
        self.player.playing || is_paused || !self.next.is_empty()
    }
}
