//! Scene without its Gaussians, as far as questions need it: a web page carries it.
//!
//! `tools/page/language` is the other end: the language as WebAssembly, which answers from this.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::scene::Identities;
use crate::scene::colors::SeenColors;
use crate::scene::shapes::NearShape;

/// Scene to be asked. Places are relative to an origin that the caller knows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct PortableScene {
    pub(crate) identities: Identities,
    /// Colors of the identities.
    pub(crate) colors: SeenColors,
    /// Shapes by number from 0.
    pub(crate) shapes: Vec<Option<NearShape>>,
    /// Up direction of the scene.
    pub(crate) up: DVec3,
    /// Length of a scene unit in meters, if known.
    pub(crate) meters: Option<f64>,
}

impl PortableScene {
    /// Takes what is known of a scene's identities, relative to an origin.
    pub(crate) fn new(identities: &Identities, origin: DVec3, up: DVec3, meters: Option<f64>) -> Self {
        let (colors, shapes) = (identities.colors.clone(), identities.shapes.near(origin));
        Self { identities: identities.clone(), colors, shapes, up, meters }
    }
}
