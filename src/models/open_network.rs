//! Network opened by an engine: one interface to its inputs and outputs for both engines.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

use ort::session::SessionInputValue;
use rten_tensor::Layout;

use super::onnx_file;
use super::tensor::{NetworkInput, Tensor};

/// Open network.
pub(super) enum OpenNetwork {
    /// Session of an ONNX Runtime library.
    Runtime(ort::session::Session),
    /// Model of the built-in engine.
    BuiltIn(Box<rten::Model>),
}

impl OpenNetwork {
    /// Opens a network with the built-in engine from the bytes of a file.
    pub(super) fn built_in(bytes: &[u8]) -> Result<Self, String> {
        onnx_file::refuse_cubic(bytes)?;
        Self::of_one_graph(bytes.to_vec())
    }

    /// Opens a network file with the built-in engine.
    pub(super) fn built_in_file(path: &std::path::Path) -> Result<Self, String> {
        Self::of_one_graph(onnx_file::with_one_graph(path)?)
    }

    /// Loads a network with one graph. Weights are not prepacked: that would keep them twice.
    fn of_one_graph(bytes: Vec<u8>) -> Result<Self, String> {
        let model = rten::ModelOptions::with_all_ops().load(bytes).map_err(|e| e.to_string())?;
        Ok(Self::BuiltIn(Box::new(model)))
    }

    /// Lengths of an input's axes, `None` for free ones. `None` if there is no such input, or its shape is not stated.
    pub(super) fn wanted_shape(&self, input: &str) -> Option<Vec<Option<usize>>> {
        match self {
            Self::Runtime(session) => {
                let known = session.inputs().iter().find(|i| i.name() == input)?;
                let shape = known.dtype().tensor_shape()?;
                Some(shape.iter().map(|n| usize::try_from(*n).ok()).collect())
            }
            Self::BuiltIn(model) => {
                let shape = model.node_info(model.find_node(input)?)?.shape()?;
                let length = |axis: rten::Dimension| match axis {
                    rten::Dimension::Fixed(n) => Some(n),
                    rten::Dimension::Symbolic(_) => None,
                };
                Some(shape.into_iter().map(length).collect())
            }
        }
    }

    /// Runs the network and returns its outputs by name. A panic of the engine becomes an error.
    pub(super) fn run(
        &mut self,
        inputs: Vec<(&'static str, NetworkInput)>,
    ) -> Result<BTreeMap<String, Tensor<f32>>, String> {
        match self {
            Self::Runtime(session) => run_runtime(session, inputs),
            Self::BuiltIn(model) => guarded(|| run_built_in(model, inputs)),
        }
    }
}

fn run_runtime(
    session: &mut ort::session::Session,
    inputs: Vec<(&'static str, NetworkInput)>,
) -> Result<BTreeMap<String, Tensor<f32>>, String> {
    fn value<T>(array: Tensor<T>) -> ort::Result<SessionInputValue<'static>>
    where
        T: ort::value::PrimitiveTensorElementType + std::fmt::Debug + Clone + 'static,
    {
        let shape: Vec<i64> = array.shape.iter().map(|n| *n as i64).collect();
        Ok(SessionInputValue::from(ort::value::Tensor::from_array((shape, array.values))?))
    }
    let all = || -> ort::Result<_> {
        let mut given: Vec<(&'static str, SessionInputValue<'_>)> = Vec::with_capacity(inputs.len());
        for (input, array) in inputs {
            let value = match array {
                NetworkInput::Floats(a) => value(a)?,
                NetworkInput::Ints(a) => value(a)?,
            };
            given.push((input, value));
        }
        let mut arrays = BTreeMap::new();
        for (output, value) in session.run(given)?.iter() {
            let (shape, values) = value.try_extract_tensor::<f32>()?;
            let shape = shape.iter().map(|n| usize::try_from(*n).unwrap_or(0)).collect();
            arrays.insert(output.to_owned(), Tensor { shape, values: values.to_vec() });
        }
        Ok(arrays)
    };
    guarded(|| all().map_err(|e| e.to_string()))
}

fn run_built_in(
    model: &rten::Model,
    inputs: Vec<(&'static str, NetworkInput)>,
) -> Result<BTreeMap<String, Tensor<f32>>, String> {
    let mut given: Vec<(rten::NodeId, rten::ValueOrView<'_>)> = Vec::with_capacity(inputs.len());
    for (input, array) in inputs {
        let node = model.find_node(input).ok_or_else(|| format!("it has no input '{input}'"))?;
        let value = match array {
            NetworkInput::Floats(a) => rten::Value::from_shape(&a.shape, a.values).map_err(|e| e.to_string())?,
            NetworkInput::Ints(a) => {
                let narrow = |v: &i64| i32::try_from(*v).map_err(|_| format!("{v} is too large for '{input}'"));
                let values = a.values.iter().map(narrow).collect::<Result<Vec<i32>, String>>()?;
                rten::Value::from_shape(&a.shape, values).map_err(|e| e.to_string())?
            }
        };
        given.push((node, value.into()));
    }
    let outputs = model.run(given, model.output_ids(), None).map_err(|e| e.to_string())?;
    let mut arrays = BTreeMap::new();
    for (node, value) in model.output_ids().iter().zip(outputs) {
        let name = model.node_info(*node).and_then(|info| info.name().map(str::to_owned)).unwrap_or_default();
        let shape = value.shape().to_vec();
        let rten::Value::FloatTensor(tensor) = value else {
            return Err(format!("its output '{name}' has no floating point numbers"));
        };
        arrays.insert(name, Tensor { shape, values: tensor.into_data() });
    }
    Ok(arrays)
}

/// Runs `work` and turns a panic of the engine into an error.
pub(super) fn guarded<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(done) => done,
        Err(_) => Err("the engine gave up on it; the file is damaged, or made for another engine".to_owned()),
    }
}
