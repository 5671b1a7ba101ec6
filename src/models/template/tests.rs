//! The reduced CLIP from its official file, compared with the graphs that Python exported from the same weights.

use std::path::PathBuf;

use safetensors::tensor::{Dtype, TensorView};

use super::*;
use crate::math::stats;
use crate::models::clip::ClipEncoder;
use crate::models::tensor::Tensor;

pub(super) type Weights = BTreeMap<String, (Vec<usize>, Vec<f32>)>;

pub(super) fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/networks").join(name)
}

fn filled(checkpoint: &Path, folder: &Path) -> Result<(), ModelError> {
    let template = std::fs::read(fixture("clip_template.zip")).expect("a fixture");
    Template::read(&template)?.fill(checkpoint, folder, "clip.json", &mut |_, _| true)
}

/// Embeddings of pictures and of texts.
fn embeddings(description: &Path) -> Vec<f32> {
    let stored = std::fs::read(fixture("clip.safetensors")).expect("a fixture");
    let stored = safetensors::SafeTensors::deserialize(&stored).expect("tensors");
    let pixels = stored.tensor("pixels0").expect("pixels");
    let pixels = pixels.data().as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
    let tokens = stored.tensor("tokens").expect("tokens");
    let shape = tokens.shape().to_vec();
    let tokens = tokens.data().as_chunks::<8>().0.iter().map(|b| i64::from_le_bytes(*b)).collect();
    let mut clip = ClipEncoder::open(description).expect("opens");
    let pictures = clip.embed_pixels(Tensor::new(&[1, 3, 64, 64], pixels)).expect("pictures");
    let texts = clip.embed_tokens(Tensor::new(&shape, tokens)).expect("texts");
    [pictures.concat(), texts.concat()].concat()
}

fn weights() -> Weights {
    weights_of("clip.pt")
}

/// Floating-point weights of an official file, to be changed.
pub(super) fn weights_of(checkpoint: &str) -> Weights {
    let mut file = WeightFile::open(&fixture(checkpoint)).expect("opens");
    let floats = file.tensors.iter().filter(|(_, t)| t.dtype.is_float());
    let shapes: Vec<(String, Vec<usize>)> = floats.map(|(n, t)| (n.clone(), t.shape.clone())).collect();
    let one = |(name, shape): (String, Vec<usize>)| {
        let floats = file.floats(&name).expect("numbers");
        (name, (shape, floats))
    };
    shapes.into_iter().map(one).collect()
}

pub(super) fn store(weights: &Weights, path: &Path) {
    let bytes: Vec<Vec<u8>> =
        weights.values().map(|(_, floats)| floats.iter().flat_map(|v| v.to_le_bytes()).collect()).collect();
    let views = weights.iter().zip(&bytes).map(|((name, (shape, _)), bytes)| {
        (name.clone(), TensorView::new(Dtype::F32, shape.clone(), bytes).expect("a view"))
    });
    std::fs::write(path, safetensors::serialize(views, None).expect("stored")).expect("written");
}

pub(super) fn swap(weights: &mut Weights, a: &str, b: &str) {
    let first = weights[a].1.clone();
    let second = std::mem::replace(&mut weights.get_mut(b).expect("b").1, first);
    weights.get_mut(a).expect("a").1 = second;
}

pub(super) fn transpose(weights: &mut Weights, name: &str) {
    let (shape, floats) = weights.get_mut(name).expect("a matrix");
    let (rows, columns) = (shape[0], shape[1]);
    *floats = (0..rows * columns).map(|i| floats[i % rows * columns + i / rows]).collect();
    *shape = vec![columns, rows];
}

