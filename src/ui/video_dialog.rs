//! The dialog before a video is exported: format, size, aspect ratio and rate, with the pixels and the time that follow.

use egui::{Context, DragValue, RichText, Slider, Ui};
use strum::VariantArray;

use super::video_choice::{VideoAspect, VideoChoice, VideoFile, VideoHeight};
use super::{main_button, theme};
use crate::math::format;

/// Largest sides of an MP4's frames, px, and highest rate of a GIF.
const MP4_PX: [u32; 2] = [3840, 2160];
const GIF_FPS: f64 = 50.0;

/// Facts that the dialog shows.
pub(super) struct VideoFacts {
    /// Size of the view, px.
    pub(super) view_px: [u32; 2],
    pub(super) frames: usize,
    pub(super) secs: f64,
}

/// Draws the dialog; returns true to go on, false to close it, once that is decided.
pub(super) fn show(ctx: &Context, choice: &mut VideoChoice, fps: &mut f64, facts: &VideoFacts) -> Option<bool> {
    let response = theme::dialog("video").show(ctx, |ui| {
        ui.set_width((ctx.content_rect().width() - 80.0).min(520.0));
        ui.heading("Export video");
        ui.add_space(4.0);
        egui::Grid::new("video").num_columns(2).spacing([16.0, 8.0]).show(ui, |ui| {
            row(ui, "Format", &mut choice.file, VideoFile::title);
            ui.label("");
            ui.label(RichText::new(choice.file.about()).small().color(theme::weak()));
            ui.end_row();
            row(ui, "Size", &mut choice.height, VideoHeight::title);
            row(ui, "Aspect", &mut choice.aspect, VideoAspect::title);
            let rate = ui.label("Rate").id;
            ui.add(DragValue::new(fps).range(1.0..=120.0).speed(0.2).suffix(" frames/s")).labelled_by(rate);
            ui.end_row();
            if matches!(choice.file, VideoFile::Mp4 | VideoFile::WebP) {
                let quality = ui.label("Quality").id;
                ui.add(Slider::new(&mut choice.quality, 0..=100)).labelled_by(quality);
                ui.end_row();
            }
        });
        ui.checkbox(&mut choice.mark, "Highlight the answer to the query in every frame");
        ui.add_space(6.0);
        let [w, h] = choice.size_px(facts.view_px);
        let frames = format::things(facts.frames, "frame");
        ui.label(format!("{w} \u{d7} {h} px, {frames}, {:.1} s", facts.secs));
        let text = "The vertical field of view is that of the path; a wider video shows more at its sides.";
        ui.label(RichText::new(text).small().color(theme::weak()));
        let why = refusal(choice.file, [w, h], *fps);
        why.iter().for_each(|why| drop(ui.colored_label(theme::warning(), why)));
        ui.add_space(8.0);
        ui.horizontal(|ui| {
            let (save, steps) = main_button::stepping_button(ui, "video", "Save\u{2026}", why.is_none());
            choice.file = main_button::stepped(VideoFile::VARIANTS, choice.file, steps);
            let goes = save.clicked();
            let closes = ui.button("Cancel").clicked();
            (goes || closes).then_some(goes)
        })
        .inner
    });
    response.inner.or_else(|| response.should_close().then_some(false))
}

/// Reason for which the format cannot hold the video.
fn refusal(file: VideoFile, [w, h]: [u32; 2], fps: f64) -> Option<String> {
    let [most, least] = MP4_PX;
    match file {
        VideoFile::Mp4 if w.max(h) > most || w.min(h) > least => {
            Some(format!("MP4 holds {most} \u{d7} {least} px at most. Choose another size or format."))
        }
        VideoFile::Gif if fps > GIF_FPS => Some(format!("GIF shows {GIF_FPS} frames/s at most. Choose a lower rate.")),
        _ => None,
    }
}

/// A row of choices.
fn row<T: Copy + PartialEq + VariantArray + 'static>(
    ui: &mut Ui,
    name: &str,
    value: &mut T,
    title: fn(T) -> &'static str,
) {
    ui.label(name);
    ui.horizontal_wrapped(|ui| {
        for &one in T::VARIANTS {
            let label = ui.selectable_label(*value == one, title(one));
            if label.accessible_name(format!("{name} {}", title(one))).clicked() {
                *value = one;
            }
        }
    });
    ui.end_row();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_format_cannot_hold_is_refused_before_it_is_drawn() {
        assert_eq!(refusal(VideoFile::Mp4, [3840, 2160], 120.0), None);
        assert!(
            refusal(VideoFile::Mp4, [5120, 2160], 30.0).is_some()
                && refusal(VideoFile::Mp4, [3000, 3000], 30.0).is_some()
        );
        assert_eq!(refusal(VideoFile::WebP, [5120, 2160], 120.0), None);
        assert!(
            refusal(VideoFile::Gif, [854, 480], 60.0).is_some() && refusal(VideoFile::Gif, [854, 480], 50.0).is_none()
        );
    }
}
