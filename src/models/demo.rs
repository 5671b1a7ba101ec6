//! The encoder that comes with the program: two small networks that this project trained on its own
//! renders (`tools/encoder`), so that queries work with nothing to download.

use super::engine::engine;
use super::network::{Network, Tensor};
use super::vocabulary::Vocabulary;
use super::{Encoder, IdentityCrop, ModelError};

const IMAGE: (&str, &[u8]) = ("demo_image.onnx", include_bytes!("../../assets/models/demo_image.onnx"));
const TEXT: (&str, &[u8]) = ("demo_text.onnx", include_bytes!("../../assets/models/demo_text.onnx"));
const WORDS: (&str, &str) = ("demo_vocab.json", include_str!("../../assets/models/demo_vocab.json"));

/// The `demo` encoder. Its networks are prepared when they are first needed.
pub(crate) struct DemoEncoder {
    words: Vocabulary,
    image: Option<Network>,
    text: Option<Network>,
}

impl DemoEncoder {
    pub(crate) fn new() -> Result<Self, ModelError> {
        Ok(Self { words: Vocabulary::parse(WORDS.1, WORDS.0)?, image: None, text: None })
    }
}

/// The network in the slot, prepared if it is not yet.
fn ready<'a>(slot: &'a mut Option<Network>, (name, bytes): (&str, &[u8])) -> Result<&'a mut Network, ModelError> {
    if slot.is_none() {
        *slot = Some(engine()?.load(bytes, name)?);
    }
    slot.as_mut().ok_or_else(|| ModelError::Load {
        model: name.into(),
        engine: "built-in",
        problem: "it is gone".into(),
    })
}

impl Encoder for DemoEncoder {
    fn name(&self) -> &str {
        super::DEMO
    }

    fn dimension(&self) -> usize {
        self.words.dimension
    }

    fn tile_side_px(&self) -> Option<usize> {
        Some(self.words.tile_side_px)
    }

    fn images(&mut self, tiles: &[IdentityCrop]) -> Result<Vec<Vec<f32>>, ModelError> {
        tiles.iter().map(|tile| self.look(tile)).collect()
    }

    fn text(&mut self, phrase: &str) -> Result<Vec<f32>, ModelError> {
        let tokens = self.words.encode(phrase)?;
        let tokens = Tensor::new(&[1, tokens.len()], tokens);
        only(ready(&mut self.text, TEXT)?.unit_rows(
            vec![("tokens", tokens.into())],
            "embedding",
            self.words.dimension,
        )?)
    }

    fn unknown_words(&self, phrase: &str) -> Vec<String> {
        self.words.unknown(phrase)
    }
}

impl DemoEncoder {
    fn look(&mut self, tile: &IdentityCrop) -> Result<Vec<f32>, ModelError> {
        let side = self.words.tile_side_px;
        if tile.side_px != side || tile.rgb.len() != side * side {
            return Err(ModelError::TileSize { side_px: tile.side_px, pixels: tile.rgb.len(), expected_px: side });
        }
        if let Some(pixel) = tile.rgb.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
            return Err(ModelError::TileColor { pixel });
        }
        let channel = |c: usize| tile.rgb.iter().map(move |p| p[c].clamp(0.0, 1.0));
        let planes: Vec<f32> = (0..3).flat_map(channel).collect();
        let pixels = Tensor::new(&[1, 3, side, side], planes);
        only(ready(&mut self.image, IMAGE)?.unit_rows(
            vec![("tile", pixels.into())],
            "embedding",
            self.words.dimension,
        )?)
    }
}

fn only(mut rows: Vec<Vec<f32>>) -> Result<Vec<f32>, ModelError> {
    rows.pop().ok_or_else(|| ModelError::NoOutput { model: super::DEMO.into(), output: "embedding".into() })
}

#[cfg(test)]
mod tests;
