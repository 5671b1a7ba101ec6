//! Photos, ids and depth compared with exact geometry.

mod dataset;
mod node_levels;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use glam::{DVec2, DVec3, Vec3};
use serde_json::{Value, json};

use super::*;
use crate::io::gltf_mesh::tests::{cubes, glb, real_scenes};
use crate::pipeline::observer::Silent;
use crate::pipeline::observer::testing::StopsAfter;
use crate::scene::Camera;
use crate::scene::Level;

/// Scene of two cubes: a small one in front of a larger one, as two objects.
fn two_cubes() -> MeshScene {
    let nodes = json!([
        { "name": "large", "mesh": 0, "translation": [0.3, 0.2, -0.4] },
        { "name": "small", "mesh": 0, "scale": [0.4, 0.4, 0.4], "translation": [-0.2, 0.1, 0.9] },
    ]);
    let (root, bin) = cubes(nodes, json!([0, 1]), json!([]));
    gltf_mesh::read_slice(&glb(&root, &bin), "two.glb").unwrap()
}

const BOXES: [(DVec3, f64); 2] = [(DVec3::new(0.3, 0.2, -0.4), 0.5), (DVec3::new(-0.2, 0.1, 0.9), 0.2)];

fn stage_of(scene: &MeshScene) -> view::SynthScene {
    stage(scene, &levels::identities(scene, Levels::Nodes, "test").unwrap()).unwrap()
}

fn small() -> SynthOptions {
    SynthOptions { views: 6, held_out: 2, width_px: 64, height_px: 48, samples: 2, points: 300, ..Default::default() }
}

/// Id and depth of the nearest box along a ray of unit depth, by slabs, and the ray's distance from any edge of an
/// outline.
fn exact(camera: &Camera, direction: DVec3, shift: DVec3) -> (u16, f64, f64) {
    let (mut best, mut margin) = ((0, f64::INFINITY), f64::INFINITY);
    for (i, (middle, half)) in BOXES.iter().enumerate() {
        let a = (*middle + shift - camera.center - DVec3::splat(*half)) / direction;
        let b = (*middle + shift - camera.center + DVec3::splat(*half)) / direction;
        let (enter, leave) = (a.min(b).max_element(), a.max(b).min_element());
        margin = margin.min((leave - enter).abs());
        if leave > enter && enter < best.1 {
            best = (i as u16 + 1, enter);
        }
    }
    if best.0 == 0 { (0, 0.0, margin) } else { (best.0, best.1, margin) }
}

/// Counts the pixels whose id or depth differs from the exact scene shifted by `shift`, and all compared pixels.
fn mismatches(shift: DVec3) -> (usize, usize) {
    let stage = stage_of(&two_cubes());
    let (mut wrong, mut compared) = (0, 0);
    for eye in [DVec3::new(0.5, 1.0, 4.0), DVec3::new(-3.0, 2.0, 2.0), DVec3::new(0.1, 3.5, 0.7)] {
        let camera = Camera::look_at(eye, DVec3::new(0.1, 0.1, 0.1), DVec3::Y, 0.7, 160, 120).unwrap();
        let view = stage.render(&camera, 0, &SynthOptions { samples: 1, ..small() });
        for (i, (&id, &depth)) in view.object.iter().zip(&view.depth).enumerate() {
            let at = DVec2::new((i % 160) as f64 + 0.5, (i / 160) as f64 + 0.5);
            let (expected, exact_depth, margin) = exact(&camera, camera.ray(at), shift);
            if margin > 1e-3 {
                compared += 1;
                wrong += usize::from(id != expected || (f64::from(depth) - exact_depth).abs() > 2e-5);
            }
        }
    }
    (wrong, compared)
}

#[test]
fn ids_and_depth_of_boxes_are_exact() {
    let (wrong, compared) = mismatches(DVec3::ZERO);
    assert!(compared > 57_000, "{compared}");
    assert_eq!(wrong, 0, "of {compared}");
    // Negative control: the same check sees a shift of a thousandth of the scene.
    let (wrong, _) = mismatches(DVec3::new(0.001, 0.0, 0.0));
    assert!(wrong > 500, "{wrong}");
}

