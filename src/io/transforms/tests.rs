//! Tests of photo lists in JSON.

use std::fs;
use std::path::PathBuf;

use image::RgbImage;
use serde_json::{Value, json};

use super::*;
use crate::scene::CameraError;

/// A folder with `images/a.png` (64 x 48) and a `transforms.json`.
struct Folder {
    guard: tempfile::TempDir,
    json: Value,
}

impl Folder {
    fn new() -> Self {
        let guard = tempfile::tempdir().expect("folder");
        fs::create_dir(guard.path().join("images")).expect("create");
        let json = json!({
            "fl_x": 50.0, "fl_y": 51.0, "cx": 30.0, "cy": 25.0, "w": 64, "h": 48.0, "k1": 0.1,
            "frames": [frame("images/a.png")],
        });
        let folder = Self { guard, json };
        folder.picture("images/a.png", 64, 48);
        folder
    }

    fn path(&self) -> PathBuf {
        self.guard.path().join("transforms.json")
    }

    fn picture(&self, name: &str, w: u32, h: u32) {
        RgbImage::new(w, h).save(self.guard.path().join(name)).expect("save");
    }

    fn read(&self) -> Result<Dataset, IoError> {
        fs::write(self.path(), self.json.to_string()).expect("write");
        read(&self.path())
    }
}

/// A camera at (1, 2, 3) that looks along +y with +z up: OpenGL's right, up, back are x, z, -y.
fn frame(name: &str) -> Value {
    json!({ "file_path": name, "transform_matrix": [[1, 0, 0, 1], [0, 0, -1, 2], [0, 1, 0, 3], [0, 0, 0, 1]] })
}

#[test]
fn a_known_point_projects_where_it_should() {
    let d = Folder::new().read().expect("read");
    let c = &d.photos[0].camera;
    assert_eq!(c.center, DVec3::new(1.0, 2.0, 3.0));
    // Ten ahead (+y), two to the right (+x), one up (+z).
    let p = c.project(DVec3::new(3.0, 12.0, 4.0)).expect("in front");
    assert!((p - DVec2::new(30.0 + 50.0 * 0.2, 25.0 - 51.0 * 0.1)).length() < 1e-12, "{p}");
    assert_eq!(c.project(DVec3::new(1.0, -5.0, 3.0)), None, "behind");
    assert_eq!(d.photos[0].distortion, Some(Distortion { k1: 0.1, ..Distortion::default() }));
    assert_eq!((d.photos[0].name.as_str(), d.format.as_str()), ("images/a.png", "transforms.json"));
}

#[test]
fn intrinsics_may_be_angles_or_per_frame() {
    let mut f = Folder::new();
    f.json = json!({ "camera_angle_x": 1.0, "frames": [frame("images/a.png")] });
    let c = f.read().expect("angle").photos[0].camera.clone();
    let focal = 32.0 / 0.5_f64.tan();
    assert!((c.focal_px - DVec2::splat(focal)).length() < 1e-12);
    assert_eq!(c.principal_px, DVec2::new(32.0, 24.0));
    f.json["frames"][0]["fl_x"] = json!(77.0);
    f.json["frames"][0]["cx"] = json!(31.0);
    f.json["frames"][0]["cy"] = json!(23.0);
    let c = f.read().expect("per frame").photos[0].camera.clone();
    assert_eq!((c.focal_px, c.principal_px), (DVec2::splat(77.0), DVec2::new(31.0, 23.0)));
}

