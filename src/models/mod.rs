//! Neural networks: encoders that embed pictures and phrases in one space, and segmenters.
//!
//! A network is an ONNX file, run by [`engine`]. [`Encoder`] compares pictures with phrases:
//! [`DemoEncoder`] is the small one that comes with the program (made by `tools/encoder`),
//! [`ClipEncoder`] the one of the paper. [`sam`] and [`sam2`] find masks. [`catalog`] lists the models, [`fetch`]
//! downloads them, and `template` makes them from official checkpoints.

use std::path::{Path, PathBuf};

use crate::io::data_folder::data_folder;

pub mod catalog;
pub mod clip;
mod demo;
pub(crate) mod engine;
mod error;
pub mod fetch;
mod known;
pub(crate) mod lama;
pub mod manifest;
pub mod network;
pub(crate) mod official;
mod onnx_file;
mod open_network;
pub mod preprocess;
pub mod sam;
pub mod sam2;
pub mod session_cache;
mod template;
pub mod tensor;
mod tile;
mod token_rows;
mod unpack;
mod vocabulary;
mod words;

pub(crate) use catalog::ModelRole;
pub use clip::ClipEncoder;
pub(crate) use demo::DemoEncoder;
pub use error::ModelError;
pub(crate) use known::{KnownAnswer, KnownResult};
pub use tile::IdentityCrop;
pub(crate) use words::{all_words, is_word};

/// Folder of the models.
pub(crate) fn folder() -> PathBuf {
    let set = std::env::var_os("FMLGS_MODELS").filter(|p| !p.is_empty());
    set.map_or_else(|| data_folder().join("models"), PathBuf::from)
}

/// Encoder of pictures and phrases as unit vectors in one space: the closer, the better they fit.
pub trait Encoder: Send {
    /// Name, for example "demo".
    fn name(&self) -> &str;

    /// Length of its vectors.
    fn dimension(&self) -> usize;

    /// Side of the tiles it takes, px; `None` if it resizes them itself.
    fn tile_side_px(&self) -> Option<usize>;

    /// Returns the unit vectors of pictures.
    fn images(&mut self, tiles: &[IdentityCrop]) -> Result<Vec<Vec<f32>>, ModelError>;

    /// Returns the unit vector of one picture.
    fn image(&mut self, tile: &IdentityCrop) -> Result<Vec<f32>, ModelError> {
        let mut one = self.images(std::slice::from_ref(tile))?;
        one.pop().ok_or_else(|| ModelError::NoOutput { model: self.name().to_owned(), output: "embedding".into() })
    }

    /// Returns the unit vectors of phrases. Unknown words are left out; a phrase with no other words is an error
    /// ([`ModelError::NoKnownWord`]). If the encoder itself fails, there are fewer results, and the last is the error.
    fn texts(&mut self, phrases: &[&str]) -> Vec<Result<Vec<f32>, ModelError>>;

    /// Returns the unit vector of one phrase.
    fn text(&mut self, phrase: &str) -> Result<Vec<f32>, ModelError> {
        let one = self.texts(&[phrase]).pop();
        one.ok_or_else(|| ModelError::NoOutput { model: self.name().to_owned(), output: "embedding".into() })?
    }

    /// Returns the first few unknown words of a phrase, each once.
    fn unknown_words(&self, phrase: &str) -> Vec<String>;
}

/// Source of the vectors of phrases: an encoder, or a function that embeds one at a time.
pub trait TextSource {
    /// Reason for which a phrase has no vector.
    type Error;

    /// Returns the vectors of these phrases, in order. If the source fails, there are fewer, and the last is the error.
    fn texts(&mut self, phrases: &[&str]) -> Vec<Result<Vec<f32>, Self::Error>>;
}

impl TextSource for dyn Encoder + '_ {
    type Error = ModelError;

    fn texts(&mut self, phrases: &[&str]) -> Vec<Result<Vec<f32>, ModelError>> {
        Encoder::texts(self, phrases)
    }
}

impl<E, F: FnMut(&str) -> Result<Vec<f32>, E>> TextSource for F {
    type Error = E;

    fn texts(&mut self, phrases: &[&str]) -> Vec<Result<Vec<f32>, E>> {
        phrases.iter().map(|phrase| self(phrase)).collect()
    }
}

/// Name of the built-in encoder.
pub(crate) const DEMO: &str = "demo";

/// Returns whether an encoder is the built-in one, or made like it: it knows a few hundred synthetic objects and
/// takes all others for one of them.
pub(crate) fn is_rough(name: &str) -> bool {
    name == DEMO || Path::new(name).ends_with(demo::WORDS.0)
}

/// Opens the best usable encoder. `on_warning` receives a warning for each better one that is broken.
pub(crate) fn best_encoder(on_warning: &mut dyn FnMut(String)) -> Result<Box<dyn Encoder>, ModelError> {
    let best = catalog::usable(ModelRole::Encoder, on_warning)?.into_iter().next();
    encoder(best.as_deref().unwrap_or(DEMO))
}

/// Opens an encoder by name: 'demo', a model of the catalog, or the path of a description; an encoder made like
/// 'demo' is named by its word list.
pub fn encoder(name: &str) -> Result<Box<dyn Encoder>, ModelError> {
    match name {
        DEMO => Ok(Box::new(DemoEncoder::new()?)),
        name if Path::new(name).ends_with(demo::WORDS.0) => Ok(Box::new(DemoEncoder::open(Path::new(name))?)),
        name => Ok(Box::new(ClipEncoder::open(&catalog::find(name, ModelRole::Encoder)?)?.called(name))),
    }
}