#[test]
fn no_ray_slips_through_an_edge_or_along_an_axis() {
    let (root, bin) = cubes(json!([{ "mesh": 0 }]), json!([0]), json!([]));
    let stage = stage_of(&gltf_mesh::read_slice(&glb(&root, &bin), "t.glb").unwrap());
    let steps = 64;
    for i in 1..steps {
        for j in 1..steps {
            // Multiples of a 64th meet the edges of the split faces exactly.
            let (u, v) = (f64::from(i) / f64::from(steps) - 0.5, f64::from(j) / f64::from(steps) - 0.5);
            for [from, to] in [
                [DVec3::new(u, v, 2.0), DVec3::NEG_Z],
                [DVec3::new(2.0, u, v), DVec3::NEG_X],
                [DVec3::new(u, -2.0, v), DVec3::Y],
                [DVec3::new(u, v, 2.0), DVec3::new(1e-5, -0.0, -1.0)],
            ] {
                let hit = stage.tracer.nearest(stage.surface.local(from), to.as_vec3a(), 0.0);
                let t = hit.map(|h| f64::from(h.t) * stage.surface.unit);
                assert!(t.is_some_and(|t| (t - 1.5).abs() < 1e-5), "{from} {to}: {t:?}");
            }
        }
    }
    assert!(stage.tracer.nearest(stage.surface.local(DVec3::new(0.51, 0.0, 2.0)), glam::Vec3A::NEG_Z, 0.0).is_none());
}

#[test]
fn anti_aliasing_covers_edges_by_area() {
    // An unlit black cube on white: a pixel's value tells how much of it the cube covers.
    let black = json!([{ "pbrMetallicRoughness": { "baseColorFactor": [0, 0, 0, 1] }, "extensions": { "KHR_materials_unlit": {} } }]);
    let (root, bin) = cubes(json!([{ "mesh": 0 }]), json!([0]), black);
    let scene = gltf_mesh::read_slice(&glb(&root, &bin), "t.glb").unwrap();
    let stage = stage_of(&scene);
    let camera = Camera::look_at(DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, DVec3::Y, 0.5, 41, 41).unwrap();
    let options = SynthOptions { samples: 8, background: [255; 3], ..small() };
    let covered = |stage: &view::SynthScene| -> f64 {
        let view = stage.render(&camera, 0, &options);
        view.rgb.iter().map(|p| 1.0 - f64::from(crate::math::srgb::linear(f32::from(p[0]) / 255.0))).sum()
    };
    let side = camera.focal_px.x / 3.5;
    let (found, exact) = (covered(&stage), side * side);
    assert!((found / exact - 1.0).abs() < 0.003, "{found} of {exact} px");
}

