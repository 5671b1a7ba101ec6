//! Results of other methods as scenes: their Gaussians, with classes and clusters as objects.

use std::path::Path;
use std::sync::Arc;

use super::Scene;
use crate::io::gs_output::{self, GsOutput};
use crate::io::results::{self, Method, MethodKind, MethodResult, ResultOptions};
use crate::io::{self, Opened, files, trainings};
use crate::jobs::JobError;
use crate::scene::{Axes, GaussianCloud};

impl Scene {
    /// Name of the method that made it, if it is a result of another one.
    pub(crate) fn method_name(&self) -> Option<&'static str> {
        self.method.map(Method::name)
    }
}

/// Opens the result of another method; `None` if the path is none. Classes and clusters are read at once; embeddings
/// are not, as they can be larger than the Gaussians.
pub(super) fn scene(path: &Path, axes: Option<Axes>) -> Result<Option<Scene>, JobError> {
    let Some(found) = results::sniff(path) else { return Ok(None) };
    let beside = || {
        let known = gs_output::beside(&found.gaussians);
        known.unwrap_or_else(|| GsOutput::of(files::folder_of(&found.gaussians)))
    };
    let mut problem = None;
    let has_objects = matches!(found.method.kind(), MethodKind::Classes | MethodKind::Clusters);
    if has_objects && axes.is_none() {
        match results::open_result(path, &ResultOptions::default()) {
            Ok(result) => return Ok(Some(with_result(path, result, beside()))),
            Err(e) => problem = Some(e),
        }
    }
    let (Opened::Cloud(cloud), training) = io::open_beside(&found.gaussians, axes)? else { return Ok(None) };
    let mut scene = bare(path, cloud, training.unwrap_or_else(beside));
    scene.method = Some(found.method);
    scene.warnings.retain(|warning| warning != trainings::MORE_VALUES);
    let name = found.method.name();
    scene.warnings.extend(problem.map(|e| format!("what {name} adds to the Gaussians cannot be read: {e}")));
    Ok(Some(scene))
}

/// Makes a scene of Gaussians, called like the folder of the run if nothing says its name.
fn bare(path: &Path, cloud: GaussianCloud, mut beside: GsOutput) -> Scene {
    beside.name = beside.name.take().or_else(|| path.is_dir().then(|| files::data_set_name(path)));
    Scene::bare(path, cloud, Some(beside))
}

/// Makes a scene that shares the Gaussians with a result.
fn with_result(path: &Path, mut result: MethodResult, beside: GsOutput) -> Scene {
    result.levels.iter_mut().for_each(|level| level.cloud = Arc::default());
    let cloud: GaussianCloud = Arc::unwrap_or_clone(std::mem::take(&mut result.cloud));
    let mut scene = bare(path, cloud, beside);
    result.cloud = Arc::clone(&scene.cloud);
    result.levels.iter_mut().for_each(|level| level.cloud = Arc::clone(&scene.cloud));
    scene.method = Some(result.method);
    scene.result = Some(Arc::new(result));
    scene
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::results::tests::samples;
    use crate::jobs::open;

    #[test]
    fn classes_and_clusters_are_objects_at_once_and_embeddings_are_not() {
        for (path, method, objects) in [
            ("gaussian_grouping", Method::GaussianGrouping, true),
            ("gaussian_grouping/point_cloud/iteration_30000/point_cloud.ply", Method::GaussianGrouping, true),
            ("opengaussian", Method::OpenGaussian, true),
            ("thgs", Method::Thgs, true),
            ("langsplat/output", Method::LangSplat, false),
            ("saga", Method::Saga, false),
            ("laga", Method::Laga, true),
            ("gags", Method::Gags, false),
            ("semantic_gaussians/fusion", Method::SemanticGaussians, false),
        ] {
            let scene = open::scene(&samples().join(path)).expect(path);
            assert_eq!((scene.method, scene.cloud.len(), scene.cameras.len()), (Some(method), 32, 2), "{path}");
            assert_eq!(scene.folder, None, "nothing is stored yet");
            let map = scene.known_semantics().expect(path);
            assert_eq!(map.is_some_and(|map| !map.identities.is_empty()), objects, "{path}");
            let shared = scene.result.as_ref().is_none_or(|r| Arc::ptr_eq(&r.cloud, &scene.cloud));
            assert!(shared, "the Gaussians are in memory once");
        }
        let plain = open::scene(&samples().join("mip_splatting")).expect("a plain training");
        assert_eq!((plain.method, plain.result.is_some()), (None, false), "the control");
    }

    #[test]
    fn a_result_without_its_helpers_opens_as_gaussians_and_says_why() {
        let folder = tempfile::tempdir().expect("folder");
        let splat = samples().join("opengaussian/point_cloud/iteration_70000/point_cloud.ply");
        std::fs::copy(splat, folder.path().join("point_cloud.ply")).expect("copied");
        let scene = open::scene(folder.path()).expect("its Gaussians");
        assert_eq!((scene.cloud.len(), scene.result.is_some()), (32, false));
        assert!(scene.warnings.iter().any(|w| w.contains("cluster_lang.npz")), "{:?}", scene.warnings);
        assert!(matches!(scene.semantics(), Err(JobError::NotGrouped { .. })));
    }
}
