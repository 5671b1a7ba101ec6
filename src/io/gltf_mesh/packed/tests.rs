//! glTF files packed by Draco and by meshoptimizer.

use serde_json::{Value, json};

use super::*;
use crate::io::gltf_mesh::tests::{cubes, glb};
use crate::io::gltf_mesh::{MeshScene, read_slice};

/// Five vertices in three triangles, with texture coordinates, colors and normals, by Draco's own encoder.
const DRACO_MESH: &str = "RFJBQ08CAgEBAAAABQMDAwAAAt8A/wER/wEi/wEi/wEiBAAAAAEAAAIAAP8AAAECAgMBAAEBAwkCAQEAAQEJAwACAAEACQMAAwIB\
    AQEACRdpJgOZGQMy9oYUyk/pjuwND2AbEKg+AAAAAP8AAAAAAIA/AACAPwAAgD8AAAAAAAAAPwAAgD4AAAAAAACAPwAAAAAAAAAA\
    AAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA/AQEBABEDmRk3aSYDTAmH\
    /////wCAAAD///9//v8AAP//AQAAAAD//wAAAAAAAAAAAAAAAAAAAAAAQBA=";

fn scene(root: &Value, bin: &[u8]) -> Result<MeshScene, IoError> {
    read_slice(&glb(root, bin), "a.glb")
}

/// A file whose only mesh is packed by Draco.
fn draco() -> (Value, Vec<u8>) {
    let bin = base64::decode(DRACO_MESH).expect("base64");
    let accessor = |kind: &str, component: u32| json!({ "componentType": component, "count": 5, "type": kind });
    let mut colors = accessor("VEC3", 5121);
    colors["normalized"] = true.into();
    let root = json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0, "name": "a" }],
        "extensionsRequired": ["KHR_draco_mesh_compression"], "extensionsUsed": ["KHR_draco_mesh_compression"],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": 2, "NORMAL": 3 }, "indices": 4,
            "extensions": { "KHR_draco_mesh_compression": {
                "bufferView": 0, "attributes": { "POSITION": 3, "TEXCOORD_0": 1, "COLOR_0": 0, "NORMAL": 2 } } },
        }] }],
        "accessors": [accessor("VEC3", 5126), accessor("VEC2", 5126), colors, accessor("VEC3", 5126),
            { "componentType": 5125, "count": 9, "type": "SCALAR" }],
        "bufferViews": [{ "buffer": 0, "byteLength": bin.len() }],
        "buffers": [{ "byteLength": bin.len() }],
    });
    (root, bin)
}

#[test]
fn a_mesh_of_dracos_is_unpacked() {
    let (root, bin) = draco();
    let scene = scene(&root, &bin).expect("read");
    let mesh = &scene.meshes[0].primitives[0];
    assert_eq!((mesh.positions.len(), mesh.triangles.len(), mesh.normals.len()), (5, 3, 5));
    // As before packing, in any order: a vertex with this position has this texture coordinate and color.
    for (place, uv, color) in [
        ([0.0, 0.0, 0.0], [0.0, 0.0], [255.0, 0.0, 0.0]),
        ([1.0, 0.0, 0.0], [1.0, 0.0], [0.0, 255.0, 0.0]),
        ([0.0, 1.0, 0.0], [0.0, 1.0], [0.0, 0.0, 255.0]),
        ([1.0, 1.0, 0.5], [1.0, 1.0], [10.0, 20.0, 30.0]),
        ([2.0, 0.0, 1.0], [0.5, 0.25], [100.0, 110.0, 120.0]),
    ] {
        let at = mesh.positions.iter().position(|p| (*p - glam::Vec3::from(place)).length() < 1e-3).expect("a vertex");
        assert!((mesh.uv_sets[0][at] - glam::Vec2::from(uv)).length() < 2e-3, "{:?}", mesh.uv_sets[0][at]);
        let found = mesh.colors[at].truncate() * 255.0;
        assert!((found - glam::Vec3::from(color)).length() < 0.1, "{found} for {color:?}");
        assert!((mesh.normals[at] - glam::Vec3::Z).length() < 0.02);
    }
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        0.5 * (b - a).cross(c - a).length()
    };
    let total: f32 = mesh.triangles.iter().map(area).sum();
    // 0.5, |(0, 1, 0.5) x (-1, 1, 0)| / 2 and |(1, 0, 1) x (0, 1, 0.5)| / 2.
    assert!((total - (0.5 + 0.5 * 1.5_f32.sqrt() + 0.75)).abs() < 1e-3, "{total}");
}

