//! `fmlgs path --survey`: random flights through a scene beside the paper's, and times against the
//! number of cameras.

use std::time::Instant;

use serde_json::{Value, json};

use super::opened::DrawableScene;
use super::{CliError, output};
use crate::navigate::Navigator;
use crate::navigate::survey::{Ends, Sum, Survey, more_cameras, survey};
use crate::scene::{Camera, HomeView};

/// Seed of the pairs of keypoints and of added cameras.
const SEED: u64 = 1;

/// Surveys the scene with its own cameras, or with each of these numbers of them.
pub fn run(scene: &DrawableScene, flights: usize, counts: &[usize], frames: usize, json: bool) -> Result<(), CliError> {
    let own: Vec<Camera> = scene.cameras.iter().map(|c| c.camera.clone()).collect();
    let counts = if counts.is_empty() { vec![own.len()] } else { counts.to_vec() };
    let (mut rows, mut documents) = (Vec::new(), Vec::new());
    let mut cells = |texts: &[&str]| rows.push(texts.iter().map(|t| (*t).to_owned()).collect::<Vec<_>>());
    cells(&[
        "cameras",
        "keypoints",
        "parts",
        "built in",
        "route (median, most)",
        "way of",
        "flights",
        "too near",
        "poses",
        "least clearance",
        "largest step",
        "largest turn",
    ]);
    for count in counts {
        let spread = 2.0 * crate::navigate::keypoints::spacing(&own);
        let cameras = more_cameras(&own, count, spread, SEED);
        let start = Instant::now();
        let navigator = Navigator::new(&scene.cloud, &cameras, HomeView::new(&cameras, None).up);
        let matter_secs = start.elapsed().as_secs_f64();
        navigator.graph.look_at_all(&navigator.matter);
        let build_secs = start.elapsed().as_secs_f64();
        let parts = navigator.graph.parts(&navigator.matter).into_iter().max().map_or(0, |p| p + 1);
        for (ends, between) in [(Ends::Keypoints, "keypoints"), (Ends::CloseToMatter, "close to matter")] {
            let found = survey(&navigator, ends, flights, frames, SEED);
            let head = [
                count.to_string(),
                navigator.graph.keypoints.len().to_string(),
                parts.to_string(),
                format!("{:.0} ms", build_secs * 1e3),
                between.to_owned(),
                format!("{:.2}, {:.2} ms", found.median_secs * 1e3, found.most_secs * 1e3),
                found.no_way.to_string(),
            ];
            let kinds =
                [("this", &found.ours), ("paper", &found.paper), ("paper, through keypoints", &found.paper_through)];
            for (name, sum) in kinds {
                let w = &sum.worst;
                let tail = [
                    name.to_owned(),
                    sum.flights.to_string(),
                    sum.flights_too_near.to_string(),
                    sum.poses_too_near.to_string(),
                    format!("{:.4}", w.least_clearance),
                    format!("{:.4}", w.largest_step),
                    format!("{:.2}\u{b0}", w.largest_turn.to_degrees()),
                ];
                rows.push(head.iter().cloned().chain(tail).collect());
            }
            documents.push(told(count, between, &navigator, parts, [matter_secs, build_secs], &found));
        }
    }
    if json { output::print_json(&json!(documents)) } else { output::print(&output::table(&rows)) }
}

fn told(cameras: usize, between: &str, navigator: &Navigator, parts: usize, secs: [f64; 2], s: &Survey) -> Value {
    let sum = |s: &Sum| {
        json!({
            "flights": s.flights,
            "flights_too_near": s.flights_too_near,
            "poses_too_near": s.poses_too_near,
            "worst": super::path::told(&s.worst),
        })
    };
    json!({
        "cameras": cameras,
        "between": between,
        "keypoints": navigator.graph.keypoints.len(),
        "keypoints_in_matter": navigator.in_matter,
        "parts": parts,
        "edges": navigator.graph.looked_at().1,
        "voxel": navigator.matter.voxel(),
        "clearance": navigator.clearance,
        "matter_secs": secs[0],
        "build_secs": secs[1],
        "route_secs": { "least": s.least_secs, "median": s.median_secs, "most": s.most_secs },
        "no_way": s.no_way,
        "ours": sum(&s.ours),
        "paper": sum(&s.paper),
        "paper_through_keypoints": sum(&s.paper_through),
    })
}
