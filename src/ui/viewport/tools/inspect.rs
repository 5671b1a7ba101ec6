//! The inspector: the Gaussians that contribute to a pixel, with all properties of each.

use egui::{Button, Color32, Grid, Rect, Response, RichText, ScrollArea, Sense, Stroke, Ui, vec2};
use glam::{DQuat, DVec2, DVec3};
use std::f64::consts::TAU;

use super::super::frusta::clipped;
use super::super::split::ViewArea;
use super::card::ToolCard;
use super::{CardPlaces, ToolScene, ViewTool};
use crate::jobs::inspect::{self, GaussianRecord, InspectRequest, InspectedPixel, PixelRecord};
use crate::math::format;
use crate::scene::Camera;
use crate::ui::actions::Action;
use crate::ui::ctx::Ctx;
use crate::ui::state::{AppState, Tone};
use crate::ui::{keys, theme};
use crate::worker::{JobInfo, QueueFull, Task, Tasks};

/// Height of the rows of the card around the properties, points.
const ROWS_PT: f32 = 125.0;
/// Height of the cards above and below it, points.
const AROUND_PT: f32 = 156.0;

/// Title of the job.
const TITLE: &str = "Inspecting a pixel";
/// Outline of a Gaussian, standard deviations.
const OUTLINE_SIGMA: f64 = 2.0;
/// Corners of an outline.
const CORNERS: usize = 48;

/// The inspected pixel, and which of its Gaussians is shown.
#[derive(Debug, Default)]
pub(crate) struct Inspector {
    pixel: Option<InspectedPixel>,
    /// The job that inspects another pixel.
    task: Option<Task<InspectedPixel>>,
    /// Reason why a pixel could not be inspected, until it is reported.
    refused: Option<QueueFull>,
    place: usize,
    record: Option<GaussianRecord>,
}

impl Inspector {
    /// Inspects another pixel, in place of one that is being inspected.
    pub(crate) fn inspect(&mut self, request: InspectRequest, tasks: &Tasks) {
        match tasks.spawn(JobInfo::short(TITLE), move |_| inspect::run(request)) {
            Ok(task) => self.task = Some(task),
            Err(refused) => self.refused = Some(refused),
        }
    }

    /// Shows a pixel, beginning with its largest Gaussian.
    fn take(&mut self, pixel: InspectedPixel) {
        self.record = pixel.record(0);
        (self.pixel, self.place) = (Some(pixel), 0);
    }

    fn go(&mut self, place: usize) {
        if let Some(record) = self.pixel.as_ref().and_then(|pixel| pixel.record(place)) {
            (self.place, self.record) = (place, Some(record));
        }
    }
}

impl ViewTool for Inspector {
    fn takes_clicks(&self) -> bool {
        true
    }

    fn update(&mut self, _scene: &mut ToolScene<'_>, state: &mut AppState, _tasks: &Tasks) {
        if let Some(refused) = self.refused.take() {
            state.toast(Tone::Warning, format!("{TITLE}: {refused}"));
        }
        // A failure was reported; the pixel before stays.
        if let Some(Ok(pixel)) = Task::take(&mut self.task) {
            self.take(pixel);
        }
    }

    /// Inspects the pixel under a click in the first view.
    fn pointer(&mut self, response: &Response, area: ViewArea, _scene: &mut ToolScene<'_>, cx: &mut Ctx<'_>) {
        let clicked = response.interact_pointer_pos().filter(|pos| response.clicked() && area.shown.contains(*pos));
        if let Some(pos) = clicked.filter(|_| !area.second) {
            let at = (pos - area.shown.min) / area.shown.size();
            cx.ask(Action::InspectAt(DVec2::new(f64::from(at.x), f64::from(at.y))));
        }
    }

    /// Outlines the Gaussian in the first view.
    fn paint(&mut self, ui: &Ui, area: ViewArea, scene: &mut ToolScene<'_>, _cx: &mut Ctx<'_>) {
        if let (Some(pixel), Some(record), false) = (&self.pixel, &self.record, area.second) {
            outline(ui, area.shown, &scene.camera(area.shown), pixel, record);
        }
    }

