//! Measuring: error against run time (every knob that trades accuracy for time is measured, not guessed), speed, and
//! extreme cases.
//!
//! [`document`] is what a report holds, [`mod@file`] reads and writes it; [`studies`] measure the stages of the program,
//! [`subject`] opens those that a scene allows, [`sweep`] goes through their settings; [`front`] says which are worth
//! having, [`order`] how errors fall, [`compare`] what another report has of the same. [`mod@bench`] times drawing,
//! training and queries, [`survey`] how well flights do; [`stability`] is the catalog of extreme cases. [`table`],
//! [`plot`] and [`page`] show all of it, by [`look`], [`axis`], [`axes`] and [`labels`], as the window's pane does;
//! [`defaults`] justifies the program's defaults.

pub(crate) mod axes;
pub(crate) mod axis;
pub mod bench;
pub(crate) mod compare;
pub(crate) mod computer;
pub mod defaults;
pub(crate) mod document;
pub(crate) mod file;
pub(crate) mod front;
mod image_error;
pub(crate) mod in_time;
pub(crate) mod knobs;
pub(crate) mod labels;
pub(crate) mod look;
mod order;
pub mod page;
pub(crate) mod plot;
pub(crate) mod stability;
pub(crate) mod studies;
pub(crate) mod subject;
pub(crate) mod survey;
mod svg;
pub(crate) mod sweep;
pub(crate) mod table;

pub(crate) use compare::StageComparison;
pub use computer::Computer;
pub use document::{ErrorKind, Measure, Point, Report, Rule, Sample, Stage, StageName, VERSION};
pub use file::{BeginError, FILE, ReportError, is_report};
pub use knobs::Knobs;
pub(crate) use knobs::turned;
pub use order::Order;
pub(crate) use sweep::{End, Study, StudyError, SweepCase, Trial};

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    pub(crate) fn example() -> Report {
        let sample = |v: f64| {
            let mut s = Sample::default();
            [v, 1.1 * v, 0.9 * v].iter().for_each(|v| s.add(*v));
            s
        };
        let point = |method: &str, setting: &str, secs: f64, rms: f64| Point {
            method: method.into(),
            setting: setting.into(),
            default: method == "default",
            secs: sample(secs),
            values: BTreeMap::from([("RMS".to_owned(), sample(rms)), ("IoU".to_owned(), sample(0.5))]),
            ..Point::default()
        };
        let stage = Stage {
            name: StageName::Render,
            secs_of: "one frame".into(),
            reference: "the exact image".into(),
            input: BTreeMap::from([("size".into(), "64 x 48 px".into())]),
            seeds: vec![0, 1, 2],
            planned: 4,
            measures: vec![
                Measure::new("RMS", "", ErrorKind::Error, "root mean square"),
                Measure::new("IoU", "", ErrorKind::Share, "overlap"),
            ],
            rule: Rule { measure: "RMS".into(), times: 1.1, floor: 0.01, spare_secs: 0.0 },
            points: vec![
                point("default", "1/255 <&> \"quoted\"", 0.02, 0.001),
                point("cut-off", "1/64", 0.01, 0.004),
                point("cut-off", "1/16", 0.005, 0.05),
                point("cut-off", "1/1000", 0.03, 0.0009999),
            ],
            orders: vec![Order::fit("samples", "of a pixel", vec![[1.0, 1.0], [2.0, 0.25]], 2.0, 0.1, 0.0)],
            left_out: vec![],
        };
        Report {
            version: VERSION,
            program: "0.0".into(),
            scene: "an example".into(),
            computer: Computer { processor: "one".into(), cores: 2, ..Computer::default() },
            commands: vec!["fmlgs report example".into()],
            stages: vec![stage],
        }
    }

    #[test]
    fn errors_are_what_is_missing() {
        assert_eq!(Measure::new("a", "", ErrorKind::Error, "").error(0.3), 0.3);
        assert!((Measure::new("a", "", ErrorKind::Share, "").error(0.3) - 0.7).abs() < 1e-12);
        assert!((Measure::new("a", "dB", ErrorKind::Decibels, "").error(20.0) - 0.1).abs() < 1e-12);
    }

    #[test]
    fn a_stage_takes_the_place_of_an_older_one() {
        let mut report = example();
        let mut other = report.stages[0].clone();
        other.points.clear();
        report.put(other.clone());
        assert_eq!((report.stages.len(), report.stages[0].points.len()), (1, 0));
        report.put(Stage { name: StageName::Depth, ..other.clone() });
        report.put(Stage { name: StageName::Train, ..other });
        let names: Vec<StageName> = report.stages.iter().map(|s| s.name).collect();
        assert_eq!(names, [StageName::Render, StageName::Train, StageName::Depth]);
    }
}
