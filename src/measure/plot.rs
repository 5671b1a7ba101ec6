//! A stage as an image: error over seconds, both logarithmic, one line per knob, the Pareto front
//! under them.

use plotters::coord::combinators::LogCoord;
use plotters::prelude::*;

use super::document::{Measure, Point, Stage};

const SIZE: (u32, u32) = (860, 520);
/// How much further than its points a plot reaches to the right, where the legend is, as a share.
const LEGEND: f64 = 0.4;
/// Errors below this are drawn at it: a logarithm of 0 has no place.
pub(crate) const LEAST: f64 = 1e-7;

/// Colors of knobs, in turn; to be told apart by the color-blind (Okabe and Ito).
pub(crate) const COLORS: [[u8; 3]; 7] =
    [[0, 114, 178], [213, 94, 0], [0, 158, 115], [204, 121, 167], [86, 180, 233], [230, 159, 0], [120, 120, 120]];

/// Where a point is in the plot: seconds and error, both above 0.
pub(crate) fn place(point: &Point, measure: &Measure) -> Option<(f64, f64)> {
    let secs = point.secs.median;
    let error = point.error(measure)?;
    (secs.is_finite() && error.is_finite()).then(|| (secs.max(1e-9), error.max(LEAST)))
}

pub(crate) fn svg(stage: &Stage, measure: &Measure) -> Result<String, String> {
    let mut image = String::new();
    draw(stage, measure, &mut image).map_err(|e| e.to_string())?;
    Ok(image)
}

type Area<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<LogCoord<f64>, LogCoord<f64>>>;
type Failed = Box<dyn std::error::Error>;

fn draw(stage: &Stage, measure: &Measure, image: &mut String) -> Result<(), Failed> {
    let places: Vec<(f64, f64)> = stage.points.iter().filter_map(|p| place(p, measure)).collect();
    if places.is_empty() {
        return Err(format!("nothing was measured of {}", measure.name).into());
    }
    // `beside` is what the range reaches further up, as a power of itself.
    let range = |axis: fn(&(f64, f64)) -> f64, spare: f64, beside: f64| {
        let (least, most) = places.iter().map(axis).fold((f64::INFINITY, 0.0_f64), |(l, m), v| (l.min(v), m.max(v)));
        least / spare..most * spare * (spare * spare * most / least).powf(beside)
    };
    let root = SVGBackend::with_string(image, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .caption(format!("{}: error over time", stage.name.title()), ("sans-serif", 18))
        .margin(14)
        .x_label_area_size(44)
        .y_label_area_size(76)
        .build_cartesian_2d(range(|p| p.0, 1.5, LEGEND).log_scale(), range(|p| p.1, 1.6, 0.0).log_scale())?;
    mesh(&mut chart, &format!("seconds of {}", stage.secs_of), &measure.error_name())?;
    front(stage, measure, &mut chart)?;
    for (k, method) in stage.methods().into_iter().enumerate() {
        series(stage, measure, method, k, &mut chart)?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.3))
        .draw()?;
    root.present()?;
    Ok(())
}

/// Grid and axes. Numbers stand at 1, 2 and 5 of each power of ten; others would run into each other.
fn mesh(chart: &mut Area<'_, '_>, x: &str, y: &str) -> Result<(), Failed> {
    let label = |v: &f64| {
        let leading = v / 10.0_f64.powf(v.log10().floor());
        let round = [1.0, 2.0, 5.0, 10.0].iter().any(|r| (leading - r).abs() < 1e-6);
        if round { crate::math::format::number(*v) } else { String::new() }
    };
    chart
        .configure_mesh()
        .x_desc(x)
        .y_desc(y)
        .x_label_formatter(&label)
        .y_label_formatter(&label)
        .light_line_style(BLACK.mix(0.05))
        .draw()?;
    Ok(())
}

/// A wide pale line under everything: nothing is both faster and better than what it joins.
fn front(stage: &Stage, measure: &Measure, chart: &mut Area<'_, '_>) -> Result<(), Failed> {
    let front: Vec<(f64, f64)> =
        stage.front(measure).into_iter().filter_map(|i| place(&stage.points[i], measure)).collect();
    let style = BLACK.mix(0.14).stroke_width(9);
    chart
        .draw_series(LineSeries::new(front, style))?
        .label("Pareto front")
        .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 16, y)], style));
    Ok(())
}