    /// Lists the properties of the Gaussian.
    fn card(&mut self, ui: &Ui, places: CardPlaces, _scene: &mut ToolScene<'_>, cx: &mut Ctx<'_>) {
        let shown = places.first_frame;
        ToolCard::in_corner("inspector", "Inspect Gaussians", shown).show(ui, |ui, _| {
            ui.set_width((shown.width() - 44.0).clamp(120.0, 330.0));
            // Up to two thirds of the view, below the cards at its top.
            let most = (shown.height() * 2.0 / 3.0).min(shown.height() - AROUND_PT);
            card(ui, self, (most - ROWS_PT).max(90.0), cx);
        });
    }
}

fn card(ui: &mut Ui, inspector: &mut Inspector, height: f32, cx: &mut Ctx<'_>) {
    ui.horizontal(|ui| {
        ui.label(RichText::new("Gaussian").strong());
        let of = inspector.pixel.as_ref().map_or(0, |pixel| pixel.weights.len());
        let (place, mut wanted) = (inspector.place, None);
        let mut step = |ui: &mut Ui, text: &str, name: &str, to: Option<usize>| {
            let button = ui.add_enabled(to.is_some(), Button::new(text)).on_hover_text(name);
            if button.accessible_name(name).clicked() {
                wanted = to;
            }
        };
        step(ui, "\u{2039}", "Previous Gaussian", place.checked_sub(1));
        step(ui, "\u{203a}", "Next Gaussian", Some(place + 1).filter(|next| *next < of));
        if of > 0 {
            ui.weak(format!("{} of {} by weight", place + 1, format::count(of as u64)));
        }
        if let Some(place) = wanted {
            inspector.go(place);
        }
    });
    match (&inspector.record, inspector.task.is_some()) {
        (Some(record), _) => {
            ScrollArea::vertical().max_height(height).auto_shrink([false, true]).show(ui, |ui| {
                properties(ui, record, cx.state);
            });
        }
        (None, true) => {
            ui.weak("Reading the pixel\u{2026}");
        }
        (None, false) => {
            ui.weak("No Gaussian is drawn there. Click a place in the view.");
        }
    }
    ui.horizontal(|ui| {
        let copy = ui.add_enabled(inspector.record.is_some(), Button::new("Copy")).on_hover_text("As JSON");
        if let Some(record) = inspector.record.as_ref().filter(|_| copy.clicked()) {
            // Numbers and names always have a form in JSON.
            ui.ctx().copy_text(serde_json::to_string_pretty(record).unwrap_or_default());
        }
        let close = ui.button("Close").on_hover_text(keys::label(ui.ctx(), &Action::Inspect));
        if close.clicked() {
            cx.ask(Action::Inspect);
        }
    });
}

