//! Loss, optimizer and whole training steps on the GPU against the CPU.

use crate::common::{camera, random_cloud, rng};
use crate::gpu_common::compare::{INTERIOR, agree};
use crate::gpu_common::with_context;
use fmlgs::render::cpu::adam::AdamStep;
use fmlgs::render::cpu::adam::Rates;
use fmlgs::render::cpu::ssim::PhotoLoss;
use fmlgs::render::gpu::ssim::photo_loss;
use fmlgs::render::gpu::{Device, GpuError, GpuTrainer, Parameters, TrainerSettings};
use fmlgs::render::{Features, FrameGradient, RenderSettings, cpu};
use fmlgs::scene::{Camera, GaussianCloud, PhotoPixels};
use rand::RngExt;

const LAMBDA: f64 = 0.2;

/// Color that another background adds where a photo is transparent.
const SHIFT: [f32; 3] = [0.3, -0.2, 0.7];

fn noise_photo(size: [u32; 2], covered: bool, seed: u64) -> PhotoPixels {
    let mut r = rng(seed);
    let pixels = (size[0] * size[1]) as usize;
    PhotoPixels {
        width_px: size[0],
        height_px: size[1],
        rgb: (0..pixels).map(|_| std::array::from_fn(|_| r.random_range(0..=255))).collect(),
        coverage: covered.then(|| (0..pixels).map(|i| if i % 7 == 0 { 0 } else { (i % 256) as u8 }).collect()),
        alpha: covered.then(|| (0..pixels).map(|i| (i * 31 % 256) as u8).collect()),
    }
}

/// Loss and gradient in f64 as the CPU trainer forms them: the picture faded toward the photo
/// where that is not covered, the photo before another color where it is transparent.
fn oracle(rendered: &[[f64; 3]], photo: &PhotoPixels) -> (f64, Vec<f64>) {
    let share = |i: usize| photo.coverage.as_ref().map_or(1.0, |c| f64::from(c[i]) / 255.0);
    let mut gradient = vec![0.0; rendered.len() * 3];
    let mut total = 0.0;
    for c in 0..3 {
        let clear = |i: usize| photo.alpha.as_ref().map_or(0.0, |a| 1.0 - f64::from(a[i]) / 255.0);
        let wanted = |(i, p): (usize, &[u8; 3])| f64::from(p[c]) / 255.0 + clear(i) * f64::from(SHIFT[c]);
        let want: Vec<f64> = photo.rgb.iter().enumerate().map(wanted).collect();
        let have: Vec<f64> = (0..want.len()).map(|i| want[i] + share(i) * (rendered[i][c] - want[i])).collect();
        let mut own = vec![0.0; want.len()];
        let width = photo.width_px as usize;
        let parts = PhotoLoss::default().channel(&have, &want, width, LAMBDA, 3, &mut own);
        total += parts.total(LAMBDA) / 3.0;
        own.iter().enumerate().for_each(|(i, g)| gradient[i * 3 + c] = g * share(i));
    }
    (total, gradient)
}

#[test]
fn loss_and_gradient_match_the_oracle() {
    with_context(|context| {
        for (size, covered) in [([37, 21], false), ([16, 16], true), ([50, 33], true)] {
            let photo = noise_photo(size, covered, 4);
            let mut r = rng(8);
            let rendered: Vec<[f32; 3]> =
                photo.rgb.iter().map(|_| std::array::from_fn(|_| r.random_range(-0.1..1.1))).collect();
            let wide: Vec<[f64; 3]> = rendered.iter().map(|p| p.map(f64::from)).collect();
            let (loss, gradient) = oracle(&wide, &photo);
            let (sums, ours) = photo_loss(context, &rendered, &photo, LAMBDA, SHIFT).unwrap();
            assert!((sums.total(LAMBDA) - loss).abs() < 1e-5 * loss, "{} {loss}", sums.total(LAMBDA));
            let all = vec![true; gradient.len()];
            agree("gradient", ours.as_flattened(), &gradient, &all, INTERIOR).unwrap();
            // Negative controls: another photo, another weight, other coverage.
            let other = noise_photo(size, covered, 5);
            let (sums, theirs) = photo_loss(context, &rendered, &other, LAMBDA, SHIFT).unwrap();
            assert!((sums.total(LAMBDA) - loss).abs() > 1e-4 * loss);
            assert!(agree("another photo", theirs.as_flattened(), &gradient, &all, INTERIOR).is_err());
            let (_, theirs) = photo_loss(context, &rendered, &photo, 0.3, SHIFT).unwrap();
            assert!(agree("another weight", theirs.as_flattened(), &gradient, &all, INTERIOR).is_err());
            let bare = noise_photo(size, !covered, 4);
            let (_, theirs) = photo_loss(context, &rendered, &bare, LAMBDA, SHIFT).unwrap();
            assert!(agree("other coverage", theirs.as_flattened(), &gradient, &all, INTERIOR).is_err());
            let (sums, _) = photo_loss(context, &rendered, &photo, LAMBDA, [0.0; 3]).unwrap();
            let another_color = (sums.total(LAMBDA) - loss).abs() > 1e-4 * loss;
            assert_eq!(another_color, covered, "only transparent pixels see another color");
        }
    });
}

