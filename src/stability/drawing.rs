//! Pictures of extreme Gaussians: single precision against double, and what is left out.

use glam::{DMat3, DVec2, DVec3};

use super::{Case, Finding};
use crate::math::sh;
use crate::render::cpu::Renderer;
use crate::render::{Features, Frame, RenderSettings};
use crate::scene::{Camera, GaussianCloud};

/// Largest deviation of a colour from double precision that a picture may have.
const BOUND: f64 = 1e-4;

/// One Gaussian in the middle, of this shape.
pub fn one(scales: [f64; 3], quaternion: [f64; 4], opacity_logit: f64) -> GaussianCloud<f64> {
    GaussianCloud {
        positions: vec![[0.0; 3]],
        log_scales: vec![scales.map(f64::ln)],
        quaternions: vec![quaternion],
        opacity_logits: vec![opacity_logit],
        sh: vec![[0.8, 0.2, -0.3]],
        ..GaussianCloud::default()
    }
}

/// A camera before the middle, 3 units away.
pub fn camera(width: u32, height: u32) -> Camera {
    let focal = 1.2 * f64::from(height.max(1));
    Camera {
        width_px: width,
        height_px: height,
        focal_px: DVec2::splat(focal),
        principal_px: DVec2::new(f64::from(width), f64::from(height)) * 0.5,
        world_from_camera: DMat3::IDENTITY,
        center: DVec3::new(0.0, 0.0, -3.0),
    }
}

/// Draws in both precisions; the largest difference of a colour or of alpha. `None` if something is
/// not finite.
pub fn both(cloud: &GaussianCloud<f64>, camera: &Camera) -> Option<(f64, Frame<f64>)> {
    let settings = RenderSettings::default();
    let exact = Renderer::<f64>::new().render(cloud, Features::NONE, camera, &settings).ok()?;
    let single = Renderer::<f32>::new().render(&cloud.cast::<f32>(), Features::NONE, camera, &settings).ok()?;
    let planes = |a: &[Vec<f64>], b: &[Vec<f32>]| {
        a.iter().flatten().zip(b.iter().flatten()).try_fold(0.0_f64, |worst, (x, y)| {
            let y = f64::from(*y);
            (x.is_finite() && y.is_finite()).then(|| worst.max((x - y).abs()))
        })
    };
    let color = planes(&exact.color, &single.color)?;
    let alpha = planes(std::slice::from_ref(&exact.alpha), std::slice::from_ref(&single.alpha))?;
    Some((color.max(alpha), exact))
}

fn drawn(cloud: &GaussianCloud<f64>, camera: &Camera, bound: f64) -> Finding {
    match both(cloud, camera) {
        Some((error, frame)) => {
            let covered = frame.alpha.iter().filter(|a| **a > 0.5).count();
            Finding::within(format!("{covered} px covered"), error, bound)
        }
        None => Finding::is("a pixel is not finite", false),
    }
}

/// What is too large for single precision is left out there, not drawn wrongly.
fn left_out(cloud: &GaussianCloud<f64>, camera: &Camera) -> Finding {
    let settings = RenderSettings::default();
    match Renderer::<f32>::new().render(&cloud.cast::<f32>(), Features::NONE, camera, &settings) {
        Ok(frame) => {
            let most = frame.alpha.iter().fold(0.0_f32, |m, a| if a.is_finite() { m.max(*a) } else { f32::NAN });
            Finding::within("left out; largest opacity", f64::from(most), 0.0)
        }
        Err(e) => Finding::is(e.to_string(), false),
    }
}

fn case(name: impl Into<String>, make: impl Fn() -> (GaussianCloud<f64>, Camera) + Send + Sync + 'static) -> Case {
    Case::new("drawing", name, move || {
        let (cloud, camera) = make();
        drawn(&cloud, &camera, BOUND)
    })
}

/// Two axes, neither along the picture's.
const TURNED: [f64; 4] = [0.8, 0.3, -0.4, 0.33];

