//! Jobs that move the eye: looking at a scene's matter, visiting identities, and films of flights.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;

use super::protocol::{Outcome, Stop};
use crate::io::animation::Settings;
use crate::navigate::target::Wish;
use crate::navigate::visit::{NoVisit, Place, Visit};
use crate::navigate::{FRAMES, Navigator, Pose};
use crate::pipeline::film::{self, Marked};
use crate::pipeline::observer::{Observer, Severity};
use crate::render::{BackendChoice, RenderSettings, Renderer};
use crate::scene::trace::{self, Sort};
use crate::scene::{Camera, GaussianCloud, IdentityId, SemanticMap};

/// A scene in which one can move about.
pub struct Explored {
    /// Finds ways.
    pub navigator: Navigator,
    /// The Gaussians that it knows.
    pub cloud: Arc<GaussianCloud>,
    /// The number of the connected part that each keypoint belongs to, the largest part first.
    pub parts: Vec<usize>,
}

impl std::fmt::Debug for Explored {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Explored({} keypoints)", self.parts.len())
    }
}

impl Explored {
    /// Looks at a scene.
    pub fn new(cloud: Arc<GaussianCloud>, cameras: &[Camera], up: DVec3) -> Self {
        let navigator = Navigator::new(&cloud, cameras, up);
        trace::record(Sort::Paths, "grid of matter, graph of keypoints", "the camera is to fly", navigator.bytes());
        let parts = navigator.graph.parts(&navigator.matter);
        Self { navigator, cloud, parts }
    }
}

/// What is to be visited.
#[derive(Clone, Debug)]
pub struct VisitRequest {
    /// The scene, if it was looked at before.
    pub explored: Option<Arc<Explored>>,
    /// The Gaussians.
    pub cloud: Arc<GaussianCloud>,
    /// The photos' cameras.
    pub cameras: Vec<Camera>,
    /// Which way is up.
    pub up: DVec3,
    /// How the Gaussians are drawn.
    pub settings: RenderSettings,
    /// Objects and parts.
    pub map: Arc<SemanticMap>,
    /// Which of them.
    pub id: IdentityId,
    /// How it is to be seen.
    pub wish: Wish,
    /// Where the eye is.
    pub from: Pose,
    /// Width by height of the picture.
    pub aspect: f64,
}

/// A film to be made.
#[derive(Clone, Debug)]
pub struct FilmRequest {
    /// The Gaussians.
    pub cloud: Arc<GaussianCloud>,
    /// How they are drawn.
    pub draw: RenderSettings,
    /// One per picture.
    pub cameras: Vec<Camera>,
    /// What is marked in every picture.
    pub marked: Option<(Arc<SemanticMap>, Vec<IdentityId>)>,
    /// Where it goes.
    pub out: PathBuf,
    /// How it is written.
    pub settings: Settings,
}

/// Finds the flight to an identity.
pub fn visit(request: VisitRequest) -> Result<Outcome, Stop> {
    let VisitRequest { explored, cloud, cameras, up, settings, map, id, wish, from, aspect } = request;
    let known = explored.filter(|e| Arc::ptr_eq(&e.cloud, &cloud));
    let explored = known.unwrap_or_else(|| Arc::new(Explored::new(Arc::clone(&cloud), &cameras, up)));
    let place = Place { cloud: &cloud, settings: &settings, map: &map };
    let name = map.identities.full_name(id);
    let visit = match explored.navigator.visit(place, id, wish, &from, aspect, FRAMES) {
        Ok(visit) => Visited { name, flight: Some(Box::new(visit)), problem: None },
        Err(NoVisit::NoWay { why, nearest }) => Visited { name, flight: nearest, problem: Some(why.to_string()) },
        Err(e) => Visited { name, flight: None, problem: Some(e.to_string()) },
    };
    Ok(Outcome::Visited(explored, visit))
}

/// What came of a visit.
#[derive(Clone, Debug)]
pub struct Visited {
    /// What was to be visited.
    pub name: String,
    /// The flight there, or to the nearest place that can be reached.
    pub flight: Option<Box<Visit>>,
    /// Why it does not lead there.
    pub problem: Option<String>,
}

/// Makes a film.
pub fn film(request: FilmRequest, observer: &mut dyn Observer) -> Result<Outcome, Stop> {
    let FilmRequest { cloud, draw, cameras, marked, out, settings } = request;
    let marked = marked.as_ref().map(|(map, ids)| Marked { map, ids, color: [255, 64, 160] });
    let told = |why| observer.note(Severity::Warning, why);
    let mut renderer = Renderer::choose(BackendChoice::Auto, told).unwrap_or_default();
    let out: (&Path, &Settings) = (&out, &settings);
    Ok(Outcome::Written(film::write(&cloud, &draw, &cameras, marked, &mut renderer, out, observer)?.path))
}
