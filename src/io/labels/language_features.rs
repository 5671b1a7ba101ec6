//! LangSplat's `language_features/`, from which many methods begin: for each photo `<photo>_s.npy`, the number of the
//! mask at each pixel at four levels (default, small, medium, large; -1 = none), and `<photo>_f.npy`, a vector of
//! OpenCLIP for each mask. Numbers run on from level to level.
//!
//! Large and medium masks are objects, or parts where they lie in a larger one; small masks are parts. The default
//! level is used only where the others are empty. In `language_features_dim3/` the vectors are compressed by an autoencoder
//! of the scene, which is to lie beside.

use std::path::{Path, PathBuf};

use super::belongs::LabelAddress;
use super::nested::{NO_MASK, nested};
use super::sheet::AsLoaded;
use super::{Region, Sheet, entries};
use crate::io::results::numpy::{self, NumpyArray};
use crate::io::results::{Decoder, autoencoder};
use crate::io::{IoError, files};
use crate::scene::Mask;

/// Name of the folder in a data set.
pub(crate) const FOLDER: &str = "language_features";
/// Name of the folder with compressed vectors.
pub(crate) const COMPRESSED: &str = "language_features_dim3";
/// Numbers of a compressed vector.
const COMPRESSED_DIMENSION: usize = 3;
/// Encoder of the vectors: OpenCLIP's ViT-B/16, trained on LAION-2B.
pub(crate) const ENCODER: &str = "clip-vit-b16";
/// Numbers of a vector.
const DIMENSION: usize = 512;
/// Endings of the two files of a photo.
const MASKS: &str = "_s.npy";
const VECTORS: &str = "_f.npy";
/// Levels in a file, and the place of the default one.
const LEVELS: usize = 4;
const DEFAULT: usize = 0;
/// Most masks of a photo.
const MOST_MASKS: usize = 4096;

/// Masks of a photo, and their vectors.
#[derive(Debug)]
pub struct MaskVectors {
    /// Number of the mask at each pixel, [`NO_MASK`] if there is none, by level: small, medium and large, or the
    /// default one alone.
    pub(crate) levels: Vec<Vec<u16>>,
    /// Vectors of the masks, one after another.
    vectors: Vec<f32>,
}

impl MaskVectors {
    /// Vector of a mask.
    pub(crate) fn of(&self, mask: u16) -> &[f32] {
        &self.vectors[usize::from(mask) * DIMENSION..][..DIMENSION]
    }

    /// Numbers of a vector.
    pub(crate) const fn dimension() -> usize {
        DIMENSION
    }
}

/// Folder of such files.
#[derive(Debug)]
pub(crate) struct MaskFolder {
    root: PathBuf,
    /// Names of the photos, without ending.
    stems: Vec<String>,
    pub(crate) has_vectors: bool,
    /// Decoder of compressed vectors.
    decoder: Option<Decoder>,
}

/// Finds the files in the folder `root`; `None` if there are none.
///
/// # Errors
/// If the vectors are not of OpenCLIP's length, or compressed and no autoencoder lies beside.
pub(crate) fn find(root: &Path) -> Result<Option<MaskFolder>, IoError> {
    let names = entries(root);
    let with = |ending: &'static str| names.iter().filter_map(move |name| name.strip_suffix(ending));
    let stems: Vec<String> = with(MASKS).filter(|stem| !stem.is_empty()).map(str::to_owned).collect();
    if stems.is_empty() {
        return Ok(None);
    }
    let first = with(VECTORS).next().map(|stem| root.join(format!("{stem}{VECTORS}")));
    let mut decoder = None;
    if let Some(path) = &first {
        let array = read(path)?;
        if matches!(array.shape.as_slice(), [_, COMPRESSED_DIMENSION]) {
            decoder = Some(decoder_beside(root, path)?);
        }
        rows(&array, path, 0, decoder.as_ref())?;
    }
    Ok(Some(MaskFolder { root: root.to_owned(), stems, has_vectors: first.is_some(), decoder }))
}

/// Reads an array of a size that a photo may have.
fn read(path: &Path) -> Result<NumpyArray, IoError> {
    numpy::parse(files::read(path, files::MAX_PICTURE_BYTES)?).map_err(|reason| IoError::syntax(path, "npy", reason))
}

/// Loads the decoder of the compressed vectors in `path`, which is in the folder `root` of a data set.
fn decoder_beside(root: &Path, path: &Path) -> Result<Decoder, IoError> {
    let whole = std::path::absolute(root).unwrap_or_else(|_| root.to_owned());
    let scene = whole.parent().and_then(Path::file_name).unwrap_or_default().to_string_lossy().into_owned();
    let Some(file) = autoencoder::find(&scene, &whole) else {
        let reason = format!(
            "its vectors are compressed to 3 numbers by LangSplat's autoencoder, and autoencoder/ckpt/{scene}/best_ckpt.pth \
             does not lie beside; choose the folder {FOLDER}, from which they were made"
        );
        return Err(IoError::syntax(path, "npy", reason));
    };
    let decoder = autoencoder::load(&file, COMPRESSED_DIMENSION)?;
    if decoder.outputs() != DIMENSION {
        let reason = format!("it makes vectors of {} numbers, expected {DIMENSION}", decoder.outputs());
        return Err(IoError::syntax(&file, "decoder", reason));
    }
    Ok(decoder)
}

impl MaskFolder {
    pub(super) fn addresses(&self) -> Vec<LabelAddress> {
        // The name of the file without its ending, which is no part of the photo's name.
        let address = |stem: &String| LabelAddress {
            file: self.root.join(format!("{stem}{MASKS}")),
            names: vec![self.root.join(format!("{stem}.png")).to_string_lossy().into_owned()],
        };
        self.stems.iter().map(address).collect()
    }

