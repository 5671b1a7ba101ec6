//! SAM 2: masks of a picture as in SAM, and tracking of objects through a sequence of pictures by a memory.
//!
//! [`Sam2`] holds the five networks; [`track`] holds the memory and selects the earlier frames that condition an
//! object's mask, forward and backward.

pub mod sequence;
pub mod track;

use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::network::Network;
use super::preprocess::{FitSide, Prepare};
use super::sam::{Prompted, PromptedMasks, prompt_inputs};
use super::tensor::Tensor;
use super::{ModelError, manifest};
use crate::math::resize::{Filter, resize};
use crate::scene::PhotoPixels;

#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Metadata {
    pub(crate) name: String,
    pub(crate) image_size: usize,
    mean: [f32; 3],
    std: [f32; 3],
    /// Memory slots: one for all prompted frames, the others for the frames just before.
    pub(crate) memories: usize,
    /// Most object pointers that condition a frame.
    pub(crate) pointers: usize,
    /// True if pointers carry their distance in time.
    pub(crate) pointer_time: bool,
    /// True if that distance has a sign.
    pub(crate) pointer_time_signed: bool,
    /// True if pointers of later frames are left out.
    pub(crate) pointers_only_from_past: bool,
    /// Most prompted frames that condition a frame; -1 = all.
    pub(crate) max_conditioning_frames: i64,
    /// Fewest and most points for which three masks are decoded.
    pub(crate) multimask_points: [usize; 2],
    /// True if three masks are decoded while tracking.
    pub(crate) multimask_when_tracking: bool,
    pub(crate) pointer_of_best_mask: bool,
    /// Shift of the threshold in the measure of stability, logits.
    pub(crate) stability_delta: f32,
    /// Stability below which the best of three masks replaces the single mask.
    pub(crate) stability_threshold: f32,
    pub(crate) single_mask_falls_back: bool,
    /// True if masks of prompted frames enter the memory in binary form.
    pub(crate) binarise_prompted: bool,
    /// Holes of at most this many low-resolution pixels are filled.
    pub(crate) fill_hole_area: usize,
    /// Mask logit of an absent object.
    pub(crate) absent_score: f32,
    no_memory_embedding: Vec<f32>,
    no_object_pointer: Vec<f32>,
    graphs: Graphs,
}

#[derive(Clone, Debug, Deserialize)]
struct Graphs {
    encoder: manifest::GraphFile,
    decoder: manifest::GraphFile,
    mask_prompt: manifest::GraphFile,
    memory_encoder: manifest::GraphFile,
    memory_attention: manifest::GraphFile,
}

/// Features of a frame from the image encoder.
#[derive(Clone, Debug, PartialEq)]
pub struct EncodedFrame {
    /// `[1, C, S/16, S/16]`.
    pub embeddings: Tensor,
    /// `[1, C/8, S/4, S/4]`.
    pub fine: Tensor,
    /// `[1, C/4, S/8, S/8]`.
    pub middle: Tensor,
}

/// Output of the decoder for one object in a frame.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Decoded {
    /// Low-resolution logits of four masks, `[1, 4, S/4, S/4]`.
    pub(crate) masks: Tensor,
    /// Predicted IoU of each, `[1, 4]`.
    pub(crate) iou: Tensor,
    /// Logit of the object's presence.
    pub(crate) score: f32,
    /// Pointer of each mask, `[1, 4, C]`.
    pub(crate) pointers: Tensor,
}

/// Networks of SAM 2, each loaded at first use.
pub struct Sam2 {
    folder: PathBuf,
    pub(crate) about: Metadata,
    prepare: Prepare,
    encoder: Option<Network>,
    decoder: Option<Network>,
    mask_prompt: Option<Network>,
    memory_encoder: Option<Network>,
    memory_attention: Option<Network>,
    /// Encoded picture for [`PromptedMasks`].
    looked: Option<EncodedFrame>,
}

