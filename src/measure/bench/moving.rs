//! Drawing of many Gaussians while the camera moves: its time, and its PSNR against the picture of all of them.

use std::sync::Arc;
use std::time::Instant;

use serde::Serialize;

use super::super::image_error::{planes, resized};
use super::super::table::{Rows, rows};
use super::views_of;
use crate::math::resize::Filter;
use crate::math::stats::{mean, median, psnr_of, quantile};
use crate::render::lod::{LodTree, MOVING_SECS, Pace};
use crate::render::{DrawError, RenderSettings, Renderer};
use crate::scene::GaussianCloud;

/// Pictures in which the pace settles before any counts.
const SETTLE: usize = 40;

#[derive(Clone, Debug, Serialize)]
pub(crate) struct MovingTiming {
    pub(crate) name: String,
    pub(crate) gaussians: usize,
    /// Seconds to build the tree, for a million Gaussians.
    pub(crate) tree_secs_per_million: f64,
    /// Bytes of the tree for each Gaussian, and of the Gaussian itself.
    pub(crate) tree_bytes: f64,
    pub(crate) gaussian_bytes: f64,
    /// Milliseconds of a picture of all Gaussians, median over the views.
    pub(crate) rest_ms: f64,
    /// Milliseconds of a moving picture: median and 95th percentile over all views.
    pub(crate) moving_ms: [f64; 2],
    /// Gaussians and nodes that it draws, median.
    pub(crate) drawn: f64,
    /// Each view's last moving picture against that of all Gaussians, dB.
    pub(crate) psnr: Vec<f64>,
}

/// Moves at three views of a cloud as the window does, `repeats` pictures each after its pace has settled.
pub(crate) fn time(
    name: &str,
    cloud: &Arc<GaussianCloud>,
    [width, height]: [u32; 2],
    repeats: usize,
) -> Result<MovingTiming, DrawError> {
    let start = Instant::now();
    // Nobody stops it.
    let tree = Arc::new(LodTree::build(cloud, || true).unwrap_or_default());
    let (tree_secs, millions) = (start.elapsed().as_secs_f64(), cloud.len() as f64 * 1e-6);
    let settings = RenderSettings::of_mode(cloud.render_mode);
    let (mut rest, mut moving, mut drawn, mut psnr) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut renderer = Renderer::new();
    let mut pace = Pace::default();
    for camera in views_of(cloud, width, height) {
        renderer.limit_to(None);
        let start = Instant::now();
        let all = planes(&renderer.draw(cloud, &camera, &settings)?);
        rest.push(start.elapsed().as_secs_f64() * 1e3);
        for k in 0..SETTLE + repeats.max(1) {
            let start = Instant::now();
            let smaller = pace.camera(&camera);
            let cut = Arc::new(pace.cut(&tree, &smaller, settings.near));
            renderer.limit_to(Some(Arc::clone(&cut)));
            let frame = renderer.draw(cloud, &smaller, &settings)?;
            let secs = start.elapsed().as_secs_f64();
            pace.learn(secs, MOVING_SECS);
            if k >= SETTLE {
                moving.push(secs * 1e3);
                drawn.push(cut.len() as f64);
            }
            if k + 1 == SETTLE + repeats.max(1) {
                let shown = resized(&planes(&frame), &camera, Filter::Bilinear);
                let pairs = all.color.iter().flatten().zip(shown.color.iter().flatten());
                psnr.push(psnr_of(mean(&pairs.map(|(a, b)| (a - b).powi(2)).collect::<Vec<_>>())));
            }
        }
    }
    Ok(MovingTiming {
        name: name.into(),
        gaussians: cloud.len(),
        tree_secs_per_million: tree_secs / millions.max(1e-6),
        tree_bytes: tree.bytes() as f64 / cloud.len().max(1) as f64,
        gaussian_bytes: cloud.bytes() as f64 / cloud.len().max(1) as f64,
        rest_ms: median(&rest),
        moving_ms: [0.5, 0.95].map(|q| quantile(&moving, q)),
        drawn: median(&drawn),
        psnr,
    })
}

impl MovingTiming {
    pub(super) fn table(all: &[Self]) -> Rows {
        let head = [
            "while moving",
            "Gaussians",
            "tree s/M",
            "tree B each",
            "at rest ms",
            "p50 ms",
            "p95 ms",
            "drawn",
            "dB against all",
        ];
        let row = |t: &Self| {
            let psnr: Vec<String> = t.psnr.iter().map(|p| format!("{p:.1}")).collect();
            vec![
                t.name.clone(),
                t.gaussians.to_string(),
                format!("{:.2}", t.tree_secs_per_million),
                format!("{:.0} of {:.0}", t.tree_bytes, t.gaussian_bytes),
                format!("{:.0}", t.rest_ms),
                format!("{:.1}", t.moving_ms[0]),
                format!("{:.1}", t.moving_ms[1]),
                format!("{:.0}", t.drawn),
                psnr.join(" "),
            ]
        };
        rows(&head, all.iter().map(row))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moving_pictures_are_timed_and_compared() {
        let positions = (0..3_000).map(|i| [0, 1, 2].map(|k| ((i * (7 + k * 6) % 101) as f32 / 101.0).sin())).collect();
        let mut cloud = GaussianCloud::isotropic(positions, -4.0, 2.0);
        cloud.sh.iter_mut().enumerate().for_each(|(i, c)| *c = [(i % 5) as f32 * 0.2; 3]);
        let timed = time("x", &Arc::new(cloud), [160, 120], 2).expect("drawn");
        // So few are all drawn, but for those that are finer than what can be seen.
        assert_eq!((timed.gaussians, timed.psnr.len()), (3_000, 3));
        assert!(timed.psnr.iter().all(|p| *p > 30.0), "{timed:?}");
        assert!(timed.tree_bytes > 0.0 && timed.moving_ms[0] > 0.0 && timed.moving_ms[1] >= timed.moving_ms[0]);
        let table = MovingTiming::table(&[timed]);
        assert_eq!((table.len(), table[0].len()), (2, table[1].len()));
    }
}
