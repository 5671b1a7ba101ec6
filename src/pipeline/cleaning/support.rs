//! Support of each Gaussian by photos, and the fit of its color to them.

use super::{CleanError, SmallView};
use crate::math::lanes::Lane;
use crate::pipeline::observer::{Observer, Ticker};
use crate::render::{ContributionSink, RenderSettings, Renderer, TILE_PX};
use crate::scene::{GaussianCloud, PhotoPixels};

/// Least share of a pixel for a photo to show a Gaussian.
const SHOWN: f32 = 0.05;

/// Evidence of the photos for each Gaussian.
pub(super) struct PhotoSupport {
    /// Largest share of a pixel in any photo.
    pub(super) largest: Vec<f32>,
    /// Number of photos that show it.
    pub(super) photos: Vec<f32>,
    /// Root mean square difference of its color from the photos; 0 if none shows it. `None` without photos.
    pub(super) error: Option<Vec<f32>>,
}

pub(super) fn look(
    cloud: &GaussianCloud,
    views: &[SmallView],
    settings: &RenderSettings,
    observer: &mut dyn Observer,
) -> Result<PhotoSupport, CleanError> {
    let n = cloud.len();
    let colors = super::colors(cloud);
    let (mut largest, mut photos) = (vec![0.0_f32; n], vec![0.0_f32; n]);
    let (mut weight, mut difference) = (vec![0.0_f64; n], vec![0.0_f64; n]);
    let mut renderer = Renderer::new();
    let mut ticker = Ticker::new("Looking for support in photos", views.len());
    for (k, (camera, photo)) in views.iter().enumerate() {
        ticker.tick(k, observer)?;
        let mut rows: Vec<Row<'_>> = (0..camera.height_px.div_ceil(TILE_PX as u32))
            .map(|_| Row { photo: photo.as_ref(), width: camera.width_px as usize, colors: &colors, seen: Vec::new() })
            .collect();
        renderer.contributions(cloud, camera, settings, &mut rows)?;
        let mut here = vec![0.0_f32; n];
        for Seen { gaussian, largest, weight: w, difference: d } in rows.iter().flat_map(|row| &row.seen) {
            let i = *gaussian as usize;
            here[i] = here[i].max(*largest);
            weight[i] += f64::from(*w);
            difference[i] += f64::from(*d);
        }
        for (i, here) in here.into_iter().enumerate() {
            largest[i] = largest[i].max(here);
            photos[i] += f32::from(here >= SHOWN);
        }
    }
    let has_photos = views.iter().any(|(_, photo)| photo.is_some());
    let rms = |(w, d): (&f64, &f64)| if *w > 0.0 { (d / w).sqrt() as f32 } else { 0.0 };
    Ok(PhotoSupport { largest, photos, error: has_photos.then(|| weight.iter().zip(&difference).map(rms).collect()) })
}

/// Share and color error of a Gaussian in a row of tiles.
struct Seen {
    gaussian: u32,
    largest: f32,
    /// Sum of its shares of pixels, and the same times the squared difference of its color from theirs.
    weight: f32,
    difference: f32,
}

struct Row<'a> {
    photo: Option<&'a PhotoPixels>,
    width: usize,
    colors: &'a [[f32; 3]],
    seen: Vec<Seen>,
}

impl ContributionSink<f32> for Row<'_> {
    fn add(&mut self, gaussian: u32, x: usize, y: usize, weights: &Lane<f32>) {
        let mut new = Seen { gaussian, largest: 0.0, weight: 0.0, difference: 0.0 };
        for (k, w) in weights.iter().enumerate().take(self.width.saturating_sub(x)) {
            new.largest = new.largest.max(*w);
            let Some(there) = self.photo.and_then(|photo| color(photo, y * self.width + x + k)) else { continue };
            let own = self.colors[gaussian as usize];
            new.weight += w;
            new.difference += w * (0..3).map(|c| (own[c] - there[c]).powi(2)).sum::<f32>() / 3.0;
        }
        match self.seen.last_mut().filter(|last| last.gaussian == gaussian) {
            Some(last) => {
                last.largest = last.largest.max(new.largest);
                last.weight += new.weight;
                last.difference += new.difference;
            }
            None if new.largest > 0.0 => self.seen.push(new),
            None => {}
        }
    }
}

/// Returns the color of a pixel, 0 to 1; `None` if the photo does not cover it.
pub(super) fn color(photo: &PhotoPixels, pixel: usize) -> Option<[f32; 3]> {
    let covered = photo.coverage.as_ref().is_none_or(|c| c[pixel] > 0);
    covered.then(|| photo.rgb[pixel].map(|v| f32::from(v) / 255.0))
}
