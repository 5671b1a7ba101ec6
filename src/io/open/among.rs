//! Check of an output folder: files among those of a data set would be taken for its own.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use super::is_data_set;

/// Starts of names of photo folders.
const PHOTO_FOLDERS: [&str; 8] = ["images", "input", "photos", "rgb", "frames", "train", "test", "val"];
/// Most levels from a folder of photos up to its data set.
const ABOVE: usize = 3;

/// Returns the data set that is `folder`, or has it among its photos. Other folders in a data set are free to use.
pub(crate) fn data_set_around(folder: &Path) -> Option<PathBuf> {
    let folder = folder.canonicalize().or_else(|_| std::path::absolute(folder)).ok()?;
    let mut below: Option<&OsStr> = None;
    for above in folder.ancestors().take(1 + ABOVE) {
        if is_data_set(above) {
            return below.is_none_or(is_of_photos).then(|| above.to_path_buf());
        }
        below = above.file_name();
    }
    None
}

/// Returns whether a folder has a name for photos: `images`, `images_4`.
fn is_of_photos(name: &OsStr) -> bool {
    let name = name.to_string_lossy().to_lowercase();
    let mut rests = PHOTO_FOLDERS.iter().filter_map(|start| name.strip_prefix(start));
    rests.any(|rest| rest.is_empty() || rest.starts_with(['_', '-']))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_data_set_is_around_its_photos_and_no_more() {
        let place = tempfile::tempdir().expect("folder");
        let root = place.path().canonicalize().expect("there");
        let (list, colmap) = (root.join("list"), root.join("colmap-set"));
        fs::create_dir_all(list.join("images")).expect("made");
        fs::create_dir_all(colmap.join("sparse/0")).expect("made");
        fs::write(list.join("transforms.json"), "{}").expect("written");
        for name in ["cameras.txt", "images.txt"] {
            fs::write(colmap.join("sparse/0").join(name), "").expect("written");
        }
        for set in [&list, &colmap] {
            for among in ["", "images", "images/new", "images/new/deep", "images_4", "Input", "train-rgb"] {
                assert_eq!(data_set_around(&set.join(among)).as_ref(), Some(set), "{among}");
            }
            for beside in ["compare", "results/images2", "imagesque", "images/far/far/too/deep"] {
                assert_eq!(data_set_around(&set.join(beside)), None, "{beside}");
            }
        }
        assert_eq!(data_set_around(&root), None, "what holds data sets is none");
        // A trained scene may lie in its photos' folder; its own files are protected elsewhere.
        fs::write(list.join("scene.json"), "{}").expect("written");
        assert_eq!(data_set_around(&list), None);
    }
}
