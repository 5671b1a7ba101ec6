//! Readers against real files: counts, geometry and speed. Skipped where the files are absent.

use std::path::Path;
use std::time::Instant;

use crate::common::data;
use fmlgs::io::{self, Opened};
use fmlgs::scene::{Bounds, Dataset, GaussianCloud};

fn dataset(path: &Path) -> Dataset {
    match io::open(path).expect("open") {
        Opened::Dataset(d) => d,
        other => panic!("{} is {other:?}", path.display()),
    }
}

fn cloud(path: &Path) -> GaussianCloud {
    match io::open(path).expect("open") {
        Opened::Cloud(c) => c,
        other => panic!("{} is {other:?}", path.display()),
    }
}

/// Share of the sparse points that the first photo sees.
fn visible(d: &Dataset) -> f64 {
    let c = &d.photos[0].camera;
    let inside = |p: glam::DVec2| p.x > 0.0 && p.y > 0.0 && p.x < f64::from(c.width_px) && p.y < f64::from(c.height_px);
    let seen = d.points.iter().filter(|p| c.project(p.position).is_some_and(inside)).count();
    seen as f64 / d.points.len() as f64
}

#[test]
fn plush() {
    let Some(path) = data("plush") else { return };
    let d = dataset(&path);
    assert_eq!((d.photos.len(), d.points.len(), d.warnings.len()), (97, 18_231, 0));
    assert_eq!((d.name.as_str(), d.format.as_str()), ("plush", "transforms.json"));
    assert!(d.photos.iter().all(|p| p.distortion.is_some_and(|l| l.k1 > 0.03)));
    // With flipped axes no point would be in front of the camera.
    assert!(visible(&d) > 0.3, "{}", visible(&d));
    let start = Instant::now();
    let photo = io::photo::load(&d.photos[0], 504).expect("load");
    println!("plush photo at 504 px: {:.1} ms", start.elapsed().as_secs_f64() * 1e3);
    assert_eq!((photo.width_px, photo.height_px), (504, 378));
    let same = dataset(&path.join("transforms.json"));
    assert_eq!(same.photos, d.photos);
}

/// The quarter-size set was undistorted and reduced by other software: an independent check of
/// our own undistortion.
#[test]
fn plush_undistorted_elsewhere_looks_the_same() {
    let (Some(full), Some(quarter)) = (data("plush"), data("plush_quarter")) else { return };
    let (full, quarter) = (dataset(&full), dataset(&quarter));
    assert_eq!((quarter.photos.len(), quarter.points.len()), (97, 18_231));
    let difference = |a: &fmlgs::scene::PhotoPixels, b: &fmlgs::scene::PhotoPixels| {
        let (mut sum, mut n) = (0.0, 0.0);
        for (i, (a, b)) in a.rgb.iter().zip(&b.rgb).enumerate() {
            if a_covers(i) {
                sum += a.iter().zip(b).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum::<f64>();
                n += 3.0;
            }
        }
        10.0 * (255.0_f64.powi(2) / (sum / n)).log10()
    };
    fn a_covers(i: usize) -> bool {
        let (x, y) = (i % 252, i / 252);
        (4..248).contains(&x) && (4..185).contains(&y)
    }
    let ours = io::photo::load(&full.photos[0], 252).expect("load");
    let theirs = io::photo::load(&quarter.photos[0], 252).expect("load");
    let psnr = difference(&ours, &theirs);
    let mut bent = full.photos[0].clone();
    bent.distortion = None;
    let control = difference(&io::photo::load(&bent, 252).expect("load"), &theirs);
    println!("undistorted here against elsewhere: {psnr:.1} dB; not undistorted: {control:.1} dB");
    assert!(psnr > 30.0 && psnr > control + 5.0, "{psnr} {control}");
}

#[test]
fn fox_lists_67_photos_and_has_50() {
    let Some(path) = data("fox") else { return };
    let d = dataset(&path);
    assert_eq!((d.photos.len(), d.points.len()), (50, 0));
    assert_eq!(d.warnings.len(), 1);
    assert!(d.warnings[0].starts_with("17 of 67 listed photos are missing"), "{}", d.warnings[0]);
    let start = Instant::now();
    let photo = io::photo::load(&d.photos[0], 960).expect("load");
    println!("fox photo at 960 px: {:.1} ms", start.elapsed().as_secs_f64() * 1e3);
    assert_eq!((photo.width_px, photo.height_px), (540, 960));
}

