//! The photos of a scene without a thing, and a scene retrained on them.
//!
//! At the thing, a photo shows the scene's new content there, which is the same from all sides. At its shadow, it is
//! brightened as the scene was. Elsewhere it is unchanged.

use std::path::Path;

use glam::DVec3;
use serde_json::json;

use super::refined::at_refined_poses;
use super::{JobError, Scene, export, open, train};
use crate::io::transforms::opengl_pose;
use crate::io::{self, IoError, SceneFolder, atomic, files, points_ply, trained};
use crate::math::grid;
use crate::pipeline::observer::{Observer, Ticker};
use crate::pipeline::removal::{INVENTED, RemovalOptions, invented_flags, members};
use crate::pipeline::semantics::lifting::carry::{carry_by, nearest};
use crate::render::{Features, Renderer};
use crate::scene::{Camera, Dataset, ExtraProperty, GaussianCloud, PhotoPixels, SemanticMap, SparsePoint};

/// Folder of the photos in that of the scene, and the file that marks them as complete.
const PHOTOS: &str = "photos";
const TRANSFORMS: &str = "transforms.json";
/// File that names the removed thing, to resume.
const MARK: &str = "without.json";
/// Share of a pixel from which the thing covers it, and the replaced rim around that, px.
const TOUCHED: f32 = 0.02;
const RIM_PX: usize = 3;

/// Retrains the scene `from` on its photos without a thing, into `out`. A stopped run there is resumed. Returns `false`
/// if the observer stopped it.
pub(crate) fn retrain(
    from: &Scene,
    map: &SemanticMap,
    (options, name): (&RemovalOptions, &str),
    reduced: (&GaussianCloud, &SemanticMap),
    out: &Path,
    observer: &mut dyn Observer,
) -> Result<bool, JobError> {
    let photos = out.join(PHOTOS);
    if !photos.join(TRANSFORMS).is_file() {
        write(from, map, (options, name), reduced.0, &photos, observer)?;
    }
    let mut dataset = open::dataset(&photos)?;
    dataset.name = format!("{} without {name}", from.name);
    let done = train::run(&dataset, &from.config, [out.to_owned()], &train::IfChanged::Ask.into(), observer)?;
    if !done.is_finished() {
        return Ok(false);
    }
    let scene = trained::load(out)?;
    let mut cloud = scene.cloud;
    let places: Vec<DVec3> = (0..cloud.len()).map(|i| cloud.world_position(i)).collect();
    let near = nearest(reduced.0, &places);
    let (carried, _) = carry_by(reduced.1, &near);
    if let Some(flags) = invented_flags(reduced.0) {
        cloud.extras.retain(|e| e.name != INVENTED);
        let values = near.into_iter().map(|n| n.map_or(0.0, |i| flags[i])).collect();
        cloud.extras.push(ExtraProperty { name: INVENTED.into(), values });
    }
    SceneFolder::hold(out, "storing its objects")?.save(&scene.info, &cloud, Some(&carried))?;
    Ok(true)
}

/// Refuses a folder with anything but the results of [`retrain`] with the same request.
pub(crate) fn check(from: &Scene, without: (&RemovalOptions, &str), out: &Path) -> Result<(), JobError> {
    if is_begun(from, without, out) { Ok(()) } else { super::derived::check(out) }
}

/// Returns whether [`retrain`] has begun exactly this in a folder.
pub(crate) fn is_begun(from: &Scene, without: (&RemovalOptions, &str), out: &Path) -> bool {
    files::read_json::<serde_json::Value>(&out.join(PHOTOS).join(MARK)).is_ok_and(|m| m == mark(from, without))
}

/// Returns whether the photos in a folder were made without a thing.
pub(crate) fn is_without(photos: &Path) -> bool {
    photos.join(MARK).is_file()
}

fn mark(from: &Scene, (options, name): (&RemovalOptions, &str)) -> serde_json::Value {
    json!({ "version": 2, "scene": from.path, "state": from.state, "without": name, "options": options })
}

