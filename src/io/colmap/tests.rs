//! Tests of COLMAP reconstructions.

use std::fs;

use glam::{DQuat, DVec2};
use image::RgbImage;

use super::*;
use crate::scene::{CameraError, Distortion};

/// A camera at (1, 2, 3) that looks along +y with +z up.
fn world_from_camera() -> DMat3 {
    DMat3::from_cols(DVec3::X, -DVec3::Z, DVec3::Y)
}

fn pose() -> ([f64; 4], DVec3) {
    let r = world_from_camera().transpose();
    let q = DQuat::from_mat3(&r);
    ([q.w, q.x, q.y, q.z], -(r * DVec3::new(1.0, 2.0, 3.0)))
}

struct Bin(Vec<u8>);

impl Bin {
    fn u32(mut self, v: u32) -> Self {
        self.0.extend(v.to_le_bytes());
        self
    }
    fn u64(mut self, v: u64) -> Self {
        self.0.extend(v.to_le_bytes());
        self
    }
    fn f64(mut self, values: &[f64]) -> Self {
        values.iter().for_each(|v| self.0.extend(v.to_le_bytes()));
        self
    }
    fn bytes(mut self, b: &[u8]) -> Self {
        self.0.extend(b);
        self
    }
}

/// Camera 7 of model `number`.
fn cameras_bin(number: u32, params: &[f64]) -> Vec<u8> {
    Bin(vec![]).u64(1).u32(7).u32(number).u64(64).u64(48).f64(params).0
}

fn images_bin(names: &[&str]) -> Vec<u8> {
    let (q, t) = pose();
    names
        .iter()
        .zip(1..)
        .fold(Bin(vec![]).u64(names.len() as u64), |b, (name, id)| {
            let b = b.u32(id).f64(&q).f64(&t.to_array()).u32(7).bytes(name.as_bytes()).bytes(&[0]);
            // Two observations, which are skipped.
            b.u64(2).f64(&[1.0; 3]).f64(&[2.0; 3])
        })
        .0
}

fn points_bin(position: [f64; 3]) -> Vec<u8> {
    let b = Bin(vec![]).u64(1).u64(99).f64(&position).bytes(&[10, 20, 30]).f64(&[0.5]);
    b.u64(2).u32(1).u32(0).u32(2).u32(5).0
}

const OPENCV: [f64; 8] = [50.0, 51.0, 30.0, 25.0, 0.1, -0.02, 0.003, -0.004];

/// A dataset with photos `b.png` and `sub/a.png`.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("folder");
    let images = folder.path().join("images/sub");
    fs::create_dir_all(&images).expect("create");
    RgbImage::new(64, 48).save(images.join("a.png")).expect("save");
    RgbImage::new(64, 48).save(folder.path().join("images/b.png")).expect("save");
    folder
}

fn write(folder: &Path, at: &str, files: &[(&str, &[u8])]) {
    let at = folder.join(at);
    fs::create_dir_all(&at).expect("create");
    for (name, bytes) in files {
        fs::write(at.join(name), bytes).expect("write");
    }
}

fn binary(at: &str) -> tempfile::TempDir {
    let f = folder();
    let images = images_bin(&["sub/a.png", "b.png", "gone.png"]);
    let files: [(&str, &[u8]); 3] = [
        ("cameras.bin", &cameras_bin(4, &OPENCV)),
        ("images.bin", &images),
        ("points3D.bin", &points_bin([1.0, 2.0, 3.5])),
    ];
    write(f.path(), at, &files);
    f
}

fn text() -> tempfile::TempDir {
    let f = folder();
    let (q, t) = pose();
    let numbers = |v: &[f64]| v.iter().map(|v| format!("{v:?}")).collect::<Vec<_>>().join(" ");
    let cameras = format!("# comment\n7 OPENCV 64 48 {}\n", numbers(&OPENCV));
    let image = |id: u32, name: &str, points: &str| {
        format!("{id} {} {} 7 {name}\n{points}\n", numbers(&q), numbers(&t.to_array()))
    };
    // The line of observations may be empty, and may look like a comment's opposite: numbers.
    let images =
        ["# comment\n".into(), image(1, "sub/a.png", ""), image(2, "b.png", "1 2 3 4 5 6"), image(3, "gone.png", "")];
    let files: [(&str, &[u8]); 3] = [
        ("cameras.txt", cameras.as_bytes()),
        ("images.txt", &images.concat().into_bytes()),
        ("points3D.txt", b"# comment\n99 1 2 3.5 10 20 30 0.5 1 0 2 5\n"),
    ];
    write(f.path(), "sparse", &files);
    f
}

