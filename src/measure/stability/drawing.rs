//! Images of extreme Gaussians: single precision against double, and what is left out.

use glam::{DMat3, DVec2, DVec3};

use super::{Case, Finding, Verdict};
use crate::math::sh;
use crate::math::stats::{worst, worst_difference};
use crate::render::cpu::{CpuRenderer, RenderStats};
use crate::render::{Features, Frame, FrameGradient, RenderError, RenderSettings};
use crate::scene::{Camera, GaussianCloud};

/// Largest deviation of a color from double precision that an image may have.
const BOUND: f64 = 1e-4;

/// A Gaussian in the middle, of this shape.
pub(crate) fn one(scales: [f64; 3], quaternion: [f64; 4], opacity_logit: f64) -> GaussianCloud<f64> {
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
pub(crate) fn camera(width: u32, height: u32) -> Camera {
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

/// Draws in both precisions.
pub(crate) fn pair(
    cloud: &GaussianCloud<f64>,
    camera: &Camera,
    settings: &RenderSettings,
) -> Result<(Frame<f64>, Frame<f32>, RenderStats), RenderError> {
    let mut renderer = CpuRenderer::<f64>::new();
    let exact = renderer.render(cloud, Features::NONE, camera, settings)?;
    let single = CpuRenderer::<f32>::new().render(&cloud.cast::<f32>(), Features::NONE, camera, settings)?;
    Ok((exact, single, renderer.stats()))
}

/// The largest difference of alpha, or of a color as a share of the largest one. NaN if one of the values is.
pub(crate) fn deviation(exact: &Frame<f64>, single: &Frame<f32>) -> f64 {
    let brightest = worst(exact.color.iter().flatten().copied().chain([1.0]));
    let color = exact.color.iter().zip(&single.color).map(|(a, b)| worst_difference(a, b) / brightest);
    worst(color.chain([worst_difference(&exact.alpha, &single.alpha)]))
}

/// Expected image of a case.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Expected {
    /// Something is drawn, alike in both precisions.
    Drawn,
    /// Nothing is drawn, in either precision.
    Nothing,
    /// As `Nothing`, and counted as degenerate.
    Degenerate,
    /// Something is drawn, and all of it is finite; single precision cannot know better.
    Finite,
    /// Too large for single precision, which leaves it out instead of drawing it wrongly.
    TooLarge,
}

/// Plants a fault of a renderer in such an image, the least that the promise rules out: a color off by twice
/// the bound, a speck in an empty image, a pixel that is NaN.
fn spoil(expected: Expected, exact: &Frame<f64>, single: &mut Frame<f32>) {
    let middle = single.alpha.len() / 2;
    match expected {
        Expected::Drawn => {
            let brightest = worst(exact.color.iter().flatten().copied().chain([1.0]));
            single.color[1][middle] = (exact.color[1][middle] + 2.0 * BOUND * brightest) as f32;
        }
        Expected::Finite => single.color[2][middle] = f32::NAN,
        Expected::Nothing | Expected::Degenerate | Expected::TooLarge => single.alpha[middle] = 1e-3,
    }
}

fn drawn(
    cloud: &GaussianCloud<f64>,
    camera: &Camera,
    settings: &RenderSettings,
    expected: Expected,
    faulty: bool,
) -> Finding {
    let (exact, mut single, stats) = match pair(cloud, camera, settings) {
        Ok(drawn) => drawn,
        Err(e) => return Finding::is(e.to_string(), false),
    };
    if faulty {
        spoil(expected, &exact, &mut single);
    }
    let touched = exact.alpha.iter().filter(|a| **a > 0.0).count();
    let (alpha, alpha32) = (worst(exact.alpha.iter().copied()), worst(single.alpha.iter().copied()));
    match expected {
        Expected::Drawn => {
            let finding =
                Finding::within(format!("{touched} px, opacity up to {alpha:.2}"), deviation(&exact, &single), BOUND);
            // Images of nothing are alike whatever happens.
            finding.and(touched > 0)
        }
        Expected::Finite => {
            let outcome = format!("{touched} px, opacity up to {alpha32:.2}, finite");
            let finding = Finding::is(outcome, deviation(&exact, &single).is_finite() && touched > 0);
            let verdict = if finding.is_broken() { Verdict::Broken } else { Verdict::NotCompared };
            Finding { verdict, ..finding }
        }
        Expected::Nothing => Finding::within("nothing is drawn", worst([alpha, alpha32]), 0.0),
        Expected::Degenerate => {
            let finding = Finding::within(
                format!("left out, {} counted as degenerate", stats.degenerate),
                worst([alpha, alpha32]),
                0.0,
            );
            finding.and(stats.degenerate == 1)
        }
        Expected::TooLarge => {
            let finding =
                Finding::within(format!("left out in single precision; {touched} px in double"), alpha32, 0.0);
            finding.and(touched > 0)
        }
    }
}

/// A scene, how it is looked at, and what is to be seen.
type Scene = (GaussianCloud<f64>, Camera);

type Make = Box<dyn Fn() -> Scene + Send + Sync>;

/// The scenes of this area, by name.
struct Scenes(Vec<(String, Expected, Make)>);

impl Scenes {
    fn add(&mut self, name: impl Into<String>, expected: Expected, make: impl Fn() -> Scene + Send + Sync + 'static) {
        self.0.push((name.into(), expected, Box::new(make)));
    }

    fn drawn(&mut self, name: impl Into<String>, make: impl Fn() -> Scene + Send + Sync + 'static) {
        self.add(name, Expected::Drawn, make);
    }
}

/// Two axes, neither along the image's.
const TURNED: [f64; 4] = [0.8, 0.3, -0.4, 0.33];

/// The cases of this area: of Gaussians, then of surfels where those differ.
pub(crate) fn cases() -> Vec<Case> {
    let as_cases = |area: &'static str, scenes: Scenes, surfels: bool| {
        let settings = RenderSettings { surfels, ..RenderSettings::default() };
        scenes.0.into_iter().map(move |(name, expected, make)| {
            let settings = settings.clone();
            Case::new(area, name, move |faulty| {
                let (cloud, camera) = make();
                drawn(&cloud, &camera, &settings, expected, faulty)
            })
        })
    };
    let mut all = Scenes(Vec::new());
    shapes(&mut all);
    places(&mut all);
    views(&mut all);
    colors(&mut all);
    crowds(&mut all);
    let mut surfels = Scenes(Vec::new());
    shapes(&mut surfels);
    places(&mut surfels);
    crowds(&mut surfels);
    let cases = as_cases("drawing", all, false).chain(as_cases("surfels", surfels, true));
    cases.chain(gradients()).chain(refused()).collect()
}

