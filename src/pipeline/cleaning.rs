//! Cleaning: what can be measured of each Gaussian that tells floaters, needles and haze from what photos support.
//!
//! Nothing is deleted here: measures become choices ([`CleanRule`]), which somebody looks at before they are carried out.

mod floaters;
mod pieces;
mod rules;
mod support;

use rayon::prelude::*;
use rstar::RTree;
use rstar::primitives::GeomWithData;

pub(crate) use self::rules::{CleanRule, RuleError};
use crate::io::{self, IoError};
use crate::math::Real;
use crate::math::sh::SH_C0;
use crate::math::stats::median;
use crate::pipeline::observer::{Interrupted, Observer, Ticker};
use crate::render::{RenderError, RenderSettings};
use crate::scene::{Bounds, Camera, GaussianCloud, Photo, PhotoPixels};

/// Neighbors of each Gaussian that are looked at.
const NEIGHBORS: usize = 8;
/// Stands where a Gaussian has fewer.
const NONE: u32 = u32::MAX;
/// The one whose distance tells how lonely a Gaussian is.
const LONELY: usize = 4;
/// Gaussians whose neighbors are looked for between two reports.
const BLOCK: usize = 1 << 14;
/// Side of the pictures in which support is looked for, px.
const SIDE_PX: u32 = 320;

/// What can be measured of a Gaussian.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, strum::VariantArray, strum::IntoStaticStr, strum::EnumString)]
#[strum(serialize_all = "lowercase")]
pub enum SplatMeasure {
    /// Largest standard deviation, scene units.
    Size,
    /// Largest standard deviation over the second: 1 is a disc or a ball, more a needle.
    Elongation,
    /// 0 to 1.
    Opacity,
    /// Distance of its fourth neighbor, 1 being usual in the scene.
    Spacing,
    /// Gaussians of the piece that it hangs together with.
    Piece,
    /// Largest share of a pixel that it has in any photo.
    Weight,
    /// Photos that show it.
    Photos,
    /// Root mean square difference of its color from the photos where they show it, 0 to 1.
    Error,
}

impl SplatMeasure {
    /// Its word on the command line and on screen.
    pub(crate) fn word(self) -> &'static str {
        self.into()
    }

    /// Whether its values differ by factors.
    pub(crate) fn is_logarithmic(self) -> bool {
        matches!(self, Self::Size | Self::Elongation | Self::Spacing | Self::Piece)
    }

    /// What it is.
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

/// A photo that may speak for Gaussians.
#[derive(Clone, Debug)]
pub(crate) struct CleanView {
    pub(crate) camera: Camera,
    /// The photo itself, where it is at hand.
    pub(crate) photo: Option<Photo>,
}

/// The camera of a small picture, and the photo as that where it is at hand.
type SmallView = (Camera, Option<PhotoPixels>);

/// Loads every photo, once: each is looked at several times.
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

