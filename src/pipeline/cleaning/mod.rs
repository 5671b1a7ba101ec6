//! Cleaning: measures of each Gaussian that distinguish floaters, needles and haze from Gaussians that photos support.
//!
//! Nothing is deleted here: measures become selections ([`CleanRule`]), which the user reviews before they are applied.

mod floaters;
pub(crate) mod neighbors;
mod pieces;
mod rules;
mod support;

use rayon::prelude::*;

pub(crate) use self::rules::{CleanRule, RuleError};
use crate::io::{self, IoError};
use crate::math::Real;
use crate::math::stats::median;
use crate::pipeline::observer::{Interrupted, Observer, Ticker};
use crate::render::{RenderError, RenderSettings};
use crate::scene::{Bounds, Camera, GaussianCloud, Photo, PhotoPixels};

/// Rank of the neighbor whose distance measures the isolation of a Gaussian.
const LONELY: usize = 4;
/// Side of the pictures in which support is measured, px.
const SIDE_PX: u32 = 320;

/// Measure of a Gaussian.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, strum::VariantArray, strum::IntoStaticStr, strum::EnumString)]
#[strum(serialize_all = "lowercase")]
pub enum SplatMeasure {
    /// Largest standard deviation, scene units.
    Size,
    /// Ratio of the largest standard deviation to the second: 1 for a disc or a ball, more for a needle.
    Elongation,
    /// 0 to 1.
    Opacity,
    /// Distance to its fourth neighbor; 1 is typical of the scene.
    Spacing,
    /// Number of Gaussians in its connected piece.
    Piece,
    /// Largest blending weight in a pixel of any photo.
    Weight,
    /// Number of photos that show it.
    Photos,
    /// Root mean square difference of its color from the photos that show it, 0 to 1.
    Error,
}

impl SplatMeasure {
    /// Name on the command line and on screen.
    pub(crate) fn word(self) -> &'static str {
        self.into()
    }

    /// True if its values span orders of magnitude.
    pub(crate) fn is_logarithmic(self) -> bool {
        matches!(self, Self::Size | Self::Elongation | Self::Spacing | Self::Piece)
    }

    /// Description for display.
    pub(crate) fn meaning(self) -> &'static str {
        match self {
            Self::Size => "largest standard deviation, in scene units",
            Self::Elongation => "largest standard deviation over the second: needles have much",
            Self::Opacity => "opacity, 0 to 1",
            Self::Spacing => "distance of the fourth neighbor; 1 is usual in this scene",
            Self::Piece => "Gaussians that it hangs together with",
            Self::Weight => "largest share of a pixel in any photo, 0 to 1",
            Self::Photos => "photos that show it",
            Self::Error => "difference of its color from the photos, root mean square, 0 to 1",
        }
    }
}

/// Camera, with its photo if available, that may support Gaussians.
#[derive(Clone, Debug)]
pub(crate) struct CleanView {
    pub(crate) camera: Camera,
    /// The photo, if available.
    pub(crate) photo: Option<Photo>,
}

/// Camera of a small picture, and the photo at that size, if available.
type SmallView = (Camera, Option<PhotoPixels>);

/// Loads every photo once, because each is used several times.
fn small(views: &[CleanView], observer: &mut dyn Observer) -> Result<Vec<SmallView>, CleanError> {
    let mut ticker = Ticker::new("Loading photos", views.len());
    let mut all = Vec::new();
    for (k, view) in views.iter().enumerate() {
        ticker.tick(k, observer)?;
        all.push(match &view.photo {
            None => (view.camera.limited_to(SIDE_PX), None),
            Some(photo) => {
                let pixels = io::photo::load(photo, SIDE_PX)?;
                (photo.camera.resized(pixels.width_px, pixels.height_px), Some(pixels))
            }
        });
    }
    Ok(all)
}

