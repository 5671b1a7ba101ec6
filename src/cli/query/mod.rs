//! `fmlgs query`: where in a view is what is asked for.

mod foreign;
mod out;
mod phrases;

use std::path::PathBuf;
use std::time::Instant;

use serde_json::{Value, json};

use self::out::OutFiles;
use super::recipe::RecipeArgs;
use super::result_args::ResultArgs;
use super::scene_args::open_scene;
use super::{CliError, number, output, view};
use crate::io::results::Method;
use crate::jobs::query::{self, QueryRequest, QueryResult, RuledMask};
use crate::jobs::{export, render};
use crate::pipeline::semantics::query::answer::Basis;
use crate::pipeline::semantics::query::language::slips::mended_text;
use crate::pipeline::semantics::query::localize::{Answer, Hit};
use crate::pipeline::semantics::query::timing::ms_since;
use crate::scene::{IdentityId, LevelFilter, SemanticMap};

/// Things that are offered where nothing fits, at most, by name and by embedding.
const OFFERED: usize = 3;

/// Ask a scene for an object or a part
///
/// "X of the Y" and "Y's X" ask for a part. Answers by the names that identities have; what they look like to the
/// encoder that has looked at them answers where nothing has a name, or if that encoder is CLIP, else it is an offer.
/// --recipe paper asks as the paper does. A result of another method with language is asked by its own embeddings, with
/// the mask by its own rule and by one that is the same for all. Exit code 1 if nothing fits.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs query scene/ \"a button of the red controller\"\n  \
    fmlgs query scene/ \"the lamp's shade\" --camera 12 --mask mask.png --heat heat.png\n  \
    fmlgs query scene/ lamp --kind object --json\n  \
    fmlgs query scene/ \"bear nose\" --recipe paper --heat heat.png\n  \
    fmlgs query langsplat/output/ramen \"chopsticks\" --level small --out answer/\n  \
    fmlgs query langsplat/output/ramen \"chopsticks\" --vectors embeddings.npy --out answer/ --arrays\n  \
    fmlgs query scene/ --phrases words.txt --views all --export masks/ --truth true_masks/")]
pub(crate) struct QueryArgs {
    /// Trained scene with objects and parts ('fmlgs preprocess'), or a result of another method
    scene: PathBuf,
    /// Text of the object or part to find
    #[arg(required_unless_present = "phrases", conflicts_with = "phrases")]
    text: Option<String>,
    /// Ask every phrase of a text file, one per line, instead of one
    #[arg(long, value_name = "FILE", conflicts_with_all = ["mask", "heat"])]
    phrases: Option<PathBuf>,
    /// Views for --phrases: 'all' photos, or some by index or name, with commas between [default: --camera]
    #[arg(long, requires = "phrases", conflicts_with = "camera")]
    views: Option<String>,
    /// True masks for --phrases, as it exports them: FOLDER/VIEW/PHRASE.png, white on black
    #[arg(long, value_name = "FOLDER", requires = "phrases")]
    truth: Option<PathBuf>,
    /// Write the masks of --phrases as .png, COCO .json and a .csv table into this folder
    #[arg(long, value_name = "FOLDER", requires = "phrases")]
    export: Option<PathBuf>,
    /// Photo by index from 0 or by name, or a JSON camera file [default: the first photo]
    #[arg(long)]
    camera: Option<String>,
    /// Shrink the view to at most this many px along its longer side
    #[arg(long, default_value_t = 1008, value_parser = clap::value_parser!(u32).range(16..=16384))]
    max_side: u32,
    /// Level of the answer: an object or a part
    #[arg(long, value_enum, default_value_t = LevelFilter::Auto)]
    kind: LevelFilter,
    /// Answers whose pixels go into the mask at most
    #[arg(long, default_value_t = 1, value_parser = number::within(1..=100_000_usize))]
    top: usize,
    /// Write the mask of the answer: .png, white on black, or .npy of booleans
    #[arg(long)]
    mask: Option<PathBuf>,
    /// Write the relevancy of every pixel: .png over the image, or .npy of numbers from 0 to 1
    #[arg(long)]
    heat: Option<PathBuf>,
    /// Write the relevancy and the masks by the own rule and by the common one into this folder, as .png
    #[arg(long, value_name = "FOLDER", conflicts_with = "phrases")]
    out: Option<PathBuf>,
    /// Write arrays (.npy) instead of pictures into the folder of --out
    #[arg(long, requires = "out")]
    arrays: bool,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    recipe: RecipeArgs,
    /// Level of a result of another method, by name or by number from 1 [default: that of the largest relevancy]
    #[arg(long, help_heading = "Results of other methods")]
    level: Option<String>,
    /// Embeddings in place of an encoder's: .npy with a row for the phrase and one for each canonical phrase
    #[arg(long, value_name = "FILE", help_heading = "Results of other methods")]
    vectors: Option<PathBuf>,
    #[command(flatten)]
    result: ResultArgs,
}

