//! Photos rendered of a made-up scene are located in it; photos of other things are refused.

use glam::{DMat3, DQuat, DVec2, DVec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::matched::SUPPORTED;
use super::testing::{at, fine_scene, scene, settings};
use super::*;
use crate::pipeline::observer::Silent;
use crate::pipeline::observer::testing::StopsAfter;
use crate::render::{Features, Renderer};

fn ring() -> Vec<Camera> {
    (0..20).map(|i| at(f64::from(i) / 20.0 * std::f64::consts::TAU, 2.2, 3.6)).collect()
}

fn locator() -> Locator {
    Locator::new(scene(1), &settings(), &ring(), 256, &mut Silent).expect("cameras")
}

/// A photo of a scene: what `change` makes of the color at a pixel.
fn photo(cloud: &GaussianCloud, camera: &Camera, change: impl Fn(usize, usize, f32) -> f32) -> PhotoPixels {
    let frame = Renderer::new().render(cloud, Features::NONE, camera, &settings()).expect("renders");
    let width = camera.width_px as usize;
    let pixel = |i: usize| {
        [0, 1, 2].map(|c| (change(i % width, i / width, frame.color[c][i]) * 255.0).round().clamp(0.0, 255.0) as u8)
    };
    PhotoPixels {
        width_px: camera.width_px,
        height_px: camera.height_px,
        rgb: (0..frame.alpha.len()).map(pixel).collect(),
        coverage: None,
        alpha: None,
    }
}

/// Between the cameras of the ring, higher, nearer, rolled, and not looking at the middle.
fn truth() -> Camera {
    let mut camera = at(0.47, 2.5, 3.3);
    let turn = DQuat::from_scaled_axis(DVec3::new(0.05, -0.06, 0.15));
    camera.world_from_camera *= DMat3::from_quat(turn);
    camera
}

/// Errors of a place: share of the ring's radius, and degrees.
fn errors(found: &Camera, truth: &Camera) -> (f64, f64) {
    let turn = DQuat::from_mat3(&(found.world_from_camera.transpose() * truth.world_from_camera));
    let degrees = 2.0 * turn.w.abs().min(1.0).acos().to_degrees();
    (found.center.distance(truth.center) / 3.6, degrees)
}

fn lens() -> Camera {
    at(3.0, 1.0, 9.0)
}

fn assert_found(found: &FoundPlace, truth: &Camera) {
    let (place, turn) = errors(&found.camera, truth);
    assert!(place < 0.005 && turn < 0.3, "{place} of the radius, {turn} degrees: {found:?}");
    assert!(found.accepted, "{found:?}");
}

#[test]
fn a_photo_is_located_under_other_exposures_and_behind_a_box() {
    let (mut locator, cloud) = (locator(), scene(1));
    let plain = photo(&cloud, &truth(), |_, _, v| v);
    let found = locator.locate(&plain, &lens(), FocalKnowledge::Known, &Silent).expect("located");
    assert_found(&found, &truth());
    assert!(found.explained > 0.8 && found.agreeing >= SUPPORTED, "{found:?}");
    let (place, turn) = found.deviations().expect("determined");
    assert!(place > 0.0 && place < 0.05 && turn > 0.0 && turn < 1.0, "{place} {turn}");
    // One stop each way, in sRGB.
    for gain in [2.0_f32.powf(1.0 / 2.2), 0.5_f32.powf(1.0 / 2.2)] {
        let exposed = photo(&cloud, &truth(), |_, _, v| gain * v);
        let found = locator.locate(&exposed, &lens(), FocalKnowledge::Known, &Silent).expect("located");
        assert_found(&found, &truth());
        assert!((found.gain[1] / gain - 1.0).abs() < 0.15, "{found:?}");
    }
    // A gray box over an eighth of a third: 15 %.
    let hidden =
        photo(&cloud, &truth(), |x, y, v| if (90..214).contains(&x) && (60..153).contains(&y) { 0.5 } else { v });
    let found = locator.locate(&hidden, &lens(), FocalKnowledge::Known, &Silent).expect("located");
    assert_found(&found, &truth());
    assert!(found.explained < 0.95, "the box is not explained: {found:?}");
}

#[test]
fn a_photo_taken_upright_is_located_and_so_is_its_focal_length() {
    let (mut locator, cloud) = (locator(), scene(1));
    let mut upright = Camera { focal_px: truth().focal_px * 1.3, ..truth() };
    (upright.width_px, upright.height_px) = (240, 320);
    upright.principal_px = DVec2::new(120.0, 160.0);
    upright.world_from_camera *= DMat3::from_rotation_z(std::f64::consts::FRAC_PI_2);
    let taken = photo(&cloud, &upright, |_, _, v| v);
    let lens = Camera { focal_px: lens().focal_px, center: DVec3::ZERO, ..upright.clone() };
    let found = locator.locate(&taken, &lens, FocalKnowledge::Unknown, &Silent).expect("located");
    assert_found(&found, &upright);
    let ratio = found.camera.focal_px.x / upright.focal_px.x;
    assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
}

#[test]
fn a_close_up_is_located() {
    let (mut locator, cloud) = (locator(), scene(1));
    let mut near = at(0.5, 1.2, 1.9);
    near.world_from_camera *= DMat3::from_quat(DQuat::from_scaled_axis(DVec3::new(0.1, 0.05, 0.0)));
    let found = locator.locate(&photo(&cloud, &near, |_, _, v| v), &lens(), FocalKnowledge::Known, &Silent);
    assert_found(&found.expect("located"), &near);
}

/// The fine scene as it is seen from afar in small photos.
fn locator_from_afar() -> Locator {
    let cameras: Vec<Camera> = ring().iter().map(|camera| camera.resized(240, 180)).collect();
    Locator::new(fine_scene(1), &settings(), &cameras, 256, &mut Silent).expect("cameras")
}

/// Five times nearer than the ring, between two of its cameras: it shows what 50 px of their photos show.
fn close_up(turn: f64, target: DVec3) -> Camera {
    let toward = DVec3::new(3.3 * turn.cos(), 3.3 * turn.sin(), 2.5).normalize_or(DVec3::Z);
    Camera::look_at(target + 0.85 * toward, target, DVec3::Z, 0.75, 512, 384).expect("valid")
}

#[test]
fn a_close_up_that_ordinary_views_are_too_coarse_for_is_located() {
    let (mut locator, cloud) = (locator_from_afar(), fine_scene(1));
    // Others by exposure, too.
    for (turn, target, gain) in [(0.47, DVec3::new(0.4, 0.2, 0.4), 1.0), (2.0, DVec3::new(-0.3, 0.5, 0.2), 0.75)] {
        let near = close_up(turn, target);
        let taken = photo(&cloud, &near, |_, _, v| gain * v);
        let lens = close_up(0.0, DVec3::new(5.0, 5.0, 5.0));
        let gray = GrayPlane::of_photo(&taken);
        let seen = SeenPhoto { features: features(&gray, MOST_FEATURES), lens: &lens, focals: &[1.0] };
        let alike = locator.gallery.alike(&gray, &lens);
        // Negative control: without finer views, nothing is found.
        let found = matched(&mut locator.gallery, &seen, &alike, &ORDINARY, &Silent).expect("looked for");
        assert!(!found.is_supported(), "{}", found.agreeing);
        let found = locator.locate(&taken, &lens, FocalKnowledge::Known, &Silent).expect("located");
        assert_found(&found, &near);
        assert!(found.agreeing >= 2 * SUPPORTED, "{found:?}");
    }
}

#[test]
fn a_close_up_of_another_scene_is_refused() {
    let mut locator = locator_from_afar();
    for (turn, target) in [(0.47, DVec3::new(0.4, 0.2, 0.4)), (4.1, DVec3::new(0.0, -0.6, 0.2))] {
        let near = close_up(turn, target);
        let other = photo(&fine_scene(2), &near, |_, _, v| v);
        let found = locator.locate(&other, &near, FocalKnowledge::Known, &Silent).expect("looked for");
        assert!(!found.accepted, "{found:?}");
    }
}

#[test]
fn a_search_for_close_ups_can_be_canceled_at_each_view() {
    let mut locator = locator_from_afar();
    let near = close_up(0.47, DVec3::new(0.4, 0.2, 0.4));
    let gray = GrayPlane::of_photo(&photo(&fine_scene(2), &near, |_, _, v| v));
    let alike = locator.gallery.alike(&gray, &near);
    let seen = SeenPhoto { features: features(&gray, MOST_FEATURES), lens: &near, focals: &[1.0] };
    let found = matched(&mut locator.gallery, &seen, &alike, &CLOSE_UPS, &StopsAfter::new(4));
    assert!(matches!(found, Err(LocateError::Interrupted(_))));
}

#[test]
fn noise_and_another_scene_are_refused() {
    let mut locator = locator();
    let other = photo(&scene(2), &truth(), |_, _, v| v);
    let mut rng = Pcg64Mcg::seed_from_u64(4);
    let noise = PhotoPixels { rgb: (0..320 * 240).map(|_| rng.random()).collect(), ..other.clone() };
    let flat = PhotoPixels { rgb: vec![[120; 3]; 320 * 240], ..other.clone() };
    for photo in [other, noise, flat] {
        let found = locator.locate(&photo, &lens(), FocalKnowledge::Known, &Silent).expect("looked for");
        assert!(!found.accepted, "{found:?}");
    }
}

#[test]
fn what_cannot_be_looked_for_is_an_error() {
    let none = Locator::new(scene(1), &settings(), &[], 256, &mut Silent);
    assert!(matches!(none, Err(LocateError::NoCameras)));
    let one = PhotoPixels { width_px: 1, height_px: 1, rgb: vec![[9; 3]], coverage: None, alpha: None };
    let lens = lens().resized(1, 1);
    let found = locator().locate(&one, &lens, FocalKnowledge::Known, &Silent);
    assert!(matches!(found, Err(LocateError::TooSmall(1, 1))));
}

#[test]
fn alignment_alone_brings_a_perturbed_pose_back() {
    let mut locator = locator();
    let cloud = scene(1);
    let size = truth().limited_to(160);
    let level = PhotoLevel::of(&photo(&cloud, &truth(), |_, _, v| 0.8 * v + 0.05), 160, 120);
    let step = [0.03, -0.02, 0.04, 0.01, -0.012, 0.01, 0.0];
    let start = pose::moved(&size, &step);
    let (before, _) = errors(&start, &truth());
    assert!(before > 0.01, "{before}");
    let found = align(&mut locator.gallery, &level, &start, None, STEPS).expect("aligned");
    let (place, turn) = errors(&found.camera, &truth());
    assert!(place < 0.004 && turn < 0.25, "{place} {turn}");
}
