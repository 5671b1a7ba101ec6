//! Timings of drawing, training and queries, stage by stage: what `fmlgs bench` prints. Every number is a median
//! over repeats in one process; compare only numbers of one run.

pub(crate) mod cpu;
pub mod gpu;
pub(crate) mod masks;
pub(crate) mod moving;
pub(crate) mod query;
pub(crate) mod strokes;

pub(crate) use cpu::{label, one_core_limit};

use glam::DVec3;
use serde::Serialize;

use self::cpu::{RenderTiming, StepTiming};
use self::gpu::Timing;
use self::masks::MasksTiming;
use self::moving::MovingTiming;
use self::query::QueryTiming;
use self::strokes::StrokesTiming;
use super::table::{Rows, rows};
use crate::math::Real;
use crate::scene::{Bounds, Camera, GaussianCloud};

/// Three cameras around a cloud, at different heights and distances, y downwards.
pub fn views_of<R: Real>(cloud: &GaussianCloud<R>, width: u32, height: u32) -> Vec<Camera> {
    let Some(bounds) = Bounds::robust((0..cloud.len()).map(|i| cloud.world_position(i))) else { return Vec::new() };
    let (center, radius) = (bounds.center(), bounds.radius());
    [(0.3_f64, -0.3, 2.2), (2.4, -0.9, 1.6), (4.4, 0.2, 3.0)]
        .into_iter()
        .filter_map(|(angle, height_over, distance)| {
            let eye = center + DVec3::new(angle.cos(), height_over, angle.sin()) * radius * distance;
            Camera::look_at(eye, center, -DVec3::Y, 0.8, width, height)
        })
        .collect()
}

#[derive(Debug, Default, Serialize)]
pub(crate) struct Timings {
    pub(crate) render: Vec<RenderTiming>,
    pub(crate) train: Vec<StepTiming>,
    /// Name and features of the GPU, if it was asked for.
    pub(crate) gpu: Option<String>,
    pub(crate) gpu_render: Vec<Timing>,
    pub(crate) gpu_train: Vec<Timing>,
    /// Limit of one core (see [`one_core_limit`]).
    pub(crate) one_core_products_per_sec: f64,
    /// Typed queries, if they were asked for.
    pub(crate) queries: Option<QueryTiming>,
    /// Masks of everything in a photo, if they were asked for.
    pub(crate) masks: Option<MasksTiming>,
    /// Selecting by strokes, if it was asked for.
    pub(crate) strokes: Vec<StrokesTiming>,
    /// Moving among many Gaussians, if it was asked for.
    pub(crate) moving: Vec<MovingTiming>,
}

impl Timings {
    /// A table of each kind, with a line about it.
    pub(crate) fn tables(&self) -> Vec<(Rows, String)> {
        let size = |[w, h]: [u32; 2]| format!("{w}x{h}");
        let mut all: Vec<(Rows, String)> = self.queries.iter().map(QueryTiming::table).collect();
        all.extend(self.masks.iter().map(MasksTiming::table));
        let head = ["drawing, CPU", "Gaussians", "size", "ms", "project", "sort", "bin", "blend", "products", "per s"];
        let drawn = self.render.iter().map(|t| {
            let mut row = vec![t.name.clone(), t.gaussians.to_string(), size(t.size), format!("{:.1}", t.total_ms)];
            row.extend(t.stages_ms.iter().map(|ms| format!("{ms:.1}")));
            row.extend([format!("{:.1e}", t.products), format!("{:.2e}", t.products_per_sec)]);
            row
        });
        all.push((rows(&head, drawn), String::new()));
        let head = ["training step, CPU", "Gaussians", "size", "ms", "steps per s"];
        let trained = self.train.iter().map(|t| {
            let speed = [format!("{:.1}", t.step_ms), format!("{:.2}", t.steps_per_sec)];
            [vec![t.name.clone(), t.gaussians.to_string(), size(t.size)], speed.to_vec()].concat()
        });
        all.push((rows(&head, trained), String::new()));
        for (what, timings) in [("drawing, GPU", &self.gpu_render), ("training step, GPU", &self.gpu_train)] {
            let head = [what, "Gaussians", "size", "ms", "stages, ms"];
            let timed = timings.iter().map(|t| {
                let stages: Vec<String> = t.stages_ms.iter().map(|(name, ms)| format!("{name} {ms:.2}")).collect();
                let row = [t.name.clone(), t.gaussians.to_string(), size(t.size), format!("{:.2}", t.total_ms)];
                [row.to_vec(), vec![stages.join(", ")]].concat()
            });
            all.push((rows(&head, timed), String::new()));
        }
        all.push((StrokesTiming::table(&self.strokes), String::new()));
        all.push((MovingTiming::table(&self.moving), String::new()));
        all.retain(|(rows, _)| rows.len() > 1);
        let limit = format!("one core at most: {:.2e} products per s", self.one_core_products_per_sec);
        all.extend(self.gpu.iter().map(|gpu| (Rows::new(), format!("GPU: {gpu}"))));
        all.push((Rows::new(), limit));
        all
    }
}
