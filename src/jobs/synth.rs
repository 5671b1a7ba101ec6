//! Photos with ground truth, rendered from a glTF scene.

use std::path::Path;

use super::JobError;
use crate::pipeline::observer::{Observer, Severity};
use crate::pipeline::synth;
pub(crate) use crate::pipeline::synth::{Levels, Rig, SynthOptions, SynthReport};

/// Renders the scene in a file into a folder of posed photos.
pub(crate) fn run(
    scene: &Path,
    options: &SynthOptions,
    out: &Path,
    observer: &mut dyn Observer,
) -> Result<SynthReport, JobError> {
    let report = synth::run(scene, options, out, observer)?;
    for warning in &report.warnings {
        observer.note(Severity::Warning, warning.clone());
    }
    Ok(report)
}
