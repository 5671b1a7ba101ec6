//! Reader of PyTorch and safetensors checkpoints: named tensors, read one at a time.
//!
//! The crate `pytorch-reader` (Burn's) is sound, but it reads no TorchScript archive, and it skips unknown names,
//! which this program must refuse; hence `pickle`.
//!
//! A checkpoint is data: opcodes and names that tensors do not need are refused by name. Sizes are compared with the
//! file before memory is allocated.

mod parts;
mod pickle;
mod safe;
mod torch_zip;

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use half::{bf16, f16};
use zip::ZipArchive;

use super::ModelError;

/// Reasons for which a checkpoint cannot be read.
#[derive(Debug, thiserror::Error)]
pub(crate) enum WeightFileError {
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

/// Element type of a tensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Dtype {
    F64,
    F32,
    F16,
    Bf16,
    /// Integers of so many bytes.
    Whole(usize),
}

impl Dtype {
    fn of_storage(name: &str) -> Option<Self> {
        Some(match name.strip_suffix("Storage")? {
            "Double" => Self::F64,
            "Float" => Self::F32,
            "Half" => Self::F16,
            "BFloat16" => Self::Bf16,
            "Long" => Self::Whole(8),
            "Int" => Self::Whole(4),
            "Short" => Self::Whole(2),
            "Char" | "Byte" | "Bool" => Self::Whole(1),
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Self::F64 => 8,
            Self::F32 => 4,
            Self::F16 | Self::Bf16 => 2,
            Self::Whole(bytes) => bytes,
        }
    }

    /// True for floating-point types.
    pub(crate) fn is_float(self) -> bool {
        !matches!(self, Self::Whole(_))
    }

    fn floats(self, bytes: &[u8]) -> Vec<f32> {
        let (pairs, quads) = (bytes.as_chunks::<2>().0, bytes.as_chunks::<4>().0);
        match self {
            Self::F64 => bytes.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b) as f32).collect(),
            Self::F32 => quads.iter().map(|b| f32::from_le_bytes(*b)).collect(),
            Self::F16 => pairs.iter().map(|b| f16::from_le_bytes(*b).to_f32()).collect(),
            Self::Bf16 => pairs.iter().map(|b| bf16::from_le_bytes(*b).to_f32()).collect(),
            Self::Whole(_) => Vec::new(),
        }
    }
}

/// Location of bytes in a file: an entry of an archive, or a range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    Entry(usize),
    Range(u64, u64),
}

/// Tensor in a file, not read yet.
#[derive(Clone, Debug)]
pub(crate) struct StoredTensor {
    pub(crate) dtype: Dtype,
    pub(crate) shape: Vec<usize>,
    /// Stride along each axis, elements.
    strides: Vec<usize>,
    /// Offset of the first element, elements.
    offset: usize,
    place: Place,
}

impl StoredTensor {
    /// Builds a tensor, checking that it lies within a storage of `elements`.
    fn new(
        dtype: Dtype,
        (shape, strides, offset): (Vec<usize>, Vec<usize>, usize),
        elements: usize,
        place: Place,
    ) -> Result<Self, String> {
        let reach = || {
            let last = shape.iter().zip(&strides).try_fold(offset, |last, (n, stride)| {
                n.saturating_sub(1).checked_mul(*stride).and_then(|far| last.checked_add(far))
            })?;
            let count = shape.iter().try_fold(1_usize, |n, length| n.checked_mul(*length))?;
            Some((count, if count == 0 { 0 } else { last.checked_add(1)? }))
        };
        match reach() {
            Some((_, end)) if end <= elements => Ok(Self { dtype, shape, strides, offset, place }),
            _ => Err(format!("of shape {shape:?} reaches beyond the {elements} numbers that are stored for it")),
        }
    }

    /// Number of bytes that its storage must have.
    fn end(&self) -> usize {
        let far: usize = self.shape.iter().zip(&self.strides).map(|(n, stride)| n.saturating_sub(1) * stride).sum();
        (self.offset + far + 1) * self.dtype.bytes()
    }

    /// Gathers its values, row-major, from the bytes of its storage.
    fn gather(&self, stored: &[u8]) -> Vec<f32> {
        let count: usize = self.shape.iter().product();
        let (mut dense, mut is_dense) = (1, true);
        for (n, stride) in self.shape.iter().zip(&self.strides).rev() {
            is_dense &= *n == 1 || *stride == dense;
            dense *= n;
        }
        let begin = self.offset * self.dtype.bytes();
        if is_dense {
            return self.dtype.floats(&stored[begin..begin + count * self.dtype.bytes()]);
        }
        let stored = self.dtype.floats(&stored[begin..]);
        let place = |mut i: usize| {
            let mut at = 0;
            for (n, stride) in self.shape.iter().zip(&self.strides).rev() {
                at += i % n * stride;
                i /= n;
            }
            stored[at]
        };
        (0..count).map(place).collect()
    }
}

enum Source {
    Archive(Box<ZipArchive<BufReader<File>>>),
    Flat(File),
}

/// Open checkpoint.
pub(crate) struct WeightFile {
    source: Source,
    pub(crate) tensors: BTreeMap<String, StoredTensor>,
    /// Storage that was read last: tensors may share one.
    last: Option<(Place, Vec<u8>)>,
}

impl WeightFile {
    /// Opens a file and reads its list of tensors, but no values.
    pub(crate) fn open(path: &Path) -> Result<Self, ModelError> {
        let failed = |problem: String| ModelError::Metadata { path: path.into(), problem };
        let file = crate::io::files::open(path).map_err(|e| failed(e.to_string()))?;
        Self::of(file).map_err(|e| failed(e.to_string()))
    }

    fn of(mut file: File) -> Result<Self, WeightFileError> {
        let mut start = [0; 9];
        let read = file.read(&mut start)?;
        file.seek(SeekFrom::Start(0))?;
        let (source, tensors) = if start.starts_with(b"PK\x03\x04") {
            let (archive, tensors) = torch_zip::open(file)?;
            (Source::Archive(Box::new(archive)), tensors)
        } else if read == 9 && start[8] == b'{' {
            let tensors = safe::open(&mut file)?;
            (Source::Flat(file), tensors)
        } else {
            return Err(WeightFileError::Kind);
        };
        Ok(Self { source, tensors, last: None })
    }

    /// Reads the values of a tensor, row-major.
    pub(crate) fn floats(&mut self, name: &str) -> Result<Vec<f32>, WeightFileError> {
        let failed = |problem: String| WeightFileError::Tensor { name: name.into(), problem };
        let tensor = self.tensors.get(name).ok_or_else(|| failed("is not there".into()))?.clone();
        if !tensor.dtype.is_float() {
            return Err(failed("has whole numbers where fractions are expected".into()));
        }
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
        if bytes.len() < tensor.end() {
            return Err(failed("is cut off; the download may be incomplete".into()));
        }
        let floats = tensor.gather(bytes);
        match floats.iter().position(|v| !v.is_finite()) {
            Some(i) => Err(failed(format!("has {} at place {i}; the file is damaged", floats[i]))),
            None => Ok(floats),
        }
    }
}
