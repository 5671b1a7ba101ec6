//! Decoding of a SOG's pictures to Gaussians.

use std::path::Path;

use rayon::prelude::*;

use super::meta::{Meta, Opacity, Rest};
use super::{FIRST_TAG, PALETTE_ROW};
use crate::io::finite::finite_only;
use crate::io::quantized::{logit, unit_quaternion};
use crate::io::{IoError, photo};
use crate::math::sh::coefficients;
use crate::scene::GaussianCloud;

/// Most palette entries: labels have 16 bits.
const MAX_PALETTE: usize = 1 << 16;
/// Pixels allowed in a picture beyond one per Gaussian, for incomplete rows.
const MARGIN_PX: u64 = 1 << 16;

/// A decoded picture: RGBA, row by row.
struct Texture {
    width: usize,
    pixels: Vec<[u8; 4]>,
}

/// Decodes the Gaussians of `meta`; `load` returns its files by name.
pub(super) fn cloud(
    meta: &Meta,
    mut load: impl FnMut(&str) -> Result<Vec<u8>, IoError>,
    path: &Path,
) -> Result<GaussianCloud, IoError> {
    let [low, high] = &meta.means_files;
    let mut names = vec![low, high, &meta.scales_file, &meta.quats_file, &meta.sh0_file];
    names.extend(meta.rest.as_ref().map(|r| &r.labels_file));
    let files = names.iter().map(|n| load(n)).collect::<Result<Vec<_>, _>>()?;
    let palette = meta.rest.as_ref().map(|r| Ok((r, load(&r.centroids_file)?))).transpose()?;
    let limit_px = meta.count.saturating_mul(2).saturating_add(MARGIN_PX);
    let decoded: Vec<Result<Texture, IoError>> =
        files.par_iter().zip(&names).map(|(bytes, name)| texture(bytes, name, limit_px, path)).collect();
    let mut textures = decoded.into_iter().collect::<Result<Vec<_>, _>>()?;
    // Every Gaussian needs its pixel in each picture.
    for (t, name) in textures.iter().zip(&names) {
        if meta.count > t.pixels.len() as u64 {
            return Err(IoError::Count {
                path: path.into(),
                what: format!("Gaussians ({name} has fewer pixels)"),
                claimed: meta.count,
                possible: t.pixels.len() as u64,
            });
        }
    }
    let n = meta.count as usize;
    textures.iter_mut().for_each(|t| t.pixels.truncate(n));
    let [low, high, scales, quats, sh0, labels @ ..] = textures.as_slice() else {
        return Ok(GaussianCloud::default());
    };
    let constant = sh0.pixels.par_iter().map(|p| [0, 1, 2].map(|k| meta.sh0.0[k][usize::from(p[k])]));
    let (sh_degree, sh) = match (palette, labels) {
        (Some((rest, bytes)), [labels]) => harmonics(rest, &bytes, &labels.pixels, constant.collect(), path)?,
        _ => (0, constant.collect()),
    };
    let cloud = GaussianCloud {
        origin: meta.origin,
        positions: low.pixels.par_iter().zip(&high.pixels).map(|(l, h)| position(meta, *l, *h)).collect(),
        log_scales: scales.pixels.par_iter().map(|p| [0, 1, 2].map(|k| meta.scales.0[k][usize::from(p[k])])).collect(),
        quaternions: quats.pixels.par_iter().map(|p| quaternion(*p)).collect(),
        opacity_logits: sh0.pixels.par_iter().map(|p| opacity(&meta.opacity, p[3])).collect(),
        sh_degree,
        sh,
        render_mode: meta.render_mode,
        ..GaussianCloud::default()
    };
    // Bounds and codebooks are finite, but a position's exponential may not be.
    finite_only(cloud, path)
}

fn position(meta: &Meta, low: [u8; 4], high: [u8; 4]) -> [f32; 3] {
    [0, 1, 2].map(|k| {
        let t = f32::from(u16::from_le_bytes([low[k], high[k]])) / 65_535.0;
        let v = meta.means.0[k] + (meta.means.1[k] - meta.means.0[k]) * t;
        v.abs().exp_m1().copysign(v)
    })
}

fn quaternion(p: [u8; 4]) -> [f32; 4] {
    match p[3].checked_sub(FIRST_TAG) {
        Some(largest) => unit_quaternion(usize::from(largest), [p[0], p[1], p[2]].map(|v| f32::from(v) / 255.0)),
        // Other tags carry no rotation.
        None => [1.0, 0.0, 0.0, 0.0],
    }
}

fn opacity(kind: &Opacity, byte: u8) -> f32 {
    let t = f32::from(byte) / 255.0;
    match *kind {
        Opacity::Linear => logit(t),
        Opacity::Logit(lo, hi) => lo + (hi - lo) * t,
    }
}

/// Decodes degree and all harmonics, the constant ones included.
fn harmonics(
    rest: &Rest,
    palette: &[u8],
    labels: &[[u8; 4]],
    constant: Vec<[f32; 3]>,
    path: &Path,
) -> Result<(u8, Vec<[f32; 3]>), IoError> {
    let bad = |reason: String| IoError::Syntax { path: path.into(), place: "'shN'".into(), reason };
    let most = PALETTE_ROW * 15 * (MAX_PALETTE / PALETTE_ROW);
    let palette = texture(palette, &rest.centroids_file, most as u64, path)?;
    let width = |degree: u8| PALETTE_ROW * (coefficients(degree) - 1);
    let Some(degree) = (1..=3_u8).find(|&d| width(d) == palette.width && rest.degree.is_none_or(|b| b == d)) else {
        return Err(bad(format!("a palette {} px wide does not fit {:?} bands", palette.width, rest.degree)));
    };
    let per_entry = coefficients(degree) - 1;
    let entries = palette.pixels.len() / per_entry;
    let entries = rest.count.map_or(entries, |c| entries.min(usize::try_from(c).unwrap_or(entries)));
    let label = |p: &[u8; 4]| usize::from(u16::from_le_bytes([p[0], p[1]]));
    if let Some(index) = labels.par_iter().position_first(|p| label(p) >= entries) {
        return Err(bad(format!("Gaussian {index} uses palette entry {} of {entries}", label(&labels[index]))));
    }
    let levels = &rest.levels.0[0];
    let mut sh = vec![[0.0; 3]; labels.len() * (per_entry + 1)];
    sh.par_chunks_exact_mut(per_entry + 1).zip(labels).zip(constant).for_each(|((out, p), constant)| {
        out[0] = constant;
        // Entries follow each other row by row, so entry `label` starts here.
        let start = label(p) * per_entry;
        for (rgb, texel) in out[1..].iter_mut().zip(&palette.pixels[start..start + per_entry]) {
            *rgb = [0, 1, 2].map(|k| levels[usize::from(texel[k])]);
        }
    });
    Ok((degree, sh))
}

fn texture(bytes: &[u8], name: &str, limit_px: u64, path: &Path) -> Result<Texture, IoError> {
    let picture = photo::decode_rgba(bytes, limit_px, &path.join(name))?;
    let width = picture.width() as usize;
    Ok(Texture { width, pixels: picture.pixels().map(|p| p.0).collect() })
}
