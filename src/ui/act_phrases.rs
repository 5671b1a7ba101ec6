//! Actions on phrases and true masks.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::actions::Pane;
use super::app::App;
use super::context::SceneContext;
use super::state::Tone;
use crate::io::splat_format::SplatFormat;
use crate::jobs::export;
use crate::jobs::export_all::{ExportAllRequest, MaskFormat};
use crate::jobs::phrases::{self, PhrasesRequest, TrueMasks};
use crate::jobs::query::write_mask;
use crate::scene::{Camera, LevelFilter};
use crate::worker::{Command, Failure};

/// Longer side of the views that are queried, px.
const SIDE_PX: u32 = 1008;

impl App {
    /// Runs the list of phrases; writes the masks into `to`, if given.
    pub(super) fn run_phrases(&mut self, to: Option<PathBuf>) {
        self.layout.hidden.retain(|p| *p != Pane::Phrases);
        let phrases = match phrases::listed(&self.phrases.text) {
            Ok(phrases) => phrases,
            Err(e) => return self.state.toast(Tone::Warning, e.to_string()),
        };
        let Some(SceneContext { cloud, map: Some(map), settings, scene, .. }) = self.context() else {
            return self.state.toast(Tone::Warning, "Find objects first: queries search among them.");
        };
        let photos = scene.dataset.as_ref().filter(|_| self.phrases.all_photos);
        let views: Vec<(String, Camera)> = match (photos, self.viewport.picture()) {
            (Some(d), _) => d.photos.iter().map(|p| (p.name.clone(), p.camera.limited_to(SIDE_PX))).collect(),
            (None, Some(picture)) => vec![("this view".to_owned(), picture.camera.limited_to(SIDE_PX))],
            (None, None) => return,
        };
        // A true mask belongs to one view only.
        let truth = self.viewport.queries.truth().filter(|_| photos.is_none()).map_or(TrueMasks::None, TrueMasks::Mask);
        let colors = self.viewport.queries.colors_of(&phrases);
        self.submit(Command::Phrases(Box::new(PhrasesRequest {
            cloud: Arc::clone(&cloud),
            map: Arc::clone(&map),
            settings,
            views,
            colors,
            phrases,
            level: LevelFilter::Auto,
            recipe: self.viewport.queries.recipe().clone(),
            top: 1,
            truth,
            export: to,
        })));
    }

    /// Writes every object and part into a folder, and their masks in the photos, if there are any.
    pub(super) fn export_all(&mut self, folder: PathBuf) {
        let Some(SceneContext { cloud, map: Some(map), settings, scene, .. }) = self.context() else {
            return self.state.toast(Tone::Warning, "Find objects first: there is nothing to export yet.");
        };
        let photos = scene.dataset.iter().flat_map(|d| &d.photos);
        let views = photos.map(|p| (p.name.clone(), p.camera.clone())).collect();
        let masks = MaskFormat::ALL.to_vec();
        let (cloud, map) = (Arc::clone(&cloud), Arc::clone(&map));
        let format = SplatFormat::Ply;
        let request = ExportAllRequest { cloud, map, settings, views, format, masks, folder };
        self.submit(Command::ExportAll(Box::new(request)));
    }

    /// Compares the newest answer with a true mask of the current view, or with none.
    pub(super) fn compare_with_mask(&mut self, path: Option<&Path>) {
        let Some(path) = path else { return self.viewport.queries.compare_with(None) };
        let read = phrases::true_mask(path).and_then(|mask| match self.viewport.queries.maps() {
            Some(maps) => phrases::fitted(mask, maps.identities.width_px, maps.identities.height_px, path),
            None => Ok(mask),
        });
        match read {
            Ok(mask) => {
                let pose = self.viewport.pose();
                self.viewport.queries.compare_with(Some((Arc::new(mask), pose)));
            }
            Err(e) => self.state.fail("Opening the true mask", Failure::of(&e, "Choose a .png of this view.")),
        }
    }

    /// Writes the true mask of the current view.
    pub(super) fn save_true_mask(&mut self, path: &Path) {
        let Some(mask) = self.viewport.queries.truth() else { return };
        match export::check(path, &[".png"], &[]).and_then(|()| write_mask(path, &mask)) {
            Ok(()) => self.state.toast(Tone::Good, format!("Saved to {}", path.display())),
            Err(e) => self.state.fail("Saving the true mask", Failure::of(&e, "Choose another place.")),
        }
    }
}
