//! The report as data: what was measured, on what, how often. One JSON document holds it all; the
//! table, the plots, the page and the window's pane are made of it.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::computer::Computer;
use super::knobs::Knobs;
use super::order::Order;
use crate::math::format::things;
use crate::math::stats::median;

/// PSNR of images without any difference, dB: what stands for it is no error.
pub(crate) const MOST_PSNR: f64 = 150.0;

/// Version of the JSON document.
pub const VERSION: u32 = 2;

/// A part of the program whose knobs are measured, in the order of the program; its message is its title.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Serialize,
    Deserialize,
    clap::ValueEnum,
    strum::EnumMessage,
    strum::IntoStaticStr,
    strum::VariantArray,
)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase")]
pub enum StageName {
    /// Images against the exact image.
    #[strum(message = "Drawing")]
    Render,
    /// Training against held-out photos.
    #[strum(message = "Training")]
    Train,
    /// Identities of Gaussians against labels.
    #[strum(message = "Finding objects")]
    Features,
    /// Answers to typed queries against labels.
    #[strum(message = "Queries")]
    Query,
    /// Flights against occupied space and their own length.
    #[strum(message = "Camera paths")]
    Path,
    /// Drawn depth against true depth.
    #[strum(message = "Depth")]
    Depth,
}

impl StageName {
    /// As in JSON and on the command line.
    pub(crate) fn name(self) -> &'static str {
        self.into()
    }

    pub(crate) fn title(self) -> &'static str {
        strum::EnumMessage::get_message(&self).unwrap_or_default()
    }
}

/// Conversion of a measure to the error that is plotted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ErrorKind {
    /// The measure is an error itself.
    Error,
    /// A share that should be 1: the error is what is missing.
    Share,
    /// Decibels: the error is the root mean square that they stand for.
    Decibels,
}

/// A quantity that is measured of every setting.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Measure {
    pub(crate) name: String,
    /// Its unit; empty for plain numbers.
    pub(crate) unit: String,
    #[serde(rename = "form")]
    pub(crate) kind: ErrorKind,
    pub(crate) meaning: String,
}

impl Measure {
    /// A measure.
    pub fn new(name: &str, unit: &str, kind: ErrorKind, meaning: &str) -> Self {
        Self { name: name.into(), unit: unit.into(), kind, meaning: meaning.into() }
    }

    /// The error that a value stands for; 0 is perfect.
    pub(crate) fn error(&self, value: f64) -> f64 {
        match self.kind {
            ErrorKind::Error => value,
            ErrorKind::Share => 1.0 - value,
            // That of images without any difference, which has no decibels.
            ErrorKind::Decibels if value >= MOST_PSNR => 0.0,
            ErrorKind::Decibels => 10.0_f64.powf(-value / 20.0),
        }
    }

    /// Name of the axis that shows its errors.
    pub(crate) fn error_name(&self) -> String {
        match self.kind {
            ErrorKind::Error if self.unit.is_empty() => self.name.clone(),
            ErrorKind::Error => format!("{} ({})", self.name, self.unit),
            ErrorKind::Share => format!("1 - {}", self.name),
            ErrorKind::Decibels => format!("RMS error (from {})", self.name),
        }
    }
}

/// A number that was measured several times.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    pub(crate) median: f64,
    pub(crate) least: f64,
    pub(crate) most: f64,
    /// All, in the order of the repeats.
    pub(crate) each: Vec<f64>,
}

impl Sample {
    /// Adds a repeat. One that is NaN is left out: JSON has none.
    pub fn add(&mut self, value: f64) {
        if !value.is_finite() {
            return;
        }
        self.each.push(value);
        self.median = median(&self.each);
        self.least = self.each.iter().copied().fold(f64::INFINITY, f64::min);
        self.most = self.each.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    }
}

impl FromIterator<f64> for Sample {
    fn from_iter<T: IntoIterator<Item = f64>>(values: T) -> Self {
        let mut sample = Self::default();
        values.into_iter().for_each(|v| sample.add(v));
        sample
    }
}

/// A method at one setting.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// The knob that was turned: "alpha cut-off". Points of one method make one series.
    pub method: String,
    /// Setting of the knob, in words.
    pub setting: String,
    /// The setting as fields of the stage's settings, for the program.
    pub knobs: Knobs,
    /// True if these are the program's defaults.
    pub default: bool,
    /// Run time in seconds.
    pub secs: Sample,
    /// Values by name of the measure.
    pub values: BTreeMap<String, Sample>,
    /// Seconds and first measure in the course of a training; empty otherwise.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub curve: Vec<[f64; 2]>,
}

impl Point {
    /// The error that `measure` stands at, of the middle repeat.
    pub(crate) fn error(&self, measure: &Measure) -> Option<f64> {
        let value = self.values.get(&measure.name)?;
        (!value.each.is_empty()).then(|| measure.error(value.median))
    }
}

/// Rule that decides if a cheaper setting is good enough.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rule {
    /// The measure that decides.
    pub measure: String,
    /// An error this many times the least is good enough.
    pub times: f64,
    /// So is any error below this.
    pub floor: f64,
    /// Times that are no further apart than this, in seconds, are the same time to the user.
    #[serde(default)]
    pub spare_secs: f64,
}

impl Rule {
    /// Errors in `measure` up to `times` the least, or below `floor`, are good enough.
    pub(crate) fn new(measure: &str, times: f64, floor: f64, spare_secs: f64) -> Self {
        Self { measure: measure.into(), times, floor, spare_secs }
    }

