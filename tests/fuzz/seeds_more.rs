//! Small valid files of the readers in `targets_more`.

use std::collections::HashMap;
use std::path::Path;

use fmlgs::io::{semantic_map, splat_ply, trained};
use fmlgs::pipeline::train::TrainConfig;
use fmlgs::pipeline::train::checkpoint::Header;
use fmlgs::scene::{
    Camera, GaussianCloud, Identities, LanguageFeatures, Level, NO_IDENTITY, SemanticMap, ViewFeatures,
};
use glam::DVec3;
use image::{ImageFormat, Rgba, RgbaImage};
use rand::SeedableRng;
use safetensors::tensor::{Dtype, TensorView};
use serde_json::{Value, json};

use super::seeds::{Seed, encode};

/// Folder, file name and bytes of every seed.
pub fn all() -> Vec<Seed> {
    let map_file = saved_map();
    let text = map_header(&map_file);
    let mut cloud = Vec::new();
    splat_ply::encode(&mut cloud, &mapped_cloud(), None).expect("encode");
    let camera = Camera::look_at(DVec3::new(0.0, -3.0, 1.0), DVec3::ZERO, DVec3::Z, 0.8, 64, 48).expect("valid");
    let webp = encode(&RgbaImage::from_fn(2, 2, |x, y| Rgba([x as u8, y as u8, 3, 255])), ImageFormat::WebP);
    let mut seeds = vec![
        ("colmap_folder", "two.txt", b"1 1 0 0 0 1 2 3 1 a.png\n1 2 -1\n2 .7 .1 0 0 1 2 3 2 b.png\n\n".to_vec()),
        ("sog_picture", "a.webp", webp),
        ("semantic_map", "language.safetensors", map_file),
        ("semantic_map_header", "header.json", text.into_bytes()),
        ("scene_cloud", "a.ply", cloud),
        ("gltf_mesh", "triangle.gltf", mesh(true).to_string().into_bytes()),
        ("gltf_mesh", "triangle.glb", glb(&mesh(false), &mesh_bytes())),
        ("gltf_mesh", "draco.glb", draco()),
        ("gltf_mesh", "meshopt.glb", meshopt()),
        ("gltf_mesh_folder", "triangle.gltf", mesh_in_folder().to_string().into_bytes()),
        ("camera_file", "alone.json", json!(camera).to_string().into_bytes()),
        (
            "camera_file",
            "entry.json",
            json!({ "name": "a", "camera": camera, "held_out": true }).to_string().into_bytes(),
        ),
        ("agent_policy", "small.toml", POLICY.to_vec()),
        ("agent_answer", "calls.json", answer().to_string().into_bytes()),
        ("agent_answer_stream", "calls.txt", ANSWER.to_vec()),
        ("query", "whole.txt", "the handle of the kettle's lid &amp; 人形的眼睛 \u{1b}[31mred".as_bytes().to_vec()),
        ("query", "broken.txt", b"caf\xc3\x83\xc2\xa9 \xff\xfe the doll's left eye".to_vec()),
        ("report", "one.json", report().to_string().into_bytes()),
        ("checkpoint", "none.bin", checkpoint(&header(0, 0))),
        ("checkpoint", "two.bin", checkpoint(&header(2, 1))),
        ("checkpoint", "two_summed.bin", summed(checkpoint(&header(2, 1)))),
        ("checkpoint", "two_today.bin", today(checkpoint(&header(2, 1)), 2)),
        ("followed_frame", "small.frame", frame()),
    ];
    let networks = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/networks");
    for name in ["clip.json", "sam.json", "sam2.json"] {
        seeds.push(("model_metadata", name, std::fs::read(networks.join(name)).expect("fixture")));
    }
    seeds
}

/// Two Gaussians of a doll and its eye.
pub fn mapped_cloud() -> GaussianCloud {
    let mut cloud =
        GaussianCloud { sh: vec![[0.25; 3]; 2], ..GaussianCloud::isotropic(vec![[0.0, 1.0, 2.0]; 2], -1.0, 0.5) };
    map().store(&mut cloud);
    cloud
}