/// A cloud to train and a photo of the cloud that it should become.
struct Lesson {
    cloud: GaussianCloud,
    photo: PhotoPixels,
    camera: Camera,
    rates: Rates,
}

impl Lesson {
    fn new(degree: u8) -> Self {
        let camera = camera(48, 36);
        let truth: GaussianCloud = random_cloud(80, degree, 0.2, 11).cast();
        let settings = RenderSettings::default();
        let frame = cpu::CpuRenderer::<f32>::new().render(&truth, Features::NONE, &camera, &settings).unwrap();
        let photo = PhotoPixels { width_px: 48, height_px: 36, rgb: frame.to_rgb8(), coverage: None, alpha: None };
        let mut cloud = truth;
        cloud.sh.iter_mut().for_each(|c| *c = c.map(|v| 0.3 * v));
        cloud.positions.iter_mut().for_each(|p| p[1] += 0.05);
        let rates = Rates {
            position: 2e-3,
            log_scale: 5e-3,
            quaternion: 1e-3,
            opacity_logit: 2e-2,
            sh_constant: 2e-2,
            sh_rest: 1e-3,
        };
        Self { cloud, photo, camera, rates }
    }

    /// Adam step `t` from a first moment of 0 and this second moment, in f64 up to the gradient:
    /// parameters, group by group; lengths of screen gradients; number of outliers.
    fn stepped(
        &self,
        settings: &RenderSettings,
        gradient: &FrameGradient<f64>,
        t: u64,
        second: f32,
    ) -> (GaussianCloud, Vec<f32>, usize) {
        let wide = self.cloud.cast::<f64>();
        let mut renderer = cpu::CpuRenderer::new();
        renderer.render(&wide, Features::NONE, &self.camera, settings).unwrap();
        let g = renderer.backward(&wide, Features::NONE, gradient);
        let adam = AdamStep::new(t);
        let (mut out, mut outliers) = (self.cloud.clone(), 0);
        let mut step = |p: &mut f32, g: f64, rate: f32| {
            outliers += usize::from(adam.update(p, g as f32, &mut 0.0, &mut { second }, rate));
        };
        for i in 0..out.len() {
            if g.screen[i] == 0.0 {
                continue;
            }
            (0..3).for_each(|k| step(&mut out.positions[i][k], g.positions[i][k], self.rates.position));
            (0..3).for_each(|k| step(&mut out.log_scales[i][k], g.log_scales[i][k], self.rates.log_scale));
            (0..4).for_each(|k| step(&mut out.quaternions[i][k], g.quaternions[i][k], self.rates.quaternion));
            step(&mut out.opacity_logits[i], g.opacity_logits[i], self.rates.opacity_logit);
            let active = fmlgs::math::sh::coefficients(settings.sh_degree);
            for k in 0..active {
                let at = i * out.sh_stride() + k;
                let rate = if k == 0 { self.rates.sh_constant } else { self.rates.sh_rest };
                (0..3).for_each(|c| step(&mut out.sh[at][c], g.sh[at][c], rate));
            }
        }
        (out, g.screen.iter().map(|&s| s as f32).collect(), outliers)
    }
}

