//! A stage as an image that reads by itself: error over seconds, both logarithmic, zero in a band of its own; a look
//! per knob, every point with its setting, the front under them, the spread of repeats through them.

use super::axes::PlotAxes;
use super::axis::{LogAxis, Tick};
use super::document::{Measure, Point, Report, Stage};
use super::labels::{self, LabelBox};
use super::look::{KnobLook, look};
use super::svg::{Anchor, BLACK, Svg, SvgStroke, lines, width};
use crate::math::format;
use crate::scene::text;

const SIZE: [f64; 2] = [1000.0, 620.0];
/// The part for the points: least corner and size. The legend is beside it, the notes are below.
const FRAME: Frame = Frame { min: [82.0, 52.0], size: [700.0, 452.0] };
const GRAY: [u8; 3] = [90; 3];
/// Size of labels, of numbers at axes and of the legend.
const SMALL: f64 = 11.0;
/// Radius of a mark, and of a default's.
const RADIUS: [f64; 2] = [4.2, 6.5];
/// Letters of a knob's name in the legend.
const MOST_LETTERS: usize = 27;

/// The part of an image where points are.
#[derive(Clone, Copy)]
struct Frame {
    min: [f64; 2],
    size: [f64; 2],
}

impl Frame {
    /// The place of a pair of coordinates of these axes.
    fn place(&self, axes: &PlotAxes, at: [f64; 2]) -> [f64; 2] {
        [self.x(&axes.secs, at[0]), self.y(&axes.error, at[1])]
    }

    fn x(&self, axis: &LogAxis, at: f64) -> f64 {
        self.min[0] + self.size[0] * share(axis, at)
    }

    fn y(&self, axis: &LogAxis, at: f64) -> f64 {
        self.min[1] + self.size[1] * (1.0 - share(axis, at))
    }

    fn bottom(&self) -> f64 {
        self.min[1] + self.size[1]
    }

    fn right(&self) -> f64 {
        self.min[0] + self.size[0]
    }

    /// Grid, numbers and names of both axes.
    fn draw(&self, svg: &mut Svg, axes: &PlotAxes, [x_name, y_name]: [&str; 2], number: fn(f64) -> String) {
        let (right, bottom) = (self.right(), self.bottom());
        for (axis, is_x) in [(&axes.secs, true), (&axes.error, false)] {
            let line = |at: f64| match is_x {
                true => [[self.x(axis, at), self.min[1]], [self.x(axis, at), bottom]],
                false => [[self.min[0], self.y(axis, at)], [right, self.y(axis, at)]],
            };
            let name = |svg: &mut Svg, at: f64, text: &str| match is_x {
                true => svg.text([self.x(axis, at), bottom + 16.0], Anchor::Middle, SMALL, BLACK, text),
                false => svg.text([self.min[0] - 7.0, self.y(axis, at) + 4.0], Anchor::End, SMALL, BLACK, text),
            };
            for Tick { at, named } in axis.ticks() {
                svg.line(&line(at), SvgStroke(BLACK, 1.0, if named { 0.14 } else { 0.05 }));
                if named {
                    let value = 10.0_f64.powf(at);
                    name(svg, at, &if is_x { number(value) } else { format::tick(value) });
                }
            }
            if let Some(end) = axis.band_end() {
                let [from, to] = line(end);
                let corner = if is_x { [self.min[0], self.min[1]] } else { from };
                let size = if is_x { [to[0] - self.min[0], self.size[1]] } else { [self.size[0], bottom - from[1]] };
                svg.area(corner, size, BLACK, 0.05);
                svg.line(&[from, to], SvgStroke(GRAY, 1.0, 0.6));
                name(svg, axis.at(0.0), axis.zero_name());
                // Two strokes across the axis: what is beyond is no continuation of it.
                for k in [-2.5, 2.5] {
                    let at = if is_x { [from[0] + k, bottom] } else { [self.min[0], from[1] + k] };
                    let ends = [[at[0] - 4.0, at[1] + 3.0], [at[0] + 4.0, at[1] - 3.0]];
                    svg.line(&ends, SvgStroke(BLACK, 1.2, 1.0));
                }
            }
        }
        svg.line(&[self.min, [self.min[0], bottom], [right, bottom]], SvgStroke(BLACK, 1.2, 0.8));
        svg.text([self.min[0] + 0.5 * self.size[0], bottom + 36.0], Anchor::Middle, 13.0, BLACK, x_name);
        svg.text_upward([self.min[0] - 62.0, self.min[1] + 0.5 * self.size[1]], 13.0, y_name);
    }
}

