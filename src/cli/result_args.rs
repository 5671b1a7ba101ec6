//! Options of results of other methods that their files do not state.

use std::path::PathBuf;

use super::number;
use crate::io::results::ResultOptions;

/// Files and choices that belong to a result.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Results of other methods")]
pub(crate) struct ResultArgs {
    /// Classifier, decoder, codebook or index of the result, if it is not beside it
    #[arg(long, value_name = "FILE")]
    decoder: Option<PathBuf>,
    /// Entries of the codebook for each Gaussian of LangSplatV2, as it was trained [default: 4]
    #[arg(long, value_parser = number::within(1..=64_usize))]
    top_k: Option<usize>,
    /// Text encoder that the result was trained with, of 'fmlgs models' [default: that of the method's authors]
    #[arg(long, value_name = "NAME")]
    encoder: Option<String>,
}

impl ResultArgs {
    /// The options for the readers.
    pub(crate) fn options(&self) -> ResultOptions {
        let usual = ResultOptions::default();
        ResultOptions {
            decoder: self.decoder.clone(),
            top_k: self.top_k.unwrap_or(usual.top_k),
            encoder: self.encoder.clone(),
        }
    }

    /// Returns whether any of them is given.
    pub(crate) fn is_given(&self) -> bool {
        self.decoder.is_some() || self.top_k.is_some() || self.encoder.is_some()
    }
}
