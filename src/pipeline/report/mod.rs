//! Error against run time: what a method costs and how good it is, as data, table and plot.

mod features;
mod plot;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

pub use features::{FeatureStudy, study as study_features};
pub use plot::svg;

/// Version of the JSON document.
pub const VERSION: u32 = 1;

/// One measurement: a method at one setting.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// The method.
    pub series: String,
    /// Its setting, for people.
    pub setting: String,
    /// Seconds it took.
    pub secs: f64,
    /// How good the result is, by name of the measure; higher is better.
    pub quality: BTreeMap<String, f64>,
}

/// Measurements of one stage on one input.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// [`VERSION`].
    pub version: u32,
    /// What was measured: "features".
    pub stage: String,
    /// On what: scene, sizes, seeds.
    pub input: BTreeMap<String, String>,
    /// The measurements.
    pub points: Vec<Point>,
}

impl Report {
    /// Names of the measures, each once.
    pub fn measures(&self) -> Vec<&str> {
        let mut names: Vec<&str> = self.points.iter().flat_map(|p| p.quality.keys().map(String::as_str)).collect();
        names.sort_unstable();
        names.dedup();
        names
    }

    /// The measurements as rows of text, header first.
    pub fn table(&self) -> Vec<Vec<String>> {
        let measures = self.measures();
        let fixed = ["method", "setting", "s"].into_iter();
        let mut rows = vec![fixed.chain(measures.iter().copied()).map(str::to_owned).collect()];
        for p in &self.points {
            let value = |m: &&str| p.quality.get(*m).map_or_else(String::new, |v| format!("{v:.4}"));
            let fixed = [p.series.clone(), p.setting.clone(), format!("{:.2}", p.secs)];
            rows.push(fixed.into_iter().chain(measures.iter().map(value)).collect());
        }
        rows
    }

    /// The table as comma-separated values.
    pub fn csv(&self) -> String {
        let quoted = |cell: &String| format!("\"{}\"", cell.replace('"', "\"\""));
        self.table().iter().map(|row| row.iter().map(quoted).collect::<Vec<_>>().join(",") + "\n").collect()
    }
}

#[cfg(test)]
pub(super) fn example() -> Report {
    let point = |series: &str, setting: &str, secs, objects| Point {
        series: series.into(),
        setting: setting.into(),
        secs,
        quality: BTreeMap::from([("objects".to_owned(), objects), ("parts".to_owned(), objects * 0.9)]),
    };
    Report {
        version: VERSION,
        stage: "features".into(),
        input: BTreeMap::from([("scene".into(), "demo".into())]),
        points: vec![
            point("vote", "1 pass", 0.5, 0.97),
            point("gradient", "300 \"steps\"", 9.0, 0.4),
            point("gradient", "1000", 30.0, 0.6),
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_hold_every_measure() {
        let report = example();
        assert_eq!(report.measures(), ["objects", "parts"]);
        let csv = report.csv();
        assert_eq!(csv.lines().next(), Some("\"method\",\"setting\",\"s\",\"objects\",\"parts\""));
        assert!(csv.contains("\"300 \"\"steps\"\"\""));
        let again: Report = serde_json::from_str(&serde_json::to_string(&report).expect("json")).expect("reads");
        assert_eq!(again, report);
    }
}
