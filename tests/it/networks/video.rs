//! SAM 2 on a video: 12 frames, three objects, forward and backward, against the official predictor.

use std::collections::BTreeMap;

use fmlgs::math::stats;
use fmlgs::models::sam2::Sam2;
use fmlgs::models::sam2::sequence::{FrameSource, InMemory, ObjectId, Output};
use fmlgs::models::sam2::track::{Prompt, Track, mask_of};
use fmlgs::models::tensor::Tensor;
use fmlgs::models::{ModelError, sam2::EncodedFrame};
use fmlgs::scene::Mask;
use serde_json::Value;

use super::fixture::{self, TOLERANCE, Tensors, agrees, error};

const SIZE: (usize, usize) = (96, 72);

fn floats(v: &Value) -> Vec<f32> {
    v.as_array().into_iter().flatten().map(|v| v.as_f64().expect("a number") as f32).collect()
}

fn prompt_of(entry: &Value, t: &Tensors) -> Prompt {
    if let Some(name) = entry["mask"].as_str() {
        let (_, bytes) = t.bytes(name);
        return Prompt::Mask(Mask::from_fn(SIZE.0, SIZE.1, |i| bytes[i] > 0));
    }
    let labels = floats(&entry["labels"]);
    let points = entry["points"].as_array().into_iter().flatten().zip(labels);
    let points = points.map(|(p, label)| (floats(p).try_into().expect("x and y"), label > 0.5)).collect();
    Prompt::Points { points, around: floats(&entry["box"]).try_into().ok() }
}

fn give(track: &mut Track<'_>, entry: &Value, t: &Tensors) {
    let (frame, object) = (entry["frame"].as_u64().expect("frame") as usize, entry["object"].as_u64().expect("object"));
    track.prompt(frame, object as ObjectId, &prompt_of(entry, t)).expect("prompted");
}

/// Frames whose objects are asked for in another order than they were taken in: a negative control.
struct Shuffled(InMemory);

impl FrameSource for Shuffled {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn get(&mut self, model: &mut Sam2, index: usize) -> Result<EncodedFrame, ModelError> {
        let n = self.0.len();
        self.0.get(model, (index * 5 + 4) % n)
    }
}

type Pass = BTreeMap<usize, BTreeMap<ObjectId, Output>>;

fn run(model: &mut Sam2, frames: &mut dyn FrameSource, described: &Value, t: &Tensors) -> BTreeMap<String, Pass> {
    let mut track = Track::new(model, frames, SIZE);
    described["prompts"].as_array().expect("prompts").iter().for_each(|p| give(&mut track, p, t));
    let mut passes = BTreeMap::new();
    for name in ["forward", "reverse", "corrected"] {
        if described["passes"].get(name).is_none() {
            continue;
        }
        if name == "corrected" {
            give(&mut track, &described["correction"], t);
        }
        let mut pass = Pass::new();
        track
            .run(name == "reverse", |frame, found| {
                pass.insert(frame, found.clone());
                true
            })
            .expect("followed");
        passes.insert(name.to_owned(), pass);
    }
    passes
}

/// The least IoU and the largest errors of pointers, scores and logits of a pass, where all three
/// objects are compared in all frames.
fn compare(t: &Tensors, track: &str, name: &str, order: &Value, pass: &Pass) -> (f64, f64, usize) {
    let (shape, bits) = t.bytes(&format!("{track}.{name}.full"));
    let (pointers, scores) = (t.floats(&format!("{track}.{name}.pointer")), t.floats(&format!("{track}.{name}.score")));
    let (mut least, mut errors, mut identical) = (1.0_f64, Vec::new(), 0);
    let order: Vec<usize> =
        order.as_array().expect("frames").iter().map(|v| v.as_u64().expect("frame") as usize).collect();
    assert_eq!(pass.keys().copied().collect::<std::collections::BTreeSet<_>>(), order.iter().copied().collect());
    for (f, frame) in order.iter().enumerate() {
        for o in 0..3 {
            let out = &pass[frame][&(o as ObjectId + 1)];
            let row = f * 3 + o;
            let packed = &bits[row * shape[2]..(row + 1) * shape[2]];
            let expected = Mask::from_fn(SIZE.0, SIZE.1, |i| packed[i / 8] >> (7 - i % 8) & 1 == 1);
            let got = mask_of(out, SIZE);
            let iou = if got.is_empty() && expected.is_empty() { 1.0 } else { got.iou(&expected) };
            least = least.min(iou);
            // Who it is: no other object of the frame fits its mask better.
            let other = |k: usize| {
                let packed = &bits[(f * 3 + k) * shape[2]..(f * 3 + k + 1) * shape[2]];
                got.iou(&Mask::from_fn(SIZE.0, SIZE.1, |i| packed[i / 8] >> (7 - i % 8) & 1 == 1))
            };
            identical += usize::from((0..3).all(|k| k == o || other(k) <= iou));
            let c = pointers.shape[2];
            errors.push(error(&out.pointer.values, &pointers.values[row * c..(row + 1) * c]));
            errors.push(error(&[out.score], &[scores.values[row]]));
        }
    }
    (least, stats::worst(errors), identical)
}

