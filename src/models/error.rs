//! What can go wrong with networks.

/// A network that could not be used, or an input that it cannot take.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// No model has that name.
    #[error("there is no model called '{0}'; 'fmlgs models' lists them, and the path of a model's .json will do too")]
    Unknown(String),
    /// A model whose files are not on this machine.
    #[error("the model '{id}' is not on this machine; see 'fmlgs models' for what it needs")]
    NotHere {
        /// Its name.
        id: String,
    },
    /// The engine that runs networks does not start.
    #[error(
        "the engine for neural networks ({engine}) does not start: {problem}; unset ORT_DYLIB_PATH to use the built-in one"
    )]
    Engine {
        /// Which engine.
        engine: String,
        /// What it says.
        problem: String,
    },
    /// A network cannot be loaded.
    #[error(
        "the {engine} engine cannot load the model {model}: {problem}; the file is damaged, or it needs {}",
        if *engine == "built-in" { "ONNX Runtime (set FMLGS_ONNXRUNTIME to its library)" } else { "a newer ONNX Runtime" }
    )]
    Load {
        /// Its file name.
        model: String,
        /// Which engine.
        engine: &'static str,
        /// What the engine says.
        problem: String,
    },
    /// A network fails.
    #[error("the model {model} failed: {problem}")]
    Run {
        /// Its file name.
        model: String,
        /// What the engine says.
        problem: String,
    },
    /// An output of the wrong size.
    #[error("the model {model} gave {got} numbers where {expected} are expected; the file is made for another version")]
    Output {
        /// Its file name.
        model: String,
        /// How many it should give.
        expected: usize,
        /// How many it gave.
        got: usize,
    },
    /// An output that is no number, or no direction.
    #[error("the model {model} gave {value} at place {index} of its output; its input or its file is damaged")]
    NotFinite {
        /// Its file name.
        model: String,
        /// Where.
        index: usize,
        /// What.
        value: f32,
    },
    /// An output that is not there.
    #[error("the model {model} has no output '{output}'; the file is made for another version")]
    NoOutput {
        /// Its file name.
        model: String,
        /// The output.
        output: String,
    },
    /// A token that the network has no row for.
    #[error(
        "the model {model} knows {tokens} tokens, and the phrase has number {token}; it was exported with another vocabulary"
    )]
    Token {
        /// Its name.
        model: String,
        /// The token.
        token: i64,
        /// How many it knows.
        tokens: usize,
    },
    /// Nothing to look at.
    #[error("the picture has no pixels, or no picture was looked at yet")]
    NoPicture,
    /// Nothing to follow.
    #[error("no object is marked in any frame")]
    NothingMarked,
    /// A description of a model that does not fit.
    #[error("{path}: {problem}")]
    Metadata {
        /// The file.
        path: std::path::PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// A word list that does not say what it must.
    #[error("the word list {file} is damaged: {problem}")]
    Vocabulary {
        /// Its file name.
        file: String,
        /// What is wrong.
        problem: String,
    },
    /// A tile of another size than the encoder takes.
    #[error(
        "a tile of {side_px} px with {pixels} pixels, where {expected_px} x {expected_px} is expected; cut it to that size"
    )]
    TileSize {
        /// Its side.
        side_px: usize,
        /// Its pixels.
        pixels: usize,
        /// The side it should have.
        expected_px: usize,
    },
    /// A tile with a color that is no number.
    #[error("the tile has a color that is no number at pixel {pixel}")]
    TileColor {
        /// Which, row-major.
        pixel: usize,
    },
    /// A phrase of which no word is known.
    #[error("no known word in the phrase; unknown: {}", if unknown.is_empty() { "(it has no words)".to_owned() } else { unknown.join(", ") })]
    NoKnownWord {
        /// The words that are not known.
        unknown: Vec<String>,
    },
}