/// Writes the photos as their own data set, in the training size.
fn write(
    from: &Scene,
    map: &SemanticMap,
    (options, name): (&RemovalOptions, &str),
    reduced: &GaussianCloud,
    out: &Path,
    observer: &mut dyn Observer,
) -> Result<(), JobError> {
    let mut dataset = open::dataset(&from.photos(None)?)?.with_alpha(from.config.alpha).into_owned();
    if let Some(folder) = &from.folder {
        at_refined_poses(&mut dataset.photos, &trained::load_info(folder)?);
    }
    export::make_parent(&out.join("images").join("0"))?;
    let json = |file: &str, value: &serde_json::Value| {
        atomic::write(&out.join(file), |w| serde_json::to_writer_pretty(w, value).map_err(Into::into))
    };
    json(MARK, &mark(from, (options, name)))?;
    let thing = members(map, &options.ids);
    let share: Vec<f32> = thing.iter().map(|is| f32::from(u8::from(*is))).collect();
    let (_, held) = dataset.split(from.config.holdout_every);
    let (mut frames, mut test) = (Vec::new(), Vec::new());
    let mut ticker = Ticker::new("Photos without it", dataset.photos.len());
    let mut renderer = Renderer::new();
    for (k, photo) in dataset.photos.iter().enumerate() {
        ticker.tick(k, observer)?;
        let pixels = io::photo::load(photo, from.config.max_side_px)?;
        let camera = photo.camera.resized(pixels.width_px, pixels.height_px);
        let features = Features { channels: 1, values: &share };
        let was = renderer.render(&from.cloud, features, &camera, &from.settings)?;
        let is = renderer.render(reduced, Features::NONE, &camera, &from.settings)?;
        let covered = was.features[0].iter().map(|s| *s >= TOUCHED).collect();
        let covered = grid::grown(pixels.width_px as usize, covered, RIM_PX);
        let rgb: Vec<[u8; 3]> = (0..pixels.len())
            .map(|i| {
                let change = |c: usize| f32::from(pixels.rgb[i][c]) / 255.0 + is.color[c][i] - was.color[c][i];
                let new = |c: usize| if covered[i] { is.color[c][i] } else { change(c) };
                [0, 1, 2].map(|c| (new(c).clamp(0.0, 1.0) * 255.0 + 0.5) as u8)
            })
            .collect();
        let stem = Path::new(&photo.name).file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        let file = format!("images/{k:04}_{stem}.png");
        store(&out.join(&file), PhotoPixels { rgb, ..pixels })?;
        if held.contains(&k) {
            test.push(file.clone());
        }
        frames.push(frame(&camera, &file));
    }
    points_ply::write(&out.join("points3D.ply"), &points(&dataset, from, &thing, reduced))?;
    let about = json!({
        "camera_model": "PINHOLE", "ply_file_path": "points3D.ply", "test_filenames": test, "frames": frames,
        "fmlgs": { "background": dataset.background, "metres_per_unit": dataset.meters_per_unit },
    });
    // Last: with it, the photos are complete.
    Ok(json(TRANSFORMS, &about)?)
}

fn frame(camera: &Camera, file: &str) -> serde_json::Value {
    json!({
        "file_path": file, "w": camera.width_px, "h": camera.height_px, "fl_x": camera.focal_px.x, "fl_y": camera.focal_px.y,
        "cx": camera.principal_px.x, "cy": camera.principal_px.y, "transform_matrix": opengl_pose(camera),
    })
}

/// Writes a photo; pixels that do not count are transparent.
fn store(path: &Path, pixels: PhotoPixels) -> Result<(), IoError> {
    let Some(coverage) = &pixels.coverage else { return export::picture(path, &pixels) };
    let samples: Vec<u8> = pixels.rgb.iter().zip(coverage).flat_map(|(c, a)| [c[0], c[1], c[2], *a]).collect();
    export::png(path, &samples, [pixels.width_px, pixels.height_px], image::ColorType::Rgba8)
}

/// Returns the sparse points without the thing's, and the invented Gaussians.
fn points(dataset: &Dataset, from: &Scene, thing: &[bool], cloud: &GaussianCloud) -> Vec<SparsePoint> {
    let places: Vec<DVec3> = dataset.points.iter().map(|p| p.position).collect();
    let near = nearest(&from.cloud, &places);
    let stays = dataset.points.iter().zip(near).filter(|(_, n)| n.is_none_or(|i| !thing[i]));
    let flags = invented_flags(cloud).unwrap_or_default();
    let invented = (0..flags.len()).filter(|i| flags[*i] > 0.0).map(|i| SparsePoint {
        position: cloud.world_position(i),
        rgb: cloud.mean_color(i).map(|v| (v * 255.0) as u8),
    });
    stays.map(|(p, _)| *p).chain(invented).collect()
}