pub(crate) fn run(args: QueryArgs, quiet: bool) -> Result<(), CliError> {
    let scene = open_scene(&args.scene)?;
    for out in args.mask.iter().chain(&args.heat) {
        export::check(out, &query::MAP_ENDINGS, &scene.reads())?;
    }
    let has_embeddings = |m: &Method| m.encoder().is_some() || m.missing_encoder().is_some();
    if let Some(method) = scene.method.filter(|m| scene.folder.is_none() && has_embeddings(m)) {
        return foreign::run(&args, &scene, method);
    }
    if args.level.is_some() || args.vectors.is_some() || args.result.is_given() {
        let text = "are for results of other methods with language; this is none";
        return Err(CliError::Usage(format!("--level, --vectors, --decoder, --top-k and --encoder {text}")));
    }
    let map = scene.semantics()?;
    if let Some(list) = &args.phrases {
        return phrases::run(&args, list, &scene, map, quiet);
    }
    let out = OutFiles::of(&args, &scene)?;
    let text = args.text.as_deref().unwrap_or_default();
    let camera = view::choose(args.camera.as_deref(), &scene)?.limited_to(args.max_side);
    render::check_room(camera.width_px, camera.height_px)?;
    let request =
        QueryRequest { text, level: args.kind, camera: &camera, recipe: &args.recipe.recipe(), top: args.top };
    let mut result = query::run(&scene, &map, &request)?;
    let drawing_since = Instant::now();
    if let Some(path) = &args.mask {
        query::write_mask(path, &result.mask)?;
    }
    if let Some(path) = &args.heat {
        let relevancy = result.answered.heat(&result.maps.identities);
        query::write_heat(path, (&scene.cloud, &scene.settings), &camera, &relevancy)?;
    }
    let common = out.as_ref().map(|_| result.common_mask(&map));
    if let (Some(out), Some(common)) = (&out, &common) {
        let relevancy = result.answered.heat(&result.maps.identities);
        out.write(&scene, &camera, &relevancy, [Some(&result.mask), Some(&common.mask)])?;
    }
    if args.mask.is_some() || args.heat.is_some() || out.is_some() {
        result.answered.stages.draw = ms_since(drawing_since);
    }
    print_answer(&args, text, &map, &result, common.as_ref())
}

