//! Time that a network takes for the masks of everything in one photo, stage by stage.

use std::time::Instant;

use serde::Serialize;

use super::super::table::{Rows, rows};
use crate::models::ModelError;
use crate::models::preprocess::FitSide;
use crate::models::sam::automatic::{AutomaticOptions, everything};
use crate::models::sam::{Prompted, PromptedMasks};
use crate::models::tensor::Tensor;
use crate::scene::PhotoPixels;

#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct MasksTiming {
    pub(crate) model: String,
    /// Size of the photo, px.
    pub(crate) size: [u32; 2],
    /// Pictures through the encoder: the photo and its crops.
    pub(crate) looks: usize,
    pub(crate) look_secs: f64,
    /// Points through the decoder.
    pub(crate) prompts: usize,
    pub(crate) prompt_secs: f64,
    /// Seconds in all, with loading the networks and judging the masks.
    pub(crate) whole_secs: f64,
    /// Number of masks that were kept.
    pub(crate) masks: usize,
}

impl MasksTiming {
    pub(super) fn table(&self) -> (Rows, String) {
        let row = |stage: &str, count: String, secs: f64| vec![stage.into(), count, format!("{secs:.2}")];
        let rest = self.whole_secs - self.look_secs - self.prompt_secs;
        let stages = [
            row("encoder", self.looks.to_string(), self.look_secs),
            row("decoder", self.prompts.to_string(), self.prompt_secs),
            row("judging the masks", self.masks.to_string(), rest),
            row("whole", String::new(), self.whole_secs),
        ];
        let [w, h] = self.size;
        (rows(&["everything in a photo", "count", "s"], stages), format!("{}, {w} x {h} px", self.model))
    }
}

/// Finds everything in a photo once.
pub(crate) fn time(
    network: &mut dyn PromptedMasks,
    options: &AutomaticOptions,
    photo: &PhotoPixels,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<MasksTiming, ModelError> {
    let mut watched = Watched { network, looks: (0, 0.0), prompts: (0, 0.0) };
    let start = Instant::now();
    let masks = everything(&mut watched, photo, options, &mut |_| go_on())?.len();
    let whole_secs = start.elapsed().as_secs_f64();
    let Watched { network, looks: (looks, look_secs), prompts: (prompts, prompt_secs) } = watched;
    let (model, size) = (network.name().to_owned(), [photo.width_px, photo.height_px]);
    Ok(MasksTiming { model, size, looks, look_secs, prompts, prompt_secs, whole_secs, masks })
}

/// A network whose answers are counted and timed.
struct Watched<'a> {
    network: &'a mut dyn PromptedMasks,
    looks: (usize, f64),
    prompts: (usize, f64),
}

impl PromptedMasks for Watched<'_> {
    fn name(&self) -> &str {
        self.network.name()
    }

    fn look(&mut self, picture: &PhotoPixels) -> Result<(), ModelError> {
        let start = Instant::now();
        let done = self.network.look(picture);
        self.looks = (self.looks.0 + 1, self.looks.1 + start.elapsed().as_secs_f64());
        done
    }

    fn masks(&mut self, points: Tensor, labels: Tensor, earlier: Option<Tensor>) -> Result<Prompted, ModelError> {
        let (start, count) = (Instant::now(), labels.shape.first().copied().unwrap_or(0));
        let done = self.network.masks(points, labels, earlier);
        self.prompts = (self.prompts.0 + count, self.prompts.1 + start.elapsed().as_secs_f64());
        done
    }

    fn side_px(&self) -> usize {
        self.network.side_px()
    }

    fn fit(&self) -> FitSide {
        self.network.fit()
    }
}
