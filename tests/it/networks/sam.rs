//! SAM and SAM 2 on single pictures, and their automatic masks.

use fmlgs::math::resize::{Filter, resize};
use fmlgs::models::preprocess::{FitSide, enlarge};
use fmlgs::models::sam::automatic::{AutomaticMask, AutomaticOptions, MaskCollector, crops, everything};
use fmlgs::models::sam::{PromptedMasks, Sam};
use fmlgs::models::sam2::Sam2;
use fmlgs::models::session_cache::close_idle;
use fmlgs::models::tensor::Tensor;
use fmlgs::scene::Mask;
use serde_json::Value;

use super::fixture::{self, Tensors, agrees};

const CASES: [&str; 6] = ["points", "click", "box", "box_points", "refined", "batch"];

fn decoder_agrees(network: &mut dyn PromptedMasks, t: &Tensors) {
    for case in CASES {
        let (coords, labels) = (t.floats(&format!("{case}.coords")), t.floats(&format!("{case}.labels")));
        let earlier =
            || t.names().contains(&format!("{case}.mask_input")).then(|| t.floats(&format!("{case}.mask_input")));
        let mut swapped = coords.clone();
        swapped.values.chunks_exact_mut(2).for_each(<[f32]>::reverse);
        let mut right = network.masks(coords, labels.clone(), earlier()).expect("masks");
        let wrong = network.masks(swapped, labels, earlier()).expect("masks");
        if network.fit() == FitSide::Both {
            // SAM 2's predictor gives low-resolution logits clamped; larger masks are made of unclamped ones.
            right.masks.values.iter_mut().for_each(|v| *v = v.clamp(-32.0, 32.0));
        }
        let expected = t.floats(&format!("{case}.masks"));
        assert_eq!(right.masks.shape, expected.shape);
        agrees(&format!("{case}, masks"), &right.masks.values, &wrong.masks.values, &expected.values);
        let iou = t.floats(&format!("{case}.iou"));
        // Which of the four is which: a mix-up must not pass.
        let mixed_up: Vec<f32> = right.iou.values.iter().rev().copied().collect();
        agrees(&format!("{case}, predicted IoU"), &right.iou.values, &mixed_up, &iou.values);
    }
}

#[test]
fn sam_agrees_with_the_official_code() {
    let (t, mut sam) = (Tensors::open("sam.safetensors"), Sam::open(&fixture::path("sam.json")).expect("opens"));
    let picture = t.picture("picture", 0);
    let resized =
        resize(&picture.rgb, (picture.width_px as usize, picture.height_px as usize), (128, 96), Filter::Bilinear);
    let official = t.picture("resized", 0).rgb;
    let largest = resized.as_flattened().iter().zip(official.as_flattened()).map(|(a, b)| a.abs_diff(*b)).max();
    assert_eq!(largest, Some(0), "resized bit by bit");
    let mut turned = picture.clone();
    turned.rgb.reverse();
    sam.look(&turned).expect("looks");
    let wrong = sam.embeddings().expect("looked").clone();
    sam.look(&picture).expect("looks");
    let right = sam.embeddings().expect("looked").clone();
    agrees("embeddings", &right.values, &wrong.values, &t.floats("image_embeddings").values);
    decoder_agrees(&mut sam, &t);
    full_size_agrees(&mut sam, &t);
}

#[test]
fn sam2_agrees_with_the_official_code_on_a_picture() {
    let (t, mut sam) = (Tensors::open("sam2.safetensors"), Sam2::open(&fixture::path("sam2.json")).expect("opens"));
    let image = t.floats("image");
    let mut mirrored = image.clone();
    mirrored.values.reverse();
    let (right, wrong) = (sam.encode_pixels(image).expect("encodes"), sam.encode_pixels(mirrored).expect("encodes"));
    let (right_seen, wrong_seen) = (sam.without_memory(&right), sam.without_memory(&wrong));
    agrees("embeddings", &right_seen.values, &wrong_seen.values, &t.floats("image_embeddings").values);
    agrees("fine features", &right.fine.values, &wrong.fine.values, &t.floats("high_res_features1").values);
    agrees("middle features", &right.middle.values, &wrong.middle.values, &t.floats("high_res_features2").values);
    // From the picture itself on.
    sam.look(&t.picture("picture", 0)).expect("looks");
    decoder_agrees(&mut sam, &t);
    full_size_agrees(&mut sam, &t);
}

