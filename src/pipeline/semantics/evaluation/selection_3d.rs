//! `3d-selection`: Gaussians chosen by text, their silhouette rendered alone, cut at 0.7.

use super::{AskedScene, LabeledView, Unit};
use crate::pipeline::semantics::lifting::codes::TOLERANCE;
use crate::pipeline::semantics::query::matching::{MatchMode, gaussians};
use crate::render::{Features, RenderError, RenderSettings, Renderer};
use crate::scene::{GaussianCloud, Mask};

/// Accumulated alpha that belongs to the silhouette.
const CUT: f32 = 0.7;

pub(crate) fn compare(
    scene: &mut AskedScene<'_>,
    view: &LabeledView<'_>,
    cloud: &GaussianCloud,
    settings: &RenderSettings,
) -> Result<Vec<Unit>, RenderError> {
    let settings = RenderSettings { sh_degree: 0, depth: false, ..settings.clone() };
    let mut renderer = Renderer::new();
    let mut units = Vec::new();
    for category in &view.categories {
        let targets = (scene.ask)(&category.name).map(|a| a.chosen(1)).unwrap_or_default();
        let mut inside = vec![false; cloud.len()];
        for id in targets {
            let found = gaussians(scene.map, id, MatchMode::Identities, TOLERANCE);
            inside.iter_mut().zip(found).for_each(|(a, b)| *a |= b);
        }
        let alone = cloud.select(&(0..cloud.len()).filter(|&i| inside[i]).collect::<Vec<_>>());
        let frame = renderer.render(&alone, Features::NONE, view.camera, &settings)?;
        let mask = Mask::from_fn(frame.width_px, frame.height_px, |i| frame.alpha[i] > CUT);
        let iou = mask.iou(&category.mask);
        units.push(category.unit(view.name, iou, None));
    }
    Ok(units)
}

/// Share of units with at least this IoU; NaN without any.
pub(crate) fn accuracy(units: &[Unit], least: f64) -> f64 {
    units.iter().filter(|u| u.iou >= least).count() as f64 / units.len() as f64
}
