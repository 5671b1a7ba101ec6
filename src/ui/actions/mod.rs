//! Actions of the user: one table for menus, command palette, shortcut sheet and key bindings. A row holds an action's
//! name, one sentence on its effect, and its key if it has one.

use std::path::PathBuf;

use egui::ThemePreference;
use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use strum::{IntoStaticStr, VariantArray};

use crate::io::unposed::Unposed;
use crate::jobs::remove::RemoveRequest;
use crate::jobs::train::IfChanged;
use crate::measure::{Knobs, StageName};
use crate::navigate::target::Side;
use crate::pipeline::semantics::edit::Edit;
use crate::scene::{CropBox, IdentityId, NOBODY};
use crate::ui::color_by::ColorBy;
use crate::worker::{Start, ViewMode};

/// A pane of the window that can be hidden, in the order of the menu.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, VariantArray, IntoStaticStr)]
pub enum Pane {
    /// Thumbnails and facts of the photos.
    #[strum(serialize = "Photos")]
    Dataset,
    /// The conversation with the agent.
    Chat,
    /// Settings, progress and plots of training.
    Training,
    /// Objects and parts.
    Objects,
    /// The answer to the query in full, with the settings of search and display.
    #[strum(serialize = "Query")]
    Query,
    /// Decisions on what is left out for this scene, with their reasons.
    #[strum(serialize = "Scene plan")]
    Plan,
    /// Neural networks, installed and missing.
    Models,
    /// A list of phrases with their answers.
    Phrases,
    /// The camera path.
    #[strum(serialize = "Camera path")]
    Camera,
    /// Detection and deletion of floaters and other artifacts.
    Clean,
    /// Error against run time.
    Report,
    /// Messages.
    Log,
}

impl Pane {
    pub(crate) fn text(self) -> &'static str {
        self.into()
    }
}

/// A world direction that can be up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, VariantArray, IntoStaticStr)]
pub enum Axis {
    /// Along x.
    #[strum(serialize = "+X")]
    PlusX,
    /// Against x.
    #[strum(serialize = "-X")]
    MinusX,
    /// Along y.
    #[strum(serialize = "+Y")]
    PlusY,
    /// Against y.
    #[strum(serialize = "-Y")]
    MinusY,
    /// Along z.
    #[strum(serialize = "+Z")]
    PlusZ,
    /// Against z.
    #[strum(serialize = "-Z")]
    MinusZ,
}

impl Axis {
    pub(crate) fn text(self) -> &'static str {
        self.into()
    }

    /// Its unit vector.
    pub(crate) fn vector(self) -> DVec3 {
        let axis = [DVec3::X, DVec3::Y, DVec3::Z][self as usize / 2];
        if (self as usize).is_multiple_of(2) { axis } else { -axis }
    }
}

/// A key with modifiers. Keys are named as on the keyboard: "F", "Home", "F1", "[".
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Shortcut {
    /// Control (Command on a Mac).
    pub(crate) ctrl: bool,
    pub(crate) key: &'static str,
}

macro_rules! actions {
    (@plain $name:ident) => {
        Some(Self::$name)
    };
    (@plain $name:ident ($($ty:ty),+)) => {
        None
    };
    ($($name:ident $(($($arg:ident: $ty:ty),+))?: $text:expr, $tip:literal $(, $key:literal)?;)*) => {
        /// An action of the user.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Action {
            $(#[doc = $tip] $name $(($($ty),+))?,)*
        }

        impl Action {
            /// Name in menus and in the palette.
            #[allow(unused_variables, clippy::useless_conversion)]
            pub(crate) fn text(&self) -> String {
                match self {
                    $(Self::$name $(($($arg),+))? => String::from($text),)*
                }
            }

            #[allow(unused_variables)]
            fn row(&self) -> (&'static str, &'static str) {
                match self {
                    $(Self::$name $(($($arg),+))? => ($tip, concat!("" $(, $key)?)),)*
                }
            }

            /// Actions without arguments that must be given, in the order of the table.
            fn plain() -> Vec<Self> {
                [$(actions!(@plain $name $(($($ty),+))?)),*].into_iter().flatten().collect()
            }
        }
    };
}

