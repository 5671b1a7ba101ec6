//! Splats of other programs: axes, numbers, properties.

use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use fmlgs::io::{self, Opened};
use fmlgs::scene::{Axes, GaussianCloud, SplatRenderMode};
use glam::DVec3;
use image::RgbImage;

use crate::cli_support::{fmlgs, folder};
use crate::common::case;

pub fn cloud(path: &Path) -> GaussianCloud {
    match io::open(path) {
        Ok(Opened::Cloud(c)) => c,
        other => panic!("{}: {other:?}", path.display()),
    }
}

fn cloud_in(path: &Path, axes: &str) -> GaussianCloud {
    match io::open_in(path, Some(axes.parse().unwrap())) {
        Ok(Opened::Cloud(c)) => c,
        other => panic!("{}: {other:?}", path.display()),
    }
}

/// Largest errors of place, rotation (1 less the cosine of half the angle) and harmonics up to ±1, which SPZ cuts off:
/// each Gaussian of `a` against the nearest of `b`.
pub fn errors(a: &GaussianCloud, b: &GaussianCloud) -> [f64; 3] {
    assert_eq!((a.len(), a.sh_degree), (b.len(), b.sh_degree));
    let (mut most, stride) = ([0.0_f64; 3], a.sh_stride());
    for i in 0..a.len() {
        let far = |j: &usize| a.world_position(i).distance(b.world_position(*j));
        let j = (0..b.len()).min_by(|x, y| far(x).total_cmp(&far(y))).unwrap();
        let unit = |q: [f32; 4]| fmlgs::math::rotation::unit_quaternion(q).unwrap();
        let dot: f32 = unit(a.quaternions[i]).iter().zip(unit(b.quaternions[j])).map(|(p, q)| p * q).sum();
        let sh = |c: &GaussianCloud, i: usize| c.sh[i * stride..(i + 1) * stride].to_vec();
        let pairs = sh(a, i).into_iter().zip(sh(b, j)).skip(1);
        let cut = |v: f32| v.clamp(-1.0, 1.0);
        let bands = pairs.flat_map(|(p, q)| [0, 1, 2].map(|k| f64::from((cut(p[k]) - cut(q[k])).abs())));
        let found = [far(&j), f64::from(1.0 - dot.abs()), bands.fold(0.0, f64::max)];
        most.iter_mut().zip(found).for_each(|(m, f)| *m = m.max(f));
    }
    most
}

pub fn near(a: &GaussianCloud, b: &GaussianCloud, most: [f64; 3]) -> bool {
    errors(a, b).iter().zip(most).all(|(e, most)| *e <= most)
}

pub fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Picture that `fmlgs render` draws of a file, and its warnings.
fn picture(path: &Path, more: &[&str]) -> (RgbImage, String) {
    let folder = folder();
    let out = folder.path().join("a.png");
    let call = [&["render", text(path), "--size", "160x120", "--out", text(&out)], more].concat();
    let told = fmlgs(&call).ok().stderr;
    (image::open(&out).unwrap().to_rgb8(), told)
}

fn psnr(a: &RgbImage, b: &RgbImage) -> f64 {
    let squares = a.as_raw().iter().zip(b.as_raw()).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2));
    let error = squares.sum::<f64>() / a.as_raw().len() as f64;
    -10.0 * (error / 255.0_f64.powi(2)).log10()
}

#[test]
fn four_formats_of_one_scene_are_one_scene() {
    let Some(case) = case("07_same_scene_four_formats") else { return };
    let of = |ending: &str| case.join(format!("scene.{ending}"));
    let (scene, (first, _)) = (cloud(&of("ply")), picture(&of("ply"), &[]));
    for (ending, most, db) in
        [("sog", [1e-3, 1e-3, 2.0], 40.0), ("spz", [3e-4, 1e-4, 0.08], 40.0), ("glb", [1e-6, 1e-6, 1e-6], 60.0)]
    {
        let other = cloud(&of(ending));
        assert!(near(&scene, &other, most), "{ending}: {:?}", errors(&scene, &other));
        let db_found = psnr(&first, &picture(&of(ending), &[]).0);
        assert!(db_found > db, "{ending}: {db_found}");
    }
    // The SPZ does not say its axes, which is told; by other axes it is another scene.
    let (_, told) = picture(&of("spz"), &[]);
    assert!(told.contains("does not say its axes") && told.contains("--axes rdf"), "{told}");
    let (turned, told) = picture(&of("spz"), &["--axes", "rdf"]);
    assert!(psnr(&first, &turned) < 30.0 && !told.contains("axes"), "{told}");
    assert!(!near(&scene, &cloud_in(&of("spz"), "rdf"), [0.1, 1.0, 2.0]));
    let info = fmlgs(&["info", text(&of("spz")), "--json"]).ok().json();
    assert!(info["warnings"][0].as_str().unwrap().contains("right, up, back"), "{info}");
    assert_eq!(fmlgs(&["info", text(&of("glb")), "--json"]).ok().json()["warnings"], serde_json::json!([]));
    fmlgs(&["info", text(&of("glb")), "--axes", "rdd"]).fails_with(2);
}

