//! Times of the stages of a frame: the last one, and the median of recent ones.

use std::collections::VecDeque;

use egui::{Grid, RichText, Ui};

use super::super::theme;
use crate::math::stats::median;
use crate::worker::view::ViewPicture;

/// Number of frames in the medians.
const MOST: usize = 60;

/// A stage of a frame.
type Stage = (&'static str, f64);

/// Times of recent frames, kept while they are shown.
#[derive(Default)]
pub(crate) struct FrameTimes {
    frames: VecDeque<Vec<Stage>>,
    /// Times of the identity maps, drawn at rest, s.
    maps: VecDeque<f64>,
    /// Name of the renderer; whether it reports its stages.
    drawn_by: String,
    has_stages: bool,
}

impl FrameTimes {
    /// Adds a frame that took `upload_secs` to upload.
    pub(crate) fn add(&mut self, picture: &ViewPicture, upload_secs: f64) {
        self.drawn_by.clone_from(&picture.drawn_by);
        self.has_stages = !picture.stages.is_empty();
        let mut stages = picture.stages.clone();
        // Waiting for the device and copying are part of the total, but of no stage.
        let known: f64 = stages.iter().map(|s| s.1).sum();
        stages.push((if self.has_stages { "other rendering" } else { "draw" }, (picture.secs - known).max(0.0)));
        stages.extend([("8-bit conversion", picture.paint_secs), ("upload", upload_secs)]);
        stages.push(("total", picture.secs + picture.paint_secs + upload_secs));
        push(&mut self.frames, stages);
    }

    /// Adds the time of the identity maps.
    pub(crate) fn add_maps(&mut self, secs: f64) {
        push(&mut self.maps, secs);
    }

    /// Last and median seconds of each stage of the newest frame.
    fn rows(&self) -> Vec<(&'static str, f64, f64)> {
        let Some(last) = self.frames.back() else { return Vec::new() };
        let of = |name: &str| -> Vec<f64> {
            self.frames.iter().filter_map(|f| f.iter().find(|s| s.0 == name)).map(|s| s.1).collect()
        };
        let mut rows: Vec<_> = last.iter().map(|&(name, secs)| (name, secs, median(&of(name)))).collect();
        if let Some(&secs) = self.maps.back() {
            rows.push(("feature maps, at rest", secs, median(&self.maps.iter().copied().collect::<Vec<_>>())));
        }
        rows
    }

    pub(crate) fn show(&self, ui: &mut Ui) {
        let small = |text: &str| RichText::new(text).small();
        let rows = self.rows();
        if rows.is_empty() {
            ui.label(small("Frame times appear with the next frame: move the view.").color(theme::weak()));
            return;
        }
        ui.vertical(|ui| {
            ui.spacing_mut().item_spacing.y = 1.0;
            Grid::new("frame times").num_columns(3).spacing([14.0, 1.0]).min_row_height(13.0).show(ui, |ui| {
                let head =
                    [format!("ms, {}", self.drawn_by), "last".into(), format!("median of {}", self.frames.len())];
                head.iter().for_each(|h| drop(ui.label(small(h).color(theme::weak()))));
                ui.end_row();
                for (name, last, median) in rows {
                    let color = if name == "total" { theme::accent() } else { theme::text() };
                    ui.label(small(name).color(color));
                    for secs in [last, median] {
                        ui.label(RichText::new(format!("{:>7.2}", secs * 1e3)).monospace().size(11.0).color(color));
                    }
                    ui.end_row();
                }
            });
            if !self.has_stages {
                ui.label(small("This device reports only the total.").color(theme::warning()));
            }
        });
    }
}

fn push<T>(list: &mut VecDeque<T>, value: T) {
    if list.len() == MOST {
        list.pop_front();
    }
    list.push_back(value);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Camera;
    use glam::DVec3;

    fn picture(blend: f64, stages: bool) -> ViewPicture {
        ViewPicture {
            ticket: 0,
            full: true,
            camera: Camera::look_at(DVec3::ONE, DVec3::ZERO, DVec3::Z, 0.8, 4, 4).expect("valid"),
            rgb: Vec::new(),
            texture: None,
            median_depth: None,
            depth_range: None,
            psnr: None,
            beside: Vec::new(),
            secs: 0.5 + blend,
            stages: if stages { vec![("project", 0.25), ("blend", blend)] } else { Vec::new() },
            paint_secs: 0.125,
            drawn_by: "CPU".into(),
            instead_of_gpu: None,
        }
    }

    #[test]
    fn rows_hold_the_last_and_the_median() {
        let mut times = FrameTimes::default();
        assert!(times.rows().is_empty());
        [9.0, 1.0, 2.0].iter().for_each(|b| times.add(&picture(*b, true), 0.25));
        times.add_maps(0.5);
        let row = |name: &str| times.rows().into_iter().find(|r| r.0 == name).map(|r| (r.1, r.2));
        assert_eq!(row("blend"), Some((2.0, 2.0)));
        assert_eq!(row("other rendering"), Some((0.25, 0.25)));
        assert_eq!(row("total"), Some((2.875, 2.875)));
        assert_eq!(row("feature maps, at rest"), Some((0.5, 0.5)));
        (0..2 * MOST).for_each(|_| times.add(&picture(4.0, false), 0.0));
        assert_eq!((times.frames.len(), times.has_stages), (MOST, false));
        let row = |name: &str| times.rows().into_iter().find(|r| r.0 == name).map(|r| (r.1, r.2));
        assert_eq!((row("draw"), row("blend")), (Some((4.5, 4.5)), None));
    }
}
