//! Reader of safetensors files, tensor by tensor.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};

use safetensors::tensor::Metadata;

use super::WeightFileError;
use super::tensor::{Dtype, StoragePlace, StoredTensor};

/// Largest header, bytes; those of official files have about 100 kB.
const MOST_HEADER: u64 = 16 << 20;

type Result<T> = std::result::Result<T, WeightFileError>;

/// Reads the header: the tensors of a file.
pub(super) fn open(file: &mut File) -> Result<BTreeMap<String, StoredTensor>> {
    let broken = |problem: String| WeightFileError::Safetensors(problem);
    let bytes = file.metadata()?.len();
    let mut header = vec![0; 8];
    file.read_exact(&mut header)?;
    let stated = header.iter().rev().fold(0_u64, |n, b| n << 8 | u64::from(*b));
    if stated > MOST_HEADER || stated + 8 > bytes {
        return Err(broken(format!("it states {stated} bytes, in a file of {bytes}")));
    }
    file.take(stated).read_to_end(&mut header)?;
    // The crate's own check needs the whole file in memory.
    let metadata: Metadata = serde_json::from_slice(&header[8..]).map_err(|e| broken(e.to_string()))?;
    let (start, bytes) = (8 + stated, bytes - 8 - stated);
    let covered = metadata.tensors().values().map(|info| info.data_offsets.1 as u64).max().unwrap_or(0);
    if covered != bytes {
        return Err(broken(format!("it states {covered} bytes of numbers, and the file has {bytes}")));
    }
    let mut tensors = BTreeMap::new();
    for (name, info) in metadata.tensors() {
        use safetensors::Dtype as Safe;
        let dtype = match info.dtype {
            Safe::F64 => Dtype::F64,
            Safe::F32 => Dtype::F32,
            Safe::F16 => Dtype::F16,
            Safe::BF16 => Dtype::Bf16,
            Safe::U8 | Safe::BOOL => Dtype::Byte,
            other => Dtype::Whole((other.bitsize() / 8).max(1)),
        };
        let failed = |problem: String| WeightFileError::Tensor { name: name.clone(), problem };
        let (begin, end) = info.data_offsets;
        let length = end.checked_sub(begin).ok_or_else(|| failed(format!("ends at byte {end}, before {begin}")))?;
        let mut strides = vec![1; info.shape.len()];
        for axis in (1..strides.len()).rev() {
            strides[axis - 1] = info.shape[axis].saturating_mul(strides[axis]);
        }
        let place = StoragePlace::Range(start + begin as u64, length as u64);
        let view = (info.shape.clone(), strides, 0);
        let tensor = StoredTensor::new(dtype, view, length / dtype.bytes(), place).map_err(failed)?;
        tensors.insert(name.clone(), tensor);
    }
    Ok(tensors)
}

/// Reads the bytes of a tensor.
pub(super) fn storage(file: &mut File, place: StoragePlace) -> Result<Vec<u8>> {
    let StoragePlace::Range(start, length) = place else { return Ok(Vec::new()) };
    file.seek(SeekFrom::Start(start))?;
    let mut bytes = Vec::new();
    file.take(length).read_to_end(&mut bytes)?;
    Ok(bytes)
}
