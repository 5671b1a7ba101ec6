//! Results in the exact formats of their methods (`tools/results/write_samples.py`), and broken ones.

use std::path::{Path, PathBuf};

use super::numpy::{self, NumpyArray};
use super::*;

/// Folder of the samples.
pub(crate) fn samples() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/results")
}

/// Opens a sample.
pub(crate) fn sample(path: &str) -> MethodResult {
    open_result(&samples().join(path), &ResultOptions::default()).expect(path)
}

fn array(path: &str) -> NumpyArray {
    numpy::read(&samples().join(path)).expect(path)
}

/// Numbers of an expected array.
pub(crate) fn expected(path: &str) -> Vec<f32> {
    array(path).floats()
}

/// Bits of numbers, so that zeros of both signs differ.
fn bits(v: &[f32]) -> Vec<u32> {
    v.iter().map(|v| v.to_bits()).collect()
}

/// All codes of a level, one after the other.
pub(super) fn codes(level: &ResultLevel) -> Vec<f32> {
    let LevelValues::Embedded(embedded) = &level.values else { panic!("no embeddings") };
    let dim = embedded.codes.dim();
    let mut all = vec![0.0; embedded.codes.len() * dim];
    all.chunks_exact_mut(dim).enumerate().for_each(|(i, row)| embedded.codes.copy(i, 0, row));
    all
}

/// Checks the Gaussians of a sample with those of the scene that all samples show.
fn is_the_scene(result: &MethodResult, count: usize) {
    let cloud = &result.cloud;
    let has = |values: &[f32], name: &str, each: usize| {
        let all = expected(&format!("scene/{name}.npy"));
        assert_eq!(bits(values), bits(&all[..count * each]), "{name}");
    };
    has(cloud.positions.as_flattened(), "xyz", 3);
    has(cloud.quaternions.as_flattened(), "rotation", 4);
    has(&cloud.opacity_logits, "opacity", 1);
    has(cloud.sh.as_flattened(), "sh", 48);
    assert!(cloud.extras.is_empty(), "{:?}", cloud.extras.iter().map(|e| &e.name).collect::<Vec<_>>());
}

#[test]
fn gaussian_grouping_has_its_features_and_its_classifier() {
    for path in ["gaussian_grouping", "gaussian_grouping/point_cloud/iteration_30000/point_cloud.ply"] {
        let result = sample(path);
        is_the_scene(&result, 32);
        assert_eq!((result.method, result.cameras.len(), result.method.encoder()), (Method::GaussianGrouping, 2, None));
        let LevelValues::Classes { features, classifier } = &result.levels[0].values else { panic!("no classes") };
        assert_eq!(bits(&features.to_vec()), bits(&expected("gaussian_grouping/expected/features.npy")));
        assert_eq!((classifier.weight.len(), classifier.weight.dim(), classifier.bias.len()), (256, 16, 256));
    }
    let turned: Vec<f32> = expected("gaussian_grouping/expected/features.npy").into_iter().rev().collect();
    let LevelValues::Classes { features, .. } = &sample("gaussian_grouping").levels[0].values else {
        panic!("no classes")
    };
    assert_ne!(bits(&features.to_vec()), bits(&turned), "the control");
}

/// A copy of Gaussian Grouping's sample in `folder` whose classes have names.
pub(crate) fn with_class_names(folder: &Path, names: &str) -> PathBuf {
    let to = folder.join("named");
    copied(&samples().join("gaussian_grouping"), &to);
    std::fs::write(to.join("point_cloud/iteration_30000/class_names.txt"), names).expect("written");
    to
}