#[test]
fn photos_are_sorted_and_missing_ones_counted_once() {
    let mut f = Folder::new();
    for name in ["images/c.png", "images/b.png"] {
        f.picture(name, 64, 48);
    }
    let names = ["images/c.png", "./images/b.png", "images/gone.png", "images/a.png", "images/lost.png"];
    f.json["frames"] = names.iter().map(|n| frame(n)).collect();
    f.json["test_filenames"] = json!(["images/b.png"]);
    let d = f.read().expect("read");
    let names: Vec<_> = d.photos.iter().map(|p| (p.name.as_str(), p.test_split)).collect();
    assert_eq!(names, [("images/a.png", false), ("images/b.png", true), ("images/c.png", false)]);
    assert_eq!(d.warnings, ["2 of 5 listed photos are missing and were skipped (first: images/gone.png)"]);
    f.json["frames"] = json!([frame("images/gone.png")]);
    assert!(matches!(f.read(), Err(IoError::NoPhotos { listed: 1, .. })));
    f.json["frames"] = json!([]);
    assert!(matches!(f.read(), Err(IoError::NoPhotos { listed: 0, .. })));
}

#[test]
fn scaled_files_rescale_the_camera_and_others_are_refused() {
    let mut f = Folder::new();
    f.picture("images/half.png", 32, 24);
    f.picture("images/tall.png", 48, 64);
    f.json["frames"] = json!([frame("images/half.png")]);
    let c = f.read().expect("half").photos[0].camera.clone();
    assert_eq!((c.width_px, c.height_px), (32, 24));
    assert_eq!((c.focal_px, c.principal_px), (DVec2::new(25.0, 25.5), DVec2::new(15.0, 12.5)));
    f.json["frames"] = json!([frame("images/tall.png")]);
    let e = f.read().expect_err("another shape");
    assert!(matches!(e, IoError::PhotoSize { found: (48, 64), expected: (64, 48), .. }), "{e}");
}

#[test]
fn hostile_paths_are_refused() {
    for name in ["../a.png", "images/../../a.png", "/etc/passwd"] {
        let mut f = Folder::new();
        f.json["frames"][0]["file_path"] = json!(name);
        assert!(matches!(f.read(), Err(IoError::Outside { entry, .. }) if entry == name));
        let mut f = Folder::new();
        f.json["ply_file_path"] = json!(name);
        assert!(matches!(f.read(), Err(IoError::Outside { entry, .. }) if entry == name));
    }
    let mut f = Folder::new();
    f.json["frames"] = json!([frame("images/a.png"), frame("./images/a.png")]);
    assert!(matches!(f.read(), Err(IoError::Duplicate { photo, .. }) if photo == "images/a.png"));
}

#[test]
fn bad_poses_are_named() {
    let with = |matrix: Value| {
        let mut f = Folder::new();
        f.json["frames"][0]["transform_matrix"] = matrix;
        f.read().expect_err("bad pose")
    };
    let rotation = |e: &IoError| matches!(e, IoError::Camera { photo, cause: CameraError::Rotation(_), .. } if photo == "images/a.png");
    let mirrored = with(json!([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]]));
    assert!(rotation(&mirrored), "{mirrored}");
    let sheared = with(json!([[1, 0.01, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]));
    assert!(rotation(&sheared), "{sheared}");
    let far = with(json!([[1, 0, 0, 1e308], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 2]]));
    assert!(matches!(far, IoError::Syntax { .. }), "{far}");
    assert!(matches!(with(json!([[1, 0, 0], [0, 1, 0], [0, 0, 1]])), IoError::Syntax { .. }));
    assert!(matches!(with(json!([])), IoError::Syntax { .. }));
    let f = Folder::new();
    for (number, is_none) in [("NaN", true), ("-Infinity", true), ("null", true), ("1e999", false), ("\"1\"", false)] {
        let text = f.json.to_string().replace("[1,0,0,1]", &format!("[{number},0,0,1]"));
        fs::write(f.path(), text).expect("write");
        let e = read(&f.path()).expect_err(number);
        assert!(if is_none { rotation(&e) } else { matches!(e, IoError::Syntax { .. }) }, "{number}: {e}");
    }
}

