//! Actions of the user: one table for menus, command palette, shortcut sheet, key bindings and what they do.

use std::path::PathBuf;

use egui::ThemePreference;
use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use strum::{IntoStaticStr, VariantArray};

use crate::jobs::poses::front_door::PoseRequest;
use crate::jobs::remove::RemoveRequest;
use crate::measure::{Knobs, StageName};
use crate::navigate::target::Side;
use crate::pipeline::semantics::lifting::edit::Edit;
use crate::scene::{CropBox, IdentityId, NO_IDENTITY};
use crate::ui::color_by::ColorBy;
use crate::ui::select_shape::SelectShape;
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

/// Side of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, VariantArray, IntoStaticStr)]
#[strum(serialize_all = "lowercase")]
#[allow(missing_docs, reason = "each name says which side it is")]
pub enum Face {
    Front,
    Back,
    Left,
    Right,
    Top,
    Bottom,
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

mod table;

pub(super) use table::action_table;

macro_rules! define_actions {
    (@plain $name:ident) => {
        Some(Self::$name)
    };
    (@plain $name:ident ($($ty:ty),+)) => {
        None
    };
    (|$app:ident, $ctx:ident|
     $($name:ident $(($($arg:ident: $ty:ty),+))?: $text:expr, $tip:literal $(, $key:literal)? => $act:expr;)*) => {
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
                [$(define_actions!(@plain $name $(($($ty),+))?)),*].into_iter().flatten().collect()
            }
        }
    };
}

action_table!(define_actions);

/// Themes in the order of the menu.
pub(crate) const THEMES: [ThemePreference; 3] =
    [ThemePreference::Dark, ThemePreference::Light, ThemePreference::System];

impl Action {
    /// Every action that needs no further input, in the order of the palette.
    pub(crate) fn all() -> Vec<Self> {
        let mut all = Self::plain();
        // These need a tool in use.
        all.retain(|a| !matches!(a, Self::AddPainted | Self::ApplyTransform | Self::KeepMeasurement));
        all.extend([
            Self::Isolate(None),
            Self::SegmentNew(Some(NO_IDENTITY)),
            Self::SetCrop(None),
            Self::Turntable(None),
            Self::ShowFolder(None),
        ]);
        all.extend(ViewMode::VARIANTS.iter().map(|mode| Self::Show(*mode)));
        all.extend(Pane::VARIANTS.iter().map(|pane| Self::ShowPane(*pane)));
        all.extend(THEMES.map(Self::UseTheme));
        all.extend(Face::VARIANTS.iter().map(|face| Self::LookFrom(*face)));
        all.extend(SelectShape::VARIANTS.iter().map(|shape| Self::SelectBy(*shape)));
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
