//! The real binary on LangSplat's `language_features/`: objects and their embeddings without any network.

use std::path::Path;

use fmlgs::jobs;
use npyz::WriterBuilder;

use crate::cli_support::{Done, command, first_version, folder};

/// Objects of the scene, numbered from 1 in its id maps.
const OBJECTS: usize = 3;
const DIMENSION: usize = 512;

/// Writes an array of 32-bit fractions as NumPy does.
fn write(path: &Path, shape: &[u64], values: &[f32]) {
    let file = std::fs::File::create(path).unwrap();
    let mut out = npyz::WriteOptions::new().default_dtype().shape(shape).writer(file).begin_nd().unwrap();
    out.extend(values.iter().copied()).unwrap();
    out.finish().unwrap();
}

/// Writes the files of every photo: its objects are the large masks, and the vector of the n-th has a one at n.
fn language_features(photos: &Path, to: &Path) {
    std::fs::create_dir(to).unwrap();
    for entry in std::fs::read_dir(photos.join("object_ids")).unwrap() {
        let path = entry.unwrap().path();
        let ids = image::open(&path).unwrap().into_luma16();
        let mut levels = vec![-1.0; 4 * ids.len()];
        let large = levels[3 * ids.len()..].iter_mut();
        large.zip(ids.iter()).for_each(|(mask, id)| *mask = f32::from(*id) - 1.0);
        let stem = path.file_stem().unwrap().to_str().unwrap();
        let (width, height) = (u64::from(ids.width()), u64::from(ids.height()));
        write(&to.join(format!("{stem}_s.npy")), &[4, height, width], &levels);
        let vectors: Vec<f32> =
            (0..OBJECTS * DIMENSION).map(|i| f32::from(u8::from(i / DIMENSION == i % DIMENSION))).collect();
        write(&to.join(format!("{stem}_f.npy")), &[OBJECTS as u64, DIMENSION as u64], &vectors);
    }
}

#[test]
fn masks_with_vectors_give_objects_and_embeddings_without_a_network() {
    let folder = folder();
    let photos = first_version(folder.path());
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (scene, features) = (at("scene"), at("language_features"));
    language_features(&photos, Path::new(&features));
    let run = |more: &[&str]| -> Done {
        let arguments = [&["preprocess", &scene, "--masks", &features, "--max-seeds", "1"], more].concat();
        command(&arguments).env("FMLGS_ONNXRUNTIME", "none").env("FMLGS_MODELS", at("models")).output().unwrap().into()
    };
    let told = run(&[]).ok().stderr;
    assert!(told.contains("the vectors of the masks (clip-vit-b16)"), "{told}");
    let map = jobs::open::scene(Path::new(&scene)).unwrap().semantics().unwrap();
    let language = map.language.as_ref().unwrap();
    assert_eq!((map.identities.len(), language.encoder.as_str(), language.dimension), (OBJECTS, "clip-vit-b16", 512));
    let mut objects: Vec<usize> = Vec::new();
    for features in &language.by_identity {
        let vector = &features.raw[0];
        objects.extend(vector.iter().position(|v| (v - 1.0).abs() < 1e-5));
    }
    objects.sort_unstable();
    assert_eq!(objects, [0, 1, 2], "each object has the vector of its own masks");

    // The controls: none is asked for, and vectors that an autoencoder has compressed.
    run(&["--encoder", "none"]).ok();
    assert_eq!(jobs::open::scene(Path::new(&scene)).unwrap().semantics().unwrap().language, None);
    write(&folder.path().join("language_features/0000_f.npy"), &[3, 3], &[0.5; 9]);
    let refused = run(&[]).fails_with(1).stderr;
    assert!(refused.contains("autoencoder") && refused.contains("0000_f.npy"), "{refused}");
}
