//! Knobs of drawing against the exact picture: double precision and (next to) no cut-offs.

use std::sync::Arc;
use std::time::Instant;

use serde_json::json;

use super::{Input, Plans, stage, timed};
use crate::math::Real;
use crate::math::stats::mean;
use crate::pipeline::observer::Observer;
use crate::render::cpu::Renderer;
use crate::render::gpu::GpuError;
use crate::render::{Backend, BackendChoice, Cutoffs, Features, Frame, RenderError, RenderSettings};
use crate::report::document::Form;
use crate::report::picture::{Errors, Planes, averaged, enlarged, footprint_order, planes, psnr_in_photo};
use crate::report::sweep::failed;
use crate::report::{Case, Measure, Order, Rule, Stage, StageName, Study, StudyError, Trial};
use crate::scene::{Camera, GaussianCloud, PhotoPixels};

/// Cut-offs of the exact picture.
const EXACT: Cutoffs = Cutoffs { alpha: 1e-6, transmittance: 1e-8 };
/// How much smaller pictures are where one looks from afar.
const AFAR: u32 = 4;
/// Turn of the camera, degrees, since an order of splats was found that is used again.
const TURNS: [f64; 3] = [0.5, 2.0, 8.0];

/// One way to draw.
#[derive(Clone)]
enum Plan {
    /// In single precision on the CPU.
    Cpu(RenderSettings),
    /// In double precision.
    Double(RenderSettings),
    /// On the graphics adapter, emulated or not.
    Gpu(RenderSettings),
    /// With parameters of 16 bits.
    Half(RenderSettings),
    /// Smaller by this factor, enlarged again.
    Smaller(u32, RenderSettings),
    /// In the order of splats of a camera that was turned by these degrees.
    Kept(f64, RenderSettings),
    /// A small picture, held against the mean of a large one.
    Afar(u32, RenderSettings),
}

/// The sweep of drawing.
pub struct RenderStudy {
    cloud: Arc<GaussianCloud>,
    double: GaussianCloud<f64>,
    half: Arc<GaussianCloud>,
    cameras: Vec<Camera>,
    photos: Vec<Option<PhotoPixels>>,
    /// The exact pictures; and as seen from afar.
    exact: Vec<Planes>,
    afar: Vec<Planes>,
    settings: RenderSettings,
    gpu: Option<Backend>,
    input: Input,
    repeats: u32,
    plans: Plans<Plan>,
}

impl RenderStudy {
    /// Of `cloud`, drawn by `settings` from these cameras, of whose pictures there may be photos.
    ///
    /// # Errors
    /// If a camera is not usable.
    pub fn new(
        cloud: GaussianCloud,
        settings: &RenderSettings,
        views: Vec<(Camera, Option<PhotoPixels>)>,
        repeats: u32,
        mut input: Input,
    ) -> Result<Self, RenderError> {
        let (cameras, photos): (Vec<Camera>, Vec<Option<PhotoPixels>>) = views.into_iter().unzip();
        let settings = RenderSettings { depth: false, ..settings.clone() };
        let why = |e: GpuError| drop(input.insert("GPU".into(), format!("not measured: {e}")));
        let gpu = Backend::choose(BackendChoice::Gpu, drop).map_err(why).ok();
        let double = cloud.cast::<f64>();
        let exactly = RenderSettings { cutoffs: EXACT, ..settings.clone() };
        let mut renderer = Renderer::<f64>::new();
        let mut exact = Vec::with_capacity(cameras.len());
        for camera in &cameras {
            exact.push(planes(&renderer.render(&double, Features::NONE, camera, &exactly)?));
        }
        let afar = exact.iter().map(|p| averaged(p, AFAR as usize)).collect();
        let plans = plans(&cloud, &settings, gpu.as_ref());
        let (cloud, half) = (Arc::new(cloud.clone()), Arc::new(in_half(&cloud)));
        Ok(Self { cloud, double, half, cameras, photos, exact, afar, settings, gpu, input, repeats, plans })
    }

