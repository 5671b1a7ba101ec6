//! Inference engine: an ONNX Runtime library if one is found, otherwise the built-in engine (RTen). Chosen once, at
//! the first use of a network.
//!
//! The library is taken from the path in `FMLGS_ONNXRUNTIME` or `ORT_DYLIB_PATH`, else from the models' folder if it
//! was fetched, the program's own folder, the active Python environment's `onnxruntime` wheel, or the system's
//! library folders. A library that cannot be loaded, or is older than version 1.24, is skipped, and
//! [`Engine::note`] reports it. `FMLGS_DEVICE` chooses the device (`cpu`, `cuda`, `tensorrt`, `coreml`, `directml`);
//! otherwise it is the first of CUDA, Core ML and DirectML that the library offers.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use ort::environment::Environment;
use ort::ep::{CUDA, CoreML, DirectML, ExecutionProvider, ExecutionProviderDispatch, TensorRT};
use ort::session::builder::{GraphOptimizationLevel, SessionBuilder};

use super::manifest::{self, GraphFile};
use super::network::Network;
use super::open_network::{OpenNetwork, guarded};
use super::{ModelError, folder, session_cache};
use crate::scene::resource_log::{self, ResourceKind};

/// Description of the fetched library.
const LIBRARY: &str = "onnxruntime.json";

const MODEL_USE: &str = "its first use";

pub(crate) struct Engine {
    /// Environment of ONNX Runtime; the built-in engine needs none.
    environment: Option<Environment>,
    name: String,
    device: Option<Device>,
    note: Option<String>,
}

/// Devices of ONNX Runtime other than the processor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Device {
    Cuda,
    TensorRt,
    CoreMl,
    DirectMl,
}

impl Device {
    /// Devices in the order of trial; TensorRT only on request, because preparing a network takes minutes.
    const TRIED: [Self; 3] = [Self::Cuda, Self::CoreMl, Self::DirectMl];

    fn named(name: &str) -> Option<Self> {
        let all = [Self::Cuda, Self::TensorRt, Self::CoreMl, Self::DirectMl];
        all.into_iter().find(|d| d.text().replace(' ', "").eq_ignore_ascii_case(name))
    }

    fn text(self) -> &'static str {
        match self {
            Self::Cuda => "CUDA",
            Self::TensorRt => "TensorRT",
            Self::CoreMl => "Core ML",
            Self::DirectMl => "DirectML",
        }
    }

    fn is_offered(self) -> bool {
        let offered = match self {
            Self::Cuda => CUDA::is_available(),
            Self::TensorRt => TensorRT::is_available(),
            Self::CoreMl => CoreML::is_available(),
            Self::DirectMl => DirectML::is_available(),
        };
        offered.unwrap_or(false)
    }

    fn provider(self) -> ExecutionProviderDispatch {
        match self {
            Self::Cuda => CUDA::default().build(),
            Self::TensorRt => TensorRT::default().build(),
            Self::CoreMl => CoreML::default().build(),
            Self::DirectMl => DirectML::default().build(),
        }
        .error_on_failure()
    }
}

static CHOSEN: OnceLock<Result<Engine, (String, String)>> = OnceLock::new();

/// Name of the built-in engine.
const BUILT_IN: &str = "RTen (built in)";

/// Engine that runs networks, or would if one were used now.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct EngineFacts {
    pub(crate) name: String,
    /// Device, for display.
    pub(crate) device: &'static str,
    /// Warning about a requested library or device that is not used.
    pub(crate) note: Option<String>,
    /// True if it is ONNX Runtime.
    pub(crate) is_fast: bool,
    /// True if the choice is final: it stays until the program ends.
    pub(crate) is_settled: bool,
}

/// Returns the engine without settling on the built-in one: a library fetched before the first use still counts.
pub(crate) fn facts() -> Result<EngineFacts, ModelError> {
    if CHOSEN.get().is_none() && library().is_none() {
        let name = BUILT_IN.to_owned();
        return Ok(EngineFacts { name, device: "processor", note: None, is_fast: false, is_settled: false });
    }
    let engine = engine()?;
    let note = engine.note().map(str::to_owned);
    let (name, device) = (engine.name().to_owned(), engine.device());
    Ok(EngineFacts { name, device, note, is_fast: engine.is_fast(), is_settled: true })
}

/// Returns the engine of this process; the first call chooses it.
pub(crate) fn engine() -> Result<&'static Engine, ModelError> {
    let chosen = CHOSEN.get_or_init(|| Engine::choose(library()));
    chosen.as_ref().map_err(|(engine, problem)| ModelError::Engine { engine: engine.clone(), problem: problem.clone() })
}

impl GraphFile {
    /// Returns the network in the slot. Loads it from a folder at first use, after checking the file against its
    /// description.
    pub(crate) fn ready<'a>(
        &self,
        slot: &'a mut Option<Network>,
        folder: &Path,
    ) -> Result<&'a mut Network, ModelError> {
        let loaded = match slot.take() {
            Some(network) => network,
            None => {
                self.check(folder)?;
                engine()?.load_file(&folder.join(&self.file))?
            }
        };
        Ok(slot.insert(loaded))
    }
}

