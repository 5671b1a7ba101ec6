//! Places of files in the folders that other methods write.

use std::path::{Path, PathBuf};

use crate::io::{IoError, files};

/// Folder of the Gaussians of all iterations.
const CLOUDS: &str = "point_cloud";
/// Start of the names of the iterations' folders.
const ITERATION: &str = "iteration_";

/// Files of a result that are not found by themselves, and choices that are stored nowhere.
#[derive(Clone, Debug, PartialEq)]
pub struct ResultOptions {
    /// The classifier, decoder, codebook or index that belongs to the result; `None` = the one beside it.
    pub decoder: Option<PathBuf>,
    /// Entries of the codebook for each Gaussian of LangSplatV2, as it was trained.
    pub top_k: usize,
    /// Text encoder that the result was trained with, by its name in the list of models; `None` = its method's.
    pub encoder: Option<String>,
}

impl Default for ResultOptions {
    fn default() -> Self {
        Self { decoder: None, top_k: 4, encoder: None }
    }
}

/// Finds the file of that name of the latest iteration in a folder of a run, or in the folder itself.
pub(super) fn latest(folder: &Path, file: &str) -> Option<PathBuf> {
    if folder.join(file).is_file() {
        return Some(folder.join(file));
    }
    let clouds = if is_called(folder, CLOUDS) { folder.to_owned() } else { folder.join(CLOUDS) };
    let names = files::names_in(&clouds).ok()?;
    let iteration = |name: &String| name.strip_prefix(ITERATION)?.parse::<u64>().ok();
    let there = |name: &String| clouds.join(name).join(file).is_file();
    let latest = names.iter().filter(|n| there(n)).filter_map(|n| Some((iteration(n)?, n))).max()?;
    Some(clouds.join(latest.1).join(file))
}

/// The folder of the run that wrote a file: the one above `point_cloud/iteration_<n>`, or the file's own.
pub(super) fn run_of(file: &Path) -> PathBuf {
    let folder = std::path::absolute(files::folder_of(file)).unwrap_or_else(|_| files::folder_of(file).into());
    let clouds = folder.parent().filter(|p| is_called(&folder, ITERATION) && is_called(p, CLOUDS));
    clouds.and_then(Path::parent).map_or_else(|| folder.clone(), Path::to_owned)
}

fn is_called(path: &Path, start: &str) -> bool {
    path.file_name().is_some_and(|n| n.to_string_lossy().starts_with(start))
}

/// Names in these folders that `is` accepts, with the number that it reads in them; the highest counts.
pub(super) fn highest(folders: &[&Path], number: impl Fn(&str) -> Option<u64>) -> Option<PathBuf> {
    let all = folders.iter().filter_map(|f| Some((f, files::names_in(f).ok()?)));
    let known =
        all.flat_map(|(f, names)| names.into_iter().filter_map(|n| Some((number(&n)?, f.join(n)))).collect::<Vec<_>>());
    known.filter(|(_, path)| path.is_file()).max().map(|(_, path)| path)
}

/// The number between two parts of a name.
pub(super) fn number_in(name: &str, before: &str, after: &str) -> Option<u64> {
    name.strip_prefix(before)?.strip_suffix(after)?.parse().ok()
}

/// The file that an option names, or the one found beside the result.
///
/// # Errors
/// If there is none; `what` says what it is and where it is looked for.
pub(super) fn helper(
    named: Option<&Path>,
    found: Option<PathBuf>,
    result: &Path,
    what: &str,
) -> Result<PathBuf, IoError> {
    let named = named.map(Path::to_owned);
    named.or(found).ok_or_else(|| IoError::Unsupported {
        path: result.into(),
        what: format!("{what}, which was not found"),
        remedy: "name the file with --decoder",
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_latest_iteration_and_the_run_around_it_are_found() {
        let run = tempfile::tempdir().expect("folder");
        for n in ["iteration_900", "iteration_7000", "iteration_30000", "other"] {
            let folder = run.path().join(CLOUDS).join(n);
            std::fs::create_dir_all(&folder).expect("create");
            std::fs::write(folder.join(if n == "iteration_30000" { "scene.ply" } else { "a.ply" }), "x")
                .expect("write");
        }
        let found = latest(run.path(), "a.ply").expect("found");
        assert!(found.ends_with("iteration_7000/a.ply"), "{found:?}");
        assert_eq!(run_of(&found), std::path::absolute(run.path()).expect("a path"));
        assert_eq!(latest(files::folder_of(&found), "a.ply"), Some(found.clone()));
        assert_eq!((latest(run.path(), "b.ply"), run_of(&run.path().join("x.ply"))), (None, run.path().to_owned()));
        for n in ["chkpnt7000.pth", "chkpnt30000.pth", "chkpnt.pth"] {
            std::fs::write(run.path().join(n), "x").expect("write");
        }
        let last = highest(&[run.path()], |n| number_in(n, "chkpnt", ".pth")).expect("found");
        assert!(last.ends_with("chkpnt30000.pth"), "{last:?}");
        assert!(helper(None, None, &found, "the classifier").is_err());
    }
}
