//! Sweeps of the report, one file per stage of the program.

pub(crate) mod depth;
pub(crate) mod features;
pub(crate) mod path;
pub(crate) mod query;
pub(crate) mod render;
pub(crate) mod train;
pub(crate) mod views;

use std::collections::BTreeMap;
use std::time::Instant;

use super::document::{ErrorKind, Measure};
use super::sweep::{StudyError, SweepCase};

/// Input of a sweep in words: name and value.
pub(crate) type StudyInput = BTreeMap<String, String>;

/// Settings of a stage, each with what it means to the study: the default first.
struct Variants<V>(Vec<(SweepCase, V)>);

impl<V> Variants<V> {
    fn new(default: impl Into<String>, variant: V) -> Self {
        Self(vec![(SweepCase::default(default), variant)])
    }

    fn add(&mut self, method: &str, setting: impl Into<String>, knobs: &[(&str, serde_json::Value)], variant: V) {
        self.0.push((SweepCase::new(method, setting, knobs), variant));
    }
}

/// Draws twice and returns the second result with its seconds, as buffers are kept from image to image.
fn timed<F>(mut draw: impl FnMut() -> Result<F, StudyError>) -> Result<(F, f64), StudyError> {
    draw()?;
    let start = Instant::now();
    let drawn = draw()?;
    Ok((drawn, start.elapsed().as_secs_f64()))
}

fn error(name: &str, meaning: &str) -> Measure {
    Measure::new(name, "", ErrorKind::Error, meaning)
}

/// Mean IoU, of which there are several.
fn overlap(name: &str, meaning: &str) -> Measure {
    Measure::new(name, "", ErrorKind::Share, meaning)
}