fn series(stage: &Stage, measure: &Measure, method: &str, k: usize, chart: &mut Area<'_, '_>) -> Result<(), Failed> {
    let [r, g, b] = COLORS[k % COLORS.len()];
    let color = RGBColor(r, g, b);
    let points: Vec<&Point> = stage.points.iter().filter(|p| p.method == method).collect();
    for curve in points.iter().map(|p| &p.curve).filter(|c| c.len() > 1) {
        let way = curve.iter().map(|c| (c[0].max(1e-9), measure.error(c[1]).max(LEAST)));
        chart.draw_series(LineSeries::new(way, color.mix(0.35)))?;
    }
    let mut line: Vec<(f64, f64)> = points.iter().filter_map(|p| place(p, measure)).collect();
    line.sort_by(|a, b| a.0.total_cmp(&b.0));
    chart.draw_series(LineSeries::new(line.iter().copied(), color.mix(0.6)))?;
    // How far repeats are apart.
    for p in &points {
        let Some((_, error)) = place(p, measure) else { continue };
        let [from, to] = [p.secs.least, p.secs.most].map(|s| (s.max(1e-9), error));
        chart.draw_series(LineSeries::new([from, to], color.mix(0.5)))?;
    }
    let size = if method == "default" { 7 } else { 4 };
    let (circles, legend) = (line.into_iter(), color.filled());
    chart
        .draw_series(circles.map(|at| Circle::new(at, size, legend)))?
        .label(method)
        .legend(move |(x, y)| Circle::new((x + 8, y), size, legend));
    Ok(())
}

/// An order of convergence as SVG: error over work, with the slope that theory gives.
pub(crate) fn order_svg(order: &super::document::Order) -> Result<String, String> {
    let mut image = String::new();
    draw_order(order, &mut image).map_err(|e| e.to_string())?;
    Ok(image)
}

fn draw_order(order: &super::document::Order, image: &mut String) -> Result<(), Failed> {
    let pairs: Vec<(f64, f64)> =
        order.pairs.iter().filter(|p| p[0] > 0.0 && p[1] > 0.0).map(|p| (p[0], p[1])).collect();
    let [Some(first), Some(last)] = [pairs.first(), pairs.last()] else { return Err("no error to draw".into()) };
    let least = pairs.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
    let most = pairs.iter().map(|p| p.1).fold(0.0_f64, f64::max);
    let root = SVGBackend::with_string(image, (420, 300)).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .caption(&order.what, ("sans-serif", 15))
        .margin(10)
        .x_label_area_size(36)
        .y_label_area_size(66)
        .build_cartesian_2d((first.0 / 1.2..last.0 * 1.2).log_scale(), (least / 2.0..most * 2.0).log_scale())?;
    mesh(&mut chart, "work", "error")?;
    let slope = |x: f64| first.1 * (x / first.0).powf(-order.expected);
    chart.draw_series(LineSeries::new([(first.0, first.1), (last.0, slope(last.0))], BLACK.mix(0.3)))?;
    let [r, g, b] = COLORS[0];
    let color = RGBColor(r, g, b);
    chart.draw_series(LineSeries::new(pairs.iter().copied(), color))?;
    chart.draw_series(pairs.iter().map(|&at| Circle::new(at, 4, color.filled())))?;
    root.present()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::tests::example;

    #[test]
    fn every_point_is_drawn() {
        let stage = example().stages.remove(0);
        let image = svg(&stage, &stage.measures[0]).expect("drawn");
        // Four points and two legends.
        assert_eq!(image.matches("<circle").count(), 4 + 2);
        assert!(image.contains("cut-off") && image.contains("Pareto front") && image.ends_with("</svg>\n"));
        let empty = Stage { points: vec![], ..stage.clone() };
        assert!(svg(&empty, &stage.measures[0]).is_err());
    }

    #[test]
    fn an_error_of_nothing_has_a_place() {
        let mut stage = example().stages.remove(0);
        let perfect = stage.points[0].values.get_mut("RMS").expect("measured");
        *perfect = crate::measure::Sample::default();
        perfect.add(0.0);
        assert_eq!(place(&stage.points[0], &stage.measures[0]).map(|p| p.1), Some(LEAST));
        assert!(svg(&stage, &stage.measures[0]).is_ok());
    }

    #[test]
    fn an_order_is_drawn_with_its_slope() {
        let order = &example().stages[0].orders[0];
        assert_eq!(order_svg(order).expect("drawn").matches("<circle").count(), 2);
    }
}
