//! `fmlgs eval --masks`: objects and parts against labelled photos.

use std::path::Path;

use image::ColorType;
use serde_json::json;

use super::eval::Job;
use super::{CliError, output};
use crate::io::{self, labels::Labels};
use crate::pipeline::semantics::score::{QueryScore, mean_iou, score_view};
use crate::pipeline::semantics::segmenter::{FileMasks, Segmenter};
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::cpu::Renderer;
use crate::scene::{Identities, IdentityId, Level, NOBODY};

/// Rows of the table at most; the worst come first.
const ROWS: usize = 12;

pub fn run(scene: &Path, masks: &Path, job: Job, json: bool) -> Result<(), CliError> {
    let semantics = io::semantic_map::load(scene, &job.cloud)?.ok_or_else(|| {
        let path = scene.display();
        CliError::failed(format!("{path} knows no objects yet; find them with 'fmlgs preprocess {path} --masks ...'"))
    })?;
    let mut labels = FileMasks(Labels::open(masks)?);
    let mut renderer = Renderer::new();
    let mut scores: Vec<QueryScore> = Vec::new();
    // Labels may be of photos that were trained on, as long as no mask of theirs was used.
    let held: Vec<usize> = job.views.iter().copied().filter(|&i| labels.covers(&job.dataset.photos[i])).collect();
    let other = || {
        let used = |name: &String| semantics.seeds.contains(name);
        let free = |&i: &usize| labels.covers(&job.dataset.photos[i]) && !used(&job.dataset.photos[i].name);
        (0..job.dataset.photos.len()).filter(free).collect()
    };
    let views: Vec<usize> = if held.is_empty() { other() } else { held };
    if let Some(folder) = &job.pictures {
        output::make_folder(folder)?;
    }
    for &i in &views {
        let photo = &job.dataset.photos[i];
        let camera = photo.camera.limited_to(job.max_side_px);
        let map =
            ViewMap::render(&mut renderer, &job.cloud, &semantics.of, &semantics.identities, &camera, &job.settings)?;
        let found = labels.segment(photo, job.max_side_px)?;
        scores.extend(score_view(&photo.name, &map, &semantics.identities, &found));
        if let Some(folder) = &job.pictures {
            let pixels = io::photo::load(photo, job.max_side_px)?;
            let ids = painted(&pixels.rgb, &map.identity, &semantics.identities);
            let size = [camera.width_px, camera.height_px];
            output::write_png(&folder.join(format!("{i:03}.png")), ids.as_flattened(), size, ColorType::Rgb8)?;
        }
    }
    if scores.is_empty() {
        return Err(CliError::failed(format!("{}: no photo to compare with has labels", masks.display())));
    }
    let (objects, parts) = (mean_iou(&scores, Level::Object), mean_iou(&scores, Level::Part));
    if json {
        return output::print_json(&json!({
            "scene": scene, "views": views.len(), "object_miou": objects, "part_miou": parts, "queries": scores,
        }));
    }
    scores.sort_by(|a, b| a.iou.total_cmp(&b.iou));
    let mut rows = vec![vec!["worst queries".to_owned(), "view".to_owned(), "px".to_owned(), "IoU".to_owned()]];
    let row = |s: &QueryScore| vec![s.query.clone(), s.view.clone(), s.pixels.to_string(), format!("{:.3}", s.iou)];
    rows.extend(scores.iter().take(ROWS).map(row));
    output::print(&format!(
        "{}\nmean IoU of {} queries in {} views: objects {objects:.4}, parts {parts:.4}",
        output::table(&rows),
        scores.len(),
        views.len()
    ))
}

/// The photo with every identity's code as a tint.
fn painted(rgb: &[[u8; 3]], of: &[IdentityId], identities: &Identities) -> Vec<[u8; 3]> {
    let tint = |(rgb, id): (&[u8; 3], &IdentityId)| match identities.get(*id) {
        Some(identity) if *id != NOBODY => {
            std::array::from_fn(|c| (0.4 * f32::from(rgb[c]) + 0.6 * 255.0 * identity.code[c]) as u8)
        }
        _ => *rgb,
    };
    rgb.iter().zip(of).map(tint).collect()
}