#[test]
fn a_broken_mesh_of_dracos_is_named() {
    let (root, bin) = draco();
    for n in [0, 3, 10, 40, bin.len() - 4] {
        let mut root = root.clone();
        root["bufferViews"][0]["byteLength"] = n.into();
        let e = scene(&root, &bin).expect_err("cut off").to_string();
        assert!(
            e.contains("meshes[0].primitives[0], KHR_draco_mesh_compression") && e.contains("gltf-transform copy"),
            "{n}: {e}"
        );
    }
    let mut other = root.clone();
    other["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"]["bufferView"] = 9.into();
    assert!(scene(&other, &bin).expect_err("no view").to_string().contains("bufferViews[9]"));
    let mut more = root;
    more["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"]["attributes"] =
        json!({ "POSITION": 77 });
    // An attribute that is not in it is read by its accessor, which has no bytes: nothing, and no crash.
    let _ = scene(&more, &bin);
}

/// The cube of the other tests with its views packed: positions as they are, indices by meshoptimizer.
fn meshopt_cube() -> (Value, Vec<u8>) {
    let (mut root, bin) = cubes(json!([{ "mesh": 0, "name": "cube" }]), json!([0]), json!([]));
    let indices: Vec<u16> = bin[96..].chunks(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
    // A sequence of indices by its own rule: twice the zigzag difference to the last, in steps of seven bits.
    let mut packed = vec![0xd1];
    let mut last = 0_i32;
    for i in indices {
        let difference = i32::from(i) - last;
        packed.push((((difference << 1) ^ (difference >> 31)) as u8) << 1);
        last = i32::from(i);
    }
    packed.extend([0; 4]);
    let packed_at = 96;
    let mut all = bin[..96].to_vec();
    all.extend(&packed);
    root["extensionsRequired"] = json!(["EXT_meshopt_compression"]);
    root["buffers"] = json!([{ "byteLength": all.len() }, { "byteLength": 72, "extensions": { "EXT_meshopt_compression": { "fallback": true } } }]);
    root["bufferViews"][1] = json!({ "buffer": 1, "byteLength": 72, "extensions": { "EXT_meshopt_compression": {
        "buffer": 0, "byteOffset": packed_at, "byteLength": packed.len(), "byteStride": 2, "count": 36, "mode": "INDICES" } } });
    (root, all)
}

#[test]
fn views_of_meshoptimizers_are_unpacked() {
    let (root, bin) = meshopt_cube();
    let found = scene(&root, &bin).expect("read");
    let (plain, plain_bin) = cubes(json!([{ "mesh": 0, "name": "cube" }]), json!([0]), json!([]));
    let plain = scene(&plain, &plain_bin).expect("plain");
    let [found, plain] = [found, plain].map(|s| s.meshes[0].primitives[0].clone());
    assert_eq!((found.triangles, found.positions), (plain.triangles, plain.positions));
}

#[test]
fn broken_views_are_named() {
    let (root, bin) = meshopt_cube();
    let with = |key: &str, value: Value| {
        let mut root = root.clone();
        root["bufferViews"][1]["extensions"]["EXT_meshopt_compression"][key] = value;
        scene(&root, &bin).expect_err(key).to_string()
    };
    for (key, value, words) in [
        ("mode", json!("CUBES"), "the mode CUBES is not known"),
        ("filter", json!("QUATERNION"), "the filter QUATERNION is not known"),
        ("filter", json!("OCTAHEDRAL"), "its filter does not go with 2 bytes"),
        ("byteLength", json!(20), "ends early"),
        ("byteLength", json!(1_u64 << 40), "lie outside its buffer"),
        ("count", json!(1_u64 << 60), "what its buffers can hold"),
        ("buffer", json!(7), "buffers[7]"),
        ("byteStride", json!(null), "bufferViews[1], EXT_meshopt_compression"),
    ] {
        let said = with(key, value);
        assert!(said.contains(words), "{words}: {said}");
    }
}
