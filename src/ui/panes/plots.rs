//! Plots of training: loss and PSNR against seconds or steps.

use egui::{Ui, Vec2b};
use egui_plot::{HoverPosition, Legend, Line, MarkerShape, Plot, PlotPoints, Points};

use super::super::layout::PlotAxis;
use super::super::state::TrainHistory;
use super::super::theme;
use crate::pipeline::observer::{Evaluation, StepMetrics};

/// PSNR over seconds of another training, with its name.
pub(crate) type PsnrCurve = (String, Vec<[f64; 2]>);

/// Draws both plots with a common horizontal axis. The `curves` are of other trainings, and drawn over
/// seconds only: how many steps they had does not matter to them.
pub(crate) fn show(ui: &mut Ui, history: &TrainHistory, curves: &[PsnrCurve], axis: &mut PlotAxis) {
    ui.horizontal(|ui| {
        theme::section(ui, "Quality");
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.selectable_value(axis, PlotAxis::Steps, "Steps");
            ui.selectable_value(axis, PlotAxis::Seconds, "Seconds");
            ui.weak("against");
        });
    });
    let over_secs = *axis == PlotAxis::Seconds;
    let x_step = |m: &StepMetrics| if *axis == PlotAxis::Seconds { m.secs } else { m.step as f64 };
    let x_eval = |e: &Evaluation| if *axis == PlotAxis::Seconds { e.secs } else { e.step as f64 };
    let psnr: Vec<[f64; 2]> = history.steps.iter().map(|m| [x_step(m), m.train_psnr]).filter(finite).collect();
    let held: Vec<[f64; 2]> = history.evaluations.iter().map(|e| [x_eval(e), e.psnr]).filter(finite).collect();
    plot("psnr", "PSNR (dB)", *axis)
        .legend(Legend::default().position(egui_plot::Corner::RightBottom).background_alpha(0.5))
        .show(ui, |p| {
            let colors = [theme::WARNING, theme::GOOD].into_iter().cycle();
            for ((name, curve), color) in curves.iter().zip(colors).filter(|_| over_secs) {
                p.line(Line::new(name.clone(), PlotPoints::from(curve.clone())).color(color).width(1.2));
            }
            p.line(Line::new("training photos", smooth(&psnr)).color(theme::WEAK).width(1.2));
            p.line(Line::new("held-out photos", PlotPoints::from(held.clone())).color(theme::ACCENT).width(2.0));
            p.points(
                Points::new("held-out photos", PlotPoints::from(held))
                    .shape(MarkerShape::Circle)
                    .radius(3.0)
                    .color(theme::ACCENT),
            );
        });
    theme::section(ui, "Loss (L1 + 0.2 D-SSIM)");
    let loss: Vec<[f64; 2]> = history.steps.iter().map(|m| [x_step(m), m.loss]).filter(finite).collect();
    plot("loss", "Loss", *axis).include_y(0.0).show(ui, |p| {
        p.line(Line::new("loss", smooth(&loss)).color(theme::ACCENT).width(1.5));
    });
}

fn plot(name: &'static str, quantity: &'static str, axis: PlotAxis) -> Plot<'static> {
    let unit = if axis == PlotAxis::Seconds { "s" } else { "steps" };
    Plot::new(name)
        .height(150.0)
        .show_background(false)
        .show_grid(Vec2b::new(true, true))
        .grid_color(theme::LINE)
        .allow_scroll(false)
        .include_x(0.0)
        .allow_boxed_zoom(false)
        .set_margin_fraction(egui::vec2(0.02, 0.08))
        .y_axis_min_width(34.0)
        .x_axis_formatter(move |mark, _| format!("{} {unit}", mark.value))
        .label_formatter(move |at| match at {
            HoverPosition::NearDataPoint { plot_name, position, .. } => {
                Some(format!("{plot_name}\n{quantity} {:.4}\n{:.1} {unit}", position.y, position.x))
            }
            HoverPosition::Elsewhere { .. } => None,
        })
}

fn finite(p: &[f64; 2]) -> bool {
    p.iter().all(|v| v.is_finite())
}

/// A running mean over about a fiftieth of the points: single photos differ more than training
/// changes from one step to the next.
fn smooth(points: &[[f64; 2]]) -> PlotPoints<'static> {
    let half = points.len() / 100;
    (0..points.len())
        .map(|i| {
            let near = &points[i.saturating_sub(half)..(i + half + 1).min(points.len())];
            [points[i][0], near.iter().map(|p| p[1]).sum::<f64>() / near.len() as f64]
        })
        .collect()
}
