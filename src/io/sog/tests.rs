//! Tests of SOG.

use std::collections::BTreeMap;
use std::fs;
use std::io::Cursor;

use image::{ImageFormat, Rgba, RgbaImage};
use serde_json::{Value, json};
use zip::write::SimpleFileOptions;

use super::*;
use crate::io::test_clouds;
use crate::scene::{CloudError, SplatRenderMode};

fn webp(w: u32, h: u32, pixels: &[[u8; 4]]) -> Vec<u8> {
    let at = |x, y| Rgba(pixels.get((y * w + x) as usize).copied().unwrap_or([0, 0, 0, 255]));
    let mut out = Cursor::new(Vec::new());
    RgbaImage::from_fn(w, h, at).write_to(&mut out, ImageFormat::WebP).expect("encode");
    out.into_inner()
}

/// Two Gaussians of degree 1 in 2 x 2 pictures.
struct Sog {
    meta: Value,
    files: BTreeMap<&'static str, Vec<u8>>,
}

impl Sog {
    fn v2() -> Self {
        let codebook: Vec<f64> = (0..256).map(|i| f64::from(i) / 100.0).collect();
        let meta = json!({
            "version": 2, "count": 2,
            "means": { "mins": [-1.0, 0.0, 0.0], "maxs": [1.0, 1.0, 2.0], "files": ["means_l.webp", "means_u.webp"] },
            "scales": { "codebook": codebook, "files": ["scales.webp"] },
            "quats": { "files": ["quats.webp"] },
            "sh0": { "codebook": codebook, "files": ["sh0.webp"] },
            "shN": { "count": 64, "bands": 1, "codebook": codebook, "files": ["shN_centroids.webp", "shN_labels.webp"] },
        });
        // Entry 63 of the palette, the last of its first row.
        let mut palette = vec![[0, 0, 0, 255]; 64 * 3];
        palette[63 * 3..].copy_from_slice(&[[1, 2, 3, 255], [4, 5, 6, 255], [7, 8, 9, 255]]);
        let files = BTreeMap::from([
            ("means_l.webp", webp(2, 2, &[[0, 255, 255, 255], [0, 0, 0, 255]])),
            ("means_u.webp", webp(2, 2, &[[0, 255, 255, 255], [0, 0, 0, 255]])),
            ("scales.webp", webp(2, 2, &[[10, 20, 30, 255]])),
            ("quats.webp", webp(2, 2, &[[255, 128, 128, 253], [1, 2, 3, 0]])),
            ("sh0.webp", webp(2, 2, &[[40, 50, 60, 51]])),
            ("shN_centroids.webp", webp(64 * 3, 1, &palette)),
            ("shN_labels.webp", webp(2, 2, &[[63, 0, 0, 255]])),
        ]);
        Self { meta, files }
    }

    fn v1() -> Self {
        let Self { mut meta, files } = Self::v2();
        meta.as_object_mut().expect("object").remove("version");
        meta.as_object_mut().expect("object").remove("count");
        meta["means"]["shape"] = json!([2, 3]);
        meta["scales"] = json!({ "mins": [0.0, 0.0, -2.55], "maxs": [2.55, 2.55, 0.0], "files": ["scales.webp"] });
        meta["sh0"] = json!({ "mins": [0.0, 0.0, 0.0, -5.0], "maxs": [2.55, 2.55, 2.55, 5.0], "files": ["sh0.webp"] });
        meta["shN"] = json!({ "mins": 0.0, "maxs": 2.55, "files": ["shN_centroids.webp", "shN_labels.webp"] });
        Self { meta, files }
    }

    fn folder(&self) -> Result<GaussianCloud, IoError> {
        let folder = tempfile::tempdir().expect("folder");
        for (name, bytes) in &self.files {
            fs::write(folder.path().join(name), bytes).expect("write");
        }
        fs::write(folder.path().join(META_FILE), self.meta.to_string()).expect("write");
        read_folder(&folder.path().join(META_FILE))
    }

    fn archive(&self, prefix: &str) -> Vec<u8> {
        let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
        let options = SimpleFileOptions::default().compression_method(zip::CompressionMethod::Deflated);
        let meta = self.meta.to_string().into_bytes();
        for (name, bytes) in self.files.iter().map(|(n, b)| (*n, b)).chain([(META_FILE, &meta)]) {
            zip.start_file(format!("{prefix}{name}"), options).expect("start");
            zip.write_all(bytes).expect("write");
        }
        zip.finish().expect("finish").into_inner()
    }
}

