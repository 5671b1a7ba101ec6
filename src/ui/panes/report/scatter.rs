//! Error over seconds as in the report's own plots: one style per knob, a label per point, the Pareto front, the spread
//! of repeats, zero in a band of its own.

use egui::{Color32, FontId, Response, Stroke, Ui, Vec2b};
use egui_plot::{Corner, HLine, Legend, Line, MarkerShape, Plot, PlotPoint, PlotPoints, PlotTransform, Points, VLine};

use super::super::super::theme;
use super::grid;
use crate::math::format;
use crate::measure::axes::PlotAxes;
use crate::measure::labels::{self, LabelBox};
use crate::measure::look::{MarkShape, look};
use crate::measure::{Measure, Point, Stage, table};

/// Largest distance of the pointer from a point that it picks, window points.
const NEAR: f32 = 14.0;
/// Distance of a label from its point that needs a line, window points.
const AWAY: f32 = 12.0;

pub(crate) struct Scatter<'a> {
    pub(crate) stage: &'a Stage,
    /// The same stage of another report, drawn hollow.
    pub(crate) second: Option<&'a Stage>,
    /// The measure on the vertical axis.
    pub(crate) measure: &'a Measure,
    /// The chosen point.
    pub(crate) selected: Option<&'a Point>,
}

