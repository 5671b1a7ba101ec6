//! Which renderer works: the GPU where there is a real one, else the CPU.

use std::sync::{Arc, Weak};

use serde::{Deserialize, Serialize};

use super::gpu::{self, GpuError};
use super::{Features, Frame, RenderError, RenderSettings, StageTimes, cpu};
use crate::scene::{Camera, GaussianCloud};

/// Which renderer is wanted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum BackendChoice {
    /// The GPU if the machine has a real one, else the CPU.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// The GPU, even a software one.
    Gpu,
}

impl BackendChoice {
    /// The GPU to use; `None` = the CPU. `Auto` takes a GPU only if it is a real one: the CPU
    /// renderer is faster than an emulated GPU.
    ///
    /// # Errors
    /// If a GPU is demanded and there is none.
    pub fn gpu(self) -> Result<Option<gpu::Context>, GpuError> {
        match self {
            Self::Cpu => Ok(None),
            Self::Gpu => gpu::Context::new().map(Some),
            Self::Auto => Ok(gpu::Context::real()),
        }
    }
}

/// Why a view could not be drawn.
#[derive(Debug, thiserror::Error)]
pub enum DrawError {
    /// By the CPU.
    #[error(transparent)]
    Cpu(#[from] RenderError),
    /// By the GPU.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

/// Stages of a picture on the CPU, in their order.
const STAGES: [&str; 4] = ["project", "sort", "bin", "blend"];

/// Seconds of a picture: the part that every Gaussian has at any size, and that of the pixels.
#[derive(Clone, Copy, Debug)]
pub struct Cost {
    /// For every Gaussian, whatever the picture's size.
    pub fixed_secs: f64,
    /// For the pixels.
    pub pixels_secs: f64,
}

/// One of the renderers, with its buffers.
pub enum Backend {
    /// The CPU.
    Cpu(Box<cpu::Renderer<f32>>),
    /// A GPU.
    Gpu(Box<Gpu>),
}

/// The GPU renderer and the cloud that it holds.
pub struct Gpu {
    renderer: gpu::Renderer,
    name: String,
    uploaded: Weak<GaussianCloud>,
    /// Degree of the harmonics that were sent.
    degree: u8,
    timed: bool,
}

impl Backend {
    /// Name of the CPU among the names of what draws.
    pub const CPU: &str = "CPU";

    /// The renderer that `choice` asks for.
    ///
    /// # Errors
    /// If a GPU is demanded and there is none that works.
    pub fn choose(choice: BackendChoice) -> Result<Self, GpuError> {
        match choice.gpu() {
            Ok(None) => Ok(Self::on_cpu()),
            Ok(Some(context)) if choice == BackendChoice::Auto => {
                Ok(Self::on_gpu(&context).unwrap_or_else(|_| Self::on_cpu()))
            }
            Ok(Some(context)) => Self::on_gpu(&context),
            Err(e) => Err(e),
        }
    }

    /// The CPU.
    pub fn on_cpu() -> Self {
        Self::Cpu(Box::new(cpu::Renderer::new()))
    }

    /// This GPU, whether real or emulated.
    pub fn on_gpu(context: &gpu::Context) -> Result<Self, GpuError> {
        let renderer = gpu::Renderer::new(context)?;
        Ok(Self::Gpu(Box::new(Gpu {
            renderer,
            name: context.info().name.clone(),
            uploaded: Weak::new(),
            degree: 0,
            timed: false,
        })))
    }

    /// Its name, for people.
    pub fn name(&self) -> &str {
        match self {
            Self::Cpu(_) => Self::CPU,
            Self::Gpu(gpu) => &gpu.name,
        }
    }

    /// Draws a cloud; it is sent to the GPU only if it is another one than last time.
    pub fn render(
        &mut self,
        cloud: &Arc<GaussianCloud>,
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Result<Frame<f32>, DrawError> {
        match self {
            Self::Cpu(renderer) => Ok(renderer.render(cloud, Features::NONE, camera, settings)?),
            Self::Gpu(gpu) => {
                camera.validate().map_err(RenderError::from)?;
                // Bands that are not drawn are not sent.
                let degree = settings.sh_degree.min(cloud.sh_degree);
                if gpu.uploaded.as_ptr() != Arc::as_ptr(cloud) || gpu.degree < degree {
                    gpu.uploaded = Weak::new();
                    gpu.renderer.upload_bands(cloud, Features::NONE, degree)?;
                    // A weak handle keeps the address from being given to another cloud.
                    (gpu.uploaded, gpu.degree) = (Arc::downgrade(cloud), degree);
                }
                Ok(gpu.renderer.draw(camera, settings)?)
            }
        }
    }

    /// Gives back working memory that the next picture can make again: on the CPU all of it; a
    /// device keeps its own, which nobody else needs.
    pub fn rest(&mut self) {
        if let Self::Cpu(renderer) = self {
            **renderer = cpu::Renderer::new();
        }
    }

    /// Bytes of buffers on the device; 0 on the CPU.
    pub fn device_bytes(&self) -> u64 {
        match self {
            Self::Cpu(_) => 0,
            Self::Gpu(gpu) => gpu.renderer.device_bytes(),
        }
    }

    /// Whether the stages of later pictures are timed. The CPU always does; a GPU does it only where
    /// it is asked to, and can.
    ///
    /// # Errors
    /// If the GPU gives no memory for it.
    pub fn time_stages(&mut self, timed: bool) -> Result<(), GpuError> {
        let Self::Gpu(gpu) = self else { return Ok(()) };
        if std::mem::replace(&mut gpu.timed, timed) != timed {
            match timed {
                true => gpu.renderer.measure()?,
                false => gpu.renderer.stop_measuring(),
            }
        }
        Ok(())
    }

    /// Seconds of the last picture by stage; empty where that is not known.
    pub fn stage_times(&self) -> StageTimes {
        match self {
            Self::Cpu(renderer) => STAGES.into_iter().zip(renderer.stats().stage_secs).collect(),
            Self::Gpu(gpu) => gpu.renderer.times().clone(),
        }
    }

    /// What the last picture cost, `secs` in all.
    pub fn cost(&self, secs: f64) -> Cost {
        match self {
            Self::Cpu(renderer) => {
                let [project, sort, bin, blend] = renderer.stats().stage_secs;
                Cost { fixed_secs: project + sort, pixels_secs: bin + blend }
            }
            Self::Gpu(_) => Cost { fixed_secs: 0.0, pixels_secs: secs },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn dots(shift: f32) -> Arc<GaussianCloud> {
        let n = 60;
        Arc::new(GaussianCloud {
            positions: (0..n).map(|i| [(i % 8) as f32 * 0.1 - 0.4 + shift, (i / 8) as f32 * 0.1 - 0.4, 0.0]).collect(),
            log_scales: vec![[-3.0; 3]; n],
            quaternions: vec![[1.0, 0.0, 0.0, 0.0]; n],
            opacity_logits: vec![1.0; n],
            sh: (0..n).map(|i| [(i % 3) as f32 * 0.5, 0.2, 0.4]).collect(),
            ..GaussianCloud::default()
        })
    }

    #[test]
    fn gpu_and_cpu_draw_the_same_view_and_follow_the_cloud() {
        let Ok(context) = gpu::Context::new() else {
            println!("skipped: no GPU adapter, not even a software one");
            return;
        };
        let mut gpu = Backend::on_gpu(&context).expect("opens");
        let mut cpu = Backend::on_cpu();
        let camera =
            Camera::look_at(DVec3::new(0.2, 0.1, -2.0), DVec3::ZERO, DVec3::NEG_Y, 0.8, 64, 48).expect("valid");
        let settings = RenderSettings { depth: true, ..RenderSettings::default() };
        let mut worst = |cloud: &Arc<GaussianCloud>, on_cpu: &Arc<GaussianCloud>| {
            let a = gpu.render(cloud, &camera, &settings).expect("draws");
            let b = cpu.render(on_cpu, &camera, &settings).expect("draws");
            a.color.iter().flatten().zip(b.color.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
        };
        let (one, other) = (dots(0.0), dots(0.07));
        assert!(worst(&one, &one) < 1e-3);
        assert!(worst(&other, &other) < 1e-3, "the other cloud was sent");
        assert!(worst(&other, &one) > 0.1, "another scene must differ");
        let names: Vec<&str> = cpu.stage_times().iter().map(|s| s.0).collect();
        assert_eq!(names, ["project", "sort", "bin", "blend"]);
        assert!(gpu.stage_times().is_empty(), "nobody asked for them");
        gpu.time_stages(true).expect("has room");
        gpu.render(&one, &camera, &settings).expect("draws");
        assert_eq!(gpu.stage_times().is_empty(), !context.has_timestamps());
        gpu.time_stages(false).expect("stops");
        assert!(gpu.stage_times().is_empty());
    }
}
