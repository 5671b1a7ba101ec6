//! Training settings as a TOML file, to be kept, edited and used for another scene.

use std::path::Path;

use crate::io::{IoError, atomic, files};
use crate::pipeline::train::TrainConfig;

/// File name of the training settings in a scene's folder.
const FILE: &str = "training.toml";
/// Largest file that is read.
const MAX_BYTES: u64 = 1 << 16;

/// Returns the settings as TOML, a line each. Automatic ones are left out.
pub(crate) fn text(config: &TrainConfig) -> String {
    // Numbers, booleans and plain words are written alike in JSON and in TOML.
    let known = fields(config).into_iter().filter(|(_, value)| !value.is_null());
    known.map(|(name, value)| format!("{name} = {value}\n")).collect()
}

/// Reads settings; those that are missing in the file have their defaults.
///
/// # Errors
/// If the file cannot be read, is not TOML, or has an unknown setting.
pub(crate) fn read(path: &Path) -> Result<TrainConfig, IoError> {
    let bytes = files::read(path, MAX_BYTES)?;
    let broken = |place: &str, reason: String| IoError::Syntax { path: path.into(), place: place.into(), reason };
    let text =
        std::str::from_utf8(files::without_mark(&bytes, path)?).map_err(|e| broken("the text", e.to_string()))?;
    let table: toml::Table = toml::from_str(text).map_err(|e| broken("the settings", e.to_string()))?;
    let known = fields(&TrainConfig::default());
    if let Some(name) = table.keys().find(|name| !known.contains_key(*name)) {
        let names = known.keys().cloned().collect::<Vec<_>>().join(", ");
        return Err(broken(&format!("'{name}'"), format!("unknown setting; known are {names}")));
    }
    table.try_into().map_err(|e: toml::de::Error| broken("the settings", e.to_string()))
}

/// Writes the settings into the folder of their trained scene.
///
/// # Errors
/// If the file cannot be written.
pub(crate) fn keep(folder: &Path, config: &TrainConfig) -> Result<(), IoError> {
    atomic::write(&folder.join(FILE), |w| w.write_all(text(config).as_bytes()))
}

fn fields(config: &TrainConfig) -> serde_json::Map<String, serde_json::Value> {
    match serde_json::to_value(config) {
        Ok(serde_json::Value::Object(fields)) => fields,
        _ => serde_json::Map::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::BackendChoice;

    #[test]
    fn settings_come_back_as_they_were_kept() {
        let folder = tempfile::tempdir().expect("folder");
        let config = TrainConfig {
            steps: 123,
            coarse_share: 0.25,
            max_gaussians: Some(9),
            backend: BackendChoice::Cpu,
            checkpoint_secs: 1e-7,
            ..TrainConfig::default()
        };
        for config in [config, TrainConfig::default()] {
            keep(folder.path(), &config).expect("kept");
            assert_eq!(read(&folder.path().join(FILE)).expect("read"), config, "{}", text(&config));
        }
    }

    #[test]
    fn slips_are_refused_by_name() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("fast.toml");
        let of = |text: &str| {
            std::fs::write(&path, text).expect("written");
            read(&path).map_err(|e| e.to_string())
        };
        let fast = of("# a preset\nsteps = 500\ncheckpoint_secs = 9\n").expect("a part of them");
        assert_eq!(fast, TrainConfig { steps: 500, checkpoint_secs: 9.0, ..TrainConfig::default() });
        for (text, named) in [("step = 5", "'step'"), ("steps = \"many\"", "steps"), ("steps", "settings")] {
            let error = of(text).expect_err(text);
            assert!(error.contains("fast.toml") && error.contains(named), "{error}");
        }
    }
}
