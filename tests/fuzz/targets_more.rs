//! More readers that are fuzzed: whole folders, trained scenes, meshes, models, the assistant, reports.

use std::convert::Infallible;
use std::fs;
use std::path::Path;

use fmlgs::agent::llm::wire::ReplyCollector;
use fmlgs::agent::{Policy, ToolCall};
use fmlgs::io::{self, IoError};
use fmlgs::measure::{self, Report};
use fmlgs::models::sam::Sam;
use fmlgs::models::sam2::Sam2;
use fmlgs::models::{ClipEncoder, ModelError, manifest};
use fmlgs::pipeline::semantics::lifting::frame_cache;
use fmlgs::pipeline::semantics::query::parse::ParsedQuery;
use fmlgs::pipeline::train::checkpoint;

use super::seeds_more as seeds;
use super::targets::{Door, Target, picture, sound, text, valid};

/// The rest of [`super::targets::all`].
pub fn all() -> Vec<Target> {
    vec![
        Target::in_folder("colmap_folder", Door::Any, "sparse/0/images.txt", colmap, |f| sound(io::colmap::read(f)))
            .fed(&["colmap_folder", "colmap_images_text"]),
        Target::in_folder("colmap_folder_cameras", Door::Any, "sparse/0/cameras.txt", colmap, |f| {
            sound(io::colmap::read(f))
        })
        .fed(&["colmap_cameras_text"]),
        Target::in_folder("llff_folder", Door::Starts(b"\x93NUMPY"), "poses_bounds.npy", llff, |f| {
            sound(io::llff::read(f))
        })
        .fed(&["llff"]),
        Target::in_folder(
            "splat_file",
            Door::Starts(b"ply"),
            "a.ply",
            |_| {},
            |f| valid(io::splat_ply::read(&f.join("a.ply"))),
        )
        .fed(&["splat_ply"]),
        Target::in_folder("sog_picture", Door::Picture, "means_l.webp", sog, |f| {
            valid(io::sog::read_folder(&f.join("meta.json")))
        })
        .slow(4),
        Target::in_folder("open", Door::Any, "a", |_| {}, |f| io::open(&f.join("a"))).fed(&[
            "splat_ply",
            "compressed_ply",
            "points_ply",
            "sog",
            "khr_gltf",
            "gltf_mesh",
            "photo",
            "depth_map",
        ]),
        Target::in_folder(
            "torch",
            Door::Starts(b"PK"),
            "chkpnt7.pth",
            |_| {},
            |f| match io::open(&f.join("chkpnt7.pth")) {
                Ok(io::Opened::Cloud(cloud)) => valid(Ok::<_, IoError>(cloud)).map_err(io::OpenError::from),
                Ok(_) => unreachable!("a checkpoint is a cloud"),
                Err(e) => Err(e),
            },
        ),
        Target::in_folder("semantic_map", Door::Any, io::semantic_map::FILE, |_| {}, map),
        Target::in_folder(
            "semantic_map_header",
            Door::Any,
            "header.json",
            |_| {},
            |f| {
                let header = fs::read_to_string(f.join("header.json")).unwrap_or_default();
                fs::write(f.join(io::semantic_map::FILE), seeds::map_with(&header)).expect("write");
                map(f)
            },
        ),
        Target::in_folder("scene_cloud", Door::Starts(b"ply"), io::trained::CLOUD_FILE, whole_scene, |f| {
            io::trained::load(f).and_then(|t| io::semantic_map::load(f, t.state.as_deref(), &t.cloud))
        }),
        Target::new("gltf_mesh", Door::StartsOrJson(b"glTF"), |b| io::gltf_mesh::read_slice(b, "fuzz")),
        Target::in_folder("gltf_mesh_folder", Door::Json, "a.gltf", gltf, |f| io::gltf_mesh::read(&f.join("a.gltf"))),
        Target::in_folder("camera_file", Door::Json, "a.json", |_| {}, |f| io::camera_file::read(&f.join("a.json"))),
        Target::in_folder("model_metadata", Door::Json, "a.json", |_| {}, |f| model(&f.join("a.json"))).slow(64),
        Target::new("agent_policy", Door::Toml, |b| Policy::parse(&text(b), "fuzz")),
        Target::new("agent_answer", Door::Json, |b| answer(b, false)),
        Target::new("agent_answer_stream", Door::Any, |b| answer(b, true)),
        Target::new("query", Door::Any, |b| query(&text(b))),
        Target::in_folder(
            "report",
            Door::Json,
            measure::FILE,
            |_| {},
            |f| Report::read(f).map(|r| (measure::page::html(&r), measure::defaults::markdown(&[r]))),
        )
        .slow(16),
        Target::in_folder(
            "checkpoint",
            Door::Starts(b"FMLGSCP"),
            checkpoint::FILE,
            |_| {},
            |f| checkpoint::load(&f.join(checkpoint::FILE)),
        ),
        Target::new("followed_frame", Door::Any, |b| frame_cache::parse(b).ok_or("damaged")),
    ]
}