#[test]
fn three_objects_are_followed_as_by_the_official_predictor() {
    let t = Tensors::open("sam2_video.safetensors");
    let described = fixture::json("sam2_video.json");
    let mut model = Sam2::open(&fixture::path("sam2.json")).expect("opens");
    let pictures: Vec<_> = (0..12).map(|k| t.picture("frames", k)).collect();
    let mut frames = InMemory::of(&mut model, &pictures).expect("encoded");
    let first = &frames.0[0];
    let other = &frames.0[5];
    agrees(
        "embeddings",
        &first.embeddings.values,
        &other.embeddings.values,
        &t.floats("frame0.image_embeddings").values,
    );
    agrees("fine features", &first.fine.values, &other.fine.values, &t.floats("frame0.high_res_features1").values);
    for name in ["first", "second"] {
        let of_track = &described["tracks"][name];
        let passes = run(&mut model, &mut frames, of_track, &t);
        assert_eq!(passes.len(), of_track["passes"].as_object().expect("passes").len());
        let shuffled = run(&mut model, &mut Shuffled(frames.clone()), of_track, &t);
        for (pass, found) in &passes {
            let order = &of_track["passes"][pass];
            let (least, worst, identical) = compare(&t, name, pass, order, found);
            println!("{name}, {pass}: least IoU {least:.4}, pointers and scores within {worst:.1e}");
            assert!(least > 0.99, "{name}, {pass}: IoU {least}");
            assert!(worst < 5.0 * TOLERANCE, "{name}, {pass}: {worst:e}");
            assert_eq!(identical, 3 * found.len(), "{name}, {pass}: identities");
            let (control, ..) = compare(&t, name, pass, order, &shuffled[pass]);
            assert!(control < 0.9, "{name}, {pass}: the negative control passes ({control})");
        }
        if name == "first" {
            logits_and_memories_agree(&t, of_track, &passes);
        }
    }
}

fn logits_and_memories_agree(t: &Tensors, of_track: &Value, passes: &BTreeMap<String, Pass>) {
    for (pass, found) in passes {
        let order: Vec<usize> = floats(&of_track["passes"][pass]).into_iter().map(|f| f as usize).collect();
        let all = |of: &dyn Fn(&Output) -> Tensor| -> Vec<f32> {
            order.iter().flat_map(|f| (1..=3).flat_map(|o| of(&found[f][&o]).values).collect::<Vec<_>>()).collect()
        };
        let expected = t.floats(&format!("first.{pass}.logits"));
        let logits = all(&|out| out.logits.clone());
        let zeros = vec![0.0; logits.len()];
        agrees(&format!("{pass}, logits"), &logits, &zeros, &expected.values);
        let expected = t.floats(&format!("first.{pass}.memory"));
        let memory = all(&|out| out.memory.clone().expect("remembered"));
        let turned: Vec<f32> = memory.iter().rev().copied().collect();
        // Kept in 16 bits, where a last bit is 1/256: the mean difference counts, not the largest.
        let mean = |a: &[f32]| {
            let sum: f64 = a.iter().zip(&expected.values).map(|(a, b)| f64::from((a - b).abs())).sum();
            sum / expected.values.iter().map(|v| f64::from(v.abs())).sum::<f64>()
        };
        println!("{pass}, memories: mean difference {:.1e}, negative control {:.1e}", mean(&memory), mean(&turned));
        assert!(mean(&memory) < TOLERANCE && mean(&turned) > 0.1);
    }
}

#[test]
fn a_track_can_be_stopped_and_needs_something_to_follow() {
    let t = Tensors::open("sam2_video.safetensors");
    let mut model = Sam2::open(&fixture::path("sam2.json")).expect("opens");
    let pictures: Vec<_> = (0..3).map(|k| t.picture("frames", k)).collect();
    let mut frames = InMemory::of(&mut model, &pictures).expect("encoded");
    let mut track = Track::new(&mut model, &mut frames, SIZE);
    assert!(matches!(track.run(false, |_, _| true), Err(ModelError::NothingMarked)));
    // A mask without a pixel: the object is not there, and that is no error.
    track.prompt(0, 7, &Prompt::Mask(Mask::empty(SIZE.0, SIZE.1))).expect("prompted");
    let points = Prompt::Points { points: vec![([30.0, 30.0], true)], around: None };
    track.prompt(0, 9, &points).expect("prompted");
    let mut seen = Vec::new();
    track
        .run(false, |frame, found| {
            seen.push((frame, found.keys().copied().collect::<Vec<_>>()));
            frame < 1
        })
        .expect("followed");
    assert_eq!(seen, [(0, vec![7, 9]), (1, vec![7, 9])], "stopped after the second");
}
