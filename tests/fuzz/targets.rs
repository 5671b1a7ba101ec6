//! The readers that are fuzzed, each as a function of bytes: data sets, splats, pictures, labels.

use std::fmt::Display;
use std::fs;
use std::io::Write;
use std::path::Path;

use fmlgs::io::{self, IoError};
use fmlgs::scene::{Camera, Dataset, GaussianCloud, Photo};
use glam::{DMat3, DVec2, DVec3};
use image::{GrayImage, RgbImage};

/// Outcome of a reader for an input: nothing, or the reason of a refusal.
pub type Outcome = Result<(), String>;

/// Reads bytes.
pub type Read = Box<dyn Fn(&[u8]) -> Outcome>;

/// Condition that an input must meet for a reader to look any further.
#[derive(Clone, Copy)]
pub enum Door {
    /// Anything.
    Any,
    /// JSON.
    Json,
    /// A picture by its first bytes.
    Picture,
    /// These first bytes.
    Starts(&'static [u8]),
    /// These first bytes, or JSON.
    StartsOrJson(&'static [u8]),
    /// TOML.
    Toml,
}

impl Door {
    /// Returns whether a reader looks any further.
    pub fn lets_in(self, input: &[u8]) -> bool {
        let json = || serde_json::from_slice::<serde::de::IgnoredAny>(input).is_ok();
        match self {
            Self::Any => true,
            Self::Json => json(),
            Self::Picture => image::guess_format(input).is_ok(),
            Self::Starts(magic) => input.starts_with(magic),
            Self::StartsOrJson(magic) => input.starts_with(magic) || json(),
            Self::Toml => std::str::from_utf8(input).is_ok_and(|t| toml::from_str::<toml::Table>(t).is_ok()),
        }
    }
}

/// A reader.
pub struct Target {
    /// Its name.
    pub name: &'static str,
    /// Condition that it checks first.
    pub door: Door,
    /// Its folders in `tests/corpus`.
    pub corpora: Vec<&'static str>,
    /// Run time as a multiple of a quick reader's: it gets so many times fewer inputs.
    pub cost: u64,
    /// Reads bytes.
    pub read: Read,
}

impl Target {
    pub fn new<T, E: Display>(name: &'static str, door: Door, read: impl Fn(&[u8]) -> Result<T, E> + 'static) -> Self {
        let read = move |bytes: &[u8]| read(bytes).map(drop).map_err(|e| e.to_string());
        Self { name, door, corpora: vec![name], cost: 1, read: Box::new(read) }
    }

    /// A reader that reads `file` in a folder of its own, which `prepare` fills.
    pub fn in_folder<T, E: Display>(
        name: &'static str,
        door: Door,
        file: &'static str,
        prepare: impl Fn(&Path),
        read: impl Fn(&Path) -> Result<T, E> + 'static,
    ) -> Self {
        let folder = folder();
        if let Some(parent) = folder.path().join(file).parent() {
            fs::create_dir_all(parent).expect("create");
        }
        prepare(folder.path());
        Self::new(name, door, move |bytes| {
            fs::write(folder.path().join(file), bytes).expect("write");
            read(folder.path())
        })
    }

    /// The same with other folders of seeds.
    pub fn fed(self, corpora: &[&'static str]) -> Self {
        Self { corpora: corpora.to_vec(), ..self }
    }

    /// The same with so many times fewer inputs.
    pub fn slow(self, cost: u64) -> Self {
        Self { cost, ..self }
    }
}

/// A folder in memory where there is one: files are written there for every input.
pub fn folder() -> tempfile::TempDir {
    let mut builder = tempfile::Builder::new();
    builder.prefix("fmlgs-fuzz");
    builder.tempdir_in("/dev/shm").or_else(|_| builder.tempdir()).expect("folder")
}

/// Asserts that an accepted cloud keeps its own invariants.
pub fn valid(cloud: Result<GaussianCloud, IoError>) -> Result<GaussianCloud, IoError> {
    cloud.inspect(|c| c.validate().expect("an accepted cloud is valid"))
}

pub fn picture(folder: &Path) {
    RgbImage::new(16, 12).save(folder.join("a.png")).expect("save");
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Every reader of the program.
pub fn all() -> Vec<Target> {
    const P: &str = "fuzz";
    const PLY: Door = Door::Starts(b"ply");
    const NPY: Door = Door::Starts(b"\x93NUMPY");
    let mut all = vec![
        Target::new("splat_ply", PLY, |b| valid(io::splat_ply::parse(b, Path::new(P)))),
        Target::new("compressed_ply", PLY, |b| valid(io::splat_ply::parse(b, Path::new(P)))),
        Target::new("points_ply", PLY, |b| io::points_ply::parse(b, Path::new(P))),
        Target::new("sog", Door::Starts(b"PK"), |b| valid(io::sog::parse_archive(b, Path::new(P)))).slow(4),
        Target::in_folder("sog_meta", Door::Json, "meta.json", sog_pictures, |folder| {
            valid(io::sog::read_folder(&folder.join("meta.json")))
        })
        .slow(4),
        Target::new("splat", Door::Any, |b| valid(io::splat::parse(b, Path::new(P)))),
        Target::new("ksplat", Door::Starts(&[0]), |b| valid(io::ksplat::parse(b, Path::new(P)))),
        Target::new("spz", Door::Any, |b| valid(io::spz::parse(b, Path::new(P)))).slow(2),
        // What gzip protects by its checksum.
        Target::new("spz_unpacked", Door::Starts(b"NGSP"), |b| valid(io::spz::parse(&gzip(b), Path::new(P)))),
        Target::new("khr_gltf", Door::StartsOrJson(b"glTF"), |b| valid(io::khr_gltf::parse(b, Path::new(P)))),
        Target::new("colmap_cameras", Door::Any, |b| io::colmap::check_cameras(b, Path::new(P))),
        Target::new("colmap_images", Door::Any, |b| io::colmap::check_images(b, Path::new(P))),
        Target::new("colmap_points", Door::Any, |b| io::colmap::check_points(b, Path::new(P))),
        Target::new("colmap_cameras_text", Door::Any, |b| io::colmap::check_text_cameras(&text(b), Path::new(P))),
        Target::new("colmap_images_text", Door::Any, |b| io::colmap::check_text_images(&text(b), Path::new(P))),
        Target::new("colmap_points_text", Door::Any, |b| io::colmap::check_text_points(&text(b), Path::new(P))),
        Target::new("llff", NPY, |b| io::llff::poses(b, Path::new(P))),
        Target::new("depth_map", NPY, |b| io::npy::map(b, Path::new(P))),
        Target::in_folder("transforms", Door::Json, "transforms.json", picture, |f| {
            sound(io::transforms::read(&f.join("transforms.json")))
        }),
        Target::new("camera_path", Door::Json, |b| {
            io::camera_path::parse(b, Path::new(P)).inspect(|p| p.validate().expect("an accepted path is valid"))
        }),
        Target::in_folder("blender", Door::Json, "transforms_train.json", picture, |f| {
            sound(io::transforms::read_blender(f))
        }),
        Target::in_folder("scene", Door::Json, "scene.json", |_| {}, io::trained::load_info),
        Target::in_folder(
            "photo",
            Door::Picture,
            "photo",
            |_| {},
            |folder| {
                let _ = io::photo::size(&folder.join("photo"));
                io::photo::load(&photo(folder), 10)
            },
        ),
        Target::in_folder("label_polygons", Door::Json, "a.json", |_| {}, labels),
        Target::in_folder("label_shapes", Door::Json, "a.json", |_| {}, labels),
        Target::in_folder("label_instances", Door::Json, "a.json", |_| {}, labels),
        Target::in_folder("label_segments", Door::Any, "photo.txt", |_| {}, labels),
        Target::in_folder("label_names", Door::Any, "data.yaml", segments, labels),
        Target::in_folder("label_masklets", Door::Json, "a.json", |_| {}, labels),
        Target::in_folder("label_ids", Door::Json, "identities.json", id_maps, labels),
        Target::in_folder("label_id_map", Door::Picture, "object_ids/photo.png", id_maps, labels),
        Target::in_folder("label_levels", NPY, "photo_s.npy", |_| {}, labels),
        Target::in_folder("label_classes", Door::Any, "segmentations/classes.txt", classes, labels),
        Target::in_folder(
            "label_picture",
            Door::Picture,
            "test_mask/photo/a.png",
            |f| gray(f, "test_mask/photo"),
            labels,
        ),
    ];
    all.extend(super::targets_more::all());
    all
}

pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut out = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    out.write_all(bytes).expect("pack");
    out.finish().expect("packed")
}

/// Photos that are read have cameras that can be.
pub fn sound(dataset: Result<Dataset, IoError>) -> Result<Dataset, IoError> {
    dataset.inspect(|d| d.cameras().iter().for_each(|c| c.validate().expect("an accepted camera is valid")))
}

pub fn sog_pictures(folder: &Path) {
    for (name, bytes) in super::seeds::sog_pictures() {
        fs::write(folder.join(name), bytes).expect("write");
    }
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

fn segments(folder: &Path) {
    fs::write(folder.join("photo.txt"), super::seeds_data_sets::SEGMENTS).expect("write");
}

fn gray(folder: &Path, inner: &str) {
    fs::create_dir_all(folder.join(inner)).expect("create");
    let at = |x, _| image::Luma([if x < 8 { 255 } else { 1 }]);
    GrayImage::from_fn(16, 12, at).save(folder.join(inner).join("photo.png")).expect("save");
}

fn id_maps(folder: &Path) {
    gray(folder, "object_ids");
    gray(folder, "part_ids");
    fs::write(folder.join("identities.json"), super::seeds::identities().to_string()).expect("write");
}

fn classes(folder: &Path) {
    gray(folder, "images");
    gray(folder, "segmentations/00");
}

fn photo(folder: &Path) -> Photo {
    Photo::new(
        "photo",
        folder.join("photo"),
        Camera {
            width_px: 16,
            height_px: 12,
            focal_px: DVec2::splat(15.0),
            principal_px: DVec2::new(8.0, 6.0),
            world_from_camera: DMat3::IDENTITY,
            center: DVec3::ZERO,
        },
    )
}
