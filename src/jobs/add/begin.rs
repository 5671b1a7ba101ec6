//! Beginning of a refinement: the Gaussians of which the added photos say more, the photos to train on, and the budget.

use std::collections::BTreeSet;

use serde::Serialize;

use crate::io::SceneFolder;
use crate::io::TrainedScene;
use crate::jobs::{JobError, Scene};
use crate::math::format::{count, things};
use crate::pipeline::observer::{Interrupted, Observer, Severity};
use crate::pipeline::train::active::{self, ActiveGaussians};
use crate::pipeline::train::refine::{Refinement, RefiningPhoto};
use crate::pipeline::train::{TrainConfig, TrainView, begin_refinement, budget, load_views};
use crate::render::Renderer;
use crate::scene::Dataset;

/// Steps for each added photo, share of the steps of the whole training that a refinement takes at most, and its least
/// number of steps.
const STEPS_PER_PHOTO: u64 = 150;
const MOST_OF_ALL: u64 = 10;
const FEWEST_STEPS: u64 = 300;
/// Share of an old photo from which active Gaussians in it are trained on.
const LEAST_SHARE: f64 = 0.002;
/// Old photos for each added one, and for few added ones.
const OLD_PER_NEW: usize = 8;
const OLD_AT_LEAST: usize = 24;
/// Most turns of an added photo in a round.
const MOST_TURNS: usize = 8;
/// Most Gaussians for each pixel that active ones fill, and least growth of their number.
const MOST_PER_PIXEL: f64 = 0.5;
const LEAST_GROWTH: f64 = 0.25;
/// Growth for each Gaussian that close-ups lack by their pixels.
const GROWTH: f64 = 1.5;
/// Steps on old photos for each on an added one: the old photos are many, and must not get worse. With 4, held-out old
/// photos lost 0.2 to 0.4 dB.
const OLD_STEPS: usize = 8;

/// Number of Gaussians that are refined, for the report.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct RefinedShare {
    /// Gaussians of the scene before.
    pub(crate) gaussians: usize,
    /// Number of those that stay bit for bit.
    pub(crate) frozen: usize,
}

/// Returns the settings of a refinement by `added` photos, and the step from which it goes on.
pub(super) fn settings(scene: &Scene, dataset: &Dataset, added: usize, steps: Option<u64>) -> (TrainConfig, u64) {
    let from = scene.history.steps.last().map_or(scene.config.steps, |s| s.step).max(1);
    let usual = (STEPS_PER_PHOTO * added as u64).min(from / MOST_OF_ALL).max(FEWEST_STEPS);
    let holdout_every = if dataset.test_photos() > 0 { scene.config.holdout_every } else { 0 };
    let config = TrainConfig {
        steps: from + steps.unwrap_or(usual),
        coarse_share: 0.0,
        holdout_every,
        // Gains of all photos are measured before.
        exposure: false,
        ..scene.config.clone()
    };
    (config, from)
}

