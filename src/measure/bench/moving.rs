//! Drawing of many Gaussians while the camera moves: its time, and its PSNR against the picture of all of them.

use std::sync::Arc;
use std::time::Instant;

use super::super::image_error::{planes, resized};
use super::{StageSample, StageValues, views_of};
use crate::math::resize::Filter;
use crate::math::stats::{mean, psnr_of};
use crate::render::lod::{self, MOVING_SECS, Pace};
use crate::render::{DrawError, RenderSettings, Renderer};
use crate::scene::GaussianCloud;

/// Pictures in which the pace settles before any counts.
const SETTLE: usize = 40;

/// Moves at three views of a cloud as the window does, `repeats` pictures each after its pace has settled.
pub(crate) fn time(
    name: &str,
    cloud: &Arc<GaussianCloud>,
    size: [u32; 2],
    repeats: usize,
) -> Result<Vec<StageSample>, DrawError> {
    let mut values = StageValues::on_scene(name, cloud.len(), size);
    let each = 1.0 / cloud.len().max(1) as f64;
    let start = Instant::now();
    // Nobody stops it.
    let tree = Arc::new(lod::build(cloud, || true).unwrap_or_default());
    values.add("tree, for a million Gaussians", "s", [1e6 * each * start.elapsed().as_secs_f64()]);
    values.add("tree, for each Gaussian", "B", [each * tree.bytes() as f64]);
    values.add("Gaussian", "B", [each * cloud.bytes() as f64]);
    let settings = RenderSettings::of_mode(cloud.render_mode);
    let mut renderer = Renderer::new();
    let mut pace = Pace::default();
    for (view, camera) in views_of(cloud, size[0], size[1]).iter().enumerate() {
        renderer.limit_to(None);
        let all = values.time("image at rest", || renderer.draw(cloud, camera, &settings).map(|f| planes(&f)))?;
        for k in 0..SETTLE + repeats.max(1) {
            let start = Instant::now();
            let smaller = pace.camera(camera);
            let cut = Arc::new(pace.cut(&tree, &smaller, settings.near));
            renderer.limit_to(Some(Arc::clone(&cut)));
            let frame = renderer.draw(cloud, &smaller, &settings)?;
            let secs = start.elapsed().as_secs_f64();
            pace.learn(secs, MOVING_SECS);
            if k >= SETTLE {
                values.add("moving image", "ms", [1e3 * secs]);
                values.add("moving image: Gaussians and nodes", "", [cut.len() as f64]);
            }
            if k + 1 == SETTLE + repeats.max(1) {
                let shown = resized(&planes(&frame), camera, Filter::Bilinear);
                let pairs = all.color.iter().flatten().zip(shown.color.iter().flatten());
                let psnr = psnr_of(mean(&pairs.map(|(a, b)| (a - b).powi(2)).collect::<Vec<_>>()));
                values.add(&format!("moving image: view {}, against all Gaussians", view + 1), "dB", [psnr]);
            }
        }
    }
    Ok(values.samples())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moving_pictures_are_timed_and_compared() {
        let positions = (0..3_000).map(|i| [0, 1, 2].map(|k| ((i * (7 + k * 6) % 101) as f32 / 101.0).sin())).collect();
        let mut cloud = GaussianCloud::isotropic(positions, -4.0, 2.0);
        cloud.sh.iter_mut().enumerate().for_each(|(i, c)| *c = [(i % 5) as f32 * 0.2; 3]);
        let samples = time("x", &Arc::new(cloud), [160, 120], 2).expect("drawn");
        let of = |stage: &str| samples.iter().find(|s| s.stage == stage).expect("measured");
        // So few are all drawn, but for those that are finer than what can be seen.
        let psnr: Vec<f64> = samples.iter().filter(|s| s.unit == "dB").map(|s| s.median).collect();
        assert!(psnr.len() == 3 && psnr.iter().all(|p| *p > 30.0), "{samples:?}");
        let moving = of("moving image");
        assert_eq!((moving.on.as_str(), moving.n), ("x, 3000 Gaussians, 160x120", 6));
        assert!(moving.median > 0.0 && moving.p95 >= moving.median && of("tree, for each Gaussian").median > 0.0);
    }
}
