//! Changes that the agent makes to the displayed scene.

use std::path::PathBuf;
use std::sync::Arc;

use glam::DVec3;

use crate::jobs::go_to::Explored;
use crate::jobs::locate::LocatedPhoto;
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
    /// The last edit of the user is to be undone.
    Undo,
    Renamed(IdentityId, String),
    /// The changes of the last request were undone.
    Undone(UndoneRequest),
    /// A photo was located, after the flight there; with `true`, its difference from the scene is to be shown.
    Located(Box<LocatedPhoto>, bool),
    /// A scene with these photos, files or folders, is made of this one.
    AddPhotos(Vec<PathBuf>),
    /// The occupied space of the scene was computed.
    Explored(Arc<Explored>),
}

/// Things as they were before a request.
#[derive(Clone, Debug, Default)]
pub struct UndoneRequest {
    /// Identities that are hidden again; `None` if the request changed none.
    pub(crate) hidden: Option<Vec<IdentityId>>,
    /// Names that identities have again, the newest rename first.
    pub(crate) names: Vec<(IdentityId, String)>,
}

pub type Emit = Box<dyn FnMut(Effect) + Send>;
