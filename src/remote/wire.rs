//! Messages between server and client, as JSON: the card of a scene, news, and the commands of a client.

use serde::{Deserialize, Serialize};

use crate::io::trained::SceneInfo;
use crate::pipeline::observer::{Evaluation, Progress, Severity, StepMetrics};
use crate::pipeline::semantics::lifting::edit::Edit;

/// Version of the protocol. Another first number is incompatible; the second one counts compatible additions.
pub(crate) const PROTOCOL: [u32; 2] = [1, 0];
/// Header with the sender's protocol version, `1.0`, and the version of its program.
pub(crate) const VERSION_HEADER: &str = "fmlgs-protocol";
/// Header with the name of a client, so that the server can track its state.
pub(crate) const CLIENT_HEADER: &str = "fmlgs-client";
/// Header with the name of a run of the server: event numbers and generations are valid within one run.
pub(crate) const RUN_HEADER: &str = "fmlgs-run";
/// Header with the generation of the snapshot in the body.
pub(crate) const GENERATION_HEADER: &str = "fmlgs-generation";
/// Header with the training step of the snapshot.
pub(crate) const STEP_HEADER: &str = "fmlgs-step";

/// Protocol version of this program: `1.0 (fmlgs 0.1.0)`.
pub(crate) fn version() -> String {
    format!("{}.{} (fmlgs {})", PROTOCOL[0], PROTOCOL[1], env!("CARGO_PKG_VERSION"))
}

/// Returns whether the other side's version is compatible.
pub(crate) fn is_understood(version: &str) -> bool {
    version.split('.').next().and_then(|major| major.trim().parse().ok()) == Some(PROTOCOL[0])
}

/// Description of a scene, without its Gaussians.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct SceneSummary {
    /// Contents of `scene.json`, without the path of the photos.
    pub(crate) info: SceneInfo,
    /// True if clients may edit objects and parts.
    pub(crate) allow_edit: bool,
    /// True if photos can be requested, by their numbers.
    pub(crate) photos: bool,
}

/// Event that is sent to clients.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum WireEvent {
    /// A training with this title has begun.
    Started(String),
    Step(StepMetrics),
    Evaluation(Evaluation),
    Note(Severity, String),
    Paused(bool),
    /// The training has finished, and is saved in this folder of the server.
    Finished(String),
    Cancelled,
    /// The training has failed for this reason.
    Failed(String),
}

/// Update for a client.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct ServerUpdate {
    /// Events in order.
    pub(crate) events: Vec<WireEvent>,
    /// Number of the last event, to ask from next time.
    pub(crate) next: u64,
    /// True if there are more events already.
    pub(crate) more: bool,
    /// Progress of the training.
    pub(crate) progress: Option<Progress>,
    /// Generation of the newest Gaussians.
    pub(crate) generation: u64,
}

/// Command of a client.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum ClientRequest {
    /// Pause the training (`true`) or let it go on.
    Pause(bool),
    /// End the training; its state is saved.
    Cancel,
    /// Edit objects and parts, if permitted.
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
