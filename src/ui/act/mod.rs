//! What actions do: the functions that the rows of the table of [`super::actions`] call.
//!
//! An action changes the window at once, or starts a job and says what is done with its result ([`App::start`]).

pub(super) mod add;
pub(super) mod camera_path;
pub(super) mod comparing;
pub(super) mod edit;
pub(super) mod edits;
pub(super) mod elsewhere;
pub(super) mod export;
pub(super) mod gaussians;
pub(super) mod import;
pub(super) mod locate;
pub(super) mod measure;
pub(super) mod objects;
pub(super) mod open;
pub(super) mod query;
pub(super) mod remote;
pub(super) mod runs;
mod tool_change;
pub(super) mod train;
pub(super) mod view;
pub(super) mod window;

use super::actions::{Action, action_table};
use super::app::App;
use super::help::HelpPage;
use super::history::EditStep;
use super::viewport::overrides::RenderOverrides;
use crate::jobs::train::IfChanged;

macro_rules! define_act {
    (|$app:ident, $ctx:ident|
     $($name:ident $(($($arg:ident: $ty:ty),+))?: $text:expr, $tip:literal $(, $key:literal)? => $act:expr;)*) => {
        /// Carries out an action.
        #[allow(unused_variables)]
        pub(super) fn act(action: Action, $app: &mut App, $ctx: &egui::Context) {
            let Some(action) = tool_change::checked(action, $app) else { return };
            match action {
                $(Action::$name $(($($arg),+))? => { $act; })*
            }
        }
    };
}

action_table!(define_act);