/// A splat with harmonics as text, a few Gaussians with numbers of their own.
pub fn splat(path: &Path, comments: &str, turn: impl Fn([f64; 3]) -> [f64; 3]) -> PathBuf {
    let names: Vec<String> = "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3"
        .split(' ')
        .map(str::to_owned)
        .chain((0..9).map(|k| format!("f_rest_{k}")))
        .collect();
    let properties: String = names.iter().map(|n| format!("property double {n}\n")).collect();
    let mut out = format!("ply\nformat ascii 1.0\n{comments}element vertex 24\n{properties}end_header\n");
    for i in 0..24 {
        let t = f64::from(i);
        let [x, y, z] = turn([t.sin() * 1.5, (1.7 * t).cos(), 0.11 * t]);
        let rest: String = (0..9).map(|k| format!(" {:.3}", (t + f64::from(k)).sin() * 0.5)).collect();
        out += &format!("{x} {y} {z} {} 0.2 -0.3 1.5 -2 -2.2 -2.5 1 {} 0.3 {}{rest}\n", t / 24.0, 0.05 * t, -0.02 * t);
    }
    fs::write(path, out).unwrap();
    path.into()
}

fn exported(from: &Path, to: &Path) -> serde_json::Value {
    fmlgs(&["export", text(from), "--out", text(to), "--json", "-q"]).ok().json()
}

fn gunzip(path: &Path) -> Vec<u8> {
    let mut out = Vec::new();
    flate2::read::GzDecoder::new(&fs::read(path).unwrap()[..]).read_to_end(&mut out).unwrap();
    out
}

/// Packs the inside of an SPZ as another program would, by the operating system in its header.
fn gzip(path: &Path, bytes: &[u8], system: u8) {
    let file = fs::File::create(path).unwrap();
    let mut out = flate2::GzBuilder::new().operating_system(system).write(file, flate2::Compression::fast());
    out.write_all(bytes).unwrap();
    out.finish().unwrap();
}

#[test]
fn what_is_exported_is_turned_as_its_format_says_and_comes_back() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let few = splat(&at("few.ply"), "", |p| p);
    let scene = cloud(&few);
    for (name, most) in [
        ("a.ply", [1e-6, 1e-6, 1e-6]),
        ("a.glb", [1e-6, 1e-6, 1e-6]),
        ("a.gltf", [1e-6, 1e-6, 1e-6]),
        ("a.spz", [1e-6, 1e-5, 0.04]),
        ("a.sog", [1e-3, 1e-3, 2.0]),
        ("a.compressed.ply", [3e-3, 1e-4, 0.04]),
    ] {
        exported(&few, &at(name));
        let back = cloud(&at(name));
        assert!(near(&scene, &back, most) && back.warnings.is_empty(), "{name}: {:?}", errors(&scene, &back));
    }
    // SPZ holds right, up, back: the numbers of y and z have the other sign, as splat-transform 2.7.1 writes and reads.
    let inside = gunzip(&at("a.spz"));
    let step = (-f64::from(inside[13])).exp2();
    let number = |k: usize| f64::from(i32::from_le_bytes([0, inside[k], inside[k + 1], inside[k + 2]]) >> 8) * step;
    let first = DVec3::from_array([16, 19, 22].map(number));
    assert!((first - scene.world_position(0) * DVec3::new(1.0, -1.0, -1.0)).length() < 1e-5, "{first}");
    // glTF holds left, up, front.
    let json: serde_json::Value = serde_json::from_slice(&fs::read(at("a.gltf")).unwrap()).unwrap();
    let least = [0, 1, 2].map(|k| json["accessors"][0]["min"][k].as_f64().unwrap() as f32);
    let ends = |k: usize, end: fn(f32, f32) -> f32| scene.positions.iter().map(|p| p[k]).reduce(end).unwrap();
    assert_eq!(least, [-ends(0, f32::max), -ends(1, f32::max), ends(2, f32::min)]);
}

