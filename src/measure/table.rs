//! A report as tables: rows of text, comma-separated values.

use super::document::{Measure, Order, Point, Report, Sample, Stage};
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
    match sample.each.len() {
        0 => String::new(),
        1 => show(sample.median),
        _ => format!("{} ({} to {})", show(sample.median), show(sample.least), show(sample.most)),
    }
}

pub(crate) fn title(measure: &Measure) -> String {
    if measure.unit.is_empty() { measure.name.clone() } else { format!("{} {}", measure.name, measure.unit) }
}

impl Stage {
    /// The measurements as rows, header first. The last column marks the front of the first measure.
    pub(crate) fn table(&self) -> Rows {
        let titles: Vec<String> = self.measures.iter().map(title).collect();
        let titles = titles.iter().map(String::as_str);
        let head: Vec<&str> = ["knob", "setting", "time"].into_iter().chain(titles).chain(["front"]).collect();
        let front = self.measures.first().map(|m| self.front(m)).unwrap_or_default();
        rows(
            &head,
            self.points.iter().enumerate().map(|(i, p)| {
                let of = |m: &Measure| p.values.get(&m.name).map_or_else(String::new, |s| spread(s, number));
                let fixed = [p.method.clone(), p.setting.clone(), spread(&p.secs, seconds)];
                let mark = if front.contains(&i) { "*" } else { "" };
                fixed.into_iter().chain(self.measures.iter().map(of)).chain([mark.to_owned()]).collect()
            }),
        )
    }

    /// What the rule says of each knob's default.
    pub(crate) fn choice_table(&self) -> Rows {
        let with = |p: &Point| {
            let value = p.values.get(&self.rule.measure).map_or_else(String::new, |v| number(v.median));
            format!("{}: {value} in {}", p.setting, seconds(p.secs.median))
        };
        let or_default = |p: &Point| if p.default { "the default".to_owned() } else { with(p) };
        rows(
            &["knob", "default", "chosen", "least error", "holds"],
            self.choices().into_iter().map(|c| {
                let (chosen, best) = (or_default(c.chosen), or_default(c.best));
                vec![c.method.to_owned(), with(c.default), chosen, best, yes(c.holds)]
            }),
        )
    }

    /// Whether errors fall as fast as theory says.
    pub(crate) fn order_table(&self) -> Rows {
        let row = |o: &Order| vec![o.what.clone(), o.expected.to_string(), format!("{:.2}", o.observed), yes(o.agrees)];
        rows(&["convergence", "expected order", "observed", "agrees"], self.orders.iter().map(row))
    }
}

fn yes(yes: bool) -> String {
    if yes { "yes" } else { "no" }.to_owned()
}

impl Report {
    /// One row for each setting and measure, repeats included: to be read by other programs.
    pub(crate) fn csv(&self) -> String {
        let mut out = String::from(
            "stage,knob,setting,default,knobs,measure,unit,repeats,seconds_median,seconds_least,seconds_most,\
             value_median,value_least,value_most\n",
        );
        let quoted = |cell: &str| format!("\"{}\"", cell.replace('"', "\"\""));
        for stage in &self.stages {
            for p in &stage.points {
                let knobs = serde_json::to_string(&p.knobs).unwrap_or_default();
                for m in &stage.measures {
                    let Some(v) = p.values.get(&m.name) else { continue };
                    let words = [stage.name.name(), &p.method, &p.setting].map(quoted).join(",");
                    let s = &p.secs;
                    let numbers =
                        [s.median, s.least, s.most, v.median, v.least, v.most].map(|n| n.to_string()).join(",");
                    let (knobs, name, unit) = (quoted(&knobs), quoted(&m.name), quoted(&m.unit));
                    out += &format!("{words},{},{knobs},{name},{unit},{},{numbers}\n", p.default, s.each.len());
                }
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use crate::measure::tests::example;

    #[test]
    fn tables_hold_every_measure_of_every_point() {
        let report = example();
        let rows = report.stages[0].table();
        assert_eq!(rows[0], ["knob", "setting", "time", "RMS", "IoU", "front"]);
        assert_eq!(rows[1][2], "20.00 ms (18.00 ms to 22.00 ms)");
        assert_eq!(rows.iter().map(|r| r[5].as_str()).collect::<Vec<_>>(), ["front", "*", "*", "*", "*"]);
        let csv = report.csv();
        assert_eq!(csv.lines().count(), 1 + 2 * 4);
        assert!(csv.contains("\"1/255 <&> \"\"quoted\"\"\",true,\"{}\",\"RMS\",\"\",3,0.02,"));
    }
}