fn properties(ui: &mut Ui, record: &GaussianRecord, state: &AppState) {
    let meters = state.scene.as_ref().and_then(|s| s.meters_per_unit());
    let list = |values: &[f64]| values.iter().map(|v| format::short(*v)).collect::<Vec<_>>().join(", ");
    let wide = |values: &[f32]| values.iter().map(|v| f64::from(*v)).collect::<Vec<_>>();
    let of = |what: f32| format!("{:.1} %", 100.0 * what);
    let mut more: Vec<(String, String)> = Vec::new();
    for identity in &record.identities {
        let name = state.semantics.as_ref().map(|map| state.labels.name(&map.identities, identity.number));
        let (name, share) = (name.unwrap_or_default(), of(identity.pixel_share));
        let text = format!("{name}, weight {:.2}, {share} of the pixel", identity.weight);
        more.push((format!("{:?}", identity.level), text));
    }
    if record.identities.is_empty() && record.codes.is_some() {
        more.push(("Belongs to".into(), "nothing".into()));
    }
    for (name, code) in ["Object code", "Part code"].iter().zip(record.codes.iter().flatten()) {
        more.push(((*name).into(), list(&wide(code))));
    }
    more.extend(record.extras.iter().map(|(name, value)| (name.clone(), format::number(f64::from(*value)))));
    let row = |ui: &mut Ui, name: &str, value: String| {
        ui.label(RichText::new(name).color(theme::weak()));
        ui.add(egui::Label::new(value).wrap());
        ui.end_row();
    };
    Grid::new("gaussian").num_columns(2).spacing([10.0, 3.0]).show(ui, |ui| {
        let PixelRecord { x, y, weight, share, .. } = record.pixel;
        row(ui, "Number", format!("#{}", record.number));
        row(ui, "Weight", format!("{weight:.4}, {} of pixel ({x}, {y})", of(share)));
        let center = record.center.map(|v| meters.map_or(v, |scale| v * scale));
        row(ui, "Center", format!("{} {}", list(&center), if meters.is_some() { "m" } else { "units" }));
        row(ui, "Scales", record.scales.map(|s| format::length(s, meters)).join(", "));
        row(ui, "Rotation", record.rotation_wxyz.map_or_else(|| format::NONE.into(), |q| list(&wide(&q))));
        row(ui, "Opacity", format!("{:.4}", record.opacity));
        for (name, color) in [("Color from here", record.color), ("Base color", record.base_color)] {
            ui.label(RichText::new(name).color(theme::weak()));
            ui.horizontal(|ui| {
                let (rect, _) = ui.allocate_exact_size(vec2(22.0, 14.0), Sense::hover());
                let [r, g, b] = color.map(|c| (255.0 * c.clamp(0.0, 1.0)).round() as u8);
                ui.painter().rect_filled(rect, 3.0, Color32::from_rgb(r, g, b));
                ui.label(list(&wide(&color)));
            });
            ui.end_row();
        }
        more.into_iter().for_each(|(name, value)| row(ui, &name, value));
    });
    ui.collapsing("Spherical harmonics", |ui| {
        Grid::new("harmonics").num_columns(4).striped(true).spacing([12.0, 2.0]).show(ui, |ui| {
            for title in ["Band, order", "Red", "Green", "Blue"] {
                ui.label(RichText::new(title).small().color(theme::weak()));
            }
            ui.end_row();
            for (i, rgb) in record.sh.iter().enumerate() {
                let band = i.isqrt();
                ui.label(format!("{band}, {}", i as i64 - (band * band + band) as i64));
                for value in rgb {
                    ui.label(RichText::new(format!("{value:.4}")).monospace());
                }
                ui.end_row();
            }
        });
    });
}

/// Draws a cross on the pixel, while the view is that of the frame, and the Gaussian's three ellipses.
fn outline(ui: &Ui, shown: Rect, eye: &Camera, pixel: &InspectedPixel, record: &GaussianRecord) {
    let painter = ui.painter_at(shown);
    let strokes = [Stroke::new(3.0, Color32::from_black_alpha(140)), Stroke::new(1.2, theme::accent())];
    let rotation = record.rotation_wxyz.map_or(DQuat::IDENTITY, |[w, x, y, z]| {
        DQuat::from_xyzw(f64::from(x), f64::from(y), f64::from(z), f64::from(w))
    });
    let (center, scales) = (DVec3::from_array(record.center), DVec3::from_array(record.scales) * OUTLINE_SIGMA);
    let place = |p: DVec2| shown.min + vec2(p.x as f32, p.y as f32);
    for stroke in strokes {
        for axis in 0..3 {
            let (a, b) = (axis, (axis + 1) % 3);
            let corner = |k: usize| {
                let mut p = DVec3::ZERO;
                (p[b], p[a]) = (TAU * k as f64 / CORNERS as f64).sin_cos();
                center + rotation * (p * scales)
            };
            for k in 0..CORNERS {
                if let Some((a, b)) = clipped(eye, corner(k), corner(k + 1)) {
                    painter.line_segment([place(a), place(b)], stroke);
                }
            }
        }
        let InspectRequest { camera, pixel: [x, y], .. } = &pixel.request;
        if camera.center == eye.center && camera.world_from_camera == eye.world_from_camera {
            let scale = vec2(shown.width() / camera.width_px as f32, shown.height() / camera.height_px as f32);
            let at = shown.min + vec2(*x as f32 + 0.5, *y as f32 + 0.5) * scale;
            for way in [vec2(1.0, 0.0), vec2(0.0, 1.0), vec2(-1.0, 0.0), vec2(0.0, -1.0)] {
                painter.line_segment([at + 4.0 * way, at + 10.0 * way], stroke);
            }
        }
    }
}
