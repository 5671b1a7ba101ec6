//! Timings of drawing, training and queries, stage by stage: what `fmlgs bench` prints. A stage is measured several
//! times in one process; compare only numbers of one run.

pub mod draw;
pub(crate) mod made_up_results;
pub(crate) mod masks;
pub(crate) mod moving;
pub(crate) mod one_core;
pub(crate) mod query;
pub(crate) mod questions;
pub(crate) mod results;
pub mod train;

use std::path::Path;
use std::time::Instant;

use glam::DVec3;
use serde::Serialize;

use super::table::{Rows, rows};
use crate::math::Real;
use crate::math::format::number;
use crate::math::stats::quantile;
use crate::pipeline::semantics::query::timing::ms_since;
use crate::scene::{Bounds, Camera, GaussianCloud};

/// Three cameras around a cloud, at different heights and distances, y downwards.
pub fn views_of<R: Real>(cloud: &GaussianCloud<R>, width: u32, height: u32) -> Vec<Camera> {
    let Some(bounds) = Bounds::robust((0..cloud.len()).map(|i| cloud.world_position(i))) else { return Vec::new() };
    let (center, radius) = (bounds.center(), bounds.radius());
    [(0.3_f64, -0.3, 2.2), (2.4, -0.9, 1.6), (4.4, 0.2, 3.0)]
        .into_iter()
        .filter_map(|(angle, height_over, distance)| {
            let eye = center + DVec3::new(angle.cos(), height_over, angle.sin()) * radius * distance;
            Camera::look_at(eye, center, -DVec3::Y, 0.8, width, height)
        })
        .collect()
}

/// A readable name for a path: its last part.
pub(crate) fn label(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}

/// A stage on one input, measured several times.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StageSample {
    /// Name of the stage; a part of it is called "stage: part".
    pub stage: String,
    /// The input: a scene with its size, a network.
    pub on: String,
    /// Unit of the values; empty for plain numbers.
    pub unit: &'static str,
    /// Median of the values.
    pub median: f64,
    /// Their 95th percentile.
    pub p95: f64,
    /// Number of values.
    pub n: usize,
}

/// Values of stages on one input, in the order of each stage's first.
#[derive(Debug)]
pub struct StageValues {
    on: String,
    stages: Vec<(String, &'static str, Vec<f64>)>,
}

impl StageValues {
    /// No values yet on an input.
    pub fn new(on: String) -> Self {
        Self { on, stages: Vec::new() }
    }

    pub(crate) fn on_scene(name: &str, gaussians: usize, [width, height]: [u32; 2]) -> Self {
        Self::new(format!("{name}, {gaussians} Gaussians, {width}x{height}"))
    }

    pub(crate) fn add(&mut self, stage: &str, unit: &'static str, values: impl IntoIterator<Item = f64>) {
        let at = self.stages.iter().position(|known| known.0 == stage).unwrap_or_else(|| {
            self.stages.push((stage.to_owned(), unit, Vec::new()));
            self.stages.len() - 1
        });
        self.stages[at].2.extend(values);
    }

    /// Does some work, and adds its milliseconds.
    pub(crate) fn time<T>(&mut self, stage: &str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let done = work();
        self.add(stage, "ms", [ms_since(start)]);
        done
    }

    /// A sample of each stage.
    pub fn samples(self) -> Vec<StageSample> {
        let Self { on, stages } = self;
        let sample = |(stage, unit, values): (String, &'static str, Vec<f64>)| {
            let [median, p95] = [0.5, 0.95].map(|q| quantile(&values, q));
            StageSample { stage, on: on.clone(), unit, median, p95, n: values.len() }
        };
        stages.into_iter().map(sample).collect()
    }
}

#[derive(Debug, Serialize)]
pub(crate) struct Timings {
    /// Name and features of the GPU, if it was asked for.
    pub(crate) gpu: Option<String>,
    pub(crate) samples: Vec<StageSample>,
}

impl Timings {
    pub(crate) fn table(&self) -> Rows {
        let row = |s: &StageSample| {
            let [median, p95] = [s.median, s.p95].map(number);
            vec![s.stage.clone(), s.on.clone(), s.n.to_string(), median, p95, s.unit.to_owned()]
        };
        rows(&["stage", "on", "n", "median", "p95", "unit"], self.samples.iter().map(row))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_a_stage_become_one_row() {
        let mut values = StageValues::on_scene("a", 5, [4, 3]);
        values.add("whole", "ms", [3.0, 2.0]);
        values.add("whole: part", "ms", [0.5]);
        values.add("whole", "ms", [4.0]);
        let timings = Timings { gpu: None, samples: values.samples() };
        let cells: Vec<String> = timings.table().iter().map(|row| row.join(" | ")).collect();
        assert_eq!(cells[1], "whole | a, 5 Gaussians, 4x3 | 3 | 3.000 | 3.900 | ms");
        assert_eq!(cells[2], "whole: part | a, 5 Gaussians, 4x3 | 1 | 0.5000 | 0.5000 | ms");
        assert_eq!((cells.len(), cells[0].as_str()), (3, "stage | on | n | median | p95 | unit"));
    }
}