    /// Reads the levels of the photo at `index` at the size of the photo as loaded: small, medium and large, or the
    /// default one if these are empty; and the largest number of a mask.
    fn levels(&self, index: usize, sheet: Sheet<'_>, as_loaded: &mut AsLoaded<'_>) -> Result<MaskNumbers, IoError> {
        let path = self.root.join(format!("{}{MASKS}", self.stems[index]));
        let array = read(&path)?;
        let bad = |reason: String| IoError::syntax(&path, "npy", reason);
        let &[LEVELS, height, width] = array.shape.as_slice() else {
            return Err(bad(format!(
                "its shape is {:?}, expected [4, height, width]: masks of four levels",
                array.shape
            )));
        };
        let size = [width, height].map(|n| u32::try_from(n).unwrap_or(u32::MAX));
        sheet.check(&path, (size[0], size[1]), 1)?;
        let (values, mut largest) = (array.floats(), None);
        let mut level = |place: usize| -> Result<Vec<u16>, IoError> {
            let mut numbers = vec![NO_MASK; width * height];
            for (i, number) in numbers.iter_mut().enumerate() {
                let value = values[place * width * height + i];
                if value >= 0.0 && value < MOST_MASKS as f32 && value.fract() == 0.0 {
                    *number = value as u16;
                    largest = largest.max(Some(value as u16));
                } else if !(value < 0.0) {
                    let reason = format!(
                        "level {place}, row {}, column {} has the mask {value}, expected a whole number from -1 (none) to {}",
                        i / width,
                        i % width,
                        MOST_MASKS - 1
                    );
                    return Err(bad(reason));
                }
            }
            Ok(numbers)
        };
        let mut levels = (DEFAULT + 1..LEVELS).map(&mut level).collect::<Result<Vec<_>, _>>()?;
        if levels.iter().flatten().all(|number| *number == NO_MASK) {
            levels = vec![level(DEFAULT)?];
        }
        sheet.check(&path, (size[0], size[1]), largest.map_or(1, |n| usize::from(n) + 1))?;
        let levels = levels.into_iter().map(|level| as_loaded.numbers(&level, [width, height], NO_MASK)).collect();
        Ok(MaskNumbers { levels, largest })
    }

    /// Reads the regions of the photo at `index`, as loaded: wholes before their pieces.
    pub(super) fn regions(
        &self,
        index: usize,
        sheet: Sheet<'_>,
        as_loaded: &mut AsLoaded<'_>,
    ) -> Result<Vec<Region>, IoError> {
        let MaskNumbers { levels, .. } = self.levels(index, sheet, as_loaded)?;
        let coarse_first: Vec<&[u16]> = levels.iter().rev().map(Vec::as_slice).collect();
        let list = nested(&coarse_first);
        let [width, height] = as_loaded.size();
        let mut regions: Vec<Region> = list
            .iter()
            .map(|m| Region {
                name: String::new(),
                level: Some(m.level),
                parent: m.parent,
                mask: Mask::empty(width, height),
            })
            .collect();
        for (place, level) in coarse_first.iter().enumerate() {
            let mut region_of = vec![None; MOST_MASKS];
            let here = list.iter().enumerate().filter(|(_, m)| m.place == place);
            here.for_each(|(region, m)| region_of[usize::from(m.number)] = Some(region));
            for (i, number) in level.iter().enumerate() {
                if let Some(region) = region_of.get(usize::from(*number)).copied().flatten() {
                    regions[region].mask.insert(i);
                }
            }
        }
        Ok(regions)
    }

    /// Reads the masks of the photo at `index`, as loaded, and their vectors; `None` if it has no vectors.
    pub(super) fn vectors(
        &self,
        index: usize,
        sheet: Sheet<'_>,
        as_loaded: &mut AsLoaded<'_>,
    ) -> Result<Option<MaskVectors>, IoError> {
        let path = self.root.join(format!("{}{VECTORS}", self.stems[index]));
        if !path.is_file() {
            return Ok(None);
        }
        let MaskNumbers { levels, largest } = self.levels(index, sheet, as_loaded)?;
        let vectors = rows(&read(&path)?, &path, largest.map_or(0, |n| usize::from(n) + 1), self.decoder.as_ref())?;
        Ok(Some(MaskVectors { levels, vectors }))
    }
}

/// Numbers of masks at each pixel, by level, and the largest.
struct MaskNumbers {
    levels: Vec<Vec<u16>>,
    largest: Option<u16>,
}

/// Returns the vectors of an array, at least `masks`, decoded if they are compressed.
fn rows(array: &NumpyArray, path: &Path, masks: usize, decoder: Option<&Decoder>) -> Result<Vec<f32>, IoError> {
    let bad = |reason: String| IoError::syntax(path, "npy", reason);
    let dimension = decoder.map_or(DIMENSION, Decoder::inputs);
    let &[count, length] = array.shape.as_slice() else {
        return Err(bad(format!("its shape is {:?}, expected [masks, {dimension}]", array.shape)));
    };
    if length != dimension {
        let reason =
            format!("its shape is {:?}, expected [masks, {dimension}]: vectors of OpenCLIP's ViT-B/16", array.shape);
        return Err(bad(reason));
    }
    if count < masks {
        return Err(bad(format!("it has {count} vectors, and the masks beside it are numbered up to {}", masks - 1)));
    }
    let values = array.floats();
    if let Some(i) = values.iter().position(|v| !v.is_finite()) {
        return Err(bad(format!("vector {} is not finite", i / dimension)));
    }
    match decoder {
        Some(decoder) => Ok(values.chunks(dimension).flat_map(|code| decoder.embedding(code)).collect()),
        None => Ok(values),
    }
}
