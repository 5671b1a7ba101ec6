//! What runs networks: an ONNX Runtime library where there is one, the built-in engine (tract)
//! otherwise. Chosen once, at the first use of a network.
//!
//! A library is taken from the path in `ORT_DYLIB_PATH`, else from the program's own folder
//! (`libonnxruntime.so`, `onnxruntime.dll`, `libonnxruntime.dylib`). One that cannot be loaded, or is
//! older than version 1.24, is left aside, and [`Engine::note`] says so.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use ort::environment::Environment;
use ort::session::Session;
use ort::session::builder::GraphOptimizationLevel;
use ort::value::Tensor;

use super::ModelError;

/// What runs networks in this process.
pub struct Engine {
    environment: Environment,
    name: String,
    note: Option<String>,
}

static CHOSEN: OnceLock<Result<Engine, (String, String)>> = OnceLock::new();

/// The engine of this process; the first call chooses it.
pub fn engine() -> Result<&'static Engine, ModelError> {
    let chosen = CHOSEN.get_or_init(|| Engine::choose(library()));
    chosen.as_ref().map_err(|(engine, problem)| ModelError::Engine { engine: engine.clone(), problem: problem.clone() })
}

/// Where an ONNX Runtime library is, or is said to be.
fn library() -> Option<PathBuf> {
    if let Some(path) = std::env::var_os("ORT_DYLIB_PATH").filter(|p| !p.is_empty()) {
        return Some(path.into());
    }
    let file = format!("{}onnxruntime{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    Some(std::env::current_exe().ok()?.parent()?.join(file)).filter(|p| p.is_file())
}

impl Engine {
    fn choose(library: Option<PathBuf>) -> Result<Self, (String, String)> {
        let mut note = None;
        let (builder, name) = match library.map(|path| (loaded(&path), path)) {
            Some((Ok(builder), path)) => (builder, format!("ONNX Runtime ({})", path.display())),
            other => {
                if let Some((Err(problem), path)) = other {
                    note = Some(format!(
                        "the built-in engine runs the models, because the ONNX Runtime library {} is of no use: \
                         {problem}; unset ORT_DYLIB_PATH or set it to a library of version 1.24 or later",
                        path.display()
                    ));
                }
                ort::set_api(ort_tract::api());
                (ort::init(), "tract (built in)".to_owned())
            }
        };
        let environment = builder.build().map_err(|e| (name.clone(), e.to_string()))?;
        Ok(Self { environment, name, note })
    }

    /// Which engine it is, for people.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Why a library that was named is not used.
    pub fn note(&self) -> Option<&str> {
        self.note.as_deref()
    }

    /// Prepares a network.
    pub fn load(&self, bytes: &[u8], name: &str) -> Result<Network, ModelError> {
        // Not asked to optimise, the built-in engine prepares nothing and is ten times slower.
        let load = || -> ort::Result<Session> {
            let builder = Session::builder(&self.environment)?;
            builder.with_optimization_level(GraphOptimizationLevel::Level3)?.commit_from_memory(bytes)
        };
        let session = load().map_err(|e| ModelError::Load { model: name.into(), problem: e.to_string() })?;
        Ok(Network { session, name: name.into() })
    }
}

/// Loads an ONNX Runtime library.
fn loaded(path: &Path) -> Result<ort::environment::EnvironmentBuilder, String> {
    // A missing file would make the loader's own message a riddle.
    if path.is_absolute() && !path.is_file() {
        return Err("there is no such file".into());
    }
    ort::init_from(path).map_err(|e| e.to_string())
}

/// A network that takes one input and gives one vector.
pub struct Network {
    session: Session,
    name: String,
}

impl Network {
    /// Runs it on an input of this shape; `length` numbers are expected, scaled to unit length.
    pub fn unit_vector<T>(&mut self, shape: Vec<i64>, input: Vec<T>, length: usize) -> Result<Vec<f32>, ModelError>
    where
        T: ort::value::PrimitiveTensorElementType + std::fmt::Debug + Clone + 'static,
    {
        let name = self.name.clone();
        let failed = |e: ort::Error| ModelError::Run { model: name.clone(), problem: e.to_string() };
        let tensor = Tensor::from_array((shape, input)).map_err(failed)?;
        let outputs = self.session.run(ort::inputs![tensor]).map_err(failed)?;
        let (_, values) = outputs[0].try_extract_tensor::<f32>().map_err(failed)?;
        unit(values, length, &self.name)
    }
}

/// Values scaled to unit length, if they are numbers and have a direction.
fn unit(values: &[f32], length: usize, name: &str) -> Result<Vec<f32>, ModelError> {
    if values.len() != length {
        return Err(ModelError::Output { model: name.into(), expected: length, got: values.len() });
    }
    if let Some(index) = values.iter().position(|v| !v.is_finite()) {
        return Err(ModelError::NotFinite { model: name.into(), index, value: values[index] });
    }
    // A vector this short has no direction but that of rounding.
    let zero = values.iter().all(|v| v.abs() < 1e-7);
    let unit = crate::math::vector::unit(values).filter(|_| !zero);
    unit.ok_or(ModelError::NotFinite { model: name.into(), index: 0, value: 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_are_checked() {
        assert_eq!(unit(&[3.0, 4.0], 2, "m").expect("sound"), [0.6, 0.8]);
        let huge = unit(&[1e30, 1e30], 2, "m").expect("large numbers are no harm");
        assert!((huge[0] - std::f32::consts::FRAC_1_SQRT_2).abs() < 1e-6);
        assert!(matches!(unit(&[1.0], 2, "m"), Err(ModelError::Output { expected: 2, got: 1, .. })));
        assert!(matches!(unit(&[1.0, f32::NAN], 2, "m"), Err(ModelError::NotFinite { index: 1, .. })));
        assert!(matches!(unit(&[f32::INFINITY, 1.0], 2, "m"), Err(ModelError::NotFinite { index: 0, .. })));
        assert!(matches!(unit(&[0.0, 0.0], 2, "m"), Err(ModelError::NotFinite { .. })));
    }

    #[test]
    fn an_engine_starts_and_refuses_what_is_no_model() {
        let engine = engine().expect("an engine");
        assert!(!engine.name().is_empty());
        let refused = engine.load(b"not a model", "x.onnx");
        assert!(matches!(refused, Err(ModelError::Load { .. })));
    }

    #[test]
    fn a_library_that_is_not_there_is_refused() {
        let problem = loaded(Path::new("/nowhere/libonnxruntime.so")).err().expect("an error");
        assert!(problem.contains("no such file"), "{problem}");
    }
}