/// Reasons for which a scene cannot be measured.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum CleanError {
    #[error(transparent)]
    Io(#[from] IoError),
    #[error(transparent)]
    Render(#[from] RenderError),
    #[error("canceled")]
    Interrupted(#[from] Interrupted),
}

/// Measures of all Gaussians of a cloud.
#[derive(Clone, Debug, Default)]
pub(crate) struct CloudMeasures {
    values: Vec<(SplatMeasure, Vec<f32>)>,
    /// True for each Gaussian of a floater.
    floaters: Vec<bool>,
    /// View-independent colors, 0 to 1 as displayed.
    colors: Vec<[f32; 3]>,
    /// Half the diagonal of the scene without stray Gaussians, scene units.
    radius: f64,
}

impl CloudMeasures {
    /// Returns the measures of the Gaussians that are not `gone`, without measuring again.
    pub(crate) fn without(&self, gone: &[bool]) -> Self {
        fn left<T: Copy>(of: &[T], gone: &[bool]) -> Vec<T> {
            of.iter().zip(gone).filter(|(_, gone)| !**gone).map(|(v, _)| *v).collect()
        }
        let values = self.values.iter().map(|(measure, values)| (*measure, left(values, gone))).collect();
        let (floaters, colors) = (left(&self.floaters, gone), left(&self.colors, gone));
        Self { values, floaters, colors, radius: self.radius }
    }

    /// Values of a measure, `[n]`; `None` without the photos that it needs.
    pub(crate) fn get(&self, measure: SplatMeasure) -> Option<&[f32]> {
        self.values.iter().find(|(of, _)| *of == measure).map(|(_, values)| values.as_slice())
    }
}

/// Measures all Gaussians; `views` are the training photos, as far as they are known.
///
/// # Errors
/// If a photo cannot be read, a view cannot be rendered, or the observer cancels.
pub(crate) fn measure(
    cloud: &GaussianCloud,
    views: &[CleanView],
    settings: &RenderSettings,
    observer: &mut dyn Observer,
) -> Result<CloudMeasures, CleanError> {
    let radius = Bounds::robust((0..cloud.len()).map(|i| cloud.world_position(i))).map_or(0.0, |b| b.radius());
    let neighbors = neighbors::search(cloud, observer)?;
    let sd = |i: usize| {
        let mut sd = cloud.log_scales[i].map(f32::exp);
        sd.sort_by(|a, b| b.total_cmp(a));
        sd
    };
    let each = |f: &(dyn Fn(usize) -> f32 + Sync)| (0..cloud.len()).into_par_iter().map(f).collect::<Vec<f32>>();
    let sizes = each(&|i| sd(i)[0]);
    let pieces = pieces::pieces(&neighbors, &sizes, |_| true);
    let far = each(&|i| neighbors[i].get(LONELY - 1).map_or(f32::INFINITY, |n| n.1));
    let usual = median(&far.iter().filter(|d| d.is_finite()).map(|d| f64::from(*d)).collect::<Vec<_>>());
    let usual = if usual > 0.0 { usual as f32 } else { 1.0 };
    let largest = f32::MAX;
    let views = small(views, observer)?;
    let support = match views.as_slice() {
        [] => None,
        views => Some(support::look(cloud, views, settings, observer)?),
    };
    let shape = floaters::Shape { neighbors: &neighbors, sizes: &sizes, pieces: &pieces };
    let floaters = floaters::find(cloud, &shape, support.as_ref(), &views, settings, observer)?;
    let mut values = vec![
        (SplatMeasure::Elongation, each(&|i| (sd(i)[0] / sd(i)[1].max(f32::MIN_POSITIVE)).min(largest))),
        (SplatMeasure::Opacity, each(&|i| cloud.opacity_logits[i].sigmoid())),
        (SplatMeasure::Spacing, each(&|i| (far[i] / usual).min(largest))),
        (SplatMeasure::Piece, each(&|i| pieces.size(i) as f32)),
    ];
    if let Some(support) = support {
        values.extend([(SplatMeasure::Weight, support.largest), (SplatMeasure::Photos, support.photos)]);
        values.extend(support.error.map(|error| (SplatMeasure::Error, error)));
    }
    values.push((SplatMeasure::Size, sizes));
    Ok(CloudMeasures { values, floaters, colors: colors(cloud), radius })
}

/// View-independent colors, 0 to 1 as displayed.
fn colors(cloud: &GaussianCloud) -> Vec<[f32; 3]> {
    (0..cloud.len()).map(|i| cloud.mean_color(i)).collect()
}

#[cfg(test)]
mod tests;