/// Chosen library, or the file that cannot be used with the reason.
type Library = Result<PathBuf, (PathBuf, String)>;

/// Finds the path of an ONNX Runtime library; an explicitly set path is not checked.
fn library() -> Option<Library> {
    let var = |name: &str| std::env::var_os(name).filter(|p| !p.is_empty()).map(PathBuf::from);
    if let Some(path) = var("FMLGS_ONNXRUNTIME").or_else(|| var("ORT_DYLIB_PATH")) {
        // An explicit "none" keeps the built-in engine, whatever is installed.
        return Some(path).filter(|p| p.as_os_str() != "none").map(Ok);
    }
    if let Some(fetched) = fetched(&folder()) {
        return Some(fetched);
    }
    let own = std::env::current_exe().ok().and_then(|p| p.parent().map(Path::to_path_buf));
    let wheels = ["VIRTUAL_ENV", "CONDA_PREFIX"].into_iter().filter_map(var).flat_map(|p| wheel_folders(&p));
    let system =
        ["/usr/local/lib", "/usr/lib", "/usr/lib/x86_64-linux-gnu", "/usr/lib/aarch64-linux-gnu", "/opt/homebrew/lib"];
    let folders = own.into_iter().chain(wheels).chain(system.map(PathBuf::from));
    folders.filter_map(|folder| library_in(&folder)).next().map(Ok)
}

/// Returns the library that was fetched into the models' folder, if it matches its description.
fn fetched(folder: &Path) -> Option<Library> {
    let description = folder.join(LIBRARY);
    if !description.is_file() {
        return None;
    }
    let library = manifest::graphs(&description).and_then(|files| {
        files.iter().try_for_each(|file| file.check(folder))?;
        Ok(files.first().map(|file| folder.join(&file.file)))
    });
    library.map_err(|e| (description, e.to_string())).transpose()
}

/// Folders of a Python environment that may hold the library of its `onnxruntime` package.
fn wheel_folders(environment: &Path) -> Vec<PathBuf> {
    let inside = |site: PathBuf| site.join("site-packages").join("onnxruntime").join("capi");
    let pythons = std::fs::read_dir(environment.join("lib")).into_iter().flatten().flatten().map(|e| e.path());
    let pythons = pythons.filter(|p| p.file_name().is_some_and(|n| n.to_string_lossy().starts_with("python")));
    pythons.map(inside).chain([inside(environment.join("Lib"))]).collect()
}