#[test]
fn classes_of_gaussian_grouping_have_the_names_in_a_file() {
    let folder = tempfile::tempdir().expect("folder");
    let opened = open_result(&with_class_names(folder.path(), "7 kettle\n3 mug\n"), &ResultOptions::default());
    let LevelValues::Classes { classifier, .. } = &opened.expect("opens").levels[0].values else { panic!("classes") };
    let named = ["kettle", "the Kettle", "mug", "class 7", "lid"].map(|name| classifier.named(name));
    assert_eq!(named, [Some(7), Some(7), Some(3), None, None]);
    let LevelValues::Classes { classifier, .. } = &sample("gaussian_grouping").levels[0].values else {
        panic!("no classes")
    };
    assert_eq!(classifier.named("kettle"), None, "the control");
    let e = refused(&with_class_names(folder.path(), "7 kettle\n999 mug\n"));
    assert!(e.contains("class_names.txt") && e.contains("line 2"), "{e}");
}

#[test]
fn another_text_encoder_is_taken_where_there_is_a_language() {
    let options = ResultOptions { encoder: Some("demo".into()), ..ResultOptions::default() };
    for path in ["langsplat/output", "opengaussian", "feature_3dgs/lseg"] {
        let other = open_result(&samples().join(path), &options).expect(path);
        assert_eq!(other.encoder.as_deref(), Some("demo"), "{path}");
        let usual = sample(path);
        assert_eq!(usual.encoder.as_deref(), usual.method.encoder(), "the control");
    }
    let e = open_result(&samples().join("gaussian_grouping"), &options).expect_err("no language").to_string();
    assert!(e.contains("Gaussian Grouping") && e.contains("--encoder"), "{e}");
}

#[test]
fn omniseg3d_has_features_without_a_classifier() {
    let folder = tempfile::tempdir().expect("folder");
    let splat = samples().join("gaussian_grouping/point_cloud/iteration_30000/point_cloud.ply");
    let copy = folder.path().join("point_cloud.ply");
    std::fs::copy(splat, &copy).expect("copied");
    let result = open_result(&copy, &ResultOptions::default()).expect("opens");
    assert_eq!(result.method, Method::OmniSeg3d);
    assert!(matches!(&result.levels[0].values, LevelValues::Affinity { gate: None, .. }));
}

#[test]
fn open_gaussian_has_its_clusters() {
    let result = sample("opengaussian");
    is_the_scene(&result, 32);
    assert_eq!(result.method.encoder(), Some(OPEN_CLIP));
    let LevelValues::Clusters(clusters) = &result.levels[0].values else { panic!("no clusters") };
    let of: Vec<i64> = clusters.of.iter().map(|c| i64::from(c.expect("a cluster"))).collect();
    assert_eq!(Some(of), array("opengaussian/expected/leaf_of.npy").integers());
    let leaves = clusters.leaves.as_ref().expect("leaves");
    assert_eq!((leaves.in_root, leaves.codes.as_ref().map(FeatureRows::len)), (3, Some(12)));
    assert!(clusters.features.row(0).iter().all(|v| *v == 0.0), "seen three times");
    assert!(clusters.features.row(1).iter().any(|v| *v != 0.0));
}

#[test]
fn feature_3dgs_has_its_features_whole_and_short() {
    let whole = sample("feature_3dgs/lseg");
    is_the_scene(&whole, 16);
    assert_eq!(whole.method.encoder(), Some(CLIP_B32));
    let first = expected("feature_3dgs/expected/semantic_first_rows.npy");
    assert_eq!(bits(&codes(&whole.levels[0])[..first.len()]), bits(&first));
    for path in ["feature_3dgs/lseg_speedup", "feature_3dgs/lseg_speedup/chkpnt7000.pth"] {
        let short = sample(path);
        assert_eq!(bits(&codes(&short.levels[0])), bits(&expected("feature_3dgs/expected/speedup_semantic.npy")));
        let LevelValues::Embedded(level) = &short.levels[0].values else { panic!("no embeddings") };
        assert_eq!((level.decoder.inputs(), level.decoder.outputs()), (16, 512));
    }
}

