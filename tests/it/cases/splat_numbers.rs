//! Numbers of splats and points: far from zero, not finite, in other types and names; SPZ within glTF.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use fmlgs::io::{self, Opened};
use fmlgs::scene::GaussianCloud;
use glam::DVec3;
use serde_json::{Value, json};

use crate::cases::splats::{cloud, errors, near, splat, text};
use crate::cli_support::{fmlgs, folder};
use crate::common::case;

/// The constant harmonic.
const SH_C0: f64 = 0.282_094_791_773_878_14;

/// Distinct values of x, y and z of a little-endian `.ply` of floats, as any other reader finds them.
fn distinct(path: &Path) -> ([usize; 3], Vec<[f32; 3]>) {
    let bytes = fs::read(path).unwrap();
    let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let header = String::from_utf8_lossy(&bytes[..end]).into_owned();
    let stride = 4 * header.matches("property float").count();
    let float = |row: &[u8], k: usize| f32::from_le_bytes(row[4 * k..4 * k + 4].try_into().unwrap());
    let rows: Vec<[f32; 3]> = bytes[end..].chunks_exact(stride).map(|row| [0, 1, 2].map(|k| float(row, k))).collect();
    let count = |k: usize| rows.iter().map(|p| p[k].to_bits()).collect::<BTreeSet<_>>().len();
    ([0, 1, 2].map(count), rows)
}

#[test]
fn scenes_far_from_zero_are_exported_near_it_and_put_back() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let place = DVec3::new(456_789.0, 5_678_901.0, 312.0);
    let utm = splat(&at("utm.ply"), "", |[x, y, z]| [x + place.x, y + place.y, z + place.z]);
    let scene = cloud(&utm);
    for (name, kept, most) in [
        ("a.ply", true, 1e-6),
        ("a.compressed.ply", true, 3e-3),
        ("a.spz", true, 1e-5),
        ("a.sog", true, 1e-3),
        ("sog/meta.json", true, 1e-3),
        ("a.splat", false, 1e-6),
    ] {
        let done = fmlgs(&["export", text(&utm), "--out", text(&at(name)), "--json", "-q"]).ok().json();
        let told = DVec3::from_array([0, 1, 2].map(|k| done["shift"][k].as_f64().unwrap()));
        assert!((told - place).length() < 4.0, "{name}: {done}");
        let back = cloud(&at(name));
        let (back, degree) = match kept {
            true => (back, scene.sh_degree),
            // A format without room for it says so.
            false => {
                assert!(done["left_out"].to_string().contains("where zero is"), "{done}");
                (GaussianCloud { origin: told, ..back }, 0)
            }
        };
        assert!(back.origin == told && back.sh_degree == degree, "{name}");
        let far = |i: usize| {
            let all = (0..24).map(|j| back.world_position(j).distance(scene.world_position(i)));
            all.fold(f64::INFINITY, f64::min)
        };
        let worst = (0..24).map(far).fold(0.0, f64::max);
        assert!(worst < most, "{name}: {worst}");
    }
    let (counts, rows) = distinct(&at("a.ply"));
    assert_eq!(counts, [24; 3], "no stripes");
    assert!(rows.iter().flatten().all(|v| v.abs() < 10.0), "near zero");
    let told = fmlgs(&["export", text(&utm), "--out", text(&at("b.ply")), "-q"]).ok().stdout;
    assert!(
        told.contains("shifted: places are relative to (4567") && told.contains("add that to put them back"),
        "{told}"
    );
    // Nodes of glTF hold the place as it is; and near zero nothing is shifted.
    let glb = fmlgs(&["export", text(&utm), "--out", text(&at("a.glb")), "--json", "-q"]).ok().json();
    assert!(glb["shift"].is_null() && near(&cloud(&at("a.glb")), &scene, [1e-6; 3]), "{glb}");
    let close = splat(&at("close.ply"), "", |p| p);
    let done = fmlgs(&["export", text(&close), "--out", text(&at("c.ply")), "--json", "-q"]).ok().json();
    assert!(done["shift"].is_null(), "{done}");
    // A comment that lies is named.
    let lie = fs::read_to_string(&utm).unwrap().replace("element", "comment fmlgs shift 1 2\nelement");
    fs::write(at("lie.ply"), lie).unwrap();
    assert!(io::open(&at("lie.ply")).expect_err("two numbers").to_string().contains("fmlgs shift"));
}