impl<'a> Scatter<'a> {
    /// Draws the plot; returns the point that was clicked.
    pub(crate) fn show(&self, ui: &mut Ui, height: f32) -> Option<&'a Point> {
        let (stage, measure) = (self.stage, self.measure);
        let name = (stage.name.name(), measure.name.clone(), self.second.is_some());
        let stages: Vec<&Stage> = std::iter::once(stage).chain(self.second).collect();
        let Some(axes) = PlotAxes::of(&stages, measure) else {
            ui.weak("This metric was not measured.");
            return None;
        };
        let axes = &axes;
        let places = self.places(axes);
        let corner = free_corner(&places);
        let plot = Plot::new(name)
            .include_x(beside_legend(&places, corner, self.legend_width() / ui.available_width()))
            .include_y(axes.error.bounds().0)
            .height(height)
            .show_background(false)
            .show_grid(Vec2b::TRUE)
            .grid_color(theme::line())
            .allow_scroll(false)
            .show_crosshair(false)
            .set_margin_fraction(egui::vec2(0.06, 0.1))
            .x_axis_label(format!("seconds of {}", stage.secs_of))
            .y_axis_label(format!("{}: less is better", measure.error_name()))
            .y_axis_min_width(46.0)
            .x_grid_spacer(|input| grid::marks(&axes.secs, &input))
            .y_grid_spacer(|input| grid::marks(&axes.error, &input))
            .x_axis_formatter(|mark, _| grid::label(&axes.secs, mark, format::tick_secs))
            .y_axis_formatter(|mark, _| grid::label(&axes.error, mark, format::tick))
            .label_formatter(|_| None)
            .legend(Legend::default().position(corner).text_style(egui::TextStyle::Small).background_alpha(0.6));
        let shown = plot.show(ui, |p| {
            // Beyond these lines is the band of zero, which has no logarithm.
            let style = Stroke::new(1.0, theme::weak());
            let lines = [axes.secs.band_end(), axes.error.band_end()];
            lines[0].into_iter().for_each(|at| p.vline(VLine::new("", at).stroke(style).allow_hover(false)));
            lines[1].into_iter().for_each(|at| p.hline(HLine::new("", at).stroke(style).allow_hover(false)));
            self.items(axes).into_iter().for_each(|item| item.add_to(p));
        });
        self.name_points(ui, axes, &shown.transform);
        shown.response.clone().accessible_name(format!("Plot of {} against run time", measure.error_name()));
        let nearest = self.nearest(axes, &shown.response, &shown.transform);
        if let Some(point) = nearest {
            let stage = if self.second.is_some_and(|s| s.points.iter().any(|p| std::ptr::eq(p, point))) {
                "in the second report"
            } else {
                ""
            };
            shown.response.clone().on_hover_ui_at_pointer(|ui| facts(ui, point, &self.stage.measures, stage));
        }
        nearest.filter(|_| shown.response.clicked())
    }

    /// Positions of the points.
    fn places(&self, axes: &PlotAxes) -> Vec<[f64; 2]> {
        let both = self.stage.points.iter().chain(self.second.into_iter().flat_map(|s| &s.points));
        both.filter_map(|p| axes.place(p, self.measure)).collect()
    }

    /// Draws the setting beside every visible point, with a thin line to it if it is far.
    fn name_points(&self, ui: &Ui, axes: &PlotAxes, transform: &PlotTransform) {
        let (frame, methods) = (*transform.frame(), self.stage.methods());
        let painter = ui.painter_at(frame);
        let named = |p: &Point| {
            let [x, y] = axes.place(p, self.measure)?;
            let at = transform.position_from_point(&PlotPoint::new(x, y));
            let color = color(methods.iter().position(|m| *m == p.method).unwrap_or(0));
            let text = painter.layout_no_wrap(p.label(), FontId::proportional(10.5), color);
            frame.contains(at).then_some((at, text, color))
        };
        let named: Vec<_> = self.stage.points.iter().filter_map(named).collect();
        let points: Vec<[f32; 2]> = named.iter().map(|n| [n.0.x, n.0.y]).collect();
        let sizes: Vec<[f32; 2]> = named.iter().map(|n| [n.1.size().x, n.1.size().y]).collect();
        let frame = LabelBox { min: [frame.min.x, frame.min.y], size: [frame.width(), frame.height()] };
        for ((at, text, color), place) in named.into_iter().zip(labels::place(&points, &sizes, frame)) {
            let near: egui::Pos2 = place.nearest([at.x, at.y]).into();
            if near.distance(at) > AWAY {
                painter.line_segment([at, near], Stroke::new(0.6, color.gamma_multiply(0.7)));
            }
            let ground = egui::Rect::from_min_size(place.min.into(), text.size());
            painter.rect_filled(ground, 2.0, theme::surface().gamma_multiply(0.7));
            painter.galley(ground.min, text, color);
        }
    }

    /// Approximate width of the legend, screen points.
    fn legend_width(&self) -> f32 {
        let longest = self.stage.methods().iter().map(|m| m.chars().count()).max().unwrap_or(0);
        30.0 + 6.0 * longest as f32
    }

    /// The point under the pointer.
    fn nearest(&self, axes: &PlotAxes, response: &Response, transform: &PlotTransform) -> Option<&'a Point> {
        let pointer = response.hover_pos()?;
        let all = self.stage.points.iter().chain(self.second.into_iter().flat_map(|s| &s.points));
        let far = |p: &'a Point| {
            let [x, y] = axes.place(p, self.measure)?;
            Some((p, transform.position_from_point(&PlotPoint::new(x, y)).distance(pointer)))
        };
        let near = all.filter_map(far).filter(|(_, d)| *d <= NEAR);
        near.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(p, _)| p)
    }

    /// All items of the plot, from back to front.
    fn items(&self, axes: &PlotAxes) -> Vec<Item> {
        let mut items = vec![self.front(axes)];
        let methods = self.stage.methods();
        for (k, method) in methods.iter().enumerate() {
            self.series(axes, method, k, &mut items);
        }
        for p in self.second.into_iter().flat_map(|s| &s.points) {
            // Knobs that only the second report has are gray.
            let k = methods.iter().position(|m| *m == p.method);
            let color = k.map_or(theme::weak(), color);
            let shape = k.map_or(MarkerShape::Circle, shape);
            if let Some(at) = axes.place(p, self.measure) {
                let hollow = Points::new("second report", vec![at]).shape(shape).filled(false);
                items.push(Item::Points(hollow.radius(5.5).color(color)));
            }
        }
        if let Some(at) = self.selected.and_then(|p| axes.place(p, self.measure)) {
            let ring = Points::new("", vec![at]).radius(10.0).filled(false).color(theme::text());
            items.push(Item::Points(ring));
        }
        items
    }

    /// Rings around points that no other beats by more than the spread of repeats.
    fn front(&self, axes: &PlotAxes) -> Item {
        let points = self.stage.front(self.measure).into_iter();
        let places: Vec<[f64; 2]> = points.filter_map(|i| axes.place(&self.stage.points[i], self.measure)).collect();
        let rings = Points::new("on the front", PlotPoints::from(places)).radius(9.5);
        Item::Points(rings.color(theme::text().gamma_multiply(0.28)).allow_hover(false))
    }

    fn series(&self, axes: &PlotAxes, method: &str, k: usize, items: &mut Vec<Item>) {
        let color = color(k);
        let points: Vec<&Point> = self.stage.points.iter().filter(|p| p.method == method).collect();
        // Only one item may have the series' name and color: the legend shows one.
        let line = |name: &str, places: Vec<[f64; 2]>, style: Stroke| {
            Item::Line(Line::new(name, PlotPoints::from(places)).stroke(style).allow_hover(false))
        };
        let ways = points.iter().map(|p| axes.way(self.stage, p, self.measure)).filter(|way| way.len() > 1);
        let faint = Stroke::new(1.0, color.gamma_multiply(0.4));
        items.extend(ways.map(|way| line("", way, faint)));
        // In the order of the settings: an order by time would zigzag with its noise.
        let places: Vec<[f64; 2]> = points.iter().filter_map(|p| axes.place(p, self.measure)).collect();
        items.push(line(method, places.clone(), Stroke::new(0.8, color)));
        let whiskers = points.iter().flat_map(|p| axes.whiskers(p, self.measure));
        items.extend(whiskers.map(|w| line(method, w.to_vec(), Stroke::new(1.6, color))));
        let radius = if points.iter().any(|p| p.default) { 6.5 } else { 4.0 };
        let marks = Points::new(method, PlotPoints::from(places)).shape(shape(k)).radius(radius);
        items.push(Item::Points(marks.color(color)));
    }
}

