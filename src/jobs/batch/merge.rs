//! Results of all units as one document, one table and one page, from any folders.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::{Value, json};

use super::state::{FAILURE, RESULT, UnitFailure, UnitResult, VERSION, is_done};
use super::unit::{self, UnitRequest};
use crate::io::IoError;
use crate::jobs::JobError;
use crate::jobs::experiment::{difference, stored};
use crate::math::stats::mean;
use crate::pipeline::observer::{Observer, Severity};
use crate::pipeline::train::TrainConfig;

/// Levels of folders that are searched; units are three below the folder of their batch.
const DEEPEST: usize = 6;

/// All units of some batches.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct MergedResults {
    version: u32,
    pub(super) program: &'static str,
    /// Sorted by settings and scene; those without a scene are the means over scenes.
    pub(crate) rows: Vec<MergedRow>,
    /// Sorted by name.
    pub(crate) units: Vec<UnitResult>,
    pub(crate) failed: Vec<UnitFailure>,
    /// Names of units that were started and have no result.
    pub(crate) unfinished: Vec<String>,
}

/// Results of one setting in one scene, over the seeds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct MergedRow {
    pub(crate) setting: String,
    /// `None` for the mean over all scenes, in which each counts once.
    pub(crate) scene: Option<String>,
    /// Units in it.
    pub(crate) units: usize,
    pub(crate) psnr: MeanStd,
    pub(crate) ssim: MeanStd,
    pub(crate) gaussians: MeanStd,
    pub(crate) training_secs: MeanStd,
    pub(crate) miou: MeanStd,
}

impl MergedRow {
    /// Headings of its cells.
    pub(crate) const HEAD: [&str; 8] =
        ["settings", "scene", "units", "PSNR dB", "SSIM", "Gaussians", "training s", "mean IoU"];

    /// The row as text.
    pub(crate) fn cells(&self) -> [String; 8] {
        [
            self.setting.clone(),
            self.scene.clone().unwrap_or_else(|| "mean of scenes".into()),
            self.units.to_string(),
            self.psnr.text(2),
            self.ssim.text(4),
            self.gaussians.text(0),
            self.training_secs.text(1),
            self.miou.text(4),
        ]
    }
}

/// Mean and sample standard deviation of the known values; `None` where too few are known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct MeanStd {
    pub(crate) mean: Option<f64>,
    pub(crate) deviation: Option<f64>,
}

impl MeanStd {
    fn of(values: impl Iterator<Item = Option<f64>>) -> Self {
        let values: Vec<f64> = values.flatten().filter(|v| v.is_finite()).collect();
        let mean = (!values.is_empty()).then(|| mean(&values));
        let deviation = mean.filter(|_| values.len() > 1).map(|m| {
            let sum: f64 = values.iter().map(|v| (v - m).powi(2)).sum();
            (sum / (values.len() - 1) as f64).sqrt()
        });
        Self { mean, deviation }
    }

    /// Returns text such as "27.41 ± 0.12".
    fn text(&self, digits: usize) -> String {
        match (self.mean, self.deviation) {
            (None, _) => "-".into(),
            (Some(mean), None) => format!("{mean:.digits$}"),
            (Some(mean), Some(deviation)) => format!("{mean:.digits$} ± {deviation:.digits$}"),
        }
    }
}

impl UnitResult {
    /// Mean IoU of its objects and parts, if its protocol has one.
    pub(super) fn miou(&self) -> Option<f64> {
        self.masks.as_ref()?.get("miou")?.as_f64()
    }

    pub(super) fn psnr(&self) -> Option<f64> {
        self.evaluation.as_ref().map(|e| e.psnr)
    }

    pub(super) fn ssim(&self) -> Option<f64> {
        self.evaluation.as_ref().map(|e| e.ssim)
    }
}

/// A unit's folder and its contents.
struct Found {
    folder: PathBuf,
    asked: UnitRequest,
    result: Option<UnitResult>,
    failure: Option<UnitFailure>,
}

