//! What a person can want of the program: one closed enum from which menus, the command palette,
//! the shortcut sheet and the key bindings are generated.

use std::path::PathBuf;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::measure::{Knobs, StageName};
use crate::navigate::target::Side;
use crate::pipeline::semantics::edit::Edit;
use crate::scene::{IdentityId, NOBODY};

/// What the viewport shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum ViewMode {
    /// The rendered picture.
    #[default]
    Picture,
    /// Expected depth, turbo colours from near to far.
    Depth,
    /// Accumulated opacity.
    Alpha,
    /// Absolute difference from the photo.
    Difference,
}

impl ViewMode {
    /// All of them, in the order of the toolbar.
    pub const ALL: [Self; 4] = [Self::Picture, Self::Depth, Self::Alpha, Self::Difference];

    /// Its name.
    pub fn text(self) -> &'static str {
        match self {
            Self::Picture => "Picture",
            Self::Depth => "Depth",
            Self::Alpha => "Alpha",
            Self::Difference => "Difference",
        }
    }
}

/// A part of the window that can be hidden.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Pane {
    /// Thumbnails and facts of the photos.
    Dataset,
    /// Settings, progress and plots of training.
    Training,
    /// Objects and parts.
    Objects,
    /// What is left out for this scene, and why.
    Plan,
    /// Neural networks: which are here, which are missing.
    Models,
    /// The camera's path.
    Camera,
    /// Error against run time.
    Report,
    /// The talk with the agent.
    Chat,
    /// Messages.
    Log,
}

impl Pane {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Dataset,
        Self::Chat,
        Self::Training,
        Self::Objects,
        Self::Plan,
        Self::Models,
        Self::Camera,
        Self::Report,
        Self::Log,
    ];

    /// Its title.
    pub fn text(self) -> &'static str {
        match self {
            Self::Dataset => "Photos",
            Self::Training => "Training",
            Self::Objects => "Objects",
            Self::Plan => "Scene plan",
            Self::Models => "Models",
            Self::Camera => "Camera path",
            Self::Report => "Report",
            Self::Chat => "Assistant",
            Self::Log => "Log",
        }
    }
}

/// A direction of the world that can be upwards.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Axis {
    /// Along x.
    PlusX,
    /// Against x.
    MinusX,
    /// Along y.
    PlusY,
    /// Against y.
    MinusY,
    /// Along z.
    PlusZ,
    /// Against z.
    MinusZ,
}

impl Axis {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::PlusX, Self::MinusX, Self::PlusY, Self::MinusY, Self::PlusZ, Self::MinusZ];

    /// Its name.
    pub fn text(self) -> &'static str {
        match self {
            Self::PlusX => "+X",
            Self::MinusX => "-X",
            Self::PlusY => "+Y",
            Self::MinusY => "-Y",
            Self::PlusZ => "+Z",
            Self::MinusZ => "-Z",
        }
    }

    /// Its unit vector.
    pub fn vector(self) -> DVec3 {
        match self {
            Self::PlusX => DVec3::X,
            Self::MinusX => DVec3::NEG_X,
            Self::PlusY => DVec3::Y,
            Self::MinusY => DVec3::NEG_Y,
            Self::PlusZ => DVec3::Z,
            Self::MinusZ => DVec3::NEG_Z,
        }
    }
}

/// A key with modifiers. Keys are named as on the keyboard: "F", "Home", "F1", "[".
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Shortcut {
    /// Control (Command on a Mac).
    pub ctrl: bool,
    /// The key's name.
    pub key: &'static str,
}

