//! Network with named input and output arrays.
//!
//! An output with a number that is not finite is an error.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use super::ModelError;
use super::open_network::OpenNetwork;
use super::session_cache::{self, CachedSession};
use super::tensor::{NetworkInput, Tensor};

/// Outputs of a network, by name.
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

type Reopen = Box<dyn Fn() -> Result<OpenNetwork, ModelError> + Send + Sync>;

pub(crate) struct Network {
    place: Arc<Mutex<CachedSession>>,
    name: String,
    /// Opens its file again. A network without a file stays open.
    reopen: Option<Reopen>,
}

impl Network {
    /// Wraps a session; `name` is its file name for messages.
    pub(super) fn new(session: OpenNetwork, name: &str) -> Self {
        Self { place: CachedSession::of(session), name: name.into(), reopen: None }
    }

    /// Registers a network in a file that `reopen` opens: it may be closed if memory is short.
    pub(super) fn in_file(self, reopen: impl Fn() -> Result<OpenNetwork, ModelError> + Send + Sync + 'static) -> Self {
        session_cache::register(&self.place);
        Self { reopen: Some(Box::new(reopen)), ..self }
    }

    /// Returns its session, opened again if it was closed.
    fn opened(&self) -> Result<MutexGuard<'_, CachedSession>, ModelError> {
        // A session stays usable after a panic during a run.
        let mut place = self.place.lock().unwrap_or_else(PoisonError::into_inner);
        if let (None, Some(reopen)) = (&place.session, &self.reopen) {
            place.session = Some(reopen()?);
        }
        place.used = Instant::now();
        Ok(place)
    }

    /// Marks the axes of an input that may have any length; empty if unknown.
    pub(super) fn free_axes(&self, input: &str) -> Vec<bool> {
        let shape = self.opened().ok().and_then(|place| place.session.as_ref()?.wanted_shape(input));
        shape.unwrap_or_default().iter().map(Option::is_none).collect()
    }

    /// Runs it. Every output value is finite.
    pub(crate) fn run(&mut self, inputs: Vec<(&'static str, NetworkInput)>) -> Result<Outputs, ModelError> {
        let name = self.name.clone();
        let mut place = self.opened()?;
        let Some(session) = &mut place.session else {
            return Err(ModelError::Run { model: name, problem: "it is closed".into() });
        };
        for (input, value) in &inputs {
            let shape = value.shape();
            // An engine may crash or compute garbage on another shape.
            let differs = |w: &Vec<Option<usize>>| {
                w.len() != shape.len() || w.iter().zip(shape).any(|(w, got)| w.is_some_and(|w| w != *got))
            };
            if let Some(wanted) = session.wanted_shape(input).filter(differs) {
                let wanted: Vec<String> = wanted.iter().map(|n| n.map_or("any".into(), |n| n.to_string())).collect();
                let wanted = wanted.join(", ");
                let problem = format!("it takes [{wanted}] as '{input}', not {shape:?}; its description does not fit");
                return Err(ModelError::Run { model: name, problem });
            }
        }
        let arrays = session.run(inputs).map_err(|problem| ModelError::Run { model: name.clone(), problem })?;
        for array in arrays.values() {
            if let Some(index) = array.values.iter().position(|v| !v.is_finite()) {
                return Err(ModelError::NotFinite { model: name, index, value: array.values[index] });
            }
        }
        Ok(Outputs { model: name, arrays })
    }

    /// Runs it and returns the rows of an output, of `length` numbers, each scaled to unit length.
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

/// Scales a row to unit length, if it has a direction.
fn unit(values: &[f32], name: &str) -> Result<Vec<f32>, ModelError> {
    // The direction of such a short vector is rounding noise.
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
}