#[test]
fn a_trained_scene_at_utm_coordinates_exports_without_stripes() {
    let Some(case) = case("08_utm") else { return };
    let folder = folder();
    let [scene, out] = ["scene", "a.ply"].map(|name| folder.path().join(name));
    fmlgs(&["train", text(&case), "--out", text(&scene), "--steps", "2", "--no-densify", "-q"]).ok();
    let done = fmlgs(&["export", text(&scene), "--out", text(&out), "--json", "-q"]).ok().json();
    assert!((done["shift"][1].as_f64().unwrap() - 5_678_901.0).abs() < 100.0, "{done}");
    let (counts, rows) = distinct(&out);
    assert!(counts.iter().all(|n| *n > rows.len() * 9 / 10), "{counts:?} of {}", rows.len());
    let (a, b) = (cloud(&scene.join("point_cloud.ply")), cloud(&out));
    let most = (0..a.len()).map(|i| a.world_position(i).distance(b.world_position(i))).fold(0.0, f64::max);
    assert!(most < 1e-4, "{most}");
}

#[test]
fn points_start_in_the_color_that_they_have() {
    let Some(case) = case("09_float_colors") else { return };
    let folder = folder();
    let scene = folder.path().join("scene");
    fmlgs(&["train", text(&case), "--out", text(&scene), "--steps", "1", "--no-densify", "-q"]).ok();
    let c = cloud(&scene.join("point_cloud.ply"));
    // Those of the points come first; the others fill what photos show where no point is.
    let (stride, points) = (c.sh_stride(), 400);
    assert!(c.len() >= points, "{}", c.len());
    for (k, want) in [0.54, 0.53, 0.54].into_iter().enumerate() {
        let own = c.sh.iter().step_by(stride).take(points);
        let mean = own.map(|sh| 0.5 + SH_C0 * f64::from(sh[k])).sum::<f64>() / points as f64;
        // Cut at white, it would be over 0.9.
        assert!((mean - want).abs() < 0.01, "{k}: {mean}");
    }
}

/// A splat of two Gaussians with other properties for the colors and the opacity.
fn other(path: &Path, format: &str, properties: &str, rows: [&[f64]; 2]) -> GaussianCloud {
    let names = format!(
        "double x,double y,double z,float scale_0,float scale_1,float scale_2,float rot_0,float rot_1,float rot_2,float rot_3,{properties}"
    );
    let mut file = format!("ply\nformat {format} 1.0\ncomment by hand\nelement vertex 2\n").into_bytes();
    names.split(',').for_each(|name| file.extend(format!("property {name}\n").as_bytes()));
    file.extend(b"end_header\n");
    for (i, more) in rows.into_iter().enumerate() {
        let base = [i as f64, 2.0, 3.0, -2.0, -2.0, -2.0, 1.0, 0.0, 0.0, 0.0];
        for (v, name) in base.iter().chain(more).zip(names.split(',')) {
            match (format, name.split(' ').next()) {
                ("ascii", _) => file.extend(format!("{v} ").as_bytes()),
                (_, Some("double")) => file.extend(v.to_be_bytes()),
                (_, Some("uchar")) => file.push(*v as u8),
                (_, Some("ushort")) => file.extend((*v as u16).to_be_bytes()),
                _ => file.extend((*v as f32).to_be_bytes()),
            }
        }
        if format == "ascii" {
            file.push(b'\n');
        }
    }
    fs::write(path, file).unwrap();
    cloud(path)
}

