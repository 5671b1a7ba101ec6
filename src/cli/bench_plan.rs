//! `fmlgs bench --plan`: what a scene's plan saves, held against everything on.
//!
//! Each variant runs in a process of its own, so that its memory is its own.

use std::path::{Path, PathBuf};
use std::process::Command as Process;
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use serde_json::json;

use super::{CliError, output, process};
use crate::math::stats::median;
use crate::models;
use crate::pipeline::bench;
use crate::pipeline::observer::Silent;
use crate::render::{BackendChoice, Device, RenderSettings, Renderer};
use crate::scene::plan::{Overrides, ScenePlan, When, bytes};
use crate::scene::{Camera, trace};
use crate::worker::jobs::PipelineJobs;
use crate::worker::places::Places;
use crate::worker::view::{Effort, Leave, ViewLane, ViewRequest};
use crate::worker::{Command, Jobs, OpenedScene, Outcome, Stop, ViewMode};

/// Size of the pictures, px.
const SIZE: [u32; 2] = [1_008, 567];
/// How long the eye rests before memory is looked at: longer than the drawing lane waits.
const REST: Duration = Duration::from_millis(2_600);
/// Only a process that hangs takes this long to draw a picture.
const LONG: Duration = Duration::from_secs(600);

/// Which plan a process follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Variant {
    /// The scene's own.
    Plan,
    /// Everything on.
    Everything,
}

/// What one process has measured; medians where several have.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Cost {
    /// Reading, until the scene can be drawn.
    open_secs: f64,
    /// From the start of reading until the first full picture is there.
    first_picture_secs: f64,
    /// From the start of reading until all is there that this plan wants at opening.
    ready_secs: f64,
    /// Memory at rest beyond that of the process before it read anything.
    resident_bytes: f64,
    /// The most that it was before, likewise; 0 where the system does not say.
    peak_bytes: f64,
    /// Buffers on the device for one picture; 0 without any adapter.
    device_bytes: f64,
    /// Drawing a picture while the eye moves.
    frame_ms: f64,
    /// Drawing all that belongs to a view at rest.
    view_ms: f64,
    /// What was loaded and built.
    loaded: Vec<String>,
}

/// A scene with both of its plans.
#[derive(Debug, Serialize)]
struct Row {
    scene: String,
    /// Bytes of its files by what they serve.
    disk: Vec<(String, u64)>,
    plan: Cost,
    everything: Cost,
}

/// Measures `scenes` with `runs` processes each way, each of which draws every view `repeats` times,
/// and prints a table or JSON.
pub fn run(scenes: &[PathBuf], runs: u32, repeats: u32, as_json: bool) -> Result<(), CliError> {
    let mut rows = Vec::new();
    for scene in scenes {
        // In turns, so that what else the machine does meets both alike.
        let (mut plan, mut everything) = (Vec::new(), Vec::new());
        for _ in 0..runs {
            plan.push(child(scene, Variant::Plan, repeats)?);
            everything.push(child(scene, Variant::Everything, repeats)?);
        }
        let (plan, everything) = (middle(plan)?, middle(everything)?);
        rows.push(Row { scene: bench::label(scene), disk: disk(scene), plan, everything });
    }
    let adapter = Device::shared().ok().map(|d| d.describe());
    if as_json {
        return output::print_json(&json!({ "size_px": SIZE, "runs": runs, "adapter": adapter, "scenes": rows }));
    }
    output::print(&text(&rows, adapter.as_deref()))
}

/// Measures one variant in this process and prints it as JSON.
pub fn run_child(scene: &Path, variant: Variant, repeats: usize) -> Result<(), CliError> {
    // As the window has it.
    process::settle();
    output::print_json(&measure(scene, variant, repeats)?)
}