/// Share of parameters whose step differs by more than a tenth of the rate. Adam's first step has
/// the rate's length in the sign of the gradient, so parameters with next to none may go either way.
fn strays(ours: &GaussianCloud, theirs: &GaussianCloud, rates: &Rates) -> f64 {
    let mut wrong = 0;
    let mut all = 0;
    let mut count = |a: &[f32], b: &[f32], rate: f32| {
        all += a.len();
        wrong += a.iter().zip(b).filter(|(x, y)| (**x - **y).abs() > 0.1 * rate).count();
    };
    count(ours.positions.as_flattened(), theirs.positions.as_flattened(), rates.position);
    count(ours.log_scales.as_flattened(), theirs.log_scales.as_flattened(), rates.log_scale);
    count(ours.quaternions.as_flattened(), theirs.quaternions.as_flattened(), rates.quaternion);
    count(&ours.opacity_logits, &theirs.opacity_logits, rates.opacity_logit);
    count(ours.sh.as_flattened(), theirs.sh.as_flattened(), rates.sh_rest);
    f64::from(wrong as u32) / f64::from(all as u32)
}

/// Interleaved channels as the gradient of a frame.
fn of_planes(flat: &[f64]) -> FrameGradient<f64> {
    let plane = |c: usize| flat.iter().skip(c).step_by(3).copied().collect::<Vec<f64>>();
    FrameGradient { color: [plane(0), plane(1), plane(2)], ..FrameGradient::default() }
}

#[test]
fn outliers_are_cut_and_counted_as_on_the_cpu() {
    with_context(|context| {
        let lesson = Lesson::new(0);
        let settings = RenderSettings { sh_degree: 0, ..RenderSettings::default() };
        let frame =
            cpu::CpuRenderer::new().render(&lesson.cloud.cast(), Features::NONE, &lesson.camera, &settings).unwrap();
        let [r, g, b] = &frame.color;
        let picture: Vec<[f64; 3]> = (0..r.len()).map(|i| [r[i], g[i], b[i]]).collect();
        let gradient = of_planes(&oracle(&picture, &lesson.photo).1);
        let photo = &lesson.photo;
        let t = 2_000;
        let stepped = |seen: f32| {
            let mut second = lesson.cloud.clone();
            second.positions.fill([seen; 3]);
            second.log_scales.fill([seen; 3]);
            second.quaternions.fill([seen; 4]);
            second.opacity_logits.fill(seen);
            second.sh.fill([seen; 3]);
            let mut first = second.clone();
            for v in [&mut first.positions, &mut first.log_scales, &mut first.sh] {
                v.fill([0.0; 3]);
            }
            first.quaternions.fill([0.0; 4]);
            first.opacity_logits.fill(0.0);
            let mut trainer = GpuTrainer::new(context, &lesson.cloud, TrainerSettings::default()).unwrap();
            trainer.upload(&lesson.cloud, Some([&first, &second]), t).unwrap();
            let photo = trainer.photo(photo).unwrap();
            trainer.step(&lesson.camera, &photo, &lesson.rates, 0).unwrap();
            let told = trainer.metrics().unwrap()[0].sums.outliers as usize;
            (trainer.cloud().unwrap(), told)
        };
        // Moments that have seen next to nothing: every gradient is far above them, and is cut.
        let (want, _, outliers) = lesson.stepped(&settings, &gradient, t + 1, 1e-24);
        let (got, told) = stepped(1e-24);
        assert_eq!((told, outliers), (0, 0));
        let share = strays(&got, &want, &lesson.rates);
        assert!(share < 0.01, "{share} of the parameters went astray");
        // Negative control: without anything seen the step is longer by far.
        let (plain, ..) = lesson.stepped(&settings, &gradient, t + 1, 0.0);
        assert!(strays(&plain, &want, &lesson.rates) > 0.5);
        // So far above that they are counted.
        let (_, _, outliers) = lesson.stepped(&settings, &gradient, t + 1, 1e-36);
        let (_, told) = stepped(1e-36);
        assert!(outliers > 100 && told.abs_diff(outliers) * 20 < outliers, "{told} of {outliers}");
        let mut trainer = GpuTrainer::new(context, &lesson.cloud, TrainerSettings::default()).unwrap();
        let photo = trainer.photo(photo).unwrap();
        // Ordinary steps have none.
        (0..20).for_each(|_| trainer.step(&lesson.camera, &photo, &lesson.rates, 0).unwrap());
        assert!(trainer.metrics().unwrap().iter().all(|m| m.sums.outliers == 0));
    });
}

