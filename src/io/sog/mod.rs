//! SOG: splats quantized into WebP pictures beside a `meta.json`, in a folder or in one `.sog`
//! archive (PlayCanvas). Versions 1 and 2.
//!
//! Pixel `i` of each picture belongs to Gaussian `i`. Positions have 16 bits an axis, in two
//! pictures, on a logarithmic scale; version 2 looks scales and colors up in codebooks where
//! version 1 interpolates between bounds; higher harmonics are entries of a palette.

mod archive;
mod decode;
mod meta;

use std::path::Path;

use super::{IoError, files};
use crate::scene::GaussianCloud;

/// The file that makes a folder a SOG scene.
pub(crate) const META_FILE: &str = "meta.json";

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

/// The Gaussians in the bytes of a bundled `.sog`; `path` is for errors.
pub fn parse_archive(bytes: &[u8], path: &Path) -> Result<GaussianCloud, IoError> {
    let mut archive = archive::Archive::open(bytes, path)?;
    let meta = meta::parse(&archive.read(META_FILE)?, path)?;
    decode::cloud(&meta, |name| archive.read(name), path)
}

fn missing(path: &Path, entry: &str) -> IoError {
    IoError::Syntax { path: path.into(), place: format!("file '{entry}'"), reason: "it does not exist".into() }
}

#[cfg(test)]
mod tests;
