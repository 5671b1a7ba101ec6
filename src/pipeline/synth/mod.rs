//! Posed photos of any glTF scene, with ground truth.
//!
//! A scene of triangles is rendered by ray casting, which shares nothing with the splat renderer, so that the results
//! of training can be compared with the ground truth. [`run`] writes a folder that opens as a data set:
//!
//! | file | content |
//! |---|---|
//! | `transforms.json` | nerfstudio layout, OpenGL camera axes, world axes of the glTF (y up); `train_filenames` and `test_filenames` list the split |
//! | `images/NNNN.png` | photos, sRGB |
//! | `object_ids/NNNN.png`, `part_ids/NNNN.png` | 16-bit ids at the pixels' centers, 0 = background (or, for parts, none) |
//! | `identities.json` | the identities by id: name, level, parent, path in the node tree, color, pixels, views |
//! | `depth/NNNN.npy` | f32 depth along the camera's axis at the pixels' centers, scene units, 0 = background |
//! | `points3D.ply` | sparse points on surfaces that training photos see, with a reconstruction's noise |
//! | `synth.json` | the settings, and a fingerprint of the scene |
//!
//! Modules: [`levels`] finds objects and parts, `surface` flattens the node tree, `trace` casts rays,
//! `material` and `texture` color them, `light` lights them, `rig` places cameras, `view` renders
//! one photo, `points` and `write` put it all on disk, [`demo`] is the scene that ships with the
//! program.

pub(crate) mod demo;
pub(crate) mod levels;
mod light;
mod material;
pub(crate) mod options;
mod points;
mod rig;
mod surface;
#[cfg(test)]
mod tests;
pub(crate) mod texture;
mod trace;
mod view;
mod write;

use std::path::{Path, PathBuf};
use std::time::Instant;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;
use rayon::prelude::*;

pub use demo::demo_glb;
pub(crate) use levels::TrueIdentity;
pub use options::{Levels, Rig, SynthOptions};
pub(crate) use write::SETTINGS;

use crate::io::IoError;
use crate::io::gltf_mesh::{self, MeshScene};
use crate::io::memory;
use crate::pipeline::observer::{self, Interrupted, Observer, Ticker};

/// Bytes per pixel of a photo during rendering and writing: color, depth and ids, and their copies in file formats.
const BYTES_PER_PX: u64 = 48;

