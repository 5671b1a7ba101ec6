//! Interface of the agent to the scene. The window, the command line and tests implement it; everything without a
//! camera or a file is in [`super::resolve`] and [`super::describe`].

use std::sync::atomic::AtomicBool;

use glam::DVec3;

use super::camera_args::{Direction, Distance};
use super::relation::Viewpoint;
use crate::jobs::query::ask_with;
use crate::navigate::target::Side;
use crate::pipeline::semantics::query::answer::{Basis, QueryAnswer};
pub use crate::pipeline::semantics::query::language::QueryPlace;
use crate::pipeline::semantics::query::query_engine::ask_by_name;
use crate::pipeline::semantics::query::recipe::{MatchBy, QueryConfig};
use crate::scene::{Bounds, Identities, IdentityId, LanguageFeatures, Level, LevelFilter};

/// Facts about one identity.
#[derive(Clone, Debug, PartialEq)]
pub struct IdentityFacts {
    /// Names; the first is shown.
    pub names: Vec<String>,
    pub level: Level,
    /// Identity that it is a part of; `NO_IDENTITY` for objects.
    pub parent: IdentityId,
    /// Bounding box in world space, in scene units, if it has Gaussians.
    pub bounds: Option<Bounds>,
    /// Share of the current view that it covers, 0 to 1.
    pub in_view: f64,
    /// True if it is not drawn.
    pub hidden: bool,
}

/// Result of a flight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Arrival {
    pub distance: f64,
    /// Share of the picture that the target covers now, 0 to 1.
    pub in_view: f64,
}

/// Reason for which the camera cannot reach a goal.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{reason}")]
pub struct Unreachable {
    pub reason: String,
    /// Distance between the goal and the nearest reachable pose, in scene units, if known.
    pub nearest: Option<f64>,
}

/// Result of a movement.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Movement {
    pub distance_done: f64,
    pub stopped_by_obstacle: bool,
}

/// A photo that was located.
#[derive(Clone, Debug, PartialEq)]
pub struct PhotoSight {
    /// Name of the file.
    pub name: String,
    /// Place of the camera, in scene units.
    pub center: DVec3,
    /// Standard deviations of place and direction, in words, if they are known.
    pub deviation: Option<String>,
    /// Share of the photo that the scene explains, 0 to 1.
    pub explained: f64,
}

/// Error of the scene, in plain words.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct WorldError(pub String);

/// Scene that can be queried and viewed. Methods may block while a path is computed.
pub trait World {
    /// Objects and parts.
    fn identities(&self) -> &Identities;

    /// Answers a query. Errors if the encoder fails.
    fn locate(&mut self, query: &str, kind: LevelFilter, place: &QueryPlace) -> Result<QueryAnswer, WorldError>;

    /// Identities that are no longer in the scene.
    fn gone(&self) -> Vec<IdentityId> {
        Vec::new()
    }

    /// Basis of queries: names, embeddings or both.
    fn match_by(&self) -> MatchBy {
        MatchBy::Both
    }

    /// Facts about an identity; `None` if it is not, or no longer, in the scene.
    fn facts(&self, id: IdentityId) -> Option<IdentityFacts>;

    /// Current view.
    fn view(&self) -> Viewpoint;

    /// Length of a scene unit in meters, if known.
    fn meters_per_unit(&self) -> Option<f64>;

    /// Flies to an identity, to view it from `side`; a `closeness` of 2 halves the usual distance.
    fn go_to(&mut self, id: IdentityId, side: Side, closeness: f64) -> Result<Arrival, Unreachable>;

    /// Turns toward an identity.
    fn look_at(&mut self, id: IdentityId) -> Result<Arrival, Unreachable>;

    /// Moves the camera; stops before occupied space.
    fn move_eye(&mut self, direction: Direction, distance: Distance) -> Result<Movement, Unreachable>;

    /// Turns the camera by degrees.
    fn turn(&mut self, direction: Direction, degrees: f64) -> Result<(), Unreachable>;

    /// Marks only these identities in the view.
    fn highlight(&mut self, ids: &[IdentityId]) -> Result<(), WorldError>;

    /// Draws only these identities.
    fn isolate(&mut self, ids: &[IdentityId]) -> Result<(), WorldError>;

    /// Hides an identity or draws it again.
    fn set_hidden(&mut self, id: IdentityId, hidden: bool) -> Result<(), WorldError>;

    /// Draws everything again.
    fn show_all(&mut self) -> Result<(), WorldError>;

    /// Schedules a new scene without an identity, with the uncovered hole filled, for [`Self::carry_out`]. The current
    /// scene is unchanged.
    fn remove(&mut self, id: IdentityId) -> Result<(), WorldError>;

    /// Executes the scheduled removals at the end of a request, all in one new scene.
    fn carry_out(&mut self) {}

    /// Begins a request: what it changes is undone together.
    fn begin(&mut self) {}

    /// Changes the first name of an identity.
    fn rename(&mut self, id: IdentityId, name: &str) -> Result<(), WorldError>;

    /// Undoes the changes of the last request and returns their description.
    fn undo(&mut self) -> Result<String, WorldError>;

    /// Writes the Gaussians of an identity to a file and returns its path.
    fn export(&mut self, id: IdentityId) -> Result<String, WorldError>;

    /// Locates the photo of this file, goes to where it was taken and compares it with the view. Without a name, it is
    /// the last photo that was spoken of or given. `cancel` stops the search.
    fn locate_photo(&mut self, _photo: Option<&str>, _cancel: &AtomicBool) -> Result<PhotoSight, WorldError> {
        Err(WorldError("photos cannot be located here".into()))
    }

    /// Shows the difference of the last photo from the scene, from where it was taken.
    fn show_changes(&mut self, _cancel: &AtomicBool) -> Result<PhotoSight, WorldError> {
        Err(WorldError("there is no photo to compare with".into()))
    }

    /// Begins to make a scene of this one and the photos of a file or folder; without one, of all photos that were given.
    /// Returns their name or number.
    fn add_photos(&mut self, _photos: Option<&str>) -> Result<String, WorldError> {
        Err(WorldError("photos cannot be added here".into()))
    }

    /// Path of the file that [`Self::export`] would replace, if it exists.
    fn export_replaces(&self, id: IdentityId) -> Option<String>;
}

/// Answers a query by names alone: [`World::locate`] for scenes without an encoder.
pub fn locate_by_names(identities: &Identities, query: &str, kind: LevelFilter, place: &QueryPlace) -> QueryAnswer {
    let recipe = QueryConfig::default();
    let asked = ask_by_name(identities, query, (kind, place), &recipe);
    asked.unwrap_or_else(|| QueryAnswer::nothing(Basis::Names, identities, &recipe))
}

/// Answers a query with embeddings: [`World::locate`] for scenes with the `features` of an encoder. `encode` embeds a
/// phrase in the same dimension.
pub fn locate_with(
    identities: &Identities,
    features: &LanguageFeatures,
    query: &str,
    from: (LevelFilter, &QueryPlace),
    encode: &mut dyn FnMut(&str) -> Vec<f32>,
) -> QueryAnswer {
    let recipe = QueryConfig::default();
    let asked = ask_with(identities, (features, &recipe), query, from, &mut |phrase: &str| Ok::<_, ()>(encode(phrase)));
    asked.unwrap_or_else(|| QueryAnswer::nothing(Basis::Names, identities, &recipe))
}
