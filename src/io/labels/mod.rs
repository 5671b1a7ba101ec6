//! Masks of objects and parts in a dataset's photos.
//!
//! [`Labels::open`] recognizes the layout, as `io::open` does:
//!
//! | folder | what |
//! |---|---|
//! | `identities.json`, `object_ids/`, `part_ids/` | id maps of `fmlgs synth` ([`synth_ids`]) |
//! | `images_<factor>/label/*.png` | SPIn-NeRF ([`spin_nerf`]) |
//! | `segmentations/classes.txt` | 3D-OVS ([`three_d_ovs`]) |
//! | `test_mask/<view>/*.png` | LERF-Mask ([`lerf_mask`]) |
//! | `json/`, `mask/`, `gt_mask/` | Ref-LERF ([`ref_lerf`]) |
//! | `<photo>_s.npy`, `<photo>_f.npy`, or a folder `language_features` with them | LangSplat ([`language_features`]) |
//! | files ([`files`](label_files)), also a single one, and in folders below | ISAT, as in lerf_ovs ([`isat`]); LabelMe; COCO; YOLO's segments; masklets of a video, as in SA-V ([`masklets`]) |
//!
//! Masks are drawn on the photos as stored, or on a larger or smaller copy of them; they are
//! undistorted and scaled like the photos. Labels belong to one photo each.

mod belongs;
mod coco;
pub(crate) mod isat;
#[path = "files.rs"]
pub(crate) mod label_files;
mod labelme;
pub(crate) mod language_features;
pub(crate) mod lerf_mask;
pub(crate) mod masklets;
pub(crate) mod nested;
pub(crate) mod pictures;
mod polygons;
pub(crate) mod ref_lerf;
pub(crate) mod rle;
mod sheet;
pub(crate) mod spin_nerf;
pub(crate) mod synth_ids;
mod things;
pub(crate) mod three_d_ovs;
mod yolo;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use self::belongs::{LabelAddress, PhotoNames, PicturesOf, bound};
use self::label_files::LabelFile;
use self::language_features::{MaskFolder, MaskVectors};
pub(crate) use self::sheet::Sheet;
use self::sheet::{AsLoaded, draw, read_ids};
use super::IoError;
use crate::scene::{Level, Mask, Photo, text};

/// Longer side of masks of which only the names are needed, px.
const NAMES_SIDE_PX: u32 = 512;

/// A labeled region of one photo.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Name of the region; empty if unnamed.
    pub(crate) name: String,
    /// Object or part, if the file says.
    pub level: Option<Level>,
    /// Index of the region that it is a part of.
    pub(crate) parent: Option<usize>,
    /// Its pixels.
    pub mask: Mask,
}

/// Labels of some of a dataset's photos.
pub struct Labels {
    source: Source,
    /// Address of each labeled picture: its file and possible photo names.
    addresses: Vec<LabelAddress>,
    /// Labeled pictures of each photo, by name, once the photos are known.
    of: Option<PicturesOf>,
    notes: Vec<String>,
}

enum Source {
    /// Id maps of `fmlgs synth`.
    SynthIds(synth_ids::SynthIds),
    /// A picture per mask: SPIn-NeRF, 3D-OVS, LERF-Mask, Ref-LERF.
    Pictures(pictures::Pictures),
    /// Masklets of a video.
    Masklets(masklets::Masklets),
    /// Arrays of masks and their vectors.
    MaskFolder(MaskFolder),
    /// Label files of one picture or several.
    Files(Vec<LabelFile>),
}

