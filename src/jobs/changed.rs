//! Differences between a scene and its photos: removed things, and edits.

use super::photos_without::is_without;
use super::{JobError, Scene};
use crate::io::semantic_map;
use crate::jobs::find_objects::removed_names;
use crate::pipeline::observer::Severity;
use crate::pipeline::semantics::lifting::removed::RemovedThings;
use crate::render::{RenderSettings, Renderer};
use crate::scene::{Camera, Dataset, PhotoPixels};

/// Differences between a scene and its photos.
#[derive(Clone, Debug, Default)]
pub(crate) struct ChangedScene {
    /// Names of removed things; `removed` holds their Gaussians, if those are known.
    names: Vec<String>,
    removed: Option<RemovedThings>,
    edited: bool,
}

impl ChangedScene {
    /// Differences between a scene and its photos, which may be made without the removed things.
    pub(crate) fn of(scene: &Scene, photos: &Dataset) -> Self {
        let (names, removed) = match &scene.folder {
            Some(folder) if !is_without(&photos.root) => semantic_map::removed_of(folder),
            _ => Default::default(),
        };
        let removed = removed.map(|removed| RemovedThings::new(&scene.cloud, &removed));
        Self { names, removed, edited: scene.edited }
    }

    /// Returns a report in words, if anything differs.
    pub(crate) fn notice(&self) -> Option<(Severity, String)> {
        let names = removed_names(&self.names);
        let removed = match (self.names.is_empty(), &self.removed) {
            (true, None) => None,
            (_, Some(_)) => Some((
                Severity::Info,
                format!("The photos still show what was removed ({names}): their pixels of it are left out"),
            )),
            (false, None) => Some((
                Severity::Warning,
                format!("The photos still show what was removed ({names}): that counts as an error of the scene"),
            )),
        };
        let edited = self.edited.then(|| {
            let text =
                "The scene was edited after it was trained and its photos were not: each change counts as an error";
            (Severity::Warning, text.to_owned())
        });
        match (removed, edited) {
            (Some((_, removed)), Some((severity, edited))) => Some((severity, format!("{removed}. {edited}"))),
            (removed, edited) => removed.or(edited),
        }
    }

    /// Leaves out the pixels of a photo that show removed things.
    pub(crate) fn leave_out(
        &self,
        pixels: &mut PhotoPixels,
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Result<(), JobError> {
        let Some(removed) = &self.removed else { return Ok(()) };
        let shown = removed.shows(&mut Renderer::new(), camera, settings)?;
        let coverage = pixels.coverage.get_or_insert_with(|| vec![u8::MAX; shown.len()]);
        coverage.iter_mut().zip(shown).filter(|(_, shown)| *shown).for_each(|(c, _)| *c = 0);
        Ok(())
    }
}
