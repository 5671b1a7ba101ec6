//! Jobs around reports: reading one, and measuring how a scene is drawn, knob by knob.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::failure::{Failure, Stop};
use super::protocol::{MeasureRequest, Outcome};
use crate::measure::studies::StudyInput;
use crate::measure::studies::render;
use crate::measure::studies::views::{StudyView, held_out};
use crate::measure::{End, FILE, Report, computer, is_report};
use crate::pipeline::observer::{Observer, Severity};

/// Most views that are compared.
const VIEWS: usize = 4;
/// Longer side of the compared pictures in px.
const MAX_SIDE_PX: u32 = 256;
/// How often every setting is measured.
const REPEATS: u32 = 3;

/// Reads a report; the `second` is one to compare with.
pub(crate) fn read(path: PathBuf, second: bool) -> Result<Outcome, Stop> {
    let report = Report::read(&path)?;
    Ok(Outcome::Report { path, report: Arc::new(report), second })
}

/// Where reports of a scene may lie: where this program writes them, beside it, and where the command
/// line writes them.
pub(crate) fn known(scene: &Path, own: &Path) -> Vec<PathBuf> {
    let usual = Path::new("out/report");
    let mut found = Vec::new();
    for folder in [own.to_owned(), scene.join("report"), usual.to_owned()] {
        if is_report(&folder) && !found.contains(&folder) {
            found.push(folder);
        }
    }
    found
}

/// Measures the drawing of a scene and writes the report after every measurement.
pub(crate) fn run(request: MeasureRequest, observer: &mut dyn Observer) -> Result<Outcome, Stop> {
    let failed = |e: &dyn std::error::Error| Stop::Failed(Failure::of(e, ""));
    let mut report = Report::begin(&request.out, &request.scene, &computer::look()).map_err(|e| failed(&e))?;
    let folder = request.out.display().to_string();
    let unwritable = |e| Failure { message: format!("{folder}: {e}"), remedy: "Is the disk writable?".into() };
    std::fs::create_dir_all(&request.out).map_err(|e| Stop::Failed(unwritable(e)))?;
    let views = views(&request, observer)?;
    let input = StudyInput::from([
        ("scene".to_owned(), request.scene.clone()),
        ("Gaussians".to_owned(), request.cloud.len().to_string()),
        ("longer side".to_owned(), format!("{MAX_SIDE_PX} px")),
        ("views".to_owned(), views.len().to_string()),
    ]);
    let MeasureRequest { cloud, settings, out, .. } = request;
    let mut study = render::study(cloud, &settings, views, REPEATS, input).map_err(|e| failed(&e))?;
    let end = report.measure(&mut study, &out, f64::INFINITY, observer).map_err(|e| failed(&e))?;
    if end == End::Cancelled {
        observer.note(Severity::Info, format!("What was measured so far is kept in {}", out.join(FILE).display()));
        return Err(Stop::Cancelled);
    }
    Ok(Outcome::Report { path: out, report: Arc::new(report), second: false })
}

/// A few held-out photos with their cameras, or the one view without a photo.
fn views(request: &MeasureRequest, observer: &mut dyn Observer) -> Result<Vec<StudyView>, Stop> {
    let views = match &request.dataset {
        Some(dataset) => held_out(dataset, request.holdout_every, MAX_SIDE_PX, VIEWS, observer),
        None => Ok(Some(Vec::new())),
    };
    let mut views = views?.ok_or(Stop::Cancelled)?;
    if views.is_empty() {
        views.push((request.camera.limited_to(MAX_SIDE_PX), None));
    }
    Ok(views)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::observer::Silent;
    use crate::render::RenderSettings;
    use crate::scene::Camera;
    use glam::DVec3;

    #[test]
    fn a_report_beside_a_scene_is_found() {
        let folder = tempfile::tempdir().expect("folder");
        let (scene, out) = (folder.path().join("scene"), folder.path().join("out"));
        let known_here = || known(&scene, &out).into_iter().filter(|p| p.starts_with(folder.path())).count();
        assert_eq!(known_here(), 0);
        std::fs::create_dir_all(scene.join("report")).expect("folder");
        std::fs::write(scene.join("report").join(FILE), "{}").expect("written");
        assert_eq!(known_here(), 1);
    }

    #[test]
    fn a_missing_report_fails_by_name() {
        assert!(matches!(read("/no/such".into(), false), Err(Stop::Failed(f)) if f.message.contains("/no/such")));
        let folder = tempfile::tempdir().expect("folder");
        let request = MeasureRequest {
            scene: "nothing".into(),
            cloud: Arc::default(),
            settings: RenderSettings::default(),
            dataset: None,
            holdout_every: 8,
            camera: Camera::look_at(DVec3::ONE, DVec3::ZERO, DVec3::Z, 0.8, 64, 48).expect("valid"),
            out: folder.path().join("report"),
        };
        std::fs::create_dir_all(&request.out).expect("folder");
        std::fs::write(request.out.join(FILE), "{").expect("written");
        let result = run(request, &mut Silent);
        assert!(matches!(result, Err(Stop::Failed(f)) if f.message.contains("not a report")), "it is not overwritten");
    }
}