#[test]
fn gaussians_with_plain_colors_open() {
    let folder = folder();
    let at = folder.path().join("a.ply");
    for format in ["ascii", "binary_big_endian"] {
        for (properties, rows) in [
            ("float opacity,uchar red,uchar green,uchar blue", [&[1.5, 51.0, 102.0, 255.0][..], &[1.5, 0.0, 0.0, 9.0]]),
            ("float red,float green,float blue,float opacity", [&[0.2, 0.4, 1.0, 1.5], &[0.0, 0.0, 0.1, 1.5]]),
            ("float opacity,float red,float green,float blue", [&[1.5, 51.0, 102.0, 255.0], &[1.5, 0.0, 0.0, 9.0]]),
            ("float opacity,double r,double g,double b", [&[1.5, 0.2, 0.4, 1.0], &[1.5, 0.0, 0.0, 0.1]]),
            (
                "float opacity,ushort red,ushort green,ushort blue",
                [&[1.5, 13107.0, 26214.0, 65535.0], &[1.5, 0.0, 0.0, 9.0]],
            ),
            (
                "uchar diffuse_red,uchar diffuse_green,uchar diffuse_blue,float opacity",
                [&[51.0, 102.0, 255.0, 1.5], &[0.0, 0.0, 9.0, 1.5]],
            ),
            ("uchar red,uchar green,uchar blue,uchar alpha", [&[51.0, 102.0, 255.0, 209.0], &[0.0, 0.0, 9.0, 209.0]]),
        ] {
            let c = other(&at, format, properties, rows);
            let color = c.sh[0].map(|v| 0.5 + SH_C0 * f64::from(v));
            assert!(
                color.iter().zip([0.2, 0.4, 1.0]).all(|(a, b)| (a - b).abs() < 1e-4),
                "{format} {properties}: {color:?}"
            );
            assert!(
                (c.opacity_logits[0] - 1.5).abs() < 0.02 && c.world_position(1) == DVec3::new(1.0, 2.0, 3.0),
                "{properties}"
            );
            assert!(c.sh_degree == 0 && c.extras.iter().all(|e| e.name == "alpha"), "{properties}");
        }
    }
    // Without any color there is nothing to see: points.
    other(&at, "ascii", "float opacity,uchar red,uchar green,uchar blue", [&[1.0; 4]; 2]);
    fs::write(&at, fs::read_to_string(&at).unwrap().replace(" red", " reddish")).unwrap();
    assert!(io::open(&at).expect_err("no color").to_string().contains("f_dc_0"));
}

#[test]
fn gaussians_that_are_not_finite_are_left_out_counted_and_told() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let few = splat(&at("few.ply"), "", |p| p);
    for name in ["a.ply", "a.splat", "a.glb"] {
        fmlgs(&["export", text(&few), "--out", text(&at(name)), "--no-measure", "-q"]).ok();
    }
    // Places of numbers in the files: the first Gaussian's x, the third's scale.
    let (ply, splat_file, glb) =
        (fs::read(at("a.ply")).unwrap(), fs::read(at("a.splat")).unwrap(), fs::read(at("a.glb")).unwrap());
    let ply_start = ply.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let glb_start = 28 + u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let stride = (ply.len() - ply_start) / 24;
    for (name, bytes, places) in [
        ("a.ply", &ply, [ply_start, ply_start + 2 * stride + 4 * 20]),
        ("a.splat", &splat_file, [0, 2 * 32 + 12]),
        ("a.glb", &glb, [glb_start, glb_start + 2 * 12 + 4]),
    ] {
        let mut bad = bytes.clone();
        for (at, v) in places.into_iter().zip([f32::NAN, f32::INFINITY]) {
            bad[at..at + 4].copy_from_slice(&v.to_le_bytes());
        }
        fs::write(at(name), bad).unwrap();
        let c = cloud(&at(name));
        assert_eq!(c.len(), 22, "{name}");
        c.validate().unwrap();
        let told = "2 of 24 Gaussians are left out";
        let info = fmlgs(&["info", text(&at(name)), "--json"]).ok().json();
        assert!(info["gaussians"] == 22 && info["warnings"].to_string().contains(told), "{name}: {info}");
        let out = at("a.png");
        let drawn = fmlgs(&["render", text(&at(name)), "--size", "32x24", "--out", text(&out), "-q"]).ok();
        assert!(drawn.stderr.contains(told) && drawn.stderr.contains("first: Gaussian 0"), "{}", drawn.stderr);
    }
    // Nothing is left: an error that says how many there were.
    let mut bad = splat_file[..64].to_vec();
    (0..2).for_each(|i| bad[32 * i..32 * i + 4].copy_from_slice(&f32::NAN.to_le_bytes()));
    fs::write(at("none.splat"), bad).unwrap();
    let e = io::open(&at("none.splat")).expect_err("none").to_string();
    assert!(e.contains("none of its 2 Gaussians is finite"), "{e}");
    // Infinite opacities are no reason: other programs make them of 0 and 1.
    let open = fs::read_to_string(&few).unwrap().replace(" 1.5 -2 ", " inf -2 ");
    fs::write(at("open.ply"), open).unwrap();
    assert!(cloud(&at("open.ply")).len() == 24 && cloud(&at("open.ply")).warnings.is_empty());
}

