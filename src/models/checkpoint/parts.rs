//! What a pickle of tensors is made of, and which names may occur in it.

use std::rc::Rc;

use super::Dtype;

/// A value; lists, tuples, dictionaries and so on lie among the nodes, because they may be shared.
#[derive(Clone, Debug)]
pub(super) enum Value {
    Nothing,
    Int(i64),
    Text(Rc<str>),
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
    /// A module of TorchScript, with its attributes once they are known.
    Module(Option<Value>),
}

/// A name that may occur.
#[derive(Clone, Copy, Debug)]
pub(super) enum Global {
    OrderedDict,
    Tensor,
    /// A function whose value is its first argument: a parameter, a list with its type.
    First,
    Storage(Dtype),
    Module,
}

impl Global {
    pub(super) fn named(module: &str, name: &str) -> Option<Self> {
        Some(match (module, name) {
            ("collections", "OrderedDict") => Self::OrderedDict,
            ("torch._utils", "_rebuild_tensor_v2") => Self::Tensor,
            ("torch._utils", "_rebuild_parameter")
            | (
                "torch.jit._pickle",
                "restore_type_tag" | "build_intlist" | "build_doublelist" | "build_boollist" | "build_tensorlist",
            ) => Self::First,
            ("torch", storage) => Self::Storage(Dtype::of_storage(storage)?),
            (module, _) if module == "__torch__" || module.starts_with("__torch__.") => Self::Module,
            _ => return None,
        })
    }
}

/// The bytes that tensors look at.
#[derive(Clone, Debug)]
pub(super) struct Storage {
    pub(super) key: Rc<str>,
    pub(super) dtype: Dtype,
    pub(super) elements: usize,
}

#[derive(Clone, Debug)]
pub(super) struct TensorRecord {
    pub(super) storage: Rc<str>,
    pub(super) dtype: Dtype,
    /// As many elements does its storage have.
    pub(super) elements: usize,
    pub(super) offset: usize,
    pub(super) shape: Vec<usize>,
    pub(super) strides: Vec<usize>,
}
