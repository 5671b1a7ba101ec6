//! Camera models and pictures.

use std::f64::consts::PI;
use std::fs;
use std::path::Path;

use fmlgs::io::{self, Opened};
use fmlgs::scene::Dataset;
use image::{Rgb, RgbImage};
use serde_json::json;

use crate::cli_support::{copy, fmlgs, folder};
use crate::common::case;

fn dataset(photos: &Path) -> Dataset {
    match io::open(photos).expect("photos") {
        Opened::Dataset(dataset) => dataset,
        _ => panic!("{} is no data set", photos.display()),
    }
}

#[test]
fn a_panorama_is_named_and_what_to_do_with_it() {
    let Some(case) = case("17_colmap4_equirectangular") else { return };
    let said = fmlgs(&["info", case.to_str().unwrap()]).fails_with(1).stderr;
    assert!(said.contains("the camera model EQUIRECTANGULAR, which is not supported"), "{said}");
    assert!(said.contains("perspective photos") && said.contains("panorama_sfm.py"), "{said}");
    // Other numbers of COLMAP 4, told from each other and from a file that is cut off.
    let at = folder();
    copy(&case, at.path());
    let cameras = at.path().join("sparse/0/cameras.bin");
    let bytes = fs::read(&cameras).expect("cameras");
    let with = |number: u32, bytes: &[u8]| {
        let mut bytes = bytes.to_vec();
        bytes[12..16].copy_from_slice(&number.to_le_bytes());
        fs::write(&cameras, bytes).expect("write");
        fmlgs(&["info", at.path().to_str().unwrap()])
    };
    let unknown = with(33, &bytes).fails_with(1).stderr;
    assert!(unknown.contains("the camera model number 33") && unknown.contains("image_undistorter"), "{unknown}");
    let cut = with(17, &bytes[..bytes.len() - 8]).fails_with(1).stderr;
    assert!(cut.contains("1 cameras announced"), "{cut}");
    // A fisheye in its place is read, once the photos are called as they are listed: by camera and frame.
    for i in 0..8 {
        let to = at.path().join(format!("images/cam{}/frame{:02}.png", i % 2, i / 2));
        fs::create_dir_all(to.parent().expect("parent")).expect("folder");
        fs::rename(at.path().join(format!("images/img_{i:02}.png")), to).expect("renamed");
    }
    let mut fisheye = bytes[..32].to_vec();
    fisheye.extend([40.0, 42.0, 31.5].map(f64::to_le_bytes).concat());
    let read = with(14, &fisheye).ok().stdout;
    assert!(read.contains("on 8, undone on load"), "{read}");
    assert!(read.contains("lens that sees 120 x 90 degrees; undistorted to a pinhole, 93 x 76 degrees"), "{read}");
}

/// Color that a camera sees in a direction: stripes across and down.
fn world(x: f64, y: f64) -> [f64; 3] {
    [128.0 + 100.0 * (9.0 * x).sin(), 128.0 + 100.0 * (7.0 * y).cos(), 90.0]
}

/// A photo of [`world`] through an equidistant fisheye of 180 degrees across, coefficient `k1`.
fn fisheye_photo(path: &Path, k1: f64) {
    let (w, h, f) = (240, 160, 240.0 / PI);
    let at = |px: u32, py: u32| {
        let (u, v) = ((f64::from(px) + 0.5 - 120.0) / f, (f64::from(py) + 0.5 - 80.0) / f);
        let d = u.hypot(v);
        // The angle of which θ (1 + k1 θ²) is d, by halving.
        let (mut low, mut high) = (0.0, PI);
        for _ in 0..60 {
            let middle: f64 = 0.5 * (low + high);
            if middle * (1.0 + k1 * middle * middle) > d { high = middle } else { low = middle }
        }
        let tan = if low < 0.5 * PI { low.tan() } else { f64::NAN };
        let [r, g, b] = world(u / d * tan, v / d * tan);
        Rgb([r, g, b].map(|c| c.round() as u8))
    };
    RgbImage::from_fn(w, h, at).save(path).expect("save");
}

