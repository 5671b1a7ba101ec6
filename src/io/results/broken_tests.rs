//! Results whose files are missing, broken, or those of another run.

use std::path::PathBuf;

use super::tests::{codes, copied, refused, sample, samples};
use super::*;
use crate::io::IoError;
use crate::io::torch::written::{Saved, saved};

#[test]
fn files_of_other_runs_and_missing_files_are_named() {
    let folder = tempfile::tempdir().expect("folder");
    let copy = |name: &str| copy_of(name, &folder);
    let langsplat = copy("langsplat");
    std::fs::remove_dir_all(langsplat.join("autoencoder")).expect("removed");
    assert!(refused(&langsplat.join("output")).contains("autoencoder"));
    let named = samples().join("langsplat/autoencoder/ckpt/made_up/best_ckpt.pth");
    let options = ResultOptions { decoder: Some(named), ..ResultOptions::default() };
    assert!(open_result(&langsplat.join("output"), &options).is_ok(), "a decoder that is named");
    // Sixteen Gaussians with the clusters of thirty-two.
    let open_gaussian = copy("opengaussian");
    let small = samples().join("feature_3dgs/lseg/point_cloud/iteration_7000/point_cloud.ply");
    let own = open_gaussian.join("point_cloud/iteration_70000/point_cloud.ply");
    let text = std::fs::read(&own).expect("read");
    std::fs::remove_file(open_gaussian.join("cluster_lang.npz")).expect("removed");
    assert!(refused(&open_gaussian).contains("cluster_lang.npz"));
    assert!(!text.is_empty() && small.is_file());
    let saga = copy("saga");
    std::fs::remove_dir_all(saga.join("point_cloud/iteration_30000")).expect("removed");
    assert!(refused(&saga).contains("scene_point_cloud.ply"));
    let thgs = copy("thgs");
    std::fs::copy(samples().join("ludvig/gaussians.ply"), thgs.join("point_cloud/iteration_30000/point_cloud.ply"))
        .expect("copied");
    assert!(refused(&thgs).contains("not of one run"), "{}", refused(&thgs));
    let grouping = copy("gaussian_grouping");
    std::fs::copy(
        samples().join("saga/point_cloud/iteration_10000/scale_gate.pt"),
        grouping.join("point_cloud/iteration_30000/classifier.pth"),
    )
    .expect("copied");
    assert!(refused(&grouping).contains("'weight'"), "{}", refused(&grouping));
}

/// A copy of a sample.
fn copy_of(name: &str, folder: &tempfile::TempDir) -> PathBuf {
    let to = folder.path().join(name);
    copied(&samples().join(name), &to);
    to
}

#[test]
fn gags_without_its_decoder_or_with_another_is_refused() {
    let folder = tempfile::tempdir().expect("folder");
    let gags = copy_of("gags", &folder);
    let decoder = gags.join("decoder_chkpnt30000.pth");
    std::fs::copy(samples().join("langsplat/autoencoder/ckpt/made_up/best_ckpt.pth"), &decoder).expect("copied");
    assert!(refused(&gags).contains("7 layers"), "{}", refused(&gags));
    std::fs::remove_file(decoder).expect("removed");
    let e = refused(&gags);
    assert!(e.contains("decoder_chkpnt<n>.pth") && e.contains("--decoder"), "{e}");
    let named = ResultOptions { decoder: Some(samples().join("gags/decoder_chkpnt30000.pth")), ..Default::default() };
    assert_eq!(open_result(&gags, &named).expect("a decoder that is named").method, Method::Gags);
}

#[test]
fn laga_names_the_file_that_is_missing_or_does_not_fit() {
    let folder = tempfile::tempdir().expect("folder");
    let laga = copy_of("laga", &folder);
    let own = laga.join("point_cloud/iteration_30000");
    for name in ["multi_lvl_cluster_feature_weights.pth", "multi_lvl_seg_scores.pth"] {
        let whole = std::fs::read(own.join(name)).expect("read");
        std::fs::remove_file(own.join(name)).expect("removed");
        let e = refused(&laga);
        assert!(e.contains(name) && e.contains("inference.ipynb"), "{e}");
        std::fs::copy(own.join("multi_lvl_cluster_features.pth"), own.join(name)).expect("copied");
        assert!(open_result(&laga, &ResultOptions::default()).is_err(), "{name}");
        std::fs::write(own.join(name), whole).expect("written");
    }
    assert!(open_result(&laga, &ResultOptions::default()).is_ok(), "the control");
    // Its clusters gone, the features are like SAGA's.
    std::fs::remove_file(own.join("multi_lvl_cluster_features.pth")).expect("removed");
    assert_eq!(open_result(&laga, &ResultOptions::default()).expect("opens").method, Method::Saga);
    std::fs::remove_file(own.join("scene_point_cloud.ply")).expect("removed");
    assert!(refused(&laga).contains("scene_point_cloud.ply"));
}

/// Features of two Gaussians of 32.
fn fused(dim: usize, shown: &[usize]) -> Vec<u8> {
    let values = (0..2 * dim).map(|k| k as f32 / 8.0).collect();
    let marks = (0..32).map(|i| i64::from(shown.contains(&i))).collect();
    let (feat, mask) = (Saved::Tensor(vec![2, dim], values), Saved::Whole(vec![32], marks));
    saved(&Saved::dict([("feat", feat), ("mask_full", mask)]))
}