/// Needles, pancakes, sizes, rotations, opacities.
fn shapes(all: &mut Scenes) {
    for k in [1, 2, 3, 4, 5, 6] {
        let ratio = 10.0_f64.powi(k);
        let condition = format!("1e{}", 2 * k);
        all.drawn(format!("needle, condition {condition}"), move || {
            (one([0.5, 0.5 / ratio, 0.5 / ratio], TURNED, 2.0), camera(64, 48))
        });
        all.drawn(format!("pancake, condition {condition}"), move || {
            (one([0.5, 0.5, 0.5 / ratio], TURNED, 2.0), camera(64, 48))
        });
    }
    for exponent in [-20, -15, -10, -5, -3, -1, 0, 2, 5, 8, 10, 15, 20] {
        let scale = 10.0_f64.powi(exponent);
        let expected = if exponent <= 8 { Expected::Drawn } else { Expected::TooLarge };
        all.add(format!("scale 1e{exponent}"), expected, move || (one([scale; 3], TURNED, 2.0), camera(64, 48)));
    }
    for (name, q, expected) in [
        ("zero", [0.0; 4], Expected::Degenerate),
        ("tiny", [1e-30, 2e-30, 0.0, 1e-30], Expected::Drawn),
        ("huge", [1e30, -1e30, 1e30, 1e30], Expected::Drawn),
        ("denormal", [1e-40, 1e-41, 0.0, 1e-40], Expected::Drawn),
    ] {
        all.add(format!("quaternion {name}"), expected, move || (one([0.4, 0.2, 0.1], q, 2.0), camera(64, 48)));
    }
    for (logit, expected) in [(-80.0, Expected::Nothing), (80.0, Expected::Drawn)] {
        all.add(format!("opacity logit {logit}"), expected, move || (one([0.3; 3], TURNED, logit), camera(64, 48)));
    }
}

