//! Knobs of drawing, compared with the exact image: double precision and (next to) no cut-offs.

use std::sync::Arc;
use std::time::Instant;

use serde_json::{Value, json};

use super::views::StudyView;
use super::{StudyInput, Variants, error, timed};
use crate::math::Real;
use crate::math::resize::Filter;
use crate::math::stats::mean;
use crate::measure::image_error::{Errors, RgbPlanes, errors, footprint_order, named, planes, psnr_in_photo, resized};
use crate::measure::sweep::failed;
use crate::measure::{ErrorKind, Measure, Rule, Stage, StageName, Study, StudyError, Trial};
use crate::pipeline::observer::Observer;
use crate::render::{BackendChoice, Cutoffs, Features, Frame, GpuError, RenderError, RenderSettings, Renderer, cpu};
use crate::scene::{Camera, GaussianCloud};

/// Cut-offs of the exact image.
const EXACT: Cutoffs = Cutoffs { alpha: 1e-6, transmittance: 1e-8 };
/// Factor by which images seen from afar are smaller.
const AFAR: u32 = 4;
/// Turn of the camera, degrees, since an order of splats was found that is used again.
const TURNS: [f64; 3] = [0.5, 2.0, 8.0];

#[derive(Clone, Copy, PartialEq)]
enum Way {
    /// In single precision on the CPU.
    Cpu,
    Double,
    /// On the graphics adapter, emulated or not.
    Gpu,
    /// With parameters of 16 bits.
    Half,
    /// Smaller by this factor, enlarged again.
    Smaller(u32),
    /// In the order of splats of a camera that was turned by these degrees.
    Kept(f64),
    /// A small image, compared with the mean of a large one.
    Afar(u32),
}

type Variant = (Way, RenderSettings);

struct Drawing {
    cloud: Arc<GaussianCloud>,
    double: GaussianCloud<f64>,
    half: GaussianCloud,
    gpu: Option<Renderer>,
}

