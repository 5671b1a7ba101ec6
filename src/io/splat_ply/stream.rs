//! Splats read block by block, so that the whole file is never in memory beside its Gaussians.

use std::borrow::Cow;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use super::STATE;
use super::read::Reading;
use crate::io::finite::finite_only;
use crate::io::ply::{Encoding, Ply, Table};
use crate::io::{IoError, files, memory};
use crate::scene::GaussianCloud;

/// Most bytes of the header.
const HEADER_BYTES: u64 = 64 << 10;
/// Bytes of a block of rows, of which two are in memory at once.
const BLOCK_BYTES: usize = 4 << 20;

/// Reads the id of the scene's state that a `.ply` belongs to, if stated.
pub(crate) fn state(path: &Path) -> Result<Option<String>, IoError> {
    Ok(state_in(&files::read_start(path, HEADER_BYTES)?, path))
}

/// As [`state`], from the first bytes of a file.
pub(crate) fn state_in(start: &[u8], path: &Path) -> Option<String> {
    let ply = Ply::parse(start, path).ok()?;
    ply.comments.iter().find_map(|c| c.strip_prefix(STATE)).map(str::to_owned)
}

/// Reads a little-endian `.ply` with the Gaussians as its first element; `None` for other files, which have to be read
/// as a whole.
pub(crate) fn read(path: &Path) -> Result<Option<GaussianCloud>, IoError> {
    let start = files::read_start(path, HEADER_BYTES)?;
    // Reading the whole file reports the errors of the header.
    let Ok(ply) = Ply::parse(&start, path) else { return Ok(None) };
    let Some((columns, stride)) = ply.first_rows("vertex") else { return Ok(None) };
    let rows = ply.elements.first().map_or(0, |e| e.count) as usize;
    let failed = |cause| IoError::Read { path: path.into(), cause };
    let mut file = files::open(path)?;
    let bytes = file.metadata().map_err(failed)?.len();
    let header = start.len() - ply.body_len();
    let end = rows.checked_mul(stride).and_then(|n| n.checked_add(header));
    let fits = end.is_some_and(|end| end as u64 <= bytes) && bytes <= memory::budget();
    let empty = Table { rows: 0, stride, columns: columns.clone(), data: Cow::default() };
    let plain = Reading { ply: &ply, table: &empty }.is_told_by_any_row();
    if ply.encoding != Encoding::LittleEndian || ply.element("chunk").is_some() || !fits || !plain {
        return Ok(None);
    }
    file.seek(SeekFrom::Start(header as u64)).map_err(failed)?;
    let mut cloud: Option<GaussianCloud> = None;
    let in_block = (BLOCK_BYTES / stride).max(1);
    // One block is read while the previous one is converted.
    let mut read = |first: usize, block: &mut Vec<u8>| {
        block.resize(in_block.min(rows.saturating_sub(first)) * stride, 0);
        file.read_exact(block).map_err(failed)
    };
    let (mut block, mut next) = (Vec::new(), Vec::new());
    read(0, &mut block)?;
    for first in (0..rows).step_by(in_block) {
        let append = || -> Result<(), IoError> {
            let data = Cow::Borrowed(block.as_slice());
            let part = Table { rows: block.len() / stride, stride, columns: columns.clone(), data };
            let reading = Reading { ply: &ply, table: &part };
            match &mut cloud {
                Some(cloud) => reading.append_to(cloud)?,
                None => cloud = Some(reading.cloud()?.with_room(rows)),
            }
            Ok(())
        };
        let (appended, was_read) = rayon::join(append, || read(first + in_block, &mut next));
        appended.and(was_read)?;
        std::mem::swap(&mut block, &mut next);
    }
    cloud.map(|cloud| finite_only(cloud, path)).transpose()
}
