//! What the agent changes of what is shown, for whoever shows the scene.

use std::sync::Arc;

use glam::DVec3;

use crate::jobs::go_to::Explored;
use crate::navigate::CameraTrajectory;
use crate::scene::IdentityId;

/// A change of what is shown, for whoever shows the scene.
#[derive(Clone, Debug)]
pub enum Effect {
    /// The camera flies; the point is what it turns about from then on.
    Fly(Box<CameraTrajectory>, Option<DVec3>),
    /// These are marked, and nothing else.
    Mark(Vec<IdentityId>),
    /// Whose own Gaussians are left out of the picture.
    Hidden(Vec<IdentityId>),
    /// One scene without all of these is made.
    Remove(Vec<IdentityId>),
    /// The last change of that was undone: these are left out again.
    HiddenUndone(Vec<IdentityId>),
    /// What the user did last is to be undone.
    Undo,
    Renamed(IdentityId, String),
    /// The last change of a name was undone: it is called this again.
    RenameUndone(IdentityId, String),
    /// The scene was looked at: which space is occupied is known.
    Explored(Arc<Explored>),
}

pub type Emit = Box<dyn FnMut(Effect) + Send>;