/// The sweep of drawing `cloud` by `settings` from these views; `None` if the observer asks to stop.
pub(crate) fn study(
    cloud: Arc<GaussianCloud>,
    settings: &RenderSettings,
    views: Vec<StudyView>,
    repeats: u32,
    mut input: StudyInput,
    observer: &dyn Observer,
) -> Result<Option<Study<'static>>, RenderError> {
    let settings = RenderSettings { depth: false, ..settings.clone() };
    let why = |e: GpuError| drop(input.insert("GPU".into(), format!("not measured: {e}")));
    let gpu = Renderer::choose(BackendChoice::Gpu, drop).map_err(why).ok();
    let measures = vec![
        error("RMS error", "root mean square difference of colors, which go from 0 to 1"),
        Measure::new("PSNR", "dB", ErrorKind::Decibels, "peak signal to noise ratio, at most 150 dB"),
        error("largest error", "largest difference of a color"),
        error("99.9 % error", "difference that one color in a thousand exceeds"),
        error("FLIP", "mean of FLIP, the difference that is seen when flipping between both"),
        error("FLIP 99 %", "FLIP that one pixel in a hundred exceeds"),
        Measure::new("PSNR in photos", "dB", ErrorKind::Decibels, "peak signal to noise ratio in held-out photos"),
        error("RMS error from afar", "as RMS error, of an image a quarter as wide, against the mean of 4 x 4 px"),
    ];
    // One step of an 8-bit image.
    let rule = Rule::new("RMS error", 1.1, 1.0 / 255.0, 0.0);
    let words = ["one frame", "images are compared with the same in double precision without cut-offs"];
    let stage = Stage::new(StageName::Render, words, (input, repeats), rule, measures);

    let double = cloud.cast::<f64>();
    let exactly = RenderSettings { cutoffs: EXACT, ..settings.clone() };
    let mut renderer = cpu::CpuRenderer::<f64>::new();
    let mut exact = Vec::with_capacity(views.len());
    for (camera, _) in &views {
        if observer.proceed().is_err() {
            return Ok(None);
        }
        exact.push(planes(&renderer.render(&double, Features::NONE, camera, &exactly)?));
    }
    let afar: Vec<RgbPlanes> =
        exact.iter().zip(&views).map(|(p, v)| resized(p, &v.0.reduced(AFAR), Filter::Area)).collect();
    let variants = variants(&cloud, &settings, gpu.as_ref());
    let first = views.first().map(|v| v.0.limited_to(96));
    let order_of = double.clone();
    let mut drawing = Drawing { half: in_half(&cloud), cloud, double, gpu };
    let study = Study::new(stage, variants.0, move |variant: &Variant, _seed, observer| {
        let from_afar = matches!(variant.0, Way::Afar(_));
        let (mut secs, mut off, mut photos) = (Vec::new(), Vec::new(), Vec::new());
        for ((camera, photo), exact) in views.iter().zip(if from_afar { &afar } else { &exact }) {
            if observer.proceed().is_err() {
                return Ok(None);
            }
            let (drawn, took) = drawing.draw(variant, camera)?;
            off.push(errors(exact, &drawn));
            if let Some(photo) = photo.as_ref().filter(|p| p.width_px as usize == drawn.width) {
                photos.push(psnr_in_photo(&drawn, photo));
            }
            secs.push(took);
        }
        let of = |k: usize| mean(&off.iter().map(|e: &Errors| e[k]).collect::<Vec<_>>());
        let errors: Errors = std::array::from_fn(of);
        let mut values = if from_afar { vec![("RMS error from afar", errors[0])] } else { named(errors) };
        if !photos.is_empty() {
            values.push(("PSNR in photos", mean(&photos)));
        }
        Ok(Some(Trial { secs: mean(&secs), values, curve: Vec::new() }))
    });
    Ok(Some(study.with_orders(move || {
        let order = first.iter().map(|camera| footprint_order(&order_of, camera, &exactly).map_err(failed));
        order.collect()
    })))
}

impl Drawing {
    /// Draws one view; returns it with the seconds that took.
    fn draw(&mut self, (way, settings): &Variant, camera: &Camera) -> Result<(RgbPlanes, f64), StudyError> {
        let mut renderer = Renderer::new();
        fn shown<R: Real>((frame, secs): (Frame<R>, f64)) -> (RgbPlanes, f64) {
            (planes(&frame), secs)
        }
        let mut cpu = |cloud: &GaussianCloud, camera: &Camera| {
            timed(|| renderer.render(cloud, Features::NONE, camera, settings).map_err(failed)).map(shown)
        };
        match *way {
            Way::Cpu => cpu(&self.cloud, camera),
            Way::Half => cpu(&self.half, camera),
            Way::Afar(factor) => cpu(&self.cloud, &camera.reduced(factor)),
            Way::Smaller(factor) => {
                let (small, secs) = cpu(&self.cloud, &camera.reduced(factor))?;
                let start = Instant::now();
                let large = resized(&small, camera, Filter::Linear);
                Ok((large, secs + start.elapsed().as_secs_f64()))
            }
            Way::Double => {
                let mut renderer = cpu::CpuRenderer::<f64>::new();
                let draw = || renderer.render(&self.double, Features::NONE, camera, settings).map_err(failed);
                timed(draw).map(shown)
            }
            Way::Gpu => {
                let Some(gpu) = &mut self.gpu else { return Err(failed("there is no graphics adapter")) };
                timed(|| gpu.draw(&self.cloud, camera, settings).map_err(failed)).map(shown)
            }
            Way::Kept(degrees) => {
                let turn = glam::DMat3::from_rotation_y(degrees.to_radians());
                let before = Camera { world_from_camera: camera.world_from_camera * turn, ..camera.clone() };
                let keep = RenderSettings { keep_order: true, ..settings.clone() };
                let mut once = |camera: &Camera, s: &RenderSettings| {
                    renderer.render(&self.cloud, Features::NONE, camera, s).map_err(failed)
                };
                // The first frame finds the order of splats that the timed one keeps.
                once(&before, settings)?;
                let start = Instant::now();
                let frame = once(camera, &keep)?;
                Ok((planes(&frame), start.elapsed().as_secs_f64()))
            }
        }
    }
}