#[test]
fn an_spz_is_read_by_what_it_says_of_its_axes() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let few = splat(&at("few.ply"), "", |p| p);
    exported(&few, &at("a.spz"));
    let (scene, inside) = (cloud(&few), gunzip(&at("a.spz")));
    let same = |c: &GaussianCloud| near(&scene, c, [1e-5, 1e-5, 0.04]);
    let turned = |c: &GaussianCloud| c.world_position(3) * DVec3::new(1.0, -1.0, -1.0);
    // Another program's file without a word: as documented, and told.
    gzip(&at("other.spz"), &inside, 3);
    let other = cloud(&at("other.spz"));
    assert!(same(&other) && other.warnings.concat().contains("does not say its axes"), "{:?}", other.warnings);
    // What this program wrote before it turned axes: all bits used, "unknown" system, no comment.
    gzip(&at("before.spz"), &inside, 255);
    let before = cloud(&at("before.spz"));
    assert!(before.warnings.is_empty() && (turned(&before) - scene.world_position(3)).length() < 1e-5);
    // Records of extensions: Adobe's number of the axes, and one that nobody knows.
    for (number, letters) in [(4_u32, "rub"), (6, "rdf"), (7, "luf"), (12, "rfu"), (8, "ruf"), (0, "rub")] {
        let mut record = inside.clone();
        record[14] |= 2;
        for (kind, value) in [(0x1234_0001_u32, 7_u32), (0xADBE_0003, number)] {
            [kind, 4, value].iter().for_each(|v| record.extend(v.to_le_bytes()));
        }
        gzip(&at("record.spz"), &record, 3);
        let read = cloud(&at("record.spz"));
        assert_eq!(read.warnings.len(), 1, "{letters}: {:?}", read.warnings);
        assert!(read.warnings[0].contains("0x12340001 of 4 bytes is passed over"), "{:?}", read.warnings);
        let given = cloud_in(&at("other.spz"), letters);
        assert!((read.world_position(3) - given.world_position(3)).length() < 1e-9, "{letters}");
        assert_eq!(same(&read), letters == "rub", "{letters}");
    }
    // Harmonics of degree 4 are read up to 3, and that is told.
    let count = 24;
    let mut four = inside[..16 + 20 * count].to_vec();
    four[12] = 4;
    four.extend(vec![140_u8; 72 * count]);
    gzip(&at("four.spz"), &four, 3);
    let read = cloud(&at("four.spz"));
    assert!(
        read.sh_degree == 3 && read.warnings.iter().any(|w| w.contains("degree 4 are left out")),
        "{:?}",
        read.warnings
    );
}

#[test]
fn files_say_what_is_upwards() {
    if let Some(case) = case("10_vertical_axis") {
        let [z, y] = ["zup.ply", "ydown.ply"].map(|name| picture(&case.join(name), &[]).0);
        assert!(z == y, "{}", psnr(&z, &y));
    }
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let usual = splat(&at("usual.ply"), "", |p| p);
    let up = |path: &Path| {
        let info = fmlgs(&["info", text(path), "--json"]).ok().json();
        DVec3::from_array([0, 1, 2].map(|k| info["up"][k].as_f64().unwrap()))
    };
    assert_eq!(up(&usual), DVec3::NEG_Y);
    type Turn = fn([f64; 3]) -> [f64; 3];
    let cases: [(&str, DVec3, Turn); 4] = [
        ("comment Generated by Nerfstudio 1.1.5\ncomment Vertical Axis: z\n", DVec3::Z, |[x, y, z]| [x, z, -y]),
        ("comment Vertical Axis: y\n", DVec3::Y, |[x, y, z]| [x, -y, -z]),
        ("comment Exported from Brush\ncomment Vertical axis: y\n", DVec3::NEG_Y, |p| p),
        ("obj_info Vertical Axis: -z\n", DVec3::NEG_Z, |[x, y, z]| [x, -z, y]),
    ];
    for (k, (comments, upwards, turn)) in cases.into_iter().enumerate() {
        let file = splat(&at(&format!("{k}.ply")), comments, turn);
        assert_eq!(up(&file), upwards, "{comments}");
        // A .ply says it on; other formats are turned, so that the scene stands in every viewer.
        exported(&file, &at(&format!("{k}_again.ply")));
        assert_eq!(up(&at(&format!("{k}_again.ply"))), upwards, "{comments}");
        for ending in ["spz", "glb", "splat"] {
            let out = at(&format!("{k}.{ending}"));
            let told = exported(&file, &out);
            assert_eq!(told["turned_upright"], serde_json::json!(upwards != DVec3::NEG_Y), "{comments}");
            let (back, is) = (cloud(&out), cloud(&usual));
            let most = (0..24).map(|i| back.world_position(i).distance(is.world_position(i))).fold(0.0, f64::max);
            assert!(most < 1e-4 && up(&out) == DVec3::NEG_Y, "{comments}{ending}: {most}");
        }
    }
    assert_eq!(Axes::PLY, "rdf".parse().unwrap());
}

#[test]
fn splats_of_2d_gaussian_splatting_are_disks() {
    let Some(case) = case("16_2dgs_ply") else { return };
    let disks = cloud(&case.join("point_cloud.ply"));
    assert_eq!((disks.len(), disks.render_mode), (500, SplatRenderMode::Surfels));
    assert!(disks.log_scales.iter().all(|s| s[2] < -13.0 && s[0] > -13.0));
    // The scene of another case with a third scale that is flat.
    let Some(other) = crate::common::case("07_same_scene_four_formats") else { return };
    let folder = folder();
    let flat = folder.path().join("flat.ply");
    let mut scene = cloud(&other.join("scene.ply"));
    scene.log_scales.iter_mut().for_each(|s| s[2] = -13.8);
    scene.render_mode = SplatRenderMode::Surfels;
    io::splat_ply::write(&flat, &scene).unwrap();
    let [a, b, c] = [&case.join("point_cloud.ply"), &flat, &other.join("scene.ply")].map(|p| picture(p, &[]).0);
    assert!(psnr(&a, &b) > 60.0 && psnr(&a, &c) < 45.0, "{} {}", psnr(&a, &b), psnr(&a, &c));
}
