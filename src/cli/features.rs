//! `fmlgs features`: what another method stores for each Gaussian, as NumPy arrays.

use std::path::PathBuf;

use super::progress::Console;
use super::result_args::ResultArgs;
use super::scene_args::open_scene;
use super::{CliError, output};
use crate::jobs::features::{self, FeatureFacts, FeaturesRequest};
use crate::math::format::things;

/// Write the features of a result's Gaussians as NumPy arrays
///
/// Reads results of other methods. Codes are the numbers that the method stores for each Gaussian: compressed
/// embeddings, weights of a codebook, features of a classifier, or the number of a cluster (-1 for none). Embeddings are
/// decoded from them, of unit length, zeros for a Gaussian without one. A level may have Gaussians of its own. Without
/// files to write, this says what there is.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs features langsplat/output/ramen --level small --codes codes.npy --embeddings embeddings.npy\n  \
    fmlgs features occams/output/ramen --level 2 --codes codes.npy --gaussians level.ply\n  \
    fmlgs features opengaussian/output/figurines --json")]
pub(crate) struct FeaturesArgs {
    /// Result of another method: its folder, or one of its files
    result: PathBuf,
    /// Level, by name or by number from 1 [default: the first]
    #[arg(long)]
    level: Option<String>,
    /// Write the codes: .npy of a row for each Gaussian
    #[arg(long, value_name = "FILE")]
    codes: Option<PathBuf>,
    /// Write the embeddings: .npy of a row for each Gaussian
    #[arg(long, value_name = "FILE")]
    embeddings: Option<PathBuf>,
    /// Write the level's Gaussians in the order of the rows: .ply
    #[arg(long, value_name = "FILE")]
    gaussians: Option<PathBuf>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    files: ResultArgs,
}

pub(crate) fn run(args: FeaturesArgs, quiet: bool) -> Result<(), CliError> {
    let scene = open_scene(&args.result)?;
    let request = FeaturesRequest {
        level: args.level,
        codes: args.codes,
        embeddings: args.embeddings,
        gaussians: args.gaussians,
        options: args.files.options(),
    };
    let done = features::run(&scene, &request, &mut Console::new(quiet || args.json));
    let facts = done.map_err(|e| CliError::of_work(e, "files that were begun are not written"))?;
    match args.json {
        true => output::print_json(&facts),
        false => output::print(&in_words(&facts)),
    }
}

fn in_words(facts: &FeatureFacts) -> String {
    let codes = match facts.code_numbers {
        Some(dim) => format!("codes of {}", things(dim, "number")),
        None => "numbers of clusters".into(),
    };
    let embeddings = facts.embedding_numbers.map_or_else(
        || "no embeddings".into(),
        |dim| format!("embeddings of {} ({})", things(dim, "number"), facts.encoder.unwrap_or_default()),
    );
    let own = if facts.own_gaussians { " of its own" } else { "" };
    format!(
        "{}, level '{}' of {}: {}{own}, {codes}, {embeddings}",
        facts.method,
        facts.level,
        facts.levels.join(", "),
        things(facts.gaussians, "Gaussian")
    )
}