/// Reasons for which no data set was made.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum SynthError {
    #[error("{0}")]
    Options(String),
    #[error("the scene has no triangles with any area; a scene of meshes is needed")]
    Empty,
    #[error("node {node} of the scene lies at a position that is not finite; check its transforms")]
    NotFinite { node: usize },
    #[error("the scene has {count} triangles; at most {limit} are drawn. Simplify it first")]
    TooManyTriangles { count: usize, limit: usize },
    #[error(transparent)]
    NoRoom(#[from] memory::NoRoom),
    #[error("nothing in the scene is called '{name}'; it has {known}")]
    Unknown { name: String, known: String },
    #[error("the scene has more than 65535 objects and parts; name fewer nodes")]
    TooManyIdentities,
    #[error("{path}: {source}; is there space, and may the folder be written to?", path = path.display())]
    Write { path: PathBuf, source: std::io::Error },
    #[error(transparent)]
    Folder(#[from] IoError),
    #[error("canceled")]
    Interrupted(#[from] Interrupted),
}

/// Report of a written data set.
#[derive(Clone, Debug)]
pub struct SynthReport {
    pub(crate) out: PathBuf,
    pub(crate) train_views: usize,
    pub(crate) held_out_views: usize,
    /// Objects and parts, pixels counted.
    pub(crate) identities: Vec<TrueIdentity>,
    pub(crate) points: usize,
    /// Triangles of the scene after splitting for light.
    pub(crate) triangles: usize,
    pub(crate) secs: f64,
    /// Warnings about omitted content of the scene.
    pub(crate) warnings: Vec<String>,
}

impl SynthReport {
    /// Summary in one line.
    pub(crate) fn summary(&self) -> String {
        format!(
            "{}: {} photos to train on, {} held out, {} objects and parts, {} sparse points, in {:.1} s",
            self.out.display(),
            self.train_views,
            self.held_out_views,
            self.identities.len(),
            self.points,
            self.secs
        )
    }
}

/// Renders the scene in `glb` (any glTF file) into a data set in the folder `out`, which is made.
/// Files of an earlier run are overwritten, others left alone.
pub fn run(
    glb: &Path,
    options: &SynthOptions,
    out: &Path,
    observer: &mut dyn Observer,
) -> Result<SynthReport, SynthError> {
    options.validate()?;
    let scene = gltf_mesh::read(glb)?;
    let name = glb.file_stem().map_or_else(|| "scene".into(), |s| s.to_string_lossy().into_owned());
    render_scene(&scene, &name, None, options, out, observer)
}

/// Renders a scene in memory; `fingerprint` goes into `synth.json`.
fn render_scene(
    scene: &MeshScene,
    name: &str,
    fingerprint: Option<u64>,
    options: &SynthOptions,
    out: &Path,
    observer: &mut dyn Observer,
) -> Result<SynthReport, SynthError> {
    let start = Instant::now();
    for warning in &scene.warnings {
        observer.note(observer::Severity::Warning, warning.clone());
    }
    Ticker::new("Building the scene", options.views).report(0, observer);
    let mut identities = levels::identities(scene, options.levels, name)?;
    let mut stage = stage(scene, &identities)?;
    let cameras = rig::cameras(&stage.surface, &stage.tracer, options);
    let test = held_out(options);
    if let Some(name) = &options.without {
        stage.take_away(called(&identities.list, name)?, options.keep_shadows);
    }
    let views: Vec<usize> = (0..cameras.len()).filter(|&i| options.without.is_none() || test[i]).collect();
    let writer = write::Writer::new(out, cameras.len())?;
    let per_view = options.points.div_ceil((options.views - options.held_out).max(1));
    let mut cloud = Vec::new();
    // A few photos at once, so that encoding one overlaps with tracing the next; fewer of them where
    // memory is short.
    let photo_bytes = u64::from(options.width_px) * u64::from(options.height_px) * BYTES_PER_PX;
    let what = format!("a photo of {} x {} px", options.width_px, options.height_px);
    memory::room(what, photo_bytes, "make photos smaller with --size")?;
    let batch = (2 * rayon::current_num_threads()).min((memory::free() / photo_bytes) as usize).max(1);
    let mut ticker = Ticker::new("Rendering photos", views.len());
    observer.proceed()?;
    for first in (0..views.len()).step_by(batch) {
        let last = (first + batch).min(views.len());
        let results: Vec<_> = views[first..last]
            .par_iter()
            .map(|&i| {
                let camera = &cameras[i];
                let view = stage.render(camera, i, options);
                let points = if test[i] { Vec::new() } else { points::sample(&view, camera, i, per_view, options) };
                writer.photo(i, camera, &view).map(|()| (levels::counts(&view.object, &view.part), points))
            })
            .collect::<Result<_, SynthError>>()?;
        for (counts, points) in results {
            cloud.extend(points);
            for (id, pixels) in counts {
                if let Some(identity) = identities.list.get_mut(usize::from(id) - 1) {
                    identity.pixels += pixels;
                    identity.views += 1;
                }
            }
        }
        ticker.tick(last, observer)?;
    }
    cloud.truncate(options.points);
    let points = cloud.len();
    writer.finish(name, fingerprint, options, (&cameras, &views, &test), &identities.list, &cloud)?;
    let held = views.iter().filter(|&&i| test[i]).count();
    Ok(SynthReport {
        out: out.to_owned(),
        train_views: views.len() - held,
        held_out_views: held,
        identities: identities.list,
        points,
        triangles: stage.surface.triangles.len(),
        secs: start.elapsed().as_secs_f64(),
        warnings: scene.warnings.clone(),
    })
}

/// Makes a scene ready for rendering.
fn stage(scene: &MeshScene, identities: &levels::TrueIdentities) -> Result<view::SynthScene, SynthError> {
    let surface = surface::Surface::of(scene, identities)?;
    let tracer = trace::Tracer::new(&surface);
    let materials = material::Materials::of(scene);
    let light = light::Light::new(&surface, &materials);
    Ok(view::SynthScene { surface, tracer, seen: None, materials, light })
}

/// Finds the id of an identity by its name or path.
fn called(all: &[TrueIdentity], name: &str) -> Result<u16, SynthError> {
    let found = all.iter().find(|i| i.path == name).or_else(|| all.iter().find(|i| i.name == name));
    found.map(|i| i.id).ok_or_else(|| {
        let known: Vec<_> = all.iter().map(|i| format!("'{}'", i.name)).collect();
        SynthError::Unknown { name: name.into(), known: known.join(", ") }
    })
}

/// Selects the held-out photos: one at random from each of as many equal stretches of the list.
fn held_out(options: &SynthOptions) -> Vec<bool> {
    let mut rng = Pcg32::seed_from_u64(options.seed ^ 0x7e57);
    let (views, held) = (options.views, options.held_out);
    let mut test = vec![false; views];
    for k in 0..held {
        let (from, to) = (k * views / held, (k + 1) * views / held);
        test[rng.random_range(from..to)] = true;
    }
    test
}
