//! Recognition of a result by names of files, a splat's header and the shapes in a checkpoint; no values are read.

use std::path::{Path, PathBuf};

use super::face::Method;
use super::folder::{self, ResultOptions};
use super::open::{self, ResultPlace, SplatFeatures};
use super::{
    feature_3dgs, gags, grouping, langsplat, legaussians, lifted, open_gaussian, saga, semantic_gaussians, thgs,
};
use crate::io::{files, gs_output, trained, transforms};

/// Result of another method that was recognized.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SniffedResult {
    /// Method that made it.
    pub method: Method,
    /// File that opens as its Gaussians.
    pub gaussians: PathBuf,
}

/// Recognizes a result; `None` if it is none, or broken.
pub fn sniff(path: &Path) -> Option<SniffedResult> {
    if !may_be_result(path) {
        return None;
    }
    let (method, gaussians) = match open::place(path).ok()?? {
        ResultPlace::Thgs(file) => (Method::Thgs, thgs::splat_of(&file)?),
        ResultPlace::Saga(file) => (Method::Saga, saga::splat_of(&file)?),
        ResultPlace::Laga(file) => (Method::Laga, saga::splat_of(&file)?),
        ResultPlace::Splat(splat, features) => {
            let method = match features {
                SplatFeatures::Grouping if grouping::has_classes(&splat) => Method::GaussianGrouping,
                SplatFeatures::Grouping => Method::OmniSeg3d,
                SplatFeatures::OpenGaussian => Method::OpenGaussian,
                SplatFeatures::Feature3dgs if gags::is_result(&splat, &ResultOptions::default()) => Method::Gags,
                SplatFeatures::Feature3dgs => Method::Feature3dgs,
                SplatFeatures::LeGaussians => Method::LeGaussians,
            };
            (method, splat)
        }
        ResultPlace::Levels(runs) => {
            let first = &runs.levels.first()?.checkpoint;
            let splat = folder::latest(files::folder_of(first), SPLAT);
            (langsplat::method_of(first).ok()?, splat.unwrap_or_else(|| first.clone()))
        }
        ResultPlace::Ludvig(file) => (Method::Ludvig, lifted::gaussians_of(&file)),
        ResultPlace::Distilled(file) => (Method::SplatDistiller, lifted::splat_of(&file)?),
        ResultPlace::Fused(file) => (semantic_gaussians::method_of(&file).ok()?, semantic_gaussians::splat_of(&file)?),
    };
    Some(SniffedResult { method, gaussians })
}

/// File of plain Gaussians.
const SPLAT: &str = "point_cloud.ply";

/// Returns whether a property of a splat is one of a method's features.
pub fn is_feature(property: &str) -> bool {
    let starts = [grouping::PREFIX, open_gaussian::PREFIX, feature_3dgs::PREFIX, legaussians::PREFIX];
    property == legaussians::UNCERTAINTY || starts.iter().any(|start| property.starts_with(start))
}

/// Returns whether a path may belong to a result: it is no scene of this program, and no photos.
fn may_be_result(path: &Path) -> bool {
    if path.is_dir() {
        return !trained::is_scene(path) && !path.join(transforms::USUAL).is_file();
    }
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().to_lowercase());
    let has_kind = [".ply", ".pth", ".pt"].iter().any(|ending| name.ends_with(ending));
    let is_known =
        has_kind || name == lifted::FEATURES || name == open_gaussian::CLUSTERS || gs_output::is_settings(&name);
    is_known && path.is_file() && !trained::is_scene(files::folder_of(path))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io;
    use crate::io::results::tests::samples;

    #[test]
    fn every_result_is_recognized_and_its_gaussians_open() {
        for (path, method) in [
            ("gaussian_grouping", Method::GaussianGrouping),
            ("gaussian_grouping/point_cloud/iteration_30000/point_cloud.ply", Method::GaussianGrouping),
            ("opengaussian", Method::OpenGaussian),
            ("opengaussian/cluster_lang.npz", Method::OpenGaussian),
            ("thgs", Method::Thgs),
            ("thgs/sai_nag.pt", Method::Thgs),
            ("saga", Method::Saga),
            ("feature_3dgs/lseg", Method::Feature3dgs),
            ("legaussians/output", Method::LeGaussians),
            ("langsplat/output", Method::LangSplat),
            ("langsplat/output/made_up_2/chkpnt30000.pth", Method::LangSplat),
            ("langsplat_v2/output/made_up_0_1", Method::LangSplatV2),
            ("occams_lgs", Method::OccamsLgs),
            ("dr_splat", Method::DrSplat),
            ("ludvig/features.npy", Method::Ludvig),
            ("splat_distiller", Method::SplatDistiller),
            ("splat_distiller/ckpts/ckpt_29999_rank0_features.pt", Method::SplatDistiller),
            ("gags", Method::Gags),
            ("gags/decoder_chkpnt30000.pth", Method::Gags),
            ("laga", Method::Laga),
            ("laga/point_cloud/iteration_30000/multi_lvl_seg_scores.pth", Method::Laga),
            ("semantic_gaussians", Method::SemanticGaussians),
            ("semantic_gaussians/fusion", Method::SemanticGaussians),
            ("semantic_gaussians/fusion/0.pt", Method::SemanticGaussians),
        ] {
            let found = sniff(&samples().join(path)).expect(path);
            assert_eq!(found.method, method, "{path}");
            assert!(matches!(io::open(&found.gaussians), Ok(io::Opened::Cloud(cloud)) if !cloud.is_empty()), "{path}");
        }
    }

    #[test]
    fn plain_trainings_and_scenes_of_this_program_are_none() {
        for plain in ["mip_splatting", "gsplat", "splatfacto", "scene", "scene/xyz.npy", "nowhere"] {
            assert_eq!(sniff(&samples().join(plain)), None, "{plain}");
        }
        let folder = tempfile::tempdir().expect("folder");
        let splat = samples().join("gaussian_grouping/point_cloud/iteration_30000/point_cloud.ply");
        std::fs::copy(splat, folder.path().join(SPLAT)).expect("copied");
        let here = || sniff(folder.path()).map(|found| found.method);
        assert_eq!(here(), Some(Method::OmniSeg3d), "features without a classifier");
        std::fs::write(folder.path().join(trained::SCENE_FILE), "{}").expect("written");
        assert_eq!(here(), None, "a scene of this program");
        assert!(is_feature("obj_dc_3") && is_feature("semantic_511") && !is_feature("fmlgs_invented"));
    }
}
