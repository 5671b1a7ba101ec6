//! Layout of the scenes of each data set, and errors for folders with another layout.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::PaperTable;
use crate::io::labels::ref_lerf::{self, ReferredPhoto};
use crate::jobs::JobError;

/// A scene of a data set.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SceneInput {
    pub(super) name: String,
    pub(super) photos: PathBuf,
    pub(super) labels: PathBuf,
    /// Sentences of Ref-LERF, by the name of the photo without ending; else empty.
    pub(super) referred: BTreeMap<String, ReferredPhoto>,
}

/// Folder of the labels of all scenes, if they do not lie beside the photos.
const LABELS: &str = "label";

/// Describes the layout of a data set, for errors.
fn expected(table: PaperTable) -> &'static str {
    match table {
        PaperTable::LerfOvs => {
            "lerf_ovs has DATA/SCENE/images, DATA/SCENE/sparse/0 and DATA/label/SCENE/frame_00001.json"
        }
        PaperTable::SpinNerf => "SPIn-NeRF has DATA/SCENE/poses_bounds.npy and DATA/SCENE/images_4/label/*.png",
        PaperTable::Ovs3d => {
            "3D-OVS has DATA/SCENE/poses_bounds.npy, DATA/SCENE/images and DATA/SCENE/segmentations/classes.txt"
        }
        PaperTable::PartAblation => {
            "scenes with parts have posed photos in DATA/SCENE, and labels that name wholes and parts in \
             DATA/label/SCENE (ISAT with 'parent') or in DATA/SCENE (id maps of 'fmlgs synth')"
        }
        PaperTable::RefLerf => {
            "Ref-LERF has DATA/SCENE/images, DATA/SCENE/sparse/0, DATA/SCENE/json/test_json/frame_00006.json and \
             DATA/SCENE/mask"
        }
    }
}

/// Returns the scenes below `data`, sorted; only those named in `wanted`, if any are.
pub(super) fn find(table: PaperTable, data: &Path, wanted: &[String]) -> Result<Vec<SceneInput>, JobError> {
    let wrong = |path: &Path, what: &str| {
        JobError::Protocol(format!("{}: {what}. {}; give the folder DATA", path.display(), expected(table)))
    };
    if !data.is_dir() {
        return Err(wrong(data, "no such folder"));
    }
    let label_root = data.join(LABELS);
    let with_labels = |name: &String| match table {
        PaperTable::LerfOvs => label_root.join(name).is_dir(),
        PaperTable::SpinNerf => has_spin_labels(&data.join(name)),
        PaperTable::Ovs3d => data.join(name).join("segmentations").is_dir(),
        PaperTable::PartAblation => label_root.join(name).is_dir() || data.join(name).join("identities.json").is_file(),
        PaperTable::RefLerf => ref_lerf::has_lists(&data.join(name)),
    };
    if table == PaperTable::LerfOvs && !label_root.is_dir() {
        return Err(wrong(&label_root, "no such folder"));
    }
    let mut names = folders(data);
    names.extend(folders(&label_root));
    names.sort();
    names.dedup();
    names.retain(|n| n != LABELS && with_labels(n));
    if names.is_empty() {
        return Err(wrong(data, "it holds no scene with labels"));
    }
    if let Some(missing) = wanted.iter().find(|w| !names.contains(w)) {
        return Err(wrong(&data.join(missing), &format!("no scene with labels; there are {}", names.join(", "))));
    }
    names.retain(|n| wanted.is_empty() || wanted.contains(n));
    let input = |name: String| {
        let (photos, apart) = (data.join(&name), label_root.join(&name));
        if !photos.is_dir() {
            return Err(wrong(&photos, "no such folder, but labels for it are there"));
        }
        let poses = photos.join("poses_bounds.npy");
        if matches!(table, PaperTable::SpinNerf | PaperTable::Ovs3d) && !poses.is_file() {
            return Err(wrong(&poses, "no such file"));
        }
        let classes = photos.join("segmentations/classes.txt");
        if table == PaperTable::Ovs3d && !classes.is_file() {
            return Err(wrong(&classes, "no such file"));
        }
        let is_referred = table == PaperTable::RefLerf;
        let referred = if is_referred { ref_lerf::photos(&photos)? } else { BTreeMap::new() };
        if is_referred && !referred.values().any(|photo| photo.is_test) {
            return Err(wrong(&photos, "it has no sentences of a test photo"));
        }
        let labels = if apart.is_dir() && !is_referred { apart } else { photos.clone() };
        Ok(SceneInput { name, photos, labels, referred })
    };
    names.into_iter().map(input).collect()
}

fn has_spin_labels(scene: &Path) -> bool {
    folders(scene).iter().any(|f| f.starts_with("images") && scene.join(f).join("label").is_dir())
}

/// Returns the names of the folders in a folder; none if it does not exist.
fn folders(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries.filter(|e| e.path().is_dir()).filter_map(|e| e.file_name().into_string().ok()).collect()
}
