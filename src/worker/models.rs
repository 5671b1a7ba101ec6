//! Neural networks as the window lists them: which are installed, and which engine runs them.

pub use crate::models::catalogue::{Entry as ModelEntry, Role as ModelRole, SAM2, State as ModelState};
use crate::models::catalogue::{entries, folder};
use crate::models::engine::engine;

/// Engine and models of this machine.
#[derive(Clone, Debug)]
pub struct ModelList {
    /// What runs them, and where.
    pub engine: String,
    /// What is wrong with it, or could be better.
    pub note: Option<String>,
    /// All models of the catalog.
    pub models: Vec<(ModelEntry, ModelState)>,
}

impl ModelList {
    /// Looks them up: reads and verifies files, so not for the window's thread.
    pub fn look() -> Self {
        let (engine, mut note) = match engine() {
            Ok(engine) => (format!("{}, {}", engine.name(), engine.device()), engine.note().map(str::to_owned)),
            Err(e) => ("none".to_owned(), Some(e.to_string())),
        };
        let folder = folder();
        let models = entries().unwrap_or_else(|e| {
            note = Some(e.to_string());
            Vec::new()
        });
        Self { engine, note, models: models.into_iter().map(|e| (e.clone(), e.state(&folder))).collect() }
    }
}
