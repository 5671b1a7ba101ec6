//! Features of a result's Gaussians as NumPy arrays: codes as the method stores them, and embeddings.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::{JobError, Scene, ask_result, export};
use crate::io::results::{LevelValues, MethodKind, ResultOptions};
use crate::pipeline::observer::{Observer, begin};
use crate::pipeline::semantics::query::foreign::features;
use crate::scene::GaussianCloud;

/// A request for the features of a level.
#[derive(Clone, Debug, Default)]
pub(crate) struct FeaturesRequest {
    /// Level by name or number; the first without it.
    pub(crate) level: Option<String>,
    /// File for the codes.
    pub(crate) codes: Option<PathBuf>,
    /// File for the embeddings.
    pub(crate) embeddings: Option<PathBuf>,
    /// File for the Gaussians that the features belong to.
    pub(crate) gaussians: Option<PathBuf>,
    pub(crate) options: ResultOptions,
}

/// Description of a level's features.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct FeatureFacts {
    pub(crate) method: &'static str,
    pub(crate) encoder: Option<&'static str>,
    /// Names of all levels.
    pub(crate) levels: Vec<String>,
    pub(crate) level: String,
    /// Kind of the values: embeddings, classes, clusters or affinities.
    pub(crate) kind: &'static str,
    /// Number of Gaussians that have features.
    pub(crate) gaussians: usize,
    /// True if the level's Gaussians are others than those of the opened result.
    pub(crate) own_gaussians: bool,
    /// Numbers of a code; `None` if a Gaussian has the number of its cluster instead.
    pub(crate) code_numbers: Option<usize>,
    /// Numbers of an embedding; `None` if the method knows no language.
    pub(crate) embedding_numbers: Option<usize>,
}

/// Refuses files that cannot be written, before anything is read.
///
/// # Errors
/// If a file has another ending, or is read by this job.
pub(crate) fn check(request: &FeaturesRequest, reads: &[&Path]) -> Result<(), JobError> {
    let FeaturesRequest { codes, embeddings, gaussians, .. } = request;
    codes.iter().chain(embeddings).try_for_each(|file| export::check(file, &[".npy"], reads))?;
    gaussians.iter().try_for_each(|file| export::check(file, &[".ply"], reads))
}

/// Writes the features of a level of the result that a scene was read from.
///
/// # Errors
/// If the scene is no result, has no such level or no embeddings, or a file cannot be written.
pub(crate) fn run(
    scene: &Scene,
    request: &FeaturesRequest,
    observer: &mut dyn Observer,
) -> Result<FeatureFacts, JobError> {
    let FeaturesRequest { level, codes, embeddings, gaussians, options } = request;
    if scene.method.is_none() {
        let path = scene.path.display();
        let text = "is no result of another method, and its Gaussians have no features of one ('fmlgs info' says more)";
        return Err(JobError::Output(format!("{path} {text}")));
    }
    check(request, &scene.reads())?;
    begin("Reading features", observer)?;
    let result = ask_result::read(scene, options)?;
    let number = level.as_deref().map_or(Ok(0), |wanted| ask_result::level_of(&result, wanted))?;
    let none = || JobError::Output(format!("{} has no levels", scene.path.display()));
    let level = result.levels.get(number).ok_or_else(none)?;
    let (values, count) = (&level.values, level.cloud.len());
    if embeddings.is_some() && values.embedding_dim().is_none() {
        let method = result.method.name();
        let text = format!("{method} knows no language, so its Gaussians have no embeddings; ask for its codes");
        return Err(JobError::Output(text));
    }
    if let Some(file) = codes {
        begin("Writing codes", observer)?;
        write_codes(file, values)?;
    }
    if let (Some(file), Some(dim)) = (embeddings, values.embedding_dim()) {
        begin("Writing embeddings", observer)?;
        export::make_parent(file)?;
        export::npy_blocks(file, &[count, dim], |rows| features::embeddings(values, rows))?;
    }
    if let Some(file) = gaussians {
        begin("Writing Gaussians", observer)?;
        export::ply(file, &level.cloud)?;
    }
    Ok(FeatureFacts {
        method: result.method.name(),
        encoder: result.method.encoder(),
        levels: result.levels.iter().map(|level| level.name.clone()).collect(),
        level: level.name.clone(),
        kind: match result.method.kind() {
            MethodKind::Classes => "classes",
            MethodKind::Clusters => "clusters",
            MethodKind::Affinities => "affinities",
            MethodKind::Embeddings => "embeddings",
        },
        gaussians: count,
        own_gaussians: !are_same(&level.cloud, &scene.cloud),
        code_numbers: values.code_dim(),
        embedding_numbers: values.embedding_dim(),
    })
}

/// Returns whether these are the same Gaussians in the same order, by their centers.
fn are_same(a: &GaussianCloud, b: &GaussianCloud) -> bool {
    a.origin == b.origin && a.positions == b.positions
}

