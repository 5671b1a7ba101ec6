//! Savings by a scene's plan, compared with everything on: times and memory of opening a scene and getting ready
//! for its user. `fmlgs bench --plan` measures each of the two in processes of its own, so that memory is its own.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::bench::views_of;
use super::sweep::failed;
use super::table::{Rows, rows};
use super::{StudyError, document::Sample};
use crate::math::format::bytes;
use crate::models;
use crate::navigate::Navigator;
use crate::pipeline::semantics::code_map::CodeMap;
use crate::pipeline::semantics::thumbnails::draw_thumbnails;
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::{BackendChoice, Device, RenderSettings, Renderer, real_gpu};
use crate::scene::plan::{Overrides, ScenePlan, When};
use crate::scene::{Camera, GaussianCloud, SceneFacts, SemanticMap, resource_log};

pub(crate) const SIZE: [u32; 2] = [1_008, 567];

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum PlanVariant {
    Plan,
    Everything,
}

pub(crate) struct OpenScene {
    pub(crate) cloud: Arc<GaussianCloud>,
    pub(crate) settings: RenderSettings,
    pub(crate) map: Option<Arc<SemanticMap>>,
    pub(crate) cameras: Vec<Camera>,
    pub(crate) up: glam::DVec3,
    /// The first view, of [`SIZE`].
    pub(crate) first: Camera,
    pub(crate) facts: SceneFacts,
}

/// Measurements of one process; medians over several.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PlanCost {
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
    /// Buffers on the device for one image; 0 without any adapter.
    device_bytes: f64,
    /// Drawing an image while the camera moves.
    frame_ms: f64,
    /// Drawing all that belongs to a view at rest.
    view_ms: f64,
    loaded: Vec<String>,
}

impl PlanCost {
    /// The medians of several processes, and what the last has loaded; `None` of none.
    pub(crate) fn median(costs: &[Self]) -> Option<Self> {
        let of = |f: fn(&Self) -> f64| costs.iter().map(f).collect::<Sample>().median;
        Some(Self {
            open_secs: of(|c| c.open_secs),
            first_picture_secs: of(|c| c.first_picture_secs),
            ready_secs: of(|c| c.ready_secs),
            resident_bytes: of(|c| c.resident_bytes),
            peak_bytes: of(|c| c.peak_bytes),
            device_bytes: of(|c| c.device_bytes),
            frame_ms: of(|c| c.frame_ms),
            view_ms: of(|c| c.view_ms),
            loaded: costs.last()?.loaded.clone(),
        })
    }
}