fn near(a: f32, b: f32) -> bool {
    (a - b).abs() < 1e-6 * (1.0 + b.abs())
}

#[test]
fn fields_are_where_the_format_puts_them() {
    let c = Sog::v2().folder().expect("read");
    assert_eq!((c.len(), c.sh_degree), (2, 1));
    // Logarithms -1, 1 and 2.
    let want = [-1.0_f32.exp_m1(), 1.0_f32.exp_m1(), 2.0_f32.exp_m1()];
    assert!(c.positions[0].iter().zip(want).all(|(a, b)| near(*a, b)), "{:?}", c.positions[0]);
    assert_eq!(c.log_scales[0], [0.1, 0.2, 0.3]);
    // Largest component x; w is at its upper end, the others just above 0.
    let [w, x, y, z] = c.quaternions[0];
    assert!(near(w, 0.5_f32.sqrt()) && (x - 0.5_f32.sqrt()).abs() < 1e-4 && y.abs() < 3e-3 && z.abs() < 3e-3);
    assert_eq!(c.quaternions[1], [1.0, 0.0, 0.0, 0.0], "a tag that names no component");
    assert!(near(c.opacity_logits[0], (0.2_f32 / 0.8).ln()));
    assert_eq!(c.sh[..4], [[0.4, 0.5, 0.6], [0.01, 0.02, 0.03], [0.04, 0.05, 0.06], [0.07, 0.08, 0.09]]);
}

#[test]
fn the_first_version_has_bounds_instead_of_codebooks() {
    let c = Sog::v1().folder().expect("read");
    assert_eq!((c.len(), c.sh_degree), (2, 1));
    assert!(near(c.log_scales[0][1], 0.2) && near(c.log_scales[0][2], -2.55 + 0.3));
    assert!(near(c.opacity_logits[0], -5.0 + 10.0 * 0.2));
    assert!(near(c.sh[0][2], 0.6) && near(c.sh[3][1], 0.08));
}

#[test]
fn archives_hold_the_same_at_any_depth() {
    let want = Sog::v2().folder().expect("folder");
    for prefix in ["", "scene/"] {
        let got = parse_archive(&Sog::v2().archive(prefix), Path::new("a.sog")).expect("archive");
        assert!(got == want);
    }
}

#[test]
fn a_codebook_without_its_first_entry_is_continued() {
    let mut s = Sog::v2();
    s.meta["scales"]["codebook"][0] = Value::Null;
    let c = s.folder().expect("read");
    assert!((c.log_scales[1][0] - (0.01 - (2.55 - 0.01) / 255.0)).abs() < 1e-5);
    s.meta["scales"]["codebook"][7] = Value::Null;
    assert!(matches!(s.folder(), Err(IoError::Syntax { reason, .. }) if reason.contains("255")));
}

#[test]
fn hostile_descriptions_are_named() {
    let with = |change: fn(&mut Value)| {
        let mut s = Sog::v2();
        change(&mut s.meta);
        s.folder().expect_err("hostile")
    };
    let e = with(|m| m["count"] = json!(1_u64 << 60));
    assert!(matches!(e, IoError::Count { claimed, possible: 4, .. } if claimed == 1 << 60), "{e}");
    assert!(matches!(with(|m| m["version"] = json!(3)), IoError::Version { found: 3, .. }));
    assert!(matches!(with(|m| m["means"]["files"] = json!(["a"])), IoError::Syntax { .. }));
    assert!(matches!(with(|m| m["means"]["files"][0] = json!("../a.webp")), IoError::Outside { .. }));
    assert!(matches!(with(|m| m["means"]["files"][0] = json!("gone.webp")), IoError::Syntax { .. }));
    assert!(matches!(with(|m| m["means"]["mins"] = json!([0.0, 0.0])), IoError::Syntax { .. }));
    assert!(matches!(with(|m| m["means"]["mins"][0] = json!(1e300)), IoError::Syntax { .. }));
    let mut far = Sog::v2();
    far.meta["means"]["maxs"][1] = json!(1000.0);
    let left = far.folder().expect("one is finite");
    assert!(left.len() == 1 && left.warnings.concat().contains("Gaussian 0, position"), "{:?}", left.warnings);
    let e = with(|m| {
        m["means"] = json!({ "files": m["means"]["files"], "mins": [1e3, 1e3, 1e3], "maxs": [1e3, 1e3, 1e3] })
    });
    assert!(matches!(e, IoError::Cloud { cause: CloudError::NoneFinite { field: "position", .. }, .. }), "{e}");
    assert!(matches!(with(|m| m["fmlgs_shift"] = json!([1.0, 2.0])), IoError::Syntax { .. }));
    assert!(matches!(with(|m| m["shN"]["bands"] = json!(2)), IoError::Syntax { .. }));
    assert!(matches!(with(|m| m["shN"]["bands"] = json!(9)), IoError::Syntax { .. }));
    let e = with(|m| m["shN"]["count"] = json!(63));
    assert!(matches!(&e, IoError::Syntax { reason, .. } if reason.contains("entry 63 of 63")), "{e}");
    let mut s = Sog::v2();
    s.files.insert("quats.webp", webp(1, 1, &[]));
    assert!(matches!(s.folder(), Err(IoError::Count { claimed: 2, possible: 1, .. })));
    s.files.insert("quats.webp", webp(2000, 1000, &[]));
    assert!(matches!(s.folder(), Err(IoError::OverBudget { .. })));
    s.files.insert("quats.webp", b"RIFF".to_vec());
    assert!(matches!(s.folder(), Err(IoError::Picture { .. })));
}