/// Around the near plane, off the origin, of any size.
fn places(all: &mut Scenes) {
    for (name, z, expected) in [
        ("on", 0.01, Expected::Nothing),
        ("just before", 0.010_1, Expected::Drawn),
        ("just behind", 0.009_9, Expected::Nothing),
        ("far behind", -1.0, Expected::Nothing),
    ] {
        all.add(format!("{name} the near plane"), expected, move || {
            // The camera is moved, not the Gaussian: its depth is exact in both precisions.
            let mut at = camera(64, 48);
            at.center.z = -z;
            (one([0.05; 3], TURNED, 2.0), at)
        });
    }
    all.drawn("around the camera", || {
        let mut cloud = one([4.0; 3], TURNED, 2.0);
        cloud.positions[0] = [0.0, 0.0, -2.9];
        (cloud, camera(64, 48))
    });
    for offset in [1e6, 1e9] {
        all.drawn(format!("{offset:e} units off the origin"), move || {
            let mut cloud = one([0.3, 0.2, 0.1], TURNED, 2.0);
            cloud.origin = DVec3::splat(offset);
            let mut at = camera(64, 48);
            at.center += DVec3::splat(offset);
            (cloud, at)
        });
    }
    all.add("a depth that overflows", Expected::TooLarge, || {
        let mut at = camera(64, 48);
        let (x, y) = (DVec3::new(1.0, -1.0, 0.0) / 2.0_f64.sqrt(), DVec3::new(1.0, 1.0, -2.0) / 6.0_f64.sqrt());
        at.world_from_camera = DMat3::from_cols(x, y, x.cross(y));
        at.center = -2.5e38 * x.cross(y).signum();
        (one([0.3; 3], TURNED, 2.0), at)
    });
    for size in [1e-6, 1e6] {
        all.drawn(format!("a scene {size:e} units large"), move || {
            // Nothing nearer than the near plane is drawn, so the small one is looked at from afar.
            let mut cloud = one([0.3 * size, 0.2 * size, 0.1 * size], TURNED, 2.0);
            cloud.positions[0] = [0.1 * size, 0.0, 0.0];
            let mut at = camera(64, 48);
            at.center *= size.max(1.0);
            at.focal_px *= (1.0 / size).max(1.0);
            (cloud, at)
        });
    }
}

/// Focal lengths and sizes of images.
fn views(all: &mut Scenes) {
    for (focal, scale) in [(1.0, 2.0), (1e6, 1e-5)] {
        all.drawn(format!("focal length {focal:e} px"), move || {
            let mut at = camera(64, 48);
            at.focal_px = DVec2::splat(focal);
            (one([scale, 2.0 * scale, scale], TURNED, 2.0), at)
        });
    }
    all.drawn("an image of one pixel", || (one([0.3; 3], TURNED, 2.0), camera(1, 1)));
    for (name, width, height) in [("wide", 16_384, 4), ("high", 4, 16_384)] {
        all.drawn(format!("an image 16,384 px {name}"), move || {
            let mut at = camera(width, height);
            at.focal_px = DVec2::splat(5_000.0);
            (one([0.3; 3], TURNED, 2.0), at)
        });
    }
}

fn colors(all: &mut Scenes) {
    all.drawn("color coefficients that overflow to white and black", || {
        let mut cloud = one([0.3; 3], TURNED, 4.0);
        cloud.sh[0] = [0.5 / sh::SH_C0, -1e3, 0.0];
        (cloud, camera(64, 48))
    });
    all.drawn("color of what is 3e38 units away", || {
        let mut cloud = one([0.3; 3], TURNED, 4.0);
        cloud.positions[0][2] = 3e38;
        cloud.sh_degree = 1;
        cloud.sh = vec![[0.1, 0.2, 0.3], [0.0; 3], [0.9, -0.8, 0.7], [0.0; 3]];
        (cloud, camera(65, 49))
    });
    for (name, expected, of) in [
        ("that cancel", Expected::Drawn, (|k| if k % 2 == 0 { 3.0 } else { -3.0 }) as fn(usize) -> f64),
        ("of 1e30", Expected::Drawn, |_| 1e30),
        ("whose sum overflows", Expected::Drawn, |_| 3e38),
        ("that overflow both ways", Expected::Finite, |k| if k % 2 == 0 { 3e38 } else { -3e38 }),
    ] {
        all.add(format!("color coefficients {name}"), expected, move || {
            let mut cloud = one([0.3; 3], TURNED, 4.0);
            cloud.sh_degree = 3;
            cloud.sh = (0..16).map(|k| [of(k); 3]).collect();
            (cloud, camera(64, 48))
        });
    }
}

