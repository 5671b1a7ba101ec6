//! Masks that come with a dataset: which pixels of a photo show which object or part.
//!
//! [`Labels::open`] sniffs, as `io::open` does:
//!
//! | folder | what |
//! |---|---|
//! | `identities.json`, `object_ids/`, `part_ids/` | id maps of `fmlgs synth` ([`synth_ids`]) |
//! | `images_<factor>/label/*.png` | SPIn-NeRF ([`spin_nerf`]) |
//! | `segmentations/classes.txt` | 3D-OVS ([`three_d_ovs`]) |
//! | `test_mask/<view>/*.png` | LERF-Mask ([`lerf_mask`]) |
//! | `*.json` with `objects` of polygons | ISAT, as in lerf_ovs ([`isat`]); also a single such file |
//! | `*.json` with `masklet` | a video's masklets, as in SA-V ([`masklets`]); also a single such file |
//!
//! Masks are drawn on the photos as stored, or on a larger or smaller copy of them; they are
//! undistorted and scaled like the photos.

pub(crate) mod isat;
pub(crate) mod lerf_mask;
pub(crate) mod masklets;
pub(crate) mod pictures;
mod polygons;
pub(crate) mod rle;
pub(crate) mod spin_nerf;
pub(crate) mod synth_ids;
pub(crate) mod three_d_ovs;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::resample::centers;
use super::{IoError, files, memory, photo_list};
use crate::scene::{Camera, Level, Mask, Photo, text};

/// How many times longer than the photo's the sides of a mask may be.
const MOST_LARGER: f64 = 8.0;

/// Most masks of one photo: what finds objects compares each with each.
const MOST_MASKS: usize = 4096;
/// Most memory that the masks of one photo take, bytes: a thousand of eight million pixels.
const MOST_BYTES: u64 = 1 << 30;

/// A labeled region of one photo.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// What it is called; empty = not named.
    pub(crate) name: String,
    /// Object or part, where the file says.
    pub level: Option<Level>,
    /// Index of the region that it is a piece of.
    pub(crate) parent: Option<usize>,
    /// Its pixels.
    pub mask: Mask,
}

/// Labels of some of a dataset's photos.
pub enum Labels {
    /// Id maps of `fmlgs synth`.
    SynthIds(synth_ids::SynthIds),
    /// Files of polygons, by the stem of the photo that they belong to.
    Isat(BTreeMap<String, PathBuf>),
    /// A picture per mask: SPIn-NeRF, 3D-OVS, LERF-Mask.
    Pictures(pictures::Pictures),
    /// Masklets of a video.
    Masklets(masklets::Masklets),
}

impl Labels {
    /// Finds out what is at `path`.
    pub fn open(path: &Path) -> Result<Self, IoError> {
        if path.join(synth_ids::LIST_FILE).is_file() {
            return Ok(Self::SynthIds(synth_ids::SynthIds::open(path)?));
        }
        for find in [spin_nerf::find, three_d_ovs::find, lerf_mask::find] {
            if let Some(pictures) = find(path)? {
                return Ok(Self::Pictures(pictures));
            }
        }
        Self::open_json(path)
    }

    /// Labels in a JSON file, or in those of a folder.
    fn open_json(path: &Path) -> Result<Self, IoError> {
        let json = |p: &Path| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
        let mut candidates: Vec<PathBuf> = match std::fs::read_dir(path) {
            Ok(_) => entries(path).iter().map(|name| path.join(name)).filter(|p| json(p)).collect(),
            Err(_) if json(path) => vec![path.into()],
            Err(cause) => return Err(IoError::Read { path: path.into(), cause }),
        };
        candidates.sort();
        let mut polygons = BTreeMap::new();
        let mut video: Option<(PathBuf, masklets::Masklets)> = None;
        for file in candidates {
            let value: serde_json::Value = files::read_json(&file)?;
            if let Some(photo) = isat::photo_of(&value) {
                polygons.insert(stem(photo), file);
            } else if let Some(found) = masklets::Masklets::parse(value, &file)? {
                if let Some((other, _)) = &video {
                    let reason = format!("{} holds masklets too; name one of the two files", other.display());
                    return Err(IoError::Syntax { path: file, place: "masklet".into(), reason });
                }
                video = Some((file, found));
            }
        }
        match video {
            _ if !polygons.is_empty() => Ok(Self::Isat(polygons)),
            Some((_, masklets)) => Ok(Self::Masklets(masklets)),
            None => Err(IoError::NoLabels { path: path.into() }),
        }
    }

    /// Whether a photo has labels.
    pub fn has(&self, photo: &Photo) -> bool {
        match self {
            Self::SynthIds(ids) => ids.has(&stem(&photo.name)),
            Self::Isat(files) => files.contains_key(&stem(&photo.name)),
            Self::Pictures(pictures) => pictures.has(&stem(&photo.name)),
            Self::Masklets(masklets) => masklets.has(&stem(&photo.name)),
        }
    }

