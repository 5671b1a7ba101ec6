//! The parsers that are fuzzed, each as a function of bytes.

use std::fs;
use std::path::Path;

use fmlgs::io::{self, IoError};
use fmlgs::scene::{Camera, GaussianCloud, Photo};
use glam::{DMat3, DVec2, DVec3};
use image::{GrayImage, RgbImage};

/// Feeds bytes to a parser.
type Parse = Box<dyn Fn(&[u8])>;
/// Asks a parser whether it accepts bytes.
type Accepts = Box<dyn Fn(&[u8]) -> bool>;

/// A parser.
pub struct Target {
    /// Its folder in `tests/corpus`.
    pub name: &'static str,
    /// Parses; what it returns does not matter.
    pub parse: Parse,
    /// Whether it accepts an input.
    pub accepts: Accepts,
}

fn target<T>(name: &'static str, parse: impl Fn(&[u8]) -> Result<T, IoError> + Clone + 'static) -> Target {
    let accepts = parse.clone();
    Target { name, parse: Box::new(move |b| drop(parse(b))), accepts: Box::new(move |b| accepts(b).is_ok()) }
}

/// What is read must keep its own invariants.
fn valid(cloud: Result<GaussianCloud, IoError>) -> Result<GaussianCloud, IoError> {
    cloud.inspect(|c| c.validate().expect("an accepted cloud is valid"))
}

/// A parser that reads `file` in a folder of its own, which `prepare` fills.
fn in_folder<T>(
    name: &'static str,
    file: &'static str,
    prepare: impl Fn(&Path),
    read: impl Fn(&Path) -> Result<T, IoError> + Clone + 'static,
) -> Target {
    let folder = std::sync::Arc::new(tempfile::tempdir().expect("folder"));
    prepare(folder.path());
    target(name, move |bytes| {
        fs::write(folder.path().join(file), bytes).expect("write");
        read(folder.path())
    })
}

fn picture(folder: &Path) {
    RgbImage::new(16, 12).save(folder.join("a.png")).expect("save");
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Every parser of the program.
pub fn all() -> Vec<Target> {
    const P: &str = "fuzz";
    vec![
        target("splat_ply", |b| valid(io::splat_ply::parse(b, Path::new(P)))),
        target("compressed_ply", |b| valid(io::splat_ply::parse(b, Path::new(P)))),
        target("points_ply", |b| io::points_ply::parse(b, Path::new(P))),
        target("sog", |b| valid(io::sog::parse_archive(b, Path::new(P)))),
        in_folder(
            "sog_meta",
            "meta.json",
            |folder| {
                for (name, bytes) in super::seeds::sog_pictures() {
                    fs::write(folder.join(name), bytes).expect("write");
                }
            },
            |folder| valid(io::sog::read_folder(&folder.join("meta.json"))),
        ),
        target("khr_gltf", |b| valid(io::khr_gltf::parse(b, Path::new(P)))),
        target("colmap_cameras", |b| io::colmap::check_cameras(b, Path::new(P))),
        target("colmap_images", |b| io::colmap::check_images(b, Path::new(P))),
        target("colmap_points", |b| io::colmap::check_points(b, Path::new(P))),
        target("colmap_cameras_text", |b| io::colmap::check_text_cameras(&text(b), Path::new(P))),
        target("colmap_images_text", |b| io::colmap::check_text_images(&text(b), Path::new(P))),
        target("colmap_points_text", |b| io::colmap::check_text_points(&text(b), Path::new(P))),
        target("llff", |b| io::llff::poses(b, Path::new(P))),
        target("depth_map", |b| io::npy::map(b, Path::new(P))),
        in_folder("transforms", "transforms.json", picture, |f| io::transforms::read(&f.join("transforms.json"))),
        target("camera_path", |b| {
            io::camera_path::parse(b, Path::new(P)).inspect(|p| p.validate().expect("an accepted path is valid"))
        }),
        in_folder("blender", "transforms_train.json", picture, io::transforms::read_blender),
        in_folder("scene", "scene.json", |_| {}, io::trained::load_info),
        in_folder(
            "photo",
            "photo",
            |_| {},
            |folder| {
                let _ = io::photo::size(&folder.join("photo"));
                io::photo::load(&photo(folder), 10)
            },
        ),
        in_folder("label_polygons", "a.json", |_| {}, labels),
        in_folder("label_masklets", "a.json", |_| {}, labels),
        in_folder("label_ids", "identities.json", id_maps, labels),
        in_folder("label_id_map", "object_ids/photo.png", id_maps, labels),
        in_folder("label_classes", "segmentations/classes.txt", classes, labels),
        in_folder("label_picture", "test_mask/photo/a.png", |f| grey(f, "test_mask/photo"), labels),
    ]
}

/// Masks of the photo, in whatever layout the folder has.
fn labels(folder: &Path) -> Result<Vec<io::labels::Region>, IoError> {
    let mut photo = photo(folder);
    photo.name = "photo.png".into();
    let found = io::labels::Labels::open(folder)?;
    let regions = found.of(&photo, 16)?;
    // The frame of a video.
    photo.name = "0".into();
    Ok([regions, found.of(&photo, 16)?].concat())
}

fn grey(folder: &Path, inner: &str) {
    fs::create_dir_all(folder.join(inner)).expect("create");
    let at = |x, _| image::Luma([if x < 8 { 255 } else { 1 }]);
    GrayImage::from_fn(16, 12, at).save(folder.join(inner).join("photo.png")).expect("save");
}

fn id_maps(folder: &Path) {
    grey(folder, "object_ids");
    grey(folder, "part_ids");
    fs::write(folder.join("identities.json"), super::seeds::identities().to_string()).expect("write");
}

fn classes(folder: &Path) {
    grey(folder, "images");
    grey(folder, "segmentations/00");
}

fn photo(folder: &Path) -> Photo {
    Photo {
        name: "photo".into(),
        path: folder.join("photo"),
        camera: Camera {
            width_px: 16,
            height_px: 12,
            focal_px: DVec2::splat(15.0),
            principal_px: DVec2::new(8.0, 6.0),
            world_from_camera: DMat3::IDENTITY,
            center: DVec3::ZERO,
        },
        distortion: None,
        test_split: false,
        background: None,
    }
}