/// What a person wants.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Action {
    /// Make the demo scene, open it and train it.
    TryDemo,
    /// Choose a folder of photos or a trained scene.
    OpenFolder,
    /// Choose a file.
    OpenFile,
    /// Open this file or folder.
    Open(PathBuf),
    /// Write the Gaussians as a `.ply`.
    ExportPly,
    /// Write what the viewport shows as a `.png`.
    Screenshot,
    /// Start training, or go on from the last checkpoint.
    StartTraining,
    /// Pause or resume training.
    PauseTraining,
    /// Cancel the running job.
    Cancel,
    /// Measure PSNR and SSIM on the held-out photos.
    Evaluate,
    /// Find objects and parts, with the masks that came with the photos if there are any.
    FindObjects,
    /// Choose masks, and find objects and parts with them.
    ChooseMasks,
    /// Fetch a model of the catalogue.
    FetchModel(String),
    /// Choose the folder that has the files of a model, and take them over.
    AddModel(String),
    /// Type a question.
    TypeQuestion,
    /// Ask for an object or part.
    Ask(String),
    /// Fly to where an identity is seen best, or from this side.
    GoToTarget(IdentityId, Side),
    /// Play the flight or path, or hold it.
    PlayPath,
    /// One picture back.
    StepBack,
    /// One picture on.
    StepForward,
    /// Record the view as a key of the path.
    AddKey,
    /// Choose a camera path to open.
    OpenPath,
    /// Choose where to save the camera path.
    SavePath,
    /// Choose where to write a film of what is played.
    SaveFilm,
    /// Type a sentence to the assistant.
    Talk,
    /// Choose where to write the talk with the assistant.
    SaveTalk,
    /// Draw one identity alone; `None` draws everything again.
    Isolate(Option<IdentityId>),
    /// Leave an identity out of the picture, or draw it again.
    Hide(IdentityId),
    /// Write the Gaussians of an identity as a `.ply`.
    ExportTarget(IdentityId),
    /// Correct objects and parts.
    Change(Edit),
    /// Mark a new piece of an identity in the view (of nobody, a new object); `None` stops it.
    Paint(Option<IdentityId>),
    /// Add what is marked.
    AddPainted,
    /// Take back the last correction.
    Undo,
    /// Make it again.
    Redo,
    /// Bring the scene into view.
    FrameScene,
    /// Go back to the first view.
    ResetView,
    /// Choose which way of the world is up.
    TurnUp(Axis),
    /// Look through the previous photo's camera.
    PreviousPhoto,
    /// Look through the next photo's camera.
    NextPhoto,
    /// Look through the camera of the photo with this index.
    GoToPhoto(usize),
    /// Choose what the viewport shows.
    Show(ViewMode),
    /// Show or hide the photo beside the picture.
    ToggleCompare,
    /// Show or hide the cameras of the photos.
    ToggleCameras,
    /// Show or hide a pane.
    TogglePane(Pane),
    /// Choose a report to look at.
    ChooseReport,
    /// Choose a second report to compare with.
    ChooseSecondReport,
    /// Show the report at this path.
    OpenReport(PathBuf),
    /// Compare with the report at this path.
    CompareReport(PathBuf),
    /// Stop comparing reports.
    EndComparison,
    /// Measure how the scene is drawn, knob by knob.
    MeasureDrawing,
    /// Take over a measured setting of a stage.
    ApplySetting(StageName, Knobs),
    /// Draw as the scene says again.
    ResetDrawing,
    /// Show or hide how long the stages of a picture take.
    ToggleTimes,
    /// Search all actions.
    Palette,
    /// List all shortcuts.
    Shortcuts,
    /// Close the window.
    Quit,
}

impl Action {
    /// Every action that needs no further input, in the order of the palette.
    pub const ALL: [Self; 58] = [
        Self::TryDemo,
        Self::OpenFolder,
        Self::OpenFile,
        Self::ExportPly,
        Self::Screenshot,
        Self::StartTraining,
        Self::PauseTraining,
        Self::Cancel,
        Self::Evaluate,
        Self::FindObjects,
        Self::ChooseMasks,
        Self::TypeQuestion,
        Self::Isolate(None),
        Self::Paint(Some(NOBODY)),
        Self::Undo,
        Self::Redo,
        Self::FrameScene,
        Self::ResetView,
        Self::PreviousPhoto,
        Self::NextPhoto,
        Self::Show(ViewMode::Picture),
        Self::Show(ViewMode::Depth),
        Self::Show(ViewMode::Alpha),
        Self::Show(ViewMode::Difference),
        Self::ToggleCompare,
        Self::ToggleCameras,
        Self::TurnUp(Axis::PlusX),
        Self::TurnUp(Axis::MinusX),
        Self::TurnUp(Axis::PlusY),
        Self::TurnUp(Axis::MinusY),
        Self::TurnUp(Axis::PlusZ),
        Self::TurnUp(Axis::MinusZ),
        Self::TogglePane(Pane::Dataset),
        Self::TogglePane(Pane::Training),
        Self::TogglePane(Pane::Objects),
        Self::TogglePane(Pane::Plan),
        Self::TogglePane(Pane::Models),
        Self::TogglePane(Pane::Camera),
        Self::TogglePane(Pane::Log),
        Self::PlayPath,
        Self::StepBack,
        Self::StepForward,
        Self::AddKey,
        Self::OpenPath,
        Self::SavePath,
        Self::SaveFilm,
        Self::Talk,
        Self::SaveTalk,
        Self::TogglePane(Pane::Chat),
        Self::TogglePane(Pane::Report),
        Self::ChooseReport,
        Self::ChooseSecondReport,
        Self::EndComparison,
        Self::MeasureDrawing,
        Self::ResetDrawing,
        Self::ToggleTimes,
        Self::Palette,
        Self::Shortcuts,
    ];