fn share(axis: &LogAxis, at: f64) -> f64 {
    let (low, high) = axis.bounds();
    (at - low) / (high - low)
}

/// The plot of a measure of a stage; `None` if it was not taken.
pub(crate) fn svg(report: &Report, stage: &Stage, measure: &Measure) -> Option<String> {
    let axes = PlotAxes::of(&[stage], measure)?;
    let mut svg = Svg::new(SIZE);
    let title = format!("{}: {} over time", stage.name.title(), measure.error_name());
    svg.text([FRAME.min[0], 24.0], Anchor::Start, 17.0, BLACK, &title);
    svg.text([FRAME.min[0], 42.0], Anchor::Start, SMALL, GRAY, &text::elided(&report.scene, 110));
    let names = [&*format!("seconds of {}", stage.secs_of), &*format!("{}: less is better", measure.error_name())];
    FRAME.draw(&mut svg, &axes, names, format::tick_secs);
    front(&mut svg, &axes, stage, measure);
    let methods = stage.methods();
    for (k, method) in methods.iter().enumerate() {
        series(&mut svg, &axes, (stage, measure), method, look(k));
    }
    name_points(&mut svg, &axes, (stage, measure), &methods);
    legend(&mut svg, &axes, (stage, measure), &methods);
    let notes = format!(
        "Medians; bars reach from the least to the most of the runs ({}). {}. FMLGS {}.",
        stage.runs(),
        report.computer.words(),
        report.program
    );
    for (k, line) in lines(&notes, SMALL, SIZE[0] - 40.0).iter().take(3).enumerate() {
        svg.text([20.0, FRAME.bottom() + 62.0 + 15.0 * k as f64], Anchor::Start, SMALL, GRAY, line);
    }
    Some(svg.finish(&format!("{title}, {}", report.scene)))
}

/// Rings around what is on the front, and a wide pale line along the best of it.
fn front(svg: &mut Svg, axes: &PlotAxes, stage: &Stage, measure: &Measure) {
    let on = stage.front(measure).into_iter().filter_map(|i| axes.place(&stage.points[i], measure));
    let on: Vec<[f64; 2]> = on.map(|at| FRAME.place(axes, at)).collect();
    let mut along: Vec<[f64; 2]> = Vec::new();
    for at in &on {
        // Downward is better.
        if along.last().is_none_or(|best| at[1] > best[1]) {
            along.push(*at);
        }
    }
    svg.line(&along, SvgStroke(BLACK, 8.0, 0.1));
    on.iter().for_each(|at| svg.halo(*at, 8.5, SvgStroke(BLACK, 3.0, 0.3)));
}

fn series(svg: &mut Svg, axes: &PlotAxes, (stage, measure): (&Stage, &Measure), method: &str, look: KnobLook) {
    let points: Vec<&Point> = stage.points.iter().filter(|p| p.method == method).collect();
    let placed = |at: &[f64; 2]| FRAME.place(axes, *at);
    for p in &points {
        let way: Vec<[f64; 2]> = axes.way(stage, p, measure).iter().map(placed).collect();
        if way.len() > 1 {
            svg.line(&way, SvgStroke(look.color, 1.0, 0.35));
        }
        for ends in axes.whiskers(p, measure) {
            svg.line(&ends.map(|at| placed(&at)), SvgStroke(look.color, 1.6, 0.55));
        }
    }
    // In the order of the settings: times in the order of their noise would zigzag.
    let placed = |p: &&Point| Some((placed(&axes.place(p, measure)?), p.default));
    let line: Vec<([f64; 2], bool)> = points.iter().filter_map(placed).collect();
    let places: Vec<[f64; 2]> = line.iter().map(|l| l.0).collect();
    svg.line(&places, SvgStroke(look.color, 1.0, 0.5));
    line.iter().for_each(|(at, default)| svg.mark(look, *at, RADIUS[usize::from(*default)]));
}

