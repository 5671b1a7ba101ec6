//! `fmlgs demo`: the whole way on the scene that ships with the program, with or without a window.

use std::path::{Path, PathBuf};

use super::progress::Console;
use super::train::TrainOverrides;
use super::{CliError, output};
use crate::jobs::{Folders, demo as shipped, demo_tour, export};
use crate::math::format;
use crate::pipeline::observer::{Observer, Severity};

/// Show the program on the demo scene: make photos, train, look around
///
/// Opens the trained demo in the window. With --headless it needs no display: it asks the trained
/// demo for objects and parts; then it renders the demo scene's photos, trains on them, measures the
/// result on held-out photos, asks again, flies around the scene, and leaves images and a report in
/// the folder given by --out. Run again, it resumes where it was and reuses the photos.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs demo\n  \
    fmlgs demo --headless\n  \
    fmlgs demo --headless --steps 300 --out quick/      a first look in a fraction of the time\n  \
    fmlgs demo --make assets/demo/demo.zip --out work/  make the trained demo that ships with the program")]
pub(crate) struct DemoArgs {
    /// Do it without a window, and write images and a report
    #[arg(long)]
    pub(crate) headless: bool,
    /// Folder for everything the headless demo makes
    #[arg(long, default_value = "out/demo")]
    out: PathBuf,
    #[command(flatten)]
    settings: TrainOverrides,
    /// Make the trained demo that ships with the program, in the folder given by --out, and write it here
    #[arg(long, value_name = "ZIP", conflicts_with = "headless")]
    pub(crate) make: Option<PathBuf>,
    /// Print the report as one JSON document
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: DemoArgs, quiet: bool) -> Result<(), CliError> {
    let mut console = Console::new(quiet);
    export::check_folder(&args.out, &[])?;
    if let Some(file) = &args.make {
        export::check(file, &[], &[])?;
        return make(file, &args.out, console);
    }
    show_shipped(&args.out.join("shipped"), &mut console);
    let config = args.settings.over(demo_tour::config());
    let report = demo_tour::run(&args.out, config, output::command_line(), &mut console)
        .map_err(|e| CliError::of_work(e, "what is done is kept; the same command resumes there"))?;
    drop(console);
    if args.json {
        return output::print_json(&report);
    }
    output::print(&format!("{}\nSee {}", report.summary(), args.out.join("report.md").display()))
}

/// Prints the answers of the trained demo at once; without it the demo is trained all the same.
fn show_shipped(pictures: &Path, console: &mut Console) {
    match shipped::examine(&Folders::of_user(), pictures, console) {
        Ok(([psnr, ssim], queries)) => {
            let (objects, parts) = (queries.object_miou, queries.part_miou);
            console.note(
                Severity::Info,
                format!(
                    "The trained demo: held-out PSNR {psnr:.2} dB, SSIM {ssim:.3}; asked by name, objects {objects:.3} and \
                     parts {parts:.3} mean IoU; heat maps in {}",
                    pictures.display()
                ),
            );
            for q in &queries.asked {
                let answer = if q.answer.is_empty() { String::new() } else { format!(": {}", q.answer.join(", ")) };
                let text = format!("  {} - {}{answer} ({} px, {:.1} ms)", q.question, q.verdict, q.pixels, q.millis);
                console.note(Severity::Info, text);
            }
        }
        Err(e) => console.note(Severity::Warning, format!("The trained demo cannot be shown: {e}")),
    }
}

/// Makes the trained demo that ships with the program.
fn make(file: &Path, work: &Path, mut console: Console) -> Result<(), CliError> {
    let made = shipped::make(&shipped::DemoRecipe::shipped(), work, &mut console);
    let (bytes, record) = made.map_err(|e| CliError::of_work(e, "the same command resumes there"))?;
    drop(console);
    export::bytes(file, &bytes)?;
    let sum = format!("{}  demo.zip\n", shipped::digest(&bytes));
    export::text(&file.with_extension("sha256"), &sum)?;
    output::print(&format!(
        "{}: {}, {} Gaussians, held-out PSNR {:.2} dB, SSIM {:.3}; asked by name, objects {:.3} and parts {:.3} mean IoU",
        file.display(),
        format::bytes(bytes.len() as u64),
        format::count(record.gaussians as u64),
        record.psnr,
        record.ssim,
        record.object_miou,
        record.part_miou
    ))
}
