//! Written data sets: complete, reproducible for a seed, readable again, and none at all after an error.

use super::*;

fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap().flatten() {
        let name = entry.file_name().into_string().unwrap();
        if entry.path().is_dir() {
            found.extend(files(&entry.path()).into_iter().map(|(k, v)| (format!("{name}/{k}"), v)));
        } else {
            found.insert(name, fs::read(entry.path()).unwrap());
        }
    }
    found
}

fn write(options: &SynthOptions) -> (tempfile::TempDir, SynthReport) {
    let out = tempfile::tempdir().unwrap();
    let report = render_scene(&two_cubes(), "two", None, options, out.path(), &mut Silent).unwrap();
    (out, report)
}

#[test]
fn the_same_seed_gives_the_same_bytes() {
    let (a, _) = write(&small());
    let (b, _) = write(&small());
    assert!(files(a.path()) == files(b.path()));
    let (c, _) = write(&SynthOptions { seed: 1, ..small() });
    let changed = files(c.path());
    let before = files(a.path());
    let photos = before.iter().filter(|(name, _)| name.starts_with("images/"));
    assert!(photos.clone().count() == 6);
    assert!(photos.into_iter().all(|(name, bytes)| changed[name] != *bytes), "photos for another seed differ");
}

#[test]
fn a_data_set_agrees_with_itself() {
    for rig in [Rig::Dome, Rig::Orbit, Rig::Handheld, Rig::Survey] {
        let options = SynthOptions { rig, views: 9, held_out: 3, ..small() };
        let (out, report) = write(&options);
        let json = |name: &str| -> Value { serde_json::from_slice(&fs::read(out.path().join(name)).unwrap()).unwrap() };
        let transforms = json("transforms.json");
        let list = |key: &str| -> BTreeSet<String> {
            transforms[key].as_array().unwrap().iter().map(|v| v.as_str().unwrap().to_owned()).collect()
        };
        let (train, test) = (list("train_filenames"), list("test_filenames"));
        assert!(train.is_disjoint(&test));
        assert_eq!((train.len(), test.len()), (6, 3));
        assert_eq!((report.train_views, report.held_out_views), (6, 3));
        let frames = transforms["frames"].as_array().unwrap();
        let named: BTreeSet<String> = frames.iter().map(|f| f["file_path"].as_str().unwrap().to_owned()).collect();
        assert_eq!(named, train.union(&test).cloned().collect());
        let mut counted: BTreeMap<u64, u64> = BTreeMap::new();
        for name in &named {
            let photo = image::open(out.path().join(name)).unwrap();
            assert_eq!((photo.width(), photo.height()), (64, 48));
            let stem = Path::new(name).file_stem().unwrap().to_str().unwrap();
            for level in ["object_ids", "part_ids"] {
                let ids = image::open(out.path().join(level).join(format!("{stem}.png"))).unwrap().into_luma16();
                for id in ids.into_raw().into_iter().filter(|id| *id != 0) {
                    *counted.entry(u64::from(id)).or_default() += 1;
                }
            }
        }
        let identities = json("identities.json");
        let listed = identities["identities"].as_array().unwrap();
        let pixels = |i: &Value| (i["id"].as_u64().unwrap(), i["pixels"].as_u64().unwrap());
        let listed: BTreeMap<u64, u64> = listed.iter().map(pixels).filter(|(_, n)| *n > 0).collect();
        assert_eq!(listed, counted, "{rig:?}");
        assert!(counted.len() == 2, "{rig:?}: both cubes are seen");
    }
}

#[test]
fn poses_and_points_fit_the_photos() {
    let (out, report) = write(&SynthOptions { point_noise_px: 0.0, ..small() });
    assert_eq!(report.points, 300);
    let bytes = fs::read(out.path().join("points3D.ply")).unwrap();
    let end = b"end_header\n";
    let start = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    let body = &bytes[start..];
    assert_eq!(body.len(), 300 * 15);
    for point in body.chunks(15) {
        let c: Vec<f64> = point[..12].chunks(4).map(|b| f64::from(f32::from_le_bytes(b.try_into().unwrap()))).collect();
        let p = DVec3::new(c[0], c[1], c[2]);
        let nearest = BOXES.iter().map(|(m, h)| ((p - *m).abs().max_element() - h).abs()).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-5, "{p} is {nearest} off");
    }
    // A pose written in OpenGL axes looks along its own -z at the scene.
    let transforms: Value = serde_json::from_slice(&fs::read(out.path().join("transforms.json")).unwrap()).unwrap();
    for frame in transforms["frames"].as_array().unwrap() {
        let m = |r: usize, c: usize| frame["transform_matrix"][r][c].as_f64().unwrap();
        let (eye, back) = (DVec3::new(m(0, 3), m(1, 3), m(2, 3)), DVec3::new(m(0, 2), m(1, 2), m(2, 2)));
        let toward = (DVec3::new(0.15, 0.15, 0.1) - eye).normalize_or_zero();
        assert!(toward.dot(-back) > 0.98, "{toward} {back}");
        assert!(m(1, 1) > 0.2, "up is up");
    }
}

#[test]
fn the_reader_gets_back_what_was_rendered() {
    let options = SynthOptions { background: [255, 51, 0], ..small() };
    let (out, report) = write(&options);
    let dataset = crate::io::transforms::read(&out.path().join("transforms.json")).unwrap();
    assert!(dataset.warnings.is_empty(), "{:?}", dataset.warnings);
    assert_eq!((dataset.photos.len(), dataset.points.len()), (6, report.points));
    assert_eq!(dataset.background, Some([1.0, 0.2, 0.0]));
    let (train, test) = dataset.split(8);
    assert_eq!((train.len(), test.len()), (report.train_views, report.held_out_views));
    let stage = stage_of(&two_cubes());
    for (photo, camera) in dataset.photos.iter().zip(rig::cameras(&stage.surface, &stage.tracer, &options)) {
        assert!(photo.distortion.is_none());
        assert!(photo.camera.center.distance(camera.center) < 1e-9);
        let p = DVec3::new(0.2, 0.3, 0.1);
        assert!(photo.camera.project(p).unwrap().distance(camera.project(p).unwrap()) < 1e-6);
    }
}

#[test]
fn wrong_settings_are_named() {
    let changes: [fn(&mut SynthOptions); 7] = [
        |o| o.views = 0,
        |o| o.held_out = o.views,
        |o| o.width_px = 0,
        |o| o.samples = 99,
        |o| o.fov_y_deg = f64::NAN,
        |o| o.radius = Some(-1.0),
        |o| o.specular = f32::NAN,
    ];
    for change in changes {
        let mut options = small();
        change(&mut options);
        let result = run(Path::new("absent.glb"), &options, Path::new("nowhere"), &mut Silent);
        assert!(matches!(result, Err(SynthError::Options(_))), "{result:?}");
    }
}

#[test]
fn canceling_leaves_no_data_set() {
    let (out, _) = write(&small());
    assert!(out.path().join("transforms.json").is_file());
    let result = render_scene(&two_cubes(), "two", None, &small(), out.path(), &mut StopsAfter::new(0));
    assert!(matches!(result, Err(SynthError::Interrupted(_))));
    assert!(!out.path().join("transforms.json").exists());
}

#[test]
fn a_folder_that_cannot_be_written_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, b"in the way").unwrap();
    let error = render_scene(&two_cubes(), "two", None, &small(), &file, &mut Silent).unwrap_err();
    assert!(matches!(&error, SynthError::Write { path, .. } if path.starts_with(&file)), "{error}");
}
