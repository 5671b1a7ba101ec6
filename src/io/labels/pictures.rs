//! Masks that are pictures, one of each region.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::belongs::LabelAddress;
use super::{Region, Sheet};
use crate::io::{IoError, files, photo};
use crate::scene::{Level, Mask};

/// Pictures of masks, by the stem of the photo that they belong to.
#[derive(Debug)]
pub struct Pictures {
    /// Name of the region and its picture, in the order of their names.
    pub(crate) of: BTreeMap<String, Vec<(String, PathBuf)>>,
    /// Least value, of 255, that belongs to the region.
    pub(crate) least: u8,
    /// What all regions are, where the layout says.
    pub(crate) level: Option<Level>,
    /// What may stand before the stem in the name of a photo.
    pub(crate) prefix: Option<&'static str>,
}

impl Pictures {
    /// Of each stem, in their order.
    pub(super) fn addresses(&self) -> Vec<LabelAddress> {
        let address = |(stem, masks): (&String, &Vec<(String, PathBuf)>)| {
            let number = self.prefix.filter(|_| stem.bytes().all(|b| b.is_ascii_digit()));
            let names = std::iter::once(stem.clone()).chain(number.map(|prefix| format!("{prefix}{stem}"))).collect();
            LabelAddress { file: masks.first().map(|(_, path)| path.clone()).unwrap_or_default(), names }
        };
        self.of.iter().map(address).collect()
    }

    /// The regions of the stem at `index`.
    pub(super) fn regions(&self, index: usize, sheet: Sheet<'_>) -> Result<Vec<Region>, IoError> {
        let listed = self.of.values().nth(index).map_or(&[][..], Vec::as_slice);
        let read = |(name, path): &(String, PathBuf)| {
            let mask = read(path, self.least, sheet, listed.len())?;
            Ok(Region { name: name.clone(), level: self.level, parent: None, mask })
        };
        listed.iter().map(read).collect()
    }
}

/// The pixels of a picture that are at least `least` of 255 in any color; `masks` such are held
/// at once.
fn read(path: &Path, least: u8, sheet: Sheet<'_>, masks: usize) -> Result<Mask, IoError> {
    sheet.check(path, photo::size(path)?, masks)?;
    let (width, height, values) = photo::decode_brightest(&files::read(path, files::MAX_PICTURE_BYTES)?, path)?;
    Ok(Mask::from_fn(width, height, |i| values[i] >= least))
}

/// The white pixels of a picture on its own.
pub(crate) fn mask(path: &Path) -> Result<Mask, IoError> {
    let (width, height, values) = photo::decode_brightest(&files::read(path, files::MAX_PICTURE_BYTES)?, path)?;
    Ok(Mask::from_fn(width, height, |i| values[i] >= 128))
}

/// Whether a name is a `.png`'s; its stem then.
pub(crate) fn png_stem(name: &str) -> Option<&str> {
    name.rsplit_once('.').filter(|(stem, ending)| ending.eq_ignore_ascii_case("png") && !stem.is_empty()).map(|p| p.0)
}
