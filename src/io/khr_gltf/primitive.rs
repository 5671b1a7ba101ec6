//! Gaussians of a primitive with the extension, and their placement by its node.

use glam::{DMat3, DMat4, DVec3};

use super::container::{Gltf, SplatPrimitive};
use super::{EXTENSION, EXTRA};
use crate::io::quantized::{log_scale, logit};
use crate::io::{IoError, splat_ply};
use crate::math::rotation::{nearest_rotation, rotation_error};
use crate::math::sh::{SH_C0, coefficients};
use crate::math::srgb;
use crate::scene::{ExtraProperty, GaussianCloud};

/// Reads the Gaussians in the axes of their node.
pub(super) fn cloud(
    gltf: &Gltf<'_>,
    primitive: &SplatPrimitive,
    extension: &serde_json::Value,
) -> Result<GaussianCloud, IoError> {
    let setting = |key: &str| extension.get(key).and_then(|v| v.as_str()).unwrap_or("");
    let kernel = setting("kernel");
    if kernel != "ellipse" {
        return Err(gltf.unsupported(format!("the splat kernel '{kernel}'"), "only the kernel 'ellipse' can be drawn"));
    }
    let linear = match setting("colorSpace") {
        "srgb_rec709_display" => false,
        "lin_rec709_display" => true,
        other => return Err(gltf.unsupported(format!("the color space '{other}'"), "convert the colors to sRGB")),
    };
    let find = |name: &str| primitive.attributes.get(name).copied();
    let extended = |name: &str| {
        let full = format!("{EXTENSION}:{name}");
        find(&full).ok_or_else(|| gltf.bad("a splat primitive", format!("attribute {full} is missing")))
    };
    let position = find("POSITION").ok_or_else(|| gltf.bad("a splat primitive", "POSITION is missing".into()))?;
    let positions = gltf.values::<3>(position)?.rows;
    let n = positions.len();
    let rotations = gltf.values::<4>(extended("ROTATION")?)?.rows;
    let scales = gltf.values::<3>(extended("SCALE")?)?;
    let opacities = gltf.values::<1>(extended("OPACITY")?)?.rows;
    let degree = (0..=3_u8).rev().find(|d| extended(&format!("SH_DEGREE_{d}_COEF_0")).is_ok()).unwrap_or(0);
    let stride = coefficients(degree);
    let mut sh = vec![[0.0; 3]; n * stride];
    for l in 0..=degree {
        for k in 0..2 * usize::from(l) + 1 {
            let rows = gltf.values::<3>(extended(&format!("SH_DEGREE_{l}_COEF_{k}"))?)?.rows;
            equal(gltf, n, rows.len())?;
            let at = usize::from(l) * usize::from(l) + k;
            sh.chunks_exact_mut(stride).zip(rows).for_each(|(out, rgb)| out[at] = rgb);
        }
    }
    for count in [rotations.len(), scales.rows.len(), opacities.len()] {
        equal(gltf, n, count)?;
    }
    if linear {
        sh.chunks_exact_mut(stride).for_each(to_display);
    }
    let logarithms = scales.signed_integer || scales.rows.iter().flatten().any(|s| *s < 0.0);
    let log_scale = |s: f32| if logarithms { s } else { log_scale(s) };
    Ok(GaussianCloud {
        positions,
        log_scales: scales.rows.iter().map(|s| s.map(log_scale)).collect(),
        quaternions: rotations.into_iter().map(|[x, y, z, w]| [w, x, y, z]).collect(),
        opacity_logits: opacities.into_iter().map(|[o]| logit(o)).collect(),
        sh_degree: degree,
        sh,
        extras: extras(gltf, primitive, n)?,
        ..GaussianCloud::default()
    })
}

/// Transforms Gaussians of a node to the world: rotated with their harmonics, scaled, and around an origin at the node.
pub(super) fn placed(gltf: &Gltf<'_>, cloud: GaussianCloud, world: DMat4) -> Result<GaussianCloud, IoError> {
    let (turn, scale) = similarity(gltf, world)?;
    let (mut cloud, size, grown) = (cloud.turned(&turn, false), scale as f32, scale.ln() as f32);
    cloud.positions.iter_mut().flatten().for_each(|v| *v *= size);
    cloud.log_scales.iter_mut().flatten().for_each(|s| *s += grown);
    cloud.origin = world.transform_point3(DVec3::ZERO) + cloud.origin * scale;
    Ok(cloud)
}

/// Reads numbers of applications, one of each Gaussian.
fn extras(gltf: &Gltf<'_>, primitive: &SplatPrimitive, n: usize) -> Result<Vec<ExtraProperty>, IoError> {
    let mut extras = Vec::new();
    for (name, at) in &primitive.attributes {
        let Some(name) = name.strip_prefix(EXTRA).filter(|name| splat_ply::may_be_extra(name)) else { continue };
        let Some(values) = gltf.scalars(*at)? else { continue };
        equal(gltf, n, values.len())?;
        extras.push(ExtraProperty { name: name.to_owned(), values });
    }
    Ok(extras)
}

fn equal(gltf: &Gltf<'_>, n: usize, count: usize) -> Result<(), IoError> {
    if n == count {
        return Ok(());
    }
    Err(gltf.bad("a splat primitive", format!("{n} positions, but another attribute has {count} values")))
}

/// Returns rotation and scale of a node's transform.
fn similarity(gltf: &Gltf<'_>, world: DMat4) -> Result<(DMat3, f64), IoError> {
    let m = DMat3::from_mat4(world);
    let scale = m.determinant().cbrt();
    let unit = m * scale.recip();
    let error = rotation_error(&unit);
    if !world.is_finite() || error.is_nan() || error > 1e-4 {
        return Err(gltf
            .unsupported("a node that is stretched, sheared or mirrored".into(), "apply its transform to the splats"));
    }
    let r = nearest_rotation(&unit);
    Ok((if r.abs_diff_eq(DMat3::IDENTITY, 1e-9) { DMat3::IDENTITY } else { r }, scale))
}

/// Converts harmonics of linear light to those of display values.
fn to_display(sh: &mut [[f32; 3]]) {
    let c0 = SH_C0 as f32;
    for channel in 0..3 {
        let linear = 0.5 + c0 * sh[0][channel];
        let (value, slope) = srgb::encode(linear.max(0.0));
        sh[0][channel] = (value - 0.5) / c0;
        sh[1..].iter_mut().for_each(|c| c[channel] *= slope);
    }
}
