//! Masks as pictures, one per region.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::belongs::LabelAddress;
use super::{Region, Sheet};
use crate::io::{IoError, files, photo};
use crate::scene::{Level, Mask};

/// Pictures of masks, by the stem of their photo.
#[derive(Debug)]
pub struct Pictures {
    /// Name of the region and its picture, in the order of their names.
    pub(crate) of: BTreeMap<String, Vec<(String, PathBuf)>>,
    /// Least value, of 255, inside the region.
    pub(crate) least: u8,
    /// Level of all regions, if the layout implies it.
    pub(crate) level: Option<Level>,
    /// Optional prefix of the stem in the name of a photo.
    pub(crate) prefix: Option<&'static str>,
}

impl Pictures {
    /// Addresses of the stems, in their order.
    pub(super) fn addresses(&self) -> Vec<LabelAddress> {
        let address = |(stem, masks): (&String, &Vec<(String, PathBuf)>)| {
            let number = self.prefix.filter(|_| stem.bytes().all(|b| b.is_ascii_digit()));
            let names = std::iter::once(stem.clone()).chain(number.map(|prefix| format!("{prefix}{stem}"))).collect();
            LabelAddress { file: masks.first().map(|(_, path)| path.clone()).unwrap_or_default(), names }
        };
        self.of.iter().map(address).collect()
    }

    /// Reads the regions of the stem at `index`.
    pub(super) fn regions(&self, index: usize, sheet: Sheet<'_>) -> Result<Vec<Region>, IoError> {
        let listed = self.of.values().nth(index).map_or(&[][..], Vec::as_slice);
        let read = |(name, path): &(String, PathBuf)| {
            let mask = read(path, self.least, sheet, listed.len())?;
            Ok(Region { name: name.clone(), level: self.level, parent: None, mask })
        };
        listed.iter().map(read).collect()
    }
}

/// Reads the pixels of a picture that are at least `least` of 255 in any color; `masks` such masks are in memory at
/// once.
fn read(path: &Path, least: u8, sheet: Sheet<'_>, masks: usize) -> Result<Mask, IoError> {
    sheet.check(path, photo::size(path)?, masks)?;
    let (width, height, values) = photo::decode_brightest(&files::read(path, files::MAX_PICTURE_BYTES)?, path)?;
    Ok(Mask::from_fn(width, height, |i| values[i] >= least))
}

/// Reads the white pixels of a single picture.
pub(crate) fn mask(path: &Path) -> Result<Mask, IoError> {
    let (width, height, values) = photo::decode_brightest(&files::read(path, files::MAX_PICTURE_BYTES)?, path)?;
    Ok(Mask::from_fn(width, height, |i| values[i] >= 128))
}

/// Returns the stem of the name of a `.png`; `None` for other names.
pub(crate) fn png_stem(name: &str) -> Option<&str> {
    name.rsplit_once('.').filter(|(stem, ending)| ending.eq_ignore_ascii_case("png") && !stem.is_empty()).map(|p| p.0)
}
