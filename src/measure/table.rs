//! A report as tables: rows of text, comma-separated values.

use super::document::{Measure, Point, Report, Sample, Stage};
use super::order::Order;
use crate::math::format::{number, seconds};

/// Rows of cells, the header first.
pub(crate) type Rows = Vec<Vec<String>>;

pub(crate) fn rows(head: &[&str], body: impl IntoIterator<Item = Vec<String>>) -> Rows {
    std::iter::once(head.iter().map(|h| (*h).to_owned()).collect()).chain(body).collect()
}

/// Rows as Markdown; a "no" stands out.
pub(crate) fn markdown(rows: &Rows) -> String {
    let cell = |text: &String| if text == "no" { "**no**".to_owned() } else { text.replace('|', "\\|") };
    let line = |row: &Vec<String>| format!("| {} |\n", row.iter().map(cell).collect::<Vec<_>>().join(" | "));
    let mut lines = rows.iter().map(line);
    let head = lines.next().unwrap_or_default();
    let rule = format!("|{}\n", "---|".repeat(rows.first().map_or(0, Vec::len)));
    head + &rule + &lines.collect::<String>()
}

/// Rows as an HTML table; a "no" stands out.
pub(crate) fn html(rows: &Rows) -> String {
    let cell = |text: &String| match text == "no" {
        true => "<td class=\"no\">no</td>".to_owned(),
        false => format!("<td>{}</td>", htmlize::escape_all_quotes(text)),
    };
    let line = |row: &Vec<String>| format!("<tr>{}</tr>\n", row.iter().map(cell).collect::<String>());
    let mut lines = rows.iter().map(line);
    let head = lines.next().unwrap_or_default().replace("<td", "<th").replace("</td", "</th");
    format!("<table><thead>{head}</thead><tbody>\n{}</tbody></table>\n", lines.collect::<String>())
}

/// The middle, and how far the repeats are apart.
pub(crate) fn spread(sample: &Sample, show: impl Fn(f64) -> String) -> String {
    let range = range(sample, &show);
    if range.is_empty() { range } else { format!("{} ({range})", show(sample.median)) }
}

/// Distance of the repeats: "0.03530 to 0.03640", "one run", "3 runs alike".
pub(crate) fn range(sample: &Sample, show: impl Fn(f64) -> String) -> String {
    match sample.each.len() {
        0 => String::new(),
        1 => "one run".into(),
        n if show(sample.least) == show(sample.most) => format!("{n} runs alike"),
        _ => format!("{} to {}", show(sample.least), show(sample.most)),
    }
}

pub(crate) fn title(measure: &Measure) -> String {
    if measure.unit.is_empty() { measure.name.clone() } else { format!("{} {}", measure.name, measure.unit) }
}

/// The measurements as rows, header first. The last column marks the front of the first measure.
pub(crate) fn of_stage(stage: &Stage) -> Rows {
    let titles: Vec<String> = stage.measures.iter().map(title).collect();
    let titles = titles.iter().map(String::as_str);
    let head: Vec<&str> = ["knob", "setting", "runs", "time"].into_iter().chain(titles).chain(["front"]).collect();
    let front = stage.measures.first().map(|m| stage.front(m)).unwrap_or_default();
    rows(
        &head,
        stage.points.iter().enumerate().map(|(i, p)| {
            let of = |m: &Measure| p.values.get(&m.name).map_or_else(String::new, |s| spread(s, number));
            let runs = p.secs.each.len().to_string();
            let fixed = [p.method.clone(), p.setting.clone(), runs, spread(&p.secs, seconds)];
            let mark = if front.contains(&i) { "*" } else { "" };
            fixed.into_iter().chain(stage.measures.iter().map(of)).chain([mark.to_owned()]).collect()
        }),
    )
}