#[test]
fn one_step_moves_every_group_as_the_cpu_does() {
    with_context(|context| {
        let lesson = Lesson::new(3);
        let settings = RenderSettings { sh_degree: 2, ..RenderSettings::default() };
        let wide = lesson.cloud.cast::<f64>();
        let frame = cpu::CpuRenderer::new().render(&wide, Features::NONE, &lesson.camera, &settings).unwrap();
        let [r, g, b] = &frame.color;
        let picture: Vec<[f64; 3]> = (0..r.len()).map(|i| [r[i], g[i], b[i]]).collect();
        let (loss, flat) = oracle(&picture, &lesson.photo);
        let gradient = of_planes(&flat);
        let (want, screen, _) = lesson.stepped(&settings, &gradient, 1, 0.0);

        let mut trainer = GpuTrainer::new(context, &lesson.cloud, TrainerSettings::default()).unwrap();
        let photo = trainer.photo(&lesson.photo).unwrap();
        trainer.step(&lesson.camera, &photo, &lesson.rates, 2).unwrap();
        let found = trainer.metrics().unwrap();
        assert!(found.len() == 1 && found[0].step == 1);
        assert!((found[0].loss - loss).abs() < 1e-4 * loss, "{} {loss}", found[0].loss);
        let got = trainer.cloud().unwrap();
        let share = strays(&got, &want, &lesson.rates);
        assert!(share < 0.01, "{share} of the parameters went astray");
        assert!(strays(&lesson.cloud, &want, &lesson.rates) > 0.5, "the comparison sees a step that was not made");
        // Bands above the active one have not moved.
        let stride = got.sh_stride();
        assert!(
            (0..got.len())
                .all(|i| got.sh[i * stride + 9..(i + 1) * stride] == lesson.cloud.sh[i * stride + 9..(i + 1) * stride])
        );
        let stats = trainer.stats().unwrap();
        let screen64: Vec<f64> = screen.iter().map(|&s| f64::from(s)).collect();
        let bounds = crate::gpu_common::compare::BOUNDARY;
        agree("screen gradients", &stats.gradient, &screen64, &[true; 80], bounds).unwrap();
        assert!(stats.seen.iter().all(|&s| s <= 1) && stats.seen.iter().sum::<u32>() > 60);
    });
}

#[test]
fn training_lowers_the_loss_and_survives_down_and_up() {
    with_context(|context| {
        let lesson = Lesson::new(1);
        let run = |trainer: &mut GpuTrainer, steps: usize| {
            let photo = trainer.photo(&lesson.photo).unwrap();
            for _ in 0..steps {
                trainer.step(&lesson.camera, &photo, &lesson.rates, 1).unwrap();
            }
            trainer.metrics().unwrap().iter().map(|m| m.loss).collect::<Vec<_>>()
        };
        let mut trainer = GpuTrainer::new(context, &lesson.cloud, TrainerSettings::default()).unwrap();
        let losses = run(&mut trainer, 70);
        assert_eq!(losses.len(), 70, "more steps than the ring holds are all told");
        assert!(losses[69] < 0.5 * losses[0], "{} to {}", losses[0], losses[69]);
        // The same state in a new trainer goes on in the same way; without its moments it does not.
        let (cloud, [first, second]) = trainer.download().unwrap();
        cloud.validate().unwrap();
        assert!(first.sh[0] != [0.0; 3] && second.sh.iter().flatten().all(|&v| v >= 0.0));
        let mut copy = GpuTrainer::new(context, &lesson.cloud, TrainerSettings::default()).unwrap();
        copy.upload(&cloud, Some([&first, &second]), 70).unwrap();
        let mut forgetful = GpuTrainer::new(context, &lesson.cloud, TrainerSettings::default()).unwrap();
        forgetful.upload(&cloud, None, 70).unwrap();
        let [a, b, c] = [&mut trainer, &mut copy, &mut forgetful].map(|t| run(t, 3)[2]);
        assert!((a - b).abs() < 2e-3 * a, "{a} {b}");
        assert!((a - c).abs() > 2e-3 * a, "{a} {c}");
        assert_eq!(copy.steps(), 73);
    });
}