fn child(scene: &Path, variant: Variant, repeats: u32) -> Result<Cost, CliError> {
    let name = if variant == Variant::Plan { "plan" } else { "everything" };
    let program = std::env::current_exe().map_err(|e| CliError::failed(format!("the program's own path: {e}")))?;
    let mut process = Process::new(program);
    process.args(["bench", "--variant", name, "--repeats", &repeats.to_string()]).arg(scene);
    let made = process.output();
    let made = made.map_err(|e| CliError::failed(format!("a process for {}: {e}", scene.display())))?;
    if !made.status.success() {
        let why = String::from_utf8_lossy(&made.stderr);
        return Err(CliError::failed(format!("{}: {}", scene.display(), why.trim())));
    }
    Ok(serde_json::from_slice(&made.stdout)?)
}

/// The medians of several processes.
fn middle(costs: Vec<Cost>) -> Result<Cost, CliError> {
    let of = |f: fn(&Cost) -> f64| median(&costs.iter().map(f).collect::<Vec<_>>());
    let last = costs.last().ok_or_else(|| CliError::failed("nothing was measured"))?;
    Ok(Cost {
        open_secs: of(|c| c.open_secs),
        first_picture_secs: of(|c| c.first_picture_secs),
        ready_secs: of(|c| c.ready_secs),
        resident_bytes: of(|c| c.resident_bytes),
        peak_bytes: of(|c| c.peak_bytes),
        device_bytes: of(|c| c.device_bytes),
        frame_ms: of(|c| c.frame_ms),
        view_ms: of(|c| c.view_ms),
        loaded: last.loaded.clone(),
    })
}

