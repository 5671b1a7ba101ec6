//! Savings by a scene's plan, compared with everything on: times and memory of opening a scene and getting ready
//! for its user. `fmlgs bench --plan` measures each of the two in processes of its own, so that memory is its own.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::sweep::failed;
use super::table::{Rows, rows};
use super::{StudyError, document::Sample};
use crate::math::format::bytes;
use crate::models;
use crate::pipeline::semantics::code_map::CodeMap;
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::lod::LodTree;
use crate::render::{BackendChoice, RenderSettings, Renderer, real_gpu};
use crate::scene::plan::{Overrides, ScenePlan, When};
use crate::scene::{Camera, GaussianCloud, SceneFacts, SemanticMap};

pub(crate) const SIZE: [u32; 2] = [1_008, 567];

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum PlanVariant {
    Plan,
    Everything,
}

pub(crate) struct OpenScene {
    pub(crate) cloud: Arc<GaussianCloud>,
    pub(crate) settings: RenderSettings,
    pub(crate) map: Option<Arc<SemanticMap>>,
    /// The first view, of [`SIZE`].
    pub(crate) first: Camera,
    pub(crate) facts: SceneFacts,
}

/// Measurements of one process; medians over several.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct PlanCost {
    /// Reading, until the scene can be drawn.
    open_secs: f64,
    /// From the start of reading until the first image.
    first_picture_secs: f64,
    /// From the start of reading until all is there that this plan wants at opening.
    ready_secs: f64,
    /// Memory at rest beyond that of the process before it read anything.
    resident_bytes: f64,
    /// Peak of that memory; 0 where the system does not report it.
    peak_bytes: f64,
    /// Drawing all that belongs to a view at rest.
    view_ms: f64,
}

impl PlanCost {
    /// The medians of several processes.
    pub(crate) fn median(costs: &[Self]) -> Self {
        let of = |f: fn(&Self) -> f64| costs.iter().map(f).collect::<Sample>().median;
        Self {
            open_secs: of(|c| c.open_secs),
            first_picture_secs: of(|c| c.first_picture_secs),
            ready_secs: of(|c| c.ready_secs),
            resident_bytes: of(|c| c.resident_bytes),
            peak_bytes: of(|c| c.peak_bytes),
            view_ms: of(|c| c.view_ms),
        }
    }
}

/// Opens a scene, draws its first view with what belongs to it, and builds what the plan wants at opening, one
/// after the other. Nothing else may run in this process.
pub(crate) fn cost(
    open: impl FnOnce() -> Result<OpenScene, StudyError>,
    variant: PlanVariant,
) -> Result<PlanCost, StudyError> {
    let overrides = if variant == PlanVariant::Plan { Overrides::default() } else { Overrides::everything() };
    // The program has looked for a GPU before it opens anything, and keeps the driver that it found.
    let _ = real_gpu();
    let before = resident();
    let start = Instant::now();
    let scene = open()?;
    let open_secs = start.elapsed().as_secs_f64();
    let plan = ScenePlan::new(scene.facts.clone(), &overrides);
    let settings = RenderSettings { sh_degree: plan.sh_degree, ..scene.settings.clone() };
    let mut renderer = Renderer::choose(BackendChoice::Auto, drop).map_err(failed)?;
    let image = renderer.draw(&scene.cloud, &scene.first, &settings).map_err(failed)?;
    let first_picture_secs = start.elapsed().as_secs_f64();
    let mut mapper = Renderer::new();
    let asked = scene.map.as_deref().filter(|_| plan.maps.now(false));
    let maps = asked.map(|map| maps(&mut mapper, &scene, map, &plan, &settings)).transpose()?;
    let view_ms = (start.elapsed().as_secs_f64() - open_secs) * 1e3;
    let encoder = encoder(&scene, &plan)?;
    let levels = plan.levels.then(|| LodTree::build(&scene.cloud, || true));
    let ready_secs = start.elapsed().as_secs_f64();
    renderer.rest();
    drop(mapper);
    let resident_bytes = resident().saturating_sub(before) as f64;
    let peak_bytes = peak().saturating_sub(before) as f64;
    drop((image, maps, encoder, levels));
    Ok(PlanCost { open_secs, first_picture_secs, ready_secs, resident_bytes, peak_bytes, view_ms })
}

/// Draws the identities and codes of the pixels of the first view.
fn maps(
    renderer: &mut Renderer,
    scene: &OpenScene,
    map: &SemanticMap,
    plan: &ScenePlan,
    settings: &RenderSettings,
) -> Result<(ViewMap, CodeMap), StudyError> {
    let (cloud, camera) = (&scene.cloud, &scene.first);
    let exact =
        ViewMap::render(renderer, cloud, &map.identity_of, &map.identities, camera, settings).map_err(failed)?;
    let codes = CodeMap::render(renderer, cloud, &map.codes, plan.parts, camera, settings).map_err(failed)?;
    Ok((exact, codes))
}

/// Loads the text encoder, if the plan wants it at opening.
fn encoder(scene: &OpenScene, plan: &ScenePlan) -> Result<Option<Box<dyn models::Encoder>>, StudyError> {
    let language = scene.map.as_ref().and_then(|m| m.language.as_ref()).filter(|_| plan.encoder == When::Always);
    let Some(language) = language else { return Ok(None) };
    let mut encoder = models::encoder(&language.encoder).map_err(failed)?;
    encoder.text("object").map_err(failed)?;
    Ok(Some(encoder))
}

/// Memory of this process now, bytes; 0 where the system does not report it.
fn resident() -> u64 {
    let Ok(pid) = sysinfo::get_current_pid() else { return 0 };
    let Ok(mut system) = sysinfo::System::new() else { return 0 };
    system.refresh_processes(sysinfo::ProcessesToUpdate::Some(&[pid]), false);
    system.process(pid).map_or(0, sysinfo::Process::memory)
}

/// Peak memory of this process, bytes; 0 where the system does not report it.
fn peak() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    line.and_then(|l| l.split_whitespace().next()?.parse::<u64>().ok()).map_or(0, |kb| kb * 1024)
}

/// A scene with both of its plans.
#[derive(Debug, Serialize)]
pub(crate) struct Saving {
    scene: String,
    plan: PlanCost,
    everything: PlanCost,
}

impl Saving {
    pub(crate) fn new(path: &Path, plan: PlanCost, everything: PlanCost) -> Self {
        Self { scene: super::bench::label(path), plan, everything }
    }
}

pub(crate) fn table(all: &[Saving]) -> Rows {
    let head = ["scene", "", "open s", "picture s", "ready s", "at rest", "peak", "view ms"];
    let both =
        |s: &Saving| [(s.scene.clone(), "plan", s.plan.clone()), (String::new(), "everything", s.everything.clone())];
    rows(
        &head,
        all.iter().flat_map(both).map(|(scene, variant, cost)| {
            let mut cells = vec![scene, variant.to_owned()];
            cells.extend([cost.open_secs, cost.first_picture_secs, cost.ready_secs].map(|s| format!("{s:.2}")));
            cells.extend([cost.resident_bytes, cost.peak_bytes].map(|b| bytes(b as u64)));
            cells.push(format!("{:.1}", cost.view_ms));
            cells
        }),
    )
}