fn colmap(folder: &Path) {
    let reconstruction = folder.join("sparse/0");
    fs::write(
        reconstruction.join("cameras.txt"),
        "1 OPENCV 16 12 15 15 8 6 .1 0 0 .01\n2 SIMPLE_PINHOLE 16 12 15 8 6\n",
    )
    .expect("write");
    fs::write(reconstruction.join("images.txt"), "1 1 0 0 0 1 2 3 1 a.png\n\n2 1 0 0 0 1 2 3 2 b.png\n\n")
        .expect("write");
    fs::write(reconstruction.join("points3D.txt"), "9 1 2 3 1 2 3 0.5 1 0\n").expect("write");
    photos(folder);
}

fn llff(folder: &Path) {
    photos(folder);
}

/// Two photos that data sets list.
fn photos(folder: &Path) {
    let photos = folder.join("images");
    fs::create_dir_all(&photos).expect("create");
    picture(&photos);
    fs::copy(photos.join("a.png"), photos.join("b.png")).expect("copy");
}

fn sog(folder: &Path) {
    super::targets::sog_pictures(folder);
    fs::write(folder.join("meta.json"), super::seeds::sog_meta(2).to_string()).expect("write");
}

fn map(folder: &Path) -> Result<Option<fmlgs::scene::SemanticMap>, IoError> {
    io::semantic_map::load(folder, None, &seeds::mapped_cloud())
}

fn whole_scene(folder: &Path) {
    fs::write(folder.join(io::trained::SCENE_FILE), super::seeds::scene()).expect("write");
    fs::write(folder.join(io::semantic_map::FILE), seeds::saved_map()).expect("write");
}

fn gltf(folder: &Path) {
    fs::write(folder.join("a.bin"), seeds::mesh_bytes()).expect("write");
    picture(folder);
}

/// Every use of a model's description.
fn model(path: &Path) -> Result<(), ModelError> {
    let kind = manifest::kind(path)?;
    for graph in manifest::graphs(path)? {
        let _ = graph.check_size(path.parent().unwrap_or(path));
    }
    match kind.as_str() {
        "clip" => ClipEncoder::open(path).map(drop),
        "sam" => Sam::open(path).map(drop),
        _ => Sam2::open(path).map(drop),
    }
}

/// A chat model's answer, and the calls in it.
fn answer(bytes: &[u8], is_stream: bool) -> Result<(), String> {
    let mut collector = ReplyCollector::default();
    bytes.chunks(61).any(|piece| collector.take(is_stream, piece));
    let answer = collector.finish(is_stream)?;
    for call in &answer.calls {
        ToolCall::parse(&call.name, &call.arguments).map_err(|e| e.to_string())?;
    }
    Ok(())
}

/// A query as the user types it.
fn query(text: &str) -> Result<(), Infallible> {
    thread_local! {
        static TOKENS: fmlgs::models::clip::tokens::Tokens = fmlgs::models::clip::tokens::Tokens::new(77);
    }
    let _ = ParsedQuery::parse(text);
    let row = TOKENS.with(|t| t.row(text));
    assert_eq!(row.len(), 77, "a row of tokens has a fixed length");
    Ok(())
}