fn measure(path: &Path, variant: Variant, repeats: usize) -> Result<Cost, CliError> {
    let overrides = if variant == Variant::Plan { Overrides::default() } else { Overrides::everything() };
    let jobs = PipelineJobs::new(Places::of_user());
    // The window has looked for a GPU before it opens anything, and keeps the driver that it found.
    let _ = crate::render::real_gpu();
    let before = resident();
    let start = Instant::now();
    let Outcome::Opened(scene) = job(&jobs, Command::Open { path: path.to_path_buf() })? else {
        return Err(CliError::failed("opening brought no scene"));
    };
    let open_secs = start.elapsed().as_secs_f64();
    let plan = ScenePlan::new(scene.facts.clone(), &overrides);
    let lane = ViewLane::start(Arc::new(|| {})).map_err(|e| CliError::failed(format!("a thread for drawing: {e}")))?;
    let camera = home(&scene);
    let request =
        view_request(&scene, &plan, camera.clone()).ok_or_else(|| CliError::failed("there is nothing to draw"))?;
    let wants_maps = request.semantics.is_some();
    lane.request(request);
    wait(|| lane.pictures().newer_than(0).is_some())?;
    let first_picture_secs = start.elapsed().as_secs_f64();
    if wants_maps {
        wait(|| lane.maps().newer_than(0).is_some())?;
    }
    let view_ms = (start.elapsed().as_secs_f64() - open_secs) * 1e3;
    let kept = at_opening(&jobs, &scene, &plan)?;
    let ready_secs = start.elapsed().as_secs_f64();
    std::thread::sleep(REST);
    let resident_bytes = resident().saturating_sub(before) as f64;
    let peak_bytes = peak().saturating_sub(before) as f64;
    drop((lane, kept));
    let loaded = trace::since(0).iter().map(|l| l.what.clone()).collect();
    let (frame_ms, device_bytes) = (frame(&scene, &plan, repeats)?, device_bytes(&scene, &plan, &camera)? as f64);
    Ok(Cost {
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

fn job(jobs: &PipelineJobs, command: Command) -> Result<Outcome, CliError> {
    jobs.run(command, &mut Silent).map_err(|stop| match stop {
        Stop::Cancelled => CliError::Cancelled("nothing was printed".into()),
        Stop::Failed(failure) => CliError::failed(format!("{} {}", failure.message, failure.remedy)),
    })
}

fn wait(done: impl Fn() -> bool) -> Result<(), CliError> {
    let start = Instant::now();
    while !done() {
        if start.elapsed() > LONG {
            return Err(CliError::failed("drawing takes too long"));
        }
        std::thread::sleep(Duration::from_micros(500));
    }
    Ok(())
}

/// The first view, as the window has it.
fn home(scene: &OpenedScene) -> Camera {
    let [width, height] = SIZE;
    match &scene.home.camera {
        Some(camera) => super::view::with_size(camera, width, height),
        None => {
            let (center, radius) = (scene.home.bounds.center(), scene.home.bounds.radius().max(1e-6));
            let eye = center + glam::DVec3::new(1.0, 0.0, -2.0) * radius + scene.home.up * (0.5 * radius);
            let seen = Camera::look_at(eye, center, scene.home.up, 0.8, width, height);
            seen.unwrap_or_else(|| Camera::of_pose(eye, glam::DMat3::IDENTITY, 0.8, width, height))
        }
    }
}

fn settings(scene: &OpenedScene, plan: &ScenePlan) -> RenderSettings {
    RenderSettings { sh_degree: plan.sh_degree, ..scene.render.clone() }
}

fn view_request(scene: &OpenedScene, plan: &ScenePlan, camera: Camera) -> Option<ViewRequest> {
    let semantics = scene.semantics.clone().filter(|_| plan.maps.now(false));
    Some(ViewRequest {
        cloud: scene.cloud.clone()?,
        camera,
        mode: ViewMode::Picture,
        settings: settings(scene, plan),
        effort: Effort::Full,
        photo: None,
        codes: semantics.is_some(),
        semantics,
        leave: Leave::of(plan),
        timed: false,
        ticket: 1,
    })
}

/// What the plan wants at opening, to be kept as the window keeps it.
fn at_opening(jobs: &PipelineJobs, scene: &OpenedScene, plan: &ScenePlan) -> Result<impl Sized, CliError> {
    let (mut outcomes, mut encoder) = (Vec::new(), None);
    let (Some(cloud), map) = (scene.cloud.clone(), scene.semantics.clone()) else { return Ok((outcomes, encoder)) };
    let cameras = scene.dataset.as_ref().map(|d| d.cameras()).unwrap_or_default();
    if plan.navigation == When::Always {
        let command = Command::Explore { cloud: Arc::clone(&cloud), cameras, up: scene.home.up };
        outcomes.push(job(jobs, command)?);
    }
    if let (Some(map), When::Always) = (&map, plan.portraits) {
        let (settings, home) = (settings(scene, plan), scene.home.clone());
        outcomes.push(job(jobs, Command::Portraits { cloud, map: Arc::clone(map), settings, home })?);
    }
    if let (Some(language), When::Always) = (map.as_ref().and_then(|m| m.language.as_ref()), plan.encoder) {
        let mut loaded = models::encoder(&language.encoder)?;
        loaded.text("object")?;
        encoder = Some(loaded);
    }
    Ok((outcomes, encoder))
}

/// Milliseconds of a picture while the eye moves.
fn frame(scene: &OpenedScene, plan: &ScenePlan, repeats: usize) -> Result<f64, CliError> {
    let Some(cloud) = scene.cloud.clone() else { return Ok(0.0) };
    let choice = if plan.on_cpu { BackendChoice::Cpu } else { BackendChoice::Auto };
    let mut renderer = Renderer::choose(choice, output::warn)?;
    let settings = RenderSettings { depth: plan.depth == When::Always, ..settings(scene, plan) };
    let mut times = Vec::new();
    for camera in bench::views_of(&cloud, SIZE[0], SIZE[1]) {
        renderer.draw(&cloud, &camera, &settings)?;
        for _ in 0..repeats {
            let start = Instant::now();
            renderer.draw(&cloud, &camera, &settings)?;
            times.push(start.elapsed().as_secs_f64() * 1e3);
        }
    }
    Ok(median(&times))
}

/// Bytes of the buffers that the GPU renderer allocates for the first view, on whatever adapter
/// there is; 0 without any.
fn device_bytes(scene: &OpenedScene, plan: &ScenePlan, camera: &Camera) -> Result<u64, CliError> {
    let (Some(cloud), Ok(device)) = (&scene.cloud, Device::shared()) else { return Ok(0) };
    let mut renderer = Renderer::on_gpu(&device)?;
    renderer.draw(cloud, camera, &settings(scene, plan))?;
    Ok(renderer.device_bytes())
}

/// Memory of this process now, bytes; 0 where the system does not say.
fn resident() -> u64 {
    let Ok(pid) = sysinfo::get_current_pid() else { return 0 };
    let Ok(mut system) = sysinfo::System::new() else { return 0 };
    system.refresh_processes(sysinfo::ProcessesToUpdate::Some(&[pid]), false);
    system.process(pid).map_or(0, sysinfo::Process::memory)
}

/// The most memory that this process has had, bytes; 0 where the system does not say.
fn peak() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    line.and_then(|l| l.split_whitespace().next()?.parse::<u64>().ok()).map_or(0, |kb| kb * 1024)
}

/// Bytes of a scene's files by what they serve, largest first.
fn disk(scene: &Path) -> Vec<(String, u64)> {
    let size = |path: &Path| std::fs::metadata(path).map_or(0, |m| m.len());
    if !scene.is_dir() {
        return vec![("Gaussians".into(), size(scene))];
    }
    let serves = |name: &str| match name {
        "point_cloud.ply" => "Gaussians",
        "checkpoint.bin" => "going on with training",
        "semantic_map.safetensors" => "objects and parts",
        "scene.json" => "cameras and history",
        _ => "other",
    };
    let mut list: Vec<(String, u64)> = Vec::new();
    for entry in std::fs::read_dir(scene).into_iter().flatten().flatten().filter(|e| e.path().is_file()) {
        let role = serves(&entry.file_name().to_string_lossy());
        match list.iter_mut().find(|(known, _)| known == role) {
            Some((_, bytes)) => *bytes += size(&entry.path()),
            None => list.push((role.into(), size(&entry.path()))),
        }
    }
    list.sort_by_key(|(_, bytes)| std::cmp::Reverse(*bytes));
    list
}

fn text(rows: &[Row], adapter: Option<&str>) -> String {
    let head =
        ["scene", "", "open s", "picture s", "ready s", "at rest", "peak", "GPU", "frame ms", "view ms", "loaded"];
    let mut table = vec![head.map(str::to_owned).to_vec()];
    let mut disks = Vec::new();
    for row in rows {
        for (name, variant, cost) in [(row.scene.as_str(), "plan", &row.plan), ("", "everything", &row.everything)] {
            let mut cells = vec![name.to_owned(), variant.to_owned()];
            cells.extend([cost.open_secs, cost.first_picture_secs, cost.ready_secs].map(|s| format!("{s:.2}")));
            cells.extend([cost.resident_bytes, cost.peak_bytes, cost.device_bytes].map(|b| bytes(b as u64)));
            cells.extend([cost.frame_ms, cost.view_ms].map(|ms| format!("{ms:.1}")));
            cells.push(cost.loaded.len().to_string());
            table.push(cells);
        }
        let parts: Vec<String> = row.disk.iter().map(|(what, n)| format!("{} {what}", bytes(*n))).collect();
        disks.push(format!("{} on disk: {}", row.scene, parts.join(", ")));
    }
    let adapter = adapter.unwrap_or("none, so no GPU memory is given");
    let pixels = format!("{} x {} px", SIZE[0], SIZE[1]);
    format!(
        "{}\n\n{}\n\nPictures of {pixels}; memory beyond the process before it read anything; buffers counted on: {adapter}",
        output::table(&table),
        disks.join("\n")
    )
}
