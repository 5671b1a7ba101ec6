//! The plot of training: PSNR or loss against seconds or steps.

use egui::{Color32, RichText, Sense, Shape, Slider, Stroke, Ui, Vec2b, vec2};
use egui_plot::{GridMark, HoverPosition, Line, LineStyle, MarkerShape, Plot, PlotPoints, Points};

use super::super::layout::{PlotAxis, PlotQuantity, PlotSettings};
use super::super::paired::paired;
use super::super::state::TrainHistory;
use super::super::theme;
use crate::math::format;
use crate::math::ticks::round_step;
use crate::pipeline::observer::{Evaluation, StepMetrics};

/// Least width of the vertical axis, points.
const Y_AXIS_PT: f32 = 34.0;
/// Least distance of the numbers of the horizontal axis, points.
const MARK_PT: f64 = 80.0;
/// Length of a line beside its name, points.
const SIGN_PT: f32 = 18.0;
/// Width of a letter of an axis, points.
const LETTER_PT: f64 = 8.0;

/// PSNR over seconds of another training, with its name.
pub(crate) type PsnrCurve = (String, Vec<[f64; 2]>);

/// Draws the plot: this training and the previous one. `curves` are of other trainings, over seconds only.
pub(crate) fn show(
    ui: &mut Ui,
    [history, previous]: [&TrainHistory; 2],
    curves: &[PsnrCurve],
    settings: &mut PlotSettings,
) {
    ui.add_space(6.0);
    ui.horizontal(|ui| {
        ui.selectable_value(&mut settings.quantity, PlotQuantity::Psnr, "PSNR (dB)");
        ui.selectable_value(&mut settings.quantity, PlotQuantity::Loss, "Loss");
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.selectable_value(&mut settings.axis, PlotAxis::Steps, "Steps");
            ui.selectable_value(&mut settings.axis, PlotAxis::Seconds, "Seconds");
        });
    });
    ui.horizontal_wrapped(|ui| {
        paired(ui, "Smoothing".into(), 180.0, |ui, label| {
            let smoothing = Slider::new(&mut settings.smoothing, 0.0..=20.0).suffix(" %").fixed_decimals(0);
            ui.add(smoothing).labelled_by(label);
        });
        if settings.quantity == PlotQuantity::Loss {
            ui.checkbox(&mut settings.log, "Log scale");
            ui.weak("L1 + 0.2 D-SSIM");
        }
    });
    let PlotSettings { smoothing, log, .. } = *settings;
    let smooth = |points: &[[f64; 2]]| smooth(points, smoothing);
    let axis = &settings.axis;
    let over_secs = *axis == PlotAxis::Seconds;
    let x_step = |m: &StepMetrics| if *axis == PlotAxis::Seconds { m.secs } else { m.step as f64 };
    let x_eval = |e: &Evaluation| if *axis == PlotAxis::Seconds { e.secs } else { e.step as f64 };
    let psnr = |h: &TrainHistory| h.steps.iter().map(|m| [x_step(m), m.train_psnr]).filter(finite).collect::<Vec<_>>();
    let held = |h: &TrainHistory| h.evaluations.iter().map(|e| [x_eval(e), e.psnr]).filter(finite).collect::<Vec<_>>();
    let loss = |h: &TrainHistory| {
        let shown = |loss: f64| if log { loss.log10() } else { loss };
        h.steps.iter().map(|m| [x_step(m), shown(m.loss)]).filter(finite).collect::<Vec<_>>()
    };
    let before = !previous.steps.is_empty();
    let dashed = |name: &str, points: &[[f64; 2]]| {
        Line::new(name, smooth(points)).color(theme::weak()).width(1.2).style(LineStyle::dashed_loose())
    };
    if settings.quantity == PlotQuantity::Loss {
        let loss_plot = plot(ui, "loss", if log { "log10 loss" } else { "Loss" }, *axis);
        let loss_plot = match log {
            true => loss_plot.y_axis_formatter(|mark, _| format!("{:.2e}", 10_f64.powf(mark.value))),
            false => loss_plot.include_y(0.0),
        };
        let loss_plot = loss_plot.show(ui, |p| {
            if before {
                p.line(dashed("before", &loss(previous)));
            }
            p.line(Line::new("loss", smooth(&loss(history))).color(theme::accent()).width(1.5));
        });
        loss_plot.response.accessible_name("Plot of the loss");
        return;
    }
    let colors = [theme::warning(), theme::good()].into_iter().cycle();
    let curves = || curves.iter().zip(colors.clone()).filter(|_| over_secs);
    let mut named: Vec<(&str, Color32, bool)> = curves().map(|((name, _), color)| (&**name, color, false)).collect();
    named.extend([("training photos", theme::weak(), false), ("held-out photos", theme::accent(), false)]);
    if before {
        named.push(("previous run", theme::weak(), true));
        if !previous.evaluations.is_empty() {
            named.push(("its held-out photos", theme::warning(), true));
        }
    }
    names(ui, &named);
    let psnr_plot = plot(ui, "psnr", "PSNR (dB)", *axis).show(ui, |p| {
        for ((name, curve), color) in curves() {
            p.line(Line::new(name.clone(), PlotPoints::from(curve.clone())).color(color).width(1.2));
        }
        if before {
            p.line(dashed("training photos (previous run)", &psnr(previous)));
            let held = PlotPoints::from(held(previous));
            p.line(
                Line::new("held-out photos (previous run)", held)
                    .color(theme::warning())
                    .width(1.4)
                    .style(LineStyle::dashed_loose()),
            );
        }
        let held = held(history);
        p.line(Line::new("training photos", smooth(&psnr(history))).color(theme::weak()).width(1.2));
        p.line(Line::new("held-out photos", PlotPoints::from(held.clone())).color(theme::accent()).width(2.0));
        p.points(
            Points::new("held-out photos", PlotPoints::from(held))
                .shape(MarkerShape::Circle)
                .radius(3.0)
                .color(theme::accent()),
        );
    });
    psnr_plot.response.accessible_name("Plot of PSNR");
}

