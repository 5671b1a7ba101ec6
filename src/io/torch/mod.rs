//! Reader of PyTorch and safetensors checkpoints: named tensors, read one at a time, and the values beside them.
//!
//! The crate `pytorch-reader` (Burn's) is sound, but it reads no TorchScript archive, and it skips unknown names,
//! which this program must refuse; hence `pickle`.
//!
//! A checkpoint is data: opcodes and names that tensors do not need are refused by name. Sizes are compared with the
//! file before memory is allocated. Only tensors that are asked for are read.

mod numpy;
mod parts;
mod pickle;
mod safe;
mod tensor;
mod torch_zip;
mod tree;

#[cfg(test)]
mod tests;
#[cfg(test)]
mod value_tests;
#[cfg(test)]
pub(crate) mod written;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use zip::ZipArchive;

use super::{IoError, files};
use tensor::StoragePlace;
pub(crate) use tensor::{Dtype, StoredTensor};
pub(crate) use tree::TorchTree;

/// Reasons for which a checkpoint cannot be read.
#[derive(Debug, thiserror::Error)]
pub(crate) enum WeightFileError {
    #[error("{0}")]
    File(Box<IoError>),
    #[error("{0}")]
    Read(#[from] io::Error),
    #[error(
        "it is neither a checkpoint of PyTorch (1.6 or later) nor safetensors; one of an older PyTorch has to be saved anew there"
    )]
    Kind,
    #[error("its archive is broken: {0}; the download may be incomplete")]
    Zip(#[from] zip::result::ZipError),
    #[error("its archive entry '{entry}' {problem}")]
    Entry { entry: String, problem: String },
    #[error("its pickle has the opcode {opcode:#04x} at byte {at}, which tensors do not need; it was not read further")]
    Opcode { opcode: u8, at: usize },
    #[error("its pickle asks for '{name}', which tensors do not need; nothing of it was run")]
    Global { name: String },
    #[error("its pickle is broken at byte {at}: {what}")]
    Pickle { what: String, at: usize },
    #[error("it has more than {most} {what}; it is no checkpoint of a network")]
    TooMany { what: &'static str, most: usize },
    #[error("its header of safetensors is broken: {0}")]
    Safetensors(String),
    #[error("its tensor '{name}' {problem}")]
    Tensor { name: String, problem: String },
}

impl WeightFileError {
    /// Makes an error about the file at `path`.
    pub(crate) fn of(self, path: &Path) -> IoError {
        match self {
            Self::File(e) => *e,
            other => IoError::syntax(path, "as a checkpoint", other.to_string()),
        }
    }
}

enum Source {
    Archive(Box<ZipArchive<BufReader<File>>>),
    Flat(File),
}

/// Open checkpoint.
pub(crate) struct WeightFile {
    source: Source,
    /// Tensors by their path of keys, joined by dots: `0.1`, `splats.means`.
    pub(crate) tensors: BTreeMap<String, StoredTensor>,
    /// Values beside the tensors; empty for safetensors.
    pub(crate) tree: TorchTree,
    /// Storage that was read last: tensors may share one.
    last: Option<(StoragePlace, Vec<u8>)>,
}

impl WeightFile {
    /// Opens a file and reads its list of tensors, but no values.
    pub(crate) fn open(path: &Path) -> Result<Self, WeightFileError> {
        Self::read(files::open(path).map_err(|e| WeightFileError::File(Box::new(e)))?)
    }

    fn read(mut file: File) -> Result<Self, WeightFileError> {
        let mut start = [0; 9];
        let read = file.read(&mut start)?;
        file.seek(SeekFrom::Start(0))?;
        let (source, tensors, tree) = if start.starts_with(b"PK\x03\x04") {
            let (archive, tensors, tree) = torch_zip::open(file)?;
            (Source::Archive(Box::new(archive)), tensors, tree)
        } else if read == 9 && start[8] == b'{' {
            let tensors = safe::open(&mut file)?;
            (Source::Flat(file), tensors, TorchTree::default())
        } else {
            return Err(WeightFileError::Kind);
        };
        Ok(Self { source, tensors, tree, last: None })
    }

    /// Reads the values of a tensor, row-major.
    pub(crate) fn floats(&mut self, name: &str) -> Result<Vec<f32>, WeightFileError> {
        let failed = |problem: String| WeightFileError::Tensor { name: name.into(), problem };
        let tensor = self.float_tensor(name)?;
        let floats = tensor.gather(self.storage(name, &tensor)?, Dtype::floats);
        match floats.iter().position(|v| !v.is_finite()) {
            Some(i) => Err(failed(format!("has {} at place {i}; the file is damaged", floats[i]))),
            None => Ok(floats),
        }
    }

    /// Reads the values of a tensor of whole numbers or truth values, row-major.
    #[allow(dead_code, reason = "results of other methods need it")]
    pub(crate) fn integers(&mut self, name: &str) -> Result<Vec<i64>, WeightFileError> {
        let tensor = self.tensor(name)?;
        if tensor.dtype.is_float() {
            let problem = "has fractions where whole numbers are expected".into();
            return Err(WeightFileError::Tensor { name: name.into(), problem });
        }
        Ok(tensor.gather(self.storage(name, &tensor)?, Dtype::integers))
    }

    /// Reads a tensor in blocks of at most `rows` of its first axis, so that it is never in memory as a whole. `each`
    /// gets the number of a block's first row and the block's values, which may be NaN or infinite.
    pub(crate) fn blocks(
        &mut self,
        name: &str,
        rows: usize,
        each: &mut dyn FnMut(usize, &[f32]),
    ) -> Result<(), WeightFileError> {
        let tensor = self.float_tensor(name)?;
        let (count, rows) = (tensor.shape.first().copied().unwrap_or(1), rows.max(1));
        let Some(in_row) = tensor.count().checked_div(count) else { return Ok(()) };
        if let (Source::Archive(archive), Some(begin)) = (&mut self.source, tensor.begin()) {
            let size = in_row * tensor.dtype.bytes();
            let lengths = (0..count).step_by(rows).map(|first| rows.min(count - first) * size);
            let mut first = 0;
            return torch_zip::parts(archive, tensor.place, begin, lengths, &mut |bytes| {
                each(first, &tensor.dtype.floats(bytes));
                first += rows;
            });
        }
        let values = tensor.gather(self.storage(name, &tensor)?, Dtype::floats);
        let parts = values.chunks((rows * in_row).max(1)).enumerate();
        parts.for_each(|(k, part)| each(k * rows, part));
        Ok(())
    }

    fn tensor(&self, name: &str) -> Result<StoredTensor, WeightFileError> {
        let failed = |problem: &str| WeightFileError::Tensor { name: name.into(), problem: problem.into() };
        let tensor = self.tensors.get(name).ok_or_else(|| failed("is not there"))?;
        match tensor.repeats() {
            true => Err(failed("is larger than what is stored for it, as it repeats numbers; save a copy of it")),
            false => Ok(tensor.clone()),
        }
    }

    fn float_tensor(&self, name: &str) -> Result<StoredTensor, WeightFileError> {
        let tensor = self.tensor(name)?;
        match tensor.dtype.is_float() {
            true => Ok(tensor),
            false => {
                let problem = "has whole numbers where fractions are expected".into();
                Err(WeightFileError::Tensor { name: name.into(), problem })
            }
        }
    }

    /// Reads the storage of a tensor, unless it is the one that was read last.
    fn storage(&mut self, name: &str, tensor: &StoredTensor) -> Result<&[u8], WeightFileError> {
        if self.last.as_ref().is_none_or(|(place, _)| *place != tensor.place) {
            // Freed first, so that only one storage is in memory.
            self.last = None;
            let bytes = match &mut self.source {
                Source::Archive(archive) => torch_zip::storage(archive, tensor.place)?,
                Source::Flat(file) => safe::storage(file, tensor.place)?,
            };
            self.last = Some((tensor.place, bytes));
        }
        let bytes = self.last.as_ref().map_or(&[][..], |(_, bytes)| bytes);
        match bytes.len() < tensor.end() {
            true => {
                let problem = "is cut off; the download may be incomplete".into();
                Err(WeightFileError::Tensor { name: name.into(), problem })
            }
            false => Ok(bytes),
        }
    }
}
