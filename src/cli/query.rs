//! `fmlgs query`: where in a view is what is asked for.

use std::path::PathBuf;
use std::time::Instant;

use serde_json::{Value, json};

use super::{CliError, number, output, view};
use crate::jobs::query::{self, QueryRequest, QueryResult};
use crate::jobs::{export, open, render};
use crate::pipeline::semantics::answer::Basis;
use crate::pipeline::semantics::codes::TOLERANCE;
use crate::pipeline::semantics::localize::{Answer, Hit};
use crate::pipeline::semantics::matching::MatchMode;
use crate::pipeline::semantics::timing::ms_since;
use crate::scene::{LevelFilter, SemanticMap};

/// Ask a scene for an object or a part
///
/// "X of the Y" and "Y's X" ask for a part. Answers by the names that identities have, else by what
/// they look like to the encoder that has looked at them. Exit code 1 if nothing fits.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs query scene/ \"a button of the red controller\"\n  \
    fmlgs query scene/ \"the lamp's shade\" --camera 12 --mask mask.png --heat heat.png\n  \
    fmlgs query scene/ lamp --kind object --json")]
pub(crate) struct QueryArgs {
    /// Trained scene with objects and parts ('fmlgs preprocess')
    scene: PathBuf,
    /// What to look for
    text: String,
    /// Photo by index from 0 or by name, or a JSON camera file [default: the first photo]
    #[arg(long)]
    camera: Option<String>,
    /// Shrink the view to at most this many px along its longer side
    #[arg(long, default_value_t = 1008, value_parser = clap::value_parser!(u32).range(16..=16384))]
    max_side: u32,
    /// Whether an object or a part is meant
    #[arg(long, value_enum, default_value_t = LevelFilter::Auto)]
    kind: LevelFilter,
    /// Answers whose pixels go into the mask at most
    #[arg(long, default_value_t = 1, value_parser = number::within(1..=100_000_usize))]
    top: usize,
    /// Match alpha-blended codes, as the paper does, instead of identities
    #[arg(long)]
    blend: bool,
    /// Largest difference per channel of a match, in 255ths
    #[arg(long, default_value_t = 255.0 * TOLERANCE, value_parser = number::within(0.0..=255.0_f32))]
    tolerance: f32,
    /// Write the mask of the answer: white on black
    #[arg(long)]
    mask: Option<PathBuf>,
    /// Write the relevancy of every pixel over the picture
    #[arg(long)]
    heat: Option<PathBuf>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: QueryArgs) -> Result<(), CliError> {
    let scene = open::scene(&args.scene)?;
    for out in args.mask.iter().chain(&args.heat) {
        export::check(out, &[".png"], &scene.reads())?;
    }
    let map = scene.semantics()?;
    let camera = view::choose(args.camera.as_deref(), &scene)?.limited_to(args.max_side);
    render::check_room(camera.width_px, camera.height_px)?;
    let request = QueryRequest {
        text: &args.text,
        level: args.kind,
        camera: &camera,
        mode: if args.blend { MatchMode::Blend } else { MatchMode::Exact },
        tolerance: args.tolerance / 255.0,
        top: args.top,
    };
    let mut result = query::run(&scene, &map, &request)?;
    let drawing_since = Instant::now();
    if let Some(path) = &args.mask {
        query::write_mask(path, &result.mask)?;
    }
    if let Some(path) = &args.heat {
        let relevancy = result.answered.heat(&result.maps.identities);
        query::write_heat(path, (&scene.cloud, &scene.settings), &camera, &relevancy)?;
    }
    if args.mask.is_some() || args.heat.is_some() {
        result.answered.stages.draw = ms_since(drawing_since);
    }
    tell(&args, &map, &result)
}

fn tell(args: &QueryArgs, map: &SemanticMap, result: &QueryResult) -> Result<(), CliError> {
    let QueryResult { answered, mask, unknown_words: unknown, query_ms, .. } = result;
    let full_name = |hit: &Hit| map.identities.full_name(hit.identity);
    let basis = if answered.basis == Basis::Names { "names" } else { "looks" };
    let answer = &answered.answer;
    let hits = answer.hits();
    if args.json {
        let hit = |h: &Hit| -> Value {
            json!({ "identity": h.identity, "name": full_name(h), "score": h.score, "margin": h.margin })
        };
        output::print_json(&json!({
            "query": args.text,
            "answer": answer.verdict(),
            "basis": basis,
            "hits": hits.iter().map(hit).collect::<Vec<_>>(),
            "pixels": mask.area(),
            "in_view": !mask.is_empty(),
            "unknown_words": unknown,
            "query_ms": query_ms,
            "stages_ms": answered.stages,
        }))?;
    }
    match answer {
        Answer::NotFound(_) => {
            let near = hits.iter().filter(|h| h.score > 0.0).map(full_name).collect::<Vec<_>>().join(", ");
            let near = if near.is_empty() { String::new() } else { format!("; nearest: {near}") };
            let known = match unknown.as_slice() {
                [] => String::new(),
                words => format!("; words that are not known: {}", words.join(", ")),
            };
            Err(CliError::failed(format!("nothing here fits '{}'{near}{known}", args.text)))
        }
        _ if args.json => Ok(()),
        _ => {
            let mut rows = vec![vec!["answer".to_owned(), "score".to_owned(), "margin".to_owned()]];
            rows.extend(hits.iter().map(|h| vec![full_name(h), format!("{:.3}", h.score), format!("{:.3}", h.margin)]));
            let ambiguous = matches!(answer, Answer::Ambiguous(_));
            let note = if ambiguous { " (ambiguous: the first two fit alike)" } else { "" };
            let seen = match mask.area() {
                0 => "not in this view (--camera looks from another photo)".to_owned(),
                n => format!("{n} px in this view"),
            };
            output::print(&format!("{}\n{seen}, answered by {basis} in {query_ms:.2} ms{note}", output::table(&rows)))
        }
    }
}
