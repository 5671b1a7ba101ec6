//! CLIP and its variants: embeddings of pictures and phrases in one space, by two networks that
//! `tools/export/export_clip.py` exports from an official checkpoint.

mod repair;
pub mod tokens;

use std::path::{Path, PathBuf};

use serde::Deserialize;

use self::tokens::Tokens;
use super::network::Network;
use super::preprocess::{FitSide, Prepare};
use super::tensor::Tensor;
use super::{Encoder, IdentityCrop, ModelError, manifest, token_rows};
use crate::math::resize::Filter;
use crate::scene::PhotoPixels;

const BATCH: usize = 8;

#[derive(Clone, Debug, Deserialize)]
struct Metadata {
    name: String,
    embed_dim: usize,
    image_size: [usize; 2],
    mean: [f32; 3],
    std: [f32; 3],
    interpolation: String,
    resize_mode: String,
    context_length: usize,
    vocab_size: usize,
    tokenizer: TokenizerKind,
    graphs: Graphs,
}

#[derive(Clone, Debug, Deserialize)]
struct TokenizerKind {
    kind: String,
}

#[derive(Clone, Debug, Deserialize)]
struct Graphs {
    image: manifest::GraphFile,
    text: manifest::GraphFile,
}

const VOCABULARY: usize = 49_408;

/// CLIP encoder; each of its networks is loaded at first use.
pub struct ClipEncoder {
    folder: PathBuf,
    about: Metadata,
    prepare: Prepare,
    tokens: Tokens,
    image: Option<Network>,
    text: Option<Network>,
}

impl ClipEncoder {
    /// Opens the model of a description; its graphs lie beside it.
    pub fn open(path: &Path) -> Result<Self, ModelError> {
        let about: Metadata = manifest::read(path, "clip")?;
        let refused = |problem: String| ModelError::Metadata { path: path.into(), problem };
        let [height, width] = about.image_size;
        manifest::check_pictures(path, width, about.mean, about.std)?;
        manifest::check_length(path, "embed_dim", about.embed_dim, 1 << 16)?;
        manifest::check_length(path, "context_length", about.context_length, 1 << 12)?;
        if height != width {
            return Err(refused(format!("images of {width} x {height} px; only square ones are supported")));
        }
        if about.tokenizer.kind != "clip-bpe" || about.vocab_size > VOCABULARY {
            return Err(refused(format!(
                "its tokenizer is '{}' with {} tokens; only CLIP's own (clip-bpe) is built in",
                about.tokenizer.kind, about.vocab_size
            )));
        }
        let filter = Filter::named(&about.interpolation)
            .ok_or_else(|| refused(format!("interpolation '{}' is not known", about.interpolation)))?;
        let side = match about.resize_mode.as_str() {
            "shortest" => FitSide::Shorter,
            "squash" => FitSide::Both,
            other => return Err(refused(format!("resize mode '{other}' is not known; there is: shortest, squash"))),
        };
        let prepare = Prepare { side_px: width, filter, side, mean: about.mean, std: about.std };
        let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
        let tokens = Tokens::new(about.context_length);
        Ok(Self { folder, about, prepare, tokens, image: None, text: None })
    }

    /// Renames it to the name by which it is looked up.
    pub(crate) fn called(mut self, name: &str) -> Self {
        name.clone_into(&mut self.about.name);
        self
    }

    /// Preprocessing of its pictures.
    pub fn prepare(&self) -> &Prepare {
        &self.prepare
    }

    /// Embeds prepared pictures `[n, 3, S, S]` as unit vectors.
    pub fn embed_pixels(&mut self, pixels: Tensor) -> Result<Vec<Vec<f32>>, ModelError> {
        let network = self.about.graphs.image.ready(&mut self.image, &self.folder)?;
        network.unit_rows(vec![("pixels", pixels.into())], "embedding", self.about.embed_dim)
    }

    /// Tokens of a phrase.
    fn row(&self, phrase: &str) -> Result<Vec<i64>, ModelError> {
        if !phrase.chars().any(char::is_alphanumeric) {
            return Err(ModelError::NoKnownWord { unknown: Vec::new() });
        }
        let row = self.tokens.row(phrase);
        // Some engines crash the process on a token outside the table.
        if let Some(token) = row.iter().find(|t| **t >= self.about.vocab_size as i64) {
            let (model, tokens) = (self.about.name.clone(), self.about.vocab_size);
            return Err(ModelError::Token { model, token: *token, tokens });
        }
        Ok(row)
    }

    /// Embeds rows of tokens as unit vectors.
    pub fn embed_tokens(&mut self, tokens: Tensor<i64>) -> Result<Vec<Vec<f32>>, ModelError> {
        let network = self.about.graphs.text.ready(&mut self.text, &self.folder)?;
        network.unit_rows(vec![("tokens", tokens.into())], "embedding", self.about.embed_dim)
    }
}

impl Encoder for ClipEncoder {
    fn name(&self) -> &str {
        &self.about.name
    }

    fn dimension(&self) -> usize {
        self.about.embed_dim
    }

    fn tile_side_px(&self) -> Option<usize> {
        None
    }

    fn images(&mut self, tiles: &[IdentityCrop]) -> Result<Vec<Vec<f32>>, ModelError> {
        let mut all = Vec::with_capacity(tiles.len());
        for batch in tiles.chunks(BATCH) {
            let pixels: Result<Vec<Tensor>, ModelError> =
                batch.iter().map(|tile| self.prepare.picture(&picture(tile)?).ok_or(tile_error(tile))).collect();
            all.extend(self.embed_pixels(Tensor::joined(&pixels?))?);
        }
        Ok(all)
    }

    fn texts(&mut self, phrases: &[&str]) -> Vec<Result<Vec<f32>, ModelError>> {
        let rows = phrases.iter().map(|phrase| self.row(phrase)).collect();
        token_rows::each(rows, |rows| {
            let network = self.about.graphs.text.ready(&mut self.text, &self.folder)?;
            Ok(token_rows::embed(network, rows, self.about.embed_dim))
        })
    }

    fn unknown_words(&self, _: &str) -> Vec<String> {
        // Its subword tokens can spell every word.
        Vec::new()
    }
}

fn tile_error(tile: &IdentityCrop) -> ModelError {
    ModelError::TileSize { side_px: tile.side_px, pixels: tile.rgb.len(), expected_px: tile.side_px }
}

fn picture(tile: &IdentityCrop) -> Result<PhotoPixels, ModelError> {
    if tile.rgb.len() != tile.side_px * tile.side_px {
        return Err(tile_error(tile));
    }
    if let Some(pixel) = tile.rgb.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
        return Err(ModelError::TileColor { pixel });
    }
    let side = tile.side_px as u32;
    let rgb = tile.rgb.iter().map(|p| p.map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8)).collect();
    Ok(PhotoPixels { width_px: side, height_px: side, rgb, coverage: None, alpha: None })
}
