//! Cameras of the photos, drawn over the view.

use egui::{Color32, Painter, Pos2, Rect, Response, Stroke, Ui};
use glam::{DVec2, DVec3};

use crate::scene::{Camera, Photo};
use crate::ui::actions::Action;
use crate::ui::ctx::Ctx;
use crate::ui::theme;

/// Largest distance of the cursor from a camera that it picks, points.
const REACH: f32 = 12.0;
/// Number of cameras that are drawn, the nearest ones. All of them would hide the scene.
const MOST: usize = 10;

/// Size of a camera in a scene of this radius.
pub(super) fn size_in(radius: f64) -> f64 {
    0.09 * radius
}

/// Draws the nearest cameras into the view in `rect`, which `eye` sees; a click on one looks through it. Returns true if the
/// cursor is on one.
pub(super) fn show(ui: &Ui, rect: Rect, eye: &Camera, response: &Response, cx: &mut Ctx<'_>) -> bool {
    let state = cx.state;
    let Some(scene) = &state.scene else { return false };
    let painter = ui.painter_at(rect);
    let size = size_in(scene.home.bounds.radius());
    let held_out: std::collections::HashSet<usize> =
        scene.held_out(cx.layout.config.holdout_every).into_iter().collect();
    let cursor = response.hover_pos().filter(|pos| rect.contains(*pos));
    let place = |p: DVec2| rect.min + egui::vec2(p.x as f32, p.y as f32);
    // From inside, a camera is only lines along the border of the view.
    let mut drawn: Vec<(f64, usize, &Photo)> = (0..state.photo_count())
        .filter_map(|i| state.photo(i).map(|photo| (photo.camera.center.distance(eye.center), i, photo)))
        .filter(|(distance, _, photo)| *distance >= size && eye.project(photo.camera.center).is_some())
        .collect();
    drawn.sort_by(|a, b| a.0.total_cmp(&b.0));
    drawn.truncate(MOST);
    let nearest = cursor.and_then(|cursor| {
        let seen = drawn.iter().filter_map(|(_, i, p)| Some((*i, *p, place(eye.project(p.camera.center)?))));
        let (i, photo, at) = seen.min_by(|a, b| a.2.distance(cursor).total_cmp(&b.2.distance(cursor)))?;
        (at.distance(cursor) < REACH).then_some((i, photo, at))
    });
    for &(distance, i, photo) in &drawn {
        let near = (1.5 * scene.home.bounds.radius() / distance).clamp(0.25, 1.0) as f32;
        let pointed = nearest.is_some_and(|n| n.0 == i);
        let color = match (pointed, held_out.contains(&i)) {
            (true, _) => theme::accent(),
            _ if state.placed(i).is_some() => theme::good().gamma_multiply(near),
            (false, true) => theme::warning().gamma_multiply(0.75 * near),
            (false, false) => Color32::from_white_alpha(130).gamma_multiply(near),
        };
        let width = if pointed { 2.0 } else { 0.8 };
        let rim = Color32::from_black_alpha(70).gamma_multiply(near);
        // A dark rim keeps the lines visible on bright scenes.
        for stroke in [Stroke::new(width + 1.5, rim), Stroke::new(width, color)] {
            draw(&painter, eye, &photo.camera, size, place, stroke);
        }
    }
    if let Some((i, photo, at)) = nearest {
        label(&painter, at, &format!("{}  (click to look through)", photo.title()));
        if response.clicked() {
            cx.ask(Action::GoToPhoto(i));
        }
    }
    nearest.is_some()
}

/// Draws all of these cameras, each of this size.
pub(super) fn show_all(ui: &Ui, rect: Rect, eye: &Camera, cameras: &[Camera], size: f64) {
    let painter = ui.painter_at(rect);
    let place = |p: DVec2| rect.min + egui::vec2(p.x as f32, p.y as f32);
    let stroke = Stroke::new(1.0, Color32::from_white_alpha(150));
    cameras.iter().for_each(|camera| draw(&painter, eye, camera, size, place, stroke));
}

fn label(painter: &Painter, at: Pos2, text: &str) {
    let galley = painter.layout_no_wrap(text.to_owned(), egui::FontId::proportional(12.5), theme::text());
    let corner = at + egui::vec2(12.0, -24.0);
    let back = Rect::from_min_size(corner, galley.size()).expand2(egui::vec2(6.0, 3.0));
    painter.rect_filled(back, 5.0, Color32::from_black_alpha(200));
    painter.galley(corner, galley, theme::text());
}

/// Draws a camera as a pyramid with a base of `size` on its longer side, and a mark on its upper side.
fn draw(painter: &Painter, eye: &Camera, camera: &Camera, size: f64, place: impl Fn(DVec2) -> Pos2, stroke: Stroke) {
    let (w, h) = (f64::from(camera.width_px), f64::from(camera.height_px));
    // The depth at which the base has that size; about `size` for a usual lens.
    let depth = size * camera.focal_px.x / w.max(h);
    let corner = |x: f64, y: f64| camera.center + camera.ray(DVec2::new(x, y)) * depth;
    let c = [corner(0.0, 0.0), corner(w, 0.0), corner(w, h), corner(0.0, h)];
    let line = |a: DVec3, b: DVec3| {
        if let Some((a, b)) = clipped(eye, a, b) {
            painter.line_segment([place(a), place(b)], stroke);
        }
    };
    for i in 0..4 {
        line(c[i], c[(i + 1) % 4]);
        line(camera.center, c[i]);
    }
    let roof = corner(0.5 * w, -0.25 * h);
    line(corner(0.3 * w, 0.0), roof);
    line(corner(0.7 * w, 0.0), roof);
}

/// The part of a segment in front of the eye, projected; `None` if all of it is behind.
pub(super) fn clipped(eye: &Camera, a: DVec3, b: DVec3) -> Option<(DVec2, DVec2)> {
    const NEAR: f64 = 1e-3;
    let (za, zb) = (eye.camera_from_world(a).z, eye.camera_from_world(b).z);
    let near = NEAR * za.abs().max(zb.abs());
    if za < near && zb < near {
        return None;
    }
    let cut = |from: DVec3, to: DVec3, zf: f64, zt: f64| {
        if zf >= near { from } else { from + (to - from) * ((near - zf) / (zt - zf)) }
    };
    Some((eye.project(cut(a, b, za, zb))?, eye.project(cut(b, a, zb, za))?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_are_cut_at_the_eye() {
        let eye = Camera::look_at(DVec3::ZERO, DVec3::X, DVec3::Z, 0.8, 100, 100).expect("valid");
        let (ahead, behind) = (DVec3::new(2.0, 0.5, 0.0), DVec3::new(-1.0, 0.5, 0.0));
        let (a, b) = clipped(&eye, ahead, behind).expect("partly ahead");
        assert!((a - eye.project(ahead).expect("ahead")).length() < 1e-9);
        assert!(b.is_finite());
        assert!(clipped(&eye, behind, behind * 2.0).is_none());
        assert!(clipped(&eye, ahead, ahead * 2.0).is_some());
    }
}