#[test]
fn splats() {
    for (name, n, degree) in [
        ("guitar_sh0_90854.ply", 90_854, 0),
        ("statue_narcissus_sh0_101275.ply", 101_275, 0),
        ("playbot_lod3_sh2_31000.ply", 31_000, 2),
    ] {
        let Some(path) = data("splats").map(|p| p.join(name)) else { return };
        let start = Instant::now();
        let c = cloud(&path);
        println!("{name}: {:.1} ms", start.elapsed().as_secs_f64() * 1e3);
        assert_eq!((c.len(), c.sh_degree, c.extras.len()), (n, degree, 0));
        c.validate().expect("valid");
        let folder = tempfile::tempdir().expect("folder");
        let copy = folder.path().join("copy.ply");
        io::splat_ply::write(&copy, &c).expect("write");
        assert_eq!(std::fs::read(&copy).expect("copy").len(), std::fs::read(&path).expect("original").len());
        assert!(cloud(&copy) == c, "{name} changed on the way");
    }
}

/// The plain file was made from the compressed one by other software.
#[test]
fn compressed_guitar_is_the_plain_guitar() {
    let Some(path) = data("splats") else { return };
    let start = Instant::now();
    let compressed = cloud(&path.join("guitar.compressed.ply"));
    println!("compressed guitar: {:.1} ms", start.elapsed().as_secs_f64() * 1e3);
    assert_same(&compressed, &cloud(&path.join("guitar_sh0_90854.ply")));
}

/// Equal up to the rounding of two decoders.
fn assert_same(a: &GaussianCloud, b: &GaussianCloud) {
    assert_eq!((a.len(), a.sh_degree), (b.len(), b.sh_degree));
    for i in 0..a.len() {
        let near = |x: &[f32], y: &[f32], what: &str| {
            for (x, y) in x.iter().zip(y) {
                assert!((x - y).abs() < 2e-4 * (1.0 + x.abs()), "Gaussian {i}: {what} {x} against {y}");
            }
        };
        near(&a.positions[i], &b.positions[i], "position");
        near(&a.log_scales[i], &b.log_scales[i], "scale");
        let unit = |q: [f32; 4]| fmlgs::math::rotation::unit_quaternion(q).expect("valid");
        let (p, q) = (unit(a.quaternions[i]), unit(b.quaternions[i]));
        let dot: f32 = p.iter().zip(q).map(|(p, q)| p * q).sum();
        near(&p.map(|v| v * dot.signum()), &q, "rotation");
        let opacity = |l: f32| 1.0 / (1.0 + (-l).exp());
        near(&[opacity(a.opacity_logits[i])], &[opacity(b.opacity_logits[i])], "opacity");
        let stride = a.sh_stride();
        near(
            a.sh[i * stride..(i + 1) * stride].as_flattened(),
            b.sh[i * stride..(i + 1) * stride].as_flattened(),
            "colour",
        );
    }
}

/// The coarser level of detail was turned into a `.ply` by other software: box, color and
/// opacity of the whole agree, though no single Gaussian does.
fn assert_same_object(fine: &GaussianCloud, coarse: &Path) {
    let coarse = cloud(coarse);
    let bounds = |c: &GaussianCloud| Bounds::robust((0..c.len()).map(|i| c.world_position(i))).expect("not empty");
    let (a, b) = (bounds(fine), bounds(&coarse));
    assert!((a.min - b.min).length() + (a.max - b.max).length() < 0.1 * a.radius(), "{a:?} {b:?}");
    let color = |c: &GaussianCloud, channel: usize| {
        let weight = |i: usize| 1.0 / (1.0 + f64::from(-c.opacity_logits[i]).exp());
        let area = |i: usize| weight(i) * f64::from(c.log_scales[i].iter().sum::<f32>() * 2.0 / 3.0).exp();
        let sum: f64 = (0..c.len()).map(|i| area(i) * f64::from(c.sh[i * c.sh_stride()][channel])).sum();
        sum / (0..c.len()).map(area).sum::<f64>()
    };
    for channel in 0..3 {
        let (a, b) = (color(fine, channel), color(&coarse, channel));
        assert!((a - b).abs() < 0.15, "channel {channel}: {a} against {b}");
    }
}