/// Compares the photos and writes the checkpoint from which the refinement starts. `added` names the added photos, and
/// `located` those of them whose poses were found in the scene.
pub(super) fn begin(
    out: &SceneFolder,
    (scene, trained): (&Scene, TrainedScene),
    dataset: &Dataset,
    (config, from_step): (&TrainConfig, u64),
    [added, located]: [&BTreeSet<String>; 2],
    observer: &mut dyn Observer,
) -> Result<(), JobError> {
    let dataset = &*dataset.with_alpha(config.alpha);
    let settings = scene.settings_beside(dataset);
    let mut cloud = trained.cloud;
    cloud.render_mode = config.render_mode();
    let (train, _) = dataset.split(config.holdout_every);
    let is_added = |i: &usize| added.contains(&dataset.photos[*i].name);
    let (new, old): (Vec<usize>, Vec<usize>) = train.into_iter().partition(is_added);
    let mut load = |indices: &[usize], stage: &str| -> Result<Vec<TrainView>, JobError> {
        Ok(load_views(dataset, indices, config, stage, observer)?.ok_or(Interrupted)?)
    };
    let (new, old) = (load(&new, "Loading added photos")?, load(&old, "Loading photos")?);
    let mut photos = Vec::new();
    let mut corrected = Vec::new();
    let mut renderer = Renderer::new();
    for view in &new {
        let fit = active::fit(&mut renderer, &cloud, view, &settings)?;
        if !fit.fits {
            let text = format!("{} does not look like the scene at its pose, and is left out", view.name);
            observer.note(Severity::Warning, text);
            continue;
        }
        corrected.push(active::corrected(view, fit.gain));
        photos.push(RefiningPhoto {
            name: view.name.clone(),
            turns: 1,
            gain: fit.gain,
            located: located.contains(&view.name),
        });
    }
    if photos.is_empty() {
        let text = "none of the added photos looks like the scene at its pose; were they posed in another frame? Add the \
                    pictures without their poses, so that they are located";
        return Err(JobError::AddPhotos(text.into()));
    }
    let before = active::shown(&cloud, &old.iter().collect::<Vec<_>>(), &settings, false, observer)?;
    let after = active::shown(&cloud, &corrected.iter().collect::<Vec<_>>(), &settings, true, observer)?;
    let active = before.less_than(&after);
    if active.count() == 0 {
        let text =
            "the added photos show nothing of the scene finer or otherwise than its own photos: nothing to refine";
        return Err(JobError::AddPhotos(text.into()));
    }
    let cameras: Vec<_> = old.iter().map(|v| &v.camera).collect();
    let shares = active::shares(&cloud, &active.is, &cameras, &settings, observer)?;
    let beside = beside(&shares, photos.len());
    let turns = beside.len().div_ceil(OLD_STEPS * photos.len()).clamp(1, MOST_TURNS) as u32;
    photos.iter_mut().for_each(|p| p.turns = turns);
    for view in beside.iter().map(|&i| &old[i]) {
        // Where exposures were learned, these photos have one, too.
        let gain =
            if scene.config.exposure { active::fit(&mut renderer, &cloud, view, &settings)?.gain } else { [1.0; 3] };
        photos.push(RefiningPhoto { name: view.name.clone(), turns: 1, gain, located: false });
    }
    let most = most_gaussians(&active, cloud.len(), before.pixels());
    let text = format!(
        "{} of {} Gaussians are refined, by {} and {} that show them; the others stay",
        count(active.count() as u64),
        count(cloud.len() as u64),
        things(corrected.len(), "added photo"),
        things(beside.len(), "other")
    );
    observer.note(Severity::Info, text);
    let frozen = cloud.len() - active.count();
    let refinement = Refinement { from_step, frozen, photos };
    let history = trained.info.history;
    begin_refinement(out, dataset, cloud.select(&active.order()), (config, most), (refinement, history))?;
    Ok(())
}

/// Returns the old photos to train on, by index: those that active Gaussians fill most, in their order.
fn beside(shares: &[f64], added: usize) -> Vec<usize> {
    let mut all: Vec<usize> = (0..shares.len()).filter(|i| shares[*i] >= LEAST_SHARE).collect();
    all.sort_by(|a, b| shares[*b].total_cmp(&shares[*a]).then(a.cmp(b)));
    all.truncate((OLD_PER_NEW * added).max(OLD_AT_LEAST));
    all.sort_unstable();
    all
}

/// Returns the budget: somewhat more Gaussians for a pixel of the close-ups than there were for one of the old photos, of
/// which all Gaussians fill so many.
fn most_gaussians(active: &ActiveGaussians, before: usize, old_pixels: f64) -> usize {
    let now = active.count() as f64;
    let per_pixel = (before as f64 / old_pixels.max(1.0)).min(MOST_PER_PIXEL);
    let growth = (GROWTH * (per_pixel * active.pixels - now)).max(LEAST_GROWTH * now);
    (before + growth as usize).min(budget::gaussians().max(before))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_photos_of_what_is_refined_are_trained_on_and_growth_follows_the_pixels() {
        assert_eq!(beside(&[0.5, 0.0, 0.1, 0.001], 1), [0, 2]);
        let many: Vec<f64> = (0..100).map(|i| 0.01 * f64::from(i)).collect();
        assert_eq!(beside(&many, 1).len(), OLD_AT_LEAST);
        assert_eq!(beside(&many, 5), (60..100).collect::<Vec<_>>());
        let active = |n: usize, pixels: f64| ActiveGaussians { is: vec![true; n], pixels };
        assert_eq!(most_gaussians(&active(100, 1_000.0), 300, 300.0), 900, "half of a Gaussian for a pixel at most");
        assert_eq!(most_gaussians(&active(100, 1_000.0), 300, 1_500.0), 450);
        assert_eq!(most_gaussians(&active(100, 10.0), 300, 300.0), 325);
    }
}
