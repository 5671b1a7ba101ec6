//! The dialog before Gaussians are saved: what is exported and in which format, with the size and the fidelity of each.

use std::sync::Arc;

use crossbeam_channel::{Receiver, bounded};
use egui::{Align, Context, Layout, RichText, ScrollArea, Ui, vec2};
use strum::VariantArray;

use super::{main_button, theme};
use crate::io::splat_format::SplatFormat;
use crate::jobs::export_forecast::{self, SplatForecast};
use crate::math::format;
use crate::pipeline::observer::Observer;
use crate::scene::{GaussianCloud, IdentityId};
use crate::worker::{JobInfo, Task, Tasks};

/// Widths of the columns at the right, points.
const SIZE_PT: f32 = 110.0;
const FIDELITY_PT: f32 = 90.0;

/// Gaussians that are exported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ExportScope {
    All,
    Identity(IdentityId),
    /// Gaussians that the tool selects.
    Selection,
    /// Gaussians that the crop box keeps.
    Crop,
}

/// A scope that can be chosen.
#[derive(Clone, Debug)]
pub(super) struct OfferedScope {
    pub(super) scope: ExportScope,
    pub(super) title: String,
    /// Proposed name of the file, without its ending.
    pub(super) stem: String,
}

/// Decision of the user.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ExportDecision {
    Change(ExportScope),
    Save,
    Close,
}

/// An open dialog.
pub(super) struct ExportDialog {
    offered: Vec<OfferedScope>,
    scope: ExportScope,
    pub(super) cloud: Arc<GaussianCloud>,
    pub(super) format: SplatFormat,
    forecasts: Vec<SplatForecast>,
    news: Receiver<SplatForecast>,
    /// The job that measures; `None` if too many jobs wait.
    task: Option<Task<()>>,
    /// True if the list scrolls to the format.
    follows: bool,
}

impl ExportDialog {
    /// Opens the dialog and begins to measure.
    pub(super) fn new(
        offered: Vec<OfferedScope>,
        scope: ExportScope,
        cloud: Arc<GaussianCloud>,
        tasks: &Tasks,
    ) -> Self {
        let (sender, news) = bounded(SplatFormat::VARIANTS.len());
        let measured = Arc::clone(&cloud);
        let measure = move |observer: &mut dyn Observer| {
            // The dialog may be closed by now.
            let found = |one| drop(sender.send(one));
            export_forecast::run(&measured, found, observer)
        };
        let task = tasks.spawn(JobInfo::short("Measuring formats").aside(), measure).ok();
        let (format, forecasts) = (SplatFormat::Ply, Vec::new());
        Self { offered, scope, cloud, format, forecasts, news, task, follows: false }
    }

    /// Ends measuring.
    pub(super) fn end(&self, tasks: &Tasks) {
        self.task.iter().for_each(|task| tasks.cancel(task.job()));
    }

    /// Scopes that can be chosen.
    pub(super) fn offered(&self) -> &[OfferedScope] {
        &self.offered
    }

    /// Proposed name of the file, without its ending.
    pub(super) fn stem(&self) -> &str {
        self.offered.iter().find(|one| one.scope == self.scope).map_or("scene", |one| &one.stem)
    }

    /// Draws the dialog; returns the decision, once there is one.
    pub(super) fn show(&mut self, ctx: &Context) -> Option<ExportDecision> {
        self.forecasts.extend(self.news.try_iter());
        if self.task.as_ref().is_some_and(|_| self.forecasts.len() < SplatFormat::VARIANTS.len()) {
            ctx.request_repaint_after(std::time::Duration::from_millis(100));
        }
        let response = theme::dialog("export").show(ctx, |ui| {
            let room = ctx.content_rect().size();
            ui.set_width((room.x - 80.0).min(640.0));
            ui.heading("Export Gaussians");
            ui.add_space(4.0);
            let changed = self.scopes(ui);
            columns(ui, |ui| ui.weak("Format"), "Size", "Fidelity (PSNR)", theme::weak());
            let list_pt = (room.y - 250.0).clamp(120.0, 400.0);
            ScrollArea::vertical().max_height(list_pt).min_scrolled_height(list_pt).show(ui, |ui| self.formats(ui));
            ui.add_space(4.0);
            ui.label(RichText::new(self.basis()).small().color(theme::weak()));
            ui.add_space(8.0);
            let [saves, closes] = ui
                .horizontal(|ui| {
                    let (save, steps) = main_button::stepping_button(ui, "export", "Save\u{2026}", true);
                    self.step(steps);
                    [save.clicked(), ui.button("Cancel").clicked()]
                })
                .inner;
            let ends = [(saves, ExportDecision::Save), (closes, ExportDecision::Close)];
            changed.or(ends.into_iter().find(|(is, _)| *is).map(|(_, end)| end))
        });
        response.inner.or_else(|| response.should_close().then_some(ExportDecision::Close))
    }

    /// Draws the scopes, if there is a choice.
    fn scopes(&self, ui: &mut Ui) -> Option<ExportDecision> {
        let n = format!("{} Gaussians", format::count(self.cloud.len() as u64));
        let mut changed = None;
        ui.horizontal_wrapped(|ui| {
            for one in &self.offered {
                let is_chosen = one.scope == self.scope;
                if self.offered.len() > 1
                    && theme::outlined(ui, |ui| ui.radio(is_chosen, &one.title)).clicked()
                    && !is_chosen
                {
                    changed = Some(ExportDecision::Change(one.scope));
                }
            }
            ui.label(RichText::new(n).color(theme::weak()));
        });
        ui.add_space(4.0);
        changed
    }

