//! What is swept, one file per stage of the program.

pub mod depth;
pub mod features;
pub mod path;
pub mod query;
pub mod render;
pub mod train;
pub mod views;

use std::collections::BTreeMap;
use std::time::Instant;

use crate::report::document::Form;
use crate::report::{Case, Measure, Rule, Stage, StageName, StudyError};

/// What a sweep is run on, in words: name and value.
pub type Input = BTreeMap<String, String>;

/// A stage that nothing was measured of yet.
fn stage(
    name: StageName,
    secs_of: &str,
    reference: &str,
    input: &Input,
    seeds: u32,
    rule: Rule,
    measures: Vec<Measure>,
) -> Stage {
    Stage {
        name,
        secs_of: secs_of.into(),
        reference: reference.into(),
        input: input.clone(),
        seeds: (0..u64::from(seeds)).collect(),
        planned: 0,
        measures,
        rule,
        points: Vec::new(),
        orders: Vec::new(),
        left_out: Vec::new(),
    }
}

/// Settings with what they mean to the study itself.
struct Plans<P>(Vec<(Case, P)>);

impl<P> Plans<P> {
    fn cases(&self) -> Vec<Case> {
        self.0.iter().map(|(case, _)| case.clone()).collect()
    }

    fn of(&self, case: &Case) -> Option<&P> {
        self.0.iter().find(|(c, _)| c == case).map(|(_, plan)| plan)
    }
}

/// What is drawn, and the seconds that took: the second time, as buffers are kept from picture to
/// picture.
fn timed<F>(mut draw: impl FnMut() -> Result<F, StudyError>) -> Result<(F, f64), StudyError> {
    draw()?;
    let start = Instant::now();
    let drawn = draw()?;
    Ok((drawn, start.elapsed().as_secs_f64()))
}

/// Mean IoU, of which there are several.
fn overlap(name: &str, meaning: &str) -> Measure {
    Measure::new(name, "", Form::Share, meaning)
}
