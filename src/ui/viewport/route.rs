//! The camera's route over the view: the loaded clip, its keyframes, and the reachable places.

use egui::{Color32, Rect, Stroke, Ui, pos2};
use glam::DVec3;

use crate::jobs::go_to::Explored;
use crate::scene::Camera;
use crate::ui::theme;

/// Camera path, for drawing it.
pub(crate) struct CameraRoute {
    /// Points along the loaded clip.
    pub(crate) way: Vec<DVec3>,
    /// Places of the keyframes; true for the chosen one.
    pub(crate) keys: Vec<(DVec3, bool)>,
    /// True if the places that the camera can reach are drawn, too.
    pub(crate) show_reach: bool,
    /// True while the clip plays.
    pub(crate) plays: bool,
}

/// Draws the loaded clip, the keyframes of the path, and the keypoints of the scene, as `eye` sees them; nothing while
/// the clip plays.
pub(super) fn show(ui: &Ui, rect: Rect, eye: &Camera, route: &CameraRoute, explored: Option<&Explored>) {
    let painter = ui.painter_at(rect);
    if route.plays {
        return;
    }
    // From a place on the way, what is nearest would cross the whole view.
    let far = route.way.iter().map(|p| p.distance(eye.center)).fold(0.0, f64::max);
    let near = (0.02 * far).max(1e-6 * (1.0 + eye.center.length()));
    let place = |p: DVec3| {
        let at = eye.project(p).filter(|_| p.distance(eye.center) > near)?;
        Some(pos2(rect.left() + at.x as f32, rect.top() + at.y as f32))
    };
    if let Some(explored) = explored.filter(|_| route.show_reach) {
        for (keypoint, part) in explored.navigator.graph.keypoints.iter().zip(&explored.parts) {
            let Some(at) = place(keypoint.center).filter(|at| rect.contains(*at)) else { continue };
            let color = if *part == 0 { theme::good() } else { theme::error() };
            let radius = if keypoint.original { 2.5 } else { 1.5 };
            painter.circle_filled(at, radius + 0.8, Color32::from_black_alpha(90));
            painter.circle_filled(at, radius, color.gamma_multiply(0.8));
        }
    }
    for stroke in [Stroke::new(4.0, Color32::from_black_alpha(110)), Stroke::new(2.0, theme::accent())] {
        for pair in route.way.windows(2) {
            if let (Some(a), Some(b)) = (place(pair[0]), place(pair[1]))
                && (rect.expand(2000.0).contains(a) && rect.expand(2000.0).contains(b))
            {
                painter.line_segment([a, b], stroke);
            }
        }
    }
    for (i, (center, chosen)) in route.keys.iter().enumerate() {
        let Some(at) = place(*center).filter(|at| rect.contains(*at)) else { continue };
        let (radius, color) = if *chosen { (7.0, theme::accent()) } else { (5.0, theme::text()) };
        painter.circle(at, radius, color, Stroke::new(1.5, Color32::from_black_alpha(160)));
        let font = egui::FontId::proportional(11.0);
        painter.text(at + egui::vec2(9.0, -9.0), egui::Align2::LEFT_BOTTOM, (i + 1).to_string(), font, theme::text());
    }
}