/// Finds the library in a folder: by its plain name, or with a version as in wheels.
pub(super) fn library_in(folder: &Path) -> Option<PathBuf> {
    let plain = format!("{}onnxruntime{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let exact = folder.join(&plain);
    if exact.is_file() {
        return Some(exact);
    }
    let versioned = |name: &str| {
        name.starts_with(&format!("{plain}.")) || (name.starts_with("libonnxruntime.") && name.ends_with(".dylib"))
    };
    let mut found: Vec<PathBuf> = std::fs::read_dir(folder).ok()?.flatten().map(|e| e.path()).collect();
    found.retain(|p| p.file_name().is_some_and(|n| versioned(&n.to_string_lossy())));
    found.sort();
    found.pop()
}

impl Engine {
    fn choose(library: Option<Library>) -> Result<Self, (String, String)> {
        let mut note = None;
        let opened = library.map(|library| {
            let path = library?;
            loaded(&path).map(|builder| (builder, path.clone())).map_err(|problem| (path, problem))
        });
        let (environment, name) = match opened {
            Some(Ok((builder, path))) => {
                let name = format!("ONNX Runtime ({})", path.display());
                let environment = builder.build().map_err(|e| (name.clone(), e.to_string()))?;
                (Some(environment), name)
            }
            other => {
                if let Some(Err((path, problem))) = other {
                    note = Some(format!(
                        "the built-in engine runs the models, because the ONNX Runtime library {} is of no use: \
                         {problem}; fetch it ('fmlgs models fetch onnxruntime'), set FMLGS_ONNXRUNTIME to a library of \
                         version 1.24 or later, or to 'none'",
                        path.display()
                    ));
                }
                (None, BUILT_IN.to_owned())
            }
        };
        let wanted = std::env::var("FMLGS_DEVICE").unwrap_or_default();
        let device = match (environment.is_some(), wanted.as_str()) {
            (false, _) | (true, "cpu") => None,
            (true, "") => Device::TRIED.into_iter().find(|d| d.is_offered()),
            (true, name) => {
                let device = Device::named(name).filter(|d| d.is_offered());
                if device.is_none() {
                    note = Some(format!(
                        "FMLGS_DEVICE is '{name}', which this ONNX Runtime does not offer; the processor computes"
                    ));
                }
                device
            }
        };
        Ok(Self { environment, name, device, note })
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// True if it is ONNX Runtime.
    pub(crate) fn is_fast(&self) -> bool {
        self.environment.is_some()
    }

    pub(crate) fn device(&self) -> &'static str {
        self.device.map_or("processor", Device::text)
    }

    /// Warning about a requested library or device that is not used.
    pub(crate) fn note(&self) -> Option<&str> {
        self.note.as_deref()
    }

    pub(crate) fn load(&self, bytes: &[u8], name: &str) -> Result<Network, ModelError> {
        resource_log::record(ResourceKind::Model, format!("network {name}"), MODEL_USE, bytes.len() as u64);
        let session = match &self.environment {
            Some(environment) => self.prepare(environment, name, |builder| builder.commit_from_memory(bytes)),
            None => guarded(|| OpenNetwork::built_in(bytes)),
        };
        Ok(Network::new(session.map_err(|problem| self.refused(name, problem))?, name))
    }

    pub(crate) fn load_file(&self, path: &Path) -> Result<Network, ModelError> {
        let file = path.to_path_buf();
        let network = Network::new(self.session(path)?, &path.display().to_string());
        Ok(network.in_file(move || engine()?.session(&file)))
    }

    /// Opens a session of a network file, closing idle networks if memory is short.
    pub(super) fn session(&self, path: &Path) -> Result<OpenNetwork, ModelError> {
        let bytes = std::fs::metadata(path).map_or(0, |m| m.len());
        let name = path.display().to_string();
        resource_log::record(ResourceKind::Model, format!("network {name}"), MODEL_USE, bytes);
        session_cache::make(bytes);
        let session = match &self.environment {
            Some(environment) => self.prepare(environment, &name, |builder| builder.commit_from_file(path)),
            None => guarded(|| OpenNetwork::built_in_file(path)),
        };
        session.map_err(|problem| self.refused(&name, problem))
    }

    fn refused(&self, name: &str, problem: String) -> ModelError {
        let engine = if self.is_fast() { "ONNX Runtime" } else { "built-in" };
        ModelError::Load { model: name.into(), engine, problem }
    }

    fn prepare(
        &self,
        environment: &Environment,
        name: &str,
        commit: impl Fn(&mut SessionBuilder) -> ort::Result<ort::session::Session>,
    ) -> Result<OpenNetwork, String> {
        let load = |device: Option<Device>| -> ort::Result<ort::session::Session> {
            let builder = ort::session::Session::builder(environment)?;
            let mut builder = builder.with_optimization_level(GraphOptimizationLevel::Level3)?;
            if let Some(device) = device {
                builder = builder.with_execution_providers([device.provider()])?;
            }
            commit(&mut builder)
        };
        // If a device refuses a network, the processor runs it, and the resource log says so.
        let refused = |device: Device, e: ort::Error| {
            let what = format!("network {name}, on the processor, because {} refused it: {e}", device.text());
            resource_log::record(ResourceKind::Model, what, MODEL_USE, 0);
            load(None)
        };
        let loaded = || match self.device {
            Some(device) => load(Some(device)).or_else(|e| refused(device, e)),
            None => load(None),
        };
        guarded(|| loaded().map(OpenNetwork::Runtime).map_err(|e| e.to_string()))
    }
}

fn loaded(path: &Path) -> Result<ort::environment::EnvironmentBuilder, String> {
    // The loader's own message about a missing file is unclear.
    if path.is_absolute() && !path.is_file() {
        return Err("there is no such file".into());
    }
    ort::init_from(path).map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_engine_starts_and_refuses_what_is_no_model() {
        let engine = engine().expect("an engine");
        assert!(!engine.name().is_empty() && !engine.device().is_empty());
        assert!(matches!(engine.load(b"not a model", "x.onnx"), Err(ModelError::Load { .. })));
        let missing = engine.load_file(Path::new("/nowhere/x.onnx"));
        assert!(matches!(missing, Err(ModelError::Load { model, .. }) if model.contains("x.onnx")));
    }

    #[test]
    fn a_library_that_is_not_there_is_refused() {
        let problem = loaded(Path::new("/nowhere/libonnxruntime.so")).err().expect("an error");
        assert!(problem.contains("no such file"), "{problem}");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn libraries_are_found_by_their_plain_name_and_inside_wheels() {
        let root = tempfile::tempdir().expect("folder");
        let capi = root.path().join("lib/python3.11/site-packages/onnxruntime/capi");
        std::fs::create_dir_all(&capi).expect("made");
        assert_eq!(wheel_folders(root.path())[0], capi);
        assert_eq!(library_in(&capi), None);
        for name in ["libonnxruntime.so.1.24.1", "libonnxruntime.so.1.25.0", "libonnxruntime_providers_shared.so"] {
            std::fs::write(capi.join(name), "").expect("written");
        }
        assert_eq!(library_in(&capi), Some(capi.join("libonnxruntime.so.1.25.0")));
        std::fs::write(capi.join("libonnxruntime.so"), "").expect("written");
        assert_eq!(library_in(&capi), Some(capi.join("libonnxruntime.so")));
    }

    #[test]
    fn devices_have_names() {
        assert_eq!((Device::named("cuda"), Device::named("CoreML")), (Some(Device::Cuda), Some(Device::CoreMl)));
        assert_eq!(Device::named("abacus"), None);
    }
}