/// None, one, and many in one place.
fn crowds(all: &mut Scenes) {
    all.add("no Gaussian", Expected::Nothing, || (GaussianCloud::default(), camera(64, 48)));
    all.drawn("one Gaussian", || (one([0.3, 0.2, 0.1], TURNED, 2.0), camera(64, 48)));
    // The middle of an odd image is the middle of a pixel.
    all.drawn("a million on one pixel", || (many(1_000_000, |_| [0.0; 3], 1e-4, -5.0), camera(9, 9)));
    all.drawn("all at one depth", || {
        (many(5_000, |i| [(i % 70) as f64 * 0.02 - 0.7, (i / 70) as f64 * 0.02 - 0.7, 0.0], 0.02, 0.0), camera(64, 48))
    });
    all.drawn("all coincident", || (many(5_000, |_| [0.0; 3], 0.2, -3.0), camera(64, 48)));
}

/// Many alike, small and round.
fn many(n: usize, place: impl Fn(usize) -> [f64; 3], scale: f64, logit: f64) -> GaussianCloud<f64> {
    GaussianCloud {
        sh: vec![[0.5, 0.1, -0.2]; n],
        ..GaussianCloud::isotropic((0..n).map(place).collect(), scale.ln(), logit)
    }
}

/// Gradients where the product of three covariances overflows, but no covariance does.
fn gradients() -> Vec<Case> {
    let length = |antialias: bool, faulty: bool| {
        let (cloud, at) = (one([0.3, 5e13, 0.2], TURNED, 2.0).cast::<f32>(), camera(64, 48));
        let settings = RenderSettings { antialias, ..RenderSettings::default() };
        let mut renderer = CpuRenderer::<f32>::new();
        let frame = renderer.render(&cloud, Features::NONE, &at, &settings)?;
        let mut up = FrameGradient { color: frame.color, ..FrameGradient::default() };
        if faulty {
            up.color[0].fill(f32::INFINITY);
        }
        let g = renderer.backward(&cloud, Features::NONE, &up);
        let all = g.positions.as_flattened().iter().chain(g.log_scales.as_flattened()).chain(&g.opacity_logits);
        let all = all.chain(g.quaternions.as_flattened()).chain(g.sh.as_flattened());
        Ok::<f64, RenderError>(all.map(|v| f64::from(*v).powi(2)).sum::<f64>().sqrt())
    };
    let case = |(antialias, name): (bool, &str)| {
        Case::new("drawing", format!("gradients of a needle 5e13 units long{name}"), move |faulty| {
            match length(antialias, faulty) {
                Ok(length) => Finding::is(format!("of length {length:.1e}"), length.is_finite() && length > 0.0),
                Err(e) => Finding::is(e.to_string(), false),
            }
        })
    };
    [(false, ""), (true, ", anti-aliased")].map(case).into()
}

/// Values that are NaN or infinite, in every property: refused by name.
fn refused() -> Vec<Case> {
    type Spoil = fn(&mut GaussianCloud<f64>, &mut Camera, f64);
    let properties: [(&str, Spoil); 10] = [
        ("position", |c, _, v| c.positions[0][1] = v),
        ("scale", |c, _, v| c.log_scales[0][2] = v),
        ("quaternion", |c, _, v| c.quaternions[0][0] = v),
        ("opacity", |c, _, v| c.opacity_logits[0] = v),
        ("color", |c, _, v| c.sh[0][0] = v),
        ("origin", |c, _, v| c.origin.y = v),
        ("focal length", |_, at, v| at.focal_px.x = v),
        ("principal point", |_, at, v| at.principal_px.y = v),
        ("camera center", |_, at, v| at.center.z = v),
        ("camera rotation", |_, at, v| at.world_from_camera.x_axis.y = v),
    ];
    let values = [("NaN", f64::NAN), ("infinity", f64::INFINITY), ("minus infinity", f64::NEG_INFINITY)];
    let each = |(property, spoil): (&'static str, Spoil)| {
        values.map(|(name, value)| {
            Case::new("drawing", format!("{name} as {property}"), move |faulty| {
                let (mut cloud, mut at) = (one([0.3; 3], TURNED, 2.0), camera(8, 8));
                if !faulty {
                    spoil(&mut cloud, &mut at, value);
                }
                let drawn = || pair(&cloud, &at, &RenderSettings::default());
                let refusal =
                    cloud.validate().map_err(|e| e.to_string()).and_then(|()| drawn().map_err(|e| e.to_string()));
                match refusal {
                    Err(reason) => Finding::is(reason, true),
                    Ok(_) => Finding::is("it was let through", false),
                }
            })
        })
    };
    properties.into_iter().flat_map(each).collect()
}
