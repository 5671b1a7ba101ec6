//! A report as a picture: quality over seconds, one line per method and measure.

use plotters::prelude::*;

use super::Report;

/// Size of the picture in px.
const SIZE: (u32, u32) = (860, 520);

/// Colours of methods, in turn; to be told apart by the colour-blind (Okabe and Ito).
const COLORS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
];

/// The report as SVG: time on a logarithmic axis.
///
/// # Errors
/// If there is nothing to draw, in words.
pub fn svg(report: &Report) -> Result<String, String> {
    let mut picture = String::new();
    draw(report, &mut picture).map_err(|e| e.to_string())?;
    Ok(picture)
}

fn draw(report: &Report, picture: &mut String) -> Result<(), Box<dyn std::error::Error>> {
    let measures = report.measures();
    let secs = report.points.iter().map(|p| p.secs.max(1e-4));
    let (least, most) = secs.fold((f64::INFINITY, 0.0_f64), |(l, m), s| (l.min(s), m.max(s)));
    if measures.is_empty() || !least.is_finite() {
        return Err("the report holds no measurements".into());
    }
    let root = SVGBackend::with_string(picture, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let input: Vec<&str> = report.input.values().map(String::as_str).collect();
    let title = format!("{}: quality over time ({})", report.stage, input.join(", "));
    let mut chart = ChartBuilder::on(&root)
        .caption(title, ("sans-serif", 18))
        .margin(14)
        .x_label_area_size(44)
        .y_label_area_size(56)
        .build_cartesian_2d((least * 0.7..most * 1.5).log_scale(), 0.0..1.0)?;
    chart.configure_mesh().x_desc("seconds").y_desc("quality").light_line_style(BLACK.mix(0.05)).draw()?;
    let mut series: Vec<&str> = Vec::new();
    for p in &report.points {
        if !series.contains(&p.series.as_str()) {
            series.push(&p.series);
        }
    }
    for (k, name) in series.iter().enumerate() {
        let color = COLORS[k % COLORS.len()];
        for (m, measure) in measures.iter().enumerate() {
            let of = report.points.iter().filter(|p| p.series == *name);
            let mut line: Vec<(f64, f64)> =
                of.filter_map(|p| Some((p.secs.max(1e-4), *p.quality.get(*measure)?))).collect();
            line.sort_by(|a, b| a.0.total_cmp(&b.0));
            // The first measure is drawn filled, the others hollow.
            let style = if m == 0 { color.filled() } else { color.stroke_width(2) };
            chart.draw_series(LineSeries::new(line.iter().copied(), color.mix(0.6)))?;
            chart
                .draw_series(line.iter().map(|&at| Circle::new(at, 5, style)))?
                .label(format!("{name}, {measure}"))
                .legend(move |(x, y)| Circle::new((x + 8, y), 5, style));
        }
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerRight)
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.3))
        .draw()?;
    root.present()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_is_drawn() {
        let report = super::super::example();
        let picture = svg(&report).expect("drawn");
        // Two measures of three points, and four legends.
        assert_eq!(picture.matches("<circle").count(), 2 * 3 + 4);
        assert!(picture.contains("gradient, parts") && picture.ends_with("</svg>\n"));
        assert!(svg(&Report { points: vec![], ..report }).is_err());
    }
}