/// Table of the rule's choice for each knob, beside its default.
pub(crate) fn choices(stage: &Stage) -> Rows {
    let with = |p: &Point| {
        let value = p.values.get(&stage.rule.measure).map_or_else(String::new, |v| spread(v, number));
        format!("{}: {value} in {}", p.setting, spread(&p.secs, seconds))
    };
    let or_default = |p: &Point| if p.default { "the default".to_owned() } else { with(p) };
    rows(
        &["knob", "default", "chosen", "least error", "holds"],
        stage.choices().into_iter().map(|c| {
            let (chosen, best) = (or_default(c.chosen), or_default(c.best));
            vec![c.method.to_owned(), with(c.default), chosen, best, yes(c.holds)]
        }),
    )
}

/// Table of the orders at which errors fall, compared with theory.
pub(crate) fn orders(stage: &Stage) -> Rows {
    let row = |o: &Order| vec![o.what.clone(), o.expected.to_string(), format!("{:.2}", o.observed), yes(o.agrees)];
    rows(&["convergence", "expected order", "observed", "agrees"], stage.orders.iter().map(row))
}

fn yes(yes: bool) -> String {
    if yes { "yes" } else { "no" }.to_owned()
}

/// One row for each setting and measure, repeats included: to be read by other programs.
pub(crate) fn csv(report: &Report) -> String {
    let mut out = String::from(
        "stage,knob,setting,default,knobs,measure,unit,repeats,seconds_median,seconds_least,seconds_most,\
         value_median,value_least,value_most\n",
    );
    let quoted = |cell: &str| format!("\"{}\"", cell.replace('"', "\"\""));
    for stage in &report.stages {
        for p in &stage.points {
            let knobs = serde_json::to_string(&p.knobs).unwrap_or_default();
            for m in &stage.measures {
                let Some(v) = p.values.get(&m.name) else { continue };
                let words = [stage.name.name(), &p.method, &p.setting].map(quoted).join(",");
                let s = &p.secs;
                let numbers = [s.median, s.least, s.most, v.median, v.least, v.most].map(|n| n.to_string()).join(",");
                let (knobs, name, unit) = (quoted(&knobs), quoted(&m.name), quoted(&m.unit));
                out += &format!("{words},{},{knobs},{name},{unit},{},{numbers}\n", p.default, s.each.len());
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::tests::example;

    #[test]
    fn every_number_says_how_far_its_repeats_are_apart() {
        let of = |values: &[f64]| spread(&values.iter().copied().collect(), seconds);
        assert_eq!(of(&[14.7, 11.2]), "12.95 s (11.20 s to 14.70 s)");
        assert_eq!(of(&[11.2]), "11.20 s (one run)");
        assert_eq!(of(&[0.5, 0.5, 0.5]), "500.0 ms (3 runs alike)");
        assert_eq!(of(&[]), "");
    }

    #[test]
    fn settings_that_ran_less_often_are_told() {
        let mut stage = example().stages.remove(0);
        assert_eq!(stage.runs(), "each setting 3 times");
        for p in &mut stage.points[2..] {
            p.secs = [0.1].into_iter().collect();
        }
        assert_eq!(stage.runs(), "2 settings 3 times, 2 settings once");
        assert_eq!(of_stage(&stage)[4][2..4], ["1".to_owned(), "100.0 ms (one run)".to_owned()]);
        stage.points.clear();
        assert_eq!(stage.runs(), "no setting measured");
    }

    #[test]
    fn tables_hold_every_measure_of_every_point() {
        let report = example();
        let rows = of_stage(&report.stages[0]);
        assert_eq!(rows[0], ["knob", "setting", "runs", "time", "RMS", "IoU", "front"]);
        assert_eq!((rows[1][2].as_str(), rows[1][3].as_str()), ("3", "20.00 ms (18.00 ms to 22.00 ms)"));
        // The last is slower than the default, and better by less than repeats differ.
        assert_eq!(rows.iter().map(|r| r[6].as_str()).collect::<Vec<_>>(), ["front", "*", "*", "*", ""]);
        let csv = csv(&report);
        assert_eq!(csv.lines().count(), 1 + 2 * 4);
        assert!(csv.contains("\"1/255 <&> \"\"quoted\"\"\",true,\"{}\",\"RMS\",\"\",3,0.02,"));
    }
}
