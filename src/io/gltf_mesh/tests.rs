//! Files made here, valid and broken, and real ones if they are available.

use std::path::PathBuf;

use glam::Vec2;
use gltf::json::mesh::Mode;
use serde_json::{Value, json};

use super::geometry::triangles;
use super::*;

/// Makes a binary glTF file of a JSON part and a binary part.
pub(crate) fn glb(json: &Value, bin: &[u8]) -> Vec<u8> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut bin = bin.to_vec();
    bin.resize(bin.len().next_multiple_of(4), 0);
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend(((28 + text.len() + bin.len()) as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &bin)] {
        out.extend((chunk.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(chunk);
    }
    out
}

/// A cube of side 1 about the origin as mesh 0, without normals; `nodes` refer to it, and the
/// materials are the caller's. The cube's material is 0 if there are any.
pub(crate) fn cubes(nodes: Value, roots: Value, materials: Value) -> (Value, Vec<u8>) {
    let mut bin = Vec::new();
    for i in 0..8_u32 {
        for axis in 0..3 {
            bin.extend(((i >> axis & 1) as f32 - 0.5).to_le_bytes());
        }
    }
    let sides: [[u16; 4]; 6] = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    for [a, b, c, d] in sides {
        bin.extend([a, b, c, a, c, d].iter().flat_map(|i| i.to_le_bytes()));
    }
    let mut primitive = json!({ "attributes": { "POSITION": 0 }, "indices": 1 });
    if materials.as_array().is_some_and(|m| !m.is_empty()) {
        primitive["material"] = 0.into();
    }
    let root = json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": roots }], "nodes": nodes,
        "meshes": [{ "primitives": [primitive] }],
        "materials": materials,
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3", "min": [-0.5, -0.5, -0.5], "max": [0.5, 0.5, 0.5] },
            { "bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": 96 },
            { "buffer": 0, "byteOffset": 96, "byteLength": 72 },
        ],
        "buffers": [{ "byteLength": bin.len() }],
    });
    (root, bin)
}

fn one_cube() -> (Value, Vec<u8>) {
    cubes(json!([{ "name": "cube", "mesh": 0 }]), json!([0]), json!([]))
}

/// Reads the cube after `change` to its JSON.
fn read_changed(change: impl FnOnce(&mut Value)) -> Result<MeshScene, IoError> {
    let (mut root, bin) = one_cube();
    change(&mut root);
    read_slice(&glb(&root, &bin), "cube.glb")
}

/// Folder with the real scenes, if available.
pub(crate) fn real_scenes() -> Option<PathBuf> {
    let data = std::env::var_os("FMLGS_DATA").map(PathBuf::from);
    let data = data.unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"));
    let folder = data.join("gltf");
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: no {}", folder.display());
    None
}

#[test]
fn a_cube_is_read() {
    let scene = read_changed(|_| {}).unwrap();
    assert_eq!(scene.nodes.len(), 1);
    assert_eq!(scene.nodes[0].name.as_deref(), Some("cube"));
    let primitive = &scene.meshes[0].primitives[0];
    assert_eq!((primitive.positions.len(), primitive.triangles.len()), (8, 12));
    assert_eq!(primitive.material, scene.materials.len() - 1);
}

