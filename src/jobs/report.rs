//! Measures error against run time, stage by stage, into a report that can be resumed; lists known reports.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use super::{JobError, export, open};
use crate::measure::in_time::InTime;
use crate::measure::subject::{StudyOptions, Subject};
use crate::measure::sweep::failed;
use crate::measure::{End, FILE, Report, StageName, computer, is_report, page, plot, table};
use crate::pipeline::observer::{Observer, Severity};

/// Request of a report: its subject, stages and folder.
#[derive(Clone, Debug)]
pub struct ReportRequest {
    pub(crate) subject: Subject,
    /// Stages to measure; empty for all that the scene allows.
    pub(crate) stages: Vec<StageName>,
    /// Folder of the report. Earlier measurements there are resumed.
    pub(crate) out: PathBuf,
    /// True if earlier measurements are discarded.
    pub(crate) fresh: bool,
    /// Seconds for all measurements.
    pub(crate) budget_secs: f64,
    /// The command line that asked for it.
    pub(crate) command: String,
}

pub(crate) struct Measured {
    pub(crate) report: Report,
    pub(crate) stages: Vec<StageName>,
    pub(crate) end: End,
}

/// Measures, and saves the report after every measurement.
pub(crate) fn run(request: &ReportRequest, observer: &mut dyn Observer) -> Result<Measured, JobError> {
    let ReportRequest { subject, out, budget_secs, .. } = request;
    let computer = computer::look();
    let mut report = match request.fresh {
        true => Report::empty(&subject.name, &computer),
        false => Report::begin(out, &subject.name, &computer)?,
    };
    if !report.commands.contains(&request.command) {
        report.commands.push(request.command.clone());
    }
    let (stages, missing) = subject.stages(&request.stages)?;
    missing.into_iter().for_each(|m| observer.note(Severity::Info, m));
    export::make_folder(out)?;
    let start = Instant::now();
    let mut end = End::Finished;
    for (k, name) in stages.iter().enumerate() {
        let left = || (budget_secs - start.elapsed().as_secs_f64()).max(0.0);
        let share = left() / (stages.len() - k) as f64;
        // Its reference is needed before anything can be measured, however long that takes.
        let prepared = subject.study(*name, &mut InTime::new(observer, left()));
        let measured = prepared.and_then(|study| match study {
            Some(mut study) => report.measure(&mut study, out, share.min(left()), observer),
            None => {
                report.write(&out.join(FILE)).map_err(failed)?;
                Ok(if observer.proceed().is_err() { End::Cancelled } else { End::OutOfTime })
            }
        });
        let stage_end = match measured {
            // A stage that was not requested by name may turn out impossible; the others go on.
            Err(why) if request.stages.is_empty() => {
                observer.note(Severity::Warning, format!("Stage '{}' left out: {why}", name.name()));
                continue;
            }
            other => other?,
        };
        write(out, &report)?;
        if stage_end != End::Finished {
            end = stage_end;
        }
        if end == End::Cancelled {
            break;
        }
    }
    Ok(Measured { report, stages, end })
}

/// Loads a trained scene with its photos, if they exist.
pub(crate) fn subject(path: &Path, options: StudyOptions) -> Result<Subject, JobError> {
    let scene = open::scene(path)?;
    let dataset = scene.dataset_path.as_ref().filter(|p| p.exists()).map(|p| open::dataset(p)).transpose()?;
    let map = scene.known_semantics()?;
    Ok(Subject {
        name: path.display().to_string(),
        cloud: scene.cloud,
        settings: scene.settings,
        cameras: scene.cameras.into_iter().map(|c| (c.camera, c.held_out)).collect(),
        holdout_every: scene.config.holdout_every,
        dataset: dataset.map(Arc::new),
        map: map.map(Arc::new),
        options,
    })
}

/// Writes everything but the JSON, which is there already.
fn write(folder: &Path, report: &Report) -> Result<(), JobError> {
    export::text(&folder.join("report.csv"), &table::csv(report))?;
    export::text(&folder.join("report.html"), &page::html(report))?;
    for stage in &report.stages {
        if let Some(plot) = stage.measures.first().and_then(|m| plot::svg(report, stage, m)) {
            export::text(&folder.join(format!("{}.svg", stage.name.name())), &plot)?;
        }
    }
    Ok(())
}

/// Returns the folders with reports of a scene: this program's folder for them, the one beside it, and the command
/// line's default.
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

#[cfg(test)]
mod tests {

    use glam::DVec3;

    use super::*;
    use crate::measure::BeginError;
    use crate::pipeline::observer::Silent;
    use crate::pipeline::observer::testing::StopsAfter;
    use crate::render::RenderSettings;
    use crate::scene::{Camera, GaussianCloud};

    /// A Gaussian and one view of it, to be drawn.
    fn request(out: PathBuf) -> ReportRequest {
        let camera = Camera::look_at(DVec3::ONE, DVec3::ZERO, DVec3::Z, 0.8, 64, 48).expect("valid");
        let subject = Subject {
            name: "nothing".into(),
            cloud: Arc::new(GaussianCloud::isotropic(vec![[0.0; 3]], -3.0, 1.0)),
            settings: RenderSettings::default(),
            cameras: vec![(camera, false)],
            holdout_every: 8,
            dataset: None,
            map: None,
            options: StudyOptions::default(),
        };
        let stages = vec![StageName::Render];
        ReportRequest { subject, stages, out, fresh: false, budget_secs: f64::INFINITY, command: "x".into() }
    }

    #[test]
    fn preparing_a_stage_ends_in_time_and_when_it_is_to_stop() {
        let folder = tempfile::tempdir().expect("folder");
        let stages = |budget_secs: f64, patience: usize, name: &str| {
            let request = ReportRequest { budget_secs, ..request(folder.path().join(name)) };
            let done = run(&request, &mut StopsAfter::new(patience)).expect("measured");
            assert!(is_report(&request.out), "a whole report is left");
            (done.end, done.report.stages.len())
        };
        assert_eq!(stages(0.0, usize::MAX, "no time"), (End::OutOfTime, 0), "not even prepared");
        assert_eq!(stages(f64::INFINITY, 0, "stopped"), (End::Cancelled, 0));
        // The control: stopped once its one view is prepared, the stage is there.
        assert_eq!(stages(f64::INFINITY, 1, "prepared"), (End::Cancelled, 1));
    }

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
    fn what_is_no_report_is_not_written_over() {
        let folder = tempfile::tempdir().expect("folder");
        let mut request = request(folder.path().join("report"));
        std::fs::create_dir_all(&request.out).expect("folder");
        std::fs::write(request.out.join(FILE), "{").expect("written");
        let refused = run(&request, &mut Silent).err().expect("refused");
        assert!(matches!(&refused, JobError::Report(BeginError::Read(e)) if e.to_string().contains("not a report")));
        request.fresh = true;
        request.stages = vec![StageName::Train];
        let refused = run(&request, &mut Silent).err().expect("refused").to_string();
        assert!(refused.contains("needs the scene's photos"), "{refused}");
        assert_eq!(std::fs::read_to_string(request.out.join(FILE)).expect("there"), "{");
    }
}