#[test]
fn binary_and_text_agree_wherever_they_lie() {
    let t = text();
    let reference = read(t.path()).expect("text");
    assert_eq!(reference.format, "COLMAP text");
    assert_eq!(reference.warnings, ["1 of 3 listed photos are missing and were skipped (first: images/gone.png)"]);
    for at in ["sparse/0", "sparse", "."] {
        let b = binary(at);
        let d = read(b.path()).expect(at);
        assert_eq!(d.format, "COLMAP binary");
        assert_eq!(d.points, reference.points);
        assert_eq!(d.photos.len(), 2);
        for (p, r) in d.photos.iter().zip(&reference.photos) {
            assert_eq!((&p.name, &p.camera, p.distortion), (&r.name, &r.camera, r.distortion));
        }
    }
}

#[test]
fn a_known_point_projects_where_it_should() {
    let b = binary("sparse/0");
    let d = read(b.path()).expect("read");
    let photo = &d.photos[1];
    assert_eq!((photo.name.as_str(), d.photos[0].name.as_str()), ("sub/a.png", "b.png"));
    assert!((photo.camera.center - DVec3::new(1.0, 2.0, 3.0)).length() < 1e-12);
    // Ten ahead (+y), two to the right (+x), one up (+z).
    let p = photo.camera.project(DVec3::new(3.0, 12.0, 4.0)).expect("in front");
    assert!((p - DVec2::new(30.0 + 50.0 * 0.2, 25.0 - 51.0 * 0.1)).length() < 1e-9, "{p}");
    assert_eq!(
        photo.distortion,
        Some(Distortion { k1: 0.1, k2: -0.02, p1: 0.003, p2: -0.004, ..Distortion::default() })
    );
    assert_eq!(d.points, [SparsePoint { position: DVec3::new(1.0, 2.0, 3.5), rgb: [10, 20, 30] }]);
}

#[test]
fn every_model_up_to_opencv_is_read_and_others_are_named() {
    let path = Path::new("cameras.bin");
    let models: [(u32, &[f64], [f64; 4]); 5] = [
        (0, &[50.0, 30.0, 25.0], [0.0; 4]),
        (1, &[50.0, 50.0, 30.0, 25.0], [0.0; 4]),
        (2, &[50.0, 30.0, 25.0, 0.1], [0.1, 0.0, 0.0, 0.0]),
        (3, &[50.0, 30.0, 25.0, 0.1, 0.2], [0.1, 0.2, 0.0, 0.0]),
        (4, &[50.0, 50.0, 30.0, 25.0, 0.1, 0.2, 0.3, 0.4], [0.1, 0.2, 0.3, 0.4]),
    ];
    for (number, params, [k1, k2, p1, p2]) in models {
        let lens = binary::cameras(&cameras_bin(number, params), path).expect("read").remove(&7);
        let lens = lens.expect("camera 7").expect("supported");
        assert!(matches!(lens.focal, photo_list::Focal::Px(f) if f == DVec2::splat(50.0)), "{number}");
        assert_eq!(lens.principal_px, Some(DVec2::new(30.0, 25.0)));
        assert_eq!(lens.distortion, Distortion { k1, k2, p1, p2, ..Distortion::default() });
    }
    let e = check_cameras(&cameras_bin(77, &OPENCV), path).expect_err("unknown");
    assert!(matches!(&e, IoError::Unsupported { what, .. } if what.contains("77")), "{e}");
    let found = text::cameras("1 LENSLET 64 48 1 2 3 4 5", path).expect("sound").remove(&1);
    assert!(matches!(&found, Some(Err(model)) if model == "LENSLET"));
    assert!(matches!(check_text_cameras("1 PINHOLE 64 48 1 2 3", path), Err(IoError::Syntax { .. })));
}

#[test]
fn counts_of_two_to_the_sixty_are_refused() {
    let path = Path::new("x.bin");
    let huge = (1_u64 << 60).to_le_bytes();
    let with = |mut bytes: Vec<u8>, at: usize| {
        bytes[at..at + 8].copy_from_slice(&huge);
        bytes
    };
    let is_huge = |e: &IoError| matches!(e, IoError::Count { claimed, .. } if *claimed == 1 << 60);
    assert!(is_huge(&check_cameras(&with(cameras_bin(4, &OPENCV), 0), path).expect_err("cameras")));
    let images = images_bin(&["a.png"]);
    assert!(is_huge(&check_images(&with(images.clone(), 0), path).expect_err("images")));
    let observations = images.len() - 48 - 8;
    assert!(is_huge(&check_images(&with(images, observations), path).expect_err("observations")));
    let points = points_bin([0.0; 3]);
    assert!(is_huge(&check_points(&with(points.clone(), 0), path).expect_err("points")));
    let track = points.len() - 16 - 8;
    assert!(is_huge(&check_points(&with(points, track), path).expect_err("track")));
}