#[test]
fn an_official_file_gives_what_the_export_gives() {
    let folder = tempfile::tempdir().expect("folder");
    let models = folder.path().join("models");
    filled(&fixture("clip.pt"), &models).expect("filled");
    let expected = embeddings(&fixture("clip.json"));
    let error = |description: &Path| {
        stats::worst_difference(&embeddings(description), &expected) / stats::worst(expected.iter().map(|v| v.abs()))
    };
    let worst = error(&models.join("clip.json"));
    println!("relative difference {worst:.1e}");
    assert!(worst < 1e-6, "{worst:e}");
    // The same weights in another file make the same graphs.
    let (file, again) = (folder.path().join("clip.safetensors"), folder.path().join("again"));
    store(&weights(), &file);
    filled(&file, &again).expect("filled");
    for name in ["clip_image.onnx", "clip_text.onnx"] {
        let of = |folder: &Path| std::fs::read(folder.join(name)).expect("a graph");
        assert!(of(&models) == of(&again), "{name}");
    }
    // Swapped weights of equal shape change the outputs.
    for change in [
        |w: &mut Weights| swap(w, "transformer.resblocks.0.mlp.c_fc.weight", "transformer.resblocks.1.mlp.c_fc.weight"),
        |w: &mut Weights| swap(w, "visual.ln_pre.weight", "visual.ln_pre.bias"),
        |w: &mut Weights| transpose(w, "visual.transformer.resblocks.1.attn.out_proj.weight"),
    ] {
        let mut wrong = weights();
        change(&mut wrong);
        store(&wrong, &file);
        filled(&file, &again).expect("nothing tells");
        let control = error(&again.join("clip.json"));
        assert!(control > 1e-3, "the control passes: {control:e}");
    }
}

#[test]
fn another_checkpoint_is_refused_by_the_name_of_its_tensor() {
    const NAME: &str = "transformer.resblocks.0.mlp.c_fc.weight";
    let folder = tempfile::tempdir().expect("folder");
    let (file, models) = (folder.path().join("clip.safetensors"), folder.path().join("models"));
    type Change = fn(&mut Weights);
    let changes: [(Change, &[&str]); 4] = [
        (|w| drop(w.remove(NAME)), &[NAME, "missing"]),
        (|w| transpose(w, NAME), &[NAME, "[32, 128]", "[128, 32]"]),
        (|w| drop(w.insert("visual.extra".into(), (vec![1], vec![0.0]))), &["visual.extra", "unknown"]),
        (|w| w.get_mut(NAME).expect("there").1[7] = f32::NAN, &[NAME, "NaN at place 7"]),
    ];
    for (change, says) in changes {
        let mut other = weights();
        change(&mut other);
        store(&other, &file);
        let error = filled(&file, &models).expect_err("refused").to_string();
        assert!(says.iter().all(|text| error.contains(text)) && error.contains("clip.safetensors"), "{error}");
        let left = std::fs::read_dir(&models).map_or(0, Iterator::count);
        assert_eq!(left, 0, "{says:?} leaves something behind");
    }
    let error = filled(&fixture("tiny.pt"), &models).expect_err("another model").to_string();
    assert!(error.contains("tiny.pt") && error.contains("missing"), "{error}");
    // Settings in official files are not taken for weights.
    let mut more = weights();
    more.insert("input_resolution".into(), (vec![], vec![224.0]));
    store(&more, &file);
    filled(&file, &models).expect("filled");
}

#[test]
fn whole_numbers_are_no_weights_and_a_stop_leaves_nothing() {
    let folder = tempfile::tempdir().expect("folder");
    let (file, models) = (folder.path().join("clip.safetensors"), folder.path().join("models"));
    let weights = weights();
    let bytes: Vec<Vec<u8>> = weights.values().map(|(_, f)| vec![0; 4 * f.len()]).collect();
    let views = weights.iter().zip(&bytes).map(|((name, (shape, _)), bytes)| {
        let dtype = if name == "visual.proj" { Dtype::I32 } else { Dtype::F32 };
        (name.clone(), TensorView::new(dtype, shape.clone(), bytes).expect("a view"))
    });
    std::fs::write(&file, safetensors::serialize(views, None).expect("stored")).expect("written");
    let error = filled(&file, &models).expect_err("refused").to_string();
    assert!(error.contains("visual.proj") && error.contains("whole numbers"), "{error}");

    let template = std::fs::read(fixture("clip_template.zip")).expect("a fixture");
    let mut template = Template::read(&template).expect("read");
    let mut told = Vec::new();
    let stopped = template.fill(&fixture("clip.pt"), &models, "clip.json", &mut |done, all| {
        told.push((done, all));
        done < 9
    });
    assert!(matches!(stopped, Err(ModelError::Cancelled)));
    assert_eq!(told.last().map(|(done, _)| *done), Some(9));
    assert_eq!(std::fs::read_dir(&models).map_or(0, Iterator::count), 0);
}
