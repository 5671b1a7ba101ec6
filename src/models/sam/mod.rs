//! Segment Anything: masks of a picture from points, boxes and masks, and of everything in it.
//!
//! [`PromptedMasks`] is the common interface of SAM and SAM 2 for an encoded picture; [`automatic`] prompts it with a
//! grid of points and keeps the good masks.

pub mod automatic;
mod grid_points;

use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::network::Network;
use super::preprocess::{FitSide, Prepare};
use super::tensor::Tensor;
use super::{ModelError, manifest};
use crate::math::resize::Filter;
use crate::scene::PhotoPixels;

/// Masks for a batch of prompts.
pub struct Prompted {
    /// Low-resolution logits, `[prompts, 4, S/4, S/4]`: one mask for unambiguous prompts, then three
    /// of growing size for ambiguous ones.
    pub masks: Tensor,
    /// Predicted IoU of each, `[prompts, 4]`.
    pub iou: Tensor,
}

/// Network that returns masks for prompts on the picture that it encoded last.
pub trait PromptedMasks {
    /// Name.
    fn name(&self) -> &str;

    /// Encodes a picture.
    fn look(&mut self, picture: &PhotoPixels) -> Result<(), ModelError>;

    /// Returns masks for points `[prompts, points, 2]` in px of the network's square, with labels `[prompts, points]`
    /// (-1 none, 0 background, 1 foreground, 2 and 3 a box's corners). `earlier` holds logits to refine.
    fn masks(&mut self, points: Tensor, labels: Tensor, earlier: Option<Tensor>) -> Result<Prompted, ModelError>;

    /// Side of the network's square, px.
    fn side_px(&self) -> usize;

    /// Fit of a picture in that square.
    fn fit(&self) -> FitSide;
}

/// Scale from px of a picture of this size to px of the network's square, along each axis.
pub(super) fn in_square(network: &dyn PromptedMasks, size: [usize; 2]) -> [f64; 2] {
    let side = network.side_px() as f64;
    match network.fit() {
        // Rounded to whole pixels, as the picture itself is resized.
        FitSide::Longer => size.map(|n| (n as f64 * side / size[0].max(size[1]) as f64 + 0.5).floor() / n as f64),
        _ => size.map(|n| side / n as f64),
    }
}

#[derive(Clone, Debug, Deserialize)]
struct Metadata {
    name: String,
    image_size: usize,
    mean: [f32; 3],
    std: [f32; 3],
    graphs: Graphs,
    /// True if it is a reduced model for slow machines.
    #[serde(default)]
    small: bool,
}

#[derive(Clone, Debug, Deserialize)]
struct Graphs {
    encoder: manifest::GraphFile,
    /// Second half of an encoder that is too large for one file.
    encoder_rest: Option<manifest::GraphFile>,
    decoder: manifest::GraphFile,
}

/// SAM of the first generation.
pub struct Sam {
    folder: PathBuf,
    about: Metadata,
    prepare: Prepare,
    encoder: Option<Network>,
    encoder_rest: Option<Network>,
    decoder: Option<Network>,
    embeddings: Option<Tensor>,
}

impl Sam {
    /// Opens the model of a description; its graphs lie beside it.
    pub fn open(path: &Path) -> Result<Self, ModelError> {
        let about: Metadata = manifest::read(path, "sam")?;
        let Metadata { image_size, mean, std, .. } = about;
        manifest::check_pictures(path, image_size, mean, std)?;
        let prepare = Prepare { side_px: image_size, filter: Filter::Bilinear, side: FitSide::Longer, mean, std };
        let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
        Ok(Self { folder, about, prepare, encoder: None, encoder_rest: None, decoder: None, embeddings: None })
    }

    /// True if it is a reduced model for slow machines, to be prompted sparingly.
    pub(crate) fn is_small(&self) -> bool {
        self.about.small
    }

    /// Embeddings of the picture that was encoded last.
    pub fn embeddings(&self) -> Option<&Tensor> {
        self.embeddings.as_ref()
    }
}

impl PromptedMasks for Sam {
    fn name(&self) -> &str {
        &self.about.name
    }

    fn look(&mut self, picture: &PhotoPixels) -> Result<(), ModelError> {
        self.embeddings = None;
        let image = self.prepare.picture(picture).ok_or(ModelError::NoPicture)?;
        let encoder = self.about.graphs.encoder.ready(&mut self.encoder, &self.folder)?;
        let mut out = encoder.run(vec![("image", image.into())])?;
        if let Some(rest) = &self.about.graphs.encoder_rest {
            let rest = rest.ready(&mut self.encoder_rest, &self.folder)?;
            out = rest.run(vec![("hidden", out.take("hidden")?.into())])?;
        }
        self.embeddings = Some(out.take("image_embeddings")?);
        Ok(())
    }

    fn masks(&mut self, points: Tensor, labels: Tensor, earlier: Option<Tensor>) -> Result<Prompted, ModelError> {
        let embeddings = self.embeddings.as_ref().ok_or(ModelError::NoPicture)?;
        let decoder = self.about.graphs.decoder.ready(&mut self.decoder, &self.folder)?;
        let mut inputs = prompt_inputs(points, labels, earlier, self.about.image_size);
        inputs.push(("image_embeddings", embeddings.into()));
        let mut out = decoder.run(inputs)?;
        Ok(Prompted { masks: out.take("masks")?, iou: out.take("iou")? })
    }

    fn side_px(&self) -> usize {
        self.about.image_size
    }

    fn fit(&self) -> FitSide {
        FitSide::Longer
    }
}

pub(super) fn prompt_inputs(
    points: Tensor,
    labels: Tensor,
    earlier: Option<Tensor>,
    side_px: usize,
) -> Vec<(&'static str, super::tensor::NetworkInput)> {
    let (n, low) = (points.shape[0], side_px / 4);
    let has = Tensor::filled(&[n], if earlier.is_some() { 1.0 } else { 0.0 });
    let mask = earlier.unwrap_or_else(|| Tensor::filled(&[n, 1, low, low], 0.0));
    vec![
        ("point_coords", points.into()),
        ("point_labels", labels.into()),
        ("mask_input", mask.into()),
        ("has_mask", has.into()),
    ]
}
