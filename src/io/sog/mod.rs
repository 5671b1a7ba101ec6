//! SOG: splats quantized into WebP pictures beside a `meta.json`, in a folder or in one `.sog`
//! archive (PlayCanvas). Versions 1 and 2 are read, version 2 is written.
//!
//! Pixel `i` of each picture belongs to Gaussian `i`. Positions have 16 bits an axis, in two pictures, on a logarithmic
//! scale. Version 2 has codebooks for scales and colors; version 1 interpolates them between bounds. Higher harmonics
//! are entries of a palette.

mod archive;
mod decode;
mod encode;
mod meta;
mod palette;

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::atomic::{Draft, WriteProgress};
use super::error::write_error;
use super::{IoError, bundle, files};
use crate::scene::GaussianCloud;

/// File that makes a folder a SOG scene.
pub(crate) const META_FILE: &str = "meta.json";

/// Palette entries in a row of the palette's picture.
const PALETTE_ROW: usize = 64;
/// Alpha value of a quaternion with `w` as its largest component.
const FIRST_TAG: u8 = 252;

/// Reads an unbundled SOG by its `meta.json`.
pub fn read_folder(meta_file: &Path) -> Result<GaussianCloud, IoError> {
    let root = meta_file.parent().unwrap_or(Path::new("."));
    let meta = meta::parse(&files::read(meta_file, files::MAX_TEXT_BYTES)?, meta_file)?;
    let load = |name: &str| {
        let entry = files::relative(root, name, meta_file)?;
        match files::inside(root, &entry, meta_file)? {
            Some(path) => files::read(&path, files::MAX_PICTURE_BYTES),
            None => Err(missing(meta_file, &entry)),
        }
    };
    decode::cloud(&meta, load, meta_file)
}

pub(crate) fn read_archive(path: &Path) -> Result<GaussianCloud, IoError> {
    parse_archive(&files::read(path, u64::MAX)?, path)
}

/// Parses the Gaussians of a bundled `.sog`; `path` is for errors.
pub fn parse_archive(bytes: &[u8], path: &Path) -> Result<GaussianCloud, IoError> {
    let mut archive = archive::Archive::open(bytes, path)?;
    let meta = meta::parse(&archive.read(META_FILE)?, path)?;
    decode::cloud(&meta, |name| archive.read(name), path)
}

/// Writes the bytes of a bundled SOG of a valid cloud that is not empty.
pub(super) fn encode(out: &mut dyn Write, cloud: &GaussianCloud, progress: &mut WriteProgress<'_>) -> io::Result<()> {
    out.write_all(&bundle::pack(&encode::files(cloud, progress)?)?)
}

/// Writes an unbundled SOG: its pictures first, then `meta_file`, without which they are not used.
///
/// # Errors
/// If `meta_file` exists already: all files could not be replaced at once.
pub(super) fn write_folder(
    meta_file: &Path,
    cloud: &GaussianCloud,
    progress: &mut WriteProgress<'_>,
) -> Result<(), IoError> {
    let folder = files::folder_of(meta_file);
    if meta_file.exists() {
        return Err(IoError::Occupied { folder: folder.into(), what: "holds a meta.json already" });
    }
    let write = |(name, bytes): &(String, Vec<u8>)| {
        let path = folder.join(name);
        let mut draft = Draft::create(&path)?;
        draft.write_all(bytes).map_err(|cause| write_error(&path, cause))?;
        Ok(draft)
    };
    let all = encode::files(cloud, progress).map_err(|cause| write_error(meta_file, cause))?;
    let drafts = all.iter().map(write).collect::<Result<Vec<_>, IoError>>()?;
    drafts.into_iter().try_for_each(|draft| draft.commit().map(drop))
}

/// Lists the files of an unbundled SOG, as far as they are known.
pub(super) fn files_of(meta_file: &Path) -> Vec<PathBuf> {
    let meta = files::read(meta_file, files::MAX_TEXT_BYTES).and_then(|bytes| meta::parse(&bytes, meta_file));
    let names = meta.map(|meta| meta.files()).unwrap_or_default();
    let folder = files::folder_of(meta_file);
    names.iter().map(|name| folder.join(name)).chain([meta_file.to_path_buf()]).collect()
}

fn missing(path: &Path, entry: &str) -> IoError {
    IoError::Syntax { path: path.into(), place: format!("file '{entry}'"), reason: "it does not exist".into() }
}

#[cfg(test)]
mod tests;
