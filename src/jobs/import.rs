//! Import: Gaussians that another program trained, with what another method found in them, as a scene of this program.

use std::path::PathBuf;
use std::sync::Arc;

use serde::Serialize;

use super::{JobError, Scene, derived, open};
use crate::io::results::{self, Method, MethodKind, ResultOptions};
use crate::io::splat_format::SplatFormat;
use crate::pipeline::observer::{Observer, Severity, begin};
use crate::pipeline::semantics::lifting::edit::{self, Edit};
use crate::pipeline::semantics::query::foreign::identities::{USUAL_SCALE, semantic_map};
use crate::scene::{GaussianCloud, Level, NO_IDENTITY, SemanticMap};

/// A request to import a result or a plain training.
#[derive(Clone, Debug)]
pub(crate) struct ImportRequest {
    /// Its folder, or one of its files.
    pub(crate) path: PathBuf,
    /// Folder of the new scene.
    pub(crate) out: PathBuf,
    /// Scale of SAGA's objects, from 0 (details) to 1 (the largest things).
    pub(crate) scale: Option<f32>,
    pub(crate) options: ResultOptions,
}

impl ImportRequest {
    /// Import of an open result; `scale` counts for SAGA's objects.
    pub(crate) fn of_scene(scene: &Scene, out: PathBuf, scale: f32) -> Self {
        let scale = (scene.method == Some(Method::Saga)).then_some(scale);
        Self { path: scene.path.clone(), out, scale, options: ResultOptions::default() }
    }
}

/// An imported scene.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct ImportedScene {
    pub(crate) scene: PathBuf,
    /// Method that made the result; `None` for a plain training.
    pub(crate) method: Option<&'static str>,
    pub(crate) gaussians: usize,
    pub(crate) objects: usize,
    pub(crate) parts: usize,
    pub(crate) cameras: usize,
    /// Photos that the scene refers to.
    pub(crate) photos: Option<PathBuf>,
    /// Things of the result that the scene lacks, in words.
    pub(crate) left_out: Option<String>,
}

/// Gaussians and objects of a result.
struct Kept {
    cloud: Arc<GaussianCloud>,
    map: Option<SemanticMap>,
    left_out: Option<String>,
}

/// Writes a result as a scene into a new folder.
///
/// # Errors
/// If it cannot be read, the place is taken, or the observer asks to stop; nothing is written then.
pub(crate) fn run(request: &ImportRequest, observer: &mut dyn Observer) -> Result<ImportedScene, JobError> {
    let ImportRequest { path, out, .. } = request;
    if SplatFormat::of(out).is_some() {
        let text = "a scene is a folder; 'fmlgs export' writes files of splats";
        return Err(JobError::Output(format!("{}: {text}", out.display())));
    }
    derived::check(out)?;
    begin("Reading Gaussians", observer)?;
    let scene = open::scene(path)?;
    if scene.folder.is_some() {
        let text = "is a scene of this program already; there is nothing to import";
        return Err(JobError::Output(format!("{} {text}", path.display())));
    }
    if request.scale.is_some() && scene.method != Some(Method::Saga) {
        return Err(JobError::Output("--scale has no effect here: only SAGA's objects have a scale".into()));
    }
    let kept = match scene.method {
        Some(method) => of_method(&scene, method, request, observer)?,
        None => Kept { cloud: Arc::clone(&scene.cloud), map: None, left_out: None },
    };
    scene.warnings.iter().for_each(|warning| observer.note(Severity::Warning, warning.clone()));
    begin("Writing the scene", observer)?;
    derived::store(&scene, (scene.name.clone(), false), &kept.cloud, kept.map.as_ref(), out)?;
    let stored = open::scene(out)?;
    let of = |level| kept.map.as_ref().map_or(0, |m| m.identities.iter().filter(|(_, i)| i.level == level).count());
    Ok(ImportedScene {
        scene: out.clone(),
        method: scene.method.map(Method::name),
        gaussians: kept.cloud.len(),
        objects: of(Level::Object),
        parts: of(Level::Part),
        cameras: stored.cameras.len(),
        photos: stored.dataset_path,
        left_out: kept.left_out,
    })
}