/// The masks of a click at the picture's size.
fn full_size_agrees(network: &mut dyn PromptedMasks, t: &Tensors) {
    let answer = network.masks(t.floats("click.coords"), t.floats("click.labels"), None).expect("masks");
    let (low, expected) = (answer.masks.shape[3], t.floats("click.full"));
    let (h, w) = (expected.shape[1], expected.shape[2]);
    let full = |j: usize, fit: FitSide| {
        enlarge(&answer.masks.values[j * low * low..(j + 1) * low * low], low, network.side_px(), fit, (w, h))
    };
    let all = |fit: FitSide| (1..4).flat_map(|j| full(j, fit)).collect::<Vec<f32>>();
    let other = if network.fit() == FitSide::Longer { FitSide::Both } else { FitSide::Longer };
    agrees("at full size", &all(network.fit()), &all(other), &expected.values);
}

#[test]
fn refusals_have_a_reason() {
    let mut sam = Sam::open(&fixture::path("sam.json")).expect("opens");
    let point = || (Tensor::filled(&[1, 2, 2], 0.0), Tensor::filled(&[1, 2], -1.0));
    assert!(sam.masks(point().0, point().1, None).is_err(), "no image was encoded");
    let nothing = fmlgs::scene::PhotoPixels { width_px: 0, height_px: 0, rgb: vec![], coverage: None, alpha: None };
    assert!(sam.look(&nothing).is_err());
    assert!(Sam::open(&fixture::path("sam2.json")).is_err() && Sam2::open(&fixture::path("sam.json")).is_err());
}

/// Masks written column by column as runs of 0 and 1.
fn of_runs(counts: &[Value], width: usize, height: usize) -> Mask {
    let mut mask = Mask::empty(width, height);
    let mut at = 0;
    for (k, run) in counts.iter().enumerate() {
        let run = run.as_u64().expect("a length") as usize;
        if k % 2 == 1 {
            (at..at + run).for_each(|i| mask.insert(i % height * width + i / height));
        }
        at += run;
    }
    mask
}

fn options(settings: &Value, area: &Value, per_side: &Value) -> AutomaticOptions {
    let number = |key: &str| settings[key].as_f64().unwrap_or(0.7);
    AutomaticOptions {
        points_per_side: per_side.as_u64().expect("points") as usize,
        batch: 7,
        predicted_iou: number("pred_iou_thresh") as f32,
        stability: number("stability_score_thresh") as f32,
        box_nms: number("box_nms_thresh"),
        crop_layers: settings["crop_n_layers"].as_u64().expect("layers") as u32,
        crop_point_divisor: 1,
        crop_nms: number("crop_nms_thresh"),
        least_region_px: area.as_u64().expect("an area") as usize,
        adaptive: false,
    }
}

/// Masks that are kept of the stored logits.
fn kept(known: &Value, t: &Tensors, kind: &str, options: &AutomaticOptions) -> Vec<AutomaticMask> {
    let size = (known["width"].as_u64().expect("w") as usize, known["height"].as_u64().expect("h") as usize);
    let (step, shift) = (known["step"].as_f64().expect("step") as f32, known["shift"].as_f64().expect("shift") as f32);
    let (shape, logits) = t.bytes(&format!("{kind}.logits"));
    let iou = t.floats(&format!("{kind}.iou"));
    let (points, plane) = (shape[1], shape[3] * shape[4]);
    let fit = if kind == "sam" { FitSide::Longer } else { FitSide::Both };
    let side = known["side"].as_u64().expect("side") as usize;
    let mut collector = MaskCollector { size, side, fit, options, found: Vec::new() };
    let boxes = crops(size.0, size.1, options.crop_layers);
    for (c, (crop, _)) in boxes.iter().enumerate() {
        let logits: Vec<f32> = logits.iter().map(|b| (f32::from(*b as i8) + shift) * step).collect();
        let answers: Vec<_> = (0..points)
            .map(|p| {
                let k = c * points + p;
                let planes = std::array::from_fn(|j| &logits[(k * 3 + j) * plane..(k * 3 + j + 1) * plane]);
                let per_side = options.points_per_side;
                let (w, h) = ((crop[2] - crop[0]) as f64, (crop[3] - crop[1]) as f64);
                let at = |i: usize| (i as f64 + 0.5) / per_side as f64;
                let point = [at(p % per_side) * w + crop[0] as f64, at(p / per_side) * h + crop[1] as f64];
                (planes, std::array::from_fn(|j| iou.values[k * 3 + j]), point)
            })
            .collect();
        let judged = collector.judge(&answers, *crop);
        collector.keep(judged.concat());
    }
    collector.finish(boxes.len() > 1)
}

