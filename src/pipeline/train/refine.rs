//! Refinement of a finished training by photos that were added to it: some Gaussians go on, the others stay bit for bit.
//!
//! Gaussians that stay are the first of the cloud, in their old order, so that a number tells them apart; density
//! control keeps the order and puts new ones at the end. The checkpoint stores a [`Refinement`], so a refinement resumes
//! as any training does.

use serde::{Deserialize, Serialize};

use super::TrainView;
use crate::scene::{Dataset, PhotoPixels};

/// Deviation of a gain from 1 up to which a photo is taken as it is.
const SAME_EXPOSURE: f32 = 0.02;

/// A finished training that goes on.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Refinement {
    /// Step at which it was finished.
    pub(crate) from_step: u64,
    /// Gaussians at the front of the cloud that stay as they are.
    pub(crate) frozen: usize,
    /// Photos that the refinement is trained on.
    pub(crate) photos: Vec<RefiningPhoto>,
}

/// A photo that a refinement is trained on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RefiningPhoto {
    pub(crate) name: String,
    /// Turns in each round.
    pub(crate) turns: u32,
    /// Gain of its colors against the scene's, by channel.
    pub(crate) gain: [f32; 3],
    /// True if its pose was found in the scene, and is refined.
    #[serde(default)]
    pub(crate) located: bool,
}

/// Returns the photos of a round, by index: each as often as it has turns, or once if `turns` is empty.
pub(super) fn round(photos: usize, turns: &[u32]) -> Vec<u32> {
    let times = |i: u32| turns.get(i as usize).copied().unwrap_or(1) as usize;
    (0..photos as u32).flat_map(|i| std::iter::repeat_n(i, times(i))).collect()
}

/// Returns those of the training photos that a refinement uses, by index; all of them in other runs.
pub(super) fn those_of(refinement: Option<&Refinement>, dataset: &Dataset, train: Vec<usize>) -> Vec<usize> {
    let Some(refinement) = refinement else { return train };
    let is_used = |i: &usize| refinement.photos.iter().any(|p| p.name == dataset.photos[*i].name);
    train.into_iter().filter(is_used).collect()
}

/// Returns which poses and exposures of a run are free: in a refinement those of located photos.
pub(super) fn free(refinement: Option<&Refinement>, views: &[TrainView]) -> Vec<bool> {
    let is_free = |v: &TrainView, r: &Refinement| r.photos.iter().any(|p| p.located && p.name == v.name);
    views.iter().map(|v| refinement.is_none_or(|r| is_free(v, r))).collect()
}

/// Divides the gains out of the photos of a refinement.
pub(super) fn absorb(refinement: Option<&Refinement>, views: &mut [TrainView]) {
    for photo in refinement.into_iter().flat_map(|r| &r.photos) {
        views.iter_mut().filter(|v| v.name == photo.name).for_each(|v| without_gain(&mut v.pixels, photo.gain));
    }
}

/// Divides a gain out of a photo, unless it is nearly 1.
pub(super) fn without_gain(pixels: &mut PhotoPixels, gain: [f32; 3]) {
    let is_usual = gain.iter().all(|g| (g - 1.0).abs() <= SAME_EXPOSURE);
    if is_usual || gain.iter().any(|g| !(g.is_finite() && *g > 0.0)) {
        return;
    }
    let table: [[u8; 256]; 3] =
        gain.map(|gain| std::array::from_fn(|value| (value as f32 / gain).round().clamp(0.0, 255.0) as u8));
    for rgb in &mut pixels.rgb {
        *rgb = std::array::from_fn(|c| table[c][usize::from(rgb[c])]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn photos_have_their_turns_and_gains_are_divided_out() {
        assert_eq!(round(3, &[]), [0, 1, 2]);
        assert_eq!(round(3, &[2, 0, 1]), [0, 0, 2]);
        let photo = |gain| {
            let mut pixels =
                PhotoPixels { width_px: 1, height_px: 1, rgb: vec![[120, 60, 250]], coverage: None, alpha: None };
            without_gain(&mut pixels, gain);
            pixels.rgb[0]
        };
        assert_eq!(photo([1.2, 0.5, 0.5]), [100, 120, 255]);
        assert_eq!(photo([1.01; 3]), [120, 60, 250], "nearly 1");
        assert_eq!(photo([f32::NAN, 1.0, 1.0]), [120, 60, 250]);
    }
}