#[test]
fn features_of_semantic_gaussians_belong_to_the_marked_ones() {
    let folder = tempfile::tempdir().expect("folder");
    let run = copy_of("semantic_gaussians", &folder);
    let file = run.join("fusion/0.pt");
    let write = |bytes: Vec<u8>| std::fs::write(&file, bytes).expect("written");
    let open = || open_result(&file, &ResultOptions::default());
    write(fused(512, &[3, 30]));
    let (here, rows) = (open().expect("opens"), |r: &MethodResult| codes(&r.levels[0]));
    assert_eq!((rows(&here)[3 * 512 + 1], rows(&here)[30 * 512 + 1]), (0.125, 64.125));
    write(fused(512, &[4, 30]));
    assert_ne!(rows(&open().expect("opens")), rows(&here), "the control: another mask");
    write(fused(512, &[3, 4, 30]));
    let e = refused(&file);
    assert!(e.contains("2 rows") && e.contains("marks 3"), "{e}");
    // OpenSeg's open, but no encoder of this program compares them.
    write(fused(768, &[3, 30]));
    let open_seg = open().expect("opens");
    assert_eq!((open_seg.method, rows(&open_seg).len()), (Method::SemanticGaussiansOpenSeg, 32 * 768));
    assert_eq!(sniff(&file).map(|found| found.method), Some(Method::SemanticGaussiansOpenSeg));
    assert!(open_seg.method.encoder().is_none() && open_seg.method.missing_encoder().is_some());
    let named = ResultOptions { encoder: Some("own-clip".into()), ..ResultOptions::default() };
    assert_eq!(open_result(&file, &named).expect("opens").encoder.as_deref(), Some("own-clip"));
    write(fused(100, &[3, 30]));
    assert!(refused(&file).contains("512 (LSeg) or 768 (OpenSeg)"), "{}", refused(&file));
    // The Gaussians of another run, and none.
    write(fused(512, &[3, 30]));
    let splat = run.join("output/point_cloud/iteration_30000/point_cloud.ply");
    std::fs::copy(samples().join("ludvig/gaussians.ply"), &splat).expect("copied");
    assert!(refused(&file).contains("not of one run"), "{}", refused(&file));
    std::fs::remove_file(&splat).expect("removed");
    let e = refused(&file);
    assert!(e.contains("point_cloud.ply") && e.contains("copy the file"), "{e}");
}

#[test]
fn gaussians_of_fused_features_are_found_where_the_trainings_are() {
    let folder = tempfile::tempdir().expect("folder");
    let from = samples().join("semantic_gaussians");
    copied(&from.join("fusion"), &folder.path().join("fusion/room"));
    copied(&from.join("output"), &folder.path().join("output/hall"));
    assert!(refused(&folder.path().join("fusion/room")).contains("point_cloud.ply"), "those of another scene");
    copied(&from.join("output"), &folder.path().join("output/room"));
    let found = open_result(&folder.path().join("fusion/room"), &ResultOptions::default()).expect("opens");
    assert!(found.path.to_string_lossy().contains("room"), "{}", found.path.display());
    assert_eq!(codes(&found.levels[0]), codes(&sample("semantic_gaussians").levels[0]));
}

#[test]
fn features_of_splat_distiller_need_their_checkpoint() {
    let folder = tempfile::tempdir().expect("folder");
    let run = copy_of("splat_distiller", &folder);
    std::fs::remove_file(run.join("ckpts/ckpt_29999_rank0.pt")).expect("removed");
    let e = refused(&run);
    assert!(e.contains("checkpoint was not found") && e.contains("beside the features"), "{e}");
}

#[test]
fn cut_files_are_errors_wherever_they_end() {
    let folder = tempfile::tempdir().expect("folder");
    for (sample, file) in [
        ("dr_splat", "pq_index.faiss"),
        ("opengaussian", "cluster_lang.npz"),
        ("thgs", "sai_nag.pt"),
        ("langsplat_v2", "output/made_up_0_2/chkpnt10000.pth"),
        ("saga", "point_cloud/iteration_10000/contrastive_feature_point_cloud.ply"),
        ("ludvig", "features.npy"),
        ("splat_distiller", "ckpts/ckpt_29999_rank0_features.pt"),
        ("gags", "decoder_chkpnt30000.pth"),
        ("laga", "point_cloud/iteration_30000/multi_lvl_seg_scores.pth"),
        ("semantic_gaussians", "fusion/0.pt"),
    ] {
        let to = folder.path().join(sample);
        copied(&samples().join(sample), &to);
        let whole = std::fs::read(to.join(file)).expect("read");
        let at = if sample == "langsplat_v2" { to.join("output") } else { to.clone() };
        assert!(open_result(&at, &ResultOptions::default()).is_ok(), "{sample}");
        // The end of the index, lists of vectors, is not needed.
        let needed = if sample == "dr_splat" { whole.len() - 32 } else { whole.len() };
        for k in 0..24 {
            std::fs::write(to.join(file), &whole[..(needed - 1) * k / 23]).expect("written");
            let result = open_result(&at, &ResultOptions::default());
            assert!(result.is_err(), "{sample} cut at {k} of 23");
        }
    }
}

#[test]
fn changed_bytes_of_an_index_are_errors_or_other_numbers() {
    let folder = tempfile::tempdir().expect("folder");
    copied(&samples().join("dr_splat"), folder.path());
    let file = folder.path().join("pq_index.faiss");
    let whole = std::fs::read(&file).expect("read");
    let mut refused = 0;
    for at in 0..200 {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x80;
        std::fs::write(&file, bytes).expect("written");
        refused += usize::from(open_result(folder.path(), &ResultOptions::default()).is_err());
    }
    assert!(refused > 30, "{refused}");
    let missing = IoError::syntax(&file, "index", "x").to_string();
    assert!(missing.contains("pq_index.faiss"));
}