    pub(crate) fn words(&self) -> String {
        let times = 100.0 * (self.times - 1.0);
        let same = match self.spare_secs > 0.0 {
            true => format!("; {} more or less do not count", crate::math::format::seconds(self.spare_secs)),
            false => String::new(),
        };
        // "RMS error" is one by its name; "PSNR" stands for one.
        let what = match self.measure.contains("error") || self.measure == "faults" {
            true => self.measure.clone(),
            false => format!("error in {}", self.measure),
        };
        let least = match times > 0.0 {
            true => format!("{times:.0} % over the least"),
            false => "the least".to_owned(),
        };
        let words = match self.floor > 0.0 {
            true => format!("the fastest whose {what} is at most {:.1e} or {least}", self.floor),
            false => format!("the fastest whose {what} is at most {least}"),
        };
        words + &same
    }
}

/// Measurements of one stage on one input.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stage {
    /// Name of the stage.
    pub name: StageName,
    /// Unit of work that the seconds are for: "one picture".
    pub secs_of: String,
    /// Reference of the errors, in a sentence.
    pub reference: String,
    /// Input: scene, sizes, views.
    pub input: BTreeMap<String, String>,
    /// Seed of each repeat.
    pub seeds: Vec<u64>,
    /// Settings that the sweep consists of; fewer points mean that it was stopped.
    pub planned: usize,
    /// Measures, the main one first.
    pub measures: Vec<Measure>,
    /// Rule that chooses a default.
    pub rule: Rule,
    /// The measurements.
    pub points: Vec<Point>,
    /// Orders of convergence.
    #[serde(default)]
    pub orders: Vec<Order>,
    /// Settings that could not be measured, and why.
    #[serde(default)]
    pub left_out: Vec<String>,
}

impl Stage {
    /// A stage that nothing was measured of yet: seconds of what, compared with what, on what, how often.
    pub(crate) fn new(
        name: StageName,
        [secs_of, reference]: [&str; 2],
        (input, repeats): (BTreeMap<String, String>, u32),
        rule: Rule,
        measures: Vec<Measure>,
    ) -> Self {
        Self {
            name,
            secs_of: secs_of.into(),
            reference: reference.into(),
            input,
            seeds: (0..u64::from(repeats)).collect(),
            planned: 0,
            measures,
            rule,
            points: Vec::new(),
            orders: Vec::new(),
            left_out: Vec::new(),
        }
    }

    /// Names of the methods, in the order of their first points.
    pub(crate) fn methods(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for p in &self.points {
            if !names.contains(&p.method.as_str()) {
                names.push(&p.method);
            }
        }
        names
    }

    pub(crate) fn measure(&self, name: &str) -> Option<&Measure> {
        self.measures.iter().find(|m| m.name == name)
    }

    /// Numbers of runs: "each setting 3 times", "7 settings 2 times, 12 once".
    pub(crate) fn runs(&self) -> String {
        let mut settings: BTreeMap<usize, usize> = BTreeMap::new();
        self.points.iter().for_each(|p| *settings.entry(p.secs.each.len()).or_default() += 1);
        let times = |runs: usize| if runs == 1 { "once".to_owned() } else { format!("{runs} times") };
        match settings.len() {
            0 => "no setting measured".into(),
            1 => settings.keys().map(|runs| format!("each setting {}", times(*runs))).collect(),
            _ => {
                let each = settings.iter().rev().map(|(runs, n)| format!("{} {}", things(*n, "setting"), times(*runs)));
                each.collect::<Vec<_>>().join(", ")
            }
        }
    }

    /// "3 of 24 measurements", where some are missing: how far a stage came that was stopped.
    pub(crate) fn stopped_at(&self) -> Option<String> {
        let measured: usize = self.points.iter().map(|p| p.secs.each.len()).sum();
        // A file may plan as many as it likes.
        let planned = self.planned.saturating_mul(self.seeds.len());
        (!self.complete()).then(|| format!("{measured} of {planned} measurements"))
    }

    /// Returns whether every setting was measured at every seed.
    pub(crate) fn complete(&self) -> bool {
        self.points.len() == self.planned && self.points.iter().all(|p| p.secs.each.len() >= self.seeds.len())
    }
}

/// All stages that were measured on one scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// [`VERSION`].
    pub version: u32,
    /// Version of the program.
    pub program: String,
    /// The scene.
    pub scene: String,
    /// The machine.
    pub computer: Computer,
    /// Commands that measured it, oldest first; empty in earlier reports.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub commands: Vec<String>,
    /// The stages.
    pub stages: Vec<Stage>,
}

impl Report {
    pub(crate) fn stage(&self, name: StageName) -> Option<&Stage> {
        self.stages.iter().find(|s| s.name == name)
    }

    /// Measurements of an earlier run of the same sweep: the same input and measures.
    pub(crate) fn earlier(&self, fresh: &Stage) -> Option<Stage> {
        let measures =
            |s: &Stage| s.measures.iter().map(|m| (m.name.clone(), m.unit.clone(), m.kind)).collect::<Vec<_>>();
        self.stage(fresh.name).filter(|s| s.input == fresh.input && measures(s) == measures(fresh)).cloned()
    }

    /// Puts a stage in, in the place of an older one.
    pub(crate) fn put(&mut self, stage: Stage) {
        self.stages.retain(|s| s.name != stage.name);
        self.stages.push(stage);
        self.stages.sort_by_key(|s| s.name);
    }
}
