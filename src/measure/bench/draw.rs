//! Times of an image on whatever draws it, stage by stage.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::{StageSample, StageValues, views_of};
use crate::pipeline::semantics::query::timing::ms_since;
use crate::render::{DrawError, RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud};

/// Time that a GPU at rest may take to wake up.
pub(super) const WAKING: Duration = Duration::from_millis(300);

/// Draws a cloud `repeats` times, after one that does not count; the copy of the image to the host is included. On a
/// GPU, where timing the stages is not free, they are timed in as many runs of their own.
pub fn frame(
    renderer: &mut Renderer,
    cloud: &Arc<GaussianCloud>,
    camera: &Camera,
    settings: &RenderSettings,
    repeats: usize,
    values: &mut StageValues,
) -> Result<(), DrawError> {
    renderer.draw(cloud, camera, settings)?;
    let is_gpu = renderer.is_gpu();
    if is_gpu {
        on_gpu(renderer, cloud, camera, settings, repeats, values)?;
    }
    let image = if is_gpu { "image, GPU" } else { "image, CPU" };
    for &timed in if is_gpu { &[false, true][..] } else { &[false] } {
        renderer.time_stages(timed)?;
        for _ in 0..repeats {
            let start = Instant::now();
            renderer.draw(cloud, camera, settings)?;
            let ms = ms_since(start);
            if !timed {
                values.add(image, "ms", [ms]);
            }
            for (part, secs) in renderer.stage_times() {
                values.add(&format!("{image}: {part}"), "ms", [1e3 * secs]);
            }
            if !is_gpu {
                let stats = renderer.stats();
                let ([.., blend], products) = (stats.stage_secs, stats.products as f64);
                values.add("image, CPU: products", "", [products]);
                values.add("image, CPU: products while blending", "1/s", [products / blend.max(1e-9)]);
            }
        }
    }
    renderer.time_stages(false)?;
    Ok(())
}

/// Times images as bytes on the host, those that stay on the GPU, one after another without a wait (their mean, with a
/// copy of the last one's bytes, which waits for all), and those that a window of the same device paints.
fn on_gpu(
    renderer: &mut Renderer,
    cloud: &Arc<GaussianCloud>,
    camera: &Camera,
    settings: &RenderSettings,
    repeats: usize,
    values: &mut StageValues,
) -> Result<(), DrawError> {
    let mut many = |frames: usize| {
        let start = Instant::now();
        for _ in 1..frames {
            renderer.draw_on_device(camera, settings)?;
        }
        renderer.draw_rgb8(cloud, camera, settings)?;
        Ok::<_, DrawError>(ms_since(start) / frames as f64)
    };
    // A GPU that rests is given time to wake up.
    let start = Instant::now();
    while start.elapsed() < WAKING && repeats > 1 {
        many(10)?;
    }
    values.add("image that stays there, GPU", "ms", [many(5 * repeats.max(1))?]);
    for _ in 0..repeats {
        values.add("image as bytes, GPU", "ms", [many(1)?]);
    }
    for _ in 0..repeats {
        values.time("image for a window, GPU", || renderer.draw_texture(cloud, camera, settings))?;
    }
    Ok(())
}

/// Times a renderer on a cloud, and a GPU beside the CPU on the labels of the drawn pixels.
pub(crate) fn render(
    mut renderer: Renderer,
    name: &str,
    cloud: &Arc<GaussianCloud>,
    size: [u32; 2],
    repeats: usize,
) -> Result<Vec<StageSample>, DrawError> {
    let mut values = StageValues::on_scene(name, cloud.len(), size);
    let settings = RenderSettings::default();
    // As many as a scene of things has.
    let groups: Vec<u32> = (0..300).collect();
    let of: Vec<u32> = (0..cloud.len() as u32).map(|i| i % 300).collect();
    for camera in views_of(cloud, size[0], size[1]) {
        frame(&mut renderer, cloud, &camera, &settings, repeats, &mut values)?;
        if !renderer.is_gpu() {
            continue;
        }
        renderer.draw_rgb8(cloud, &camera, &settings)?;
        for (renderer, stage) in [(&mut renderer, "labels, GPU"), (&mut Renderer::new(), "labels, CPU")] {
            for _ in 0..repeats.min(5) {
                values.time(stage, || renderer.label_winners(cloud, (&of, &groups), &camera, &settings))?;
            }
        }
    }
    Ok(values.samples())
}