/// Objects and parts of the scene.
pub fn map() -> SemanticMap {
    let mut identities = Identities::default();
    let doll = identities.add(Level::Object, NO_IDENTITY, vec!["doll".into(), "人形".into()]);
    let eye = identities.add(Level::Part, doll, vec![]);
    let views = |raw: [f32; 2]| ViewFeatures { raw: vec![raw.to_vec(); 2], deviated: vec![raw.to_vec(); 2] };
    let of = vec![views([1.0, 0.0]), views([0.0, 1.0])];
    let mut map = SemanticMap::from_identities(identities, vec![eye, NO_IDENTITY], vec![0.25, 0.0], vec!["a".into()]);
    map.language = Some(LanguageFeatures { encoder: "test".into(), dimension: 2, by_identity: of });
    map
}

pub fn saved_map() -> Vec<u8> {
    semantic_map::encode(&map(), None, Path::new(semantic_map::FILE)).expect("encode")
}

/// The header that a map's file carries as text.
fn map_header(file: &[u8]) -> String {
    let (_, about) = safetensors::SafeTensors::read_metadata(file).expect("metadata");
    about.metadata().as_ref().expect("metadata")["fmlgs"].clone()
}

/// A map's file with this header and the tensors of two identities.
pub fn map_with(header: &str) -> Vec<u8> {
    let zeros = [0; 2 * 4 * 2 * 2];
    let ones = [2_u32.to_le_bytes(), 2_u32.to_le_bytes()].concat();
    let unit: Vec<u8> = (0..8).flat_map(|_| [0x00, 0x3C, 0, 0]).collect();
    let view = |dtype, shape: &[usize], data| TensorView::new(dtype, shape.to_vec(), data).expect("a tensor");
    let tensors = [
        ("codes", view(Dtype::F32, &[2, 3], &zeros[..24])),
        ("parents", view(Dtype::U32, &[2], &zeros[..8])),
        ("views", view(Dtype::U32, &[2], &ones)),
        ("raw", view(Dtype::F16, &[2, 4, 2], &unit)),
        ("deviated", view(Dtype::F16, &[2, 4, 2], &unit)),
    ];
    safetensors::serialize(tensors, Some(HashMap::from([("fmlgs".to_owned(), header.to_owned())]))).expect("a file")
}

/// Three positions and three indices.
pub fn mesh_bytes() -> Vec<u8> {
    let mut bytes: Vec<u8> =
        [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    bytes.extend([0_u16, 1, 2, 0].iter().flat_map(|v| v.to_le_bytes()));
    bytes
}

/// A triangle with a texture, its bytes inside or as the binary chunk.
fn mesh(embedded: bool) -> Value {
    let bytes = mesh_bytes();
    let png = encode(&RgbaImage::from_pixel(2, 2, Rgba([9, 8, 7, 255])), ImageFormat::Png);
    let uri = |data: &[u8], kind: &str| json!(format!("data:{kind};base64,{}", base64::encode(data)));
    let mut buffer = json!({ "byteLength": bytes.len() });
    if embedded {
        buffer["uri"] = uri(&bytes, "application/octet-stream");
    }
    json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }],
        "nodes": [{ "name": "top", "children": [1], "translation": [1, 0, 0] },
            { "name": "leaf", "mesh": 0, "rotation": [0, 0, 1, 0], "scale": [2, 2, 2] }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_0": 2 }, "indices": 1, "material": 0, "mode": 4 }] }],
        "materials": [{ "name": "paint", "alphaMode": "MASK", "alphaCutoff": 0.5, "doubleSided": true,
            "emissiveFactor": [0, 0.5, 1], "pbrMetallicRoughness": { "baseColorFactor": [1, 0.5, 0.25, 1],
                "baseColorTexture": { "index": 0, "texCoord": 0 } } }],
        "textures": [{ "source": 0, "sampler": 0 }], "samplers": [{ "wrapS": 33071, "wrapT": 10497 }],
        "images": [{ "uri": uri(&png, "image/png") }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] },
            { "bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR" },
            { "componentType": 5126, "count": 3, "type": "VEC2", "sparse": { "count": 1,
                "indices": { "bufferView": 1, "byteOffset": 2, "componentType": 5123 }, "values": { "bufferView": 0 } } },
        ],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }, { "buffer": 0, "byteOffset": 36, "byteLength": 8 }],
        "buffers": [buffer],
    })
}

/// The same with its bytes and its texture in files.
fn mesh_in_folder() -> Value {
    let mut mesh = mesh(false);
    mesh["buffers"][0]["uri"] = json!("a.bin");
    mesh["images"][0]["uri"] = json!("a.png");
    mesh
}