    /// The regions of a photo, undistorted and scaled to at most `max_side_px`; regions without a
    /// pixel are left out, and pieces of them then have no parent. Empty if it has no labels.
    pub fn of(&self, photo: &Photo, max_side_px: u32) -> Result<Vec<Region>, IoError> {
        let name = stem(&photo.name);
        let sheet = Sheet(photo);
        let regions = match self {
            Self::SynthIds(ids) => ids.regions(&name, sheet)?,
            Self::Isat(files) => match files.get(&name) {
                Some(file) => isat::read(file, sheet)?,
                None => Vec::new(),
            },
            Self::Pictures(pictures) => pictures.regions(&name, sheet)?,
            Self::Masklets(masklets) => masklets.regions(&name, sheet)?,
        };
        let mut place = Vec::with_capacity(regions.len());
        let mut kept: Vec<Region> = Vec::new();
        let mut as_loaded = AsLoaded::new(photo, max_side_px);
        for region in regions {
            let mask = as_loaded.mask(&region.mask);
            let parent = region.parent.and_then(|p| place.get(p).copied().flatten());
            place.push((!mask.is_empty()).then_some(kept.len()));
            if !mask.is_empty() {
                kept.push(Region { name: text::name(&region.name), mask, parent, ..region });
            }
        }
        Ok(kept)
    }
}

/// What masks are drawn on: a photo as stored, or a larger or smaller copy of it.
#[derive(Clone, Copy)]
pub(crate) struct Sheet<'a>(&'a Photo);

impl Sheet<'_> {
    /// Whether `masks` masks of `size_px` (width, height), which `path` holds, are of the photo's
    /// shape and fit into memory. To be asked before they are made.
    pub(crate) fn check(self, path: &Path, size_px: (u32, u32), masks: usize) -> Result<(), IoError> {
        let (w, h) = size_px;
        if w == 0 || h == 0 || w > Camera::MAX_SIDE_PX || h > Camera::MAX_SIDE_PX {
            return Err(IoError::EmptyPicture { path: path.into(), width_px: w, height_px: h });
        }
        let expected = (self.0.camera.width_px, self.0.camera.height_px);
        let larger = f64::from(w.max(h)) / f64::from(expected.0.max(expected.1));
        if !photo_list::is_scaled(expected, size_px) || larger > MOST_LARGER {
            return Err(IoError::PhotoSize { path: path.into(), found: size_px, expected });
        }
        if masks > MOST_MASKS {
            let reason = format!("{masks} regions of one photo; at most {MOST_MASKS} are taken");
            return Err(IoError::Syntax { path: path.into(), place: "masks".into(), reason });
        }
        let pixels = (u64::from(w) * u64::from(h)).max(u64::from(expected.0) * u64::from(expected.1));
        let (bytes, limit) = (pixels.div_ceil(8).saturating_mul(masks as u64), memory::budget().min(MOST_BYTES));
        if bytes > limit {
            let remedy = "label fewer regions, or smaller photos";
            return Err(IoError::OverBudget { path: path.into(), what: "its masks", bytes, limit, remedy });
        }
        Ok(())
    }
}

/// File name without folder and extension.
pub(crate) fn stem(name: &str) -> String {
    let file = name.rsplit(['/', '\\']).next().unwrap_or(name);
    file.rsplit_once('.').map_or(file, |(stem, _)| stem).to_owned()
}

/// Masks on a photo as stored, or on scaled copies, as the photo is loaded: each pixel takes the value at its center.
struct AsLoaded<'a> {
    photo: &'a Photo,
    size: [usize; 2],
    /// Where the centers lie on a distorted copy, by its size.
    centers: BTreeMap<[usize; 2], Vec<Option<usize>>>,
}

impl<'a> AsLoaded<'a> {
    fn new(photo: &'a Photo, max_side_px: u32) -> Self {
        let camera = photo.camera.limited_to(max_side_px);
        Self { photo, size: [camera.width_px as usize, camera.height_px as usize], centers: BTreeMap::new() }
    }

    fn mask(&mut self, mask: &Mask) -> Mask {
        let [width, height] = self.size;
        let Some(distortion) = self.photo.distortion.as_ref().filter(|_| !mask.is_empty()) else {
            return mask.resized(width, height);
        };
        let drawn = [mask.width_px(), mask.height_px()];
        let camera = || self.photo.camera.resized(drawn[0] as u32, drawn[1] as u32);
        let centers = self.centers.entry(drawn).or_insert_with(|| centers(&camera(), distortion, self.size));
        Mask::from_fn(width, height, |i| centers[i].is_some_and(|at| mask.contains(at)))
    }
}

/// File names in a folder, sorted; none if there is no such folder.
fn entries(folder: &Path) -> Vec<String> {
    files::names_in(folder).unwrap_or_default()
}

/// A picture file's id per pixel: 8- or 16-bit gray, of the photo's shape; `masks` are made of it.
fn read_ids(path: &Path, sheet: Sheet<'_>, masks: usize) -> Result<(usize, usize, Vec<u16>), IoError> {
    sheet.check(path, super::photo::size(path)?, masks)?;
    let bytes = files::read(path, files::MAX_PICTURE_BYTES)?;
    let ids = super::photo::decode_gray16(&bytes, path)?;
    Ok((ids.width() as usize, ids.height() as usize, ids.into_raw()))
}

#[cfg(test)]
mod tests;
