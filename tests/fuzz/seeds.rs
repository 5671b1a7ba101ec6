//! Small valid files, one or a few per parser, from which the corpus was written.

use std::fmt::Write as _;
use std::io::{Cursor, Write as _};

use fmlgs::io::splat_ply;
use fmlgs::io::trained::{SceneCamera, SceneInfo};
use fmlgs::math::sh::coefficients;
use fmlgs::scene::{Camera, Evaluation, ExtraProperty, GaussianCloud, StepMetrics};
use glam::DVec3;
use image::{ImageFormat, Rgba, RgbaImage};
use npyz::WriterBuilder;
use serde_json::json;

use super::seeds_data_sets;

pub type Seed = (&'static str, &'static str, Vec<u8>);

/// Folder, file name and bytes of every seed.
pub fn all() -> Vec<Seed> {
    let mut seeds = vec![
        ("splat_ply", "degree0.ply", splat(0, DVec3::ZERO)),
        ("splat_ply", "degree1_origin.ply", splat(1, DVec3::new(1e6, 0.0, -3.0))),
        ("splat_ply", "ascii.ply", ascii_splat()),
        ("splat_ply", "disks.ply", replaced(&ascii_splat(), &[("property double scale_2\n", ""), ("-2 -3 1", "-2 1")])),
        ("splat_ply", "rgb.ply", replaced(&ascii_splat(), &RGB)),
        ("splat_ply", "comments.ply", replaced(&ascii_splat(), &[("element", COMMENTED)])),
        ("compressed_ply", "degree1.ply", compressed()),
        ("points_ply", "ascii.ply", points("ascii", b"1 2 3 4 5 6\n7 8 9 10 11 12\n")),
        ("points_ply", "binary.ply", points("binary_little_endian", &[7; 30])),
        ("points_ply", "faces_first.ply", faces_first()),
        ("points_ply", "lists.ply", LISTS.to_vec()),
        ("sog", "v2.sog", sog()),
        ("sog_meta", "v2.json", sog_meta(2).to_string().into_bytes()),
        ("sog_meta", "v1.json", sog_meta(1).to_string().into_bytes()),
        ("khr_gltf", "a.gltf", gltf(None)),
        ("khr_gltf", "a.glb", gltf(Some(*b"glTF"))),
        ("khr_gltf", "spz.gltf", gltf_of_spz()),
        ("llff", "two.npy", npy()),
        ("depth_map", "a.npy", depth_map()),
        ("transforms", "nerfstudio.json", transforms().to_string().into_bytes()),
        ("transforms", "per_frame.json", per_frame().to_string().into_bytes()),
        ("transforms", "fisheye.json", fisheye().to_string().into_bytes()),
        ("camera_path", "own.json", camera_path().to_string().into_bytes()),
        ("camera_path", "nerfstudio.json", nerfstudio_path(json!(ROWS)).to_string().into_bytes()),
        ("camera_path", "nerfstudio_old.json", nerfstudio_path(json!(COLUMNS)).to_string().into_bytes()),
        ("blender", "train.json", blender().to_string().into_bytes()),
        ("scene", "scene.json", scene()),
    ];
    seeds.extend(seeds_data_sets::colmap());
    seeds.extend(seeds_data_sets::labels());
    let rgba = RgbaImage::from_fn(16, 12, |x, y| Rgba([(x * 16) as u8, (y * 20) as u8, 99, 255 - (x * y) as u8]));
    seeds.push(("photo", "a.png", encode(&rgba, ImageFormat::Png)));
    seeds.push(("photo", "a.webp", encode(&rgba, ImageFormat::WebP)));
    let rgb = image::DynamicImage::from(rgba).into_rgb8();
    let mut jpeg = Cursor::new(Vec::new());
    rgb.write_to(&mut jpeg, ImageFormat::Jpeg).expect("encode");
    seeds.push(("photo", "a.jpg", jpeg.into_inner()));
    seeds
}

pub fn encode(picture: &RgbaImage, format: ImageFormat) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    picture.write_to(&mut out, format).expect("encode");
    out.into_inner()
}

fn splat(sh_degree: u8, origin: DVec3) -> Vec<u8> {
    let cloud = GaussianCloud {
        origin,
        sh_degree,
        sh: vec![[0.25; 3]; 2 * coefficients(sh_degree)],
        extras: vec![ExtraProperty { name: "label".into(), values: vec![3.0; 2] }],
        ..GaussianCloud::isotropic(vec![[1.0, 2.0, 3.0], [-1.0, 0.5, 0.25]], -2.0, 0.5)
    };
    let mut out = Vec::new();
    splat_ply::encode(&mut out, &cloud, None).expect("encode");
    out
}

