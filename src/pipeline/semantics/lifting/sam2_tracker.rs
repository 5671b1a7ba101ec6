//! Masks of one photo followed to the others by SAM 2, photo by photo in their order, as in the paper. Needs no
//! Gaussians. Frames are encoded once, and the track of each mask is kept, so that a canceled run resumes with its
//! current photo and mask.

use std::path::PathBuf;

use sha2::{Digest, Sha256};

use super::error::FindError;
use super::frame_cache::{FrameCache, cache_name, written};
use super::prompt_points::prompt_points;
use super::segmenter::FoundMask;
use super::track_cache::{self, TrackCache};
use super::votes::UNKNOWN;
use crate::io::files::hex;
use crate::models::ModelError;
use crate::models::catalog::{self, ModelRole};
use crate::models::sam2::Sam2;
use crate::models::sam2::track::{Prompt, Track, mask_of};
use crate::pipeline::observer::{Interrupted, Observer, Ticker};
use crate::scene::{IdentityId, Mask, MaskPrompt, Photo};

pub(crate) const LABEL_SIDE_PX: u32 = 512;

pub(crate) struct Sam2Tracker {
    model: Sam2,
    cache: Option<PathBuf>,
    /// Seconds of encoding frames, reading kept ones included.
    pub(crate) encode_secs: f64,
}

impl Sam2Tracker {
    /// Opens the SAM 2 of this name: a model of the catalog, or the path of a description. Frames are kept in
    /// `cache`.
    pub(crate) fn open(name: &str, cache: Option<PathBuf>) -> Result<Self, ModelError> {
        Ok(Self { model: Sam2::open(&catalog::find(name, ModelRole::Segmenter)?)?, cache, encode_secs: 0.0 })
    }

    /// Returns the label of every pixel of every photo, scaled to at most [`LABEL_SIDE_PX`], row-major: the number in
    /// `ids` of the innermost mask that was followed there. Other pixels are `UNKNOWN`, because an unmarked pixel may
    /// be anything.
    pub(crate) fn follow(
        &mut self,
        photos: &[Photo],
        seed: usize,
        (found, ids): (&[FoundMask], &[IdentityId]),
        prompt: MaskPrompt,
        observer: &mut dyn Observer,
    ) -> Result<Vec<Vec<IdentityId>>, FindError> {
        let size = |photo: &Photo| {
            let camera = photo.camera.limited_to(LABEL_SIDE_PX);
            (camera.width_px as usize, camera.height_px as usize)
        };
        let sizes: Vec<(usize, usize)> = photos.iter().map(size).collect();
        let mut labels: Vec<Vec<IdentityId>> = sizes.iter().map(|(w, h)| vec![UNKNOWN; w * h]).collect();
        let of_photo = |photo| cache_name((&self.model.about.name, self.model.digest()), photo, written(photo));
        let of_photos: Vec<String> = photos.iter().map(of_photo).collect();
        let mut ticker = Ticker::new("Tracking masks", found.len() * photos.len());
        for (k, (mask, id)) in found.iter().zip(ids).enumerate() {
            let mask = mask.mask.resized(sizes[seed].0, sizes[seed].1);
            let file = self.cache.as_ref().map(|folder| folder.join(track_name(&of_photos, seed, &mask, prompt)));
            let done = k * photos.len();
            let masks = match file.as_deref().and_then(|file| track_cache::read(file, &sizes)) {
                Some(masks) => masks,
                None => {
                    let mut seen = |n: usize| ticker.tick(done + n, observer);
                    let mut history = TrackCache::open(file.as_deref());
                    let masks = self.follow_one((photos, &sizes), (seed, &mask, prompt), &mut history, &mut seen)?;
                    // A failed write (a full disk) only costs time later.
                    let _ = file.map(|file| track_cache::write(&file, &masks));
                    masks
                }
            };
            for (labels, mask) in labels.iter_mut().zip(&masks) {
                mask.pixels().for_each(|i| labels[i] = *id);
            }
            ticker.tick(done + photos.len(), observer)?;
        }
        Ok(labels)
    }
    /// Returns a mask of the photo `seed` in all photos. `seen` receives the number of finished photos.
    fn follow_one(
        &mut self,
        (photos, sizes): (&[Photo], &[(usize, usize)]),
        (seed, mask, prompt): (usize, &Mask, MaskPrompt),
        history: &mut TrackCache,
        seen: &mut dyn FnMut(usize) -> Result<(), Interrupted>,
    ) -> Result<Vec<Mask>, FindError> {
        let folder = self.cache.clone();
        let mut frames = FrameCache { photos, folder, kept: None, secs: &mut self.encode_secs };
        let mut track = Track::new(&mut self.model, &mut frames, sizes[seed]);
        let prompt = match prompt {
            MaskPrompt::Points => Prompt::Points { points: prompt_points(mask), around: None },
            MaskPrompt::Mask => Prompt::Mask(mask.clone()),
        };
        track.prompt(seed, 0, &prompt)?;
        let mut masks: Vec<Mask> = sizes.iter().map(|(w, h)| Mask::empty(*w, *h)).collect();
        let (mut done, mut end) = (0, Ok(()));
        for backward in [false, true] {
            track.resume(backward, history, |frame, found| {
                // The seed is passed in both directions.
                done += usize::from(!(backward && frame == seed));
                found.values().for_each(|out| masks[frame] = mask_of(out, sizes[frame]));
                end = seen(done);
                end.is_ok()
            })?;
            end?;
        }
        Ok(masks)
    }
}

/// Returns the file name of a mask's track: another one for other photos, another mask or another prompt.
fn track_name(of_photos: &[String], seed: usize, mask: &Mask, prompt: MaskPrompt) -> String {
    let mut sum = Sha256::new();
    of_photos.iter().for_each(|name| sum.update(name));
    sum.update(format!("{seed} {prompt} {}", mask.width_px()));
    mask.pixels().for_each(|i| sum.update((i as u64).to_le_bytes()));
    format!("{}.track", hex(&sum.finalize()[..12]))
}
