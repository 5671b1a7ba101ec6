//! A network: named arrays in, named arrays out.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use ort::session::{Session, SessionInputValue};

use super::ModelError;
use super::session_cache::{self, CachedSession};

/// Numbers with a shape, row-major.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tensor<T = f32> {
    /// Length of each axis.
    pub shape: Vec<usize>,
    /// As many numbers as the axes' product.
    pub values: Vec<T>,
}

impl<T: Clone> Tensor<T> {
    /// An array; its numbers have to fill its shape.
    pub fn new(shape: &[usize], values: Vec<T>) -> Self {
        debug_assert_eq!(shape.iter().product::<usize>(), values.len(), "{shape:?}");
        Self { shape: shape.to_vec(), values }
    }

    /// The same number everywhere.
    pub fn filled(shape: &[usize], value: T) -> Self {
        Self { shape: shape.to_vec(), values: vec![value; shape.iter().product()] }
    }

    /// Arrays of one shape one after another along their first axis.
    pub fn joined<'a>(parts: impl IntoIterator<Item = &'a Self>) -> Self
    where
        T: 'a,
    {
        let mut joined: Option<Self> = None;
        for part in parts {
            match &mut joined {
                None => joined = Some(part.clone()),
                Some(all) => {
                    all.shape[0] += part.shape[0];
                    all.values.extend_from_slice(&part.values);
                }
            }
        }
        joined.unwrap_or_else(|| Self { shape: vec![0], values: Vec::new() })
    }

    /// The `i`-th piece along the first axis, which stays, with length 1.
    pub fn row(&self, i: usize) -> Self {
        let n = self.values.len() / self.shape[0].max(1);
        let mut shape = self.shape.clone();
        shape[0] = 1;
        Self { shape, values: self.values[i * n..(i + 1) * n].to_vec() }
    }
}

pub(crate) enum NetworkInput {
    Floats(Tensor<f32>),
    Ints(Tensor<i64>),
}

impl From<Tensor<f32>> for NetworkInput {
    fn from(array: Tensor<f32>) -> Self {
        Self::Floats(array)
    }
}

impl From<&Tensor<f32>> for NetworkInput {
    fn from(array: &Tensor<f32>) -> Self {
        Self::Floats(array.clone())
    }
}

impl From<Tensor<i64>> for NetworkInput {
    fn from(array: Tensor<i64>) -> Self {
        Self::Ints(array)
    }
}

/// What comes out of a network, by name.
#[derive(Clone, Debug, Default)]
pub(crate) struct Outputs {
    model: String,
    arrays: BTreeMap<String, Tensor<f32>>,
}

impl Outputs {
    pub(crate) fn take(&mut self, name: &str) -> Result<Tensor<f32>, ModelError> {
        self.arrays.remove(name).ok_or_else(|| ModelError::NoOutput { model: self.model.clone(), output: name.into() })
    }
}

type Reopen = Box<dyn Fn() -> Result<Session, ModelError> + Send + Sync>;

pub(crate) struct Network {
    place: Arc<Mutex<CachedSession>>,
    name: String,
    /// What opens its file again, if it has one; without, it stays open.
    reopen: Option<Reopen>,
}

impl Network {
    /// Of a session, with the file name for messages.
    pub(super) fn new(session: Session, name: &str) -> Self {
        Self { place: CachedSession::of(session), name: name.into(), reopen: None }
    }

    /// The same, known to lie in a file that `reopen` opens: it may be closed where memory is short.
    pub(super) fn in_file(self, reopen: impl Fn() -> Result<Session, ModelError> + Send + Sync + 'static) -> Self {
        session_cache::register(&self.place);
        Self { reopen: Some(Box::new(reopen)), ..self }
    }

