//! Masks that come with a dataset: which pixels of a photo show which object or part.
//!
//! [`Labels::open`] sniffs, as `io::open` does:
//!
//! | folder | what |
//! |---|---|
//! | `identities.json`, `object_ids/`, `part_ids/` | id maps of `fmlgs synth` ([`synth_ids`]) |
//! | `*.json` with `objects` of polygons | ISAT, as in lerf_ovs ([`isat`]); also a single such file |
//!
//! Masks are drawn on the photos as stored; they are undistorted and scaled like them.

pub mod isat;
pub mod synth_ids;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::resample::{Pixels, resample};
use super::{IoError, files};
use crate::scene::{Level, Mask, Photo};

/// A labelled region of one photo.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// What it is called; empty = not named.
    pub name: String,
    /// Object or part, where the file says.
    pub level: Option<Level>,
    /// Index of the region that it is a piece of.
    pub parent: Option<usize>,
    /// Its pixels.
    pub mask: Mask,
}

/// Labels of some of a dataset's photos.
pub enum Labels {
    /// Id maps of `fmlgs synth`.
    SynthIds(synth_ids::SynthIds),
    /// Files of polygons, by the stem of the photo that they belong to.
    Isat(BTreeMap<String, PathBuf>),
}

impl Labels {
    /// Finds out what is at `path`.
    ///
    /// # Errors
    /// If there are no labels of a known kind, or the list of identities does not parse.
    pub fn open(path: &Path) -> Result<Self, IoError> {
        if path.join(synth_ids::LIST_FILE).is_file() {
            return Ok(Self::SynthIds(synth_ids::SynthIds::open(path)?));
        }
        let json = |p: &Path| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
        let mut found = BTreeMap::new();
        let candidates: Vec<PathBuf> = match std::fs::read_dir(path) {
            Ok(entries) => entries.flatten().map(|e| e.path()).filter(|p| json(p)).collect(),
            Err(_) if json(path) => vec![path.into()],
            Err(cause) => return Err(IoError::Read { path: path.into(), cause }),
        };
        for file in candidates {
            if let Some(photo) = isat::photo_of(&file)? {
                found.insert(stem(&photo), file);
            }
        }
        if found.is_empty() {
            return Err(IoError::NoLabels { path: path.into() });
        }
        Ok(Self::Isat(found))
    }

    /// Whether a photo has labels.
    pub fn has(&self, photo: &Photo) -> bool {
        match self {
            Self::SynthIds(ids) => ids.has(&stem(&photo.name)),
            Self::Isat(files) => files.contains_key(&stem(&photo.name)),
        }
    }

    /// The regions of a photo, undistorted and scaled to at most `max_side_px`; regions without a
    /// pixel are left out, and pieces of them then have no parent. Empty if it has no labels.
    ///
    /// # Errors
    /// If its file is broken or of another size than the photo.
    pub fn of(&self, photo: &Photo, max_side_px: u32) -> Result<Vec<Region>, IoError> {
        let regions = match self {
            Self::SynthIds(ids) => ids.regions(&stem(&photo.name))?,
            Self::Isat(files) => match files.get(&stem(&photo.name)) {
                Some(file) => isat::read(file)?,
                None => Vec::new(),
            },
        };
        let mut place = Vec::with_capacity(regions.len());
        let mut kept: Vec<Region> = Vec::new();
        for region in regions {
            let mask = as_photo(&region.mask, photo, max_side_px)?;
            let parent = region.parent.and_then(|p| place.get(p).copied().flatten());
            place.push((!mask.is_empty()).then_some(kept.len()));
            if !mask.is_empty() {
                kept.push(Region { mask, parent, ..region });
            }
        }
        Ok(kept)
    }
}

/// File name without folder and extension.
fn stem(name: &str) -> String {
    let file = name.rsplit(['/', '\\']).next().unwrap_or(name);
    file.rsplit_once('.').map_or(file, |(stem, _)| stem).to_owned()
}

/// A mask of a photo as stored, as the photo is loaded.
fn as_photo(mask: &Mask, photo: &Photo, max_side_px: u32) -> Result<Mask, IoError> {
    let (camera, size) = (&photo.camera, (mask.width_px(), mask.height_px()));
    let found = (size.0 as u32, size.1 as u32);
    let target = camera.limited_to(max_side_px);
    let (w, h) = (target.width_px as usize, target.height_px as usize);
    if found != (camera.width_px, camera.height_px) {
        let expected = (camera.width_px, camera.height_px);
        return Err(IoError::PhotoSize { path: photo.path.clone(), found, expected });
    }
    if photo.distortion.is_none() {
        return Ok(mask.resized(w, h));
    }
    let grey = |i| if mask.contains(i) { [u8::MAX; 3] } else { [0; 3] };
    let data = (0..size.0 * size.1).flat_map(grey).collect();
    let picture = Pixels { width: size.0, height: size.1, channels: 3, data };
    let straight = resample(&picture, camera, photo.distortion.as_ref(), &target);
    Ok(Mask::from_fn(w, h, |i| straight.rgb[i][0] > 127))
}

/// A picture file's id per pixel: 8- or 16-bit grey.
fn read_ids(path: &Path) -> Result<(usize, usize, Vec<u16>), IoError> {
    let bytes = files::read(path, files::MAX_PICTURE_BYTES)?;
    let ids = super::photo::decode_grey16(&bytes, path)?;
    Ok((ids.width() as usize, ids.height() as usize, ids.into_raw()))
}

#[cfg(test)]
mod tests;