actions! {
    OpenFolder: "Open folder\u{2026}",
        "COLMAP, transforms.json (nerfstudio, instant-ngp, Blender), LLFF, or a trained scene.", "Ctrl+O";
    OpenFile: "Open file\u{2026}", "A splat (.ply, .sog, .gltf, .glb), a transforms.json, or the scene.json of a trained scene.";
    Open(path: PathBuf): format!("Open {}", path.display()), "Open this path.";
    FindPoses(photos: Box<Unposed>): format!("Find the camera poses of {}", photos.folder.display()),
        "Run COLMAP on the photos, in a folder of its own, and open the result.";
    Connect(url: String): "Connect to another computer",
        "Look at what 'fmlgs serve' or 'fmlgs train --serve' shows there.";
    OpenDemo: "Open the demo", "A trained tabletop with objects and parts, ready for queries. No download needed.";
    TrainDemo: "Train the demo yourself",
        "Render posed photos of the tabletop and train on them. No download needed.";
    ExportPly: "Export Gaussians\u{2026}", "Write the Gaussians as .ply, .spz, .sog, .glb or others that viewers read.", "Ctrl+E";
    ExportAll: "Export all objects and parts\u{2026}",
        "Into a folder: a .ply each, and their masks in the photos as ISAT, COCO and id pictures.";
    ExportPage: "Export page\u{2026}",
        "One .html that opens in any browser without a server: to orbit, with names to click and camera paths.";
    Screenshot: "Save the view as .png\u{2026}", "Write the image in the viewport, without the drawn cameras.", "Ctrl+S";
    StartTraining: "Start training",
        "Fit Gaussians to the photos. Resumes from the last checkpoint if the settings are the same.", "Ctrl+T";
    AskHowToTrain(changes: String): "Ask how to train", "The photos are not those that the training began with: ask how to go on.";
    TrainChanged(how: IfChanged): match how {
            IfChanged::GoOn => "Go on with the photos as they are now",
            _ => "Train anew on the photos as they are now",
        }, "The photos are not those that the training began with.";
    TrainAnew: "Begin training anew",
        "Another training of the same photos, in a folder of its own. The one before stays, and its objects are carried over.";
    PauseJob: "Pause or resume the running job", "Training, a search for objects, a download: it waits and loses nothing.", "T";
    Cancel: "Cancel the running job", "Stop the running job at its next step. Progress so far is kept.";
    Dismiss: "Deselect, or cancel the running job", "Deselect what is selected; with nothing selected, stop the running job.",
        "Escape";
    Evaluate: "Evaluate on held-out photos", "PSNR and SSIM on photos held out from training.";
    FindObjects: "Find objects and parts",
        "From the labels that came with the photos, or else from what networks or colors tell.";
    SegmentPhoto: "Segment this photo",
        "Find what this photo, or else the nearest one, shows that is nobody's yet. Objects and parts stay; can be undone.";
    ChooseMasks: "Find objects with other masks\u{2026}",
        "Labels of ISAT, LabelMe, COCO, YOLO, fmlgs synth, SPIn-NeRF, 3D-OVS or LERF-Mask; one labeled photo is enough.";
    FetchModel(id: String): format!("Download the model {id}"), "Download it, verify it, and use it from then on.";
    AddModel(id: String): format!("Add files of the model {id}\u{2026}"),
        "Choose a folder with its files; they are verified and copied.";
    TypeQuery: "Query an object or a part", "A name, or \"the button of the red controller\".", "/";
    Ask(text: String): format!("Query {text}"), "A name, or \"the button of the red controller\".";
    RunPhrases(to: Option<PathBuf>): to.as_ref().map_or_else(|| "Run the phrase list".into(),
            |to| format!("Export phrase masks to {}", to.display())),
        "Query every phrase of the list, in this view or in all photos.";
    ExportPhrases: "Export phrase masks\u{2026}", "As .png, COCO .json and a .csv table, in a folder.";
    ChooseTrueMask: "Compare with a true mask\u{2026}",
        "A .png of this view, white where the object is. Shows hits, misses, false alarms and IoU.";
    TrueMask(path: Option<PathBuf>): path.as_ref().map_or_else(|| "End the comparison with a true mask".into(),
            |p| format!("Compare with the true mask {}", p.display())),
        "Hits, misses, false alarms and IoU of the latest answer.";
    PaintTrueMask: "Paint a true mask", "Paint what the answer should be here: shows hits, misses, false alarms, IoU.";
    SaveTrueMask: "Save the true mask as .png\u{2026}", "White where the object is; can be loaded again.";
    GoToTarget(id: IdentityId, side: Side): format!("Go to #{id}, {}", side.text()),
        "Fly to its best view, around obstacles.";
    PlayPath: "Play or pause the camera path", "Fly along the path, or pause where you are.", "Space";
    StepBack: "Previous frame", "Move back along the path by one frame.", ",";
    StepForward: "Next frame", "Move forward along the path by one frame.", ".";
    AddKey: "Add keyframe", "Add the current view to the camera path.", "K";
    OpenPath: "Open a camera path\u{2026}", "A path of this program, or of nerfstudio's viewer.";
    SavePath: "Save the camera path\u{2026}", "As .json; for nerfstudio, end its name in .nerfstudio.json.";
    ExportVideo: "Export video\u{2026}", "H.264 (.mp4), .gif, .webp, or .png frames in a folder.";
    StartChat: "Chat", "Type a command, such as \u{201c}show me the lid of the kettle\u{201d}. \u{201c}help\u{201d} lists all.", "Enter";
    SaveChat: "Save conversation\u{2026}", "As Markdown, or .json, with every step and its result.";
    Select(id: Option<IdentityId>): id.map_or_else(|| "Deselect".into(), |id| format!("Select #{id}")),
        "Outline it in the view; keys and menus act on it.";
    SelectNext: "Select the next object", "In the order of the list; with a part selected, the part next to it.", "N";
    SelectPrevious: "Select the previous object", "In the order of the list; with a part selected, the part before it.", "P";
    SelectInner: "Select a part of the selection", "The first part of what is selected; N and P go through the others.", "O";
    SelectOuter: "Select the whole of the selection", "What the selected part is a part of.", "U";
    IsolateSelected: "Isolate the selection",
        "Show only the selection, or everything again.", "I";
    HideSelected: "Hide the selection", "Do not show it in the view.", "H";
    GoToSelected: "Go to the selection", "Fly to its best view.", "G";
    Isolate(only: Option<IdentityId>): only.map_or_else(|| "Show all objects".into(), |id| format!("Show only #{id}")),
        "Show everything that was hidden.";
    Hide(id: IdentityId): format!("Hide or show #{id}"), "Hide it in the view, or show it again.";
    ExportTarget(id: IdentityId): format!("Export #{id}\u{2026}"),
        "Write its Gaussians in the format that 3DGS viewers read.";
    Remove(id: IdentityId): format!("Remove #{id} and fill"),
        "Take it out, into a scene of its own that is shown beside this one: what it hid is closed from what is around.";
    AnotherFill(request: Box<RemoveRequest>): "Another fill",
        "Remove it again, with another choice of what hides below it; the scene made before stays.";
    DeleteRemoved: "Delete this scene\u{2026}",
        "Delete the scene that was made by removing something, which is shown beside this one. This one stays.";
    Arrange(id: IdentityId): format!("Move, turn or recolor #{id}"),
        "Drag it along the axes, turn, scale, duplicate or recolor it; can be undone.";
    KeepArranged: "Keep the arrangement", "Carry out what the view shows of a moved, duplicated or recolored thing.";
    MeasureSplats: "Clean: measure Gaussians",
        "Size, shape, opacity and neighbors of each, and what the photos show of it: finds floaters and the like.";
    BrushSplats: "Choose Gaussians by brush", "Brush over what is chosen in the Clean pane, once it is measured.";
    DeleteChosen: "Delete the chosen Gaussians",
        "Delete what is chosen in the Clean pane; can be undone, and the scene that was opened stays as it is.";
    ExportCrop: "Export what the crop box keeps\u{2026}",
        "Write the Gaussians whose centers it keeps, hidden ones too, in the format that 3DGS viewers read.";
    Change(edit: Edit): match edit {
            Edit::Rename(_, name) => format!("Rename to {name}"),
            Edit::Merge(from, into) => format!("Merge #{from} into #{into}"),
            Edit::Split(id) => format!("Split #{id}"),
            Edit::AddPiece { name, .. } => format!("Add {name}"),
            Edit::Reshape { id, .. } => format!("Correct the extent of #{id}"),
        }, "Correct the segmentation; can be undone.";
    Paint(of: Option<IdentityId>): match *of {
            None => "Stop selecting".into(),
            Some(NOBODY) => "Select a new object".to_owned(),
            Some(id) => format!("Select a new part of #{id}"),
        }, "Click on it or draw a line through it, in any view; name it, and it can be asked for everywhere.";
    Correct(id: IdentityId): format!("Correct #{id} by clicks"),
        "Add what it lacks and remove what it has too much, by clicks and lines in any view.";
    AddPainted: "Keep the selection", "Make what is selected an object or part, or the extent of the one that is corrected.";
    Rename: "Rename", "Type a new name for the selected object or part.", "F2";
    Undo: "Undo", "Undo the last change to objects, visibility or the camera path.", "Ctrl+Z";
    Redo: "Redo", "Redo the last undone change.", "Ctrl+Y";
    FrameScene: "Frame the selection or the scene", "Move until the selection, or the whole scene, fits the view.", "F";
    ResetView: "Reset the view", "Return to the scene's initial view.", "Home";
    TurnUp(axis: Axis): format!("Make {} the up direction", axis.text()), "For scenes that lie on their side.";
    SetUp(up: DVec3): format!("Make ({:.2}, {:.2}, {:.2}) the up direction", up.x, up.y, up.z),
        "Use the picked plane as the floor.";
    Measure: "Measure a distance", "Click two points on surfaces; set the scale from a known length.", "M";
    Crop: "Crop box", "Show only the Gaussians in a box: drag its faces or type its corners.", "B";
    SetCrop(crop: Option<CropBox>): if crop.is_some() { "Crop the view" } else { "Remove the crop box" },
        "Show only what a box keeps, or everything again.";
    Inspect: "Inspect Gaussians", "Click a pixel to see every property of its Gaussians.", "X";
    InspectAt(at: DVec2): format!("Inspect the Gaussians at ({:.2}, {:.2})", at.x, at.y),
        "Every property of the Gaussians of a pixel.";
    SetScale(meters: f64): format!("Set the scale to {meters} m per unit"),
        "Show lengths in meters; saved with the scene.";
    PreviousPhoto: "Previous photo", "Look through the camera of the previous photo.", "[";
    NextPhoto: "Next photo", "Look through the camera of the next photo.", "]";
    GoToPhoto(index: usize): format!("Go to photo {}", index + 1), "Look through the camera of this photo.";
    Show(mode: ViewMode): match mode {
            ViewMode::Rgb => "Show RGB".to_owned(),
            other => format!("Show {}", other.text().to_lowercase()),
        }, "Choose what the viewport shows.";
    Tint(by: ColorBy): format!("Color by {}", by.text().to_lowercase()),
        "Color the view this way; again for the RGB image.";
    ToggleCompare: "Compare with the photo", "Show the photo beside the rendering with a slider between them.", "C";
    ToggleSplit: "Split view", "Two views of the scene by one camera, each with its own query and colors.", "8";
    OtherView: "Work in the other view", "Keys, queries and colors act on it from now on.", "0";
    ChooseBeside: "Compare with another scene\u{2026}",
        "Show its Gaussians in the second view by the same camera: two trainings of the same photos.";
    OpenBeside(path: Option<PathBuf>): path.as_ref().map_or_else(|| "End the comparison with another scene".into(),
            |p| format!("Compare with the scene {}", p.display())), "Show its Gaussians in the second view.";
    ToggleDim: "Dim the rest", "Darken everything except answers and the selection.", "9";
    ToggleCameras: "Show or hide cameras", "Show the camera of every photo in the view.", "V";
    TogglePane(pane: Pane): format!("Show or hide the {} pane", pane.text().to_lowercase()),
        "Show or hide this pane.";
    FillWindow: "Fill the window with the view", "Show only the view, full screen; again to show everything.", "F11";
    ResetPanes: "Reset the panes", "Put every pane back in its initial place.";
    UseTheme(theme: ThemePreference): match theme {
            ThemePreference::Dark => "Dark theme",
            ThemePreference::Light => "Light theme",
            ThemePreference::System => "System theme",
        }, "The view keeps its dark background.";
    LargerText: "Larger text", "Enlarge everything in the window.";
    SmallerText: "Smaller text", "Reduce everything in the window.";
    NormalText: "Normal text size", "Reset the size of everything in the window.";
    ShowPane(pane: Pane): format!("Show the {} pane", pane.text().to_lowercase()), "Open this pane.";
    ChooseReport: "Open a report\u{2026}", "A report.json of fmlgs report: error vs. run time of every setting.";
    ChooseSecondReport: "Compare with another report\u{2026}", "Shown with hollow markers, and side by side in the tables.";
    OpenReport(path: PathBuf): format!("Open the report {}", path.display()), "Read this report.";
    CompareReport(path: PathBuf): format!("Compare with the report {}", path.display()), "Open it as the second report.";
    EndComparison: "Stop comparing reports", "Close the second report.";
    BenchmarkRendering: "Benchmark rendering",
        "Render a few views with many settings and compare them with the exact image. Takes minutes; can be canceled and resumed.";
    ApplySetting(stage: StageName, knobs: Knobs): format!("Apply a setting of {}", stage.title().to_lowercase()),
        "Use this setting from now on.";
    ResetRenderSettings: "Reset render settings", "Render with the scene's own settings, not those taken from a report.";
    ToggleTimes: "Show or hide frame times",
        "How long each stage of a frame takes: the last, and the median of the last 60.", "F3";
    Palette: "Command palette", "Find and run any action by name.", "Ctrl+P";
    Shortcuts: "Keyboard shortcuts", "List every key and mouse gesture.", "F1";
    Quit: "Quit", "Close the window. A running training keeps its last checkpoint.", "Ctrl+Q";
}

