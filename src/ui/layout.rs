//! Layout and settings that the window stores between runs.

use std::path::{Path, PathBuf};

use egui::ThemePreference;
use serde::{Deserialize, Serialize};

use super::chat_model::ChatSettings;
use super::dock::Dock;
use super::file_kind::{FileKind, KindFolders};
use super::video_choice::VideoChoice;
use crate::io::splat_format::SplatFormat;
use crate::jobs::find_objects::FindSettings;
use crate::pipeline::train::TrainConfig;
use crate::scene::Overrides;
use crate::ui::actions::Pane;
use crate::worker::ViewMode;

/// Key of the layout in the storage.
const KEY: &str = "layout";

/// Horizontal axis of the plots.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum PlotAxis {
    /// Seconds of training.
    #[default]
    Seconds,
    Steps,
}

/// Quantity in the plot of training.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum PlotQuantity {
    #[default]
    Psnr,
    Loss,
}

/// Settings of the plots of training.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct PlotSettings {
    pub(crate) quantity: PlotQuantity,
    pub(crate) axis: PlotAxis,
    /// Window of the running mean, percent of the points.
    pub(crate) smoothing: f32,
    /// True if the loss has a logarithmic axis.
    pub(crate) log: bool,
}

impl Default for PlotSettings {
    fn default() -> Self {
        Self { quantity: PlotQuantity::default(), axis: PlotAxis::default(), smoothing: 2.0, log: false }
    }
}

/// Settings of the window and of the next training.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Layout {
    /// Hidden panes.
    pub hidden: Vec<Pane>,
    /// Arrangement of the panes.
    pub(crate) dock: Dock,
    /// Dark, light, or the system's theme.
    pub(crate) theme: ThemePreference,
    /// Zoom factor of the window, 1 by default.
    pub(crate) zoom: f32,
    /// True if the photos' cameras are drawn into the view.
    pub cameras: bool,
    /// True if kept measurements are drawn into the view, also while nothing is measured.
    pub measurements: bool,
    /// True if the photo is shown beside the frame.
    pub compare: bool,
    /// Position of the split between frame and photo, 0 to 1.
    pub(crate) split: f32,
    /// Mode of the first view.
    pub mode: ViewMode,
    /// True if there are two views; the mode of the second.
    pub split_view: bool,
    pub second_mode: ViewMode,
    /// True if everything except answers and the selection is dimmed.
    pub dim: bool,
    /// Settings of the plots of training.
    pub(crate) plots: PlotSettings,
    /// True if the times of a frame's stages are shown.
    pub times: bool,
    /// Settings of the next training.
    pub config: TrainConfig,
    /// The user's overrides of the scene plan.
    pub(crate) plan: Overrides,
    /// Models that find objects.
    pub finding: FindSettings,
    /// Planner of the agent.
    pub(crate) chat: ChatSettings,
    /// Choices for videos.
    pub(crate) video: VideoChoice,
    /// Format that Gaussians were last exported in.
    pub(crate) export: SplatFormat,
    /// Recently opened files and folders.
    pub(crate) recent: Vec<PathBuf>,
    /// Folder that each kind of files was last chosen from.
    pub folders: KindFolders,
    /// Folder for kinds that were never chosen: the one that a scene was last chosen from.
    pub folder: Option<PathBuf>,
}

impl Default for Layout {
    fn default() -> Self {
        Self {
            hidden: vec![Pane::Log, Pane::Camera, Pane::Report, Pane::Query, Pane::Phrases, Pane::Clean],
            dock: Dock::default(),
            theme: ThemePreference::Dark,
            zoom: 1.0,
            cameras: true,
            measurements: false,
            compare: false,
            split: 0.5,
            mode: ViewMode::Rgb,
            split_view: false,
            second_mode: ViewMode::Rgb,
            dim: false,
            plots: PlotSettings::default(),
            times: false,
            config: TrainConfig { steps: 3_000, eval_every: 250, ..TrainConfig::default() },
            plan: Overrides::default(),
            finding: FindSettings::default(),
            chat: ChatSettings::default(),
            video: VideoChoice::default(),
            export: SplatFormat::Ply,
            recent: Vec::new(),
            folders: KindFolders::new(),
            folder: None,
        }
    }
}

impl Layout {
    /// The stored layout, or the default one.
    pub(crate) fn load(storage: Option<&dyn eframe::Storage>) -> Self {
        let mut layout: Self = storage.and_then(|s| eframe::get_value(s, KEY)).unwrap_or_default();
        layout.split = if layout.split.is_finite() { layout.split.clamp(0.02, 0.98) } else { 0.5 };
        layout.zoom = if layout.zoom.is_finite() { layout.zoom.clamp(0.5, 3.0) } else { 1.0 };
        layout.dock = layout.dock.checked();
        layout
    }