impl Labels {
    /// Recognizes and reads the labels at `path`. Until the photos are known, each is treated as the only one.
    pub fn open(path: &Path) -> Result<Self, IoError> {
        let with = |source, addresses| Ok(Self { source, addresses, of: None, notes: Vec::new() });
        if path.join(synth_ids::LIST_FILE).is_file() {
            let ids = synth_ids::SynthIds::open(path)?;
            let addresses = ids.addresses();
            return with(Source::SynthIds(ids), addresses);
        }
        if let Some(folder) = language_features::find(path)? {
            let addresses = folder.addresses();
            return with(Source::MaskFolder(folder), addresses);
        }
        for find in [spin_nerf::find, three_d_ovs::find, lerf_mask::find, ref_lerf::find] {
            if let Some(pictures) = find(path)? {
                let addresses = pictures.addresses();
                return with(Source::Pictures(pictures), addresses);
            }
        }
        let found = label_files::find(path)?;
        let mut notes = found.passed.notes();
        let (source, addresses) = match found.video {
            video if !found.files.is_empty() => {
                let unused = |(path, _): (PathBuf, _)| {
                    format!("{}: a video's masklets beside label files are not used", path.display())
                };
                notes.extend(video.map(unused));
                let addresses = found.files.iter().map(|file| file.address.clone()).collect();
                (Source::Files(found.files), addresses)
            }
            Some((_, masklets)) => (Source::Masklets(masklets), Vec::new()),
            None => {
                for name in [language_features::FOLDER, language_features::COMPRESSED] {
                    if let Some(folder) = language_features::find(&path.join(name))? {
                        let addresses = folder.addresses();
                        return Ok(Self { source: Source::MaskFolder(folder), addresses, of: None, notes });
                    }
                }
                let passed = notes.iter().map(|note| format!(" ({note})")).collect();
                return Err(IoError::NoLabels { path: path.into(), passed });
            }
        };
        Ok(Self { source, addresses, of: None, notes })
    }

    /// Reads the labels at `path` of these photos, which are all of a data set: each label file belongs to one of them.
    ///
    /// # Errors
    /// As [`open`](Self::open), and if a file matches two photos.
    pub fn of_photos(path: &Path, photos: &[Photo]) -> Result<Self, IoError> {
        let mut labels = Self::open(path)?;
        let names = PhotoNames::new(photos.iter().map(|photo| photo.name.as_str()));
        let (of, notes) = bound(&labels.addresses, &names)?;
        labels.notes.extend(notes);
        labels.of = Some(of);
        if let Source::Masklets(masklets) = &labels.source {
            masklets.of_one_video(photos)?;
        }
        Ok(labels)
    }

    /// Notes on labels that are skipped, unused or joined, a sentence each.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Returns the labeled pictures of a photo.
    fn pictures_of(&self, photo: &Photo) -> Vec<usize> {
        match &self.of {
            Some(of) => of.get(&photo.name).cloned().unwrap_or_default(),
            None => {
                let alone = PhotoNames::new(std::iter::once(photo.name.as_str()));
                let is_own = |i: &usize| alone.owner(&self.addresses[*i]).is_ok_and(|owner| owner.is_some());
                (0..self.addresses.len()).filter(is_own).collect()
            }
        }
    }

    /// Returns whether a photo has labels.
    pub fn has(&self, photo: &Photo) -> bool {
        match &self.source {
            Source::Masklets(masklets) => masklets.has(&stem(&photo.name)),
            _ => !self.pictures_of(photo).is_empty(),
        }
    }

    /// Reads the names in the label files of a photo; none if masks are pictures or a video's.
    pub(crate) fn names(&self, photo: &Photo) -> Result<Vec<String>, IoError> {
        match &self.source {
            Source::Files(_) if self.has(photo) => {
                let regions = self.of(photo, NAMES_SIDE_PX)?;
                Ok(regions.into_iter().map(|region| region.name).filter(|name| !name.is_empty()).collect())
            }
            _ => Ok(Vec::new()),
        }
    }

