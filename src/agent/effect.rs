//! Changes that the agent makes to the displayed scene.

use std::sync::Arc;

use glam::DVec3;

use crate::jobs::go_to::Explored;
use crate::navigate::CameraTrajectory;
use crate::scene::IdentityId;

/// Change of the displayed scene, sent to the window or command line.
#[derive(Clone, Debug)]
pub enum Effect {
    /// The camera flies; the point is the new orbit center.
    Fly(Box<CameraTrajectory>, Option<DVec3>),
    /// Only these identities are marked.
    Mark(Vec<IdentityId>),
    /// Identities whose own Gaussians are hidden.
    Hidden(Vec<IdentityId>),
    /// A new scene without any of these identities is made.
    Remove(Vec<IdentityId>),
    /// The last change of hidden identities was undone: these are hidden again.
    HiddenUndone(Vec<IdentityId>),
    /// The last edit of the user is to be undone.
    Undo,
    Renamed(IdentityId, String),
    /// The last rename was undone: the identity has this name again.
    RenameUndone(IdentityId, String),
    /// The occupied space of the scene was computed.
    Explored(Arc<Explored>),
}

pub type Emit = Box<dyn FnMut(Effect) + Send>;
