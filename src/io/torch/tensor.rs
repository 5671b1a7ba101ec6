//! Tensors of a file: their types, and their places in what is stored.

use half::{bf16, f16};

/// Element type of a tensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Dtype {
    F64,
    F32,
    F16,
    Bf16,
    /// Integers of so many bytes, with a sign.
    Whole(usize),
    /// Integers of one byte without sign, and truth values.
    Byte,
}

impl Dtype {
    pub(super) fn of_storage(name: &str) -> Option<Self> {
        Some(match name.strip_suffix("Storage")? {
            "Double" => Self::F64,
            "Float" => Self::F32,
            "Half" => Self::F16,
            "BFloat16" => Self::Bf16,
            "Long" => Self::Whole(8),
            "Int" => Self::Whole(4),
            "Short" => Self::Whole(2),
            "Char" => Self::Whole(1),
            "Byte" | "Bool" => Self::Byte,
            _ => return None,
        })
    }

    pub(super) fn bytes(self) -> usize {
        match self {
            Self::F64 => 8,
            Self::F32 => 4,
            Self::F16 | Self::Bf16 => 2,
            Self::Byte => 1,
            Self::Whole(bytes) => bytes,
        }
    }

    /// True for floating-point types.
    pub(crate) fn is_float(self) -> bool {
        !matches!(self, Self::Whole(_) | Self::Byte)
    }

    pub(super) fn floats(self, bytes: &[u8]) -> Vec<f32> {
        let (pairs, quads) = (bytes.as_chunks::<2>().0, bytes.as_chunks::<4>().0);
        match self {
            Self::F64 => bytes.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b) as f32).collect(),
            Self::F32 => quads.iter().map(|b| f32::from_le_bytes(*b)).collect(),
            Self::F16 => pairs.iter().map(|b| f16::from_le_bytes(*b).to_f32()).collect(),
            Self::Bf16 => pairs.iter().map(|b| bf16::from_le_bytes(*b).to_f32()).collect(),
            Self::Whole(_) | Self::Byte => Vec::new(),
        }
    }

    pub(super) fn integers(self, bytes: &[u8]) -> Vec<i64> {
        match self {
            Self::Byte => bytes.iter().map(|b| i64::from(*b)).collect(),
            Self::Whole(1) => bytes.iter().map(|b| i64::from(*b as i8)).collect(),
            Self::Whole(2) => bytes.as_chunks().0.iter().map(|b| i64::from(i16::from_le_bytes(*b))).collect(),
            Self::Whole(4) => bytes.as_chunks().0.iter().map(|b| i64::from(i32::from_le_bytes(*b))).collect(),
            Self::Whole(8) => bytes.as_chunks().0.iter().map(|b| i64::from_le_bytes(*b)).collect(),
            _ => Vec::new(),
        }
    }
}

/// Location of bytes in a file: an entry of an archive, or a range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum StoragePlace {
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
    pub(super) place: StoragePlace,
    /// Number of elements in its storage.
    elements: usize,
}

impl StoredTensor {
    /// Builds a tensor, checking that it lies within a storage of `elements`.
    pub(super) fn new(
        dtype: Dtype,
        (shape, strides, offset): (Vec<usize>, Vec<usize>, usize),
        elements: usize,
        place: StoragePlace,
    ) -> Result<Self, String> {
        let reach = || {
            let last = shape.iter().zip(&strides).try_fold(offset, |last, (n, stride)| {
                n.saturating_sub(1).checked_mul(*stride).and_then(|far| last.checked_add(far))
            })?;
            let count = shape.iter().try_fold(1_usize, |n, length| n.checked_mul(*length))?;
            Some((count, if count == 0 { 0 } else { last.checked_add(1)? }))
        };
        match reach() {
            Some((_, end)) if end <= elements => Ok(Self { dtype, shape, strides, offset, place, elements }),
            _ => Err(format!("of shape {shape:?} reaches beyond the {elements} numbers that are stored for it")),
        }
    }

    /// Number of its values.
    pub(crate) fn count(&self) -> usize {
        self.shape.iter().product()
    }

    /// Returns whether it has more values than its storage: a stride of zero makes any number of them.
    pub(super) fn repeats(&self) -> bool {
        self.count() > self.elements
    }

    /// Number of bytes that its storage must have.
    pub(super) fn end(&self) -> usize {
        let far: usize = self.shape.iter().zip(&self.strides).map(|(n, stride)| n.saturating_sub(1) * stride).sum();
        if self.count() == 0 { 0 } else { (self.offset + far + 1) * self.dtype.bytes() }
    }

    /// Byte in its storage at which its values begin, if they lie there one after the other.
    pub(super) fn begin(&self) -> Option<usize> {
        let (mut dense, mut is_dense) = (1, true);
        for (n, stride) in self.shape.iter().zip(&self.strides).rev() {
            is_dense &= *n == 1 || *stride == dense;
            dense *= n;
        }
        is_dense.then_some(self.offset * self.dtype.bytes())
    }

    /// Gathers its values, row-major, from the bytes of its storage.
    pub(super) fn gather<T: Copy>(&self, stored: &[u8], of: impl Fn(Dtype, &[u8]) -> Vec<T>) -> Vec<T> {
        let (count, bytes) = (self.count(), self.dtype.bytes());
        if count == 0 {
            return Vec::new();
        }
        if let Some(begin) = self.begin() {
            return of(self.dtype, &stored[begin..begin + count * bytes]);
        }
        let stored = of(self.dtype, &stored[self.offset * bytes..]);
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