/// The same Gaussians with parameters of 16 bits.
fn in_half(cloud: &GaussianCloud) -> GaussianCloud {
    let half = |v: f32| half::f16::from_f32(v).to_f32();
    GaussianCloud {
        positions: cloud.positions.iter().map(|p| p.map(half)).collect(),
        log_scales: cloud.log_scales.iter().map(|s| s.map(half)).collect(),
        quaternions: cloud.quaternions.iter().map(|q| q.map(half)).collect(),
        opacity_logits: cloud.opacity_logits.iter().map(|o| half(*o)).collect(),
        sh: cloud.sh.iter().map(|c| c.map(half)).collect(),
        ..cloud.clone()
    }
}

fn variants(cloud: &GaussianCloud, s: &RenderSettings, gpu: Option<&Renderer>) -> Variants<Variant> {
    let degree = s.sh_degree.min(cloud.sh_degree);
    let default = format!("CPU, f32, SH {degree}, alpha 1/255, transmittance 1e-4");
    let mut all = Variants::new(default, (Way::Cpu, s.clone()));
    let mut with = |method: &str, setting: &str, knob: (&str, Value), settings: RenderSettings| {
        all.add(method, setting, &[knob], (Way::Cpu, settings));
    };
    let usual = Cutoffs::default();
    for (alpha, name) in
        [(1.0 / 32.0, "1/32"), (1.0 / 64.0, "1/64"), (1.0 / 128.0, "1/128"), (1.0 / 1024.0, "1/1024"), (1e-4, "1e-4")]
    {
        let cutoffs = Cutoffs { alpha, ..usual };
        with("alpha cut-off", name, ("cutoffs", json!(cutoffs)), RenderSettings { cutoffs, ..s.clone() });
    }
    for (transmittance, name) in [(0.1, "0.1"), (1e-2, "1e-2"), (1e-3, "1e-3"), (1e-6, "1e-6")] {
        let cutoffs = Cutoffs { transmittance, ..usual };
        with("transmittance cut-off", name, ("cutoffs", json!(cutoffs)), RenderSettings { cutoffs, ..s.clone() });
    }
    for sh_degree in 0..degree {
        let settings = RenderSettings { sh_degree, ..s.clone() };
        with("SH bands", &format!("degree {sh_degree}"), ("sh_degree", json!(sh_degree)), settings);
    }
    let mut by = |method: &str, setting: &str, knobs: &[(&str, Value)], way: Way| {
        all.add(method, setting, knobs, (way, s.clone()));
    };
    by("precision", "16-bit parameters", &[("precision", json!("half"))], Way::Half);
    by("precision", "f64", &[("precision", json!("double"))], Way::Double);
    if let Some(gpu) = gpu {
        by("backend", gpu.name(), &[("backend", json!("gpu"))], Way::Gpu);
    }
    for factor in [2, 4] {
        let knobs = [("scale", json!(1.0 / f64::from(factor)))];
        by("resolution", &format!("1/{factor} of the size, enlarged"), &knobs, Way::Smaller(factor));
    }
    for degrees in TURNS {
        let knobs = [("keep_order", json!(true)), ("degrees", json!(degrees))];
        by("sorting", &format!("order of a view {degrees}\u{b0} away"), &knobs, Way::Kept(degrees));
    }
    for (antialias, word) in [(false, "without"), (true, "with the filter")] {
        let settings = RenderSettings { antialias, ..s.clone() };
        let knobs = [("antialias", json!(antialias))];
        all.add("anti-aliasing from afar", word, &knobs, (Way::Afar(AFAR), settings));
    }
    all
}
