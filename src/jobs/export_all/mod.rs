//! Exports a whole scene to files: the Gaussians of every object and part, and their masks in photos.
//!
//! Tests read exported masks back and compare them pixel by pixel.

mod folder;
mod labels;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use self::folder::ExportFolder;
use self::labels::LabelWriter;
use super::{JobError, export, export_splat};
use crate::io::splat_format::SplatFormat;
use crate::pipeline::observer::{Observer, Severity, Ticker};
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::{RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud, SemanticMap};

/// Format of masks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum)]
pub enum MaskFormat {
    /// Polygons, a file for each photo
    Isat,
    /// Run lengths, one file
    Coco,
    /// 16-bit pictures of numbers, with a list of what they mean
    Ids,
}

impl MaskFormat {
    pub(crate) const ALL: [Self; 3] = [Self::Isat, Self::Coco, Self::Ids];
}

/// Request to export a scene.
#[derive(Clone, Debug)]
pub struct ExportAllRequest {
    pub(crate) cloud: Arc<GaussianCloud>,
    pub(crate) map: Arc<SemanticMap>,
    pub(crate) settings: RenderSettings,
    /// Photos whose masks are written, by name.
    pub(crate) views: Vec<(String, Camera)>,
    /// Format of the files with Gaussians.
    pub(crate) format: SplatFormat,
    pub(crate) masks: Vec<MaskFormat>,
    pub(crate) folder: PathBuf,
}

/// Result of an export.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ExportedAll {
    pub(crate) folder: PathBuf,
    /// Number of objects and parts.
    pub(crate) written: usize,
    /// Number of objects and parts without Gaussians.
    pub(crate) left_out: usize,
    /// Number of photos with masks.
    pub(crate) photos: usize,
}

/// Exports a scene.
///
/// # Errors
/// If the folder holds anything but an unchanged earlier export, something cannot be drawn or written, or the observer
/// asks to stop: files written by then stay and are recorded as an export's.
pub(crate) fn run(request: &ExportAllRequest, observer: &mut dyn Observer) -> Result<ExportedAll, JobError> {
    if request.map.identities.is_empty() {
        return Err(JobError::NoObjects(request.folder.clone()));
    }
    different_files(&request.views)?;
    let mut folder = ExportFolder::open(&request.folder)?;
    let done = write(request, &mut folder, observer);
    folder.close(done.is_ok())?;
    done
}

fn write(
    request: &ExportAllRequest,
    folder: &mut ExportFolder,
    observer: &mut dyn Observer,
) -> Result<ExportedAll, JobError> {
    let ExportAllRequest { cloud, map, settings, views, format, masks, .. } = request;
    if let Some(shift) = format.shift(&format.prepared(cloud)) {
        observer.note(Severity::Info, export_splat::shift_line(shift.to_array()));
    }
    let all = &map.identities;
    let mut done = ExportedAll { folder: request.folder.clone(), ..ExportedAll::default() };
    let mut ticker = Ticker::new("Writing Gaussians", all.len());
    for (k, (id, _)) in all.iter().enumerate() {
        ticker.tick(k, observer)?;
        let members = map.members(id);
        if members.is_empty() {
            done.left_out += 1;
            continue;
        }
        let place = format!("gaussians/{}", export::identity_file(all, id, format.ending()));
        folder.write(&place, |path| format.write(path, &cloud.select(&members), &mut |_| Ok(())))?;
        done.written += 1;
    }
    ticker.tick(all.len(), observer)?;
    let views = if masks.is_empty() { &[] } else { views.as_slice() };
    let (mut renderer, mut labels) = (Renderer::new(), LabelWriter::new(all, masks)?);
    let mut ticker = Ticker::new("Writing masks", views.len());
    for (k, (name, camera)) in views.iter().enumerate() {
        ticker.tick(k, observer)?;
        let view = ViewMap::render(&mut renderer, cloud, &map.identity_of, all, camera, settings)?;
        labels.view(name, camera, &view, folder)?;
        done.photos += 1;
    }
    ticker.tick(views.len(), observer)?;
    labels.finish(folder)?;
    Ok(done)
}

/// Refuses two photos with the same stem, which would share the files of their masks.
fn different_files(views: &[(String, Camera)]) -> Result<(), JobError> {
    let mut known = BTreeMap::new();
    for (name, _) in views {
        // Some file systems do not distinguish letter cases.
        if let Some(other) = known.insert(labels::stem(name).to_lowercase(), name) {
            let text = format!("'{other}' and '{name}' would share the files of their masks: choose photos by --views");
            return Err(JobError::Output(text));
        }
    }
    Ok(())
}