/// The setting beside every point, with a thin line to it where it had to go away.
fn name_points(svg: &mut Svg, axes: &PlotAxes, (stage, measure): (&Stage, &Measure), methods: &[&str]) {
    let named = |p: &Point| {
        let at = FRAME.place(axes, axes.place(p, measure)?);
        let k = methods.iter().position(|m| *m == p.method).unwrap_or(0);
        Some((at, p.label(), look(k).color))
    };
    let named: Vec<([f64; 2], String, [u8; 3])> = stage.points.iter().filter_map(named).collect();
    let single = |v: [f64; 2]| v.map(|v| v as f32);
    let points: Vec<[f32; 2]> = named.iter().map(|n| single(n.0)).collect();
    let sizes: Vec<[f32; 2]> = named.iter().map(|n| single([width(&n.1, SMALL) + 3.0, SMALL + 1.0])).collect();
    let places = labels::place(&points, &sizes, LabelBox { min: single(FRAME.min), size: single(FRAME.size) });
    for ((at, label, color), place) in named.iter().zip(places) {
        let dark = color.map(|v| (f64::from(v) * 0.72) as u8);
        let near = place.nearest(single(*at)).map(f64::from);
        if (near[0] - at[0]).hypot(near[1] - at[1]) > 12.0 {
            svg.line(&[*at, near], SvgStroke(dark, 0.6, 0.7));
        }
        let base = [f64::from(place.min[0]), f64::from(place.min[1]) + SMALL - 1.5];
        svg.label(base, SMALL, dark, label);
    }
}

/// The knobs that have a point here.
fn legend(svg: &mut Svg, axes: &PlotAxes, (stage, measure): (&Stage, &Measure), methods: &[&str]) {
    let x = FRAME.right() + 18.0;
    let mut y = FRAME.min[1] + 4.0;
    let mut row = |svg: &mut Svg, name: &str, mark: &dyn Fn(&mut Svg, [f64; 2])| {
        mark(svg, [x, y]);
        svg.text([x + 14.0, y + 4.0], Anchor::Start, SMALL, BLACK, name);
        y += 18.0;
    };
    for (k, method) in methods.iter().enumerate() {
        let mut drawn =
            stage.points.iter().filter(|p| p.method == *method && axes.place(p, measure).is_some()).peekable();
        if drawn.peek().is_none() {
            continue;
        }
        let is_default = drawn.any(|p| p.default);
        let mark = |svg: &mut Svg, at| svg.mark(look(k), at, RADIUS[usize::from(is_default)]);
        row(svg, &text::elided(method, MOST_LETTERS), &mark);
    }
    row(svg, "on the front: nothing is better", &|svg, at| svg.halo(at, 7.0, SvgStroke(BLACK, 3.0, 0.3)));
    row(svg, "by more than repeats differ", &|_, _| {});
}