    /// Its name in menus and in the palette.
    pub fn text(&self) -> String {
        match self {
            Self::TryDemo => "Try the demo".into(),
            Self::OpenFolder => "Open folder…".into(),
            Self::OpenFile => "Open file…".into(),
            Self::Open(path) => format!("Open {}", path.display()),
            Self::ExportPly => "Export Gaussians as .ply…".into(),
            Self::Screenshot => "Save the view as .png…".into(),
            Self::StartTraining => "Start training".into(),
            Self::PauseTraining => "Pause or resume training".into(),
            Self::Cancel => "Cancel the running job".into(),
            Self::Evaluate => "Measure held-out quality".into(),
            Self::FindObjects => "Find objects and parts".into(),
            Self::ChooseMasks => "Find objects with other masks…".into(),
            Self::FetchModel(id) => format!("Fetch the model {id}"),
            Self::AddModel(id) => format!("Add files of the model {id}…"),
            Self::TypeQuestion => "Ask for an object or a part".into(),
            Self::Ask(text) => format!("Ask for {text}"),
            Self::GoToTarget(id, side) => format!("Go to #{id}, {}", side.text()),
            Self::PlayPath => "Play or hold the camera path".into(),
            Self::StepBack => "One picture back".into(),
            Self::StepForward => "One picture on".into(),
            Self::AddKey => "Record the view as a key of the camera path".into(),
            Self::OpenPath => "Open a camera path…".into(),
            Self::SavePath => "Save the camera path…".into(),
            Self::SaveFilm => "Make a film…".into(),
            Self::Talk => "Talk to the assistant".into(),
            Self::SaveTalk => "Save the talk with the assistant…".into(),
            Self::Isolate(None) => "Show all objects".into(),
            Self::Isolate(Some(id)) => format!("Show #{id} alone"),
            Self::Hide(id) => format!("Hide or show #{id}"),
            Self::ExportTarget(id) => format!("Export #{id} as .ply…"),
            Self::Change(Edit::Rename(_, name)) => format!("Rename to {name}"),
            Self::Change(Edit::Merge(from, into)) => format!("Merge #{from} into #{into}"),
            Self::Change(Edit::Split(id)) => format!("Split #{id}"),
            Self::Change(Edit::AddPiece { name, .. }) => format!("Add {name}"),
            Self::Paint(None) => "Stop marking".into(),
            Self::Paint(Some(NOBODY)) => "Mark a new object by hand".into(),
            Self::Paint(Some(id)) => format!("Mark a new part of #{id} by hand"),
            Self::AddPainted => "Add what is marked".into(),
            Self::Undo => "Undo the last change of objects".into(),
            Self::Redo => "Redo the last change of objects".into(),
            Self::FrameScene => "Frame the scene".into(),
            Self::ResetView => "Reset the view".into(),
            Self::TurnUp(axis) => format!("Turn {} upwards", axis.text()),
            Self::PreviousPhoto => "Previous photo".into(),
            Self::NextPhoto => "Next photo".into(),
            Self::GoToPhoto(index) => format!("Go to photo {}", index + 1),
            Self::Show(mode) => format!("Show {}", mode.text().to_lowercase()),
            Self::ToggleCompare => "Compare with the photo".into(),
            Self::ToggleCameras => "Show or hide cameras".into(),
            Self::TogglePane(pane) => format!("Show or hide the {} pane", pane.text().to_lowercase()),
            Self::ChooseReport => "Open a report…".into(),
            Self::ChooseSecondReport => "Compare with another report…".into(),
            Self::OpenReport(path) => format!("Open the report {}", path.display()),
            Self::CompareReport(path) => format!("Compare with the report {}", path.display()),
            Self::EndComparison => "Stop comparing reports".into(),
            Self::MeasureDrawing => "Measure drawing of this scene".into(),
            Self::ApplySetting(stage, _) => format!("Apply a setting of {}", stage.title().to_lowercase()),
            Self::ResetDrawing => "Draw as the scene says again".into(),
            Self::ToggleTimes => "Show or hide frame times".into(),
            Self::Palette => "Command palette".into(),
            Self::Shortcuts => "Keyboard shortcuts".into(),
            Self::Quit => "Quit".into(),
        }
    }

