//! One file per pane of the window, and the parts around the panes.

use egui::Ui;

use super::ctx::Ctx;
use super::viewport::Viewport;

pub(crate) mod bars;
pub(crate) mod clean;
pub(crate) mod empty;
mod histogram;
pub(crate) mod log;
pub(crate) mod models;
mod object_facts;
pub(crate) mod object_thumbnails;
pub(crate) mod objects;
pub(crate) mod photos;
pub mod phrases;
pub(crate) mod plan;
pub(crate) mod plots;
pub(crate) mod problems;
pub(crate) mod query;
pub(crate) mod report;
pub(crate) mod runs;
pub(crate) mod training;
pub(crate) mod unposed;

/// Contents of a pane.
pub(crate) trait PaneContents {
    /// Draws the pane.
    fn ui(&mut self, ui: &mut Ui, cx: &mut Ctx<'_>, view: &mut Viewport);

    /// True if the window scrolls the pane.
    fn scrolls(&self) -> bool {
        false
    }
}