#[test]
fn a_step_that_does_not_fit_is_skipped_told_and_made_up_for() {
    with_context(|context| {
        // Far away everything is small; close by the same cloud needs many times the pairs.
        let mut lesson = Lesson::new(0);
        lesson.cloud.log_scales.iter_mut().for_each(|s| *s = [-0.5; 3]);
        let mut far = lesson.camera.resized(480, 360);
        far.center *= 60.0;
        let near = lesson.camera.resized(480, 360);
        let photo = noise_photo([480, 360], false, 1);
        let mut trainer = GpuTrainer::new(context, &lesson.cloud, TrainerSettings::default()).unwrap();
        let photo = trainer.photo(&photo).unwrap();
        trainer.step(&far, &photo, &lesson.rates, 0).unwrap();
        let before = trainer.cloud().unwrap();
        trainer.step(&near, &photo, &lesson.rates, 0).unwrap();
        let told = trainer.metrics().unwrap();
        assert!(!told[0].sums.overflow && told[1].sums.overflow, "{told:?}");
        assert_eq!(trainer.cloud().unwrap(), before, "nothing moved");
        trainer.step(&near, &photo, &lesson.rates, 0).unwrap();
        let told = trainer.metrics().unwrap();
        assert!(!told[0].sums.overflow && told[0].sums.wanted > 1024, "{told:?}");
        assert_ne!(trainer.cloud().unwrap(), before, "now it moved");
    });
}

#[test]
fn more_than_a_binding_holds_is_refused_with_the_numbers() {
    with_context(|context| {
        let limit = context.limits().max_storage_buffer_binding_size;
        // Degrees 0 to 2 take 108 bytes a Gaussian.
        let n = (limit / 108 + 1) as usize;
        match Parameters::new(context, "cloud", n, 3) {
            Err(GpuError::Limit { need, limit: l, limit_name, .. }) => {
                assert!(need > limit && l == limit && limit_name == "maxStorageBufferBindingSize");
            }
            other => panic!("{other:?}"),
        }
        // 699,050 Gaussians of degree 3 in one f32 array would fill 128 MiB.
        if context.is_software() {
            Parameters::new(context, "cloud", 800_000, 3).unwrap();
        }
    });
}

#[test]
fn a_lost_device_is_an_error_and_no_panic() {
    with_context(|_| {
        let own = Device::new().unwrap();
        let lesson = Lesson::new(0);
        let mut trainer = GpuTrainer::new(&own, &lesson.cloud, TrainerSettings::default()).unwrap();
        let photo = trainer.photo(&lesson.photo).unwrap();
        trainer.step(&lesson.camera, &photo, &lesson.rates, 0).unwrap();
        trainer.metrics().unwrap();
        own.wgpu().destroy();
        let stepped = trainer.step(&lesson.camera, &photo, &lesson.rates, 0);
        let told = trainer.metrics();
        assert!(stepped.is_err() || told.is_err(), "{stepped:?} {told:?}");
        assert!(trainer.cloud().is_err());
    });
}

#[test]
fn stages_are_measured() {
    use fmlgs::measure::bench::{StageSample, StageValues, draw::frame, train::training_step};
    with_context(|context| {
        let lesson = Lesson::new(0);
        let mut renderer = fmlgs::render::Renderer::on_gpu(context).unwrap();
        let cloud = std::sync::Arc::new(lesson.cloud.clone());
        let mut values = StageValues::new("a lesson".into());
        frame(&mut renderer, &cloud, &lesson.camera, &RenderSettings::default(), 3, &mut values).unwrap();
        training_step(context, &lesson.cloud, &lesson.camera, &lesson.photo, 3, &mut values).unwrap();
        let samples = values.samples();
        // A software adapter may find no time between two stages of an image.
        let takes_time = |s: &StageSample| s.median > 0.0 || s.stage.starts_with("image, GPU: ");
        assert!(samples.iter().all(|s| s.unit == "ms" && takes_time(s) && s.median < 1e4), "{samples:?}");
        let parts = |of: &str| samples.iter().filter_map(|s| s.stage.strip_prefix(of)).collect::<Vec<_>>();
        assert_eq!([parts("image, GPU"), parts("training step, GPU")].map(|all| all[0]), ["", ""], "the whole");
        if context.has_timestamps() {
            assert_eq!(parts("image, GPU: "), ["project", "sort by depth", "bin", "sort by tile", "blend"]);
            let backward = ["loss", "blend backward", "project backward", "adam"];
            assert_eq!(parts("training step, GPU: ")[5..], backward);
        } else {
            assert!(parts("image, GPU: ").is_empty());
        }
    });
}
