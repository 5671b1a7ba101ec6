//! CLIP: tokens, prepared pictures, embeddings.

use fmlgs::math::resize::Filter;
use fmlgs::math::vector::{dot, unit};
use fmlgs::models::clip::ClipEncoder;
use fmlgs::models::clip::tokens::{Tokens, clean};
use fmlgs::models::preprocess::{FitSide, Prepare};
use fmlgs::models::tensor::Tensor;
use fmlgs::models::{Encoder, IdentityCrop, ModelError};
use fmlgs::scene::PhotoPixels;

use super::fixture::{self, Tensors, agrees};

#[test]
fn tokens_are_those_of_open_clip() {
    let (known, tensors) = (fixture::json("clip_tokens.json"), Tensors::open("clip_tokens.safetensors"));
    let (ids, ends) = (tensors.unsigned("ids"), tensors.unsigned("ends"));
    let text = |v: &serde_json::Value| v.as_str().expect("text").to_owned();
    let names: Vec<String> = known["names"].as_array().expect("names").iter().map(text).collect();
    let awkward = known["awkward"].as_array().expect("awkward");
    assert_eq!((names.len(), awkward.len()), (2_148, 200));
    for v in awkward {
        assert_eq!(clean(&text(&v["text"])), text(&v["cleaned"]), "{:?}", v["text"]);
    }
    let tokens = Tokens::new(77);
    let all = names.into_iter().chain(awkward.iter().map(|v| text(&v["text"])));
    let (mut from, mut unlike_plain) = (0, 0);
    for (line, end) in all.zip(ends) {
        let row = tokens.row(&line);
        assert_eq!(row.len(), 77);
        let expected: Vec<i64> = ids[from..end].iter().map(|id| *id as i64).chain([0; 77]).take(77).collect();
        assert_eq!(row, expected, "{line:?}");
        unlike_plain += usize::from(clean(&line) != line.trim());
        from = end;
    }
    assert!(unlike_plain > 20, "the awkward ones need cleaning: {unlike_plain}");
}

#[test]
fn pictures_are_prepared_as_by_pillow() {
    let (t, clip) = (Tensors::open("clip.safetensors"), ClipEncoder::open(&fixture::path("clip.json")).expect("opens"));
    for k in 0..5 {
        let picture = t.picture(&format!("picture{k}"), 0);
        let got = clip.prepare().picture(&picture).expect("pixels");
        let mut turned = picture.clone();
        turned.rgb.reverse();
        let wrong = clip.prepare().picture(&turned).expect("pixels");
        agrees(&format!("picture {k}"), &got.values, &wrong.values, &t.floats(&format!("pixels{k}")).values);
    }
}

#[test]
fn embeddings_are_those_of_open_clip() {
    let (t, mut clip) =
        (Tensors::open("clip.safetensors"), ClipEncoder::open(&fixture::path("clip.json")).expect("opens"));
    let units = |a: &Tensor| -> Vec<f32> {
        a.values.chunks_exact(a.shape[1]).flat_map(|row| unit(row).expect("a direction")).collect()
    };
    let pixels: Vec<Tensor> = (0..5)
        .map(|k| {
            let p = t.floats(&format!("pixels{k}"));
            Tensor::new(&[1, 3, 64, 64], p.values)
        })
        .collect();
    let got = clip.embed_pixels(Tensor::joined(&pixels)).expect("embeds").concat();
    let mirrored: Vec<Tensor> =
        pixels.iter().map(|p| Tensor::new(&p.shape, p.values.iter().rev().copied().collect())).collect();
    let wrong = clip.embed_pixels(Tensor::joined(&mirrored)).expect("embeds").concat();
    agrees("image embeddings", &got, &wrong, &units(&t.floats("image_embedding")));

    let tokens = t.ints("tokens");
    let got = clip.embed_tokens(tokens.clone()).expect("embeds").concat();
    let mut other = tokens;
    other.values.iter_mut().skip(1).step_by(77).for_each(|id| *id = (*id + 5) % 1022);
    let wrong = clip.embed_tokens(other).expect("embeds").concat();
    agrees("text embeddings", &got, &wrong, &units(&t.floats("text_embedding")));
}

#[test]
fn texts_may_end_where_their_rows_say_nothing_more() {
    let (t, mut clip) =
        (Tensors::open("clip.safetensors"), ClipEncoder::open(&fixture::path("clip.json")).expect("opens"));
    let (tokens, official) = (t.ints("tokens"), t.floats("text_embedding"));
    for k in 0..tokens.shape[0] {
        let row = tokens.row(k);
        let ends = row.values.iter().position(|id| *id == 1023).expect("an end") + 1;
        let mut cut =
            |n: usize| clip.embed_tokens(Tensor::new(&[1, n], row.values[..n].to_vec())).expect("embeds").concat();
        let right = unit(&official.row(k).values).expect("a direction");
        agrees("a cut text", &cut(ends), &cut(ends - 1), &right);
    }
}

