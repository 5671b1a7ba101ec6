//! `meta.json`: both versions, validated, in one form.

use std::path::Path;

use glam::DVec3;
use serde::Deserialize;

use crate::io::render_mode::of_sog_model;
use crate::io::{IoError, files};
use crate::scene::SplatRenderMode;

/// Validated contents: every number is finite, every list has its length.
pub(super) struct Meta {
    /// Number of Gaussians, not yet compared with the pictures.
    pub(crate) count: u64,
    /// Bounds of the positions' logarithms.
    pub(crate) means: ([f32; 3], [f32; 3]),
    /// Pictures with the low and the high bytes of the positions.
    pub(crate) means_files: [String; 2],
    /// Log-scales.
    pub(crate) scales: Codebook<3>,
    pub(crate) scales_file: String,
    pub(crate) quats_file: String,
    pub(crate) sh0: Codebook<3>,
    pub(crate) opacity: Opacity,
    pub(crate) sh0_file: String,
    pub(crate) rest: Option<Rest>,
    pub(crate) render_mode: SplatRenderMode,
    /// Shift that the positions are relative to.
    pub(crate) origin: DVec3,
}

/// Values of the 256 levels of a byte, by channel.
pub(super) struct Codebook<const N: usize>(pub [[f32; 256]; N]);

pub(super) enum Opacity {
    /// 0 to 1.
    Linear,
    /// Logits between two bounds.
    Logit(f32, f32),
}

pub(super) struct Rest {
    /// Degree, if stated; else it follows from the palette's width.
    pub(crate) degree: Option<u8>,
    /// Palette entries, if stated.
    pub(crate) count: Option<u64>,
    pub(crate) levels: Codebook<1>,
    pub(crate) centroids_file: String,
    pub(crate) labels_file: String,
}

impl Meta {
    /// Names of the pictures, in the order of decoding; the palette of harmonics comes last.
    pub(crate) fn files(&self) -> Vec<String> {
        let [low, high] = &self.means_files;
        let rest = self.rest.iter().flat_map(|rest| [&rest.labels_file, &rest.centroids_file]);
        let all = [low, high, &self.scales_file, &self.quats_file, &self.sh0_file].into_iter().chain(rest);
        all.cloned().collect()
    }
}

#[derive(Deserialize)]
struct File {
    version: Option<u64>,
    count: Option<u64>,
    model: Option<String>,
    means: Part,
    scales: Part,
    quats: Part,
    sh0: Part,
    #[serde(rename = "shN")]
    rest: Option<Part>,
    /// Key of this program's own.
    fmlgs_shift: Option<[f64; 3]>,
}