/// A square from (0, 0) to (1, 1) at z = 0 facing +z with a 2 x 2 texture, unlit.
fn textured_square(info: Value, sampler: Value) -> MeshScene {
    let mut bin = Vec::new();
    for (x, y) in [(0.0_f32, 0.0_f32), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
        bin.extend([x, y, 0.0].iter().flat_map(|v| v.to_le_bytes()));
    }
    for (u, v) in [(0.0_f32, 1.0_f32), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)] {
        bin.extend([u, v].iter().flat_map(|v| v.to_le_bytes()));
    }
    bin.extend([0_u8, 1, 2, 0, 2, 3, 0, 0]);
    let mut png = std::io::Cursor::new(Vec::new());
    let texels = [[250, 10, 20, 255], [30, 200, 40, 255], [50, 60, 180, 255], [128, 128, 128, 0]];
    let image = image::RgbaImage::from_raw(2, 2, texels.concat()).unwrap();
    image.write_to(&mut png, image::ImageFormat::Png).unwrap();
    let (at, length) = (bin.len(), png.get_ref().len());
    bin.extend(png.into_inner());
    let root = json!({
        "asset": { "version": "2.0" }, "scenes": [{ "nodes": [0] }], "nodes": [{ "name": "square", "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_1": 1 }, "indices": 2, "material": 0 }] }],
        "materials": [{ "alphaMode": "MASK", "pbrMetallicRoughness": { "baseColorTexture": info },
            "extensions": { "KHR_materials_unlit": {} } }],
        "textures": [{ "source": 0, "sampler": 0 }], "samplers": [sampler],
        "images": [{ "bufferView": 3, "mimeType": "image/png" }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2" },
            { "bufferView": 2, "componentType": 5121, "count": 6, "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": 48 }, { "buffer": 0, "byteOffset": 48, "byteLength": 32 },
            { "buffer": 0, "byteOffset": 80, "byteLength": 6 }, { "buffer": 0, "byteOffset": at, "byteLength": length },
        ],
        "buffers": [{ "byteLength": bin.len() }],
    });
    gltf_mesh::read_slice(&glb(&root, &bin), "square.glb").unwrap()
}

/// Colors in the middle of the square's quarters: top left, top right, bottom left, bottom right.
fn quarters(scene: &MeshScene) -> [[u8; 3]; 4] {
    let stage = stage_of(scene);
    let camera = Camera::look_at(DVec3::new(0.5, 0.5, 2.0), DVec3::new(0.5, 0.5, 0.0), DVec3::Y, 0.6, 80, 80).unwrap();
    let view = stage.render(&camera, 0, &SynthOptions { background: [9, 9, 9], ..small() });
    [(0.25, 0.75), (0.75, 0.75), (0.25, 0.25), (0.75, 0.25)].map(|(x, y)| {
        let p = camera.project(DVec3::new(x, y, 0.0)).unwrap();
        view.rgb[p.y as usize * 80 + p.x as usize]
    })
}

#[test]
fn textures_keep_their_srgb_values_and_transform() {
    let (red, green, blue, hole) = ([250, 10, 20], [30, 200, 40], [50, 60, 180], [9, 9, 9]);
    let nearest = json!({ "magFilter": 9728 });
    let plain = textured_square(json!({ "index": 0, "texCoord": 1 }), nearest.clone());
    // The last texel has no alpha, so the background shows through the mask.
    assert_eq!(quarters(&plain), [red, green, blue, hole]);
    let shifted = |transform: Value, sampler: &Value| {
        let info = json!({ "index": 0, "texCoord": 1, "extensions": { "KHR_texture_transform": transform } });
        quarters(&textured_square(info, sampler.clone()))
    };
    assert_eq!(shifted(json!({ "offset": [0.5, 0.0] }), &nearest), [green, red, hole, blue]);
    assert_eq!(shifted(json!({ "scale": [-1.0, 1.0] }), &nearest), [green, red, hole, blue]);
    // The set that the transform names wins: set 0 is absent, so everything is one texel.
    let [a, b, c, d] = shifted(json!({ "texCoord": 0 }), &nearest);
    assert!(a == b && b == c && c == d);
    let clamp = json!({ "magFilter": 9728, "wrapS": 33071, "wrapT": 33071 });
    assert_eq!(shifted(json!({ "offset": [0.5, 0.0] }), &clamp), [green, green, hole, hole]);
    let mirror = json!({ "magFilter": 9728, "wrapS": 33648, "wrapT": 33648 });
    assert_eq!(shifted(json!({ "offset": [1.0, 0.0] }), &mirror), [green, red, hole, blue]);
}

