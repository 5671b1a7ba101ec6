//! A report as tables: rows of text, comma-separated values.

use super::document::{Measure, Report, Sample, Stage};
use crate::math::format::{number, seconds};

/// The middle, and how far the repeats are apart.
pub fn spread(sample: &Sample, show: impl Fn(f64) -> String) -> String {
    match sample.each.len() {
        0 => String::new(),
        1 => show(sample.median),
        _ => format!("{} ({} to {})", show(sample.median), show(sample.least), show(sample.most)),
    }
}

/// Header of a measure.
pub fn title(measure: &Measure) -> String {
    if measure.unit.is_empty() { measure.name.clone() } else { format!("{} {}", measure.name, measure.unit) }
}

impl Stage {
    /// The measurements as rows, header first. The last column marks the front of the first measure.
    pub fn table(&self) -> Vec<Vec<String>> {
        let fixed = ["knob", "setting", "time"].map(str::to_owned);
        let mut rows: Vec<Vec<String>> =
            vec![fixed.into_iter().chain(self.measures.iter().map(title)).chain(["front".to_owned()]).collect()];
        let front = self.measures.first().map(|m| self.front(m)).unwrap_or_default();
        for (i, p) in self.points.iter().enumerate() {
            let of = |m: &Measure| p.values.get(&m.name).map_or_else(String::new, |s| spread(s, number));
            let fixed = [p.method.clone(), p.setting.clone(), spread(&p.secs, seconds)];
            let mark = if front.contains(&i) { "*" } else { "" };
            rows.push(fixed.into_iter().chain(self.measures.iter().map(of)).chain([mark.to_owned()]).collect());
        }
        rows
    }
}

impl Report {
    /// One row for each setting and measure, repeats included: to be read by other programs.
    pub fn csv(&self) -> String {
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
    use crate::report::tests::example;

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