/// Reads what a method has, but for embeddings, which scenes do not have.
fn of_method(
    scene: &Scene,
    method: Method,
    request: &ImportRequest,
    observer: &mut dyn Observer,
) -> Result<Kept, JobError> {
    let path = &request.path;
    if method.kind() == MethodKind::Embeddings {
        let mut cloud = (*scene.cloud).clone();
        cloud.extras.retain(|extra| !results::is_feature(&extra.name));
        let stay = format!("its embeddings stay in {}", path.display());
        let left = match method.encoder() {
            Some(_) => format!("{stay}; they answer phrases there: fmlgs query {} PHRASE", path.display()),
            None => stay,
        };
        return Ok(Kept { cloud: Arc::new(cloud), map: None, left_out: Some(left) });
    }
    let result = match &scene.result {
        Some(result) if request.options == ResultOptions::default() => Arc::clone(result),
        _ => Arc::new(results::open_result(path, &request.options)?),
    };
    begin("Finding its objects", observer)?;
    let mut map = semantic_map(&result, request.scale.unwrap_or(USUAL_SCALE))?;
    if method == Method::Saga {
        for (name, gaussians) in results::saved_selections(&result)?.into_iter().filter(|(_, g)| !g.is_empty()) {
            map = edit::apply(&map, &result.cloud, &Edit::AddPiece { of: NO_IDENTITY, name, gaussians })?;
        }
    }
    let found = !map.identities.is_empty();
    let nothing = match method.kind() {
        MethodKind::Affinities => "no objects stand out among its features at this scale",
        _ => "no Gaussian is in a class or cluster",
    };
    let left_out = if found { None } else { Some(nothing.to_owned()) };
    Ok(Kept { cloud: Arc::clone(&result.cloud), map: found.then_some(map), left_out })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::results::tests::{copied, expected, samples};
    use crate::pipeline::observer::Silent;
    use crate::pipeline::observer::testing::StopsAfter;

    fn import(sample: &str, out: &std::path::Path, scale: Option<f32>) -> Result<ImportedScene, JobError> {
        let request = ImportRequest {
            path: samples().join(sample),
            out: out.to_owned(),
            scale,
            options: ResultOptions::default(),
        };
        run_silently(&request)
    }

    fn run_silently(request: &ImportRequest) -> Result<ImportedScene, JobError> {
        run(request, &mut Silent)
    }

    #[test]
    fn classes_and_clusters_become_objects_of_a_stored_scene() {
        let folder = tempfile::tempdir().expect("folder");
        for (sample, name) in [("gaussian_grouping", true), ("opengaussian", false), ("thgs", false), ("laga", false)] {
            let out = folder.path().join(sample);
            let done = import(sample, &out, None).expect(sample);
            assert_eq!((done.gaussians, done.cameras, done.left_out), (32, 2, None), "{sample}");
            let scene = open::scene(&out).expect("opens");
            assert_eq!((scene.method, scene.folder.as_ref()), (None, Some(&out)), "a scene like any other");
            assert!(scene.cloud.extras.iter().all(|e| !results::is_feature(&e.name)), "{sample}");
            let map = scene.semantics().expect("its objects");
            assert_eq!(map.identities.len(), done.objects + done.parts, "{sample}");
            assert!(done.objects > 1, "{sample}");
            let named = map.identities.iter().all(|(_, i)| i.names.iter().any(|n| n.starts_with("class ")));
            assert_eq!(named, name, "{sample}: classes have their numbers as names");
            let xyz = expected("scene/xyz.npy");
            assert_eq!(scene.cloud.positions.as_flattened(), xyz, "{sample}: the Gaussians are the same");
            assert_eq!(map.language.is_some(), sample != "gaussian_grouping");
        }
        assert!(
            matches!(import("thgs", &folder.path().join("thgs"), None), Err(JobError::Io(_))),
            "never onto a scene"
        );
    }

    #[test]
    fn embeddings_are_not_kept_and_the_report_says_so() {
        let folder = tempfile::tempdir().expect("folder");
        for sample in ["langsplat/output", "legaussians/output", "occams_lgs", "gags", "semantic_gaussians"] {
            let out = folder.path().join(sample.replace('/', "-"));
            let done = import(sample, &out, None).expect(sample);
            assert_eq!((done.gaussians, done.objects), (32, 0), "{sample}");
            assert!(done.left_out.is_some_and(|text| text.contains("fmlgs query")), "{sample}");
            let scene = open::scene(&out).expect("opens");
            assert!(scene.cloud.extras.is_empty() && scene.known_semantics().expect("none").is_none());
        }
    }

    #[test]
    fn photos_that_the_run_names_come_along() {
        let folder = tempfile::tempdir().expect("folder");
        let (run, photos) = (folder.path().join("run"), folder.path().join("data/made_up"));
        copied(&samples().join("gaussian_grouping"), &run);
        std::fs::create_dir_all(&photos).expect("made");
        let colors = image::RgbImage::from_fn(24, 18, |x, y| image::Rgb([10 * x as u8, 10 * y as u8, 90]));
        colors.save(photos.join("view_0.png")).expect("written");
        let pose = [[1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, -1.0, -3.2], [0.0, 0.0, 0.0, 1.0]];
        let frame = serde_json::json!({ "file_path": "view_0.png", "transform_matrix": pose });
        let list = serde_json::json!({ "fl_x": 20.0, "cx": 12.0, "cy": 9.0, "w": 24, "h": 18, "frames": [frame] });
        std::fs::write(photos.join("transforms.json"), list.to_string()).expect("written");
        let out = folder.path().join("scene");
        let request = ImportRequest { path: run, out: out.clone(), scale: None, options: ResultOptions::default() };
        let done = run_silently(&request).expect("imported");
        let found = done.photos.expect("its photos").canonicalize().expect("there");
        assert_eq!(found, photos.canonicalize().expect("there"));
        let scene = open::scene(&out).expect("opens");
        let names: Vec<&str> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["view_0.png"], "the photos' own cameras");
    }

    #[test]
    fn what_makes_no_sense_is_refused_and_writes_nothing() {
        let folder = tempfile::tempdir().expect("folder");
        let out = folder.path().join("out");
        assert!(matches!(import("gaussian_grouping", &out, Some(0.5)), Err(JobError::Output(e)) if e.contains("SAGA")));
        assert!(import("gaussian_grouping", &folder.path().join("a.ply"), None).is_err(), "no folder");
        assert!(import("scene", &out, None).is_err(), "no Gaussians");
        let scene = folder.path().join("scene");
        import("gaussian_grouping", &scene, None).expect("imported");
        let again = ImportRequest { path: scene, out: out.clone(), scale: None, options: ResultOptions::default() };
        assert!(matches!(run(&again, &mut Silent), Err(JobError::Output(e)) if e.contains("already")));
        let request = ImportRequest { path: samples().join("thgs"), ..again };
        assert!(run(&request, &mut StopsAfter::new(0)).expect_err("stopped").is_cancelled());
        assert!(!out.exists(), "nothing was written");
    }

    #[test]
    fn sagas_objects_have_a_scale_and_its_saved_selections_their_names() {
        let folder = tempfile::tempdir().expect("folder");
        let out = folder.path().join("scene");
        let done = import("saga", &out, Some(0.2)).expect("imported");
        assert_eq!((done.method, done.gaussians, done.left_out), (Some("SAGA"), 32, None));
        let map = open::scene(&out).expect("opens").semantics().expect("objects");
        let kettle = map.identities.iter().find(|(_, i)| i.names.iter().any(|n| n == "kettle"));
        let members = map.members(kettle.expect("the selection's name").0);
        assert_eq!(members.len(), 8);
        let grouping = folder.path().join("grouping");
        import("gaussian_grouping", &grouping, None).expect("imported");
        let map = open::scene(&grouping).expect("opens").semantics().expect("objects");
        assert!(map.identities.iter().all(|(_, i)| i.names.iter().all(|n| n != "kettle")), "the control");
    }
}