#[test]
fn truncated_files_are_named_at_every_length() {
    let path = Path::new("x.bin");
    let ok = |e: &IoError| matches!(e, IoError::Truncated { .. } | IoError::Count { .. });
    for n in 0..cameras_bin(4, &OPENCV).len() {
        assert!(ok(&check_cameras(&cameras_bin(4, &OPENCV)[..n], path).expect_err("cut")), "{n}");
    }
    for n in 0..images_bin(&["a.png"]).len() {
        assert!(ok(&check_images(&images_bin(&["a.png"])[..n], path).expect_err("cut")), "{n}");
    }
    for n in 0..points_bin([0.0; 3]).len() {
        assert!(ok(&check_points(&points_bin([0.0; 3])[..n], path).expect_err("cut")), "{n}");
    }
}

#[test]
fn hostile_values_are_named() {
    let e = check_points(&points_bin([0.0, f64::NAN, 0.0]), Path::new("p")).expect_err("NaN");
    assert!(matches!(&e, IoError::NotFinite { element: "point", index: 0, property, .. } if property == "y"), "{e}");
    let replaced = |images: &[u8], cameras: &[u8]| {
        let b = binary("sparse/0");
        write(b.path(), "sparse/0", &[("images.bin", images), ("cameras.bin", cameras)]);
        read(b.path()).expect_err("hostile")
    };
    let cameras = cameras_bin(4, &OPENCV);
    let outside = replaced(&images_bin(&["../c.png"]), &cameras);
    assert!(matches!(outside, IoError::Outside { .. }), "{outside}");
    let twice = replaced(&images_bin(&["b.png", "b.png"]), &cameras);
    assert!(matches!(twice, IoError::Duplicate { .. }), "{twice}");
    for quaternion in [[0.0; 4], [f64::NAN, 0.0, 0.0, 1.0]] {
        let mut images = images_bin(&["b.png"]);
        images[12..44].copy_from_slice(&quaternion.map(f64::to_le_bytes).concat());
        let e = replaced(&images, &cameras);
        assert!(matches!(e, IoError::Camera { cause: CameraError::Rotation(_), .. }), "{e}");
    }
    let mut images = images_bin(&["b.png"]);
    images[44..52].copy_from_slice(&f64::INFINITY.to_le_bytes());
    let e = replaced(&images, &cameras);
    assert!(matches!(e, IoError::Camera { cause: CameraError::Center(..), .. }), "{e}");
    let mut other = cameras.clone();
    other[8] = 6;
    let e = replaced(&images_bin(&["b.png"]), &other);
    assert!(matches!(&e, IoError::Syntax { reason, .. } if reason.contains("no camera 7")), "{e}");
    let mut empty = cameras.clone();
    empty[16..24].copy_from_slice(&0_u64.to_le_bytes());
    assert!(matches!(replaced(&images_bin(&["b.png"]), &empty), IoError::Syntax { .. }));
    let mut nan = cameras;
    nan[32 + 32..32 + 40].copy_from_slice(&f64::NAN.to_le_bytes());
    let e = replaced(&images_bin(&["b.png"]), &nan);
    assert!(matches!(&e, IoError::Syntax { reason, .. } if reason.contains("k1")), "{e}");
}

#[test]
fn photos_without_lines_of_points_are_told_not_dropped() {
    let t = text();
    let file = t.path().join("sparse/images.txt");
    let full = fs::read_to_string(&file).expect("read");
    let e = read_changed(&t, &full.replace("\n\n", "\n"));
    assert!(e.contains("images.txt, line 3") && e.contains("two lines for each photo"), "{e}");
    // Control: the same with its lines; and the last photo may end the file.
    fs::write(&file, full.trim_end()).expect("write");
    assert_eq!(read(t.path()).expect("whole").photos.len(), 2);
}

/// The error of a reconstruction with another `images.txt`.
fn read_changed(folder: &tempfile::TempDir, images: &str) -> String {
    fs::write(folder.path().join("sparse/images.txt"), images).expect("write");
    read(folder.path()).expect_err("changed").to_string()
}

#[test]
fn numbers_that_are_given_twice_are_named() {
    let path = Path::new("x");
    let says =
        |e: IoError, what: &str| assert!(e.to_string().contains(&format!("{what}: its number is given twice")), "{e}");
    let twice = |bytes: Vec<u8>| [&2_u64.to_le_bytes(), &bytes[8..], &bytes[8..]].concat();
    says(check_cameras(&twice(cameras_bin(4, &OPENCV)), path).expect_err("cameras"), "camera 7");
    says(check_images(&twice(images_bin(&["a.png"])), path).expect_err("images"), "image 1");
    says(check_points(&twice(points_bin([0.0; 3])), path).expect_err("points"), "point 99");
    let lines = |text: &str| format!("{text}{text}");
    says(check_text_cameras(&lines("7 PINHOLE 64 48 1 2 3 4\n"), path).expect_err("cameras"), "camera 7");
    says(check_text_images(&lines("1 1 0 0 0 1 2 3 7 a.png\n\n"), path).expect_err("images"), "image 1");
    says(check_text_points(&lines("99 1 2 3 1 2 3 0.5\n"), path).expect_err("points"), "point 99");
}