/// An order of convergence: error over work, with the slope that theory gives.
pub(crate) fn order_svg(order: &super::order::Order) -> Option<String> {
    let pairs: Vec<[f64; 2]> = order.pairs.iter().filter(|p| p[0] > 0.0 && p[1].is_finite()).copied().collect();
    let first = pairs.iter().find(|p| p[1] > 0.0)?;
    let axes =
        PlotAxes { secs: LogAxis::of(pairs.iter().map(|p| p[0]))?, error: LogAxis::of(pairs.iter().map(|p| p[1]))? };
    let frame = Frame { min: [78.0, 34.0], size: [330.0, 212.0] };
    let mut svg = Svg::new([430.0, 300.0]);
    svg.text([12.0, 20.0], Anchor::Start, 13.0, BLACK, &text::elided(&order.what, 60));
    frame.draw(&mut svg, &axes, ["work", "error"], format::tick);
    let at = |[work, error]: [f64; 2]| frame.place(&axes, [axes.secs.at(work), axes.error.at(error)]);
    let last = pairs.last().copied().unwrap_or(*first);
    // As far as theory stays within what was seen.
    let least = pairs.iter().map(|p| p[1]).filter(|e| *e > 0.0).fold(first[1], f64::min);
    let end = (first[0] * (first[1] / least).powf(1.0 / order.expected)).min(last[0]);
    if order.expected > 0.0 && end > first[0] {
        let slope = [end, first[1] * (end / first[0]).powf(-order.expected)];
        svg.line(&[at(*first), at(slope)], SvgStroke(BLACK, 5.0, 0.15));
    }
    let places: Vec<[f64; 2]> = pairs.iter().map(|p| at(*p)).collect();
    svg.line(&places, SvgStroke(look(0).color, 1.0, 0.6));
    places.iter().for_each(|p| svg.mark(look(0), *p, RADIUS[0]));
    Some(svg.finish(&order.what))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::tests::example;

    fn drawn(report: &Report) -> Option<String> {
        svg(report, &report.stages[0], &report.stages[0].measures[0])
    }

    #[test]
    fn every_point_is_drawn_and_named() {
        let report = example();
        let image = drawn(&report).expect("drawn");
        // Four points and two in the legend.
        assert_eq!(image.matches("class=\"mark\"").count(), 4 + 2);
        for label in ["default", "1/64", "1/16", "1/1000"] {
            assert!(image.contains(&format!(">{label}</text>")), "{label}");
        }
        for said in ["cut-off", "seconds of one frame", "RMS: less is better", "each setting 3 times", "one, 2 cores"] {
            assert!(image.contains(said), "{said}");
        }
        assert!(image.ends_with("</svg>\n"));
        let mut empty = example();
        empty.stages[0].points.clear();
        assert!(drawn(&empty).is_none());
    }

    #[test]
    fn nothing_is_drawn_as_zero_but_zero() {
        let mut report = example();
        assert!(!drawn(&report).expect("drawn").contains(">0</text>"), "the control");
        let perfect = report.stages[0].points[1].values.get_mut("RMS").expect("measured");
        *perfect = [0.0, 0.0, 0.0].into_iter().collect();
        let image = drawn(&report).expect("drawn");
        assert_eq!(image.matches(">0</text>").count(), 1, "the band has its number");
        assert!(!image.contains("1e-7"), "and no other");
    }

    #[test]
    fn both_axes_have_numbers_whatever_was_measured() {
        for (secs, error) in [([11.2, 14.7], [0.0353, 0.0364]), ([1.0, 1.0], [0.5, 0.5]), ([1e-6, 90.0], [0.0, 0.0])] {
            let mut report = example();
            report.stages[0].points.truncate(2);
            for (k, p) in report.stages[0].points.iter_mut().enumerate() {
                p.secs = [secs[k]].into_iter().collect();
                p.values.insert("RMS".into(), [error[k]].into_iter().collect());
            }
            let axes = PlotAxes::of(&[&report.stages[0]], &report.stages[0].measures[0]).expect("axes");
            for axis in [axes.secs, axes.error] {
                assert!(axis.ticks().iter().filter(|t| t.named).count() >= 3, "{axis:?}");
            }
            assert!(drawn(&report).is_some());
        }
    }

    #[test]
    fn an_order_is_drawn_with_its_slope() {
        let mut order = example().stages[0].orders[0].clone();
        assert_eq!(order_svg(&order).expect("drawn").matches("class=\"mark\"").count(), 2);
        order.pairs.push([4.0, 0.0]);
        assert!(order_svg(&order).expect("drawn").contains(">0</text>"), "an error of zero has its place");
        order.pairs.clear();
        assert!(order_svg(&order).is_none());
    }
}
