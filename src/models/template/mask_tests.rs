//! The reduced SAM, SAM 2 and MobileSAM from their official files, compared with the graphs that Python exported from
//! the same weights.

use safetensors::tensor::{Dtype, TensorView};

use super::tests::{Weights, fixture, store, swap, transpose, weights_of};
use super::*;
use crate::math::stats;
use crate::models::manifest;
use crate::models::sam::{PromptedMasks, Sam};
use crate::models::sam2::Sam2;
use crate::models::sam2::sequence::InMemory;
use crate::models::sam2::track::{Prompt, Track};
use crate::models::tensor::Tensor;
use crate::scene::PhotoPixels;

/// Official file, the template that it fills, and their description.
struct Family {
    checkpoint: &'static str,
    template: &'static str,
    description: &'static str,
    /// Tensors of one shape; a square one; one that is removed.
    alike: [&'static str; 2],
    square: &'static str,
    gone: &'static str,
}

const QUERY: &str = "mask_decoder.transformer.layers.0.self_attn.q_proj.weight";
const OUT: &str = "mask_decoder.transformer.layers.1.self_attn.out_proj.weight";

const FAMILIES: [Family; 4] = [
    Family {
        checkpoint: "sam.pth",
        template: "sam_template.zip",
        description: "sam.json",
        alike: ["image_encoder.blocks.0.mlp.lin1.weight", "image_encoder.blocks.1.mlp.lin1.weight"],
        square: QUERY,
        gone: "image_encoder.blocks.1.attn.rel_pos_h",
    },
    // As for ViT-H, the encoder has two graphs.
    Family {
        checkpoint: "sam.pth",
        template: "sam_parts_template.zip",
        description: "sam.json",
        alike: [QUERY, OUT],
        square: "image_encoder.blocks.1.attn.proj.weight",
        gone: "image_encoder.pos_embed",
    },
    Family {
        checkpoint: "sam2.pt",
        template: "sam2_template.zip",
        description: "sam2.json",
        alike: ["memory_attention.layers.0.norm1.weight", "memory_attention.layers.1.norm3.bias"],
        square: "memory_attention.layers.0.self_attn.q_proj.weight",
        gone: "maskmem_tpos_enc",
    },
    Family {
        checkpoint: "mobile.pt",
        template: "mobile_template.zip",
        description: "mobile.json",
        alike: ["image_encoder.layers.0.blocks.0.conv1.bn.weight", "image_encoder.layers.0.blocks.0.conv1.bn.bias"],
        square: "image_encoder.layers.1.blocks.0.attn.proj.weight",
        gone: "image_encoder.layers.2.blocks.0.attn.attention_biases",
    },
];

impl Family {
    fn fill(&self, checkpoint: &Path, folder: &Path) -> Result<(), ModelError> {
        let template = std::fs::read(fixture(self.template)).expect("a fixture");
        Template::read(&template)?.fill(checkpoint, folder, self.description, &mut |_, _| true)
    }
}

fn picture(turn: u32) -> PhotoPixels {
    let color = |i: u32| {
        let (x, y) = (i % 96 + turn, i / 96);
        [(x * x / 40 + y) as u8, (y * 3) as u8 ^ (x as u8 & 0x38), (x * 2 + y) as u8]
    };
    PhotoPixels { width_px: 96, height_px: 72, rgb: (0..96 * 72).map(color).collect(), coverage: None, alpha: None }
}

/// Outputs of the networks of a description, by group; every graph takes part.
fn answers(description: &Path) -> Vec<Vec<f32>> {
    let clicks = || Tensor::new(&[2, 2, 2], vec![40.0, 50.0, 0.0, 0.0, 80.0, 30.0, 0.0, 0.0]);
    let labels = || Tensor::new(&[2, 2], vec![1.0, -1.0, 1.0, -1.0]);
    let ask = |network: &mut dyn PromptedMasks| {
        network.look(&picture(0)).expect("looks");
        let first = network.masks(clicks(), labels(), None).expect("masks");
        let earlier = Tensor::joined([&first.masks; 1]);
        let low = earlier.shape[3];
        let own: Vec<f32> = (0..2).flat_map(|p| earlier.values[p * 4 * low * low..][..low * low].to_vec()).collect();
        let refined = network.masks(clicks(), labels(), Some(Tensor::new(&[2, 1, low, low], own))).expect("masks");
        vec![first.masks.values, first.iou.values, refined.masks.values, refined.iou.values]
    };
    if manifest::kind(description).expect("a kind") == "sam" {
        let mut sam = Sam::open(description).expect("opens");
        let said = ask(&mut sam);
        return [said, vec![sam.embeddings().expect("looked").values.clone()]].concat();
    }
    let mut sam2 = Sam2::open(description).expect("opens");
    let mut said = ask(&mut sam2);
    let pictures: Vec<_> = (0..3).map(|t| picture(5 * t)).collect();
    let mut frames = InMemory::of(&mut sam2, &pictures).expect("encoded");
    let mut track = Track::new(&mut sam2, &mut frames, (96, 72));
    let mask = crate::scene::Mask::from_fn(96, 72, |i| (20..50).contains(&(i % 96)) && (20..60).contains(&(i / 96)));
    track.prompt(0, 1, &Prompt::Mask(mask)).expect("prompted");
    track
        .run(false, |_, found| {
            said.extend(found.values().flat_map(|out| [out.logits.values.clone(), out.pointer.values.clone()]));
            true
        })
        .expect("followed");
    said
}

/// Largest difference of a group, relative to the largest number in it.
fn difference(got: &[Vec<f32>], expected: &[Vec<f32>]) -> f64 {
    assert_eq!(got.len(), expected.len());
    let of = |(got, expected): (&Vec<f32>, &Vec<f32>)| {
        stats::worst_difference(got, expected) / stats::worst(expected.iter().map(|v| v.abs()))
    };
    stats::worst(got.iter().zip(expected).map(of))
}

#[test]
fn official_files_give_what_the_exports_give() {
    for family in FAMILIES {
        let folder = tempfile::tempdir().expect("folder");
        let (file, models) = (folder.path().join("a.safetensors"), folder.path().join("models"));
        family.fill(&fixture(family.checkpoint), &models).expect("filled");
        let expected = answers(&fixture(family.description));
        let worst = difference(&answers(&models.join(family.description)), &expected);
        println!("{}: relative difference {worst:.1e}", family.template);
        assert!(worst < 1e-6, "{}: {worst:e}", family.template);
        // Swapped weights of equal shape change the outputs.
        type Change = fn(&Family, &mut Weights);
        let changes: [Change; 2] = [|f, w| swap(w, f.alike[0], f.alike[1]), |f, w| transpose(w, f.square)];
        let root = if family.checkpoint == "sam2.pt" { "model." } else { "" };
        for change in changes {
            let mut wrong: Weights = weights_of(family.checkpoint);
            wrong = wrong.into_iter().map(|(n, v)| (n.strip_prefix(root).unwrap_or(&n).to_owned(), v)).collect();
            change(&family, &mut wrong);
            store(&wrong, &file);
            family.fill(&file, &models).expect("nothing tells");
            let control = difference(&answers(&models.join(family.description)), &expected);
            assert!(control > 1e-3, "{}: the control passes: {control:e}", family.template);
        }
    }
}

#[test]
fn other_files_are_refused_by_the_name_of_a_tensor() {
    for family in FAMILIES {
        let folder = tempfile::tempdir().expect("folder");
        let (file, models) = (folder.path().join("a.safetensors"), folder.path().join("models"));
        let weights = weights_of(family.checkpoint);
        let name = weights.keys().find(|n| n.ends_with(family.gone)).expect("there").clone();
        let refused = |says: &[&str]| {
            let error = family.fill(&file, &models).expect_err("refused").to_string();
            assert!(says.iter().all(|text| error.contains(text)) && error.contains("a.safetensors"), "{error}");
            assert_eq!(std::fs::read_dir(&models).map_or(0, Iterator::count), 0, "{says:?} leaves something");
        };
        let mut other = weights.clone();
        other.remove(&name);
        store(&other, &file);
        refused(&[&name, "missing"]);
        let mut other = weights.clone();
        other.get_mut(&name).expect("there").0.insert(0, 1);
        store(&other, &file);
        refused(&[&name, "has the shape"]);
        let mut other = weights.clone();
        other.insert(format!("{name}.more"), (vec![1], vec![0.0]));
        store(&other, &file);
        refused(&[&format!("{name}.more"), "unknown"]);
        let bytes: Vec<Vec<u8>> = weights.values().map(|(_, floats)| vec![0; 4 * floats.len()]).collect();
        let views = weights.iter().zip(&bytes).map(|((n, (shape, _)), bytes)| {
            let dtype = if *n == name { Dtype::I32 } else { Dtype::F32 };
            (n.clone(), TensorView::new(dtype, shape.clone(), bytes).expect("a view"))
        });
        std::fs::write(&file, safetensors::serialize(views, None).expect("stored")).expect("written");
        refused(&[&name, "whole numbers"]);
    }
}