impl Sam2 {
    /// Opens the model of a description; its graphs lie beside it.
    pub fn open(path: &Path) -> Result<Self, ModelError> {
        let about: Metadata = manifest::read(path, "sam2")?;
        let Metadata { image_size, mean, std, .. } = about;
        manifest::check_pictures(path, image_size, mean, std)?;
        manifest::check_length(path, "memories", about.memories, 1 << 10)?;
        manifest::check_length(path, "pointers", about.pointers, 1 << 16)?;
        if image_size % 16 != 0 || about.memories < 2 {
            let problem = format!("a side of {image_size} px and {} memories are invalid", about.memories);
            return Err(ModelError::Metadata { path: path.into(), problem });
        }
        let prepare = Prepare { side_px: image_size, filter: Filter::Bicubic, side: FitSide::Both, mean, std };
        let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
        Ok(Self {
            folder,
            about,
            prepare,
            encoder: None,
            decoder: None,
            mask_prompt: None,
            memory_encoder: None,
            memory_attention: None,
            looked: None,
        })
    }

    /// SHA-256 of its encoder, to recognize frames that this encoder encoded.
    pub(crate) fn digest(&self) -> &str {
        &self.about.graphs.encoder.sha256
    }

    /// Encodes a frame of a sequence.
    pub(crate) fn encode(&mut self, picture: &PhotoPixels) -> Result<EncodedFrame, ModelError> {
        let image = self.prepare.picture(picture).ok_or(ModelError::NoPicture)?;
        self.encode_pixels(image)
    }

    /// Prepares a single picture, `[1, 3, S, S]`: the official code resizes it in floating point, but frames of a
    /// sequence in bytes.
    fn single_picture(&self, picture: &PhotoPixels) -> Option<Tensor> {
        let (w, h) = (picture.width_px as usize, picture.height_px as usize);
        if w == 0 || h == 0 || picture.rgb.len() != w * h {
            return None;
        }
        let Metadata { image_size, mean, std, .. } = self.about;
        let plane = |c: usize| {
            let values: Vec<f32> = picture.rgb.iter().map(|p| f32::from(p[c]) / 255.0).collect();
            resize(&values, (w, h), (image_size, image_size), Filter::Bilinear)
                .into_iter()
                .map(move |v| (v - mean[c]) / std[c])
        };
        Some(Tensor::new(&[1, 3, image_size, image_size], (0..3).flat_map(plane).collect()))
    }

    /// Encodes a prepared picture, `[1, 3, S, S]`.
    pub fn encode_pixels(&mut self, image: Tensor) -> Result<EncodedFrame, ModelError> {
        let encoder = self.about.graphs.encoder.ready(&mut self.encoder, &self.folder)?;
        let mut out = encoder.run(vec![("image", image.into())])?;
        Ok(EncodedFrame {
            embeddings: out.take("image_embeddings")?,
            fine: out.take("high_res_features1")?,
            middle: out.take("high_res_features2")?,
        })
    }

    /// Returns the embeddings of a frame without memory.
    pub fn without_memory(&self, frame: &EncodedFrame) -> Tensor {
        let mut embeddings = frame.embeddings.clone();
        let plane = embeddings.values.len() / self.about.no_memory_embedding.len().max(1);
        for (values, add) in embeddings.values.chunks_exact_mut(plane.max(1)).zip(&self.about.no_memory_embedding) {
            values.iter_mut().for_each(|v| *v += add);
        }
        embeddings
    }

    /// Pointer of an absent object, `[1, C]`.
    pub(crate) fn no_pointer(&self) -> Tensor {
        Tensor::new(&[1, self.about.no_object_pointer.len()], self.about.no_object_pointer.clone())
    }

    /// Decodes masks for prompts on a frame; its embeddings may be conditioned on memories.
    pub(crate) fn decode(
        &mut self,
        frame: &EncodedFrame,
        embeddings: &Tensor,
        points: Tensor,
        labels: Tensor,
        mask: Option<Tensor>,
    ) -> Result<Decoded, ModelError> {
        let decoder = self.about.graphs.decoder.ready(&mut self.decoder, &self.folder)?;
        let mut inputs = prompt_inputs(points, labels, mask, self.about.image_size);
        inputs.extend([
            ("image_embeddings", embeddings.into()),
            ("high_res_features1", (&frame.fine).into()),
            ("high_res_features2", (&frame.middle).into()),
        ]);
        let mut out = decoder.run(inputs)?;
        let score = out.take("object_score")?.values.first().copied().unwrap_or(0.0);
        Ok(Decoded { masks: out.take("masks")?, iou: out.take("iou")?, score, pointers: out.take("object_pointers")? })
    }

