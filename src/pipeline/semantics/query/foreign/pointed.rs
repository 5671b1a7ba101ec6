//! Pixels that are pointed at: their cluster, their class, or all that is alike to them.

use super::ForeignError;
use super::asked::{ForeignScene, ForeignView, LevelView};
use super::classes;
use super::click::ClickedFeature;
use super::own_rules::ForeignMask;
use crate::io::results::LevelValues;
use crate::scene::Mask;

/// A pixel that is pointed at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointedPixel {
    /// Column and row.
    pub at: [usize; 2],
    /// Scale of what is meant, from 0 (details) to 1 (the largest things), where a method has scales.
    pub scale: f32,
    /// Score of alike pixels that belong to it, 0 to 1.
    pub threshold: f32,
}

impl ForeignScene {
    /// The mask of what a pixel of a view belongs to; `None` where nothing is.
    ///
    /// # Errors
    /// If the method knows neither classes nor clusters nor alike features.
    pub fn pointed(&self, view: &ForeignView, pixel: PointedPixel) -> Result<Option<ForeignMask>, ForeignError> {
        let (w, h) = view.size();
        let [x, y] = pixel.at;
        let Some(i) = (x < w && y < h).then(|| y * w + x) else { return Ok(None) };
        let cut = |values: Vec<f32>, least: f32, level, rule| {
            let mask = Mask::from_fn(w, h, |i| values[i] >= least);
            Some(ForeignMask { mask, level, values, peak: Some(i), rule })
        };
        let shared = |same: Vec<bool>, level, rule| {
            let values: Vec<f32> = same.iter().map(|same| f32::from(u8::from(*same))).collect();
            cut(values, 0.5, level, rule)
        };
        // Levels go from details to the largest things.
        let last = self.result.levels.len().saturating_sub(1);
        let k = ((pixel.scale.clamp(0.0, 1.0) * last as f32).round() as usize).min(last);
        let level = self.result.levels.get(k).ok_or(ForeignError::Level(k))?;
        Ok(match (&level.values, view.levels.get(k)) {
            (LevelValues::Affinity { gate, .. }, Some(LevelView::Blended(blended))) => {
                let clicked = ClickedFeature::at(blended, x, y, gate.as_ref(), pixel.scale);
                let scores = clicked.map(|clicked| clicked.pixels(blended));
                scores.and_then(|scores| cut(scores, pixel.threshold, k, "score of the click over the threshold"))
            }
            (LevelValues::Clusters(_), Some(LevelView::Winners(winners))) => {
                let label = winners.get(i).map(|w| w.label).filter(|label| *label > 0);
                label.and_then(|label| {
                    shared(winners.iter().map(|w| w.label == label).collect(), k, "cluster of the pixel")
                })
            }
            (LevelValues::Classes { classifier, .. }, Some(LevelView::Blended(blended))) => {
                let of = classes::of_pixels(classifier, blended);
                let class = of.get(i).copied().filter(|class| *class > 0);
                class.and_then(|class| shared(of.iter().map(|c| *c == class).collect(), k, "class of the pixel"))
            }
            _ => return Err(ForeignError::NoIdentities(self.result.method.name())),
        })
    }
}
