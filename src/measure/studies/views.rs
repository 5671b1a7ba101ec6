//! The views that are compared: a few held-out photos, evenly spread.

use crate::pipeline::observer::Observer;
use crate::pipeline::train::{TrainConfig, TrainError, load_views};
use crate::scene::{Camera, Dataset, PhotoPixels};

/// A camera, and what a photo shows from there if there is one.
pub(crate) type StudyView = (Camera, Option<PhotoPixels>);

/// At most `count` held-out photos, their longer side at most `max_side_px`; `None` if the observer
/// cancels.
pub(crate) fn held_out(
    dataset: &Dataset,
    holdout_every: usize,
    max_side_px: u32,
    count: usize,
    observer: &mut dyn Observer,
) -> Result<Option<Vec<StudyView>>, TrainError> {
    let config = TrainConfig { max_side_px, holdout_every, ..TrainConfig::default() };
    let chosen = spread(&dataset.split(holdout_every).1, count);
    let loaded = load_views(dataset, &chosen, &config, "Loading held-out photos", observer)?;
    Ok(loaded.map(|views| views.into_iter().map(|v| (v.camera, Some(v.pixels))).collect()))
}

/// At most `count` of them, evenly spread.
pub(crate) fn spread<T: Clone>(all: &[T], count: usize) -> Vec<T> {
    let count = count.min(all.len());
    (0..count).map(|k| all[k * all.len() / count].clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_are_spread_over_many() {
        let all: Vec<usize> = (0..10).collect();
        assert_eq!(spread(&all, 4), [0, 2, 5, 7]);
        assert_eq!(spread(&all[..2], 4).len(), 2);
        assert!(spread::<u8>(&[], 4).is_empty());
    }
}