/// Reads all units below `folders`.
///
/// # Errors
/// If there are no units, results do not match (settings of one name that differ, in one scene or in two; a scene of
/// one name with other photos), or a file cannot be read.
pub(super) fn collect(folders: &[PathBuf], observer: &mut dyn Observer) -> Result<MergedResults, JobError> {
    let mut found = Vec::new();
    for folder in folders {
        let before = found.len();
        find(folder, DEEPEST, &mut found)?;
        if found.len() == before {
            let text = format!("{}: no units of a batch are in it; give the folder of its results", folder.display());
            return Err(JobError::Batch(text));
        }
    }
    check(&found)?;
    let mut by_name: BTreeMap<String, Found> = BTreeMap::new();
    for unit in found {
        let name = unit.asked.name();
        match by_name.remove(&name) {
            None => drop(by_name.insert(name, unit)),
            Some(other) => drop(by_name.insert(name, same(other, unit, observer))),
        }
    }
    let (mut units, mut failed, mut unfinished) = (Vec::new(), Vec::new(), Vec::new());
    for (name, unit) in by_name {
        match (unit.result, unit.failure) {
            (Some(result), _) => units.push(result),
            (None, Some(failure)) => failed.push(failure),
            (None, None) => unfinished.push(name),
        }
    }
    Ok(MergedResults {
        version: VERSION,
        program: env!("CARGO_PKG_VERSION"),
        rows: rows(&units),
        units,
        failed,
        unfinished,
    })
}

/// Returns the one of two folders of a unit that is further along.
fn same(one: Found, other: Found, observer: &mut dyn Observer) -> Found {
    if let (Some(a), Some(b)) = (&one.result, &other.result)
        && one.folder != other.folder
    {
        let same = if a.sha256 == b.sha256 { "the same" } else { "other" };
        let (a, b) = (one.folder.display(), other.folder.display());
        let text = format!("{b} is the unit of {a} once more, with {same} Gaussians; the first one counts");
        observer.note(Severity::Warning, text);
    }
    if one.result.is_none() && (other.result.is_some() || one.failure.is_none()) { other } else { one }
}

fn find(folder: &Path, deepest: usize, found: &mut Vec<Found>) -> Result<(), IoError> {
    let file = folder.join(unit::FILE);
    if file.is_file() {
        if let Some(asked) = stored(&file)? {
            let result: Option<UnitResult> = if is_done(folder) { stored(&folder.join(RESULT))? } else { None };
            if let Some(found) = result.as_ref().map(|r| u64::from(r.version)).filter(|v| *v > u64::from(VERSION)) {
                return Err(IoError::Version { path: folder.join(RESULT), found, supported: u64::from(VERSION) });
            }
            let asked = result.as_ref().map_or(asked, |r| r.asked.clone());
            found.push(Found { folder: folder.into(), asked, result, failure: stored(&folder.join(FAILURE))? });
        }
        return Ok(());
    }
    let entries = std::fs::read_dir(folder).map_err(|cause| IoError::Read { path: folder.into(), cause })?;
    let mut folders: Vec<PathBuf> = entries.flatten().map(|e| e.path()).filter(|p| p.is_dir()).collect();
    folders.sort();
    for folder in folders.iter().filter(|_| deepest > 0) {
        find(folder, deepest - 1, found)?;
    }
    Ok(())
}

/// Refuses units that have the same name and differ.
fn check(found: &[Found]) -> Result<(), JobError> {
    let mut seen: BTreeMap<[&str; 2], (&Found, Value)> = BTreeMap::new();
    for unit in found {
        // Two results of one name must agree in these values.
        let asked = &unit.asked;
        let config = TrainConfig { seed: 0, ..asked.config.clone() };
        let setting = json!({ "config": config, "plan": asked.plan, "objects": asked.objects, "eval": asked.eval });
        let scene = json!({ "masks": asked.masks, "query": asked.query });
        for (kind, name, now) in [("settings", &asked.setting, setting), ("scene", &asked.scene, scene)] {
            let Some((first, before)) = seen.insert([kind, name], (unit, now.clone())) else { continue };
            let others = kind == "scene" && !first.asked.may_have_photos_of(asked);
            let what = if others { Some("other photos".to_owned()) } else { difference(&before, &now) };
            if let Some(what) = what {
                let (a, b) = (first.folder.display(), unit.folder.display());
                return Err(JobError::Batch(format!(
                    "{a} and {b}: the {kind} '{name}' of one is not that of the other ({what}); merge them apart"
                )));
            }
        }
    }
    Ok(())
}

