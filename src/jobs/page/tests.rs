//! A page has the same contents as the scene.

use glam::DMat3;

use super::*;
use crate::io::page::packed;
use crate::pipeline::observer::Silent;
use crate::scene::{Level, PathKey};

/// Two heaps of Gaussians, a mug with a handle and an unlabeled one, and photos from two sides.
fn request(out: &Path) -> PageRequest {
    let (mut positions, mut of) = (Vec::new(), Vec::new());
    let mut all = Identities::default();
    let mug = all.add(Level::Object, NO_IDENTITY, vec!["</script><b>mug".into()]);
    let handle = all.add(Level::Part, mug, vec!["handle".into()]);
    all.add(Level::Object, NO_IDENTITY, vec!["nowhere".into()]);
    all.get_mut(handle).expect("there").code = [1.0, 0.5, 0.0];
    for i in 0..60_usize {
        let (x, id) = [(-1.0, mug), (1.0, handle), (3.0, NO_IDENTITY)][i / 20];
        positions.push([x + (i % 5) as f32 * 0.02, (i % 4) as f32 * 0.03, (i % 3) as f32 * 0.05]);
        of.push(id);
    }
    let mut cloud =
        GaussianCloud { origin: DVec3::new(1e6, 0.0, 0.0), ..GaussianCloud::isotropic(positions, -2.5, 3.0) };
    cloud.sh = (0..60).map(|i| [i as f32 / 60.0, 0.5, -0.5]).collect();
    let at = |eye: DVec3| Camera::look_at(cloud.origin + eye, cloud.origin, -DVec3::Y, 0.8, 64, 48).expect("valid");
    let cameras = vec![at(DVec3::new(0.0, -0.5, -6.0)), at(DVec3::new(0.2, -0.5, 6.0))];
    let map = SemanticMap::from_identities(all, of, vec![1.0; 60], Vec::new());
    let key = |x: f64| PathKey::of_pose(cloud.origin + DVec3::new(x, 0.0, -5.0), DMat3::IDENTITY, 0.9);
    let path = CameraPath { keys: vec![key(0.0), key(1.0)], closed: false, fps: 30.0, seconds: 2.0 };
    PageRequest {
        title: "A <mug>".into(),
        home: HomeView::new(&cameras, Some(&cloud)),
        cloud: Arc::new(cloud),
        map: Some(Arc::new(map)),
        cameras,
        meters: Some(0.25),
        settings: RenderSettings { background: [0.1, 0.2, 0.3], ..RenderSettings::default() },
        paths: vec![("tour".into(), path)],
        out: out.into(),
    }
}

fn near(a: [f64; 3], b: [f64; 3]) -> bool {
    DVec3::from(a).distance(DVec3::from(b)) < 1e-3
}

#[test]
fn gaussians_and_identities_come_in_one_order() {
    let request = request(Path::new("page.html"));
    let made = page(&request, &mut Silent).expect("made");
    let back = packed::tests::decode(&made.gaussians);
    let order = packed::order(&request.cloud);
    assert_eq!((back.len(), order.len(), made.identities.len()), (60, 60, 3 * 60));
    let of = &request.map.as_ref().expect("found").identity_of;
    for (k, &i) in order.iter().enumerate() {
        assert_eq!(u32::from(made.identities[k]), of[i]);
        let off = (0..3).map(|a| (back.positions[k][a] - request.cloud.positions[i][a]).abs()).fold(0.0, f32::max);
        assert!(off < 1e-4, "Gaussian {i} is {off} off");
        assert!((back.sh[k][0] - request.cloud.sh[i][0]).abs() < 0.02);
    }
}

