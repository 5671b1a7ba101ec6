//! Time of a typed question by names, on a made-up scene with many identities.

use std::time::Instant;

use glam::DVec3;

use super::{StageSample, StageValues};
use crate::pipeline::semantics::query::language::QueryPlace;
use crate::pipeline::semantics::query::language::viewpoint::Viewpoint;
use crate::pipeline::semantics::query::query_engine::answer_by_name;
use crate::pipeline::semantics::query::reading::QueryReading;
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::pipeline::semantics::query::timing::ms_since;
use crate::scene::{Bounds, Identities, Level, LevelFilter, NO_IDENTITY};

const COLORS: [&str; 6] = ["red", "blue", "green", "yellow", "white", "black"];
const THINGS: [&str; 8] = ["controller", "mug", "kettle", "lamp", "camera", "book", "car", "jar"];
const PARTS: [&str; 4] = ["button", "handle", "lid", "wheel"];

/// Questions of every kind: names, other words, pieces, relations, orders, numbers, slips, and what is not there.
const QUESTIONS: [&str; 20] = [
    "mug",
    "a red controller",
    "the lid of the blue kettle",
    "the mug left of the red lamp",
    "the handle of the mug behind the green kettle",
    "the largest book",
    "the second smallest car",
    "the tallest thing",
    "all books but the red one",
    "how many lamps",
    "is there a banana",
    "the cup next to the yellow jar",
    "a vehicle",
    "the two mugs nearest to the white camera",
    "everything on the table",
    "which is taller, the red lamp or the blue kettle",
    "the book between the red lamp and the green kettle",
    "the kettel",
    "the frobnicated lamp",
    "the thing that is not red",
];

/// Asks every question `rounds` times; the first round, in which names are taken apart, is reported by itself.
pub(crate) fn time(identities: usize, rounds: usize) -> Vec<StageSample> {
    let all = scene(identities);
    let recipe = QueryConfig::default();
    let view = Viewpoint { eye: DVec3::new(0.0, 30.0, -60.0), forward: DVec3::new(0.0, -0.4, 1.0), up: DVec3::Y };
    let place = QueryPlace { view: Some(view), ..QueryPlace::default() };
    let mut values = StageValues::new(format!("{identities} identities, by names"));
    for round in 0..=rounds {
        for question in QUESTIONS {
            let start = Instant::now();
            let Some(reading) = QueryReading::new(&all, question, &recipe) else { continue };
            let read = ms_since(start);
            std::hint::black_box(answer_by_name(&all, &reading, (LevelFilter::Auto, &place), &recipe));
            let whole = ms_since(start);
            if round == 0 {
                values.add("question: first time", "ms", [whole]);
                continue;
            }
            values.add("question", "ms", [whole]);
            values.add("question: read", "ms", [read]);
            values.add(&format!("question: \u{201c}{question}\u{201d}"), "ms", [whole]);
        }
    }
    values.samples()
}

/// Objects of a few kinds in rows on a table, each with four parts.
fn scene(identities: usize) -> Identities {
    let mut all = Identities::default();
    let side = ((identities as f64 / 5.0).sqrt().ceil() as usize).max(1);
    let table = all.add(Level::Object, NO_IDENTITY, vec!["table".into()]);
    let wide = side as f64 * 2.0;
    let mut boxes = vec![None, Some(Bounds { min: DVec3::new(0.0, -1.0, 0.0), max: DVec3::new(wide, 0.0, wide) })];
    let mut object = table;
    for i in 0..identities.saturating_sub(1) {
        let (k, piece) = (i / 5, i % 5);
        let at = DVec3::new((k % side) as f64, 0.0, (k / side) as f64) * 2.0;
        // Sizes differ, so that one is the largest.
        let size = 0.8 + 0.4 * (k as f64 * 0.618_034).fract();
        if piece == 0 {
            let name = format!("{} {}", COLORS[k % COLORS.len()], THINGS[k / COLORS.len() % THINGS.len()]);
            object = all.add(Level::Object, NO_IDENTITY, vec![name]);
            boxes.push(Some(Bounds { min: at, max: at + size }));
        } else {
            all.add(Level::Part, object, vec![PARTS[piece - 1].into()]);
            let min = at + 0.2 * piece as f64 * size;
            boxes.push(Some(Bounds { min, max: min + 0.15 * size }));
        }
    }
    all.set_boxes(&boxes);
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_question_is_timed_and_most_are_answered() {
        let samples = time(300, 1);
        assert_eq!(samples.len(), QUESTIONS.len() + 3);
        assert!(samples.iter().all(|s| s.median >= 0.0 && s.n > 0));
        let (all, recipe) = (scene(300), QueryConfig::default());
        let found = |text: &str| {
            let reading = QueryReading::new(&all, text, &recipe).expect("words");
            answer_by_name(&all, &reading, (LevelFilter::Auto, &QueryPlace::default()), &recipe).answer.hits().len()
        };
        assert!(found("mug") > 1 && found("a vehicle") > 1 && found("is there a banana") == 0);
    }
}