fn rows(units: &[UnitResult]) -> Vec<MergedRow> {
    let mut groups: BTreeMap<(&str, &str), Vec<&UnitResult>> = BTreeMap::new();
    for unit in units {
        groups.entry((&unit.asked.setting, &unit.asked.scene)).or_default().push(unit);
    }
    let row = |((setting, scene), units): (&(&str, &str), &Vec<&UnitResult>)| {
        let of = |value: fn(&UnitResult) -> Option<f64>| MeanStd::of(units.iter().map(|u| value(u)));
        MergedRow {
            setting: (*setting).into(),
            scene: Some((*scene).into()),
            units: units.len(),
            psnr: of(UnitResult::psnr),
            ssim: of(UnitResult::ssim),
            gaussians: of(|u| Some(u.gaussians as f64)),
            training_secs: of(|u| Some(u.secs.training)),
            miou: of(UnitResult::miou),
        }
    };
    let mut rows: Vec<MergedRow> = groups.iter().map(row).collect();
    let mut settings: Vec<String> = rows.iter().map(|r| r.setting.clone()).collect();
    settings.dedup();
    for setting in settings {
        let own: Vec<&MergedRow> = rows.iter().filter(|r| r.setting == setting).collect();
        let over = |value: fn(&MergedRow) -> MeanStd| MeanStd::of(own.iter().map(|r| value(r).mean));
        let all = MergedRow {
            scene: None,
            units: own.iter().map(|r| r.units).sum(),
            psnr: over(|r| r.psnr),
            ssim: over(|r| r.ssim),
            gaussians: over(|r| r.gaussians),
            training_secs: over(|r| r.training_secs),
            miou: over(|r| r.miou),
            setting,
        };
        if own.len() > 1 {
            rows.push(all);
        }
    }
    rows
}

impl MergedResults {
    /// Returns a table with one line per unit that has a result.
    pub(super) fn csv(&self) -> String {
        // Some spreadsheets take text that begins so for a formula.
        let cell = |text: &str| {
            let text = if text.starts_with(['=', '+', '-', '@']) { format!("'{text}") } else { text.to_owned() };
            format!("\"{}\"", text.replace('"', "\"\""))
        };
        let number = |value: Option<f64>| value.map_or_else(String::new, |v| v.to_string());
        let head = "scene,setting,seed,psnr_db,ssim,gaussians,steps,training_s,evaluation_s,objects_s,objects,parts,\
                    miou,host,sha256\n";
        let line = |u: &UnitResult| {
            let found = u.objects.as_ref();
            let counts = found.map_or_else(|| ",".to_owned(), |o| format!("{},{}", o.objects, o.parts));
            let (psnr, ssim, miou) = (number(u.psnr()), number(u.ssim()), number(u.miou()));
            let UnitResult { asked, gaussians, steps, secs, .. } = u;
            let times = format!("{},{},{}", secs.training, secs.evaluation, number(secs.objects));
            format!(
                "{},{},{},{psnr},{ssim},{gaussians},{steps},{times},{counts},{miou},{},{}\n",
                cell(&asked.scene),
                cell(&asked.setting),
                asked.seed,
                cell(&u.host),
                u.sha256
            )
        };
        self.units.iter().fold(head.to_owned(), |all, unit| all + &line(unit))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_is_of_what_is_known() {
        let of = |values: &[Option<f64>]| {
            let MeanStd { mean, deviation } = MeanStd::of(values.iter().copied());
            (mean, deviation)
        };
        assert_eq!(of(&[]), (None, None));
        assert_eq!(of(&[Some(3.0), None]), (Some(3.0), None));
        assert_eq!(of(&[Some(1.0), Some(3.0), Some(f64::INFINITY)]), (Some(2.0), Some(2.0_f64.sqrt())));
    }
}