    /// Runs it. Every number that comes out is finite.
    pub(crate) fn run(&mut self, inputs: Vec<(&'static str, NetworkInput)>) -> Result<Outputs, ModelError> {
        let name = self.name.clone();
        // A panic while it ran leaves a session that runs again.
        let mut place = self.place.lock().unwrap_or_else(PoisonError::into_inner);
        if let (None, Some(reopen)) = (&place.session, &self.reopen) {
            place.session = Some(reopen()?);
        }
        place.used = Instant::now();
        let Some(session) = &mut place.session else {
            return Err(ModelError::Run { model: name, problem: "it is closed".into() });
        };
        let failed = |e: ort::Error| ModelError::Run { model: name.clone(), problem: e.to_string() };
        let mut given: Vec<(&'static str, SessionInputValue<'_>)> = Vec::with_capacity(inputs.len());
        for (input, value) in inputs {
            let value: SessionInputValue<'_> = match value {
                NetworkInput::Floats(a) => tensor(a).map_err(failed)?,
                NetworkInput::Ints(a) => tensor(a).map_err(failed)?,
            };
            given.push((input, value));
        }
        for (input, value) in &given {
            let shape = value.shape();
            let wanted = session.inputs().iter().find(|i| i.name() == *input).and_then(|i| i.dtype().tensor_shape());
            // Lengths that are left open are below 0. An engine may do worse than fail on another shape.
            let differs = |w: &&ort::value::Shape| {
                w.len() != shape.len() || w.iter().zip(shape.iter()).any(|(w, got)| *w >= 0 && w != got)
            };
            if let Some(wanted) = wanted.filter(differs) {
                let problem = format!("it takes {wanted:?} as '{input}', not {shape:?}; its description does not fit");
                return Err(ModelError::Run { model: name.clone(), problem });
            }
        }
        let outputs = guarded(&name, || session.run(given))
            .map_err(|problem| ModelError::Run { model: name.clone(), problem })?;
        let mut arrays = BTreeMap::new();
        for (output, value) in outputs.iter() {
            let (shape, values) = value.try_extract_tensor::<f32>().map_err(failed)?;
            if let Some(index) = values.iter().position(|v| !v.is_finite()) {
                return Err(ModelError::NotFinite { model: name.clone(), index, value: values[index] });
            }
            let shape = shape.iter().map(|n| usize::try_from(*n).unwrap_or(0)).collect();
            arrays.insert(output.to_owned(), Tensor { shape, values: values.to_vec() });
        }
        Ok(Outputs { model: name.clone(), arrays })
    }

    /// The rows of an output, each scaled to unit length; `length` numbers in each are expected.
    pub(crate) fn unit_rows(
        &mut self,
        inputs: Vec<(&'static str, NetworkInput)>,
        output: &str,
        length: usize,
    ) -> Result<Vec<Vec<f32>>, ModelError> {
        let rows = self.run(inputs)?.take(output)?;
        if length == 0 || rows.shape.last() != Some(&length) {
            let got = rows.shape.last().copied().unwrap_or(0);
            return Err(ModelError::Output { model: self.name.clone(), expected: length, got });
        }
        rows.values.chunks_exact(length).map(|row| unit(row, &self.name)).collect()
    }
}

fn tensor<T>(array: Tensor<T>) -> ort::Result<SessionInputValue<'static>>
where
    T: ort::value::PrimitiveTensorElementType + std::fmt::Debug + Clone + 'static,
{
    let shape: Vec<i64> = array.shape.iter().map(|n| *n as i64).collect();
    Ok(SessionInputValue::from(ort::value::Tensor::from_array((shape, array.values))?))
}

/// What an engine makes of a model; a panic in it is an error as any other.
pub(super) fn guarded<T>(name: &str, work: impl FnOnce() -> ort::Result<T>) -> Result<T, String> {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(done) => done.map_err(|e| e.to_string()),
        Err(_) => Err(format!("the engine gave up on {name}; its file is damaged, or made for another engine")),
    }
}

/// A row scaled to unit length, if it has a direction.
fn unit(values: &[f32], name: &str) -> Result<Vec<f32>, ModelError> {
    // A vector this short has no direction but that of rounding.
    let zero = values.iter().all(|v| v.abs() < 1e-7);
    let unit = crate::math::vector::unit(values).filter(|_| !zero);
    unit.ok_or(ModelError::NotFinite { model: name.into(), index: 0, value: 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_have_a_direction_or_are_refused() {
        assert_eq!(unit(&[3.0, 4.0], "m").expect("sound"), [0.6, 0.8]);
        let huge = unit(&[1e30, 1e30], "m").expect("large numbers are no harm");
        assert!((huge[0] - std::f32::consts::FRAC_1_SQRT_2).abs() < 1e-6);
        for bad in [[1.0, f32::NAN], [f32::INFINITY, 1.0], [0.0, 0.0], [1e-9, 0.0]] {
            assert!(matches!(unit(&bad, "m"), Err(ModelError::NotFinite { .. })), "{bad:?}");
        }
    }

    #[test]
    fn arrays_join_and_part_along_their_first_axis() {
        let (a, b) = (Tensor::new(&[1, 2], vec![1.0, 2.0]), Tensor::new(&[2, 2], vec![3.0, 4.0, 5.0, 6.0]));
        let both = Tensor::joined([&a, &b]);
        assert_eq!((both.shape.as_slice(), both.row(2)), ([3, 2].as_slice(), Tensor::new(&[1, 2], vec![5.0, 6.0])));
        assert_eq!(Tensor::<f32>::joined([]).values.len(), 0);
    }
}
