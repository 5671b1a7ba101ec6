//! Small pictures of recently opened scenes, for the start page of the window.

use std::path::{Path, PathBuf};

use super::{Folders, JobError, export};
use crate::io::{IoError, files, semantic_map, trained};
use crate::math::format;
use crate::math::resize::{Filter, resize};
use crate::scene::PhotoPixels;

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

/// Summary of a training run, for lists.
#[derive(Clone, Debug, PartialEq)]
pub struct RunSummary {
    /// Its folder.
    pub folder: PathBuf,
    /// Number of finished steps.
    pub steps: u64,
    /// Number of objects and parts stored with it.
    pub objects: usize,
    psnr: Option<f64>,
}

impl RunSummary {
    /// Returns text such as "run-1: 600 steps, 26.6 dB, 13 objects and parts".
    pub(crate) fn text(&self) -> String {
        let name = self.folder.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let quality = self.psnr.map_or_else(String::new, |psnr| format!(", {psnr:.1} dB"));
        let objects = match self.objects {
            0 => "no objects".to_owned(),
            1 => "1 object".to_owned(),
            n => format!("{n} objects and parts"),
        };
        format!("{name}: {}{quality}, {objects}", format::things(self.steps as usize, "step"))
    }
}

/// Returns the training runs of the photos at `path`, oldest first. Unreadable ones are left out.
pub(crate) fn runs(folders: &Folders, path: &Path) -> Vec<RunSummary> {
    let summary = |folder: PathBuf| {
        let info = trained::load_info(&folder).ok()?;
        let last = info.history.evaluations.last();
        let steps = info.history.steps.last().map(|s| s.step).or(last.map(|e| e.step)).unwrap_or(0);
        let psnr = last.map(|e| e.psnr).filter(|psnr| psnr.is_finite());
        Some(RunSummary { objects: semantic_map::count(&folder), folder, steps, psnr })
    };
    folders.trainings(path).into_iter().filter_map(summary).collect()
}

/// Returns the training runs of these photos, for photos with several.
pub(crate) fn several(folders: &Folders, of: Vec<PathBuf>) -> Vec<(PathBuf, Vec<RunSummary>)> {
    // Photos may have been opened by the file that lists them.
    let root = |path: &Path| if path.is_file() { files::folder_of(path).to_path_buf() } else { path.to_path_buf() };
    let all = of.into_iter().map(|path| (runs(folders, &root(&path)), path)).map(|(runs, path)| (path, runs));
    all.filter(|(_, runs)| runs.len() > 1).collect()
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
