//! Removed things that the photos still show: their pixels are not used.

use super::super::error::FindError;
use super::super::removed::RemovedThings;
use super::super::segmenter::FoundMask;
use super::super::votes::UNKNOWN;
use super::{Tracker, undrawn};
use crate::render::{RenderError, RenderSettings, Renderer};
use crate::scene::{Camera, IdentityId, Mask};

/// Least share of a mask that must be left without the removed things.
const LEFT: f64 = 0.5;

/// Returns the pixels of a photo's view that show removed things; `None` if nothing was removed.
pub(super) fn pixels(
    renderer: &mut Renderer,
    removed: Option<&RemovedThings>,
    camera: &Camera,
    settings: &RenderSettings,
) -> Result<Option<Vec<bool>>, RenderError> {
    removed.map(|removed| removed.shows(renderer, camera, settings)).transpose()
}

/// Returns the masks without the pixels of removed things; and all of those pixels, if there are any.
pub(super) fn masks_left(
    tracker: &mut Tracker<'_>,
    photo: usize,
    found: Vec<FoundMask>,
) -> Result<(Vec<FoundMask>, Option<Vec<bool>>), FindError> {
    let photo = &tracker.photos[photo];
    let camera = photo.camera.limited_to(tracker.options.max_side_px);
    let gone = pixels(tracker.renderers.one(), tracker.removed.as_ref(), &camera, tracker.settings);
    let mut gone = gone.map_err(|e| undrawn(photo, e))?;
    // Earlier versions recorded removed things by name alone.
    let is_gone = |m: &&FoundMask| m.name.as_ref().is_some_and(|name| tracker.options.removed_names.contains(name));
    for mask in found.iter().filter(is_gone) {
        let size = mask.mask.width_px() * mask.mask.height_px();
        let all = gone.get_or_insert_with(|| vec![false; size]);
        mask.mask.pixels().for_each(|i| all[i] = true);
    }
    match gone {
        Some(gone) => Ok((still_there(found, &gone), Some(gone))),
        None => Ok((found, None)),
    }
}

/// Sets the labels of removed pixels to `UNKNOWN`.
pub(super) fn forget(labels: &mut [IdentityId], gone: Option<&Vec<bool>>) {
    let gone = gone.into_iter().flatten();
    labels.iter_mut().zip(gone).filter(|(_, gone)| **gone).for_each(|(label, _)| *label = UNKNOWN);
}

/// Returns the masks without the pixels that are `gone`; masks that lose most of their pixels are dropped.
fn still_there(found: Vec<FoundMask>, gone: &[bool]) -> Vec<FoundMask> {
    let mut now: Vec<Option<usize>> = Vec::with_capacity(found.len());
    let mut left: Vec<FoundMask> = Vec::new();
    for mask in found {
        let own = &mask.mask;
        let mut is_left = vec![false; own.width_px() * own.height_px()];
        own.pixels().filter(|i| !gone[*i]).for_each(|i| is_left[i] = true);
        let rest = Mask::from_fn(own.width_px(), own.height_px(), |i| is_left[i]);
        if (rest.area() as f64) < LEFT * own.area() as f64 {
            // Its remaining pieces become pieces of its whole.
            now.push(mask.parent.and_then(|p| now[p]));
            continue;
        }
        let parent = mask.parent.and_then(|p| now[p]);
        now.push(Some(left.len()));
        left.push(FoundMask { parent, mask: rest, ..mask });
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Level;

    #[test]
    fn masks_lose_what_is_gone_and_those_of_it_are_no_masks() {
        let mask = |level, parent, pixels: std::ops::Range<usize>| FoundMask {
            level,
            parent,
            name: None,
            mask: Mask::from_fn(10, 10, |i| pixels.contains(&i)),
        };
        // A table on which a lamp with a shade stood, and a drawer of the table.
        let found = vec![
            mask(Level::Object, None, 0..60),
            mask(Level::Object, None, 60..90),
            mask(Level::Part, Some(1), 80..90),
            mask(Level::Part, Some(0), 10..20),
        ];
        let gone: Vec<bool> = (0..100).map(|i| (55..90).contains(&i)).collect();
        let left = still_there(found.clone(), &gone);
        let areas: Vec<_> = left.iter().map(|m| (m.parent, m.mask.area())).collect();
        assert_eq!(areas, [(None, 55), (Some(0), 10)]);
        assert_eq!(still_there(found.clone(), &[false; 100]), found, "the control");
        let mut labels = vec![1; 100];
        forget(&mut labels, Some(&gone));
        assert_eq!(labels.iter().filter(|l| **l == UNKNOWN).count(), 35);
        forget(&mut labels, None);
        assert_eq!(labels.iter().filter(|l| **l == UNKNOWN).count(), 35);
    }
}
