//! `fmlgs query`: where in a view is what is asked for.

use std::path::{Path, PathBuf};
use std::time::Instant;

use image::ColorType;
use serde_json::{Value, json};

use super::asking::{Asker, semantics};
use super::{CliError, number, opened, output, view};
use crate::math::colormap::Colormap;
use crate::pipeline::semantics::answer::{Answered, Basis};
use crate::pipeline::semantics::code_map::CodeMap;
use crate::pipeline::semantics::codes::TOLERANCE;
use crate::pipeline::semantics::grammar::Kind;
use crate::pipeline::semantics::localise::{Answer, Hit};
use crate::pipeline::semantics::matching;
use crate::pipeline::semantics::stages::ms_since;
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::{Features, RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud, Mask, SemanticMap};

/// Ask a scene for an object or a part
///
/// "X of the Y" and "Y's X" ask for a part. Answers by the names that identities have, else by what
/// they look like to the encoder that has looked at them. Exit code 1 if nothing fits.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs query scene/ \"a button of the red controller\"\n  \
    fmlgs query scene/ \"the lamp's shade\" --camera 12 --mask mask.png --heat heat.png\n  \
    fmlgs query scene/ lamp --kind object --json")]
pub struct Args {
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
    #[arg(long, value_enum, default_value_t = KindArg::Auto)]
    kind: KindArg,
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

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum KindArg {
    /// As the words say, else whatever fits better
    Auto,
    /// A whole object
    Object,
    /// A part
    Part,
}

impl From<KindArg> for Kind {
    fn from(arg: KindArg) -> Self {
        match arg {
            KindArg::Auto => Self::Auto,
            KindArg::Object => Self::Object,
            KindArg::Part => Self::Part,
        }
    }
}

pub fn run(args: Args) -> Result<(), CliError> {
    let scene = opened::drawable(&args.scene)?;
    for out in args.mask.iter().chain(&args.heat) {
        output::check(out, &[".png"], &scene.reads(&args.scene))?;
    }
    let map = semantics(&args.scene, scene.state.as_deref(), &scene.cloud)?;
    let camera = view::choose(args.camera.as_deref(), &scene)?.limited_to(args.max_side);
    view::check_room(camera.width_px, camera.height_px)?;
    let mut renderer = Renderer::new();
    let exact = ViewMap::render(&mut renderer, &scene.cloud, &map.of, &map.identities, &camera, &scene.settings)?;
    let blended = match args.blend {
        true => {
            Some(CodeMap::render(&mut renderer, &scene.cloud, &map.codes, map.has_parts(), &camera, &scene.settings)?)
        }
        false => None,
    };
    let mut asker = Asker::new(&map)?;
    let start = Instant::now();
    let answered = asker.ask(&args.text, args.kind.into())?;
    let mut answered = answered
        .ok_or_else(|| CliError::Usage("there is nothing to look for in the query; type an object's name".into()))?;
    let matching_since = Instant::now();
    let mut mask = Mask::empty(exact.width_px, exact.height_px);
    let tolerance = args.tolerance / 255.0;
    for id in answered.chosen(args.top) {
        mask.add(&match &blended {
            Some(codes) => matching::blend(codes, &map.identities, id, tolerance),
            None => matching::exact(&exact, &map.identities, id, tolerance),
        });
    }
    answered.stages.mask = ms_since(matching_since);
    let query_ms = ms_since(start);
    let drawing_since = Instant::now();
    if let Some(path) = &args.mask {
        let pixels: Vec<u8> = (0..exact.identity.len()).map(|i| if mask.contains(i) { 255 } else { 0 }).collect();
        output::make_parent(path)?;
        output::write_png(path, &pixels, [camera.width_px, camera.height_px], ColorType::L8)?;
    }
    if let Some(path) = &args.heat {
        write_heat(path, &scene.cloud, &camera, &scene.settings, &answered.heat(&exact))?;
    }
    if args.mask.is_some() || args.heat.is_some() {
        answered.stages.draw = ms_since(drawing_since);
    }
    tell(&args, &map, &answered, &asker.unknown_words(&args.text), &mask, query_ms)
}

/// Writes the relevancy of every pixel over the picture in grey.
pub fn write_heat(
    path: &Path,
    cloud: &GaussianCloud,
    camera: &Camera,
    settings: &RenderSettings,
    relevancy: &[f32],
) -> Result<(), CliError> {
    let frame = Renderer::new().render(cloud, Features::NONE, camera, settings)?;
    let mixed = frame.to_rgb8().into_iter().zip(relevancy).map(|(rgb, &relevancy)| {
        let heat = Colormap::Turbo.color(relevancy);
        let grey = (u32::from(rgb[0]) + u32::from(rgb[1]) + u32::from(rgb[2])) / 3;
        std::array::from_fn::<u8, 3, _>(|c| ((u32::from(heat[c]) * 6 + grey * 4) / 10) as u8)
    });
    let pixels: Vec<[u8; 3]> = mixed.collect();
    output::make_parent(path)?;
    output::write_png(path, pixels.as_flattened(), [camera.width_px, camera.height_px], ColorType::Rgb8)
}

fn tell(
    args: &Args,
    map: &SemanticMap,
    answered: &Answered,
    unknown: &[String],
    mask: &Mask,
    query_ms: f64,
) -> Result<(), CliError> {
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
            let known = match unknown {
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