#[test]
fn archive_bombs_are_refused() {
    let path = Path::new("a.sog");
    let mut s = Sog::v2();
    // 64 MiB of zeros shrink to 64 KiB.
    s.files.insert("quats.webp", vec![0; 64 << 20]);
    let bomb = s.archive("");
    assert!(bomb.len() < 1 << 20);
    assert!(matches!(parse_archive(&bomb, path), Err(IoError::OverBudget { .. })));
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for i in 0..100 {
        zip.start_file(format!("{i}"), SimpleFileOptions::default()).expect("start");
    }
    let many = zip.finish().expect("finish").into_inner();
    assert!(matches!(parse_archive(&many, path), Err(IoError::Count { claimed: 100, .. })));
    let good = Sog::v2().archive("");
    for n in [0, 4, 100, good.len() / 2, good.len() - 1] {
        assert!(matches!(parse_archive(&good[..n], path), Err(IoError::Syntax { .. })), "{n}");
    }
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    zip.start_file("notes.txt", SimpleFileOptions::default()).expect("start");
    let other = zip.finish().expect("finish").into_inner();
    assert!(matches!(parse_archive(&other, path), Err(IoError::Syntax { place, .. }) if place.contains("meta.json")));
}

fn written(cloud: &GaussianCloud) -> Vec<u8> {
    let mut out = Vec::new();
    encode(&mut out, cloud, &mut |_| Ok(())).expect("encode");
    out
}

#[test]
fn what_is_written_comes_back_as_near_as_its_palettes_are() {
    for degree in 0..=3 {
        let mode = SplatRenderMode::Mip;
        let cloud = GaussianCloud { render_mode: mode, ..test_clouds::random(1500, degree) };
        let back = parse_archive(&written(&cloud), Path::new("a.sog")).expect("valid");
        // Harmonics are noise here, of which 1024 entries stand for 1500.
        test_clouds::assert_near(&back, &test_clouds::in_order(&cloud), [1e-4, 0.02, 1e-4, 0.002, 0.5]);
    }
    for n in [1, 2, 5, 17] {
        let cloud = test_clouds::random(n, 1);
        let back = parse_archive(&written(&cloud), Path::new("a.sog")).expect("valid");
        test_clouds::assert_near(&back, &test_clouds::in_order(&cloud), [1e-4, 1e-5, 1e-4, 0.002, 0.5]);
    }
}

#[test]
fn a_folder_holds_what_an_archive_does_and_is_not_written_over() {
    let folder = tempfile::tempdir().expect("folder");
    let meta = folder.path().join(META_FILE);
    let cloud = test_clouds::random(300, 2);
    let failed = |_: usize| Err(io::Error::other("enough"));
    write_folder(&meta, &cloud, &mut { failed }).expect_err("stopped");
    assert_eq!(fs::read_dir(folder.path()).expect("list").count(), 0, "nothing is left");
    write_folder(&meta, &cloud, &mut |_| Ok(())).expect("written");
    let archive = parse_archive(&written(&cloud), Path::new("a.sog")).expect("valid");
    assert!(read_folder(&meta).expect("valid") == archive);
    assert!(matches!(write_folder(&meta, &cloud, &mut |_| Ok(())), Err(IoError::Occupied { .. })));
}