    /// Reads the regions of a photo, undistorted and scaled to at most `max_side_px`. Regions without a pixel are left
    /// out, and their parts then have no parent. Empty if the photo has no labels.
    pub fn of(&self, photo: &Photo, max_side_px: u32) -> Result<Vec<Region>, IoError> {
        let sheet = Sheet::new(photo);
        let mut as_loaded = AsLoaded::new(photo, max_side_px);
        if let Source::Masklets(masklets) = &self.source {
            return Ok(shown(masklets.regions(&stem(&photo.name), sheet)?, &mut as_loaded));
        }
        let mut all = Vec::new();
        for picture in self.pictures_of(photo) {
            if let Source::MaskFolder(folder) = &self.source {
                // A photo has one file; it is read as loaded.
                return folder.regions(picture, sheet, &mut as_loaded);
            }
            let regions = match &self.source {
                Source::SynthIds(ids) => ids.regions(picture, sheet)?,
                Source::Pictures(pictures) => pictures.regions(picture, sheet)?,
                Source::Files(files) => files[picture].regions(sheet)?,
                Source::Masklets(_) | Source::MaskFolder(_) => Vec::new(),
            };
            things::join(&mut all, shown(regions, &mut as_loaded));
        }
        Ok(all)
    }
}

impl Labels {
    /// Returns the name of the encoder of the masks' vectors; `None` if the masks have none.
    pub(crate) fn encoder(&self) -> Option<&'static str> {
        matches!(&self.source, Source::MaskFolder(folder) if folder.has_vectors).then_some(language_features::ENCODER)
    }

    /// Reads the masks of a photo and their vectors, undistorted and scaled to at most `max_side_px`; `None` if it has
    /// none.
    pub(crate) fn vectors(&self, photo: &Photo, max_side_px: u32) -> Result<Option<MaskVectors>, IoError> {
        let Source::MaskFolder(folder) = &self.source else { return Ok(None) };
        let Some(&picture) = self.pictures_of(photo).first() else { return Ok(None) };
        folder.vectors(picture, Sheet::new(photo), &mut AsLoaded::new(photo, max_side_px))
    }
}

/// Returns the regions that have a pixel in the photo as loaded.
fn shown(regions: Vec<Region>, as_loaded: &mut AsLoaded<'_>) -> Vec<Region> {
    let mut place = Vec::with_capacity(regions.len());
    let mut kept: Vec<Region> = Vec::new();
    for region in regions {
        let mask = as_loaded.mask(&region.mask);
        let parent = region.parent.and_then(|p| place.get(p).copied().flatten());
        place.push((!mask.is_empty()).then_some(kept.len()));
        if !mask.is_empty() {
            kept.push(Region { name: text::name(&region.name), mask, parent, ..region });
        }
    }
    kept
}

/// Content of label files that is skipped or reinterpreted: its count, and the first file with it.
#[derive(Default)]
pub(crate) struct Passed(BTreeMap<String, (usize, PathBuf)>);

impl Passed {
    /// Counts skipped content.
    fn add(&mut self, what: &str, path: &Path) {
        self.report(&format!("{what} are passed over"), path);
    }

    /// Counts content to be reported.
    fn report(&mut self, what: &str, path: &Path) {
        self.0.entry(what.to_owned()).or_insert_with(|| (0, path.to_owned())).0 += 1;
    }

    fn notes(&self) -> Vec<String> {
        let note = |(what, (count, first)): (&String, &(usize, PathBuf))| {
            let first = first.file_name().unwrap_or(first.as_os_str()).to_string_lossy();
            format!("{count} {what} (first in {first})")
        };
        self.0.iter().map(note).collect()
    }
}

/// File name without folder and extension.
pub(crate) fn stem(name: &str) -> String {
    let file = name.rsplit(['/', '\\']).next().unwrap_or(name);
    file.rsplit_once('.').map_or(file, |(stem, _)| stem).to_owned()
}

/// Lists file names in a folder, sorted; empty if there is no such folder.
fn entries(folder: &Path) -> Vec<String> {
    crate::io::files::names_in(folder).unwrap_or_default()
}

#[cfg(test)]
mod tests;