fn print_answer(
    args: &QueryArgs,
    text: &str,
    map: &SemanticMap,
    result: &QueryResult,
    common: Option<&RuledMask>,
) -> Result<(), CliError> {
    let QueryResult { answered, reading, mask, ignored_words: ignored, unexplained_words, query_ms, .. } = result;
    let full_name = |hit: &Hit| map.identities.full_name(hit.identity);
    let basis = if answered.basis == Basis::Names { "names" } else { "looks" };
    let mut lines = args.recipe.lines(map);
    if !result.unread.is_empty() {
        lines.push(format!("note: the encoder cannot read these canonical phrases: {}", result.unread.join(", ")));
    }
    if !args.json && !lines.is_empty() {
        output::print(&lines.join("\n"))?;
    }
    let answer = &answered.answer;
    let understood = answered.understood.as_ref();
    let hits = answer.hits();
    let is_empty = hits.first().is_some_and(|hit| map.members(hit.identity).is_empty());
    if args.json {
        let hit = |h: &Hit| -> Value {
            json!({ "identity": h.identity, "name": full_name(h), "score": h.score, "margin": h.margin })
        };
        output::print_json(&json!({
            "query": text,
            "answer": answer.verdict(),
            "basis": basis,
            "hits": hits.iter().map(hit).collect::<Vec<_>>(),
            "looks_like": answered.alike.iter().map(hit).collect::<Vec<_>>(),
            "pixels": mask.area(),
            "own_rule": common.map(|_| json!({ "rule": query::BY_IDENTITY, "pixels": mask.area() })),
            "common_rule": common.map(|m| json!({ "rule": m.rule, "level": m.level, "pixels": m.mask.area() })),
            "in_view": !mask.is_empty(),
            "empty": is_empty,
            "said": understood.and_then(|u| u.said.as_ref()),
            "notes": understood.map(|u| &u.notes),
            "reason": understood.and_then(|u| u.unmet.as_ref()).map(|u| &u.text),
            "unknown_words": unexplained_words,
            "ignored_words": ignored,
            "mended": reading.mended.iter().map(|(typed, read)| json!({ "typed": typed, "read": read })).collect::<Vec<_>>(),
            "query_ms": query_ms,
            "stages_ms": answered.stages,
            "recipe": answered.recipe,
            "unmet": answered.recipe.unmet(map),
            "unread": result.unread,
        }))?;
    }
    match answer {
        Answer::NotFound(_) => {
            let [by_name, by_looks] = answered.offers(OFFERED);
            let name = |id: IdentityId| map.identities.full_name(id);
            let slips = reading.near.iter().map(|(_, other)| other.clone());
            let offer = |what: &str, names: Vec<String>| match names.as_slice() {
                [] => String::new(),
                names => format!("; {what}: {}", names.join(", ")),
            };
            let near = offer("nearest", slips.chain(by_name.into_iter().map(name)).collect());
            let looks = offer("looks most like", by_looks.into_iter().map(name).collect());
            let words = offer("words that nothing here fits", unexplained_words.clone());
            let why = understood.and_then(|u| u.said.as_ref().or(u.unmet.as_ref().map(|unmet| &unmet.text)));
            let why = why.map(|why| format!(". {why}")).unwrap_or_default();
            Err(CliError::failed(format!("no match for '{text}'{words}{near}{looks}{why}")))
        }
        _ if args.json => Ok(()),
        _ => {
            let mut rows = vec![vec!["answer".to_owned(), "score".to_owned(), "margin".to_owned()]];
            rows.extend(hits.iter().map(|h| vec![full_name(h), format!("{:.3}", h.score), format!("{:.3}", h.margin)]));
            let ambiguous = matches!(answer, Answer::Ambiguous(_));
            let note = if ambiguous { " (ambiguous: they fit alike)" } else { "" };
            let said = understood.into_iter().flat_map(|u| u.said.iter().chain(&u.notes));
            let said: String = said.map(|line| format!("{line}\n")).collect();
            let seen = match mask.area() {
                0 if is_empty => "empty: no Gaussians belong to it".to_owned(),
                0 => "not in this view (--camera looks from another photo)".to_owned(),
                n => format!("{} px in this view", crate::math::format::count(n as u64)),
            };
            let mended = mended_text(&reading.mended).map(|t| format!("\n{t}")).unwrap_or_default();
            let ignored = if ignored.is_empty() { String::new() } else { format!("\nignored: {}", ignored.join(", ")) };
            let table = output::table(&rows);
            output::print(&format!(
                "{said}{table}\n{seen}, answered by {basis} in {query_ms:.2} ms{note}{mended}{ignored}"
            ))
        }
    }
}
