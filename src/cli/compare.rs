//! `fmlgs compare`: results of any method side by side.

use std::path::PathBuf;

use super::progress::Console;
use super::{CliError, number, output};
use crate::io::results::ResultOptions;
use crate::jobs::compare::cell::{ComparedCell, ShownRelevancy};
use crate::jobs::compare::vectors::InstalledEncoders;
use crate::jobs::compare::views::{ViewChoice, WantedViews};
use crate::jobs::compare::{self, CompareRequest, write};
use crate::jobs::phrases;

/// Rows of the printed table at most; files have all.
const ROWS: usize = 60;

/// Ask results of several methods the same phrases, side by side
///
/// Takes scenes of this program with objects, and results of LangSplat, LangSplatV2, OpenGaussian, LaGa, Feature 3DGS,
/// GAGS, LEGaussians, Occam's LGS, Dr.Splat, THGS, LUDVIG and others. Each phrase is asked in each view: relevancy, the
/// mask by the method's own rule and by a rule that is the same for all, IoU and localization where labels are given, and
/// times. Writes compare.json, compare.csv, a picture sheet compare.png and a page compare.html.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs compare langsplat/output scene/ --phrases words.txt\n  \
    fmlgs compare a/ b/ c/ d/ --phrases words.txt --views 0,12 --truth labels/ --out side_by_side/\n  \
    fmlgs compare a/ b/ --phrases words.txt --views all --photos figurines/ --json\n  \
    fmlgs compare scene/ langsplat/output --encoder langsplat/output=clip-vit-b32 --phrases words.txt")]
pub(crate) struct CompareArgs {
    /// First scene, a folder or file: pictures of the views are its own
    first: PathBuf,
    /// One to three scenes to compare it with
    #[arg(required = true, num_args = 1..compare::MOST_SCENES)]
    others: Vec<PathBuf>,
    /// Text file with a phrase on each line
    #[arg(long, value_name = "FILE")]
    phrases: PathBuf,
    /// Photos to look from, by index or name with commas between, or 'all'
    #[arg(long, default_value = "0")]
    views: String,
    /// Data set with the photos [default: that of the first scene that has one, or the cameras beside it]
    #[arg(long)]
    photos: Option<PathBuf>,
    /// Labels of the photos, in any layout that 'fmlgs eval' reads
    #[arg(long, value_name = "LABELS")]
    truth: Option<PathBuf>,
    /// Folder for the results; files that are there are not replaced
    #[arg(long)]
    out: Option<PathBuf>,
    /// Relevancy in pictures
    #[arg(long, value_enum, default_value_t, requires = "out")]
    show: ShownRelevancy,
    /// Write the relevancy of every answer as .npy, too
    #[arg(long, requires = "out")]
    arrays: bool,
    /// Decoder, codebook or index of a result, as RESULT=FILE, where it is not found beside it
    #[arg(long, value_name = "RESULT=FILE", value_parser = result_and_file)]
    decoder: Vec<(PathBuf, PathBuf)>,
    /// Text encoder that a result was trained with, as RESULT=NAME, of 'fmlgs models' [default: that of the method's
    /// authors]
    #[arg(long, value_name = "RESULT=NAME", value_parser = result_and_name)]
    encoder: Vec<(PathBuf, String)>,
    /// Longer side of the views at most, px
    #[arg(long, default_value_t = 1_008, value_parser = clap::value_parser!(u32).range(16..=16384))]
    max_side: u32,
    /// Runs that times are medians of
    #[arg(long, default_value_t = 3, value_parser = number::within(1..=1_000_usize))]
    repeats: usize,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

fn result_and_file(given: &str) -> Result<(PathBuf, PathBuf), String> {
    result_and(given).map(|(result, file)| (result, file.into())).ok_or_else(|| "expected RESULT=FILE".into())
}

fn result_and_name(given: &str) -> Result<(PathBuf, String), String> {
    result_and(given).map(|(result, name)| (result, name.to_owned())).ok_or_else(|| "expected RESULT=NAME".into())
}

/// A result, and what is said of it after `=`.
fn result_and(given: &str) -> Option<(PathBuf, &str)> {
    let (result, value) = given.split_once('=')?;
    (!result.is_empty() && !value.is_empty()).then(|| (result.into(), value))
}

impl CompareArgs {
    fn request(&self) -> Result<CompareRequest, CliError> {
        let scenes: Vec<&PathBuf> = std::iter::once(&self.first).chain(&self.others).collect();
        let decoders = self.decoder.iter().map(|(result, _)| ("--decoder", result));
        let mut named = decoders.chain(self.encoder.iter().map(|(result, _)| ("--encoder", result)));
        if let Some((option, result)) = named.find(|(_, result)| !scenes.contains(result)) {
            return Err(CliError::Usage(format!("{option}: '{}' is none of the scenes", result.display())));
        }
        let options = |scene: &PathBuf| ResultOptions {
            decoder: self.decoder.iter().find(|(result, _)| result == scene).map(|(_, file)| file.clone()),
            encoder: self.encoder.iter().find(|(result, _)| result == scene).map(|(_, name)| name.clone()),
            ..ResultOptions::default()
        };
        Ok(CompareRequest {
            scenes: scenes.into_iter().map(|scene| (scene.clone(), options(scene))).collect(),
            phrases: phrases::read(&self.phrases)?,
            views: ViewChoice {
                wanted: WantedViews::Listed(self.views.clone()),
                photos: self.photos.clone(),
                truth: self.truth.clone(),
                max_side_px: self.max_side,
            },
            repeats: self.repeats,
            shown: self.show,
            out: self.out.clone(),
            arrays: self.arrays,
        })
    }
}

pub(crate) fn run(args: &CompareArgs, quiet: bool) -> Result<(), CliError> {
    let request = args.request()?;
    let mut encoders = InstalledEncoders::default();
    let mut encode = |name: &str, phrases: &[&str]| encoders.encode(name, phrases);
    let mut console = Console::new(quiet || args.json);
    let found = compare::run(&request, &mut encode, &mut console).map_err(CliError::of_views)?;
    drop(console);
    if args.json {
        return output::print_json(&found);
    }
    found.notes.iter().cloned().for_each(output::warn);
    let table = |head: &[&str], rows: Vec<Vec<String>>| {
        let head: Vec<String> = head.iter().map(|h| (*h).to_owned()).collect();
        output::table(&std::iter::once(head).chain(rows).collect::<Vec<_>>())
    };
    let mut text = table(&write::HEAD, found.cells.iter().take(ROWS).map(ComparedCell::texts).collect());
    if found.cells.len() > ROWS {
        text += &format!("\n{} more rows: see --out or --json", found.cells.len() - ROWS);
    }
    text += &format!("\n\n{}", table(&write::METHOD_HEAD, found.method_rows()));
    for cell in found.cells.iter().filter(|c| c.view == found.views[0] && c.phrase == found.phrases[0]) {
        if let Some(problem) = &cell.problem {
            text += &format!("\n{}: {problem}", cell.method);
        }
    }
    for rule in found.rules() {
        text += &format!("\n{rule}");
    }
    if let Some(folder) = &args.out {
        text += &format!("\nwrote compare.json, compare.csv, compare.png and compare.html to {}", folder.display());
    }
    output::print(&text)
}