    pub(crate) fn save(&self, storage: &mut dyn eframe::Storage) {
        eframe::set_value(storage, KEY, self);
    }

    /// Folder that a dialog for this kind of files begins in.
    pub(crate) fn folder_of(&self, kind: FileKind) -> Option<&Path> {
        let own = self.folders.get(&kind).filter(|folder| folder.is_dir());
        own.or(self.folder.as_ref()).map(PathBuf::as_path)
    }

    /// Remembers where a path of this kind was chosen.
    pub(crate) fn remember_folder(&mut self, kind: FileKind, path: &Path) {
        let Some(folder) = path.parent().filter(|folder| folder.is_dir()) else { return };
        self.folders.insert(kind, folder.to_owned());
        if kind.is_scene() {
            self.folder = Some(folder.to_owned());
        }
    }

    /// Mode of the first or the second view.
    pub(crate) fn mode_of(&mut self, second: bool) -> &mut ViewMode {
        if second { &mut self.second_mode } else { &mut self.mode }
    }

    /// True if a pane is shown.
    pub fn shows(&self, pane: Pane) -> bool {
        !self.hidden.contains(&pane)
    }

    /// Shows a pane, in front of its group.
    pub(crate) fn show(&mut self, pane: Pane) {
        self.hidden.retain(|p| *p != pane);
        self.dock.activate(pane);
    }

    /// Shows a hidden pane or hides a shown one.
    pub(crate) fn toggle(&mut self, pane: Pane) {
        if self.shows(pane) { self.hidden.push(pane) } else { self.show(pane) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    #[derive(Default)]
    struct Memory(HashMap<String, String>);

    impl eframe::Storage for Memory {
        fn get_string(&self, key: &str) -> Option<String> {
            self.0.get(key).cloned()
        }
        fn set_string(&mut self, key: &str, value: String) {
            self.0.insert(key.to_owned(), value);
        }
        fn remove_string(&mut self, key: &str) {
            self.0.remove(key);
        }
        fn flush(&mut self) {}
    }

    #[test]
    fn a_layout_comes_back_as_it_was_saved() {
        let recent = vec!["a/b".into()];
        let mut layout = Layout { split: 0.25, recent, export: SplatFormat::Spz, ..Layout::default() };
        layout.toggle(Pane::Dataset);
        let mut storage = Memory::default();
        layout.save(&mut storage);
        assert_eq!(Layout::load(Some(&storage)), layout);
        assert!(!layout.shows(Pane::Dataset));
        layout.toggle(Pane::Dataset);
        assert!(layout.shows(Pane::Dataset));
    }

    #[test]
    fn each_kind_of_files_has_its_folder_and_keeps_it() {
        let place = tempfile::tempdir().expect("folder");
        let [photos, pages] = ["photos", "pages"].map(|name| place.path().join(name));
        [&photos, &pages].into_iter().for_each(|folder| std::fs::create_dir(folder).expect("made"));
        let mut layout = Layout::default();
        layout.remember_folder(FileKind::Photos, &photos.join("plush"));
        layout.remember_folder(FileKind::Pages, &pages.join("a.html"));
        layout.remember_folder(FileKind::Videos, Path::new("/no/such/folder/a.mp4"));
        let mut storage = Memory::default();
        layout.save(&mut storage);
        let mut layout = Layout::load(Some(&storage));
        assert_eq!(layout.folder_of(FileKind::Pages), Some(&*pages));
        for kind in [FileKind::Photos, FileKind::Masks, FileKind::Videos] {
            assert_eq!(layout.folder_of(kind), Some(&*photos), "{kind:?}: not where a page was written");
        }
        layout.remember_folder(FileKind::Masks, &pages.join("masks"));
        assert_eq!(layout.folder_of(FileKind::Masks), Some(&*pages));
        std::fs::remove_dir(&pages).expect("removed");
        assert_eq!(layout.folder_of(FileKind::Masks), Some(&*photos), "its own is gone");
    }

    #[test]
    fn a_broken_store_gives_the_default() {
        let mut storage = Memory::default();
        eframe::Storage::set_string(&mut storage, KEY, "(split: NaN, nonsense".into());
        assert_eq!(Layout::load(Some(&storage)), Layout::default());
        assert_eq!(Layout::load(None), Layout::default());
    }
}