#[test]
fn bad_lenses_are_named() {
    let with = |key: &str, value: Value| {
        let mut f = Folder::new();
        f.json[key] = value;
        f.read().expect_err(key)
    };
    for value in [json!(0), json!(-64), json!(64.5), json!(1e18)] {
        assert!(matches!(with("w", value), IoError::Syntax { .. }));
    }
    for value in [json!(0), json!(-50.0)] {
        assert!(matches!(with("fl_x", value), IoError::Camera { cause: CameraError::Focal(..), .. }));
    }
    for (key, value, model) in [
        ("camera_model", json!("EQUIRECTANGULAR"), "EQUIRECTANGULAR"),
        ("equirectangular", json!(true), "EQUIRECTANGULAR"),
        ("camera_model", json!("FISHEYE624"), "FISHEYE624"),
        ("ftheta_p0", json!(0.5), "FTHETA"),
    ] {
        let e = with(key, value);
        assert!(matches!(&e, IoError::Unsupported { what, .. } if what.contains(model)), "{e}");
        assert_eq!(e.to_string().contains("panorama_sfm"), model == "EQUIRECTANGULAR", "{e}");
    }
    let mut f = Folder::new();
    f.json = json!({ "frames": [frame("images/a.png")] });
    assert!(matches!(f.read(), Err(IoError::Syntax { .. })));
}

#[test]
fn coefficients_mean_what_the_camera_model_says() {
    let read = |keys: &[(&str, Value)]| {
        let mut f = Folder::new();
        for (key, value) in keys {
            f.json[*key] = value.clone();
        }
        f.json["k1"] = json!(0.1);
        f.json["k3"] = json!(0.01);
        f.json["k4"] = json!(-0.02);
        f.read().expect("read").photos[0].distortion.expect("a lens")
    };
    let k1 = Distortion { k1: 0.1, ..Distortion::default() };
    // nerfstudio's and Metashape's k4 belongs to a power, OpenCV's to the divisor, a fisheye's to a power of the angle.
    assert_eq!(read(&[]), Distortion { more: [0.01, -0.02, 0.0, 0.0], ..k1 });
    let rational = Distortion { more: [0.01, 0.0, 0.0, 0.0], divisor: [-0.02, 0.0, 0.3], ..k1 };
    assert_eq!(read(&[("k6", json!(0.3))]), rational);
    let without = Distortion { divisor: [-0.02, 0.0, 0.0], ..rational };
    assert_eq!(read(&[("camera_model", json!("FULL_OPENCV"))]), without);
    let fisheye = Distortion { more: [0.01, -0.02, 0.0, 0.0], projection: Projection::Fisheye, ..k1 };
    assert_eq!(read(&[("camera_model", json!("OPENCV_FISHEYE"))]), fisheye);
    assert_eq!(read(&[("is_fisheye", json!(true))]), fisheye);
}

#[test]
fn sparse_points_are_read_or_warned_about() {
    let mut f = Folder::new();
    f.json["ply_file_path"] = json!("points.ply");
    let d = f.read().expect("without");
    assert!(d.points.is_empty() && d.warnings[0].contains("points.ply"));
    let text = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n";
    fs::write(f.guard.path().join("points.ply"), text).expect("write");
    let d = f.read().expect("with");
    assert_eq!((d.points[0].position, d.warnings.len()), (DVec3::new(1.0, 2.0, 3.0), 0));
}

#[test]
fn blender_splits_are_marked_and_composited_over_white() {
    let f = Folder::new();
    for split in ["train", "test", "val"] {
        fs::create_dir(f.guard.path().join(split)).expect("create");
        f.picture(&format!("{split}/r_0.png"), 64, 48);
        let json = json!({ "camera_angle_x": 0.7, "frames": [frame(&format!("./{split}/r_0"))] });
        fs::write(f.guard.path().join(format!("transforms_{split}.json")), json.to_string()).expect("write");
    }
    let d = read_blender(f.guard.path()).expect("read");
    let names: Vec<_> = d.photos.iter().map(|p| (p.name.as_str(), p.test_split)).collect();
    assert_eq!(names, [("test/r_0", true), ("train/r_0", false)]);
    assert_eq!((d.background, d.photos[0].background), (Some([1.0; 3]), Some([1.0; 3])));
    assert!(d.photos[0].path.ends_with("test/r_0.png"));
}