fn ascii_splat() -> Vec<u8> {
    let mut text = String::from("ply\nformat ascii 1.0\nelement vertex 2\n");
    for name in "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3".split(' ') {
        let _ = writeln!(text, "property double {name}");
    }
    text += "end_header\n";
    text += &"1 2 3 .1 .2 .3 .5 -1 -2 -3 1 0 0 0\n".repeat(2);
    text.into_bytes()
}

/// Colors in place of harmonics, of a type whose range the values tell.
const RGB: [(&str, &str); 3] = [
    ("property double f_dc_0", "property ushort red"),
    ("property double f_dc_1\nproperty double f_dc_2", "property half green\nproperty float blue"),
    (".1 .2 .3", "300 .2 3"),
];

/// Comments of this program and others.
const COMMENTED: &str =
    "comment Vertical Axis: z\ncomment fmlgs shift 456789 5678901 312\ncomment antialiased 1\nelement";

/// Points with a list among their numbers, and colors in harmonics.
const LISTS: &[u8] = b"ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty list uchar int seen\nproperty float y\nproperty float z\nproperty float f_dc_0\nproperty float f_dc_1\nproperty float f_dc_2\nend_header\n1 2 7 8 2 3 .1 .2 .3\n4 0 5 6 .1 .2 .3\n";

fn replaced(file: &[u8], words: &[(&str, &str)]) -> Vec<u8> {
    let text = String::from_utf8(file.to_vec()).expect("text");
    words.iter().fold(text, |text, (from, to)| text.replace(from, to)).into_bytes()
}

/// An SPZ of one Gaussian within glTF, with a record that says its axes.
fn gltf_of_spz() -> Vec<u8> {
    let head = [b"NGSP".to_vec(), [3_u32, 1].map(u32::to_le_bytes).concat(), vec![0, 12, 2, 0]].concat();
    let record = [0xADBE_0003_u32, 4, 7].map(u32::to_le_bytes).concat();
    let spz = super::targets::gzip(&[head, vec![9; 20], record].concat());
    json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0, "rotation": [0, 0, 1, 0], "scale": [2, 2, 2] }],
        "meshes": [{ "primitives": [{ "attributes": {}, "extensions": { "KHR_gaussian_splatting": {
            "extensions": { "KHR_gaussian_splatting_compression_spz_2": { "bufferView": 0 } } } } }] }],
        "bufferViews": [{ "buffer": 0, "byteLength": spz.len() }],
        "buffers": [{ "byteLength": spz.len(), "uri": format!("data:;base64,{}", base64::encode(&spz)) }],
    })
    .to_string()
    .into_bytes()
}

fn points(format: &str, body: &[u8]) -> Vec<u8> {
    let mut out = format!("ply\nformat {format} 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n").into_bytes();
    out.extend(body);
    out
}

fn faces_first() -> Vec<u8> {
    let mut out = b"ply\nformat binary_big_endian 1.0\nelement face 1\nproperty list uchar int i\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n".to_vec();
    out.extend([2, 0, 0, 0, 1, 0, 0, 0, 2]);
    out.extend([0; 12]);
    out
}

fn compressed() -> Vec<u8> {
    let mut text = String::from("ply\nformat binary_little_endian 1.0\nelement chunk 1\n");
    for name in "min_x min_y min_z max_x max_y max_z min_scale_x min_scale_y min_scale_z max_scale_x max_scale_y max_scale_z min_r min_g min_b max_r max_g max_b".split(' ') {
        let _ = writeln!(text, "property float {name}");
    }
    text += "element vertex 2\n";
    for name in ["position", "rotation", "scale", "color"] {
        let _ = writeln!(text, "property uint packed_{name}");
    }
    text += "element sh 2\n";
    for k in 0..9 {
        let _ = writeln!(text, "property uchar f_rest_{k}");
    }
    let mut out = (text + "end_header\n").into_bytes();
    (0..18).for_each(|i| out.extend((i as f32 / 8.0).to_le_bytes()));
    out.extend((0..32 + 18).map(|i| (i * 5) as u8));
    out
}

