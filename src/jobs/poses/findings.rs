//! Result of a search for poses: which photos have none and why, and which poses are doubtful.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::{IMAGES, PoseMaker, SPARSE};
use crate::io::colmap::{self, support};
use crate::io::photo;
use crate::io::unposed::Unposed;
use crate::jobs::JobError;
use crate::math::stats::median;
use crate::pipeline::frames::{Gray, sharpness};
use crate::pipeline::observer::{Observer, Ticker};

/// Multiple of the median reprojection error above which a pose is doubtful, if it is also above [`LEAST_ERROR_PX`].
const FAR_ABOVE: f64 = 3.0;
/// Reprojection error that is fine whatever that of others is, px.
const LEAST_ERROR_PX: f64 = 1.0;
/// Share of the median number of points below which a pose is doubtful.
const FEW_POINTS: f64 = 0.05;
/// Share of the median sharpness below which a photo is called blurred.
const BLURRED: f64 = 0.35;
/// Sharpness below which there is nothing to see, gray levels squared.
const PLAIN: f64 = 4.0;

/// Photo, and a remark on it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct PhotoRemark {
    /// Its name.
    pub(crate) photo: String,
    /// The remark.
    pub(crate) why: String,
}

/// Poses that were found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct FoundPoses {
    /// Folder with `images` and `sparse/0`.
    pub(crate) out: PathBuf,
    /// Name of the maker.
    pub(crate) maker: String,
    /// Number of all photos.
    pub(crate) photos: usize,
    /// Number of photos with a pose.
    pub(crate) registered: usize,
    /// Number of sparse points.
    pub(crate) points: usize,
    /// Median over the photos of their mean reprojection error, px; `None` if the maker does not say.
    pub(crate) error_px: Option<f64>,
    /// Photos without a pose.
    pub(crate) missing: Vec<PhotoRemark>,
    /// Photos whose pose may be wrong.
    pub(crate) doubtful: Vec<PhotoRemark>,
}

/// Number of photos with a pose in the largest reconstruction of a folder.
pub(super) fn registered(sparse: &Path) -> usize {
    colmap::photo_names(sparse).map_or(0, |names| names.len())
}

/// Looks at the poses in `out`.
pub(super) fn of(
    photos: &Unposed,
    maker: &dyn PoseMaker,
    out: &Path,
    observer: &mut dyn Observer,
) -> Result<FoundPoses, JobError> {
    let dataset = colmap::read(out)?;
    let support: HashMap<String, support::PhotoPoints> = support::read(&out.join(SPARSE).join("0"))?;
    let errors: Vec<f64> = support.values().filter_map(|s| s.error_px).collect();
    let (usual_error, usual_points) =
        (median(&errors), median(&support.values().map(|s| s.points as f64).collect::<Vec<_>>()));
    let strays = dataset.strays();
    let mut doubtful = Vec::new();
    for (i, photo) in dataset.photos.iter().enumerate() {
        let of_photo = support.get(&photo.name).or_else(|| support.get(name_of(&photo.name)));
        let error = of_photo.and_then(|s| s.error_px).unwrap_or(0.0);
        let points = of_photo.map_or(usual_points, |s| s.points as f64);
        let why = if strays.contains(&i) {
            "stands far from all others".to_owned()
        } else if error > LEAST_ERROR_PX.max(FAR_ABOVE * usual_error) {
            format!("has points that are {error:.1} px off, others {usual_error:.1} px")
        } else if points < FEW_POINTS * usual_points {
            format!("rests on {points:.0} points, others on {usual_points:.0}")
        } else {
            continue;
        };
        doubtful.push(PhotoRemark { photo: name_of(&photo.name).into(), why });
    }
    let has_pose = |name: &String| dataset.photos.iter().any(|p| name_of(&p.name) == name);
    let lost: Vec<&String> = photos.photos.iter().filter(|name| !has_pose(name)).collect();
    Ok(FoundPoses {
        out: out.into(),
        maker: maker.name(),
        photos: photos.photos.len(),
        registered: dataset.photos.len(),
        points: dataset.points.len(),
        error_px: Some(usual_error).filter(|e| e.is_finite()),
        missing: reasons(&lost, &photos.photos, &out.join(IMAGES), observer)?,
        doubtful,
    })
}

fn name_of(entry: &str) -> &str {
    entry.rsplit('/').next().unwrap_or(entry)
}

/// Reasons why photos have no pose, as far as the photos themselves tell.
fn reasons(
    lost: &[&String],
    all: &[String],
    images: &Path,
    observer: &mut dyn Observer,
) -> Result<Vec<PhotoRemark>, JobError> {
    /// Photos at most that sharpness is compared with.
    const COMPARED: usize = 24;
    if lost.is_empty() {
        return Ok(Vec::new());
    }
    let step = all.len().div_ceil(COMPARED).max(1);
    let others: Vec<&String> = all.iter().filter(|name| !lost.contains(name)).step_by(step).collect();
    let mut ticker = Ticker::new("Looking at photos without a pose", lost.len() + others.len());
    let mut looked = 0;
    let mut sharp = |name: &str, observer: &mut dyn Observer| -> Result<f64, JobError> {
        ticker.tick(looked, observer)?;
        looked += 1;
        let pixels = photo::open(&images.join(name))?;
        Ok(sharpness(&Gray::of_rgb(pixels.rgb.as_flattened(), pixels.width_px, pixels.height_px)))
    };
    let usual = others.iter().map(|name| sharp(name, observer)).collect::<Result<Vec<_>, _>>()?;
    let usual = median(&usual);
    let mut remarks = Vec::new();
    for name in lost {
        let own = sharp(name, observer)?;
        let why = if own < PLAIN {
            "shows almost nothing to hold on to: too dark, too bright or too plain".to_owned()
        } else if own < BLURRED * usual {
            format!("is blurred: {:.0} % as sharp as the others", 100.0 * own / usual)
        } else {
            "shares too few points with the photos that have a pose: take more from between".to_owned()
        };
        remarks.push(PhotoRemark { photo: (*name).clone(), why });
    }
    Ok(remarks)
}
