//! Tests of splats in glTF.

use serde_json::{Value, json};

use super::*;
use crate::io::test_clouds;
use crate::math::sh::SH_C0;
use crate::scene::ExtraProperty;

/// One Gaussian of degree 0 with float attributes, in one embedded buffer, in the axes of the scene as this program wrote
/// them once.
fn gltf() -> Value {
    let floats: [f32; 14] = [1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0, 0.5, 1.0, 2.0, 0.75, 0.1, 0.2, 0.3];
    let bytes: Vec<u8> = floats.iter().flat_map(|v| v.to_le_bytes()).collect();
    let accessor = |offset: usize, kind: &str| json!({ "bufferView": 0, "byteOffset": offset * 4, "componentType": 5126, "count": 1, "type": kind });
    json!({
        "asset": { "version": "2.0", "generator": "fmlgs" }, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{
            "mode": 0,
            "attributes": {
                "POSITION": 0, "KHR_gaussian_splatting:ROTATION": 1, "KHR_gaussian_splatting:SCALE": 2,
                "KHR_gaussian_splatting:OPACITY": 3, "KHR_gaussian_splatting:SH_DEGREE_0_COEF_0": 4,
            },
            "extensions": { "KHR_gaussian_splatting": { "kernel": "ellipse", "colorSpace": "srgb_rec709_display" } },
        }] }],
        "accessors": [accessor(0, "VEC3"), accessor(3, "VEC4"), accessor(7, "VEC3"), accessor(10, "SCALAR"), accessor(11, "VEC3")],
        "bufferViews": [{ "buffer": 0, "byteLength": bytes.len() }],
        "buffers": [{ "byteLength": bytes.len(), "uri": format!("data:application/octet-stream;base64,{}", base64::encode(&bytes)) }],
    })
}

fn read_json(json: &Value) -> Result<GaussianCloud, IoError> {
    parse(json.to_string().as_bytes(), Path::new("a.gltf"))
}

fn near(a: f32, b: f32) -> bool {
    (a - b).abs() < 1e-5
}

#[test]
fn values_arrive_in_our_units() {
    let c = read_json(&gltf()).expect("read");
    assert_eq!((c.len(), c.sh_degree, c.positions[0]), (1, 0, [1.0, 2.0, 3.0]));
    assert_eq!(c.quaternions[0], [1.0, 0.0, 0.0, 0.0]);
    assert!(near(c.log_scales[0][0], 0.5_f32.ln()) && near(c.log_scales[0][2], 2.0_f32.ln()));
    assert!(near(c.opacity_logits[0], 3.0_f32.ln()));
    assert_eq!(c.sh, [[0.1, 0.2, 0.3]]);
}

#[test]
fn others_files_are_left_up_front() {
    let mut g = gltf();
    for generator in [json!("splat-transform 2.7.1"), json!("fmlgs 0.2.0"), json!(null)] {
        g["asset"]["generator"] = generator;
        let c = read_json(&g).expect("read");
        // Half a turn around z.
        assert_eq!((c.positions[0], c.quaternions[0]), ([-1.0, -2.0, 3.0], [0.0, 0.0, 0.0, 1.0]));
    }
    let c = parse_in(g.to_string().as_bytes(), Path::new("a.gltf"), Some(Axes::PLY)).expect("read");
    assert_eq!(c.positions[0], [1.0, 2.0, 3.0]);
}

#[test]
fn harmonics_turn_with_their_node() {
    let cloud = test_clouds::random(50, 3);
    let mut text = Vec::new();
    encode_text(&mut text, &cloud, &mut |_| Ok(())).expect("gltf");
    let mut g: Value = serde_json::from_slice(&text).expect("json");
    let turn = glam::DQuat::from_axis_angle(glam::DVec3::new(0.6, 0.0, 0.8), 0.7);
    g["nodes"][1]["rotation"] = json!(turn.to_array());
    let turned = read_json(&g).expect("read");
    // The turn is in the axes of the file.
    let axes = Axes::GLTF.scene_from_file();
    let expected = cloud.clone().turned(&(axes * glam::DMat3::from_quat(turn) * axes.transpose()), false);
    test_clouds::assert_near(&turned, &expected, [1e-5, 1e-5, 1e-5, 1e-5, 1e-5]);
    assert!((turned.sh[5][0] - cloud.sh[5][0]).abs() > 1e-3, "it turned");
}

#[test]
fn linear_colors_become_display_colors() {
    let mut g = gltf();
    g["meshes"][0]["primitives"][0]["extensions"]["KHR_gaussian_splatting"]["colorSpace"] = json!("lin_rec709_display");
    let c = read_json(&g).expect("read");
    let linear = 0.5 + SH_C0 as f32 * 0.2;
    let display = 1.055 * linear.powf(1.0 / 2.4) - 0.055;
    assert!(near(0.5 + SH_C0 as f32 * c.sh[0][1], display));
}

#[test]
fn nodes_move_turn_and_scale() {
    let mut g = gltf();
    let half = 0.5_f64.sqrt();
    g["nodes"] = json!([
        { "children": [1], "translation": [10, 0, 0] },
        { "mesh": 0, "rotation": [0, 0, half, half], "scale": [2, 2, 2] },
    ]);
    let c = read_json(&g).expect("read");
    // (1, 2, 3) doubled is (2, 4, 6); a quarter turn about z makes it (-4, 2, 6).
    let place = c.world_position(0).as_vec3().to_array();
    assert!(place.iter().zip([6.0, 2.0, 6.0]).all(|(a, b)| near(*a, b)), "{place:?}");
    assert!(near(c.log_scales[0][1], 2.0_f32.ln()));
    assert!(near(c.quaternions[0][0], half as f32) && near(c.quaternions[0][3], half as f32));
    g["nodes"][1]["scale"] = json!([2, 1, 2]);
    assert!(matches!(read_json(&g), Err(IoError::Unsupported { .. })));
    g["nodes"][1] = json!({ "mesh": 0, "children": [0] });
    assert!(matches!(read_json(&g), Err(IoError::Syntax { reason, .. }) if reason.contains("twice")));
}