/// The pictures that the descriptions in `sog_meta` refer to.
pub fn sog_pictures() -> Vec<(&'static str, Vec<u8>)> {
    let picture = |w, h| {
        let at = |x: u32, y: u32| Rgba([x as u8, y as u8, (x + y) as u8, 252 + (x % 4) as u8]);
        encode(&RgbaImage::from_fn(w, h, at), ImageFormat::WebP)
    };
    let names = ["means_l.webp", "means_u.webp", "scales.webp", "quats.webp", "sh0.webp", "shN_labels.webp"];
    let mut files: Vec<_> = names.map(|n| (n, picture(2, 2))).to_vec();
    files.push(("shN_centroids.webp", picture(64 * 3, 5)));
    files
}

pub fn sog_meta(version: u64) -> serde_json::Value {
    let rest = ["shN_centroids.webp", "shN_labels.webp"];
    let means =
        json!({ "shape": [2, 3], "mins": [-1, 0, 0], "maxs": [1, 1, 2], "files": ["means_l.webp", "means_u.webp"] });
    if version == 1 {
        return json!({
            "means": means,
            "scales": { "mins": [-5, -5, -5], "maxs": [0, 0, 0], "files": ["scales.webp"] },
            "quats": { "files": ["quats.webp"] },
            "sh0": { "mins": [-1, -1, -1, -4], "maxs": [1, 1, 1, 4], "files": ["sh0.webp"] },
            "shN": { "mins": -1, "maxs": 1, "files": rest },
        });
    }
    let codebook: Vec<i32> = (0..256).map(|i| i - 128).collect();
    json!({
        "version": 2, "count": 2, "means": means, "quats": { "files": ["quats.webp"] },
        "scales": { "codebook": codebook, "files": ["scales.webp"] },
        "sh0": { "codebook": codebook, "files": ["sh0.webp"] },
        "shN": { "count": 300, "bands": 1, "codebook": codebook, "files": rest },
    })
}

fn sog() -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let meta = ("meta.json", sog_meta(2).to_string().into_bytes());
    let options = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Deflated);
    for (name, bytes) in sog_pictures().into_iter().chain([meta]) {
        zip.start_file(name, options).expect("start");
        zip.write_all(&bytes).expect("write");
    }
    zip.finish().expect("finish").into_inner()
}

