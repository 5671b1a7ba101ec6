//! Values of a pickle of tensors, and the global names that it may contain.

use std::sync::Arc;

use super::tensor::Dtype;

/// Value; containers such as lists, tuples and dictionaries are nodes, because they may be shared.
#[derive(Clone, Debug)]
pub(super) enum Value {
    Nothing,
    Bool(bool),
    Int(i64),
    Float(f64),
    Text(Arc<str>),
    Bytes(Arc<[u8]>),
    Node(usize),
}

#[derive(Debug)]
pub(super) enum PickleNode {
    List(Vec<Value>),
    Tuple(Vec<Value>),
    Dict(Vec<(Value, Value)>),
    Global(Global),
    Storage(Storage),
    Tensor(TensorRecord),
    /// TorchScript module, with its attributes once they are known.
    Module(Option<Value>),
    /// Type of NumPy's numbers: `f8`.
    NumpyDtype(Arc<str>),
    /// Array of NumPy, which is not read.
    NumpyArray,
}

/// Global name that is accepted.
#[derive(Clone, Copy, Debug)]
pub(super) enum Global {
    OrderedDict,
    Tensor,
    /// Function that returns its first argument: a parameter, a list with its type.
    First,
    /// Bytes, which Python writes as text of the same code points.
    Latin1,
    /// Settings such as a device, whose value is not needed.
    Setting,
    NumpyScalar,
    NumpyDtype,
    NumpyArray,
    Storage(Dtype),
    Module,
}

impl Global {
    pub(super) fn named(module: &str, name: &str) -> Option<Self> {
        Some(match (module, name) {
            ("collections", "OrderedDict") => Self::OrderedDict,
            ("torch._utils", "_rebuild_tensor_v2") => Self::Tensor,
            ("torch._utils", "_rebuild_parameter" | "_rebuild_parameter_with_state")
            | ("torch", "Size")
            | ("collections", "Counter")
            | (
                "torch.jit._pickle",
                "restore_type_tag" | "build_intlist" | "build_doublelist" | "build_boollist" | "build_tensorlist",
            ) => Self::First,
            ("_codecs", "encode") => Self::Latin1,
            ("numpy.core.multiarray" | "numpy._core.multiarray", "scalar") => Self::NumpyScalar,
            ("numpy.core.multiarray" | "numpy._core.multiarray", "_reconstruct") => Self::NumpyArray,
            ("numpy", "ndarray") => Self::Setting,
            ("numpy", "dtype") => Self::NumpyDtype,
            (
                "torch",
                "device" | "float64" | "float32" | "float16" | "bfloat16" | "int64" | "int32" | "uint8" | "bool",
            ) => Self::Setting,
            ("torch", storage) => Self::Storage(Dtype::of_storage(storage)?),
            (module, _) if module == "__torch__" || module.starts_with("__torch__.") => Self::Module,
            _ => return None,
        })
    }
}

/// Storage of tensors.
#[derive(Clone, Debug)]
pub(super) struct Storage {
    pub(super) key: Arc<str>,
    pub(super) dtype: Dtype,
    pub(super) elements: usize,
}

#[derive(Clone, Debug)]
pub(super) struct TensorRecord {
    pub(super) storage: Arc<str>,
    pub(super) dtype: Dtype,
    /// Number of elements in its storage.
    pub(super) elements: usize,
    pub(super) offset: usize,
    pub(super) shape: Vec<usize>,
    pub(super) strides: Vec<usize>,
}