#[derive(Deserialize)]
struct Part {
    #[serde(default)]
    shape: Vec<u64>,
    mins: Option<Bounds>,
    maxs: Option<Bounds>,
    codebook: Option<Vec<Option<f32>>>,
    files: Vec<String>,
    bands: Option<u8>,
    count: Option<u64>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Bounds {
    One(f32),
    Many(Vec<f32>),
}

/// Parses and checks a `meta.json`.
pub(super) fn parse(bytes: &[u8], path: &Path) -> Result<Meta, IoError> {
    let file: File = files::json(bytes, path)?;
    let version = file.version.unwrap_or(1);
    if !(1..=2).contains(&version) {
        return Err(IoError::Version { path: path.into(), found: version, supported: 2 });
    }
    convert(file, version == 2).map_err(|(part, reason)| IoError::syntax(path, format!("'{part}'"), reason))
}

type Flaw = (&'static str, String);

fn convert(file: File, codebooks: bool) -> Result<Meta, Flaw> {
    let count = file.count.or(file.means.shape.first().copied()).ok_or_else(|| flaw("count", "missing"))?;
    let means = (file.means.bounds::<3>("means", true)?, file.means.bounds::<3>("means", false)?);
    let [low, high] = file.means.files("means")?;
    let [scales_file] = file.scales.files("scales")?;
    let [quats_file] = file.quats.files("quats")?;
    let [sh0_file] = file.sh0.files("sh0")?;
    let (scales, sh0, opacity) = if codebooks {
        let shared = |p: &Part, name| p.codebook(name).map(|c| Codebook([c; 3]));
        (shared(&file.scales, "scales")?, shared(&file.sh0, "sh0")?, Opacity::Linear)
    } else {
        let (min, max) = (file.sh0.bounds::<4>("sh0", true)?, file.sh0.bounds::<4>("sh0", false)?);
        let sh0 = Codebook([0, 1, 2].map(|k| between(min[k], max[k])));
        let (lo, hi) = (file.scales.bounds::<3>("scales", true)?, file.scales.bounds::<3>("scales", false)?);
        (Codebook([0, 1, 2].map(|k| between(lo[k], hi[k]))), sh0, Opacity::Logit(min[3], max[3]))
    };
    let rest = match &file.rest {
        None => None,
        Some(part) => {
            let [centroids_file, labels_file] = part.files("shN")?;
            let levels = if codebooks {
                part.codebook("shN")?
            } else {
                between(part.bounds::<1>("shN", true)?[0], part.bounds::<1>("shN", false)?[0])
            };
            let degree = part.bands;
            if degree.is_some_and(|d| d > 3) {
                return Err(flaw("shN", "more than 3 bands"));
            }
            let count = if codebooks { part.count } else { None };
            (degree != Some(0)).then_some(Rest {
                degree,
                count,
                levels: Codebook([levels]),
                centroids_file,
                labels_file,
            })
        }
    };
    let render_mode = file.model.as_deref().map(of_sog_model).unwrap_or_default();
    let means_files = [low, high];
    let origin = DVec3::from_array(file.fmlgs_shift.unwrap_or_default());
    if !origin.is_finite() {
        return Err(flaw("fmlgs_shift", "not finite"));
    }
    let read = Meta {
        count,
        means,
        means_files,
        scales,
        scales_file,
        quats_file,
        sh0,
        opacity,
        sh0_file,
        rest,
        render_mode,
        origin,
    };
    Ok(read)
}

fn flaw(part: &'static str, reason: &str) -> Flaw {
    (part, reason.into())
}

/// 256 levels from `lo` to `hi`.
fn between(lo: f32, hi: f32) -> [f32; 256] {
    std::array::from_fn(|byte| lo + (hi - lo) * (byte as f32 / 255.0))
}

impl Part {
    fn bounds<const N: usize>(&self, part: &'static str, lower: bool) -> Result<[f32; N], Flaw> {
        let bounds = if lower { &self.mins } else { &self.maxs };
        let values = match bounds {
            None => return Err(flaw(part, "its bounds 'mins' and 'maxs' are missing")),
            Some(Bounds::One(v)) => std::slice::from_ref(v),
            Some(Bounds::Many(v)) => v,
        };
        match <[f32; N]>::try_from(values) {
            Ok(v) if v.iter().all(|x| x.is_finite()) => Ok(v),
            _ => Err((part, format!("'mins' or 'maxs' does not hold {N} finite numbers"))),
        }
    }

    fn codebook(&self, part: &'static str) -> Result<[f32; 256], Flaw> {
        let Some(entries) = &self.codebook else { return Err(flaw(part, "its codebook is missing")) };
        let mut entries = entries.clone();
        // Some writers left out the first entry; it continues the others.
        if let [first @ None, Some(second), .., Some(last)] = entries.as_mut_slice() {
            *first = Some(*second + (*second - *last) / 255.0);
        }
        let values: Vec<f32> = entries.into_iter().flatten().filter(|v| v.is_finite()).collect();
        values.try_into().map_err(|v: Vec<f32>| (part, format!("its codebook holds {} numbers, expected 256", v.len())))
    }

    fn files<const N: usize>(&self, part: &'static str) -> Result<[String; N], Flaw> {
        let files = self.files.clone();
        files.try_into().map_err(|f: Vec<String>| (part, format!("{} files, expected {N}", f.len())))
    }
}