/// Opens a scene, draws its first view with what belongs to it, and builds what the plan wants at opening, one
/// after the other. Nothing else may run in this process.
pub(crate) fn cost(
    open: impl FnOnce() -> Result<OpenScene, StudyError>,
    variant: PlanVariant,
    repeats: usize,
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
    let choice = if plan.on_cpu { BackendChoice::Cpu } else { BackendChoice::Auto };
    let mut renderer = Renderer::choose(choice, drop).map_err(failed)?;

    let drawn = RenderSettings { depth: plan.depth == When::Always, ..settings.clone() };
    let image = renderer.draw(&scene.cloud, &scene.first, &drawn).map_err(failed)?;
    let first_picture_secs = start.elapsed().as_secs_f64();
    let mut mapper = Renderer::new();
    let asked = scene.map.as_deref().filter(|_| plan.maps.now(false));
    let maps = asked.map(|map| maps(&mut mapper, &scene, map, &plan, &settings)).transpose()?;
    let view_ms = (start.elapsed().as_secs_f64() - open_secs) * 1e3;
    let kept = at_opening(&scene, &plan, &settings)?;
    let ready_secs = start.elapsed().as_secs_f64();
    if plan.buffers != When::Always {
        renderer.rest();
        mapper = Renderer::new();
    }
    let resident_bytes = resident().saturating_sub(before) as f64;
    let peak_bytes = peak().saturating_sub(before) as f64;
    let mut loaded: Vec<String> = resource_log::since(0).iter().map(|l| l.what.clone()).collect();
    loaded.extend(maps.is_some().then(|| "maps of the view".to_owned()));
    loaded.extend(kept.navigator.is_some().then(|| "navigation".to_owned()));
    loaded.extend(kept.thumbnails.is_some().then(|| "thumbnails".to_owned()));
    drop((image, mapper, maps, kept));

    let mut times = Vec::new();
    for camera in views_of(&scene.cloud, SIZE[0], SIZE[1]) {
        renderer.draw(&scene.cloud, &camera, &drawn).map_err(failed)?;
        for _ in 0..repeats {
            let start = Instant::now();
            renderer.draw(&scene.cloud, &camera, &drawn).map_err(failed)?;
            times.push(start.elapsed().as_secs_f64() * 1e3);
        }
    }
    let frame_ms = times.into_iter().collect::<Sample>().median;
    let device_bytes = device_bytes(&scene, &settings)? as f64;
    Ok(PlanCost {
        open_secs,
        first_picture_secs,
        ready_secs,
        resident_bytes,
        peak_bytes,
        device_bytes,
        frame_ms,
        view_ms,
        loaded,
    })
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

struct AtOpening {
    navigator: Option<Navigator>,
    thumbnails: Option<crate::pipeline::semantics::thumbnails::Thumbnails>,
    _encoder: Option<Box<dyn models::Encoder>>,
}

fn at_opening(scene: &OpenScene, plan: &ScenePlan, settings: &RenderSettings) -> Result<AtOpening, StudyError> {
    let navigator = (plan.navigation == When::Always).then(|| {
        let navigator = Navigator::new(&scene.cloud, &scene.cameras, scene.up);
        // The connected parts are what the window asks for first.
        navigator.graph.parts(&navigator.occupancy);
        navigator
    });
    let map = scene.map.as_deref();
    let thumbnails = map.filter(|_| plan.thumbnails == When::Always).map(|map| {
        let from = scene.first.center;
        draw_thumbnails(&scene.cloud, map, settings, from, scene.up).map_err(failed)
    });
    let language = map.and_then(|m| m.language.as_ref()).filter(|_| plan.encoder == When::Always);
    let encoder = language.map(|language| {
        let mut encoder = models::encoder(&language.encoder).map_err(failed)?;
        encoder.text("object").map_err(failed)?;
        Ok::<_, StudyError>(encoder)
    });
    Ok(AtOpening { navigator, thumbnails: thumbnails.transpose()?, _encoder: encoder.transpose()? })
}

/// Bytes of the buffers that the GPU renderer allocates for the first view, on whatever adapter there is; 0
/// without any.
fn device_bytes(scene: &OpenScene, settings: &RenderSettings) -> Result<u64, StudyError> {
    let Ok(device) = Device::shared() else { return Ok(0) };
    let mut renderer = Renderer::on_gpu(&device).map_err(failed)?;
    renderer.draw(&scene.cloud, &scene.first, settings).map_err(failed)?;
    Ok(renderer.device_bytes())
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
    /// Bytes of its files by what they serve.
    disk: Vec<(&'static str, u64)>,
    plan: PlanCost,
    everything: PlanCost,
}

impl Saving {
    pub(crate) fn new(path: &Path, plan: PlanCost, everything: PlanCost) -> Self {
        Self { scene: super::bench::label(path), disk: disk(path), plan, everything }
    }

    /// Size of its files, in a line.
    pub(crate) fn on_disk(&self) -> String {
        let parts: Vec<String> = self.disk.iter().map(|(what, n)| format!("{} {what}", bytes(*n))).collect();
        format!("{} on disk: {}", self.scene, parts.join(", "))
    }
}

pub(crate) fn table(all: &[Saving]) -> Rows {
    let head =
        ["scene", "", "open s", "picture s", "ready s", "at rest", "peak", "GPU", "frame ms", "view ms", "loaded"];
    let both =
        |s: &Saving| [(s.scene.clone(), "plan", s.plan.clone()), (String::new(), "everything", s.everything.clone())];
    rows(
        &head,
        all.iter().flat_map(both).map(|(scene, variant, cost)| {
            let mut cells = vec![scene, variant.to_owned()];
            cells.extend([cost.open_secs, cost.first_picture_secs, cost.ready_secs].map(|s| format!("{s:.2}")));
            cells.extend([cost.resident_bytes, cost.peak_bytes, cost.device_bytes].map(|b| bytes(b as u64)));
            cells.extend([cost.frame_ms, cost.view_ms].map(|ms| format!("{ms:.1}")));
            cells.push(cost.loaded.len().to_string());
            cells
        }),
    )
}

/// Bytes of a scene's files by what they serve, largest first.
fn disk(scene: &Path) -> Vec<(&'static str, u64)> {
    let size = |path: &Path| std::fs::metadata(path).map_or(0, |m| m.len());
    if !scene.is_dir() {
        return vec![("Gaussians", size(scene))];
    }
    let serves = |name: &str| match name {
        "point_cloud.ply" => "Gaussians",
        "checkpoint.bin" => "going on with training",
        "semantic_map.safetensors" => "objects and parts",
        "scene.json" => "cameras and history",
        _ => "other",
    };
    let mut sums = std::collections::BTreeMap::new();
    for entry in std::fs::read_dir(scene).into_iter().flatten().flatten().filter(|e| e.path().is_file()) {
        *sums.entry(serves(&entry.file_name().to_string_lossy())).or_default() += size(&entry.path());
    }
    let mut list: Vec<(&str, u64)> = sums.into_iter().collect();
    list.sort_by_key(|(_, bytes)| std::cmp::Reverse(*bytes));
    list
}