#[test]
fn lenses_and_places_that_cannot_be_are_refused_on_reading() {
    let with = |file: &str, from: &str, to: &str| {
        let t = text();
        let path = t.path().join("sparse").join(file);
        let full = fs::read_to_string(&path).expect("read");
        assert!(full.contains(from), "{full}");
        fs::write(&path, full.replacen(from, to, 1)).expect("write");
        read(t.path()).map(|d| d.photos.len()).map_err(|e| e.to_string())
    };
    assert_eq!(with("cameras.txt", "50.0", "70.0"), Ok(2), "control");
    assert_eq!(with("images.txt", "-1.0 ", "1e308 "), Ok(1), "one pose is no place: the other photo stays");
    for (file, from, to, what) in [
        ("cameras.txt", "50.0", "1e-30", "focal length"),
        ("cameras.txt", " 0.1 ", " 1e10 ", "leaves nothing"),
        ("points3D.txt", "3.5", "1e308", "z = 1e308"),
    ] {
        let e = with(file, from, to).expect_err(what);
        assert!(e.contains(what) && e.contains(file) | e.contains("photo"), "{e}");
    }
}

#[test]
fn photos_without_a_camera_are_left_out_and_named() {
    // As text and as binary, photos of these cameras.
    let read_with = |cameras: [u32; 3]| {
        let (t, b) = (text(), binary("sparse"));
        let [lines_at, bytes_at] =
            [(&t, "images.txt"), (&b, "images.bin")].map(|(f, n)| f.path().join("sparse").join(n));
        let (mut lines, mut bytes) =
            (fs::read_to_string(&lines_at).expect("text"), fs::read(&bytes_at).expect("bytes"));
        for ((name, at), camera) in [("sub/a.png", 68), ("b.png", 198), ("gone.png", 324)].into_iter().zip(cameras) {
            lines = lines.replace(&format!(" 7 {name}"), &format!(" {camera} {name}"));
            assert_eq!(bytes[at..at + 4], 7_u32.to_le_bytes(), "{name}");
            bytes[at..at + 4].copy_from_slice(&camera.to_le_bytes());
        }
        fs::write(lines_at, lines).expect("write");
        fs::write(bytes_at, bytes).expect("write");
        [t, b].map(|folder| {
            RgbImage::new(64, 48).save(folder.path().join("images/gone.png")).expect("save");
            let set = read(folder.path()).map_err(|e| e.to_string())?;
            Ok::<_, String>((set.photos.into_iter().map(|p| p.name).collect::<Vec<_>>(), set.warnings))
        })
    };
    let some = |names: &[&str], warnings: &[&str]| {
        let owned = |all: &[&str]| all.iter().map(|&text| text.to_owned()).collect::<Vec<_>>();
        Ok((owned(names), owned(warnings)))
    };
    for (cameras, left) in [
        ([7, 7, 7], some(&["b.png", "gone.png", "sub/a.png"], &[])),
        (
            [7, 9, 7],
            some(
                &["gone.png", "sub/a.png"],
                &["1 of 3 listed photos have no camera and were skipped: b.png: there is no camera 9"],
            ),
        ),
        (
            [8, 9, 7],
            some(
                &["gone.png"],
                &[
                    "2 of 3 listed photos have no camera and were skipped: sub/a.png: there is no camera 8; b.png: there \
                   is no camera 9",
                ],
            ),
        ),
    ] {
        read_with(cameras).into_iter().for_each(|read| assert_eq!(read, left, "{cameras:?}"));
    }
    for e in read_with([9; 3]).map(|read| read.expect_err("no photo is left")) {
        assert!(e.contains("photo 'sub/a.png'") && e.contains("there is no camera 9"), "{e}");
    }
}

#[test]
fn a_camera_without_photos_folder_is_named() {
    let b = binary("sparse/0");
    fs::rename(b.path().join("images"), b.path().join("pictures")).expect("rename");
    assert_eq!(read(b.path()).expect("another name").photos.len(), 2);
    let elsewhere = tempfile::tempdir().expect("folder");
    let taken = elsewhere.path().join("pictures");
    fs::rename(b.path().join("pictures"), &taken).expect("rename");
    assert!(matches!(read(b.path()), Err(IoError::Syntax { reason, .. }) if reason.contains("images_<factor>")));
    fs::rename(taken, b.path().join("images_2")).expect("rename");
    assert_eq!(read(b.path()).expect("reduced folder").photos.len(), 2);
}
