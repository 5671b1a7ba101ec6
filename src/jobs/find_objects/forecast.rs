//! Estimated times of finding masks, reported before it starts.

use crate::io::memory;
use crate::jobs::models::{ModelEntry, ModelList};
use crate::math::format::{self, things};
use crate::models::catalog;
use crate::models::engine::engine;

/// Cores of the machine that measured the times of the list, and the number beyond which networks gain little.
const MEASURED_CORES: usize = 2;
const MOST_CORES: usize = 8;

/// Estimated time of a segmenter on one photo here, or of an encoder on one picture of an object, from times measured
/// elsewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct InferenceEstimate {
    secs: f64,
    /// Seconds for each object in it besides.
    object_secs: Option<f64>,
}

impl InferenceEstimate {
    /// Returns the time of a model of the list, if it was measured, by this machine's engine or by the fast one.
    pub(crate) fn of(model: &str, known: &ModelList, is_fast: bool) -> Option<Self> {
        Self::estimated(&known.get(model)?.0, is_fast, known.cores)
    }

    /// Returns the same for jobs without the list.
    pub(super) fn of_installed(model: &str) -> Option<Self> {
        let entry = catalog::entry(model).ok()?;
        Self::estimated(&entry, engine().ok()?.is_fast(), memory::cores())
    }

    fn estimated(entry: &ModelEntry, is_fast: bool, cores: usize) -> Option<Self> {
        let measured = entry.photo_seconds?;
        let secs = if is_fast { measured.onnx_runtime } else { measured.built_in? };
        let slower = secs / measured.onnx_runtime;
        let object_secs = measured.each_object.map(|object| on_cores(slower * object, cores));
        Some(Self { secs: on_cores(secs, cores), object_secs })
    }

    /// Returns the time in words for one `what`: a photo, a picture of an object.
    pub(crate) fn text(self, what: &str) -> String {
        let time = if self.secs < 5.0 { format::roughly(self.secs) } else { format::about(self.secs) };
        format!("{time} {what} here, by estimate")
    }
}

/// Returns the time of tracking masks through this many photos with a network of this name, if it was measured.
pub(super) fn tracking(tracker: &str, photos: usize) -> Option<String> {
    let entry = catalog::entry(tracker).ok()?;
    let seconds = entry.track_seconds.filter(|_| engine().is_ok_and(|e| e.is_fast()))?;
    let [look, follow] = seconds.map(|s| format::about(on_cores(s, memory::cores()) * photos as f64));
    Some(format!(
        "{} looks at {} first ({look}), then follows each mask through those that the \
         Gaussians do not explain (at most {follow} a mask), by estimate. What is done \
         is kept if you stop it.",
        entry.title,
        things(photos, "photo")
    ))
}

/// Scales measured seconds to another number of cores.
fn on_cores(secs: f64, cores: usize) -> f64 {
    secs * MEASURED_CORES as f64 / cores.clamp(1, MOST_CORES) as f64
}

/// Returns the time of finding objects in up to `most_photos` photos, in words.
pub(crate) fn sentence(look: InferenceEstimate, most_photos: usize) -> String {
    let more = look.object_secs.map(|secs| format!(", and {} more for each object in it", format::about(secs)));
    let (each, more) = (format::about(look.secs), more.unwrap_or_default());
    match most_photos {
        0 | 1 => format!("Looking at the photo takes {each}{more}."),
        n => format!(
            "Looking at a photo takes {each}{more}. One may be enough; up to {n} are looked at where something is still \
             unknown."
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::models::catalog::PhotoSeconds;

    fn entry() -> ModelEntry {
        catalog::entries().expect("the list").remove(0)
    }

    #[test]
    fn more_cores_are_faster_up_to_a_point_and_the_built_in_engine_is_slower() {
        let measured = Some(PhotoSeconds { onnx_runtime: 60.0, built_in: Some(90.0), each_object: None });
        let mut entry = entry();
        entry.photo_seconds = measured;
        let secs = |fast, cores| InferenceEstimate::estimated(&entry, fast, cores).expect("a time").secs;
        assert_eq!(secs(true, 4) * 2.0, secs(true, 2));
        assert_eq!(secs(true, 64), secs(true, 8));
        assert!(secs(false, 2) > secs(true, 2));
        entry.photo_seconds = None;
        assert_eq!(InferenceEstimate::estimated(&entry, true, 2), None);
    }

    #[test]
    fn sentences_name_the_most() {
        let look = InferenceEstimate { secs: 60.0, object_secs: None };
        assert!(sentence(look, 12).contains("up to 12"));
        assert!(!sentence(look, 1).contains("up to") && !sentence(look, 1).contains("object"));
        let with_objects = InferenceEstimate { object_secs: Some(42.0), ..look };
        assert!(sentence(with_objects, 1).contains("50 s more for each object"));
    }
}
