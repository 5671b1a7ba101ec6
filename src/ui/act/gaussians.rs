//! Export of Gaussians: the dialog with its formats, then the file.

use std::sync::Arc;

use strum::VariantArray;

use super::export::{has_view, scene_name};
use super::open::file_name;
use crate::io::splat_format::SplatFormat;
use crate::jobs::export;
use crate::jobs::export_splat::{self, LossViews};
use crate::jobs::phases;
use crate::math::format;
use crate::pipeline::observer::Observer;
use crate::scene::{GaussianCloud, IdentityId};
use crate::ui::app::App;
use crate::ui::export_dialog::{ExportDecision, ExportDialog, ExportScope, OfferedScope};
use crate::ui::file_dialogs::{FileFormat, FileRequest};
use crate::ui::file_kind::FileKind;
use crate::ui::state::Tone;
use crate::worker::JobInfo;

/// Exports what the whole view holds.
pub(in crate::ui) fn all(app: &mut App) {
    if has_view(app) {
        open(app, ExportScope::All);
    }
}

/// Exports the Gaussians of an identity.
pub(in crate::ui) fn identity(app: &mut App, id: IdentityId) {
    if app.state.semantics.is_some() && !super::view::is_empty(app, id) && has_view(app) {
        open(app, ExportScope::Identity(id));
    }
}

/// Exports the Gaussians that the tool selects.
pub(in crate::ui) fn selection(app: &mut App) {
    match app.viewport.selected_gaussians() {
        Some(_) => open(app, ExportScope::Selection),
        None => app.state.toast(Tone::Info, "No Gaussians are selected: select some in the view first."),
    }
}

/// Exports the Gaussians that the crop box keeps.
pub(in crate::ui) fn crop(app: &mut App) {
    if !has_view(app) {
        return;
    }
    if app.viewport.visibility.crop().is_none() {
        return app.state.toast(Tone::Info, "There is no crop box yet: press B, and drag its faces.");
    }
    open(app, ExportScope::Crop);
}

/// Opens the dialog for a scope; the others are offered beside it.
fn open(app: &mut App, scope: ExportScope) {
    let Some(cloud) = cloud_of(app, scope) else { return };
    let id = match scope {
        ExportScope::Identity(id) => Some(id),
        _ => app.viewport.picking.selected().filter(|id| !app.state.is_empty(*id)),
    };
    let name = scene_name(app);
    let of_all = OfferedScope { scope: ExportScope::All, title: "Everything".into(), stem: name.clone() };
    let of_id = id.zip(app.state.semantics.as_ref()).map(|(id, map)| OfferedScope {
        scope: ExportScope::Identity(id),
        title: format::capital(&map.identities.full_name(id)),
        stem: export::identity_name(&map.identities, id),
    });
    let of_crop = app.viewport.visibility.crop().map(|_| OfferedScope {
        scope: ExportScope::Crop,
        title: "Crop box".into(),
        stem: format!("{name}-cropped"),
    });
    let of_selection = app.viewport.selected_gaussians().map(|_| OfferedScope {
        scope: ExportScope::Selection,
        title: "Selected Gaussians".into(),
        stem: format!("{name}-selection"),
    });
    let offered = [Some(of_all), of_selection, of_id, of_crop].into_iter().flatten().collect();
    show_anew(app, offered, scope, cloud);
}

fn show_anew(app: &mut App, offered: Vec<OfferedScope>, scope: ExportScope, cloud: Arc<GaussianCloud>) {
    let before = app.export_dialog.take();
    before.iter().for_each(|dialog| dialog.end(&app.tasks));
    let mut dialog = ExportDialog::new(offered, scope, cloud, &app.tasks);
    dialog.format = before.map_or(app.layout.export, |before| before.format);
    app.export_dialog = Some(dialog);
}

/// The Gaussians of a scope; tells the user if there are none.
fn cloud_of(app: &mut App, scope: ExportScope) -> Option<Arc<GaussianCloud>> {
    let cloud = app.viewport.cloud()?;
    match scope {
        ExportScope::All => Some(Arc::clone(cloud)),
        ExportScope::Identity(id) => Some(Arc::new(cloud.select(&app.state.semantics.as_ref()?.members(id)))),
        ExportScope::Selection => {
            let selected: Vec<usize> = app.viewport.selected_gaussians()?.iter().map(|i| *i as usize).collect();
            Some(Arc::new(cloud.select(&selected)))
        }
        ExportScope::Crop => {
            let kept = export::cropped(cloud, &app.viewport.visibility.crop()?);
            kept.map_err(|e| app.state.toast(Tone::Warning, format!("Nothing is exported: {e}."))).ok().map(Arc::new)
        }
    }
}

/// Shows the dialog, and continues with the user's decision.
pub(in crate::ui) fn show_dialog(app: &mut App, ctx: &egui::Context) {
    let Some(decision) = app.export_dialog.as_mut().and_then(|dialog| dialog.show(ctx)) else { return };
    if let ExportDecision::Change(scope) = decision {
        let offered = app.export_dialog.as_ref().map_or_else(Vec::new, |dialog| dialog.offered().to_vec());
        if let Some(cloud) = cloud_of(app, scope) {
            show_anew(app, offered, scope, cloud);
        }
        return;
    }
    let Some(dialog) = app.export_dialog.take() else { return };
    dialog.end(&app.tasks);
    if decision == ExportDecision::Save {
        app.layout.export = dialog.format;
        save(app, &dialog);
    }
}

/// Asks for a file, and writes the Gaussians.
fn save(app: &mut App, dialog: &ExportDialog) {
    let formats = SplatFormat::VARIANTS.iter().map(|f| FileFormat::new(f.title(), &[f.ending()])).collect();
    let format = SplatFormat::VARIANTS.iter().position(|format| *format == dialog.format).unwrap_or(0);
    let request = FileRequest::save(FileKind::Gaussians, "Export Gaussians", dialog.stem(), formats);
    let cloud = Arc::clone(&dialog.cloud);
    app.choose(request.with_format(format), |app, path| {
        // The name may have the ending of another format.
        app.layout.export = SplatFormat::of(&path).unwrap_or(app.layout.export);
        let info = JobInfo::short(format!("Writing {}", file_name(&path))).phases(phases::EXPORT);
        let write = move |observer: &mut dyn Observer| {
            let views = LossViews::of_cloud(&cloud);
            let written = export_splat::run(&cloud, &path, Some(&views), observer)?;
            written.tell_loss(observer);
            Ok::<_, crate::jobs::JobError>((path, written.drawn))
        };
        app.start(info, write, |app, (path, drawn)| {
            let loss = drawn.map_or_else(String::new, |drawn| format!(" ({})", drawn.line()));
            app.state.result(format!("Saved to {}{loss}", path.display()));
        });
    });
}