#[test]
fn binary_files_hold_the_same() {
    let mut g = gltf();
    let text = g["buffers"][0]["uri"].as_str().expect("text").split_once(',').expect("data").1.to_owned();
    g["buffers"][0].as_object_mut().expect("object").remove("uri");
    let json = g.to_string();
    let binary = base64::decode(text).expect("valid");
    let mut glb = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    for (kind, data) in [(b"JSON", json.as_bytes()), (b"BIN\0", &binary)] {
        glb.extend((data.len() as u32).to_le_bytes());
        glb.extend(kind);
        glb.extend(data);
    }
    let path = Path::new("a.glb");
    assert!(parse(&glb, path).expect("glb") == read_json(&gltf()).expect("gltf"));
    for n in [4, 12, 19, 40, glb.len() - 1] {
        assert!(matches!(parse(&glb[..n], path), Err(IoError::Truncated { .. })), "{n}");
    }
}

#[test]
fn hostile_files_are_named() {
    let with = |change: fn(&mut Value)| {
        let mut g = gltf();
        change(&mut g);
        read_json(&g).expect_err("hostile")
    };
    let e = with(|g| g["accessors"][0]["count"] = json!(1_u64 << 60));
    assert!(matches!(e, IoError::OverBudget { .. }), "{e}");
    let e = with(|g| g["accessors"][0]["count"] = json!(5));
    assert!(matches!(e, IoError::Count { claimed: 5, possible: 4, .. }), "{e}");
    assert!(matches!(with(|g| g["accessors"][0]["count"] = json!(2)), IoError::Syntax { .. }));
    assert!(matches!(with(|g| g["accessors"][0]["byteOffset"] = json!(u64::MAX)), IoError::Syntax { .. }));
    assert!(matches!(with(|g| g["bufferViews"][0]["byteLength"] = json!(u64::MAX)), IoError::Syntax { .. }));
    assert!(matches!(with(|g| g["bufferViews"][0]["byteStride"] = json!(1)), IoError::Syntax { .. }));
    assert!(matches!(with(|g| g["accessors"][0]["type"] = json!("MAT4")), IoError::Syntax { .. }));
    assert!(matches!(with(|g| g["buffers"][0]["uri"] = json!("../secret.bin")), IoError::Outside { .. }));
    assert!(matches!(with(|g| g["buffers"][0]["uri"] = json!("data:;base64,???")), IoError::Syntax { .. }));
    let kernel =
        with(|g| g["meshes"][0]["primitives"][0]["extensions"]["KHR_gaussian_splatting"]["kernel"] = json!("box"));
    assert!(matches!(&kernel, IoError::Unsupported { what, .. } if what.contains("box")), "{kernel}");
    let none = with(|g| g["meshes"][0]["primitives"][0]["extensions"] = json!({}));
    assert!(matches!(&none, IoError::Unsupported { remedy, .. } if remedy.contains("synth")), "{none}");
}

#[test]
fn what_is_written_comes_back_with_its_origin_and_its_extras() {
    for degree in 0..=3 {
        let extra = |name: &str, from: f32| ExtraProperty {
            name: name.into(),
            values: (0..5_000).map(|i| from + i as f32).collect(),
        };
        let cloud = GaussianCloud {
            origin: glam::DVec3::new(1e6 + 0.1, -3.5, 0.0),
            extras: vec![extra("confidence", 0.5), extra("fmlgs_identity", 0.0)],
            ..test_clouds::random(5_000, degree)
        };
        let (mut binary, mut text) = (Vec::new(), Vec::new());
        encode_binary(&mut binary, &cloud, &mut |_| Ok(())).expect("glb");
        encode_text(&mut text, &cloud, &mut |_| Ok(())).expect("gltf");
        let back = [&binary, &text].map(|bytes| parse(bytes, Path::new("a.glb")).expect("valid"));
        test_clouds::assert_near(&back[0], &cloud, [1e-6, 2e-6, 1e-6, 1e-6, 0.0]);
        assert_eq!(back[0].extras, cloud.extras);
        assert!(back[0] == back[1], "the text holds the same");
        let u32_at =
            |at: usize| u32::from_le_bytes([binary[at], binary[at + 1], binary[at + 2], binary[at + 3]]) as usize;
        assert_eq!((u32_at(8), (20 + u32_at(12)) % 4), (binary.len(), 0));
    }
}

#[test]
fn attributes_that_are_no_numbers_or_have_taken_names_are_left_out() {
    let mut g = gltf();
    let attributes = g["meshes"][0]["primitives"][0]["attributes"].as_object_mut().expect("object");
    for (name, accessor) in [("_mine", 3), ("_x", 3), ("_vector", 0), ("_two words", 3)] {
        attributes.insert(name.into(), json!(accessor));
    }
    let c = read_json(&g).expect("read");
    assert_eq!(c.extras, [ExtraProperty { name: "mine".into(), values: vec![0.75] }]);
}