    /// Converts a mask of the square's size, `[1, 1, S, S]` of 0 and 1, to the decoder's prompt and to low-resolution
    /// logits.
    fn mask_prompt(&mut self, mask: Tensor) -> Result<(Tensor, Tensor), ModelError> {
        let network = self.about.graphs.mask_prompt.ready(&mut self.mask_prompt, &self.folder)?;
        let mut out = network.run(vec![("mask", mask.into())])?;
        Ok((out.take("mask_input")?, out.take("low_res_mask")?))
    }

    /// Encodes an object's mask in a frame into a memory.
    fn remember(
        &mut self,
        frame: &EncodedFrame,
        logits: &Tensor,
        score: f32,
        binarise: bool,
    ) -> Result<Tensor, ModelError> {
        let network = self.about.graphs.memory_encoder.ready(&mut self.memory_encoder, &self.folder)?;
        let inputs = vec![
            ("image_embeddings", (&frame.embeddings).into()),
            ("mask_logits", logits.into()),
            ("object_score", Tensor::filled(&[1, 1], score).into()),
            ("binarise", Tensor::filled(&[1], f32::from(u8::from(binarise))).into()),
        ];
        let mut memory = network.run(inputs)?.take("memory_features")?;
        memory.values.iter_mut().for_each(|v| *v = half::bf16::from_f32(*v).to_f32());
        Ok(memory)
    }

    /// Conditions a frame's embeddings on memories with their rows of the time table, and on pointers with their
    /// distances in time.
    fn condition(
        &mut self,
        frame: &EncodedFrame,
        memories: &[(i64, &Tensor)],
        pointers: &[(f32, &Tensor)],
    ) -> Result<Tensor, ModelError> {
        let nothing = self.no_pointer();
        let network = self.about.graphs.memory_attention.ready(&mut self.memory_attention, &self.folder)?;
        let n = memories.len();
        let mut inputs = vec![
            ("image_embeddings", (&frame.embeddings).into()),
            ("memory_features", Tensor::joined(memories.iter().map(|m| m.1)).into()),
            ("memory_time", Tensor::new(&[n], memories.iter().map(|m| m.0).collect::<Vec<i64>>()).into()),
            ("memory_valid", Tensor::filled(&[n], 1.0).into()),
        ];
        // Engines may fail on empty arrays, so there is one row that is marked invalid.
        let (rows, offsets, valid) = match pointers {
            [] => (nothing, vec![0.0], 0.0),
            some => (Tensor::joined(some.iter().map(|p| p.1)), some.iter().map(|p| p.0).collect(), 1.0),
        };
        let m = offsets.len();
        inputs.push(("object_pointers", rows.into()));
        if self.about.pointer_time {
            inputs.push(("pointer_offset", Tensor::new(&[m], offsets).into()));
        }
        inputs.push(("pointer_valid", Tensor::filled(&[m], valid).into()));
        network.run(inputs)?.take("conditioned")
    }
}

impl PromptedMasks for Sam2 {
    fn name(&self) -> &str {
        &self.about.name
    }

    fn look(&mut self, picture: &PhotoPixels) -> Result<(), ModelError> {
        self.looked = None;
        let image = self.single_picture(picture).ok_or(ModelError::NoPicture)?;
        self.looked = Some(self.encode_pixels(image)?);
        Ok(())
    }

    fn masks(&mut self, points: Tensor, labels: Tensor, earlier: Option<Tensor>) -> Result<Prompted, ModelError> {
        let frame = self.looked.take().ok_or(ModelError::NoPicture)?;
        let embeddings = self.without_memory(&frame);
        let decoded = self.decode(&frame, &embeddings, points, labels, earlier);
        self.looked = Some(frame);
        let Decoded { masks, iou, .. } = decoded?;
        Ok(Prompted { masks, iou })
    }

    fn side_px(&self) -> usize {
        self.about.image_size
    }

    fn fit(&self) -> FitSide {
        FitSide::Both
    }
}