/// Five vertices in three triangles by Draco's own encoder.
const DRACO: &str = "RFJBQ08CAgEBAAAABQMDAwAAAt8A/wER/wEi/wEi/wEiBAAAAAEAAAIAAP8AAAECAgMBAAEBAwkCAQEAAQEJAwACAAEACQMAAwIBAQEACRdpJg\
    OZGQMy9oYUyk/pjuwND2AbEKg+AAAAAP8AAAAAAIA/AACAPwAAgD8AAAAAAAAAPwAAgD4AAAAAAACAPwAAAAAAAAAAAAAAAAAAAAAAAIA/AAAA\
    AAAAAAAAAIA/AAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA/AQEBABEDmRk3aSYDTAmH/////wCAAAD///9//v8AAP//AQAAAA\
    D//wAAAAAAAAAAAAAAAAAAAAAAQBA=";

/// A mesh that Draco has packed.
fn draco() -> Vec<u8> {
    let bytes = base64::decode(DRACO).expect("base64");
    let accessor = |kind: &str| json!({ "componentType": 5126, "count": 5, "type": kind });
    let file = json!({
        "asset": { "version": "2.0" }, "nodes": [{ "mesh": 0 }], "extensionsRequired": ["KHR_draco_mesh_compression"],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "indices": 2,
            "extensions": { "KHR_draco_mesh_compression": { "bufferView": 0, "attributes": { "POSITION": 3, "TEXCOORD_0": 1 } } } }] }],
        "accessors": [accessor("VEC3"), accessor("VEC2"), { "componentType": 5125, "count": 9, "type": "SCALAR" }],
        "bufferViews": [{ "buffer": 0, "byteLength": bytes.len() }], "buffers": [{ "byteLength": bytes.len() }],
    });
    glb(&file, &bytes)
}

/// Four vertices and two triangles that meshoptimizer has packed.
fn meshopt() -> Vec<u8> {
    let [vertices, triangles] = ["oAE/AAAACnYSAT8AAABAB0IAAT8AAAAfGiABPAAAADgIAT8AAAAEP0ABJgAAAAE/AAAAHxogAQ8AAAD//wE/AAAAY0hHAAE/AAAAHxogAAAAAAAAAAAA\
        AAAAAAAAAAAAAAAAAADAAAD54P7/+QAyAPk=", "4fAQAHaHVmd4qYZliWiYAWkAAA=="].map(|text| base64::decode(text).expect("base64"));
    let view = |at: usize, length: usize, stride: u32, count: u32, mode: &str, filter: &str| {
        json!({ "buffer": 1, "byteLength": count * stride,
        "extensions": { "EXT_meshopt_compression": { "buffer": 0, "byteOffset": at, "byteLength": length, "byteStride": stride,
            "count": count, "mode": mode, "filter": filter } } })
    };
    let bytes = [vertices.clone(), triangles.clone()].concat();
    let file = json!({
        "asset": { "version": "2.0" }, "nodes": [{ "mesh": 0 }], "extensionsRequired": ["EXT_meshopt_compression"],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR" }],
        "bufferViews": [view(0, vertices.len(), 12, 4, "ATTRIBUTES", "EXPONENTIAL"),
            view(vertices.len(), triangles.len(), 2, 6, "TRIANGLES", "NONE")],
        "buffers": [{ "byteLength": bytes.len() }, { "byteLength": 60, "extensions": { "EXT_meshopt_compression": { "fallback": true } } }],
    });
    glb(&file, &bytes)
}