#[test]
fn tiles_of_any_size_and_phrases_without_words() {
    let mut clip = ClipEncoder::open(&fixture::path("clip.json")).expect("opens");
    assert_eq!((clip.name(), clip.dimension(), clip.tile_side_px()), ("clip", 32, None));
    let tile = |side_px: usize| IdentityCrop {
        side_px,
        rgb: (0..side_px * side_px).map(|i| [(i % 7) as f32 / 7.0; 3]).collect(),
    };
    let both = clip.images(&[tile(9), tile(300)]).expect("embeds");
    assert_eq!(both.len(), 2);
    for v in &both {
        assert!((dot(v, v) - 1.0).abs() < 1e-5);
    }
    assert_eq!(clip.images(&[]).expect("nothing to do").len(), 0);
    // Alone or beside others: sums in another order.
    let alone = clip.image(&tile(9)).expect("embeds");
    assert!(alone.iter().zip(&both[0]).all(|(a, b)| (a - b).abs() < 1e-6));
    // Tokens of CLIP's own vocabulary, of which the reduced network has the first thousand.
    assert!(matches!(clip.text("a cat"), Err(ModelError::Token { tokens: 1024, .. })));
    for empty in ["", "  ", "?!"] {
        assert!(matches!(clip.text(empty), Err(ModelError::NoKnownWord { .. })), "{empty:?}");
    }
    let broken = IdentityCrop { side_px: 3, rgb: vec![[0.0; 3]; 8] };
    assert!(matches!(clip.image(&broken), Err(ModelError::TileSize { .. })));
    let poisoned = IdentityCrop { side_px: 1, rgb: vec![[f32::NAN; 3]] };
    assert!(matches!(clip.image(&poisoned), Err(ModelError::TileColor { pixel: 0 })));
}

#[test]
fn metadata_that_does_not_fit_is_refused() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("clip.json");
    let good = fixture::json("clip.json");
    let with = |key: &str, value: serde_json::Value| {
        let mut changed = good.clone();
        changed[key] = value;
        std::fs::write(&path, changed.to_string()).expect("written");
        ClipEncoder::open(&path).err().map(|e| e.to_string()).unwrap_or_default()
    };
    for (key, value, says) in [
        ("version", 9.into(), "export the model anew"),
        ("kind", "sam".into(), "'clip' is wanted"),
        ("tokenizer", serde_json::json!({ "kind": "hugging-face" }), "clip-bpe"),
        ("interpolation", "nearest".into(), "nearest"),
        ("resize_mode", "wrap".into(), "wrap"),
        ("image_size", serde_json::json!([64, 32]), "square"),
    ] {
        let error = with(key, value);
        assert!(error.contains(says) && error.contains("clip.json"), "{key}: {error}");
    }
    // Graphs that are not there, or have been swapped, are told when they are needed.
    assert_eq!(with("name", "other".into()), "");
    let mut clip = ClipEncoder::open(&path).expect("opens");
    let tokens = || Tensors::open("clip.safetensors").ints("tokens").row(2);
    let missing = clip.embed_tokens(tokens()).expect_err("no graph").to_string();
    assert!(missing.contains("clip_text.onnx"), "{missing}");
    std::fs::copy(fixture::path("clip_image.onnx"), folder.path().join("clip_text.onnx")).expect("copied");
    let swapped = clip.embed_tokens(tokens()).expect_err("another graph").to_string();
    assert!(swapped.contains("another file"), "{swapped}");
}

#[test]
fn a_real_photo_is_prepared_as_the_golden_tensor() {
    let Some(folder) = crate::common::data("clip/clip_bpe_vocab/data") else { return };
    let bytes = std::fs::read(folder.join("expected_preprocessed_image.npy")).expect("readable");
    let golden: Vec<f32> = npyz::NpyFile::new(&bytes[..]).expect("NumPy").into_vec().expect("floats");
    let prepare = Prepare {
        side_px: 224,
        filter: Filter::Bicubic,
        side: FitSide::Shorter,
        mean: [0.481_454_66, 0.457_827_5, 0.408_210_73],
        std: [0.268_629_54, 0.261_302_6, 0.275_777_1],
    };
    let of = |name: &str| {
        let picture = image::open(folder.join(name)).expect("a picture").to_rgb8();
        let (width_px, height_px) = picture.dimensions();
        let rgb = picture.pixels().map(|p| p.0).collect();
        prepare.picture(&PhotoPixels { width_px, height_px, rgb, coverage: None, alpha: None }).expect("pixels").values
    };
    let mean =
        |got: &[f32]| got.iter().zip(&golden).map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / golden.len() as f64;
    let (photo, drawing) = (mean(&of("franz-kafka.jpg")), mean(&of("CLIP.png")));
    let (right, wrong) = (photo.min(drawing), photo.max(drawing));
    println!("mean difference from the golden tensor {right:.2e}, of another picture {wrong:.2e}");
    // Decoders of JPEG differ in the last bit, which is 0.015 here.
    assert!(right < 5e-3 && wrong > 0.1, "{right} {wrong}");
}
