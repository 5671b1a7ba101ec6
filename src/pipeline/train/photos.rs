//! Photos ready for comparison: loaded, undistorted, scaled, without borders.

use std::time::{Duration, Instant};

use rayon::prelude::*;

use super::border::Borders;
use super::{TrainConfig, TrainError, TrainView};
use crate::io::IoError;
use crate::pipeline::observer::{Level, Observer, Progress, Signal};
use crate::scene::Dataset;

/// Loads and scales photos, several at a time; `None` if the observer cancels.
pub fn load_views(
    dataset: &Dataset,
    indices: &[usize],
    config: &TrainConfig,
    stage: &str,
    observer: &mut dyn Observer,
) -> Result<Option<Vec<TrainView>>, TrainError> {
    let start = Instant::now();
    let (training, _) = dataset.split(config.holdout_every);
    let borders = Borders::of(dataset, &training, config.max_side_px).map_err(TrainError::Photo)?;
    if borders.share() > 0.0 {
        let percent = 100.0 * borders.share();
        observer.note(Level::Info, format!("{stage}: a black border ({percent:.1}% of the picture) is left out"));
    }
    let mut views = Vec::with_capacity(indices.len());
    for batch in indices.chunks(8) {
        if wait(observer) == Signal::Cancel {
            return Ok(None);
        }
        let loaded: Result<Vec<TrainView>, IoError> = batch
            .par_iter()
            .map(|&i| {
                let photo = &dataset.photos[i];
                let pixels = borders.load(photo)?;
                let camera = photo.camera.resized(pixels.width_px, pixels.height_px);
                Ok(TrainView { name: photo.name.clone(), camera, pixels })
            })
            .collect();
        views.extend(loaded.map_err(TrainError::Photo)?);
        let secs = start.elapsed().as_secs_f64();
        observer.progress(Progress {
            stage: stage.into(),
            done: views.len() as u64,
            total: indices.len() as u64,
            elapsed_secs: secs,
            rate: views.len() as f64 / secs.max(1e-9),
        });
    }
    Ok(Some(views))
}

/// Waits out a pause.
pub(super) fn wait(observer: &mut dyn Observer) -> Signal {
    loop {
        match observer.signal() {
            Signal::Pause => std::thread::sleep(Duration::from_millis(20)),
            other => return other,
        }
    }
}