fn glb(json: &Value, binary: &[u8]) -> Vec<u8> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend(((28 + text.len() + binary.len()) as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", text.as_slice()), (b"BIN\0", binary)] {
        out.extend((chunk.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(chunk);
    }
    out
}

const POLICY: &[u8] = br#"[tools]
allowed = ["locate", "go_to", "remove", "export"]
confirm = ["remove"]
confirm_overwrite = ["export"]
forbidden = []
"#;

fn answer() -> Value {
    let call = |name: &str, arguments: Value| json!({ "id": "a", "type": "function", "function": { "name": name, "arguments": arguments.to_string() } });
    json!({ "choices": [{ "message": { "role": "assistant", "content": "On it.", "tool_calls": [
        call("go_to", json!({ "target": "the mug", "side": "other", "closeness": 1.5 })),
        call("undo", json!({})),
    ] }, "finish_reason": "tool_calls" }], "usage": { "total_tokens": 7 } })
}

const ANSWER: &[u8] = b": hello\r\ndata: {\"choices\":[{\"delta\":{\"role\":\"assistant\",\"content\":\"On \"}}]}\n\n\
data: {\"choices\":[{\"delta\":{\"tool_calls\":[{\"index\":0,\"id\":\"a\",\"function\":{\"name\":\"undo\",\"arguments\":\"{\"}}]}}]}\n\n\
data: {\"choices\":[{\"delta\":{\"tool_calls\":[{\"index\":0,\"function\":{\"arguments\":\"}\"}}]}}]}\n\n\
data: {\"choices\":[{\"delta\":{},\"finish_reason\":\"tool_calls\"}],\"usage\":{\"total_tokens\":7}}\n\ndata: [DONE]\n\n";

fn report() -> Value {
    let sample = |v: f64| json!({ "median": v, "least": 0.9 * v, "most": 1.1 * v, "each": [v, 0.9 * v, 1.1 * v] });
    let point = |method: &str, secs: f64, rms: f64| {
        json!({ "method": method, "setting": "1/64", "knobs": { "steps": 5 }, "default": method == "default",
        "secs": sample(secs), "values": { "RMS": sample(rms) }, "curve": [[1.0, 0.5], [2.0, 0.25]] })
    };
    let order = json!({ "what": "samples", "pairs": [[1, 1], [2, 0.25]], "expected": 2, "observed": 2, "agrees": true,
        "meaning": "it falls" });
    json!({ "version": fmlgs::measure::VERSION, "program": "0", "scene": "x",
        "computer": { "processor": "one", "cores": 2, "memory_bytes": 5, "gpu": null, "system": "l", "build": "d" },
        "stages": [{ "name": "render", "secs_of": "one picture", "reference": "exact", "input": { "size": "64" },
            "seeds": [0, 1, 2], "planned": 3,
            "measures": [{ "name": "RMS", "unit": "", "form": "error", "meaning": "root mean square" }],
            "rule": { "measure": "RMS", "times": 1.1, "floor": 0.01, "spare_secs": 0 },
            "points": [point("default", 0.02, 0.001), point("cut", 0.01, 0.004), point("cut", 0.005, 0.05)],
            "orders": [order], "left_out": ["one"] }] })
}

fn header(count: usize, sh_degree: u8) -> Header {
    Header {
        config: TrainConfig::default(),
        photos: vec!["a.png".into()],
        step: 5,
        secs: 1.5,
        count,
        sh_degree,
        origin: DVec3::new(1.0, 2.0, 3.0),
        rng: rand_pcg::Pcg64Mcg::seed_from_u64(1),
        round: vec![0],
        budget: 100,
        damping: 1.0,
        refinement: None,
        history: trained::History::default(),
        unreported: Default::default(),
        fits: Vec::new(),
        inputs: None,
    }
}

/// A checkpoint of clouds whose every number is zero.
fn checkpoint(header: &Header) -> Vec<u8> {
    let text = serde_json::to_vec(header).expect("JSON");
    let coefficients = fmlgs::math::sh::coefficients(header.sh_degree);
    let per_gaussian = 4 * (3 * (3 + 3 + 4 + 1 + 3 * coefficients) + 3);
    let mut out = b"FMLGSCP1".to_vec();
    out.extend((text.len() as u64).to_le_bytes());
    out.extend(text);
    out.extend(vec![0; header.count * per_gaussian]);
    out
}

/// The same as the second version wrote it: with a checksum at its end.
fn summed(mut checkpoint: Vec<u8>) -> Vec<u8> {
    checkpoint[7] = b'2';
    checkpoint.extend([0; 32]);
    super::repair::repaired(checkpoint)
}

/// The same as it is written today: without an array of one number for each of its `count` Gaussians.
fn today(mut checkpoint: Vec<u8>, count: usize) -> Vec<u8> {
    checkpoint[7] = b'3';
    checkpoint.truncate(checkpoint.len() - 4 * count);
    checkpoint.extend([0; 32]);
    super::repair::repaired(checkpoint)
}

/// Three arrays, as they are kept of a followed frame.
fn frame() -> Vec<u8> {
    let mut out = Vec::new();
    for n in [2_u64, 3, 0] {
        [2, 1, n].iter().for_each(|v| out.extend(v.to_le_bytes()));
        (0..n).for_each(|i| out.extend((i as f32).to_le_bytes()));
    }
    out
}
