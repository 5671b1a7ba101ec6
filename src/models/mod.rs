//! Neural networks: what turns a picture of a thing, and a phrase, into vectors that can be compared.
//!
//! A network is an ONNX file, run by [`engine`]. [`Encoder`] is what the rest of the program sees of
//! it; [`DemoEncoder`] is the small one that comes with the program (made by `tools/encoder`).

mod demo;
pub mod engine;
mod error;
mod tile;
mod words;

pub use demo::DemoEncoder;
pub use error::ModelError;

/// A picture of one identity: mask on black, padded to a square, side x side, sRGB 0..1, row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    /// Side in px.
    pub side_px: usize,
    /// Colours.
    pub rgb: Vec<[f32; 3]>,
}

/// Pictures and phrases as unit vectors of one space: the nearer, the better they fit.
pub trait Encoder: Send {
    /// What it is called, for example "demo".
    fn name(&self) -> &str;

    /// Length of its vectors.
    fn dimension(&self) -> usize;

    /// Side of the tiles it takes, px.
    fn tile_side_px(&self) -> usize;

    /// The vector of a picture; of unit length.
    fn image(&mut self, tile: &Tile) -> Result<Vec<f32>, ModelError>;

    /// The vector of a phrase; of unit length. Words it does not know are left out; a phrase with
    /// no other words is an error ([`ModelError::NoKnownWord`]).
    fn text(&mut self, phrase: &str) -> Result<Vec<f32>, ModelError>;

    /// The words of a phrase that it does not know, each once, the first few of them.
    fn unknown_words(&self, phrase: &str) -> Vec<String>;
}