#[test]
fn light_is_brightest_from_above_and_shadows_fall() {
    // A plate with a cube over its middle: below the cube it is darker than at its corners.
    let nodes = json!([
        { "name": "plate", "mesh": 0, "scale": [4, 0.1, 4], "translation": [0, -1.0, 0] },
        { "name": "cube", "mesh": 0 },
    ]);
    let (root, bin) = cubes(nodes, json!([0, 1]), json!([]));
    let stage = stage_of(&gltf_mesh::read_slice(&glb(&root, &bin), "t.glb").unwrap());
    let light = |p: DVec3, normal: Vec3| {
        let from = stage.surface.local(p + normal.as_dvec3() * 0.02);
        let hit = stage.tracer.nearest(from, -normal.to_vec3a(), 0.0).unwrap();
        let triangle = &stage.surface.triangles[hit.triangle];
        stage.light.at(stage.lit(), triangle, hit.weights, true).0.element_sum()
    };
    let corner = light(DVec3::new(1.8, -0.95, 1.8), Vec3::Y);
    let below = light(DVec3::new(0.0, -0.95, 0.0), Vec3::Y);
    let underside = light(DVec3::new(0.0, -0.5, 0.0), Vec3::NEG_Y);
    assert!(below < 0.6 * corner && underside < 0.6 * corner, "{below} {underside} {corner}");
    assert!(below > 0.05 && (1.5..=3.3).contains(&corner), "{below} {corner}");
}

#[test]
fn noise_moves_points_by_its_size() {
    let stage = stage_of(&two_cubes());
    let camera = Camera::look_at(DVec3::new(0.5, 1.0, 4.0), DVec3::ZERO, DVec3::Y, 0.7, 64, 48).unwrap();
    let options = |noise| SynthOptions { point_noise_px: noise, ..small() };
    let view = stage.render(&camera, 0, &options(0.0));
    let exact = points::sample(&view, &camera, 0, 400, &options(0.0));
    let noisy = points::sample(&view, &camera, 0, 400, &options(1.5));
    let offsets = exact.iter().zip(&noisy).map(|(a, b)| {
        let d = camera.camera_from_world(a.position).z;
        (b.position - a.position).x / d * camera.focal_px.y
    });
    assert_eq!((exact.len(), noisy.len()), (400, 400));
    let sigma = (offsets.map(|o| o * o).sum::<f64>() / 400.0).sqrt();
    assert!((1.3..1.7).contains(&sigma), "{sigma} px");
}

#[test]
fn a_scene_without_area_is_refused() {
    let (root, bin) = cubes(json!([{ "mesh": 0, "scale": [0, 0, 0] }]), json!([0]), json!([]));
    let scene = gltf_mesh::read_slice(&glb(&root, &bin), "t.glb").unwrap();
    let identities = levels::identities(&scene, Levels::Nodes, "t").unwrap();
    assert!(matches!(stage(&scene, &identities), Err(SynthError::Empty)));
}

#[test]
fn transforms_that_overflow_are_refused() {
    let with_last = |scale: f64| {
        let nest = |i: usize| json!({ "scale": [1e38, 1e38, 1e38], "children": [i + 1] });
        let mut nodes: Vec<Value> = (0..8).map(nest).collect();
        nodes.push(json!({ "mesh": 0, "scale": [scale, scale, scale] }));
        let (root, bin) = cubes(nodes.into(), json!([0]), json!([]));
        gltf_mesh::read_slice(&glb(&root, &bin), "t.glb")
    };
    // 1e304 times 1e5 is no number; a thousandth of that is one, but has no square.
    assert!(with_last(1e5).unwrap_err().to_string().contains("nodes[8]: its transform is not finite"));
    let scene = with_last(1e2).unwrap();
    let identities = levels::identities(&scene, Levels::Nodes, "t").unwrap();
    assert!(matches!(stage(&scene, &identities), Err(SynthError::Empty)));
}

