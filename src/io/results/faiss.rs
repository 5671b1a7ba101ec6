//! An index of FAISS with product quantization (`IwPQ` over a flat index), as Dr.Splat uses one for all scenes.

use std::path::{Path, PathBuf};

use super::folder::{self, ResultOptions};
use super::product::ProductCodes;
use crate::io::reader::Reader;
use crate::io::{IoError, files};

const FILE: &str = "pq_index.faiss";
/// Largest index in bytes; the published one has 2.6 MB.
const MAX_BYTES: u64 = 64 << 20;
/// Folders above the checkpoint in which the index is looked for.
const ABOVE: usize = 3;

/// Centroids of an index.
pub(super) struct PqIndex {
    path: PathBuf,
    pieces: usize,
    width: usize,
    coarse: Vec<f32>,
    books: Vec<f32>,
}

/// Reads the index that belongs to a checkpoint.
pub(super) fn beside(checkpoint: &Path, options: &ResultOptions) -> Result<PqIndex, IoError> {
    let whole = std::path::absolute(checkpoint).unwrap_or_else(|_| checkpoint.into());
    let above = whole.ancestors().skip(1).take(ABOVE + 1).flat_map(|f| [f.join(FILE), f.join("ckpts").join(FILE)]);
    let found = above.into_iter().find(|file| file.is_file());
    let what = "codes of an index of FAISS (pq_index.faiss, which its authors publish)";
    read(&folder::helper(options.decoder.as_deref(), found, checkpoint, what)?)
}

fn read(path: &Path) -> Result<PqIndex, IoError> {
    let bytes = files::read(path, MAX_BYTES)?;
    parse(&bytes, path)
}

/// Reads the beginning of an index: kind, numbers of a vector, number of vectors.
fn head<'a>(r: &mut Reader<'a>, path: &Path, kind: &[u8; 4]) -> Result<(usize, u64), IoError> {
    let found = r.array::<4>("the kind")?;
    if found != *kind {
        let (found, kind) = (String::from_utf8_lossy(&found), String::from_utf8_lossy(kind));
        let what = format!("an index of the kind '{found}' instead of '{kind}'");
        return Err(IoError::Unsupported { path: path.into(), what, remedy: "use the index that its authors publish" });
    }
    let dim = r.u32("the dimension")? as usize;
    let count = r.u64("the count")?;
    // Two numbers that are not used, whether it is trained, and the metric.
    r.take(8 + 8 + 1, "the head")?;
    let metric = r.u32("the metric")?;
    if metric > 1 {
        r.take(4, "the metric's argument")?;
    }
    Ok((dim, count))
}

/// Numbers with their count in front.
fn floats(r: &mut Reader<'_>, place: &str) -> Result<Vec<f32>, IoError> {
    let count = r.count(place, 4)?;
    Ok(r.take(4 * count, place)?.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect())
}

fn parse(bytes: &[u8], path: &Path) -> Result<PqIndex, IoError> {
    let mut r = Reader::new(bytes, path);
    let bad = |reason: String| IoError::syntax(path, "index", reason);
    let (dim, _) = head(&mut r, path, b"IwPQ")?;
    let lists = r.u64("the number of lists")?;
    r.u64("the number of probes")?;
    let (coarse_dim, coarse_count) = head(&mut r, path, b"IxFI")?;
    let coarse = floats(&mut r, "coarse centroids")?;
    let whole = coarse_dim == dim && dim > 0 && coarse_count.checked_mul(dim as u64) == Some(coarse.len() as u64);
    if !whole || coarse_count != lists {
        return Err(bad(format!("{} coarse numbers for {lists} lists of {dim}", coarse.len())));
    }
    // The direct map: a kind, and an array.
    let kind = r.array::<1>("the direct map")?;
    let mapped = r.count("the direct map", 8)?;
    r.take(8 * mapped, "the direct map")?;
    if kind != [0] {
        return Err(bad("a direct map of another kind".into()));
    }
    let by_residual = r.array::<1>("residuals")?;
    let code_size = r.u64("the size of a code")?;
    let (inner, pieces, bits) = (r.u64("the dimension")?, r.u64("the pieces")?, r.u64("the bits")?);
    if by_residual != [1] || bits != 8 || inner != dim as u64 || code_size != pieces {
        return Err(bad(format!(
            "codes of {pieces} pieces of {bits} bits without or with residuals ({by_residual:?})"
        )));
    }
    let pieces = pieces as usize;
    let books = floats(&mut r, "centroids of pieces")?;
    if pieces == 0 || dim % pieces != 0 || books.len() != dim * 256 {
        return Err(bad(format!("{} numbers of {pieces} pieces", books.len())));
    }
    if let Some(at) = coarse.iter().chain(&books).position(|v| !v.is_finite()) {
        return Err(bad(format!("number {at} of its centroids is not finite")));
    }
    Ok(PqIndex { path: path.into(), pieces, width: dim / pieces, coarse, books })
}

impl PqIndex {
    /// Codes of Gaussians, one row of bytes each.
    pub(super) fn codes(self, rows: Vec<u8>) -> Result<ProductCodes, IoError> {
        let codes = ProductCodes::new(self.pieces, self.width, self.coarse, self.books, rows);
        codes.ok_or_else(|| IoError::syntax(&self.path, "index", "the codes of the Gaussians do not fit it"))
    }
}
