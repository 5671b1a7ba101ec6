//! End of a refinement: what stayed the same, what got better or worse, and parts that masks of the added photos show.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::io::joined::{AddedPhoto, JoinedPhotos};
use crate::io::labels::Labels;
use crate::io::{SceneFolder, semantic_map, trained};
use crate::jobs::{JobError, Scene, open};
use crate::pipeline::observer::{Evaluation, Observer, Severity};
use crate::pipeline::semantics::lifting::build_map::{REGIONS, segmenter};
use crate::pipeline::semantics::lifting::closer::closer;
use crate::pipeline::semantics::lifting::tracker::TrackOptions;
use crate::scene::{GaussianCloud, MaskGrid, Photo};

/// Mean PSNR of the held-out photos of the scene before, dB.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct HeldOutScores {
    pub(crate) photos: usize,
    pub(crate) before: f64,
    pub(crate) now: f64,
}

/// Returns the first of the folders that holds masks of an added photo.
pub(super) fn masks_among(roots: &[PathBuf], added: &[AddedPhoto]) -> Option<PathBuf> {
    let photos: Vec<Photo> = added.iter().map(|p| p.photo(Path::new(""))).collect();
    let has = |root: &&PathBuf| {
        Labels::of_photos(root, &photos).is_ok_and(|labels| photos.iter().any(|photo| labels.has(photo)))
    };
    roots.iter().find(has).cloned()
}

/// Returns whether the first `frozen` Gaussians of `now` are some of `before`, in their order, bit for bit.
pub(super) fn is_unchanged(before: &GaussianCloud, now: &GaussianCloud, frozen: usize) -> bool {
    let mut rest = 0..before.len();
    let stays = |i: usize| rest.any(|k| bits(before, k).eq(bits(now, i)));
    frozen <= now.len() && before.origin == now.origin && (0..frozen).all(stays)
}

fn bits(cloud: &GaussianCloud, i: usize) -> impl Iterator<Item = u32> {
    let g = cloud.gaussian(i);
    let all = g.position.into_iter().chain(g.log_scale).chain(g.quaternion).chain([g.opacity_logit]);
    all.chain(g.sh.as_flattened().iter().copied()).map(f32::to_bits)
}

/// Compares the last evaluations before and now on the held-out photos that were there before.
pub(super) fn held_out_scores(before: &Scene, now: &[Evaluation], added: &BTreeSet<String>) -> Option<HeldOutScores> {
    let (old, new) = (before.history.evaluations.last()?, now.last()?);
    let pairs: Vec<[f64; 2]> = old
        .views
        .iter()
        .filter(|v| !added.contains(&v.name))
        .filter_map(|v| Some([v.psnr, new.views.iter().find(|n| n.name == v.name)?.psnr]))
        .collect();
    let mean = |k: usize| pairs.iter().map(|p| p[k]).sum::<f64>() / pairs.len() as f64;
    (!pairs.is_empty()).then(|| HeldOutScores { photos: pairs.len(), before: mean(0), now: mean(1) })
}

/// Adds the identities that masks of the added photos show to the scene in `out`, and stores them; returns their number.
/// Photos whose masks are in it already are left out.
pub(super) fn closer_parts(
    (out, photos): (&Path, &Path),
    list: &JoinedPhotos,
    (masks, by): (Option<&Path>, Option<&str>),
    frozen: usize,
    observer: &mut dyn Observer,
) -> Result<usize, JobError> {
    let scene = open::scene(out)?;
    let cloud = trained::load(out)?.cloud;
    let Some(known) = semantic_map::load(out, scene.state.as_deref(), &cloud)? else { return Ok(0) };
    let is_open = |p: &&AddedPhoto| !p.held_out && !known.seeds.contains(&p.name);
    let new: Vec<Photo> = list.added.iter().filter(is_open).map(|p| p.photo(photos)).collect();
    if new.is_empty() || (masks.is_none() && by.is_none()) {
        if by.is_none() && !new.is_empty() {
            let text = "The added photos have no masks, so they name no parts; --masks or --segmenter does";
            observer.note(Severity::Info, text.into());
        }
        return Ok(0);
    }
    let labels = masks.map(|masks| Labels::of_photos(masks, &new)).transpose()?;
    labels.iter().flat_map(|l| l.notes()).for_each(|note| observer.note(Severity::Warning, note.clone()));
    let network = by.filter(|by| *by != REGIONS).map(|name| (name, MaskGrid::default()));
    let mut segmenter = segmenter(labels, &cloud, &scene.settings, network, out.join("cache"))?;
    let side_px = TrackOptions::default().max_side_px;
    let map = closer(&known, (&cloud, frozen), &new, (&scene.settings, side_px), &mut *segmenter, observer)?;
    let named = map.identities.len() - known.identities.len();
    SceneFolder::hold(out, "adding parts")?.save_map(scene.state.as_deref(), &map, &cloud)?;
    Ok(named)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaussians_that_stay_are_compared_bit_for_bit() {
        let cloud = |xs: &[f32]| GaussianCloud {
            sh: vec![[0.5; 3]; xs.len()],
            ..GaussianCloud::isotropic(xs.iter().map(|x| [*x, 0.0, 0.0]).collect(), -1.0, 0.0)
        };
        let before = cloud(&[1.0, 2.0, 3.0, 4.0]);
        assert!(is_unchanged(&before, &cloud(&[1.0, 3.0, 9.0]), 2));
        assert!(!is_unchanged(&before, &cloud(&[1.0, 3.0, 9.0]), 3), "the control: the third is another");
        assert!(!is_unchanged(&before, &cloud(&[3.0, 1.0]), 2), "another order");
        let mut moved = cloud(&[1.0, 3.0]);
        moved.sh[1][2] = f32::from_bits(0.5_f32.to_bits() + 1);
        assert!(!is_unchanged(&before, &moved, 2), "one bit");
    }
}
