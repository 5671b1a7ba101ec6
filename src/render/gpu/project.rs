//! Gaussians to splats in the picture; `shaders/project.wgsl`.

use super::kernel::{Access, FrameBindings, Kernel, Module, RecordedStage};
use super::layout::View;
use super::scratch::PerGaussian;
use super::shader::ShaderVariant;
use super::{Device, GpuError, Parameters};
use crate::render::{RenderSettings, TANGENT_CLAMP, TILE_PX};
use crate::scene::Camera;

#[derive(Debug)]
pub(crate) struct Project {
    kernel: Kernel,
}

impl Project {
    pub(crate) fn new(device: &Device) -> Result<Self, GpuError> {
        use Access::{Read, Uniform, Write};
        let module = Module::new(device, "project", ShaderVariant::default())?;
        let slots =
            [(0, Uniform), (1, Read), (2, Read), (3, Read), (4, Write), (5, Write), (6, Write), (7, Write), (8, Write)];
        Ok(Self { kernel: Kernel::new(device, &module, "main", &slots)? })
    }

    pub(crate) fn encode(
        &self,
        stage: &mut RecordedStage<'_>,
        bindings: FrameBindings<'_>,
        cloud: &Parameters,
        scratch: &PerGaussian,
    ) {
        let [geometry, low, high] = &cloud.buffers;
        let by_depth = &scratch.by_depth;
        let buffers = [
            bindings.view,
            geometry,
            low,
            high,
            &scratch.splats,
            &by_depth.keys[0],
            &by_depth.values[0],
            &scratch.tile_counts,
            bindings.counters,
        ];
        stage.run_flat(&self.kernel, &buffers, u64::from(bindings.gaussians.div_ceil(256)));
    }
}

/// Camera data for the kernels. `capacity` is the number of (splat, tile) pairs that fit, `channels` the extra channels
/// per Gaussian.
pub(crate) fn view(
    camera: &Camera,
    settings: &RenderSettings,
    cloud: CloudShape,
    channels: u32,
    capacity: u32,
) -> View {
    let axis = |a: glam::DVec3| [a.x as f32, a.y as f32, a.z as f32, 0.0];
    let m = camera.world_from_camera;
    let offset = cloud.origin - camera.center;
    let hi = offset.as_vec3();
    let lo = (offset - hi.as_dvec3()).as_vec3();
    let size = glam::DVec2::new(f64::from(camera.width_px), f64::from(camera.height_px));
    let tangent = (TANGENT_CLAMP * 0.5 * size / camera.focal_px).as_vec2();
    let [r, g, b] = settings.background;
    let tiles = |side: u32| side.div_ceil(TILE_PX as u32);
    View {
        right: axis(m.x_axis),
        down: axis(m.y_axis),
        forward: axis(m.z_axis),
        offset_hi: hi.extend(0.0).to_array(),
        offset_lo: lo.extend(0.0).to_array(),
        background: [r, g, b, 0.0],
        focal: camera.focal_px.as_vec2().to_array(),
        principal: camera.principal_px.as_vec2().to_array(),
        tangent_min: (-tangent).to_array(),
        tangent_max: tangent.to_array(),
        size_px: [camera.width_px, camera.height_px],
        tiles: [tiles(camera.width_px), tiles(camera.height_px)],
        gaussians: cloud.gaussians,
        sh_degree: u32::from(settings.sh_degree),
        sh_stored: u32::from(cloud.degree),
        capacity,
        near: settings.near as f32,
        antialias: u32::from(settings.antialias),
        channels,
        blur: settings.blur_px2 as f32,
    }
}

/// Data of a cloud on the device that a view needs.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct CloudShape {
    /// World position that the Gaussians are relative to.
    pub(crate) origin: glam::DVec3,
    pub(crate) gaussians: u32,
    /// Spherical-harmonics degree that is stored.
    pub(crate) degree: u8,
}