/// Themes in the order of the menu.
pub(crate) const THEMES: [ThemePreference; 3] =
    [ThemePreference::Dark, ThemePreference::Light, ThemePreference::System];

impl Action {
    /// Every action that needs no further input, in the order of the palette.
    pub(crate) fn all() -> Vec<Self> {
        let mut all = Self::plain();
        // These need a tool in use.
        all.retain(|a| !matches!(a, Self::AddPainted | Self::KeepArranged | Self::DeleteChosen));
        all.extend([Self::Isolate(None), Self::Paint(Some(NOBODY)), Self::SetCrop(None)]);
        all.extend(ViewMode::VARIANTS.iter().map(|mode| Self::Show(*mode)));
        all.extend(Pane::VARIANTS.iter().map(|pane| Self::ShowPane(*pane)));
        all.extend(THEMES.map(Self::UseTheme));
        all.extend(ColorBy::VARIANTS.iter().map(|by| Self::Tint(*by)));
        all.extend(Pane::VARIANTS.iter().map(|pane| Self::TogglePane(*pane)));
        all.extend(Axis::VARIANTS.iter().map(|axis| Self::TurnUp(*axis)));
        all
    }

    /// One sentence on its effect.
    pub(crate) fn tooltip(&self) -> &'static str {
        match self {
            Self::Isolate(Some(_)) => "Show nothing else.",
            Self::Show(ViewMode::Rgb) => "The rendered image.",
            Self::Show(ViewMode::Depth) => "Distance from the camera, near to far as blue to red.",
            Self::Show(ViewMode::Alpha) => "Accumulated opacity, black to white.",
            Self::Show(ViewMode::Difference) => {
                "Absolute difference from the photo, amplified four times. Needs a photo's view."
            }
            Self::Show(ViewMode::Photo) => "The photo through whose camera the view looks. Needs a photo's view.",
            other => other.row().0,
        }
    }

    /// The key that runs it, if it has one.
    pub(crate) fn shortcut(&self) -> Option<Shortcut> {
        let key = match self {
            Self::Show(ViewMode::Rgb) => "1",
            Self::Tint(ColorBy::Heat) => "2",
            Self::Tint(ColorBy::Objects) => "3",
            Self::Tint(ColorBy::Features) => "4",
            Self::Show(ViewMode::Depth) => "5",
            Self::Show(ViewMode::Difference) => "6",
            Self::Show(ViewMode::Alpha) => "7",
            other => other.row().1,
        };
        match key.strip_prefix("Ctrl+") {
            Some(key) => Some(Shortcut { ctrl: true, key }),
            None => (!key.is_empty()).then_some(Shortcut { ctrl: false, key }),
        }
    }
}

impl From<Start> for Action {
    fn from(start: Start) -> Self {
        match start {
            Start::Demo => Self::OpenDemo,
            Start::Scene(path) => Self::Open(path),
            Start::Report(path) => Self::OpenReport(path),
            Start::SecondReport(path) => Self::CompareReport(path),
            Start::Remote(url) => Self::Connect(url),
        }
    }
}

#[cfg(test)]
mod tests;