#[test]
fn saga_has_its_features_and_its_gate() {
    for path in ["saga", "saga/point_cloud/iteration_10000/contrastive_feature_point_cloud.ply"] {
        let result = sample(path);
        is_the_scene(&result, 32);
        let LevelValues::Affinity { features, gate } = &result.levels[0].values else { panic!("no affinities") };
        assert_eq!(bits(&features.to_vec()), bits(&expected("saga/expected/features.npy")));
        let at = gate.as_ref().expect("a gate").at(0.5);
        let wanted = expected("saga/expected/gate_at_half.npy");
        assert!(at.iter().zip(&wanted).all(|(a, b)| (a - b).abs() < 1e-6), "{at:?}");
    }
}

#[test]
fn gags_has_its_codes_and_a_decoder_with_skips() {
    for path in ["gags", "gags/point_cloud/iteration_30000/point_cloud.ply", "gags/decoder_chkpnt30000.pth"] {
        let result = sample(path);
        is_the_scene(&result, 32);
        assert_eq!((result.method, result.method.encoder()), (Method::Gags, Some(OPEN_CLIP)), "{path}");
        assert_eq!(bits(&codes(&result.levels[0])), bits(&expected("gags/expected/codes.npy")));
        let LevelValues::Embedded(level) = &result.levels[0].values else { panic!("no embeddings") };
        assert_eq!((level.decoder.inputs(), level.decoder.outputs()), (16, 512));
        let count = |wanted| level.decoder.split().0.iter().filter(|step| **step == wanted).count();
        assert_eq!([DecoderStep::Relu, DecoderStep::Keep, DecoderStep::AddKept].map(count), [8, 2, 2]);
        let wanted = expected("gags/expected/decoded_first_rows.npy");
        let apart = |i: usize, row: usize| {
            let (mut code, wanted) = (vec![0.0; 16], &wanted[512 * row..]);
            level.codes.copy(i, 0, &mut code);
            let found = level.decoder.embedding(&code);
            found.iter().zip(wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
        };
        assert!((0..4).all(|i| apart(i, i) < 1e-4) && apart(0, 1) > 1e-3, "the control: another row");
    }
}

#[test]
fn legaussians_has_its_codes_its_decoder_and_its_codebook() {
    let result = sample("legaussians/output");
    is_the_scene(&result, 32);
    assert_eq!(bits(&codes(&result.levels[0])), bits(&expected("legaussians/expected/codes.npy")));
    let LevelValues::Embedded(level) = &result.levels[0].values else { panic!("no embeddings") };
    let book = level.decoder.split().1.expect("a codebook");
    let words = expected("legaussians/expected/codebook_first_words.npy");
    assert_eq!((book.inputs(), book.outputs()), (8, 512));
    assert!((0..512).all(|k| book.weights(k)[0] == words[k] && book.weights(k)[1] == words[896 + k]));
}

#[test]
fn langsplat_has_three_levels_from_any_of_its_folders() {
    for path in ["langsplat/output", "langsplat/output/made_up_2", "langsplat/output/made_up_3/chkpnt30000.pth"] {
        let result = sample(path);
        is_the_scene(&result, 32);
        assert_eq!((result.method, result.levels.len(), result.cameras.len()), (Method::LangSplat, 3, 2));
        for (k, level) in result.levels.iter().enumerate() {
            let wanted = expected(&format!("langsplat/expected/codes_{}.npy", k + 1));
            assert_eq!(bits(&codes(level)), bits(&wanted), "level {k}");
            let other = expected(&format!("langsplat/expected/codes_{}.npy", (k + 1) % 3 + 1));
            assert_ne!(bits(&codes(level)), bits(&other), "the control: a level exchanged");
        }
    }
}

#[test]
fn langsplat_v2_has_the_largest_weights_and_its_codebook() {
    let result = sample("langsplat_v2/output");
    is_the_scene(&result, 32);
    assert_eq!((result.method, result.levels.len()), (Method::LangSplatV2, 3));
    for (k, level) in result.levels.iter().enumerate() {
        let wanted = expected(&format!("langsplat_v2/expected/weights_{}.npy", k + 1));
        let found = codes(level);
        assert!(found.iter().zip(&wanted).all(|(a, b)| (a - b).abs() < 1e-6), "level {k}");
        let LevelValues::Embedded(level) = &level.values else { panic!("no embeddings") };
        let book = expected(&format!("langsplat_v2/expected/codebook_{}.npy", k + 1));
        let layer = level.decoder.split().1.expect("a codebook");
        let same = |turned: bool| {
            let at = |word: usize, d: usize| if turned { d * 6 + word } else { word * 512 + d };
            (0..512).all(|d| (0..6).all(|w| layer.weights(d)[w].to_bits() == book[at(w, d)].to_bits()))
        };
        assert!(same(false) && !same(true), "a codebook, and the control: a transposed one");
    }
    let three = ResultOptions { top_k: 3, ..ResultOptions::default() };
    let three = open_result(&samples().join("langsplat_v2/output"), &three).expect("opens");
    assert_ne!(codes(&three.levels[0]), codes(&result.levels[0]), "the control: another number of weights");
}

#[test]
fn occams_levels_have_their_own_gaussians() {
    let result = sample("occams_lgs");
    assert_eq!((result.method, result.levels.len()), (Method::OccamsLgs, 3));
    let xyz = expected("scene/xyz.npy");
    for (k, level) in result.levels.iter().enumerate() {
        let rows = array(&format!("occams_lgs/expected/rows_{}.npy", k + 1)).integers().expect("rows");
        assert_eq!(level.cloud.len(), rows.len());
        for (own, row) in level.cloud.positions.iter().zip(&rows) {
            assert_eq!(bits(own), bits(&xyz[*row as usize * 3..][..3]));
        }
        let first = expected(&format!("occams_lgs/expected/features_first_rows_{}.npy", k + 1));
        let halves: Vec<f32> = first.iter().map(|v| half::f16::from_f32(*v).to_f32()).collect();
        assert_eq!(bits(&codes(level)[..first.len()]), bits(&halves), "kept in half the memory");
    }
}

#[test]
fn dr_splat_has_the_vectors_of_its_index() {
    let result = sample("dr_splat");
    is_the_scene(&result, 32);
    let (found, wanted) = (codes(&result.levels[0]), expected("dr_splat/expected/vectors.npy"));
    assert_eq!(found.len(), wanted.len());
    assert!(found.iter().zip(&wanted).all(|(a, b)| (a - b).abs() < 1e-6));
    assert!(found[5 * 24..6 * 24].iter().all(|v| *v == 0.0), "a Gaussian without a vector");
}

#[test]
fn thgs_has_its_superpoints() {
    let result = sample("thgs");
    assert_eq!((result.method, result.levels.len()), (Method::Thgs, 3));
    assert_eq!(result.cloud.render_mode, crate::scene::SplatRenderMode::Surfels);
    for (k, level) in result.levels.iter().enumerate() {
        let LevelValues::Clusters(clusters) = &level.values else { panic!("no clusters") };
        let of: Vec<i64> = clusters.of.iter().map(|c| c.map_or(-1, i64::from)).collect();
        assert_eq!(Some(of), array(&format!("thgs/expected/labels_{}.npy", k + 1)).integers());
    }
}

#[test]
fn laga_has_clusters_with_several_embeddings() {
    let folder = "laga/point_cloud/iteration_30000";
    let (descriptors, splat) =
        (format!("{folder}/multi_lvl_cluster_features.pth"), format!("{folder}/scene_point_cloud.ply"));
    for path in ["laga", &descriptors, &splat] {
        let result = sample(path);
        is_the_scene(&result, 32);
        assert_eq!((result.method, result.method.encoder()), (Method::Laga, Some(OPEN_CLIP)), "{path}");
        let names: Vec<&str> = result.levels.iter().map(|level| level.name.as_str()).collect();
        assert_eq!(names, ["small", "medium", "large"]);
        for (k, level) in result.levels.iter().enumerate() {
            let of = |name: &str, k: usize| format!("laga/expected/{name}_{}.npy", k + 1);
            let LevelValues::Clusters(clusters) = &level.values else { panic!("no clusters") };
            let numbers: Vec<i64> = clusters.of.iter().map(|c| i64::from(c.expect("a cluster"))).collect();
            assert_eq!(Some(numbers), array(&of("clusters", k)).integers());
            let several = clusters.several.as_ref().expect("several embeddings");
            assert_eq!((several.each, clusters.count()), (2, [4, 4, 2][k]));
            assert_eq!(bits(&several.weights), bits(&expected(&of("weights", k))));
            let first = [clusters.features.row(0), clusters.features.row(1)].concat();
            assert_eq!(bits(&first), bits(&expected(&of("features_first_rows", k))));
            let other = expected(&of("features_first_rows", (k + 1) % 3));
            assert_ne!(bits(&first), bits(&other), "the control: a level exchanged");
        }
    }
}

#[test]
fn semantic_gaussians_has_features_of_those_that_are_shown() {
    let shown = expected("semantic_gaussians/expected/seen.npy");
    let first = expected("semantic_gaussians/expected/features_first_rows.npy");
    for path in ["semantic_gaussians", "semantic_gaussians/fusion", "semantic_gaussians/fusion/0.pt"] {
        let result = sample(path);
        is_the_scene(&result, 32);
        assert_eq!((result.method, result.method.encoder()), (Method::SemanticGaussians, Some(CLIP_B32)), "{path}");
        assert_eq!(result.cameras.len(), 2);
        let codes = codes(&result.levels[0]);
        let rows: Vec<&[f32]> = codes.chunks_exact(512).collect();
        let is_there = |row: &&[f32]| row.iter().any(|v| *v != 0.0);
        assert!(rows.iter().zip(&shown).all(|(row, shown)| is_there(row) == (*shown != 0.0)));
        let there: Vec<f32> = rows.into_iter().filter(is_there).take(2).flatten().copied().collect();
        assert_eq!(bits(&there), bits(&first));
    }
    assert!(shown.contains(&0.0) && shown.contains(&1.0));
}

#[test]
fn lifted_embeddings_are_read() {
    let ludvig = sample("ludvig");
    let file = std::fs::read(samples().join("ludvig/features.npy")).expect("the sample");
    let own = codes(&ludvig.levels[0]);
    // The array is the end of its file.
    let stored = file[file.len() - 4 * own.len()..].chunks_exact(4);
    let stored: Vec<f32> = stored.map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    assert!(ludvig.method == Method::Ludvig && bits(&own) == bits(&stored));
    let distilled = sample("splat_distiller");
    assert_eq!((distilled.method, distilled.cloud.len()), (Method::SplatDistiller, 16));
    let first = expected("splat_distiller/expected/features_first_rows.npy");
    let halves: Vec<f32> = first.iter().map(|v| half::f16::from_f32(*v).to_f32()).collect();
    assert_eq!(bits(&codes(&distilled.levels[0])[..first.len()]), bits(&halves));
}

/// The reason for which a result is refused.
pub(super) fn refused(path: &Path) -> String {
    open_result(path, &ResultOptions::default()).expect_err("refused").to_string()
}

#[test]
fn what_cannot_be_opened_exactly_is_refused_with_the_reason() {
    for (path, says) in [
        ("3dgs/chkpnt30000.pth", "without language features"),
        ("3dgs", "without language features"),
        ("2dgs", "files of no method"),
        ("splatfacto/made_up/splatfacto/2026-01-02_030405/nerfstudio_models/step-000029999.ckpt", "nerfstudio"),
        ("nowhere", "cannot read"),
    ] {
        let e = refused(&samples().join(path));
        assert!(e.contains(says) && e.contains(path.rsplit('/').next().expect("a name")), "{path}: {e}");
    }
}

/// Copies a folder.
pub(crate) fn copied(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("created");
    for entry in std::fs::read_dir(from).expect("listed") {
        let entry = entry.expect("an entry");
        match entry.path().is_dir() {
            true => copied(&entry.path(), &to.join(entry.file_name())),
            false => drop(std::fs::copy(entry.path(), to.join(entry.file_name())).expect("copied")),
        }
    }
}
