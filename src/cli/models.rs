//! `fmlgs models`: which networks there are, which are here, and how to get the others.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::progress::Console;
use super::{CliError, output};
use crate::jobs::models::{self, KnownCheck, ModelEntry, ModelList, ModelRole, ModelState, Source};

/// List, fetch and check the neural networks
///
/// Nothing is fetched unless it is asked for here or in the window. Models lie in the user's data
/// folder, or in FMLGS_MODELS. FMLGS_ONNXRUNTIME names an ONNX Runtime library to run them with
/// ('none' = the built-in engine), FMLGS_DEVICE what that computes on.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs models                                   what is here, what is missing, what each adds\n  \
    fmlgs models fetch sam2.1-tiny --from https://files.example.org/models\n  \
    fmlgs models add clip-vit-b16 open_clip_pytorch_model.bin   make it of the official checkpoint\n  \
    fmlgs models add clip-vit-b16 exported/        take over files that you bring\n  \
    fmlgs models fetch onnxruntime                 the fast engine, used from the next start on\n  \
    fmlgs models check                             compare all files with their checksums\n  \
    fmlgs models check clip-vit-b32                and what it answers with what was published")]
pub(crate) struct ModelsArgs {
    #[command(subcommand)]
    command: Option<Command>,
    /// Print one JSON document
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    /// Fetch the files of a model; resumes where it was stopped
    Fetch {
        /// Its name
        id: String,
        /// Address of a folder that has its files, or of its checkpoint [default: the one in the list]
        #[arg(long)]
        from: Option<String>,
    },
    /// Make a model of its official checkpoint, or take over its files from a folder
    Add {
        /// Its name
        id: String,
        /// The checkpoint (.pt, .pth, .bin, .safetensors, .onnx), or the folder
        #[arg(value_name = "FILE")]
        brought: PathBuf,
    },
    /// Compare all files that are here with their checksums; of one model, also its answer with a published one
    Check {
        /// Its name [default: all, and checksums only]
        id: Option<String>,
        /// The picture that the answer is about [default: the one that was fetched with the model]
        #[arg(long, requires = "id")]
        picture: Option<PathBuf>,
    },
    /// Run the models that look at images and phrases once, and time them
    Bench,
}

pub(crate) fn run(args: ModelsArgs, quiet: bool) -> Result<(), CliError> {
    match args.command {
        None => list(args.json),
        Some(Command::Fetch { id, from }) => fetch(&id, from.as_deref(), quiet),
        Some(Command::Add { id, brought }) => {
            let entry = models::install(&id, Source::Brought(&brought), &mut Console::new(quiet))?;
            output::print(&format!("'{id}' is here now: {}", entry.adds))
        }
        Some(Command::Check { id: None, .. }) => check(args.json),
        Some(Command::Check { id: Some(id), picture }) => ask(&id, picture.as_deref(), args.json),
        Some(Command::Bench) => bench(args.json),
    }
}

/// All models, what runs them, and on what.
fn listed() -> Result<(ModelList, [String; 2]), CliError> {
    let mut list = models::list();
    match list.engine.take() {
        Some(engine) => Ok((list, engine)),
        None => Err(CliError::failed(list.note.unwrap_or_default())),
    }
}

fn list(as_json: bool) -> Result<(), CliError> {
    let (ModelList { note, folder, models, .. }, [engine, device]) = listed()?;
    if as_json {
        let one = |(e, state): &(ModelEntry, ModelState)| {
            json!({ "id": e.id, "role": e.role, "title": e.title, "adds": e.adds, "license": e.license, "source": e.source,
                "speed": e.speed, "megabytes": e.megabytes(), "state": state })
        };
        return output::print_json(&json!({
            "engine": engine, "device": device, "note": note, "folder": folder,
            "models": models.iter().map(one).collect::<Vec<_>>(),
        }));
    }
    let mut rows = vec![["model", "for", "state", "MB", "license"].map(str::to_owned).to_vec()];
    let mut notes = String::new();
    for (e, state) in &models {
        let (state, how) = state_text(e, state);
        let size = if e.built_in { String::new() } else { e.megabytes().to_string() };
        let role = match e.role {
            ModelRole::Encoder => "looks",
            ModelRole::Segmenter => "masks",
            ModelRole::Inpainter => "paints",
            ModelRole::Engine => "runs",
        };
        rows.push(vec![e.id.clone(), role.into(), state, size, e.license.clone()]);
        notes.push_str(&format!("\n{}: {} {} {how}", e.id, e.adds, e.speed));
    }
    let note = note.map(|n| format!("\nNote: {n}")).unwrap_or_default();
    output::print(&format!(
        "{}\n{notes}\n\nRun by {engine} on the {device}. Models lie in {}.{note}",
        output::table(&rows),
        folder.display()
    ))
}