/// A glTF with an SPZ in a buffer view, under one of the extension's names.
fn glb_of_spz(spz: &[u8], within: Option<&str>, beside: Option<&str>, view: Value) -> Vec<u8> {
    let mut extensions =
        json!({ "KHR_gaussian_splatting": { "kernel": "ellipse", "colorSpace": "srgb_rec709_display" } });
    if let Some(name) = within {
        extensions["KHR_gaussian_splatting"] = json!({ "extensions": { name: view } });
    } else if let Some(name) = beside {
        extensions[name] = view;
    }
    let accessor = |kind: &str| json!({ "componentType": 5126, "count": 24, "type": kind });
    let json = json!({
        "asset": { "version": "2.0" }, "extensionsUsed": ["KHR_gaussian_splatting"],
        "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0, "translation": [0, 10, 0] }],
        "meshes": [{ "primitives": [{ "mode": 0, "attributes": { "POSITION": 0, "COLOR_0": 1, "KHR_gaussian_splatting:SCALE": 0,
            "KHR_gaussian_splatting:ROTATION": 1 }, "extensions": extensions }] }],
        "accessors": [accessor("VEC3"), accessor("VEC4")],
        "bufferViews": [{ "buffer": 0, "byteLength": spz.len() }], "buffers": [{ "byteLength": spz.len() }],
    });
    let mut out = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    for (kind, data) in [(b"JSON", json.to_string().as_bytes()), (b"BIN\0", spz)] {
        out.extend((data.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(data);
    }
    out
}

#[test]
fn spz_within_gltf_is_read() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let few = splat(&at("few.ply"), "", |p| p);
    fmlgs(&["export", text(&few), "--out", text(&at("a.spz")), "--no-measure", "-q"]).ok();
    let (spz, plain) = (fs::read(at("a.spz")).unwrap(), cloud(&at("a.spz")));
    let read = |bytes: &[u8]| {
        fs::write(at("a.glb"), bytes).unwrap();
        match io::open(&at("a.glb")) {
            Ok(Opened::Cloud(c)) => Ok(c),
            Ok(other) => panic!("{other:?}"),
            Err(e) => Err(e.to_string()),
        }
    };
    for (within, beside) in [
        (Some("KHR_gaussian_splatting_compression_spz_2"), None),
        (Some("KHR_gaussian_splatting_compression_spz"), None),
        (None, Some("KHR_spz_gaussian_splats_compression")),
        (None, Some("KHR_spz_compression")),
    ] {
        let c = read(&glb_of_spz(&spz, within, beside, json!({ "bufferView": 0 }))).unwrap();
        // Ten units up are ten against y.
        let placed = GaussianCloud { origin: plain.origin + DVec3::new(0.0, -10.0, 0.0), ..plain.clone() };
        // A half turn of a Gaussian's own axes changes nothing but its quaternion.
        let found = errors(&placed, &c);
        assert!(found[0] < 1e-5 && found[2] < 1e-6 && c.warnings.is_empty(), "{found:?} {:?}", c.warnings);
    }
    let name = Some("KHR_gaussian_splatting_compression_spz_2");
    for (view, word) in [
        (json!({}), "no bufferView"),
        (json!({ "bufferView": 9 }), "bufferViews[9]"),
        (json!({ "bufferView": -1 }), "no bufferView"),
        (json!({ "bufferView": u64::MAX }), "bufferViews"),
    ] {
        let e = read(&glb_of_spz(&spz, name, None, view)).expect_err("refused");
        assert!(e.contains(word), "{e}");
    }
    read(&glb_of_spz(&spz[..spz.len() / 2], name, None, json!({ "bufferView": 0 }))).expect_err("cut off");
    read(&glb_of_spz(b"no splat at all.", name, None, json!({ "bufferView": 0 }))).expect_err("no SPZ");
}
