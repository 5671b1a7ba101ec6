//! The tools of the view, of which at most one is in use. A tool handles the pointer, draws over each view, has a card,
//! and owns its jobs.

mod card;
pub(crate) mod crop;
pub(crate) mod inspect;
pub(crate) mod mask_brush;
pub(crate) mod preparation;
pub(crate) mod ruler;
pub(crate) mod select;
pub(crate) mod transform;

use egui::{Rect, Response, Ui};

use self::crop::CropTool;
use self::inspect::Inspector;
use self::mask_brush::MaskBrush;
use self::preparation::SelectionPreparation;
use self::ruler::Ruler;
use self::select::SelectTool;
use self::transform::TransformTool;
use super::display::Display;
use super::eye::Eye;
use super::marks::Marks;
use super::picking::Picking;
use super::query::Queries;
use super::split::ViewArea;
use super::visible::Visibility;
use crate::navigate::Pose;
use crate::scene::measurement::Measurement;
use crate::scene::{Bounds, Camera, GaussianCloud, SemanticMap};
use crate::ui::ctx::Ctx;
use crate::ui::state::AppState;
use crate::worker::{Tasks, Versioned};

/// The tool in use.
pub(crate) enum Tool {
    Ruler(Ruler),
    Crop(CropTool),
    Inspect(Box<Inspector>),
    MaskBrush(MaskBrush),
    Select(Box<SelectTool>),
    Transform(TransformTool),
}

impl Tool {
    pub(super) fn as_dyn(&mut self) -> &mut dyn ViewTool {
        match self {
            Self::Ruler(tool) => tool,
            Self::Crop(tool) => tool,
            Self::Inspect(tool) => &mut **tool,
            Self::MaskBrush(tool) => tool,
            Self::Select(tool) => &mut **tool,
            Self::Transform(tool) => tool,
        }
    }

    /// True if the tool paints, chooses or transforms: "Done" and "Cancel" of its card end it.
    pub(super) fn is_edit(&self) -> bool {
        !matches!(self, Self::Ruler(_) | Self::Crop(_) | Self::Inspect(_))
    }
}

/// Rest of the viewport, for its tool.
pub(super) struct ToolScene<'a> {
    pub(super) display: &'a Display,
    pub(super) eye: &'a Eye,
    /// Current camera pose.
    pub(super) pose: Pose,
    pub(super) cloud: Option<&'a Versioned<GaussianCloud>>,
    pub(super) visibility: &'a mut Visibility,
    pub(super) queries: &'a mut Queries,
    pub(super) picking: &'a Picking,
    pub(super) marks: &'a mut Marks,
    /// Measurements of the scene.
    pub(super) measurements: &'a mut Vec<Measurement>,
    /// Preparation for selections in this scene.
    pub(super) preparation: &'a mut SelectionPreparation,
    /// Ticket of the newest request for a frame.
    pub(super) ticket: u64,
}

impl ToolScene<'_> {
    /// The camera for overlays of the frame in `shown`.
    pub(super) fn camera(&self, shown: Rect) -> Camera {
        self.display.overlay_camera(self.eye, shown)
    }

    /// Bounds of the selected object or part, if any.
    pub(super) fn selected_bounds(&mut self, semantics: Option<&Versioned<SemanticMap>>) -> Option<Bounds> {
        self.marks.bounds(self.cloud?, semantics?, self.picking.selected()?)
    }
}

/// Places of a tool's card.
#[derive(Clone, Copy)]
pub(super) struct CardPlaces {
    /// Frame in the first view.
    pub(super) first_frame: Rect,
    /// The active view.
    pub(super) active_view: Rect,
}

/// A tool of the view.
pub(super) trait ViewTool {
    /// True if drags and clicks are strokes: a drag does not orbit, a click selects nothing.
    fn takes_drags(&self) -> bool {
        false
    }

    /// True if clicks are the tool's: they select nothing, and the photos' cameras are not in the way.
    fn takes_clicks(&self) -> bool {
        false
    }

    /// True if a click or a line waits for a frame with depth.
    fn waits_for_depth(&self) -> bool {
        false
    }

    /// Takes over results of jobs and begins the next, once per frame.
    fn update(&mut self, _scene: &mut ToolScene<'_>, _state: &mut AppState, _tasks: &Tasks) {}

    /// Handles clicks and drags in the view under the pointer, before the camera moves.
    fn pointer(&mut self, _response: &Response, _area: ViewArea, _scene: &mut ToolScene<'_>, _cx: &mut Ctx<'_>) {}

    /// Draws over the frame of a view; handles for dragging are widgets.
    fn paint(&mut self, _ui: &Ui, _area: ViewArea, _scene: &mut ToolScene<'_>, _cx: &mut Ctx<'_>) {}

    /// Draws the card.
    fn card(&mut self, ui: &Ui, places: CardPlaces, scene: &mut ToolScene<'_>, cx: &mut Ctx<'_>);
}