    /// Draws one view; returns it with the seconds that took.
    fn draw(&mut self, plan: &Plan, camera: &Camera) -> Result<(Planes, f64), StudyError> {
        let mut renderer = Renderer::<f32>::new();
        fn shown<R: Real>((frame, secs): (Frame<R>, f64)) -> (Planes, f64) {
            (planes(&frame), secs)
        }
        let mut cpu = |cloud: &GaussianCloud, camera: &Camera, settings: &RenderSettings| {
            timed(|| renderer.render(cloud, Features::NONE, camera, settings).map_err(failed)).map(shown)
        };
        match plan {
            Plan::Cpu(settings) => cpu(&self.cloud, camera, settings),
            Plan::Half(settings) => cpu(&self.half, camera, settings),
            Plan::Afar(factor, settings) => cpu(&self.cloud, &camera.reduced(*factor), settings),
            Plan::Smaller(factor, settings) => {
                let (small, secs) = cpu(&self.cloud, &camera.reduced(*factor), settings)?;
                let start = Instant::now();
                let large = enlarged(&small, *factor as usize, camera.width_px as usize, camera.height_px as usize);
                Ok((large, secs + start.elapsed().as_secs_f64()))
            }
            Plan::Double(settings) => {
                let mut renderer = Renderer::<f64>::new();
                let draw = || renderer.render(&self.double, Features::NONE, camera, settings).map_err(failed);
                timed(draw).map(shown)
            }
            Plan::Gpu(settings) => {
                let Some(gpu) = &mut self.gpu else { return Err(failed("there is no graphics adapter")) };
                timed(|| gpu.render(&self.cloud, camera, settings).map_err(failed)).map(shown)
            }
            Plan::Kept(degrees, settings) => {
                let turn = glam::DMat3::from_rotation_y(degrees.to_radians());
                let before = Camera { world_from_camera: camera.world_from_camera * turn, ..camera.clone() };
                let keep = RenderSettings { keep_order: true, ..settings.clone() };
                let mut once = |camera: &Camera, s: &RenderSettings| {
                    renderer.render(&self.cloud, Features::NONE, camera, s).map_err(failed)
                };
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

fn plans(cloud: &GaussianCloud, settings: &RenderSettings, gpu: Option<&Backend>) -> Plans<Plan> {
    let s = settings;
    let degree = s.sh_degree.min(cloud.sh_degree);
    let default = format!("CPU, f32, SH {degree}, alpha 1/255, transmittance 1e-4");
    let mut all = vec![(Case::default(default), Plan::Cpu(s.clone()))];
    let mut add = |method: &str, setting: String, knobs: &[(&str, serde_json::Value)], plan: Plan| {
        all.push((Case::new(method, setting, knobs), plan));
    };
    let cut =
        |alpha: f64, transmittance: f64| RenderSettings { cutoffs: Cutoffs { alpha, transmittance }, ..s.clone() };
    for (alpha, name) in
        [(1.0 / 32.0, "1/32"), (1.0 / 64.0, "1/64"), (1.0 / 128.0, "1/128"), (1.0 / 1024.0, "1/1024"), (1e-4, "1e-4")]
    {
        let settings = cut(alpha, Cutoffs::default().transmittance);
        add("alpha cut-off", name.into(), &[("cutoffs", json!(settings.cutoffs))], Plan::Cpu(settings));
    }
    for (least, name) in [(0.1, "0.1"), (1e-2, "1e-2"), (1e-3, "1e-3"), (1e-6, "1e-6")] {
        let settings = cut(Cutoffs::default().alpha, least);
        add("transmittance cut-off", name.into(), &[("cutoffs", json!(settings.cutoffs))], Plan::Cpu(settings));
    }
    for sh_degree in 0..degree {
        let settings = RenderSettings { sh_degree, ..s.clone() };
        add("SH bands", format!("degree {sh_degree}"), &[("sh_degree", json!(sh_degree))], Plan::Cpu(settings));
    }
    add("precision", "16-bit parameters".into(), &[("precision", json!("half"))], Plan::Half(s.clone()));
    add("precision", "f64".into(), &[("precision", json!("double"))], Plan::Double(s.clone()));
    if let Some(gpu) = gpu {
        let name = gpu.name().to_owned();
        add("backend", name, &[("backend", json!("gpu"))], Plan::Gpu(s.clone()));
    }
    for factor in [2, 4] {
        let setting = format!("1/{factor} of the size, enlarged");
        add("resolution", setting, &[("scale", json!(1.0 / f64::from(factor)))], Plan::Smaller(factor, s.clone()));
    }
    for degrees in TURNS {
        let knobs = [("keep_order", json!(true)), ("degrees", json!(degrees))];
        add("sorting", format!("order of a view {degrees}\u{b0} away"), &knobs, Plan::Kept(degrees, s.clone()));
    }
    for antialias in [false, true] {
        let settings = RenderSettings { antialias, ..s.clone() };
        let word = if antialias { "with the filter" } else { "without" };
        let knobs = [("antialias", json!(antialias))];
        add("anti-aliasing from afar", word.into(), &knobs, Plan::Afar(AFAR, settings));
    }
    Plans(all)
}

impl Study for RenderStudy {
    fn stage(&self) -> Stage {
        let error = |name: &str, meaning: &str| Measure::new(name, "", Form::Error, meaning);
        let measures = vec![
            error("RMS error", "root mean square difference of colours, which go from 0 to 1"),
            Measure::new("PSNR", "dB", Form::Decibels, "peak signal to noise ratio, at most 150 dB"),
            error("largest error", "largest difference of a colour"),
            error("99.9 % error", "difference that one colour in a thousand exceeds"),
            error("FLIP", "mean of FLIP, the difference that a person sees when flipping between both"),
            error("FLIP 99 %", "FLIP that one pixel in a hundred exceeds"),
            Measure::new("PSNR in photos", "dB", Form::Decibels, "peak signal to noise ratio in held-out photos"),
            error("RMS error from afar", "as RMS error, of a picture a quarter as wide, against the mean of 4 x 4 px"),
        ];
        // One step of an 8-bit picture.
        let rule = Rule { measure: "RMS error".into(), times: 1.1, floor: 1.0 / 255.0, spare_secs: 0.0 };
        let reference = "pictures are held against the same in double precision without cut-offs";
        stage(StageName::Render, "one picture", reference, &self.input, self.repeats, rule, measures)
    }

    fn cases(&self) -> Vec<Case> {
        self.plans.cases()
    }

    fn run(&mut self, case: &Case, _seed: u64, observer: &mut dyn Observer) -> Result<Option<Trial>, StudyError> {
        let Some(plan) = self.plans.of(case).cloned() else { return Ok(None) };
        let (mut secs, mut errors, mut photos) = (Vec::new(), Vec::new(), Vec::new());
        for (i, camera) in self.cameras.clone().iter().enumerate() {
            if observer.proceed().is_err() {
                return Ok(None);
            }
            let (drawn, took) = self.draw(&plan, camera)?;
            let exact = if matches!(plan, Plan::Afar(..)) { &self.afar[i] } else { &self.exact[i] };
            errors.push(Errors::between(exact, &drawn));
            if let Some(photo) = self.photos[i].as_ref().filter(|p| p.width_px as usize == drawn.width) {
                photos.push(psnr_in_photo(&drawn, photo));
            }
            secs.push(took);
        }
        let mut values = match plan {
            Plan::Afar(..) => vec![("RMS error from afar", Errors::mean(&errors).rms)],
            _ => Errors::mean(&errors).named(),
        };
        if !photos.is_empty() {
            values.push(("PSNR in photos", mean(&photos)));
        }
        Ok(Some(Trial { secs: mean(&secs), values, curve: Vec::new() }))
    }

    fn orders(&mut self, _observer: &mut dyn Observer) -> Result<Vec<Order>, StudyError> {
        let Some(camera) = self.cameras.first() else { return Ok(Vec::new()) };
        let small = camera.limited_to(96);
        let exactly = RenderSettings { cutoffs: EXACT, ..self.settings.clone() };
        Ok(vec![footprint_order(&self.double, &small, &exactly).map_err(failed)?])
    }
}
