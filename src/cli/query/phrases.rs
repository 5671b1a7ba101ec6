//! `fmlgs query --phrases`: a list of phrases asked of one or more views, as a table, with their masks as files.

use std::path::Path;
use std::sync::Arc;

use serde_json::json;

use super::QueryArgs;
use crate::cli::progress::Console;
use crate::cli::{CliError, output, view};
use crate::jobs::phrases::colors::PhraseColors;
use crate::jobs::phrases::{self, PhraseRow, PhrasesRequest, TrueMasks};
use crate::jobs::{Scene, export, render};
use crate::scene::{Camera, SemanticMap};

/// Rows of the printed table at most; files have all.
const ROWS: usize = 60;

pub(super) fn run(args: &QueryArgs, list: &Path, scene: &Scene, map: SemanticMap, quiet: bool) -> Result<(), CliError> {
    if let Some(folder) = &args.export {
        export::check_folder(folder, &scene.reads())?;
        export::make_folder(folder)?;
    }
    let lines = args.recipe.lines(&map);
    let request = PhrasesRequest {
        cloud: Arc::clone(&scene.cloud),
        map: Arc::new(map),
        settings: scene.settings.clone(),
        views: views(args, scene)?,
        phrases: phrases::read(list)?,
        colors: PhraseColors::default(),
        level: args.kind,
        up: scene.home().up,
        meters: scene.meters_per_unit,
        recipe: args.recipe.recipe(),
        top: args.top,
        truth: args.truth.clone().map_or(TrueMasks::None, TrueMasks::Folder),
        export: args.export.clone(),
    };
    let rows = phrases::run(&request, &mut Console::new(quiet || args.json))?;
    if args.json {
        return output::print_json(&json!({ "rows": rows, "mean_iou": mean_iou(&rows), "recipe": request.recipe }));
    }
    let mut text = lines.into_iter().map(|line| line + "\n").collect::<String>() + &output::table(&table(&rows));
    if rows.len() > ROWS {
        text += &format!("\n{} more rows: see --export or --json", rows.len() - ROWS);
    }
    if let Some(iou) = mean_iou(&rows) {
        text += &format!("\nmean IoU {iou:.3} of {} masks", rows.iter().filter(|r| r.iou.is_some()).count());
    }
    if let Some(folder) = &args.export {
        text += &format!("\nwrote masks, coco.json and phrases.csv to {}", folder.display());
    }
    output::print(&text)
}

/// The views that are asked for, by name.
fn views(args: &QueryArgs, scene: &Scene) -> Result<Vec<(String, Camera)>, CliError> {
    let limited = |camera: &Camera| camera.limited_to(args.max_side);
    let views: Vec<(String, Camera)> = match args.views.as_deref() {
        Some("all") => scene.cameras.iter().map(|c| (c.name.clone(), limited(&c.camera))).collect(),
        Some(list) => {
            let one = |name: &str| {
                let camera = view::choose(Some(name), scene)?;
                let photo = scene.cameras.iter().find(|c| c.camera == camera);
                Ok((photo.map_or_else(|| name.to_owned(), |c| c.name.clone()), limited(&camera)))
            };
            list.split(',').map(str::trim).filter(|v| !v.is_empty()).map(one).collect::<Result<_, CliError>>()?
        }
        None => vec![("first view".to_owned(), limited(&view::choose(args.camera.as_deref(), scene)?))],
    };
    if views.is_empty() {
        return Err(CliError::failed("--views names no view; this scene's photos are listed by 'fmlgs info'"));
    }
    views.iter().try_for_each(|(_, c)| render::check_room(c.width_px, c.height_px))?;
    Ok(views)
}

fn mean_iou(rows: &[PhraseRow]) -> Option<f64> {
    let known: Vec<f64> = rows.iter().filter_map(|r| r.iou).collect();
    (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len() as f64)
}

fn table(rows: &[PhraseRow]) -> Vec<Vec<String>> {
    let mut all = vec![["view", "phrase", "answer", "", "score", "px", "IoU"].map(str::to_owned).to_vec()];
    all.extend(rows.iter().take(ROWS).map(|r| {
        let answer = if r.answer.is_empty() { r.verdict } else { &r.answer };
        let iou = r.iou.map_or_else(String::new, |v| format!("{v:.3}"));
        let (score, area) = (format!("{:.3}", r.score), r.area_px.to_string());
        vec![r.view.clone(), r.phrase.clone(), answer.to_owned(), r.certainty.to_owned(), score, area, iou]
    }));
    all
}
