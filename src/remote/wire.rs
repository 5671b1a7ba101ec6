//! What goes over the wire, as JSON: a scene's card, news, and the few things that a client may ask for.

use serde::{Deserialize, Serialize};

use crate::io::trained::SceneInfo;
use crate::pipeline::observer::{Evaluation, Progress, Severity, StepMetrics};
use crate::pipeline::semantics::edit::Edit;

/// Version of what is written here. Another first number is another language; the second counts what was added.
pub(crate) const PROTOCOL: [u32; 2] = [1, 0];
/// Carries the sender's version, `1.0`, and that of its program.
pub(crate) const VERSION_HEADER: &str = "fmlgs-protocol";
/// Names a client, so that the server knows who has what.
pub(crate) const CLIENT_HEADER: &str = "fmlgs-client";
/// Names a run of the server: its numbers are no other's.
pub(crate) const RUN_HEADER: &str = "fmlgs-run";
/// Generation of the snapshot that follows.
pub(crate) const GENERATION_HEADER: &str = "fmlgs-generation";
/// Step of the training that it was taken at.
pub(crate) const STEP_HEADER: &str = "fmlgs-step";

/// What this side speaks: `1.0 (fmlgs 0.1.0)`.
pub(crate) fn version() -> String {
    format!("{}.{} (fmlgs {})", PROTOCOL[0], PROTOCOL[1], env!("CARGO_PKG_VERSION"))
}

/// Whether a side that says so can be talked to.
pub(crate) fn is_understood(version: &str) -> bool {
    version.split('.').next().and_then(|major| major.trim().parse().ok()) == Some(PROTOCOL[0])
}

/// What a scene is, without its Gaussians.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct SceneCard {
    /// As in `scene.json`, without where its photos are.
    pub(crate) info: SceneInfo,
    /// Whether objects and parts may be changed from here.
    pub(crate) allow_edit: bool,
    /// Whether its photos are sent, by their numbers.
    pub(crate) photos: bool,
}

/// One thing that happened, of those that a client is told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum WireEvent {
    /// A training has begun.
    Started(String),
    Step(StepMetrics),
    Evaluation(Evaluation),
    Note(Severity, String),
    Paused(bool),
    /// It is done, and saved in this folder of the server.
    Finished(String),
    Cancelled,
    /// What went wrong.
    Failed(String),
}

/// What is new.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct News {
    /// In order.
    pub(crate) events: Vec<WireEvent>,
    /// Number to ask from next time.
    pub(crate) next: u64,
    /// Whether there is more already.
    pub(crate) more: bool,
    /// Where the training stands.
    pub(crate) progress: Option<Progress>,
    /// Of the newest Gaussians.
    pub(crate) generation: u64,
}

/// What a client may ask to be done.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Ask {
    /// The training waits (`true`) or goes on.
    Pause(bool),
    /// The training ends; what was reached is saved.
    Cancel,
    /// Objects and parts are changed, where that is allowed.
    Edit(Edit),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_first_number_divides() {
        assert!(is_understood(&version()) && is_understood("1.7 (fmlgs 9.9)") && is_understood("1"));
        for other in ["2.0 (fmlgs 0.1.0)", "0.9", "", "x", "11.0"] {
            assert!(!is_understood(other), "{other}");
        }
    }
}