#[test]
fn sog_folders_and_archives() {
    for (name, n, degree) in [
        ("formats/sog/playbot_lod4", 8_406, 2),
        ("formats/sog/massa.sog", 58_649, 0),
        ("splats/playbot_500k_sog", 500_000, 2),
    ] {
        let Some(path) = data(name) else { return };
        let start = Instant::now();
        let c = cloud(&path);
        println!("{name}: {:.1} ms", start.elapsed().as_secs_f64() * 1e3);
        assert_eq!((c.len(), c.sh_degree), (n, degree), "{name}");
        c.validate().expect("valid");
        if n == 500_000 {
            assert_same_object(&c, &path.with_file_name("playbot_lod3_sh2_31000.ply"));
            // Large files quickly: the bar is generous, the figures are printed.
            let folder = tempfile::tempdir().expect("folder");
            let file = folder.path().join("large.ply");
            let start = Instant::now();
            io::splat_ply::write(&file, &c).expect("write");
            let wrote = start.elapsed().as_secs_f64();
            let start = Instant::now();
            assert!(cloud(&file) == c);
            let read = start.elapsed().as_secs_f64();
            println!("500,000 splats as .ply: written in {wrote:.2} s, read in {read:.2} s");
            assert!(read < 10.0, "{read}");
        }
    }
}

#[test]
fn gltf_conformance_matrix() {
    let Some(path) = data("formats/khr_gaussian_fixtures") else { return };
    for name in ["khr_conformance_matrix.gltf", "khr_conformance_matrix.glb"] {
        let c = cloud(&path.join(name));
        assert_eq!((c.len(), c.sh_degree), (15, 3), "{name}");
        // The drafts that this file follows hold logarithms; quaternions x y z w; plain opacities.
        // The axes of glTF are half a turn around z from those of the scene.
        assert_eq!((c.positions[0], c.log_scales[3]), ([-1.0, -2.0, 3.0], [0.2, -0.1, 0.7]));
        assert_eq!((c.log_scales[4], c.log_scales[6]), ([1.0, -2.0, 3.0], [2.0, -3.0, 4.0]));
        assert!(c.quaternions.iter().all(|q| *q == [0.0, 0.0, 1.0, 0.0]));
        let opacity = |i: usize| 1.0 / (1.0 + (-c.opacity_logits[i]).exp());
        for (i, want) in [(8, 0.75), (9, 64.0 / 255.0), (10, 16_384.0 / 65_535.0)] {
            assert!((opacity(i) - want).abs() < 1e-5, "{i}");
        }
    }
    let e = io::open(&path.join("khr_extensible_fallback.gltf")).expect_err("another kernel");
    assert!(e.to_string().contains("customShape"), "{e}");
}

#[test]
fn masklets_of_a_video() {
    use fmlgs::io::labels::Labels;
    use fmlgs::scene::{Camera, Photo};
    use glam::DVec3;

    let Some(path) = data("sam2_media/sav_example") else { return };
    let frame = |number: usize| {
        Photo::new(
            format!("{number:05}.jpg"),
            path.clone(),
            Camera::look_at(DVec3::X, DVec3::ZERO, DVec3::Z, 0.8, 480, 848).expect("valid"),
        )
    };
    // Areas by an independent decoder.
    for (file, first, areas) in [
        ("sav_000001_manual.json", 5, vec![2808, 52965, 6072, 8467]),
        ("sav_000001_auto.json", 9, vec![23808, 16188, 15808, 13982, 10165, 5439, 4834, 3636, 2344]),
    ] {
        let labels = Labels::open(&path.join(file)).expect(file);
        assert!(labels.has(&frame(480)) && !labels.has(&frame(481)) && !labels.has(&frame(484)));
        let regions = labels.of(&frame(0), 4096).expect(file);
        assert!(regions.len() <= first);
        assert_eq!(regions.iter().map(|r| r.mask.area()).collect::<Vec<_>>(), areas, "{file}");
        (0..121).for_each(|k| drop(labels.of(&frame(4 * k), 256).expect(file)));
    }
    // Which of the two?
    assert!(Labels::open(&path).is_err());
}