    /// Chooses a format some places below, of those that can be written.
    fn step(&mut self, steps: isize) {
        let fails = |format: &SplatFormat| self.forecasts.iter().any(|f| f.format == *format && f.written.is_err());
        let can: Vec<SplatFormat> = SplatFormat::VARIANTS.iter().copied().filter(|format| !fails(format)).collect();
        if steps != 0 {
            (self.format, self.follows) = (main_button::stepped(&can, self.format, steps), true);
        }
    }

    fn formats(&mut self, ui: &mut Ui) {
        for &format in SplatFormat::VARIANTS {
            let found = self.forecasts.iter().find(|one| one.format == format).map(|one| &one.written);
            let waiting = if self.task.is_some() { "\u{2026}" } else { "\u{2013}" };
            let (size, fidelity) = match found {
                None => (waiting.to_owned(), waiting.to_owned()),
                Some(Err(_)) => ("\u{2013}".to_owned(), "\u{2013}".to_owned()),
                Some(Ok(written)) => {
                    let bytes = size_text(written.bytes);
                    let size = if self.is_sampled() { format!("about {bytes}") } else { bytes };
                    let fidelity = written.drawn.map_or_else(
                        || "\u{2013}".to_owned(),
                        |drawn| match drawn.psnr {
                            Some(db) => format::decibel(db),
                            None => "exact".to_owned(),
                        },
                    );
                    (size, fidelity)
                }
            };
            let can_write = !matches!(found, Some(Err(_)));
            let mut clicked = false;
            let name = |ui: &mut Ui| {
                let button = egui::RadioButton::new(self.format == format, format.title());
                let radio = theme::outlined(ui, |ui| ui.add_enabled(can_write, button));
                clicked = radio.clicked();
                if self.format == format && std::mem::take(&mut self.follows) {
                    radio.scroll_to_me(None);
                }
                let values = format!("{}: size {size}, fidelity {fidelity}", format.title());
                radio.on_hover_text(format.rounding().map_or_else(|| values.clone(), |r| format!("Rounded: {r}.")))
            };
            columns(ui, name, &size, &fidelity, theme::text());
            ui.indent(format.title(), |ui| {
                let mut about = format.about().to_owned();
                match found {
                    Some(Ok(written)) if !written.left_out.is_empty() => {
                        let left_out: Vec<String> = written.left_out.iter().map(|what| short(what)).collect();
                        about = format!("{about} Not stored: {}.", left_out.join("; "));
                    }
                    Some(Err(why)) => about = format!("{about} Cannot be written: {why}."),
                    _ => {}
                }
                let color = if can_write { theme::weak() } else { theme::warning() };
                let about = ui.label(RichText::new(about).small().color(color));
                if let Some(Ok(written)) = found.filter(|_| about.hovered()) {
                    about.on_hover_text(written.lines().get(1..).unwrap_or_default().join("\n"));
                }
            });
            if clicked {
                self.format = format;
            }
        }
    }

    /// True if sizes and fidelity are those of some of the Gaussians.
    fn is_sampled(&self) -> bool {
        self.cloud.len() > export_forecast::MOST
    }

    /// Sentence on how sizes and fidelity were found.
    fn basis(&self) -> String {
        if self.task.is_none() {
            return "Not measured: too many jobs wait.".into();
        }
        let views = "drawings of the file from 4 sides, compared with what is exported";
        match self.is_sampled() {
            true => {
                let [some, all] = [export_forecast::MOST, self.cloud.len()].map(|n| format::count(n as u64));
                format!("Sizes and fidelity are estimated on {some} of {all} Gaussians. Fidelity: {views}.")
            }
            false => format!("Fidelity: {views}."),
        }
    }
}

/// Bytes with as many digits as tell formats apart: "1.4 MB".
fn size_text(bytes: u64) -> String {
    match bytes {
        1_000..10_000 => format!("{:.1} kB", bytes as f64 / 1e3),
        1_000_000..100_000_000 => format!("{:.1} MB", bytes as f64 / 1e6),
        _ => format::bytes(bytes),
    }
}

/// A list of properties by its first one.
fn short(what: &str) -> String {
    let names = what.strip_prefix("the properties ").map(|names| names.split(", ").collect::<Vec<_>>());
    match names.as_deref() {
        Some([first, rest @ ..]) if rest.len() > 1 => format!("{} properties ({first}, \u{2026})", rest.len() + 1),
        _ => what.to_owned(),
    }
}

/// A row of the list: a name, and two values at the right.
fn columns<T>(ui: &mut Ui, name: impl FnOnce(&mut Ui) -> T, size: &str, fidelity: &str, color: egui::Color32) {
    ui.horizontal(|ui| {
        name(ui);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.add_space(12.0);
            for (text, width) in [(fidelity, FIDELITY_PT), (size, SIZE_PT)] {
                let place = Layout::right_to_left(Align::Center);
                ui.allocate_ui_with_layout(vec2(width, ui.available_height()), place, |ui| {
                    ui.set_min_width(width);
                    ui.label(RichText::new(text).color(color));
                });
            }
        });
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_short_and_tell_formats_apart() {
        assert_eq!(
            [999, 1_280, 123_456, 1_440_000, 1_360_000, 123_000_000].map(size_text),
            ["999 B", "1.3 kB", "123 kB", "1.4 MB", "1.4 MB", "123 MB"]
        );
        assert_eq!(short("the properties a, b, c"), "3 properties (a, \u{2026})");
        assert_eq!(["the properties a, b", "flag of surfels"].map(short), ["the properties a, b", "flag of surfels"]);
    }
}
