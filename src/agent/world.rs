//! What the agent needs of the scene. The window, the command line and tests supply it; everything
//! that does not need a camera or a file is in [`super::resolve`] and [`super::describe`].

use super::camera_args::{Direction, Distance};
use super::relation::{Extent, Viewpoint};
use crate::jobs::query::ask_with;
use crate::navigate::target::Side;
use crate::pipeline::semantics::answer::{Basis, QueryAnswer};
use crate::pipeline::semantics::query_engine::ask_by_name;
use crate::pipeline::semantics::recipe::{Recipe, Understanding};
use crate::scene::{Bounds, Identities, IdentityId, LanguageFeatures, Level, LevelFilter};

/// What is known of one identity.
#[derive(Clone, Debug, PartialEq)]
pub struct IdentityFacts {
    /// What it is called; the first is shown.
    pub names: Vec<String>,
    pub level: Level,
    /// What it is a piece of; `NOBODY` for objects.
    pub parent: IdentityId,
    /// Its box in world space, in scene units, if it fills any space.
    pub bounds: Option<Bounds>,
    /// The share of the present view that it covers, 0 to 1.
    pub in_view: f64,
    /// Whether it is left out of the picture.
    pub hidden: bool,
}

/// What came of a flight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Arrival {
    pub distance: f64,
    /// The share of the picture that the target covers now, 0 to 1.
    pub in_view: f64,
}

/// Why the camera cannot go somewhere.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{reason}")]
pub struct Unreachable {
    pub reason: String,
    /// How near to the goal the camera could come, in scene units, if that is known.
    pub nearest: Option<f64>,
}

/// What came of a movement.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Movement {
    pub distance_done: f64,
    pub stopped_by_obstacle: bool,
}

/// Why the scene could not do something, in plain words.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct WorldError(pub String);

/// A scene that can be asked and looked at. Methods may block while a way is computed.
pub trait World {
    /// Objects and parts.
    fn identities(&self) -> &Identities;

    /// What a query means. Errors if the scene cannot be asked.
    fn locate(&mut self, query: &str, kind: LevelFilter) -> Result<QueryAnswer, WorldError>;

    /// What questions are compared with.
    fn understanding(&self) -> Understanding {
        Understanding::Both
    }

    /// What is known of an identity; `None` if it is not (or no more) in the scene.
    fn facts(&self, id: IdentityId) -> Option<IdentityFacts>;

    /// The size of an identity, if it fills any space: that of its box, unless more is known.
    fn extent(&self, id: IdentityId) -> Option<Extent> {
        Extent::of_box(&self.facts(id)?.bounds?, self.view().up)
    }

    /// The present view.
    fn view(&self) -> Viewpoint;

    /// Length of a scene unit in meters, if that is known.
    fn metres_per_unit(&self) -> Option<f64>;

    /// Flies to an identity, to see it from `side`: 1 as close as usual, 2 twice as close.
    fn go_to(&mut self, id: IdentityId, side: Side, closeness: f64) -> Result<Arrival, Unreachable>;

    /// Turns toward an identity.
    fn look_at(&mut self, id: IdentityId) -> Result<Arrival, Unreachable>;

    /// Moves the eye; stops before occupied space.
    fn move_eye(&mut self, direction: Direction, distance: Distance) -> Result<Movement, Unreachable>;

    /// Turns the eye by degrees.
    fn turn(&mut self, direction: Direction, degrees: f64) -> Result<(), Unreachable>;

    /// Marks these in the view, and nothing else.
    fn highlight(&mut self, ids: &[IdentityId]) -> Result<(), WorldError>;

    /// Draws these identities, and nothing else.
    fn isolate(&mut self, ids: &[IdentityId]) -> Result<(), WorldError>;

    /// Leaves an identity out of the picture, or draws it again.
    fn set_hidden(&mut self, id: IdentityId, hidden: bool) -> Result<(), WorldError>;

    /// Draws everything again.
    fn show_all(&mut self) -> Result<(), WorldError>;

    /// Makes a scene of its own without an identity, what it hid closed; this one stays as it is. Waits for
    /// [`Self::carry_out`].
    fn remove(&mut self, id: IdentityId) -> Result<(), WorldError>;

    /// Does what waited for the end of the request: whatever is removed by one request goes into one scene.
    fn carry_out(&mut self) {}

    /// Gives an identity another first name.
    fn rename(&mut self, id: IdentityId, name: &str) -> Result<(), WorldError>;

    /// Takes back the last change; says which.
    fn undo(&mut self) -> Result<String, WorldError>;

    /// Writes the Gaussians of an identity to a file; says which.
    fn export(&mut self, id: IdentityId) -> Result<String, WorldError>;

    /// The file that [`Self::export`] would replace, if there is one.
    fn export_replaces(&self, id: IdentityId) -> Option<String>;
}

/// Answers a query by names alone: a [`World::locate`] for scenes without an encoder.
pub fn locate_by_names(identities: &Identities, query: &str, kind: LevelFilter) -> QueryAnswer {
    let recipe = Recipe::default();
    let asked = ask_by_name(identities, query, kind, &recipe);
    asked.unwrap_or_else(|| QueryAnswer::nothing(Basis::Names, identities, &recipe))
}

/// Answers a query as a scene does that an encoder has looked at: a [`World::locate`] for scenes whose encoder's
/// `features` and phrases (`encode`, of the same dimension) are at hand.
pub fn locate_with(
    identities: &Identities,
    features: &LanguageFeatures,
    query: &str,
    kind: LevelFilter,
    encode: &mut dyn FnMut(&str) -> Vec<f32>,
) -> QueryAnswer {
    let recipe = Recipe::default();
    let asked = ask_with(identities, (features, &recipe), query, kind, &mut |phrase: &str| Ok::<_, ()>(encode(phrase)));
    asked.unwrap_or_else(|| QueryAnswer::nothing(Basis::Names, identities, &recipe))
}