/// Writes codes as `[Gaussians, numbers]`, or numbers of clusters as `[Gaussians]`, with -1 for none.
fn write_codes(file: &Path, values: &LevelValues) -> Result<(), JobError> {
    export::make_parent(file)?;
    match values {
        LevelValues::Clusters(clusters) => {
            let number = |c: &Option<u32>| c.map_or(-1, i64::from);
            export::npy_blocks(file, &[values.len()], |rows| clusters.of[rows].iter().map(number).collect())?;
        }
        _ => {
            let shape = [values.len(), values.code_dim().unwrap_or(0)];
            export::npy_blocks(file, &shape, |rows| features::codes(values, rows))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::results::tests::{expected, samples};
    use crate::jobs::open;
    use crate::pipeline::observer::Silent;

    fn numbers(file: &Path) -> (Vec<u64>, Vec<f32>) {
        let bytes = std::fs::read(file).expect("written");
        let array = npyz::NpyFile::new(&bytes[..]).expect("npy");
        let shape = array.shape().to_vec();
        let values = match array.dtype().num_bytes() {
            Some(8) => array.into_vec::<i64>().expect("numbers").into_iter().map(|v| v as f32).collect(),
            _ => array.into_vec::<f32>().expect("numbers"),
        };
        (shape, values)
    }

    fn write(sample: &str, request: &FeaturesRequest) -> Result<FeatureFacts, JobError> {
        run(&open::scene(&samples().join(sample)).expect(sample), request, &mut Silent)
    }

    #[test]
    fn a_level_is_written_with_its_gaussians() {
        let folder = tempfile::tempdir().expect("folder");
        let at = |name: &str| Some(folder.path().join("made").join(name));
        let request = FeaturesRequest {
            level: Some("medium".into()),
            codes: at("codes.npy"),
            embeddings: at("embeddings.npy"),
            gaussians: at("level.ply"),
            options: ResultOptions::default(),
        };
        let facts = write("occams_lgs", &request).expect("written");
        let rows = expected("occams_lgs/expected/rows_2.npy");
        assert_eq!((facts.level.as_str(), facts.gaussians, facts.own_gaussians), ("medium", rows.len(), true));
        let (shape, codes) = numbers(&request.codes.expect("given"));
        assert_eq!(shape, [rows.len() as u64, 512]);
        let apart = |name: &str| {
            let wanted = expected(&format!("occams_lgs/expected/features_first_rows_{name}.npy"));
            codes.iter().zip(&wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
        };
        assert!(apart("2") < 1e-3 && apart("1") > 1e-2, "the level, and the control: another one");
        assert_eq!(numbers(&request.embeddings.expect("given")).0, [rows.len() as u64, 512]);
        let gaussians = open::scene(&request.gaussians.expect("given")).expect("opens");
        let xyz = expected("scene/xyz.npy");
        let own = |k: usize| &xyz[rows[k] as usize * 3..][..3];
        assert!((0..rows.len()).all(|k| gaussians.cloud.positions[k] == own(k)));
    }

    #[test]
    fn clusters_are_numbers_and_the_first_level_is_the_usual_one() {
        let folder = tempfile::tempdir().expect("folder");
        let codes = folder.path().join("codes.npy");
        for (level, wanted) in [(None, "labels_1"), (Some("3".to_owned()), "labels_3")] {
            let request = FeaturesRequest { level, codes: Some(codes.clone()), ..FeaturesRequest::default() };
            let facts = write("thgs", &request).expect("written");
            assert_eq!((facts.kind, facts.code_numbers, facts.own_gaussians), ("clusters", None, false));
            assert_eq!(numbers(&codes), (vec![32], expected(&format!("thgs/expected/{wanted}.npy"))));
        }
    }

    #[test]
    fn what_has_no_features_is_refused_and_writes_nothing() {
        let folder = tempfile::tempdir().expect("folder");
        let file = folder.path().join("a.npy");
        let embeddings = FeaturesRequest { embeddings: Some(file.clone()), ..FeaturesRequest::default() };
        for (sample, says) in [("gaussian_grouping", "ask for its codes"), ("mip_splatting", "no result")] {
            let refused = write(sample, &embeddings).expect_err(sample).to_string();
            assert!(refused.contains(says), "{refused}");
        }
        let no_level = FeaturesRequest { level: Some("4".into()), codes: Some(file.clone()), ..Default::default() };
        assert!(write("thgs", &no_level).expect_err("three levels").to_string().contains("1 to 3"));
        let ending = FeaturesRequest { codes: Some(folder.path().join("a.png")), ..Default::default() };
        assert!(write("thgs", &ending).expect_err("no array").to_string().contains(".npy"));
        let all = write("thgs", &FeaturesRequest::default()).expect("described");
        assert_eq!((all.levels.len(), all.embedding_numbers), (3, Some(512)));
        assert!(!file.exists());
    }
}
