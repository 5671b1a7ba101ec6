//! `fmlgs query`: where in a view is what is asked for.

use std::path::{Path, PathBuf};
use std::time::Instant;

use image::ColorType;
use serde_json::{Value, json};

use super::{CliError, opened, output, view};
use crate::io;
use crate::math::colormap::Colormap;
use crate::pipeline::semantics::answer::{Answered, by_name};
use crate::pipeline::semantics::grammar::{Kind, Phrase};
use crate::pipeline::semantics::localise::{Answer, Hit};
use crate::pipeline::semantics::names;
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::cpu::Renderer;
use crate::render::{Features, RenderSettings};
use crate::scene::{Camera, GaussianCloud, Mask, SemanticMap};

/// Ask a scene for an object or a part
///
/// "X of the Y" and "Y's X" ask for a part. Answers by the names that came with the masks. Exit
/// code 1 if nothing fits.
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
    #[arg(long, default_value_t = 1)]
    top: usize,
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
enum KindArg {
    /// As the words say, else whatever fits better
    Auto,
    /// A whole object
    Object,
    /// A part
    Part,
}

pub fn run(args: Args) -> Result<(), CliError> {
    let scene = opened::drawable(&args.scene)?;
    let semantics = io::semantic_map::load(&args.scene, &scene.cloud)?.ok_or_else(|| {
        let path = args.scene.display();
        CliError::failed(format!("{path} knows no objects yet; find them with 'fmlgs preprocess {path} --masks ...'"))
    })?;
    let camera = view::choose(args.camera.as_deref(), &scene)?.limited_to(args.max_side);
    let phrase = Phrase::parse(&args.text)
        .ok_or_else(|| CliError::Usage("there is nothing to look for in the query; type an object's name".into()))?;
    let kind = match args.kind {
        KindArg::Auto => Kind::Auto,
        KindArg::Object => Kind::Object,
        KindArg::Part => Kind::Part,
    };
    let mut renderer = Renderer::new();
    let map =
        ViewMap::render(&mut renderer, &scene.cloud, &semantics.of, &semantics.identities, &camera, &scene.settings)?;
    let start = Instant::now();
    let answered = by_name(&semantics.identities, &phrase, kind);
    let mask = answered.mask(&map, &semantics.identities, args.top);
    let query_ms = start.elapsed().as_secs_f64() * 1e3;
    if let Some(path) = &args.mask {
        let pixels: Vec<u8> = (0..map.identity.len()).map(|i| if mask.contains(i) { 255 } else { 0 }).collect();
        output::make_parent(path)?;
        output::write_png(path, &pixels, [camera.width_px, camera.height_px], ColorType::L8)?;
    }
    if let Some(path) = &args.heat {
        write_heat(path, &scene.cloud, &camera, &scene.settings, &answered.heat(&map))?;
    }
    tell(&args, &semantics, &answered, &mask, query_ms)
}

fn write_heat(
    path: &Path,
    cloud: &GaussianCloud,
    camera: &Camera,
    settings: &RenderSettings,
    relevancy: &[f32],
) -> Result<(), CliError> {
    let frame = Renderer::<f32>::new().render(cloud, Features::NONE, camera, settings)?;
    let mixed = frame.to_rgb8().into_iter().zip(relevancy).map(|(rgb, &relevancy)| {
        let heat = Colormap::Turbo.color(relevancy);
        let grey = (u32::from(rgb[0]) + u32::from(rgb[1]) + u32::from(rgb[2])) / 3;
        std::array::from_fn::<u8, 3, _>(|c| ((u32::from(heat[c]) * 6 + grey * 4) / 10) as u8)
    });
    let pixels: Vec<[u8; 3]> = mixed.collect();
    output::make_parent(path)?;
    output::write_png(path, pixels.as_flattened(), [camera.width_px, camera.height_px], ColorType::Rgb8)
}

fn tell(args: &Args, map: &SemanticMap, answered: &Answered, mask: &Mask, query_ms: f64) -> Result<(), CliError> {
    let full_name = |hit: &Hit| {
        let line: Vec<String> = map.identities.line(hit.identity).map(|i| map.identities.name(i)).collect();
        line.join(" of the ")
    };
    let unknown = names::unknown_words(&map.identities, &args.text);
    let answer = &answered.answer;
    let (verdict, hits) = match answer {
        Answer::Found(hits) => ("found", hits),
        Answer::Ambiguous(hits) => ("ambiguous", hits),
        Answer::NotFound(hits) => ("not found", hits),
    };
    if args.json {
        let hit = |h: &Hit| -> Value {
            json!({ "identity": h.identity, "name": full_name(h), "score": h.score, "margin": h.margin })
        };
        output::print_json(&json!({
            "query": args.text,
            "answer": verdict,
            "hits": hits.iter().map(hit).collect::<Vec<_>>(),
            "pixels": mask.area(),
            "unknown_words": unknown,
            "query_ms": query_ms,
        }))?;
    }
    match answer {
        Answer::NotFound(hits) => {
            let near = hits.iter().filter(|h| h.score > 0.0).map(full_name).collect::<Vec<_>>().join(", ");
            let near = if near.is_empty() { String::new() } else { format!("; nearest: {near}") };
            Err(CliError::failed(format!("nothing here is called '{}'{near}", args.text)))
        }
        _ if args.json => Ok(()),
        _ => {
            let mut rows = vec![vec!["answer".to_owned(), "score".to_owned(), "margin".to_owned()]];
            rows.extend(hits.iter().map(|h| vec![full_name(h), format!("{:.3}", h.score), format!("{:.3}", h.margin)]));
            let note = if verdict == "ambiguous" { " (ambiguous: the first two fit alike)" } else { "" };
            output::print(&format!(
                "{}\n{} px in this view, answered in {query_ms:.2} ms{note}",
                output::table(&rows),
                mask.area()
            ))
        }
    }
}