/// The cases of this area.
pub fn cases() -> Vec<Case> {
    let mut all = Vec::new();
    for k in [1, 2, 3, 4, 5, 6] {
        let ratio = 10.0_f64.powi(k);
        let condition = format!("1e{}", 2 * k);
        all.push(case(format!("needle, condition {condition}"), move || {
            (one([0.5, 0.5 / ratio, 0.5 / ratio], TURNED, 2.0), camera(64, 48))
        }));
        all.push(case(format!("pancake, condition {condition}"), move || {
            (one([0.5, 0.5, 0.5 / ratio], TURNED, 2.0), camera(64, 48))
        }));
    }
    for exponent in [-20, -10, -5, 2, 5] {
        let scale = 10.0_f64.powi(exponent);
        all.push(case(format!("scale 1e{exponent}"), move || (one([scale; 3], TURNED, 2.0), camera(64, 48))));
    }
    for exponent in [10, 20] {
        let scale = 10.0_f64.powi(exponent);
        all.push(Case::new("drawing", format!("scale 1e{exponent}"), move || {
            left_out(&one([scale; 3], TURNED, 2.0), &camera(64, 48))
        }));
    }
    for (name, z) in [("on", 0.01), ("just before", 0.010_1), ("just behind", 0.009_9), ("far behind", -1.0)] {
        all.push(case(format!("{name} the near plane"), move || {
            let mut cloud = one([0.05; 3], TURNED, 2.0);
            cloud.positions[0] = [0.001, 0.0, -3.0 + z];
            (cloud, camera(64, 48))
        }));
    }
    all.push(case("around the camera", || {
        let mut cloud = one([4.0; 3], TURNED, 2.0);
        cloud.positions[0] = [0.0, 0.0, -2.9];
        (cloud, camera(64, 48))
    }));
    for (name, q) in [
        ("zero", [0.0; 4]),
        ("tiny", [1e-30, 2e-30, 0.0, 1e-30]),
        ("huge", [1e30, -1e30, 1e30, 1e30]),
        ("denormal", [1e-40, 1e-41, 0.0, 1e-40]),
    ] {
        all.push(case(format!("quaternion {name}"), move || (one([0.4, 0.2, 0.1], q, 2.0), camera(64, 48))));
    }
    for logit in [-80.0, 80.0] {
        all.push(case(format!("opacity logit {logit}"), move || (one([0.3; 3], TURNED, logit), camera(64, 48))));
    }
    all.push(case("colour coefficients that overflow to white and black", || {
        let mut cloud = one([0.3; 3], TURNED, 4.0);
        cloud.sh[0] = [0.5 / sh::SH_C0, -1e3, 0.0];
        (cloud, camera(64, 48))
    }));
    all.push(case("colour coefficients that cancel", || {
        let mut cloud = one([0.3; 3], TURNED, 4.0);
        cloud.sh_degree = 3;
        cloud.sh = (0..16).map(|k| [if k % 2 == 0 { 3.0 } else { -3.0 }; 3]).collect();
        (cloud, camera(64, 48))
    }));
    for offset in [1e6, 1e9] {
        all.push(case(format!("{offset:e} units off the origin"), move || {
            let mut cloud = one([0.3, 0.2, 0.1], TURNED, 2.0);
            cloud.origin = DVec3::splat(offset);
            let mut at = camera(64, 48);
            at.center += DVec3::splat(offset);
            (cloud, at)
        }));
    }
    for size in [1e-6, 1e6] {
        all.push(case(format!("a scene {size:e} units large"), move || {
            // Nothing nearer than the near plane is drawn, so the small one is looked at from afar.
            let mut cloud = one([0.3 * size, 0.2 * size, 0.1 * size], TURNED, 2.0);
            cloud.positions[0] = [0.1 * size, 0.0, 0.0];
            let mut at = camera(64, 48);
            at.center *= size.max(1.0);
            at.focal_px *= (1.0 / size).max(1.0);
            (cloud, at)
        }));
    }
    for focal in [1.0, 1e6] {
        all.push(case(format!("focal length {focal:e} px"), move || {
            let mut at = camera(64, 48);
            at.focal_px = DVec2::splat(focal);
            (one([1e-3, 2e-3, 1e-3], TURNED, 2.0), at)
        }));
    }
    all.push(case("a picture of one pixel", || (one([0.3; 3], TURNED, 2.0), camera(1, 1))));
    all.push(case("a picture 16,384 px wide", || {
        let mut at = camera(16_384, 4);
        at.focal_px = DVec2::splat(5_000.0);
        (one([0.3; 3], TURNED, 2.0), at)
    }));
    all.push(case("no Gaussian", || (GaussianCloud::default(), camera(64, 48))));
    all.push(case("a million on one pixel", || (many(1_000_000, |_| [0.0; 3], 1e-4, -9.0), camera(8, 8))));
    all.push(case("all at one depth", || {
        (many(5_000, |i| [(i % 70) as f64 * 0.02 - 0.7, (i / 70) as f64 * 0.02 - 0.7, 0.0], 0.02, 0.0), camera(64, 48))
    }));
    all.push(case("all coincident", || (many(5_000, |_| [0.0; 3], 0.2, -3.0), camera(64, 48))));
    all.extend(refused());
    all
}

/// Many alike, small and round.
fn many(n: usize, place: impl Fn(usize) -> [f64; 3], scale: f64, logit: f64) -> GaussianCloud<f64> {
    GaussianCloud {
        positions: (0..n).map(place).collect(),
        log_scales: vec![[scale.ln(); 3]; n],
        quaternions: vec![[1.0, 0.0, 0.0, 0.0]; n],
        opacity_logits: vec![logit; n],
        sh: vec![[0.5, 0.1, -0.2]; n],
        ..GaussianCloud::default()
    }
}

/// Values that are no numbers, in every property: refused by name.
fn refused() -> Vec<Case> {
    type Spoil = fn(&mut GaussianCloud<f64>, f64);
    let properties: [(&str, Spoil); 5] = [
        ("position", |c, v| c.positions[0][1] = v),
        ("scale", |c, v| c.log_scales[0][2] = v),
        ("quaternion", |c, v| c.quaternions[0][0] = v),
        ("opacity", |c, v| c.opacity_logits[0] = v),
        ("colour", |c, v| c.sh[0][0] = v),
    ];
    let values = [("NaN", f64::NAN), ("infinity", f64::INFINITY)];
    let each = |(property, spoil): (&'static str, Spoil)| {
        values.map(|(name, value)| {
            Case::new("drawing", format!("{name} as {property}"), move || {
                let mut cloud = one([0.3; 3], TURNED, 2.0);
                spoil(&mut cloud, value);
                match cloud.validate() {
                    Err(e) => Finding::is(e.to_string(), true),
                    Ok(()) => Finding::is("it was let through", false),
                }
            })
        })
    };
    properties.into_iter().flat_map(each).collect()
}