/// Why a scene cannot be measured.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum CleanError {
    #[error(transparent)]
    Io(#[from] IoError),
    #[error(transparent)]
    Render(#[from] RenderError),
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
}

/// What was measured of a cloud, Gaussian by Gaussian.
#[derive(Clone, Debug, Default)]
pub(crate) struct CloudMeasures {
    values: Vec<(SplatMeasure, Vec<f32>)>,
    /// Whether each Gaussian is part of a floater.
    floaters: Vec<bool>,
    /// Colors without what depends on the direction, 0 to 1 as displayed.
    colors: Vec<[f32; 3]>,
    /// Nearest neighbors; `NONE` where there are fewer.
    near: Vec<[u32; NEIGHBORS]>,
    /// Half the diagonal of the scene without its strays, scene units.
    radius: f64,
}

impl CloudMeasures {
    /// Those of the Gaussians that are not `gone`, as they were measured with them.
    pub(crate) fn without(&self, gone: &[bool]) -> Self {
        fn left<T: Copy>(of: &[T], gone: &[bool]) -> Vec<T> {
            of.iter().zip(gone).filter(|(_, gone)| !**gone).map(|(v, _)| *v).collect()
        }
        let values = self.values.iter().map(|(measure, values)| (*measure, left(values, gone))).collect();
        let mut number = Vec::with_capacity(gone.len());
        let mut next = 0;
        for gone in gone {
            number.push(if *gone { NONE } else { next });
            next += u32::from(!gone);
        }
        let renumbered = |near: [u32; NEIGHBORS]| near.map(|j| number.get(j as usize).copied().unwrap_or(NONE));
        let near = left(&self.near, gone).into_iter().map(renumbered).collect();
        let (floaters, colors) = (left(&self.floaters, gone), left(&self.colors, gone));
        Self { values, floaters, colors, near, radius: self.radius }
    }

    /// A choice with all neighbors of what is chosen.
    pub(crate) fn grown(&self, chosen: &[bool]) -> Vec<bool> {
        let mut grown = chosen.to_vec();
        for near in self.near.iter().zip(chosen).filter(|(_, chosen)| **chosen).map(|(near, _)| near) {
            near.iter().filter(|j| **j != NONE).for_each(|j| grown[*j as usize] = true);
        }
        grown
    }

    /// A choice without what has a neighbor that is not chosen.
    pub(crate) fn shrunk(&self, chosen: &[bool]) -> Vec<bool> {
        let is_inner = |near: &[u32; NEIGHBORS]| near.iter().all(|j| *j == NONE || chosen[*j as usize]);
        self.near.iter().zip(chosen).map(|(near, chosen)| *chosen && is_inner(near)).collect()
    }

    /// The values of a measure, `[n]`; `None` without the photos that it needs.
    pub(crate) fn get(&self, measure: SplatMeasure) -> Option<&[f32]> {
        self.values.iter().find(|(of, _)| *of == measure).map(|(_, values)| values.as_slice())
    }
}

/// Measures all Gaussians; `views` are the photos that the scene was trained on, as far as they are known.
///
/// # Errors
/// If a photo cannot be read or drawn, or the observer ends it.
pub(crate) fn measure(
    cloud: &GaussianCloud,
    views: &[CleanView],
    settings: &RenderSettings,
    observer: &mut dyn Observer,
) -> Result<CloudMeasures, CleanError> {
    let radius = Bounds::robust((0..cloud.len()).map(|i| cloud.world_position(i))).map_or(0.0, |b| b.radius());
    let neighbors = neighbors(cloud, observer)?;
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
    let first = |of: &Vec<(u32, f32)>| std::array::from_fn(|k| of.get(k).map_or(NONE, |n| n.0));
    let near = neighbors.iter().map(first).collect();
    Ok(CloudMeasures { values, floaters, colors: colors(cloud), near, radius })
}

/// Colors without what depends on the direction, 0 to 1 as displayed.
fn colors(cloud: &GaussianCloud) -> Vec<[f32; 3]> {
    let shown = |v: f32| (0.5 + SH_C0 as f32 * v).clamp(0.0, 1.0);
    (0..cloud.len()).map(|i| cloud.sh[i * cloud.sh_stride()].map(shown)).collect()
}

/// The nearest neighbors of each Gaussian with their distances, the nearest first.
fn neighbors(cloud: &GaussianCloud, observer: &mut dyn Observer) -> Result<Vec<Vec<(u32, f32)>>, Interrupted> {
    let place = |i: usize| cloud.positions[i].map(f64::from);
    let tree = RTree::bulk_load((0..cloud.len()).map(|i| GeomWithData::new(place(i), i as u32)).collect());
    let of = |i: usize| {
        let near = tree.nearest_neighbor_iter_with_distance_2(place(i)).filter(|(n, _)| n.data != i as u32);
        near.take(NEIGHBORS).map(|(n, d)| (n.data, d.sqrt() as f32)).collect()
    };
    let mut ticker = Ticker::new("Looking for neighbors", cloud.len());
    let mut all = Vec::with_capacity(cloud.len());
    for from in (0..cloud.len()).step_by(BLOCK) {
        ticker.tick(from, observer)?;
        let to = (from + BLOCK).min(cloud.len());
        all.par_extend((from..to).into_par_iter().map(of));
    }
    Ok(all)
}

#[cfg(test)]
mod tests;
