//! Changes of objects, parts and Gaussians, and the tools that make them.

use std::sync::Arc;

use super::{edits, remote, view};
use crate::jobs::clean::{self, MeasureRequest};
use crate::jobs::edit::EditRequest;
use crate::jobs::phases;
use crate::jobs::rearrange::SplatEdit;
use crate::jobs::select::SelectFor;
use crate::math::format;
use crate::pipeline::observer::Observer;
use crate::pipeline::semantics::lifting::edit::Edit;
use crate::scene::{IdentityId, NO_IDENTITY};
use crate::ui::actions::Pane;
use crate::ui::app::App;
use crate::ui::history::EditStep;
use crate::ui::select_shape::SelectShape;
use crate::ui::state::Tone;
use crate::ui::viewport::splat_selection::SplatSelection;

use crate::worker::JobInfo;

/// Corrects objects and parts.
pub(in crate::ui) fn apply(app: &mut App, edit: Edit) {
    edits::queue(app, EditStep::Request(EditRequest::Apply(edit)));
}

/// Begins selecting a new object or a part of one; `None` ends the tool.
pub(in crate::ui) fn segment(app: &mut App, of: Option<IdentityId>) {
    app.viewport.select(of.map(SelectFor::New), &app.state);
}

/// Makes the lines of the selection tool, or its brush and ball, wider or narrower.
pub(in crate::ui) fn widen_line(app: &mut App, is_wider: bool) {
    if !app.viewport.widen_line(is_wider) {
        app.state
            .toast(Tone::Info, "Start a new object or a correction first; these keys change the width of its lines.");
    }
}

/// Begins correcting the extent of an identity.
pub(in crate::ui) fn correct(app: &mut App, id: IdentityId) {
    app.viewport.select(Some(SelectFor::Extent(id)), &app.state);
}

/// Adds or corrects what is selected.
pub(in crate::ui) fn add_segment(app: &mut App) {
    if let Some(edit) = app.viewport.take_edit() {
        apply(app, edit);
    }
}

/// Begins moving, turning or recoloring an identity, which becomes the selection: outline and list show what changes.
pub(in crate::ui) fn transform(app: &mut App, id: IdentityId) {
    if !view::is_empty(app, id) {
        app.viewport.picking.select(Some(id));
        app.viewport.transform(id, &app.state);
    }
}

/// Applies the transform that the view previews.
pub(in crate::ui) fn apply_transform(app: &mut App) {
    if let Some(arrangement) = app.viewport.take_transform() {
        edits::queue(app, EditStep::Rearrange(SplatEdit::Arrange(arrangement)));
    }
}

/// Measures the Gaussians on screen, to clean them.
pub(in crate::ui) fn measure_splats(app: &mut App) {
    let Some((scene, cloud)) = app.state.scene.clone().zip(app.viewport.cloud().cloned()) else { return };
    if !app.state.is_trained() {
        return app.state.toast(Tone::Warning, "Only trained Gaussians can be cleaned.");
    }
    app.layout.show(Pane::Clean);
    let request = MeasureRequest { path: scene.stored().to_path_buf(), cloud: Arc::clone(&cloud) };
    let measure = move |observer: &mut dyn Observer| clean::measured(request, observer);
    let info = JobInfo::long("Measuring Gaussians").pausable().phases(phases::CLEANING);
    app.clean.measuring = app.start_to_end(info, measure, |app, _, measured| {
        app.clean.measuring = false;
        if let Ok(measured) = measured {
            app.state.say(Tone::Info, format!("{} measured", format::things(measured.cloud.len(), "Gaussian")));
            app.clean.take(Arc::new(measured));
        }
    });
}

/// Goes on by hand with the selection of the Clean pane.
pub(in crate::ui) fn refine_chosen(app: &mut App) {
    let first = app.clean.chosen().unwrap_or_default();
    app.viewport.select_from(SelectFor::New(NO_IDENTITY), Some(SelectShape::Brush), first, &app.state);
}

/// Deletes the selected Gaussians: those of the selection tool while it is in use, else those of the Clean pane.
pub(in crate::ui) fn delete_chosen(app: &mut App) {
    let selected = match app.viewport.is_selecting() {
        true => app.viewport.selected_gaussians().map(<[u32]>::to_vec),
        false => app.clean.chosen(),
    };
    let Some((selected, cloud)) = selected.zip(app.viewport.cloud()) else {
        return app.state.toast(Tone::Info, "No Gaussians are selected: select some in the view or in the Clean pane.");
    };
    let gone = Arc::new(SplatSelection::of_numbers(cloud.len(), &selected));
    app.viewport.select(None, &app.state);
    app.clean.deletes(Arc::clone(&gone));
    edits::queue(app, EditStep::Rearrange(SplatEdit::Delete(gone.of.clone())));
}

/// Turns the name of the selected identity into a text field.
pub(in crate::ui) fn start_renaming(app: &mut App) {
    match (view::chosen_identity(app), app.state.semantics.clone()) {
        (Some(id), Some(map)) => {
            app.layout.show(Pane::Objects);
            app.objects.rename(id, &map.identities);
        }
        _ => {
            let text = "Choose what to rename first: click it in the view or its name in the list.";
            app.state.toast(Tone::Info, text);
        }
    }
}

/// Sets the length of a unit of the scene, in meters.
pub(in crate::ui) fn set_scale(app: &mut App, meters_per_unit: f64) {
    let Some(out) = app.state.scene.as_ref().map(|scene| scene.out.clone()) else { return };
    if remote::refuses(app, "Saving the scale", "its scale is stored with the scene there") {
        return;
    }
    let workspace = Arc::clone(&app.workspace);
    let store = move |_: &mut dyn Observer| workspace.set_scale(&out, meters_per_unit);
    app.start_in_scene(JobInfo::short("Saving the scale"), store, move |app, is_stored| {
        if let Some(is_stored) = is_stored {
            app.state.scaled(meters_per_unit, is_stored);
        }
    });
}
