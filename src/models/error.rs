//! Errors of networks.

/// Network that could not be used, or an input that it cannot take.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum ModelError {
    #[error("there is no model called '{0}'; 'fmlgs models' lists them, and the path of a model's .json will do too")]
    Unknown(String),
    #[error("the model '{id}' is not on this machine; see 'fmlgs models' for what it needs")]
    NotHere { id: String },
    #[error(
        "the engine for neural networks ({engine}) does not start: {problem}; unset ORT_DYLIB_PATH to use the built-in one"
    )]
    Engine { engine: String, problem: String },
    #[error(
        "the {engine} engine cannot load the model {model}: {problem}; the file is damaged, or it needs {}",
        if *engine == "built-in" { "ONNX Runtime (set FMLGS_ONNXRUNTIME to its library)" } else { "a newer ONNX Runtime" }
    )]
    Load { model: String, engine: &'static str, problem: String },
    #[error("the model {model} failed: {problem}")]
    Run { model: String, problem: String },
    #[error("the model {model} gave {got} numbers where {expected} are expected; the file is made for another version")]
    Output { model: String, expected: usize, got: usize },
    #[error("the model {model} gave {value} at place {index} of its output; its input or its file is damaged")]
    NotFinite { model: String, index: usize, value: f32 },
    #[error("the model {model} has no output '{output}'; the file is made for another version")]
    NoOutput { model: String, output: String },
    #[error(
        "the model {model} knows {tokens} tokens, and the phrase has number {token}; it was exported with another vocabulary"
    )]
    Token { model: String, token: i64, tokens: usize },
    #[error("the image has no pixels, or no image was encoded yet")]
    NoPicture,
    #[error("no object is marked in any frame")]
    NothingMarked,
    #[error("{path}: {problem}")]
    Metadata { path: std::path::PathBuf, problem: String },
    #[error(transparent)]
    File(#[from] crate::io::IoError),
    #[error("cancelled")]
    Cancelled,
    #[error("the word list {file} is damaged: {problem}")]
    Vocabulary { file: String, problem: String },
    #[error(
        "a tile of {side_px} px with {pixels} pixels, where {expected_px} x {expected_px} is expected; cut it to that size"
    )]
    TileSize { side_px: usize, pixels: usize, expected_px: usize },
    #[error("the tile has a color that is not a number at pixel {pixel}")]
    TileColor { pixel: usize },
    #[error("no known word in the phrase; unknown: {}", if unknown.is_empty() { "(it has no words)".to_owned() } else { unknown.join(", ") })]
    NoKnownWord { unknown: Vec<String> },
}