    /// One sentence on what it does.
    pub fn tooltip(&self) -> &'static str {
        match self {
            Self::TryDemo => {
                "Render a table-top scene into posed photos, open them and train at once. Needs no download."
            }
            Self::OpenFolder => "COLMAP, transforms.json (nerfstudio, instant-ngp, Blender), LLFF, or a trained scene.",
            Self::OpenFile => "A splat .ply, a transforms.json, or the scene.json of a trained scene.",
            Self::Open(_) => "Open this path.",
            Self::ExportPly => "Write the Gaussians in the format that 3DGS viewers read.",
            Self::Screenshot => "Write the picture in the viewport, without the drawn cameras.",
            Self::StartTraining => {
                "Fit Gaussians to the photos. Continues from the last checkpoint if the settings are the same."
            }
            Self::PauseTraining => "Hold training without losing its state.",
            Self::Cancel => "Stop the running job at its next step. What is trained so far stays.",
            Self::Evaluate => "PSNR and SSIM on the photos that training does not see.",
            Self::FindObjects => {
                "Carry the masks that came with the photos, or else regions of even colour, to every view through the Gaussians."
            }
            Self::ChooseMasks => {
                "Id maps of fmlgs synth, ISAT files, folders of SPIn-NeRF, 3D-OVS or LERF-Mask; one labelled photo will do."
            }
            Self::FetchModel(_) => "Download it, check it, and use it from then on.",
            Self::AddModel(_) => "Choose a folder with its files; they are checked and copied.",
            Self::TypeQuestion | Self::Ask(_) => "A name, or \"the button of the red controller\".",
            Self::GoToTarget(..) => "Fly to where it is seen best, clear of everything in between.",
            Self::PlayPath => "Fly along the path, or stop where you are.",
            Self::StepBack | Self::StepForward => "Move along the path by one picture.",
            Self::AddKey => "The camera will pass here, looking this way.",
            Self::OpenPath => "A path of this program, or of nerfstudio's viewer.",
            Self::SavePath => "As .json; for nerfstudio, end its name in .nerfstudio.json.",
            Self::Talk => "Ask in plain sentences: show me the lid of the kettle, then step back.",
            Self::SaveTalk => "As Markdown, or .json, with every step and its result.",
            Self::SaveFilm => "H.264 (.mp4), .gif, .webp, or .png frames in a folder.",
            Self::Isolate(None) => "Draw everything again that was hidden.",
            Self::Isolate(Some(_)) => "Draw nothing else.",
            Self::Hide(_) => "Leave it out of the picture, or draw it again.",
            Self::ExportTarget(_) => "Write its Gaussians in the format that 3DGS viewers read.",
            Self::Change(_) => "Correct what was found; can be undone.",
            Self::Paint(_) | Self::AddPainted => {
                "Drag over it or click on it in the view; its Gaussians become a new one."
            }
            Self::Undo => "Take the last correction of objects and parts back.",
            Self::Redo => "Make the correction again that was taken back.",
            Self::FrameScene => "Move back until all of the scene is in view.",
            Self::ResetView => "Return to the view with which the scene opened.",
            Self::TurnUp(_) => "For scenes that lie on their side.",
            Self::PreviousPhoto | Self::NextPhoto | Self::GoToPhoto(_) => "Look through the camera of a photo.",
            Self::Show(ViewMode::Picture) => "The rendered picture.",
            Self::Show(ViewMode::Depth) => "Distance from the camera, near to far as blue to red.",
            Self::Show(ViewMode::Alpha) => "Accumulated opacity, black to white.",
            Self::Show(ViewMode::Difference) => {
                "Absolute difference from the photo, four times amplified. Needs a photo's view."
            }
            Self::ToggleCompare => "Show the photo beside the picture with a slider between them.",
            Self::ToggleCameras => "Draw the camera of every photo into the view.",
            Self::TogglePane(_) => "Show or hide this part of the window.",
            Self::ChooseReport => "A report.json of fmlgs report: error against run time of every knob.",
            Self::ChooseSecondReport => "Its points are drawn hollow, its numbers stand beside.",
            Self::OpenReport(_) | Self::CompareReport(_) => "Read this report.",
            Self::EndComparison => "Leave the second report out again.",
            Self::MeasureDrawing => {
                "Draws a few views in many ways, and holds them against the exact picture. Takes minutes; can be cancelled and gone on with."
            }
            Self::ApplySetting(..) => "Take this setting over.",
            Self::ResetDrawing => "Forget drawing settings that were taken from a report.",
            Self::ToggleTimes => "How long each stage of a picture takes: the last, and the median of the last 60.",
            Self::Palette => "Find and run any action by name.",
            Self::Shortcuts => "List every key and mouse gesture.",
            Self::Quit => "Close the window. A running training keeps its last checkpoint.",
        }
    }

    /// The key that runs it, if it has one.
    pub fn shortcut(&self) -> Option<Shortcut> {
        let plain = |key| Some(Shortcut { ctrl: false, key });
        let ctrl = |key| Some(Shortcut { ctrl: true, key });
        match self {
            Self::OpenFolder => ctrl("O"),
            Self::ExportPly => ctrl("E"),
            Self::Screenshot => ctrl("S"),
            Self::StartTraining => ctrl("T"),
            Self::PauseTraining => plain("T"),
            Self::Cancel => plain("Escape"),
            Self::TypeQuestion => plain("/"),
            Self::Undo => ctrl("Z"),
            Self::Redo => ctrl("Y"),
            Self::FrameScene => plain("F"),
            Self::ResetView => plain("Home"),
            Self::PlayPath => plain("Space"),
            Self::StepBack => plain(","),
            Self::StepForward => plain("."),
            Self::AddKey => plain("K"),
            Self::Talk => plain("Enter"),
            Self::PreviousPhoto => plain("["),
            Self::NextPhoto => plain("]"),
            Self::Show(ViewMode::Picture) => plain("1"),
            Self::Show(ViewMode::Depth) => plain("5"),
            Self::Show(ViewMode::Difference) => plain("6"),
            Self::Show(ViewMode::Alpha) => plain("7"),
            Self::ToggleCompare => plain("C"),
            Self::ToggleCameras => plain("V"),
            Self::ToggleTimes => plain("F3"),
            Self::Palette => ctrl("P"),
            Self::Shortcuts => plain("F1"),
            Self::Quit => ctrl("Q"),
            Self::TryDemo
            | Self::OpenFile
            | Self::Open(_)
            | Self::Evaluate
            | Self::FindObjects
            | Self::ChooseMasks
            | Self::FetchModel(_)
            | Self::AddModel(_)
            | Self::Ask(_)
            | Self::GoToTarget(..)
            | Self::OpenPath
            | Self::SavePath
            | Self::SaveFilm
            | Self::SaveTalk
            | Self::Isolate(_)
            | Self::Hide(_)
            | Self::ExportTarget(_)
            | Self::Change(_)
            | Self::Paint(_)
            | Self::AddPainted
            | Self::GoToPhoto(_)
            | Self::ChooseReport
            | Self::ChooseSecondReport
            | Self::OpenReport(_)
            | Self::CompareReport(_)
            | Self::EndComparison
            | Self::MeasureDrawing
            | Self::ApplySetting(..)
            | Self::ResetDrawing
            | Self::TurnUp(_)
            | Self::TogglePane(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn no_two_actions_share_a_key_or_a_name() {
        let all: Vec<Action> = Action::ALL.into_iter().chain([Action::Quit]).collect();
        let keys: Vec<Shortcut> = all.iter().filter_map(Action::shortcut).collect();
        assert_eq!(keys.iter().collect::<HashSet<_>>().len(), keys.len());
        let names: HashSet<String> = all.iter().map(Action::text).collect();
        assert_eq!(names.len(), all.len());
    }

    #[test]
    fn no_action_takes_a_flying_key() {
        for action in Action::ALL {
            if let Some(Shortcut { ctrl: false, key }) = action.shortcut() {
                assert!(!["W", "A", "S", "D", "Q", "E"].contains(&key), "{action:?} would stop flying");
            }
        }
    }

    #[test]
    fn every_action_is_explained() {
        for action in Action::ALL {
            assert!(action.tooltip().ends_with('.'), "{action:?}");
        }
    }
}