/// One Gaussian below two nodes; as text with an embedded buffer, or binary.
fn gltf(magic: Option<[u8; 4]>) -> Vec<u8> {
    let floats = [1.0_f32, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0, 0.5, 1.0, 2.0, 0.75, 0.1, 0.2, 0.3];
    let binary = floats.map(f32::to_le_bytes).concat();
    let accessor = |offset: usize, kind: &str| json!({ "bufferView": 0, "byteOffset": offset * 4, "componentType": 5126, "count": 1, "type": kind });
    let mut file = json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "children": [1], "translation": [1, 0, 0] }, { "mesh": 0, "rotation": [0, 0, 1, 0], "scale": [2, 2, 2] }],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": 0, "KHR_gaussian_splatting:ROTATION": 1, "KHR_gaussian_splatting:SCALE": 2,
                "KHR_gaussian_splatting:OPACITY": 3, "KHR_gaussian_splatting:SH_DEGREE_0_COEF_0": 4 },
            "extensions": { "KHR_gaussian_splatting": { "kernel": "ellipse", "colorSpace": "lin_rec709_display" } },
        }] }],
        "accessors": [accessor(0, "VEC3"), accessor(3, "VEC4"), accessor(7, "VEC3"), accessor(10, "SCALAR"), accessor(11, "VEC3")],
        "bufferViews": [{ "buffer": 0, "byteLength": binary.len() }],
        "buffers": [{ "byteLength": binary.len() }],
    });
    let Some(magic) = magic else {
        file["buffers"][0]["uri"] = json!(format!("data:;base64,{}", base64::encode(&binary)));
        return file.to_string().into_bytes();
    };
    let text = file.to_string().into_bytes();
    let mut out = [&magic[..], &[2, 0, 0, 0, 0, 0, 0, 0]].concat();
    for (kind, data) in [(b"JSON", &text), (b"BIN\0", &binary)] {
        out.extend((data.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(data);
    }
    out
}

/// A map of 4 x 3 depths.
fn depth_map() -> Vec<u8> {
    let mut out = Vec::new();
    let mut w = npyz::WriteOptions::new().default_dtype().shape(&[3, 4]).writer(&mut out).begin_nd().expect("begin");
    w.extend((0..12).map(|i| i as f32 * 0.5)).expect("write");
    w.finish().expect("finish");
    out
}

fn npy() -> Vec<u8> {
    let row = [0.0, 1.0, 0.0, 1.0, 48.0, 0.0, 0.0, -1.0, 2.0, 64.0, -1.0, 0.0, 0.0, 3.0, 50.0, 0.5, 9.0];
    let mut out = Vec::new();
    let options = npyz::WriteOptions::new().default_dtype().shape(&[2, 17]);
    let mut w = options.writer(&mut out).begin_nd().expect("begin");
    w.extend(row.repeat(2)).expect("write");
    w.finish().expect("finish");
    out
}

fn frame() -> serde_json::Value {
    json!({ "file_path": "a.png", "transform_matrix": [[1, 0, 0, 1], [0, 0, -1, 2], [0, 1, 0, 3], [0, 0, 0, 1]] })
}

fn transforms() -> serde_json::Value {
    json!({ "camera_model": "OPENCV", "w": 16, "h": 12.0, "fl_x": 15.5, "fl_y": 15, "cx": 8, "cy": 6, "k1": 0.1,
        "k2": -0.1, "p1": 0, "p2": 0.01, "ply_file_path": "points.ply", "test_filenames": ["a.png"], "frames": [frame()] })
}

fn per_frame() -> serde_json::Value {
    let mut f = frame();
    f["camera_angle_x"] = json!(0.7);
    f["w"] = json!(32);
    f["h"] = json!(24);
    json!({ "frames": [f] })
}

fn fisheye() -> serde_json::Value {
    let mut f = transforms();
    f["camera_model"] = json!("OPENCV_FISHEYE");
    f["fl_x"] = json!(5.5);
    f["k3"] = json!(0.01);
    f["k6"] = json!(-0.001);
    f
}

fn blender() -> serde_json::Value {
    let mut f = frame();
    f["file_path"] = json!("./a");
    json!({ "camera_angle_x": 0.69, "frames": [f] })
}

/// A camera at (1, 2, 3) in nerfstudio's two ways.
const ROWS: [f64; 16] = [0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 2.0, 0.0, 1.0, 0.0, 3.0, 0.0, 0.0, 0.0, 1.0];
const COLUMNS: &str = "[0,1,0,0,0,0,1,0,1,0,0,0,1,2,3,1]";

fn nerfstudio_path(matrix: serde_json::Value) -> serde_json::Value {
    json!({ "keyframes": [{ "matrix": matrix, "fov": 50, "aspect": 1.5, "override_transition_enabled": true,
        "override_transition_sec": 0.5 }], "camera_type": "perspective", "render_height": 480, "render_width": 640,
        "fps": 24, "seconds": 4, "is_cycle": false, "smoothness_value": 0.5, "default_transition_sec": 2.0,
        "camera_path": [{ "camera_to_world": ROWS, "fov": 50.0, "aspect": 1.5 }] })
}

fn camera_path() -> serde_json::Value {
    let key = json!({ "name": "start", "center": [1, 2.5, -3], "world_from_camera": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        "fov_y_rad": 0.8, "roll_rad": 0.1, "dwell_secs": 1, "time_secs": 2 });
    json!({ "format": "fmlgs-camera-path", "version": 1, "closed": true, "fps": 30, "seconds": 4, "keys": [key, key] })
}

pub fn scene() -> Vec<u8> {
    let camera = Camera::look_at(DVec3::new(0.0, -3.0, 1.0), DVec3::ZERO, DVec3::Z, 0.8, 64, 48).expect("valid");
    let mut info = SceneInfo { version: 1, name: "seed".into(), ..SceneInfo::default() };
    info.cameras.push(SceneCamera { name: "a.png".into(), camera, held_out: true });
    info.history.steps.push(StepMetrics { step: 1, secs: 0.5, loss: 0.2, train_psnr: f64::INFINITY, gaussians: 2 });
    info.history.evaluations.push(Evaluation {
        step: 1,
        secs: 0.5,
        psnr: 20.0,
        ssim: 0.5,
        gaussians: 2,
        views: vec![],
        fitted: None,
    });
    serde_json::to_vec(&info).expect("write")
}

/// List of the objects and parts of the label targets' id maps.
pub fn identities() -> serde_json::Value {
    json!({ "identities": [{ "id": 255, "name": "cup", "level": "object" },
        { "id": 1, "name": "handle", "level": "part", "parent": 255 }] })
}