#[test]
fn mutated_files_never_panic() {
    let (root, bin) =
        cubes(json!([{ "name": "a", "mesh": 0, "children": [1] }, { "mesh": 0 }]), json!([0]), json!([{}]));
    let whole = glb(&root, &bin);
    let mut rng = Pcg32::seed_from_u64(5);
    let (mut read, mut staged) = (0, 0);
    for _ in 0..1000 {
        let mut bytes = whole.clone();
        for _ in 0..rng.random_range(1..4) {
            let at = rng.random_range(0..bytes.len());
            // Digits in the JSON part stay digits now and then, so that it still parses.
            bytes[at] = if bytes[at].is_ascii_digit() { rng.random_range(b'0'..=b'9') } else { rng.random::<u8>() };
        }
        let Ok(scene) = gltf_mesh::read_slice(&bytes, "mutated.glb") else { continue };
        read += 1;
        let Ok(identities) = levels::identities(&scene, Levels::Nodes, "mutated") else { continue };
        staged += usize::from(read % 8 == 0 && stage(&scene, &identities).is_ok());
    }
    assert!(read > 40 && staged > 3, "{read} of 1000 were read, {staged} made ready");
}

#[test]
fn scenes_far_away_and_tiny_are_as_exact() {
    let nodes = json!([{ "mesh": 0, "translation": [1e6, 0, 0], "scale": [0.001, 0.001, 0.001] }]);
    let (root, bin) = cubes(nodes, json!([0]), json!([]));
    let stage = stage_of(&gltf_mesh::read_slice(&glb(&root, &bin), "t.glb").unwrap());
    let middle = DVec3::new(1e6, 0.0, 0.0);
    let camera = Camera::look_at(middle + DVec3::new(0.0, 0.0, 0.004), middle, DVec3::Y, 0.5, 33, 33).unwrap();
    let view = stage.render(&camera, 0, &small());
    assert!((f64::from(view.depth[16 * 33 + 16]) / 0.0035 - 1.0).abs() < 1e-5);
    assert_eq!(view.object[0], 0);
}

#[test]
fn real_scenes_are_rendered() {
    let Some(folder) = real_scenes() else { return };
    let options = SynthOptions { views: 3, held_out: 1, ..small() };
    for file in
        ["CesiumMilkTruck/CesiumMilkTruck.glb", "SheenChair/SheenChair.gltf", "kenney_vehicles/vehicle-truck-red.glb"]
    {
        let out = tempfile::tempdir().unwrap();
        let report = run(&folder.join(file), &options, out.path(), &mut Silent).unwrap();
        let seen: u64 = report.identities.iter().filter(|i| i.level == Level::Object).map(|i| i.pixels).sum();
        let share = seen as f64 / (3.0 * 64.0 * 48.0);
        assert!((0.12..0.8).contains(&share), "{file}: {share} of the pictures show the scene");
    }
}

#[test]
fn the_demo_shows_every_thing_and_part() {
    let out = tempfile::tempdir().unwrap();
    let options = SynthOptions { width_px: 160, height_px: 120, samples: 1, points: 500, ..demo::demo_options() };
    let scene = gltf_mesh::read_slice(demo_glb(), "demo.glb").unwrap();
    let report = render_scene(&scene, "demo", None, &options, out.path(), &mut Silent).unwrap();
    assert!(report.warnings.is_empty());
    for identity in &report.identities {
        let enough = if identity.level == Level::Object { 40 } else { 4 };
        assert!(identity.views >= enough, "{} is seen in {} of 64 photos", identity.path, identity.views);
    }
    assert!(!demo::demo_is_written(out.path(), &demo::demo_options()), "other settings than the demo's");
}

#[test]
fn slivers_do_not_fall_into_pieces_without_end() {
    let triangles = |scale: f64| {
        let (root, bin) = cubes(json!([{ "name": "bar", "mesh": 0, "scale": [scale, 1, 1] }]), json!([0]), json!([]));
        stage_of(&gltf_mesh::read_slice(&glb(&root, &bin), "bar.glb").unwrap()).surface.triangles.len()
    };
    assert_eq!(triangles(1e6), 2 * 6, "nobody sees how light changes along it");
    let (cube, bar) = (triangles(1.0), triangles(100.0));
    assert!(cube > 10_000 && bar > 10_000 && bar < 400_000, "control: {cube}, {bar}");
}