#[test]
fn strips_and_fans_turn_the_same_way_as_lists() {
    assert_eq!(triangles(&[0, 1, 2, 3], Mode::TriangleStrip), [[0, 1, 2], [1, 3, 2]]);
    assert_eq!(triangles(&[0, 1, 2, 3], Mode::TriangleFan), [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(triangles(&[0, 1, 2, 3], Mode::Triangles), [[0, 1, 2]]);
    for mode in [Mode::TriangleStrip, Mode::TriangleFan, Mode::Triangles] {
        assert!(triangles(&[0, 1], mode).is_empty() && triangles(&[], mode).is_empty());
    }
}

#[test]
fn index_types_are_equivalent() {
    let expected = read_changed(|_| {}).unwrap().meshes[0].primitives[0].triangles.clone();
    let (root, bin) = one_cube();
    let shorts: Vec<u16> = bin[96..168].chunks(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
    for (kind, bytes) in [
        (5121, shorts.iter().map(|&i| i as u8).collect::<Vec<u8>>()),
        (5125, shorts.iter().flat_map(|&i| u32::from(i).to_le_bytes()).collect()),
    ] {
        let mut root = root.clone();
        root["accessors"][1]["componentType"] = kind.into();
        root["bufferViews"][1]["byteLength"] = bytes.len().into();
        let bin = [&bin[..96], &bytes].concat();
        root["buffers"][0]["byteLength"] = bin.len().into();
        let scene = read_slice(&glb(&root, &bin), "cube.glb").unwrap();
        assert_eq!(scene.meshes[0].primitives[0].triangles, expected);
    }
}

#[test]
fn sparse_and_normalized_accessors() {
    let (mut root, mut bin) = one_cube();
    // Vertex 7 moved to (2, 3, 4); vertex colors as normalized bytes.
    let at = bin.len();
    bin.extend(7_u16.to_le_bytes());
    bin.extend([0, 0]);
    bin.extend([2.0_f32, 3.0, 4.0].iter().flat_map(|v| v.to_le_bytes()));
    bin.extend([255_u8, 51, 0].repeat(8));
    root["bufferViews"].as_array_mut().unwrap().extend([
        json!({ "buffer": 0, "byteOffset": at, "byteLength": 2 }),
        json!({ "buffer": 0, "byteOffset": at + 4, "byteLength": 12 }),
        json!({ "buffer": 0, "byteOffset": at + 16, "byteLength": 24 }),
    ]);
    root["accessors"][0]["sparse"] = json!({
        "count": 1,
        "indices": { "bufferView": 2, "componentType": 5123, "byteOffset": 0 },
        "values": { "bufferView": 3, "byteOffset": 0 },
    });
    let color = json!({ "bufferView": 4, "componentType": 5121, "normalized": true, "count": 8, "type": "VEC3" });
    root["accessors"].as_array_mut().unwrap().push(color);
    root["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = 2.into();
    root["buffers"][0]["byteLength"] = bin.len().into();
    let scene = read_slice(&glb(&root, &bin), "cube.glb").unwrap();
    let primitive = &scene.meshes[0].primitives[0];
    assert_eq!(primitive.positions[7].to_array(), [2.0, 3.0, 4.0]);
    assert_eq!(primitive.positions[6].to_array(), [-0.5, 0.5, 0.5]);
    assert_eq!(primitive.colors[3].to_array(), [1.0, 0.2, 0.0, 1.0]);
}

#[test]
fn texture_transform_is_the_extensions() {
    let quarter = std::f32::consts::FRAC_PI_2;
    let usage = |offset, rotation_rad, scale| TextureUse {
        image: 0,
        uv_set: 0,
        offset,
        rotation_rad,
        scale,
        wrap: [Wrap::Repeat; 2],
        nearest: false,
    };
    let at = |u: TextureUse, x, y| u.transform(Vec2::new(x, y));
    // The extension's matrices: translation * rotation * scale, rotation = [c s; -s c] on (u, v).
    assert!(at(usage(Vec2::new(0.1, 0.2), 0.0, Vec2::new(2.0, 3.0)), 0.5, 0.5).distance(Vec2::new(1.1, 1.7)) < 1e-6);
    assert!(at(usage(Vec2::ZERO, quarter, Vec2::ONE), 1.0, 0.0).distance(Vec2::new(0.0, -1.0)) < 1e-6);
    assert!(at(usage(Vec2::ZERO, quarter, Vec2::new(2.0, 1.0)), 0.0, 1.0).distance(Vec2::new(1.0, 0.0)) < 1e-6);
}

#[test]
fn transforms_multiply_down_the_tree() {
    let scene = read_changed(|r| {
        r["nodes"] = json!([
            { "name": "a", "translation": [1, 2, 3], "scale": [2, 2, 2], "children": [1] },
            { "name": "b", "rotation": [0, 0.707_106_77, 0, 0.707_106_77], "translation": [1, 0, 0], "mesh": 0 },
        ]);
    })
    .unwrap();
    let p = scene.nodes[1].world_from_node.transform_point3(glam::DVec3::X);
    assert!(p.distance(glam::DVec3::new(3.0, 2.0, 1.0)) < 1e-6, "{p}");
}

#[test]
fn wrong_content_is_named() {
    let claims = |n: u64| move |r: &mut Value| r["accessors"][0]["count"] = n.into();
    let problem = |change: &dyn Fn(&mut Value)| match read_changed(change) {
        Err(e) => e.to_string(),
        Ok(_) => panic!("read without an error"),
    };
    type Change = Box<dyn Fn(&mut Value)>;
    let cases: Vec<(&str, Change)> = vec![
        ("9 values in accessors[0] announced", Box::new(claims(9))),
        ("what its buffers can hold", Box::new(claims(1 << 60))),
        ("accessors[7], but there are 2", Box::new(|r| r["meshes"][0]["primitives"][0]["indices"] = 7.into())),
        ("meshes[1], but there are 1", Box::new(|r| r["nodes"][0]["mesh"] = 1.into())),
        ("materials[0], but there are 0", Box::new(|r| r["meshes"][0]["primitives"][0]["material"] = 0.into())),
        ("buffers[4], but there are 1", Box::new(|r| r["bufferViews"][0]["buffer"] = 4.into())),
        ("nodes[5], but there are 1", Box::new(|r| r["scenes"][0]["nodes"] = json!([5]))),
        ("lie outside its buffer", Box::new(|r| r["bufferViews"][0]["byteOffset"] = u64::MAX.into())),
        ("claims 99999 bytes", Box::new(|r| r["buffers"][0]["byteLength"] = 99_999.into())),
        ("is not below its 3 vertices", Box::new(|r| r["accessors"][0]["count"] = 3.into())),
        ("reached twice", Box::new(|r| r["nodes"] = json!([{ "children": [1] }, { "children": [0] }]))),
        ("reached twice", Box::new(|r| r["scenes"][0]["nodes"] = json!([0, 0]))),
        ("number out of range", Box::new(|r| r["nodes"][0]["translation"] = json!([1e39, 0, 0]))),
        ("number out of range", Box::new(|r| r["nodes"][0]["rotation"] = json!([1e39, 0, 0, 0]))),
        ("gltf-transform copy", Box::new(|r| r["extensionsRequired"] = json!(["KHR_meshopt_compression"]))),
        ("mode is unknown", Box::new(|r| r["meshes"][0]["primitives"][0]["mode"] = 77.into())),
        ("componentType is unknown", Box::new(|r| r["accessors"][0]["componentType"] = 1.into())),
        ("not VEC3", Box::new(|r| r["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 1.into())),
        ("as indices", Box::new(|r| r["meshes"][0]["primitives"][0]["indices"] = 0.into())),
        ("expected a sequence", Box::new(|r| *r = json!({ "nodes": 3 }))),
    ];
    for (expected, change) in cases {
        let text = problem(&*change);
        assert!(text.contains(expected) && text.contains("cube.glb"), "expected `{expected}`, got `{text}`");
    }
}

#[test]
fn numbers_that_are_not_finite_are_named() {
    let (root, mut bin) = one_cube();
    bin[40..44].copy_from_slice(&f32::NAN.to_le_bytes());
    let text = read_slice(&glb(&root, &bin), "cube.glb").unwrap_err().to_string();
    assert!(text.contains("accessors[0] of element 3 is not finite"), "{text}");
}

#[test]
fn every_truncation_is_an_error() {
    let (root, bin) = one_cube();
    let whole = glb(&root, &bin);
    assert!(read_slice(&whole, "cube.glb").is_ok());
    for length in 0..whole.len() {
        assert!(read_slice(&whole[..length], "cube.glb").is_err(), "{length} of {} bytes", whole.len());
    }
}

#[test]
fn files_outside_the_folder_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("scene");
    std::fs::create_dir(&inner).unwrap();
    let (mut root, bin) = one_cube();
    std::fs::write(folder.path().join("data.bin"), &bin).unwrap();
    std::fs::write(inner.join("my data.bin"), &bin).unwrap();
    let path = inner.join("cube.gltf");
    let mut read_with = |uri: &str| {
        root["buffers"][0]["uri"] = uri.into();
        std::fs::write(&path, root.to_string()).unwrap();
        read(&path)
    };
    assert!(read_with("my%20data.bin").is_ok());
    assert!(read_with("./my data.bin").is_ok());
    let absolute = folder.path().join("data.bin").display().to_string();
    for uri in ["../data.bin", "%2e%2e/data.bin", "..\\data.bin", "a/../../data.bin", &absolute, "file:///etc/passwd"] {
        let result = read_with(uri);
        assert!(matches!(result, Err(IoError::Outside { .. })), "{uri}: {result:?}");
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(folder.path().join("data.bin"), inner.join("link.bin")).unwrap();
        assert!(matches!(read_with("link.bin"), Err(IoError::Outside { .. })));
    }
    assert!(matches!(read_with("absent.bin"), Err(IoError::Read { .. })));
    // From memory there is no folder to read from.
    root["buffers"][0]["uri"] = "my data.bin".into();
    let result = read_slice(root.to_string().as_bytes(), "cube.gltf");
    assert!(matches!(result, Err(IoError::Outside { .. })));
}

#[test]
fn embedded_data_is_decoded() {
    let (mut root, _) = cubes(json!([{ "mesh": 0 }]), json!([0]), json!([]));
    root["accessors"] = json!([{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }]);
    root["bufferViews"] = json!([{ "buffer": 0, "byteLength": 36 }]);
    root["meshes"] = json!([{ "primitives": [{ "attributes": { "POSITION": 0 } }] }]);
    // 36 bytes, zero but for the last, which makes 0.5 of the last component.
    let uri = format!("data:application/octet-stream;base64,{}/", "A".repeat(47));
    root["buffers"] = json!([{ "byteLength": 36, "uri": uri }]);
    let scene = read_slice(root.to_string().as_bytes(), "t.gltf").unwrap();
    assert_eq!(scene.meshes[0].primitives[0].positions[2].to_array(), [0.0, 0.0, 0.5]);
    root["buffers"] = json!([{ "byteLength": 36, "uri": "data:;base64,!!!" }]);
    let text = read_slice(root.to_string().as_bytes(), "t.gltf").unwrap_err().to_string();
    assert!(text.contains("data URI does not decode"), "{text}");
}

#[test]
fn images_that_are_missing_or_broken_leave_a_warning() {
    let material = json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }]);
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("broken.png"), b"\x89PNG nothing").unwrap();
    for (image, expected) in [("absent.png", "absent.png"), ("broken.png", "images[0]")] {
        let (mut root, bin) = cubes(json!([{ "mesh": 0 }]), json!([0]), material.clone());
        root["textures"] = json!([{ "source": 0 }]);
        root["images"] = json!([{ "uri": image }]);
        let path = folder.path().join("cube.glb");
        std::fs::write(&path, glb(&root, &bin)).unwrap();
        let scene = read(&path).unwrap();
        assert!(scene.warnings.len() == 1 && scene.warnings[0].contains(expected), "{:?}", scene.warnings);
        assert!(scene.materials[0].base_texture.is_none());
    }
}

/// A BMP with a header of so many pixels, and none in it.
fn bmp_without_pixels(side_px: i32) -> Vec<u8> {
    let mut bytes = b"BM".to_vec();
    [54_u32, 0, 54, 40].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    [side_px, side_px].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    [1_u16, 24].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    bytes.resize(54, 0);
    bytes
}

#[test]
fn textures_that_are_too_large_together_are_refused_before_one_is_decoded() {
    let read_with = |side_px: i32| {
        let texture = |i: usize| json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": i } } });
        let materials: Vec<Value> = (0..20).map(texture).collect();
        let (mut root, bin) = cubes(json!([{ "mesh": 0 }]), json!([0]), materials.into());
        let uri = format!("data:image/bmp;base64,{}", base64::encode(bmp_without_pixels(side_px)));
        root["textures"] = (0..20).map(|i| json!({ "source": i })).collect();
        root["images"] = (0..20).map(|_| json!({ "uri": uri })).collect();
        read_slice(&glb(&root, &bin), "huge.glb")
    };
    let text = read_with(16_384).unwrap_err().to_string();
    let told = ["huge.glb, images: 20 textures", "5,368,709,120 pixels", "16384 x 16384 px", "make them smaller"];
    told.iter().for_each(|words| assert!(text.contains(words), "{text}"));
    // Control: with a usual size, each is read as far as it goes.
    assert_eq!(read_with(64).unwrap().materials.len(), 21);
}

#[test]
fn real_scenes_are_read() {
    let Some(folder) = real_scenes() else { return };
    let expected = [
        ("CesiumMilkTruck/CesiumMilkTruck.glb", 6, 1),
        ("GlassBrokenWindow/GlassBrokenWindow.glb", 3, 1),
        ("GlamVelvetSofa/GlamVelvetSofa.glb", 4, 0),
        ("SheenChair/SheenChair.gltf", 4, 3),
        ("ToyCar/ToyCar.gltf", 11, 3),
        ("kenney_vehicles/vehicle-motorcycle.glb", 5, 1),
        ("sunglasses/sunglasses.glb", 16, 1),
    ];
    for (file, nodes, images) in expected {
        let scene = read(&folder.join(file)).unwrap();
        assert_eq!((scene.nodes.len(), scene.images.len()), (nodes, images), "{file}");
        assert!(scene.warnings.is_empty(), "{file}: {:?}", scene.warnings);
        assert!(scene.meshes.iter().flat_map(|m| &m.primitives).all(|p| !p.triangles.is_empty()));
    }
}
