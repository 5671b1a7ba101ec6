//! Recently opened scenes, for the start page of the window: their names, training runs and small pictures.

use std::path::{Path, PathBuf};

use super::runs::{self, RunSummary};
use super::{Folders, JobError, export};
use crate::io::{IoError, files, trained};
use crate::math::resize::{Filter, resize};
use crate::scene::{PhotoPixels, text};

/// Longer side of a kept picture, px.
const SIDE_PX: f64 = 320.0;

/// Keeps a small copy of a picture of the scene at `of`.
///
/// # Errors
/// If it cannot be written.
pub(crate) fn keep(folders: &Folders, of: &Path, pixels: &PhotoPixels) -> Result<(), JobError> {
    let size = [pixels.width_px, pixels.height_px].map(f64::from);
    let scale = (SIDE_PX / size[0].max(size[1])).min(1.0);
    let [w, h] = size.map(|s| (s * scale).round().max(1.0) as usize);
    let from = (pixels.width_px as usize, pixels.height_px as usize);
    let rgb: Vec<[f32; 3]> = pixels.rgb.iter().map(|p| p.map(f32::from)).collect();
    let small = resize(&rgb, from, (w, h), Filter::Area);
    let rgb = small.into_iter().map(|p| p.map(|v| v.round().clamp(0.0, 255.0) as u8)).collect();
    let path = folders.picture(of);
    export::make_parent(&path)?;
    Ok(export::picture(
        &path,
        &PhotoPixels { width_px: w as u32, height_px: h as u32, rgb, coverage: None, alpha: None },
    )?)
}

/// Loads the kept pictures of these scenes. Unreadable ones are left out: they are drawn anew when the scene is opened.
pub(crate) fn load(folders: &Folders, of: Vec<PathBuf>) -> Vec<(PathBuf, PhotoPixels)> {
    let read = |path: &Path| -> Result<PhotoPixels, IoError> {
        let file = folders.picture(path);
        let bytes = files::read(&file, 1 << 20)?;
        let picture = image::load_from_memory_with_format(&bytes, image::ImageFormat::Png)
            .map_err(|e| IoError::Picture { path: file, reason: e.to_string() })?;
        let rgb = picture.to_rgb8();
        let (width_px, height_px) = rgb.dimensions();
        Ok(PhotoPixels { width_px, height_px, rgb: rgb.pixels().map(|p| p.0).collect(), coverage: None, alpha: None })
    };
    of.into_iter().filter_map(|path| Some((read(&path).ok()?, path))).map(|(pixels, path)| (path, pixels)).collect()
}

/// A recently opened scene or data set.
#[derive(Clone, Debug, PartialEq)]
pub struct RecentScene {
    /// Its path.
    pub path: PathBuf,
    /// Its own name.
    pub name: String,
    /// Training runs of the photos, and what was made of them.
    pub runs: Vec<RunSummary>,
}

impl RecentScene {
    /// Reads what is known of the scene at `path`; of one that is not there, its file's name.
    pub(crate) fn of(folders: &Folders, path: PathBuf) -> Self {
        let is_file = path.is_file();
        // Photos may have been opened by the file that lists them.
        let root = if is_file { files::folder_of(&path) } else { &path };
        let own = runs::list(folders, &path);
        let runs = if own.is_empty() && is_file { runs::list(folders, root) } else { own };
        let name = match trained::load_info(&path) {
            Ok(info) => info.name_in(&path),
            Err(_) if is_file && runs.is_empty() => {
                path.file_stem().map(|stem| text::name(&stem.to_string_lossy())).unwrap_or_default()
            }
            Err(_) => folders.name_of_photos(root),
        };
        Self { path, name, runs }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kept_picture_comes_back_small_and_of_its_scene_alone() {
        let folder = tempfile::tempdir().expect("folder");
        let folders = Folders { data: folder.path().into() };
        let rgb = (0..800 * 400).map(|i| if i % 800 < 400 { [200, 10, 10] } else { [10, 10, 200] }).collect();
        let pixels = PhotoPixels { width_px: 800, height_px: 400, rgb, coverage: None, alpha: None };
        keep(&folders, Path::new("/one/fox"), &pixels).expect("kept");
        let found = load(&folders, vec!["/two/fox".into(), "/one/fox".into()]);
        assert_eq!(found.len(), 1, "nothing is known of the other fox");
        let (path, small) = &found[0];
        assert_eq!((path.as_path(), small.width_px, small.height_px), (Path::new("/one/fox"), 320, 160));
        assert_eq!((small.rgb[0], small.rgb[319]), ([200, 10, 10], [10, 10, 200]), "left is left");
        std::fs::write(folders.picture(path), "no picture").expect("broken");
        assert!(load(&folders, vec![path.clone()]).is_empty());
    }
}
