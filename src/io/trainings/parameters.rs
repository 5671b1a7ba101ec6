//! Gaussians from the tensors of a checkpoint, read block by block.

use std::path::Path;

use crate::io::finite::finite_only;
use crate::io::quantized::{constant, logit};
use crate::io::torch::{WeightFile, WeightFileError};
use crate::io::{IoError, splat_ply};
use crate::math::Real;
use crate::math::sh::coefficients;
use crate::scene::{GaussianCloud, SplatRenderMode};

/// Rows of a tensor in memory at once.
const ROWS: usize = 1 << 15;

/// TensorNames of the tensors of Gaussians in a checkpoint.
pub(super) struct TensorNames {
    pub(super) means: String,
    pub(super) scales: String,
    pub(super) quats: String,
    pub(super) opacities: String,
    /// Constant harmonics.
    pub(super) constant: String,
    /// Higher harmonics, coefficient by coefficient.
    pub(super) rest: String,
}

/// Meaning of the constant harmonics of a training without higher ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ColorMeaning {
    Harmonics,
    /// Logits of colors.
    Logits,
}

/// Reads the Gaussians of a checkpoint as it stores them.
///
/// # Errors
/// If a tensor is missing, broken, or of another shape.
pub(super) fn read(
    path: &Path,
    file: &mut WeightFile,
    names: &TensorNames,
    constants: ColorMeaning,
) -> Result<GaussianCloud, IoError> {
    let cloud = gather(file, names, constants).map_err(|e| e.of(path))?;
    finite_only(cloud, path)
}

fn gather(
    file: &mut WeightFile,
    names: &TensorNames,
    constants: ColorMeaning,
) -> Result<GaussianCloud, WeightFileError> {
    let n = rows(file, &names.means)?;
    let degree = degree(file, n, &names.rest)?;
    let mut cloud = GaussianCloud { sh_degree: degree, ..GaussianCloud::default() };
    three(file, &names.means, n, &mut cloud.positions)?;
    match file.tensors.get(&names.scales).map(|t| &t.shape[..]) {
        Some([_, 2]) => {
            cloud.render_mode = SplatRenderMode::Surfels;
            columns(file, &names.scales, (n, 2), &mut |v| cloud.log_scales.push([v[0], v[1], splat_ply::FLAT]))?;
        }
        _ => three(file, &names.scales, n, &mut cloud.log_scales)?,
    }
    columns(file, &names.quats, (n, 4), &mut |v| cloud.quaternions.push([v[0], v[1], v[2], v[3]]))?;
    // Infinite logits are opacities of 0 and 1.
    let finite = |v: f32| if v.is_infinite() { logit(f32::from(v > 0.0)) } else { v };
    columns(file, &names.opacities, (n, 1), &mut |v| cloud.opacity_logits.push(finite(v[0])))?;
    let stride = coefficients(degree);
    let mut sh = Vec::new();
    let of = |v: f32| match constants {
        ColorMeaning::Logits if degree == 0 => constant(v.sigmoid()),
        _ => v,
    };
    columns(file, &names.constant, (n, 3), &mut |v| {
        sh.push([v[0], v[1], v[2]].map(of));
        sh.resize(sh.len() + stride - 1, [0.0; 3]);
    })?;
    if degree > 0 {
        let mut row = 0;
        columns(file, &names.rest, (n, 3 * (stride - 1)), &mut |v| {
            let own = sh[row * stride + 1..].iter_mut();
            own.zip(v.as_chunks().0).for_each(|(to, from)| *to = *from);
            row += 1;
        })?;
    }
    cloud.sh = sh;
    Ok(cloud)
}

/// Number of Gaussians: rows of the tensor of their positions.
fn rows(file: &WeightFile, means: &str) -> Result<usize, WeightFileError> {
    match file.tensors.get(means).map(|t| &t.shape[..]) {
        Some(&[n, 3]) => Ok(n),
        Some(shape) => Err(wrong(means, format!("has the shape {shape:?}, and positions have [N, 3]"))),
        None => Err(wrong(means, "is not there".into())),
    }
}

/// Degree of the harmonics, from the tensor of the higher ones, which may be missing.
fn degree(file: &WeightFile, n: usize, rest: &str) -> Result<u8, WeightFileError> {
    let Some(tensor) = file.tensors.get(rest) else { return Ok(0) };
    let known = (0..=3_u8).find(|d| tensor.shape == [n, coefficients(*d) - 1, 3]);
    let shape = &tensor.shape;
    known.ok_or_else(|| {
        wrong(rest, format!("has the shape {shape:?}, and harmonics of degree 0 to 3 have [{n}, 0 or 3 or 8 or 15, 3]"))
    })
}

fn three(file: &mut WeightFile, name: &str, n: usize, to: &mut Vec<[f32; 3]>) -> Result<(), WeightFileError> {
    columns(file, name, (n, 3), &mut |v| to.push([v[0], v[1], v[2]]))
}

/// Reads a tensor of `n` rows of `width` numbers, row by row.
fn columns(
    file: &mut WeightFile,
    name: &str,
    (n, width): (usize, usize),
    each: &mut dyn FnMut(&[f32]),
) -> Result<(), WeightFileError> {
    match file.tensors.get(name) {
        None => return Err(wrong(name, "is not there".into())),
        Some(t) if t.shape.first() != Some(&n) || t.count() != n * width => {
            let shape = &t.shape;
            return Err(wrong(name, format!("has the shape {shape:?}, and {n} Gaussians need {width} numbers each")));
        }
        Some(_) => {}
    }
    file.blocks(name, ROWS, &mut |_, block| block.chunks_exact(width).for_each(&mut *each))
}

fn wrong(name: &str, problem: String) -> WeightFileError {
    WeightFileError::Tensor { name: name.into(), problem }
}