#[test]
fn automatic_masks_are_those_of_the_official_generators() {
    let (known, t) = (fixture::json("automatic.json"), Tensors::open("automatic.safetensors"));
    let boxes: Vec<Value> = crops(240, 180, 1).iter().map(|(b, _)| serde_json::json!(b)).collect();
    assert_eq!(Value::from(boxes), known["crop_boxes"]);
    let (mut masks, mut different) = (0, 0);
    for kind in ["sam", "sam2"] {
        for (name, settings) in known["settings"].as_object().expect("settings") {
            let area = if kind == "sam" {
                &settings["min_mask_region_area"]
            } else {
                &known["sam2_min_mask_region_area"][name]
            };
            let options = options(settings, area, &known["points_per_side"]);
            let got = kept(&known, &t, kind, &options);
            let expected = known["results"][kind][name].as_array().expect("results");
            assert_eq!(got.len(), expected.len(), "{kind}, {name}");
            for (k, (got, expected)) in got.iter().zip(expected).enumerate() {
                let number = |key: &str| expected[key].as_f64().expect("a number");
                let mask = of_runs(expected["counts"].as_array().expect("runs"), 240, 180);
                assert_eq!(got.mask.area(), expected["area"].as_u64().expect("area") as usize, "{kind}, {name}, {k}");
                assert_eq!(got.mask, mask, "{kind}, {name}, {k}");
                assert!((f64::from(got.predicted_iou) - number("predicted_iou")).abs() < 1e-6);
                assert!((f64::from(got.stability) - number("stability_score")).abs() < 1e-6);
                let [l, t, r, b] = got.bounds;
                assert_eq!(serde_json::json!([l, t, r - l, b - t]), expected["bbox"], "{kind}, {name}, {k}");
                let point = expected["point"].as_array().expect("a point");
                assert!((0..2).all(|c| (got.point[c] - point[c].as_f64().expect("px")).abs() < 1e-3));
                masks += 1;
            }
            // Other thresholds keep other masks.
            let strict = AutomaticOptions { stability: 0.93, box_nms: 0.3, ..options };
            different += usize::from(kept(&known, &t, kind, &strict).len() != expected.len());
        }
    }
    assert!(masks > 60, "{masks}");
    assert_eq!(different, 6, "the negative control");
}

#[test]
fn everything_in_a_picture_is_asked_for_crop_by_crop() {
    let t = Tensors::open("sam2.safetensors");
    let picture = t.picture("picture", 0);
    let options = AutomaticOptions {
        points_per_side: 3,
        batch: 4,
        predicted_iou: 0.0,
        stability: 0.3,
        least_region_px: 2,
        ..AutomaticOptions::default()
    };
    let networks: [Box<dyn PromptedMasks>; 2] = [
        Box::new(Sam::open(&fixture::path("sam.json")).expect("opens")),
        Box::new(Sam2::open(&fixture::path("sam2.json")).expect("opens")),
    ];
    for mut network in networks {
        let mut shares = Vec::new();
        let all = everything(&mut *network, &picture, &options, &mut |share| {
            shares.push(share);
            true
        });
        let all = all.expect("masks");
        assert!(!all.is_empty(), "{}: nothing", network.name());
        assert!(all.iter().all(|f| f.mask.width_px() == 96 && f.mask.height_px() == 72 && !f.mask.is_empty()));
        assert_eq!(shares.len(), 20, "five crops, each a look and three batches");
        // A look is asked for with the share at which its first batch begins.
        assert!(shares.windows(2).enumerate().all(|(i, w)| if i % 4 == 0 { w[0] == w[1] } else { w[0] < w[1] }));
        assert!(shares[19] < 1.0);
        let mut asked = 0;
        let some = everything(&mut *network, &picture, &options, &mut |_| {
            asked += 1;
            asked < 3
        });
        assert!(some.expect("cancelled").len() <= all.len() && asked == 3);
    }
}

#[test]
fn networks_that_were_closed_to_make_room_open_again() {
    let (t, mut sam) = (Tensors::open("sam.safetensors"), Sam::open(&fixture::path("sam.json")).expect("opens"));
    sam.look(&t.picture("picture", 0)).expect("looks");
    let before = sam.embeddings().expect("looked").clone();
    assert!(close_idle() >= 1, "one lies idle");
    sam.look(&t.picture("picture", 0)).expect("opens again");
    assert_eq!(sam.embeddings(), Some(&before));
    drop(sam);
}
