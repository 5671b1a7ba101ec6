//! Built-in encoder: two small networks that this project trained on its own renders (`tools/encoder`), so that
//! queries work without a download.

use std::borrow::Cow;
use std::path::Path;

use super::engine::engine;
use super::network::Network;
use super::tensor::Tensor;
use super::vocabulary::Vocabulary;
use super::{Encoder, IdentityCrop, ModelError, token_rows};
use crate::io::{IoError, files};

const IMAGE: (&str, &[u8]) = ("demo_image.onnx", include_bytes!("../../../assets/models/demo_image.onnx"));
const TEXT: (&str, &[u8]) = ("demo_text.onnx", include_bytes!("../../../assets/models/demo_text.onnx"));
/// Word list. Its file name also identifies another encoder made by `tools/encoder`.
pub(super) const WORDS: (&str, &str) = ("demo_vocab.json", include_str!("../../../assets/models/demo_vocab.json"));

/// Largest accepted network file, bytes.
const MAX_BYTES: u64 = 64 << 20;

/// The `demo` encoder, or another one that `tools/encoder` made. Its networks are loaded at first use.
pub(crate) struct DemoEncoder {
    name: String,
    words: Vocabulary,
    image: Half,
    text: Half,
}

/// Network and the bytes of its file.
struct Half {
    name: &'static str,
    bytes: Cow<'static, [u8]>,
    network: Option<Network>,
}

impl DemoEncoder {
    /// Opens the built-in encoder.
    pub(crate) fn new() -> Result<Self, ModelError> {
        let half = |(name, bytes)| Half { name, bytes: Cow::Borrowed(bytes), network: None };
        let words = Vocabulary::parse(WORDS.1, WORDS.0)?;
        Ok(Self { name: super::DEMO.into(), words, image: half(IMAGE), text: half(TEXT) })
    }

    /// Opens the encoder with the word list in the file `path`, its networks beside it.
    pub(super) fn open(path: &Path) -> Result<Self, ModelError> {
        let damaged = |path: &Path, e: IoError| ModelError::Vocabulary {
            file: path.display().to_string(),
            problem: e.to_string(),
        };
        let half = |name: &'static str| {
            let file = path.with_file_name(name);
            let bytes = files::read(&file, MAX_BYTES).map_err(|e| damaged(&file, e))?;
            Ok::<_, ModelError>(Half { name, bytes: bytes.into(), network: None })
        };
        let name = path.display().to_string();
        let words = Vocabulary::parse(&files::read_text(path).map_err(|e| damaged(path, e))?, &name)?;
        Ok(Self { words, image: half(IMAGE.0)?, text: half(TEXT.0)?, name })
    }
}

impl Half {
    /// Returns the network, loading it at first use.
    fn ready(&mut self) -> Result<&mut Network, ModelError> {
        let loaded = match self.network.take() {
            Some(network) => network,
            None => engine()?.load(&self.bytes, self.name)?,
        };
        Ok(self.network.insert(loaded))
    }
}

impl Encoder for DemoEncoder {
    fn name(&self) -> &str {
        &self.name
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

    fn texts(&mut self, phrases: &[&str]) -> Vec<Result<Vec<f32>, ModelError>> {
        let rows = phrases.iter().map(|phrase| self.words.encode(phrase)).collect();
        token_rows::each(rows, |rows| Ok(token_rows::embed(self.text.ready()?, rows, self.words.dimension)))
    }

    fn unknown_words(&self, phrase: &str) -> Vec<String> {
        self.words.unknown(phrase)
    }
}

impl DemoEncoder {
    /// Words that it knows, with their forms in "es" and without a last "s".
    pub(super) fn words(&self) -> impl Iterator<Item = String> {
        let forms = |w: &String| [w.clone(), format!("{w}es"), w.trim_end_matches('s').to_owned()];
        self.words.words.keys().flat_map(forms)
    }

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
        let rows = self.image.ready()?.unit_rows(vec![("tile", pixels.into())], "embedding", self.words.dimension)?;
        self.only(rows)
    }

    fn only(&self, mut rows: Vec<Vec<f32>>) -> Result<Vec<f32>, ModelError> {
        rows.pop().ok_or_else(|| ModelError::NoOutput { model: self.name.clone(), output: "embedding".into() })
    }
}

#[cfg(test)]
mod tests;
