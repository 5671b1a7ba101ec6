//! Time that a network takes for the masks of everything in one photo, stage by stage.

use std::time::Instant;

use super::{StageSample, StageValues};
use crate::models::ModelError;
use crate::models::preprocess::FitSide;
use crate::models::sam::automatic::{AutomaticOptions, everything};
use crate::models::sam::{Prompted, PromptedMasks};
use crate::models::tensor::Tensor;
use crate::scene::PhotoPixels;

/// Finds everything in a photo once.
pub(crate) fn time(
    network: &mut dyn PromptedMasks,
    options: &AutomaticOptions,
    photo: &PhotoPixels,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<Vec<StageSample>, ModelError> {
    let mut watched = Watched { network, look_secs: Vec::new(), point_secs: Vec::new() };
    let start = Instant::now();
    let masks = everything(&mut watched, photo, options, &mut |_| go_on())?.len();
    let whole = start.elapsed().as_secs_f64();
    let Watched { network, look_secs, point_secs } = watched;
    let mut values = StageValues::new(format!("{}, {}x{}", network.name(), photo.width_px, photo.height_px));
    let [encoder, decoder] = [&look_secs, &point_secs].map(|secs| secs.iter().sum::<f64>());
    values.add("everything in a photo", "s", [whole]);
    values.add("everything in a photo: encoder", "s", [encoder]);
    values.add("everything in a photo: decoder", "s", [decoder]);
    values.add("everything in a photo: judging the masks", "s", [whole - encoder - decoder]);
    values.add("everything in a photo: masks that are kept", "", [masks as f64]);
    values.add("encoder, the photo or a crop", "s", look_secs);
    values.add("decoder, a point", "s", point_secs);
    Ok(values.samples())
}

/// A network whose answers are timed.
struct Watched<'a> {
    network: &'a mut dyn PromptedMasks,
    look_secs: Vec<f64>,
    /// Each point's share of its batch.
    point_secs: Vec<f64>,
}

impl PromptedMasks for Watched<'_> {
    fn name(&self) -> &str {
        self.network.name()
    }

    fn look(&mut self, picture: &PhotoPixels) -> Result<(), ModelError> {
        let start = Instant::now();
        let done = self.network.look(picture);
        self.look_secs.push(start.elapsed().as_secs_f64());
        done
    }

    fn masks(&mut self, points: Tensor, labels: Tensor, earlier: Option<Tensor>) -> Result<Prompted, ModelError> {
        let (start, count) = (Instant::now(), labels.shape.first().copied().unwrap_or(0));
        let done = self.network.masks(points, labels, earlier);
        let secs = start.elapsed().as_secs_f64() / count.max(1) as f64;
        self.point_secs.extend(std::iter::repeat_n(secs, count));
        done
    }

    fn side_px(&self) -> usize {
        self.network.side_px()
    }

    fn fit(&self) -> FitSide {
        self.network.fit()
    }
}
