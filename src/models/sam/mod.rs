//! Segment Anything: masks of a picture from points, boxes and masks, and of everything in it.
//!
//! [`PromptedMasks`] is what SAM and SAM 2 have in common once a picture is encoded; [`automatic`]
//! asks it for a grid of points and keeps what is good.

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

/// A network that gives masks for prompts on the picture that it has looked at last.
pub trait PromptedMasks {
    /// Its name.
    fn name(&self) -> &str;

    /// Looks at a picture.
    fn look(&mut self, picture: &PhotoPixels) -> Result<(), ModelError>;

    /// Masks for points `[prompts, points, 2]` in px of the network's square, with labels
    /// `[prompts, points]` (-1 none, 0 background, 1 foreground, 2 and 3 a box's corners).
    fn masks(&mut self, points: Tensor, labels: Tensor, earlier: Option<Tensor>) -> Result<Prompted, ModelError>;

    /// Side of the network's square, px.
    fn side_px(&self) -> usize;

    /// How a picture lies in that square.
    fn fit(&self) -> FitSide;
}

/// Lengths in the network's square of a px of a picture of this size, along each axis.
pub(super) fn in_square(network: &dyn PromptedMasks, size: [usize; 2]) -> [f64; 2] {
    let side = network.side_px() as f64;
    match network.fit() {
        // Whole pixels of the square, as the picture itself is resized.
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
    /// Whether it is made for small machines.
    #[serde(default)]
    small: bool,
}

#[derive(Clone, Debug, Deserialize)]
struct Graphs {
    encoder: manifest::GraphFile,
    /// Its second half, of one that is too large for one file.
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
    /// The model that a metadata file describes; its graphs lie beside it.
    pub fn open(path: &Path) -> Result<Self, ModelError> {
        let about: Metadata = manifest::read(path, "sam")?;
        let Metadata { image_size, mean, std, .. } = about;
        manifest::check_pictures(path, image_size, mean, std)?;
        let prepare = Prepare { side_px: image_size, filter: Filter::Bilinear, side: FitSide::Longer, mean, std };
        let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
        Ok(Self { folder, about, prepare, encoder: None, encoder_rest: None, decoder: None, embeddings: None })
    }

    /// Whether it is made for small machines, and to be asked sparingly.
    pub(crate) fn is_small(&self) -> bool {
        self.about.small
    }

    /// What the network made of the picture it looked at.
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
