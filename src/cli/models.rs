//! `fmlgs models`: which networks there are, which are here, and how to get the others.

use std::path::PathBuf;
use std::time::Instant;

use serde_json::json;

use super::progress::Console;
use super::{CliError, output};
use crate::models::catalogue::{self, Entry, InstallError, State};
use crate::models::engine::engine;
use crate::models::fetch::{FetchError, Patience};
use crate::models::{self, Tile};
use crate::pipeline::observer::Ticker;

/// List, fetch and check the neural networks
///
/// Nothing is fetched unless it is asked for here or in the window. Models lie in the user's data
/// folder, or in FMLGS_MODELS. FMLGS_ONNXRUNTIME names an ONNX Runtime library to run them with
/// ('none' = the built-in engine), FMLGS_DEVICE what that computes on.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs models                                   what is here, what is missing, what each adds\n  \
    fmlgs models fetch sam2.1-tiny --from https://files.example.org/models\n  \
    fmlgs models add clip-vit-b16 exported/        take over files that you bring\n  \
    fmlgs models check                             compare all files with their checksums")]
pub struct Args {
    #[command(subcommand)]
    command: Option<Command>,
    /// Print one JSON document
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    /// Fetch the files of a model; goes on where it was stopped
    Fetch {
        /// Its name
        id: String,
        /// Address of a folder that has its files [default: the one in the list]
        #[arg(long)]
        from: Option<String>,
    },
    /// Take over the files of a model from a folder
    Add {
        /// Its name
        id: String,
        /// The folder
        folder: PathBuf,
    },
    /// Compare all files that are here with their checksums
    Check,
    /// Run the models that look at pictures and phrases once, and time them
    Bench,
}

pub fn run(args: Args, quiet: bool) -> Result<(), CliError> {
    match args.command {
        None => list(args.json),
        Some(Command::Fetch { id, from }) => fetch(&id, from.as_deref(), quiet),
        Some(Command::Add { id, folder }) => {
            let entry = catalogue::entry(&id)?;
            entry.add(&catalogue::folder(), &folder)?;
            output::print(&format!("'{id}' is here now: {}", entry.adds))
        }
        Some(Command::Check) => check(args.json),
        Some(Command::Bench) => bench(args.json),
    }
}

fn list(as_json: bool) -> Result<(), CliError> {
    let (engine, folder) = (engine()?, catalogue::folder());
    let all = catalogue::entries()?;
    if as_json {
        let one = |e: &Entry| {
            json!({ "id": e.id, "role": e.role, "title": e.title, "adds": e.adds, "licence": e.licence, "source": e.source,
                "megabytes": e.megabytes(), "state": e.state(&folder) })
        };
        return output::print_json(&json!({
            "engine": engine.name(), "device": engine.device(), "note": engine.note(), "folder": folder,
            "models": all.iter().map(one).collect::<Vec<_>>(),
        }));
    }
    let mut rows = vec![["model", "for", "state", "MB", "licence"].map(str::to_owned).to_vec()];
    let mut notes = String::new();
    for e in &all {
        let (state, how) = state_text(e, &e.state(&folder));
        let size = if e.built_in { String::new() } else { e.megabytes().to_string() };
        let role = match e.role {
            models::Role::Encoder => "looks",
            models::Role::Segmenter => "masks",
        };
        rows.push(vec![e.id.clone(), role.into(), state, size, e.licence.clone()]);
        notes.push_str(&format!("\n{}: {} {how}", e.id, e.adds));
    }
    let note = engine.note().map(|n| format!("\nNote: {n}")).unwrap_or_default();
    output::print(&format!(
        "{}\n{notes}\n\nRun by {} on the {}. Models lie in {}.{note}",
        output::table(&rows),
        engine.name(),
        engine.device(),
        folder.display()
    ))
}

/// The state of a model in a word, and what can be done about it.
fn state_text(entry: &Entry, state: &State) -> (String, String) {
    match state {
        State::BuiltIn => ("built in".into(), String::new()),
        State::Here => ("here".into(), String::new()),
        State::Missing(_) if entry.url.is_some() => {
            ("not here".into(), format!("Get it: fmlgs models fetch {}", entry.id))
        }
        State::Missing(_) => (
            "not here".into(),
            format!(
                "Nobody hosts its files yet. Make them: python tools/export/{} --out FOLDER, then: fmlgs models add {} FOLDER",
                entry.export, entry.id
            ),
        ),
        State::Broken(problem) => ("broken".into(), problem.clone()),
    }
}

