//! Which renderer draws for the command line.

use super::CliError;
use crate::pipeline::train::BackendChoice;
use crate::render::gpu::{self, Context};
use crate::render::{Features, Frame, RenderSettings, cpu};
use crate::scene::{Camera, GaussianCloud};

/// A renderer on the chosen backend.
pub enum Painter {
    /// The CPU.
    Cpu(cpu::Renderer<f32>),
    /// A GPU, possibly a software one.
    Gpu(Box<gpu::Renderer>),
}

impl Painter {
    /// The renderer that `choice` asks for, and what it is, for people. `Auto` takes a GPU only if
    /// it is a real one: the CPU renderer is faster than an emulated GPU.
    pub fn new(choice: BackendChoice) -> Result<(Self, String), CliError> {
        let on_cpu = || (Self::Cpu(cpu::Renderer::new()), "CPU".to_owned());
        let on_gpu = |context: &Context| -> Result<_, CliError> {
            Ok((Self::Gpu(Box::new(gpu::Renderer::new(context)?)), context.describe()))
        };
        match choice {
            BackendChoice::Cpu => Ok(on_cpu()),
            BackendChoice::Gpu => on_gpu(&Context::new()?),
            BackendChoice::Auto => match Context::new() {
                Ok(context) if !context.is_software() => on_gpu(&context),
                _ => Ok(on_cpu()),
            },
        }
    }

    /// Draws `cloud` as `camera` sees it.
    pub fn draw(
        &mut self,
        cloud: &GaussianCloud,
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Result<Frame<f32>, CliError> {
        Ok(match self {
            Self::Cpu(renderer) => renderer.render(cloud, Features::NONE, camera, settings)?,
            Self::Gpu(renderer) => renderer.render(cloud, Features::NONE, camera, settings)?,
        })
    }
}