/// Least extent of the plot along x, so that a legend in `corner`, as wide as this share of it, hides no place.
fn beside_legend(places: &[[f64; 2]], corner: Corner, share: f32) -> f64 {
    let (least, most) = places.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), p| (l.min(p[0]), m.max(p[0])));
    if !(least < most) {
        return if least.is_finite() { least } else { 0.0 };
    }
    let share = f64::from(share).clamp(0.0, 0.5);
    let room = (most - least) * share / (1.0 - share);
    if matches!(corner, Corner::LeftTop | Corner::LeftBottom) { least - room } else { most + room }
}

/// The corner of their range with the fewest places.
fn free_corner(places: &[[f64; 2]]) -> Corner {
    let middle = |axis: usize| {
        let all = places.iter().map(|p| p[axis]);
        0.5 * (all.clone().fold(f64::INFINITY, f64::min) + all.fold(f64::NEG_INFINITY, f64::max))
    };
    let (x, y) = (middle(0), middle(1));
    let corners = [
        (Corner::RightTop, true, true),
        (Corner::RightBottom, true, false),
        (Corner::LeftBottom, false, false),
        (Corner::LeftTop, false, true),
    ];
    let inside = |right: bool, top: bool| places.iter().filter(|p| (p[0] >= x) == right && (p[1] >= y) == top).count();
    let free = corners.into_iter().min_by_key(|(_, right, top)| inside(*right, *top));
    free.map_or(Corner::RightTop, |c| c.0)
}

/// An item of the plot.
enum Item {
    Line(Line<'static>),
    Points(Points<'static>),
}

impl Item {
    fn add_to(self, plot: &mut egui_plot::PlotUi<'_>) {
        match self {
            Self::Line(line) => plot.line(line),
            Self::Points(points) => plot.points(points),
        }
    }
}

/// Color of a knob by number: that of the report's own plots, lighter for a dark background.
pub(crate) fn color(k: usize) -> Color32 {
    let [r, g, b] = look(k).color.map(|v| v + (255 - v) / 4);
    Color32::from_rgb(r, g, b)
}

fn shape(k: usize) -> MarkerShape {
    match look(k).shape {
        MarkShape::Circle => MarkerShape::Circle,
        MarkShape::Square => MarkerShape::Square,
        MarkShape::Diamond => MarkerShape::Diamond,
        MarkShape::Up => MarkerShape::Up,
        MarkShape::Down => MarkerShape::Down,
        MarkShape::Left => MarkerShape::Left,
        MarkShape::Right => MarkerShape::Right,
    }
}

/// Draws all measurements of a point.
pub(crate) fn facts(ui: &mut Ui, point: &Point, measures: &[Measure], whose: &str) {
    ui.strong(format!("{}: {}", point.method, point.setting));
    let repeats = point.secs.each.len();
    let default = if point.default { "program's default, " } else { "" };
    let whose = if whose.is_empty() { String::new() } else { format!(", {whose}") };
    ui.weak(format!(
        "{default}measured {}{whose}",
        if repeats == 1 { "once".into() } else { format!("{repeats} times") }
    ));
    egui::Grid::new(("facts", &point.method, &point.setting, whose))
        .num_columns(2)
        .spacing([14.0, 1.0])
        .min_row_height(17.0)
        .show(ui, |ui| {
            ui.label("time");
            ui.label(table::spread(&point.secs, format::seconds));
            ui.end_row();
            for measure in measures {
                let Some(value) = point.values.get(&measure.name) else { continue };
                ui.label(table::title(measure)).on_hover_text(&measure.meaning);
                ui.label(table::spread(value, format::number));
                ui.end_row();
            }
        });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plot_reaches_beside_its_legend() {
        let places = [[1.0, 0.0], [4.0, 2.0], [2.0, 1.0]];
        assert!((beside_legend(&places, Corner::RightTop, 0.25) - 5.0).abs() < 1e-6);
        assert!((beside_legend(&places, Corner::LeftBottom, 0.25) - 0.0).abs() < 1e-6);
        // In a narrow plot the legend takes half the width at most.
        assert!((beside_legend(&places, Corner::RightTop, 3.0) - 7.0).abs() < 1e-6);
        assert_eq!(
            (beside_legend(&places[..1], Corner::RightTop, 0.5), beside_legend(&[], Corner::LeftTop, 0.5)),
            (1.0, 0.0)
        );
    }

    #[test]
    fn the_legend_goes_where_nothing_is() {
        let falling = [[0.0, 1.0], [0.1, 0.9], [0.9, 0.1], [1.0, 0.0]];
        assert_eq!(free_corner(&falling), Corner::RightTop);
        let with_slow_and_bad = [falling.as_slice(), &[[1.0, 1.0]]].concat();
        assert_eq!(free_corner(&with_slow_and_bad), Corner::LeftBottom);
        assert_eq!(free_corner(&[]), Corner::RightTop);
    }

    #[test]
    fn series_differ_in_color_or_shape() {
        let looks: Vec<_> = (0..70).map(|k| (color(k), shape(k))).collect();
        assert!((0..70).all(|i| (0..i).all(|j| looks[i] != looks[j])));
        assert!((0..10).all(|i| (0..i).all(|j| color(i) != color(j))));
    }
}