fn fetch(id: &str, from: Option<&str>, quiet: bool) -> Result<(), CliError> {
    let entry = catalogue::entry(id)?;
    let mut console = Console::new(quiet);
    let mut ticker = Ticker::new("", 0);
    let result = entry.fetch(&catalogue::folder(), from, Patience::default(), &mut |name, there, all| {
        ticker.enter(format!("Fetching {name} (kB)"), all.unwrap_or(there) / 1000);
        ticker.tick((there / 1000) as usize, &mut console).is_ok()
    });
    drop(console);
    match result {
        Ok(()) => output::print(&format!("'{id}' is here now: {}", entry.adds)),
        Err(InstallError::Fetch(e @ FetchError::Cancelled { .. })) => Err(CliError::Cancelled(e.to_string())),
        Err(e) => Err(e.into()),
    }
}

fn check(as_json: bool) -> Result<(), CliError> {
    let folder = catalogue::folder();
    let mut results = Vec::new();
    for entry in catalogue::entries()? {
        if matches!(entry.state(&folder), State::Missing(_)) {
            continue;
        }
        results.push((entry.id.clone(), entry.verify(&folder).err().map(|e| e.to_string())));
    }
    let broken = results.iter().filter(|r| r.1.is_some()).count();
    if as_json {
        let list = results.iter().map(|(id, problem)| json!({ "id": id, "problem": problem }));
        output::print_json(&json!({ "checked": list.collect::<Vec<_>>() }))?;
    } else {
        let line =
            |(id, problem): &(String, Option<String>)| format!("{id}: {}", problem.as_deref().unwrap_or("right"));
        output::print(&results.iter().map(line).collect::<Vec<_>>().join("\n"))?;
    }
    if broken > 0 {
        let text = format!("{broken} of {} models are broken; fetch or add them again", results.len());
        return Err(CliError::failed(text));
    }
    Ok(())
}

/// Times every encoder that can be used here on a picture and a phrase.
fn bench(as_json: bool) -> Result<(), CliError> {
    const RUNS: usize = 20;
    let engine = engine()?;
    let mut rows = vec![["model", "load ms", "picture ms", "phrase ms"].map(str::to_owned).to_vec()];
    let mut list = Vec::new();
    for id in catalogue::usable(models::Role::Encoder, &mut output::warn)? {
        let start = Instant::now();
        let mut encoder = models::encoder(&id)?;
        let side_px = encoder.tile_side_px().unwrap_or(224);
        let color = |i: usize| {
            let (x, y) = (i % side_px, i / side_px);
            [x as f32 / side_px as f32, y as f32 / side_px as f32, ((x / 8 + y / 8) % 2) as f32]
        };
        let tile = Tile { side_px, rgb: (0..side_px * side_px).map(color).collect() };
        // The first run prepares the networks.
        let (picture, phrase) = (encoder.image(&tile)?, encoder.text("a red wooden chair")?);
        let load_ms = start.elapsed().as_secs_f64() * 1e3;
        let median = |run: &mut dyn FnMut() -> Result<(), CliError>| -> Result<f64, CliError> {
            let mut ms = Vec::with_capacity(RUNS);
            for _ in 0..RUNS {
                let start = Instant::now();
                run()?;
                ms.push(start.elapsed().as_secs_f64() * 1e3);
            }
            Ok(crate::math::stats::median(&ms))
        };
        let picture_ms = median(&mut || Ok(encoder.image(&tile).map(drop)?))?;
        let phrase_ms = median(&mut || Ok(encoder.text("a red wooden chair").map(drop)?))?;
        let ms = |v: f64| format!("{v:.2}");
        rows.push(vec![id.clone(), ms(load_ms), ms(picture_ms), ms(phrase_ms)]);
        list.push(json!({ "id": id, "load_ms": load_ms, "picture_ms": picture_ms, "phrase_ms": phrase_ms,
            "picture": picture, "phrase": phrase }));
    }
    if as_json {
        return output::print_json(&json!({ "engine": engine.name(), "device": engine.device(), "models": list }));
    }
    output::print(&format!(
        "{}\nmedians of {RUNS} runs, {} on the {}",
        output::table(&rows),
        engine.name(),
        engine.device()
    ))
}