#[test]
fn names_counts_places_and_paths_are_those_of_the_scene() {
    let request = request(Path::new("page.html"));
    let made = page(&request, &mut Silent).expect("made");
    assert_eq!(made.facts, "60 Gaussians · 2 objects · 1 part");
    let scene = &made.scene;
    let [mug, handle] = &scene.identities[..] else { panic!("what has no Gaussians is left out") };
    assert_eq!((mug.id, mug.parent, mug.count, mug.name.as_str()), (1, 0, 40, "</script><b>mug"));
    assert_eq!((handle.parent, handle.count, handle.full.as_str()), (1, 20, "handle · </script><b>mug"));
    assert_eq!(handle.color, [255, 128, 0]);
    assert!((handle.center[0] - 1.04).abs() < 0.03 && handle.radius < 0.2, "{handle:?}");
    let from = DVec3::from(handle.from.expect("photos show it"));
    assert!((from.length() - 1.0).abs() < 1e-9 && from.z.abs() > 0.9, "{from}");
    // Places are relative to the Gaussians' origin, far out as it is.
    assert_eq!(scene.origin, [1e6, 0.0, 0.0]);
    assert!(near(scene.view.center, [0.0, -0.5, -6.0]) && near(scene.focus, [0.0; 3]), "{:?}", scene.view);
    assert!((scene.distance - 6.02).abs() < 0.01 && (scene.view.aspect - 4.0 / 3.0).abs() < 1e-9);
    let [path] = &scene.paths[..] else { panic!("one path") };
    assert_eq!((path.name.as_str(), path.seconds, path.frames.len()), ("tour", 2.0, 8 * 41));
    assert_eq!(path.frames[..8], [0.0, 0.0, -5.0, 0.0, 0.0, 0.0, 1.0, 0.9]);
    assert!((path.frames[8 * 40] - 1.0).abs() < 1e-6);
}

#[test]
fn a_scene_without_objects_or_photos_is_a_page_too() {
    let folder = tempfile::tempdir().expect("folder");
    let mut request = request(&folder.path().join("new/page.html"));
    (request.map, request.cameras, request.paths) = (None, Vec::new(), Vec::new());
    request.home = HomeView::new(&[], Some(&request.cloud));
    assert_eq!(page(&request, &mut Silent).expect("made").facts, "60 Gaussians");
    let bytes = run(&request, &mut Silent).expect("written");
    assert_eq!(bytes, std::fs::metadata(&request.out).expect("there").len());
    request.cloud = Arc::default();
    assert!(matches!(run(&request, &mut Silent), Err(JobError::NoGaussians)));
}

#[test]
fn a_crop_box_takes_identities_along() {
    let mut request = request(Path::new("page.html"));
    let o = request.cloud.origin;
    let bounds = Bounds { min: o - DVec3::new(2.0, 1.0, 1.0), max: o + DVec3::new(0.0, 1.0, 1.0) };
    request.crop(&CropBox { bounds, outside: false });
    let made = page(&request, &mut Silent).expect("made");
    assert_eq!(made.scene.identities.iter().map(|i| i.count).collect::<Vec<_>>(), [20]);
    assert!(made.facts.starts_with("20 Gaussians"));
}

#[test]
fn paths_in_a_scenes_folder_are_found_and_other_files_passed_over() {
    let folder = tempfile::tempdir().expect("folder");
    let at = |name: &str| folder.path().join(name);
    let request = request(Path::new("page.html"));
    export::camera_path(&at("b.json"), &request.paths[0].1, 1.5).expect("written");
    export::camera_path(&at("a.nerfstudio.json"), &request.paths[0].1, 1.5).expect("written");
    std::fs::write(at("scene.json"), "{}").expect("written");
    std::fs::write(at("c.txt"), "no path").expect("written");
    let names: Vec<String> = paths_in(folder.path()).into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, ["a", "b"]);
    std::fs::copy(at("b.json"), at("camera_path.json")).expect("written");
    let names: Vec<String> = paths_in(folder.path()).into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, ["a", "b", KEPT_PATH], "the one that is kept with a scene");
    assert!(paths_in(&at("missing")).is_empty() && named_path(&at("c.txt")).is_err());
}