/// The state of a model in a word, and what can be done about it.
fn state_text(entry: &ModelEntry, state: &ModelState) -> (String, String) {
    match state {
        ModelState::BuiltIn => ("built in".into(), String::new()),
        ModelState::Here => ("here".into(), String::new()),
        ModelState::Missing(_) if entry.is_hosted() => {
            ("not here".into(), format!("Get it: fmlgs models fetch {}. {}", entry.id, entry.origin()))
        }
        ModelState::Missing(_) => ("not here".into(), entry.origin()),
        ModelState::Broken(problem) => ("broken".into(), problem.clone()),
    }
}

fn fetch(id: &str, from: Option<&str>, quiet: bool) -> Result<(), CliError> {
    let entry = models::install(id, Source::Fetch(from), &mut Console::new(quiet))?;
    output::print(&format!("'{id}' is here now: {}", entry.adds))
}

fn check(as_json: bool) -> Result<(), CliError> {
    let results = models::check()?;
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

/// Compares the files of a model with their checksums, and its answer with the published one.
fn ask(id: &str, picture: Option<&Path>, as_json: bool) -> Result<(), CliError> {
    let answer = match models::ask_known(id, picture)? {
        KnownCheck::Answer(answer) => answer,
        KnownCheck::NothingKnown if as_json => return output::print_json(&json!({ "id": id, "known": null })),
        KnownCheck::NothingKnown => {
            return output::print(&format!("{id}: its files are right; no answer of it is known to compare with"));
        }
        KnownCheck::NoPicture { address } => {
            return Err(CliError::failed(format!(
                "{id}: its files are right, but the picture that the published answer is about is not here; \
                 give it with --picture ({address})"
            )));
        }
    };
    if as_json {
        output::print_json(&json!({ "id": id, "known": answer }))?;
    } else {
        let numbers = |all: &[f64]| all.iter().map(|v| format!("{v:.4}")).collect::<Vec<_>>().join(", ");
        output::print(&format!(
            "{id}: its files are right\npublished: {} ({})\nhere:      {}\n{} {}",
            numbers(&answer.expected),
            answer.published,
            numbers(&answer.got),
            if answer.agrees { "equal within" } else { "not equal within" },
            answer.tolerance
        ))?;
    }
    if answer.agrees {
        return Ok(());
    }
    Err(CliError::failed(format!(
        "'{id}' does not answer what was published; its checkpoint or its engine is another one, or the picture is"
    )))
}

/// Times every encoder that can be used here on a picture and a phrase.
fn bench(as_json: bool) -> Result<(), CliError> {
    const RUNS: usize = 20;
    let (_, [engine, device]) = listed()?;
    let times = models::time_encoders(RUNS, &mut output::warn)?;
    if as_json {
        return output::print_json(&json!({ "engine": engine, "device": device, "models": times }));
    }
    let mut rows = vec![["model", "load ms", "image ms", "phrase ms"].map(str::to_owned).to_vec()];
    let ms = |v: f64| format!("{v:.2}");
    rows.extend(times.iter().map(|t| vec![t.id.clone(), ms(t.load_ms), ms(t.picture_ms), ms(t.phrase_ms)]));
    output::print(&format!("{}\nmedians of {RUNS} runs, {engine} on the {device}", output::table(&rows)))
}