/// Draws the names of lines, each with its color and whether it is dashed, above the plot, where they cover nothing.
fn names(ui: &mut Ui, lines: &[(&str, Color32, bool)]) {
    ui.horizontal_wrapped(|ui| {
        for (name, color, is_dashed) in lines {
            paired(ui, RichText::new(*name).small().color(theme::weak()), SIGN_PT, |ui, _| {
                let (rect, _) = ui.allocate_exact_size(vec2(SIGN_PT, 8.0), Sense::hover());
                let (ends, stroke) = ([rect.left_center(), rect.right_center()], Stroke::new(2.0, *color));
                if *is_dashed {
                    ui.painter().extend(Shape::dashed_line(&ends, stroke, 4.0, 3.0));
                } else {
                    ui.painter().line_segment(ends, stroke);
                }
            });
        }
    });
}

fn plot(ui: &Ui, name: &'static str, quantity: &'static str, axis: PlotAxis) -> Plot<'static> {
    let unit = if axis == PlotAxis::Seconds { "s" } else { "steps" };
    let width = f64::from(ui.available_width() - Y_AXIS_PT).max(1.0);
    Plot::new(name)
        .height(180.0)
        .show_background(false)
        .show_grid(Vec2b::new(true, true))
        .grid_color(theme::line())
        .allow_scroll(false)
        .include_x(0.0)
        .allow_boxed_zoom(false)
        .set_margin_fraction(egui::vec2(0.02, 0.08))
        .y_axis_min_width(Y_AXIS_PT)
        .x_grid_spacer(move |grid| round_marks(grid.bounds.into(), width))
        .x_axis_formatter(move |mark, range| {
            let text = format!("{} {unit}", format::tick(mark.value));
            let to_border = (range.end() - mark.value) / (range.end() - range.start()) * width;
            // A number that the border would cut is left out.
            if to_border < 0.5 * LETTER_PT * text.len() as f64 { String::new() } else { text }
        })
        .label_formatter(move |at| match at {
            HoverPosition::NearDataPoint { plot_name, position, .. } => {
                Some(format!("{plot_name}\n{quantity} {:.4}\n{:.1} {unit}", position.y, position.x))
            }
            HoverPosition::Elsewhere { .. } => None,
        })
}

/// Marks of the horizontal axis: round values, far enough apart for their numbers.
fn round_marks([from, to]: [f64; 2], width: f64) -> Vec<GridMark> {
    let step_size = round_step((to - from) * MARK_PT / width);
    let (first, last) = ((from / step_size).ceil() as i64, (to / step_size).floor() as i64);
    (first..=last).take(200).map(|i| GridMark { value: i as f64 * step_size, step_size }).collect()
}

fn finite(p: &[f64; 2]) -> bool {
    p.iter().all(|v| v.is_finite())
}

/// A running mean over `percent` of the points: single photos differ more than training changes from one step to the
/// next.
fn smooth(points: &[[f64; 2]], percent: f32) -> PlotPoints<'static> {
    let half = (points.len() as f32 * percent / 200.0) as usize;
    (0..points.len())
        .map(|i| {
            let near = &points[i.saturating_sub(half)..(i + half + 1).min(points.len())];
            [points[i][0], near.iter().map(|p| p[1]).sum::<f64>() / near.len() as f64]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_has_several_round_marks_at_any_length() {
        for seconds in [0.3, 9.0, 75.0, 100.0, 4000.0] {
            let marks = round_marks([-0.02 * seconds, 1.02 * seconds], 300.0);
            assert!((2..=4).contains(&marks.len()) && marks[0].value == 0.0, "{seconds}: {marks:?}");
        }
        // Control: in a narrow plot there is room for fewer.
        assert!(round_marks([0.0, 75.0], 120.0).len() < round_marks([0.0, 75.0], 600.0).len());
    }

    #[test]
    fn smoothing_is_a_running_mean_and_none_changes_nothing() {
        let points: Vec<[f64; 2]> = (0..100).map(|i| [f64::from(i), f64::from(i % 2)]).collect();
        let values = |percent: f32| smooth(&points, percent).points().iter().map(|p| p.y).collect::<Vec<_>>();
        assert_eq!(values(0.0), points.iter().map(|p| p[1]).collect::<Vec<_>>());
        assert!(values(20.0)[20..80].iter().all(|v| (v - 0.5).abs() < 0.05), "the zigzag is gone");
        assert_eq!(smooth(&[], 5.0).points().len(), 0);
    }
}