#[test]
fn a_fisheye_becomes_a_pinhole_of_the_same_focal_length() {
    let at = folder();
    fs::create_dir(at.path().join("images")).expect("folder");
    let pose = json!([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]);
    let frame = |name: &str| json!({ "file_path": format!("images/{name}"), "transform_matrix": pose });
    let names = ["a.png", "b.png", "c.png"];
    names.iter().for_each(|name| fisheye_photo(&at.path().join("images").join(name), 0.02));
    let mut frames: Vec<_> = names.map(frame).to_vec();
    // One of another lens: the frame's own model counts. And a panorama among them is left out.
    frames[2]["camera_model"] = json!("EQUIRECTANGULAR");
    let f = 240.0 / PI;
    let file = json!({ "camera_model": "OPENCV_FISHEYE", "w": 240, "h": 160, "fl_x": f, "fl_y": f, "cx": 120, "cy": 80,
        "k1": 0.02, "k2": 0, "k3": 0, "k4": 0, "frames": frames });
    fs::write(at.path().join("transforms.json"), file.to_string()).expect("write");
    let data = dataset(at.path());
    assert_eq!(data.photos.len(), 2);
    let warnings = data.warnings.join("\n");
    assert!(warnings.contains("1 of 3 photos were left out") && warnings.contains("EQUIRECTANGULAR"), "{warnings}");
    assert!(warnings.contains("2 photos were taken through a lens that sees 1"), "{warnings}");
    let wrong = |k1: f64| {
        let mut photo = data.photos[0].clone();
        photo.distortion.as_mut().expect("a lens").k1 = k1;
        let pixels = io::photo::load(&photo, 240).expect("pixels");
        let coverage = pixels.coverage.clone().unwrap_or_else(|| vec![255; pixels.rgb.len()]);
        let mut worst = 0.0_f64;
        for (i, rgb) in pixels.rgb.iter().enumerate().filter(|(i, _)| coverage[*i] == 255) {
            let (x, y) = ((i % 240) as f64 + 0.5 - 120.0, (i / 240) as f64 + 0.5 - 80.0);
            // Stripes that are finer than a pixel of the fisheye prove nothing.
            if x.hypot(y) / f > 1.0 {
                continue;
            }
            let expected = world(x / f, y / f);
            worst = rgb.iter().zip(expected).map(|(a, b)| (f64::from(*a) - b).abs()).fold(worst, f64::max);
        }
        (worst, coverage.iter().filter(|c| **c == 0).count())
    };
    let (worst, uncovered) = wrong(0.02);
    assert!(worst < 4.0, "{worst}");
    // The corners are beyond nothing: 62 degrees from the axis.
    assert_eq!(uncovered, 0);
    assert!(wrong(0.1).0 > 25.0, "another lens is seen to be wrong");
}

#[test]
fn what_a_lens_does_not_show_does_not_count() {
    let at = folder();
    fs::create_dir_all(at.path().join("sparse/0")).expect("folder");
    fs::create_dir(at.path().join("images")).expect("folder");
    RgbImage::from_pixel(60, 60, Rgb([200; 3])).save(at.path().join("images/a.png")).expect("save");
    fs::write(at.path().join("sparse/0/images.txt"), "1 1 0 0 0 0 0 3 1 a.png\n\n").expect("write");
    let cameras = |text: &str| fs::write(at.path().join("sparse/0/cameras.txt"), text).expect("write");
    // 245 degrees across: a pinhole of the same focal length would see 72 degrees to the corner, 70 are kept.
    cameras("1 SIMPLE_FISHEYE 60 60 14 30 30\n");
    let data = dataset(at.path());
    let pixels = io::photo::load(&data.photos[0], 60).expect("pixels");
    let coverage = pixels.coverage.expect("corners without data");
    assert_eq!((coverage[0], coverage[30 * 60 + 30], coverage[30 * 60]), (0, 255, 255));
    // A lens that folds back on itself ends there; one that shows nothing is refused with its coefficients.
    cameras("1 RADIAL_FISHEYE 60 60 15.6 30 30 -0.5 0\n");
    let folded = io::photo::load(&dataset(at.path()).photos[0], 60).expect("pixels").coverage.expect("a border");
    assert!(folded[30 * 60] == 0 && folded[30 * 60 + 30] == 255);
    cameras("1 OPENCV_FISHEYE 60 60 15.6 15.6 30 30 nan 0 0 0\n");
    let said = fmlgs(&["info", at.path().to_str().unwrap()]).fails_with(1).stderr;
    assert!(said.contains("a.png") && said.contains("k1 = NaN is not finite"), "{said}");
}
