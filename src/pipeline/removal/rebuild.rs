//! The Gaussians that stay, some of them brighter, and new ones.

use glam::{DQuat, DVec3};

use crate::math::sh::SH_C0;
use crate::math::srgb::brighter;
use crate::scene::{ExtraProperty, GaussianCloud, IdentityId};

/// Extra property of Gaussians: 1 for invented ones, else 0.
pub(crate) const INVENTED: &str = "fmlgs_invented";

/// Returns 1 for each invented Gaussian, else 0; `None` if there is none.
pub(crate) fn invented_flags(cloud: &GaussianCloud) -> Option<&[f32]> {
    let flags = cloud.extras.iter().find(|e| e.name == INVENTED)?;
    flags.values.contains(&1.0).then_some(&flags.values)
}

/// Standard deviation of a new Gaussian along the surface, in texels: neighbors overlap to an even cover.
pub(super) const SPREAD: f64 = 0.6;
/// The same across the surface.
const THICKNESS: f64 = 0.1;
/// Opacity of 0.95, before the sigmoid.
const OPACITY_LOGIT: f32 = 2.944;

/// Gaussian of a piece of a surface.
pub(super) struct NewGaussian {
    pub(super) position: DVec3,
    pub(super) rotation: DQuat,
    /// Standard deviation along the surface, scene units.
    pub(super) scale: f64,
    pub(super) rgb: [f32; 3],
    pub(super) identity: IdentityId,
    /// False if the photos show this piece.
    pub(super) is_invented: bool,
}

/// Returns the Gaussians at `kept`, and the new ones.
pub(super) fn with_new(cloud: &GaussianCloud, kept: &[usize], new: &[NewGaussian]) -> GaussianCloud {
    let mut all = cloud.select(kept);
    if !all.extras.iter().any(|e| e.name == INVENTED) {
        all.extras.push(ExtraProperty { name: INVENTED.into(), values: vec![0.0; kept.len()] });
    }
    let stride = all.sh_stride();
    for one in new {
        all.positions.push((one.position - all.origin).as_vec3().to_array());
        let along = one.scale.ln() as f32;
        all.log_scales.push([along, along, (one.scale * THICKNESS / SPREAD).ln() as f32]);
        all.quaternions.push([one.rotation.w, one.rotation.x, one.rotation.y, one.rotation.z].map(|v| v as f32));
        all.opacity_logits.push(OPACITY_LOGIT);
        all.sh.push(one.rgb.map(|c| ((f64::from(c) - 0.5) / SH_C0) as f32));
        all.sh.extend(std::iter::repeat_n([0.0; 3], stride - 1));
    }
    for extra in &mut all.extras {
        let is_flag = extra.name == INVENTED;
        extra.values.extend(new.iter().map(|one| f32::from(u8::from(is_flag && one.is_invented))));
    }
    all
}

/// Returns the color of Gaussian `i`, mean over all directions.
pub(super) fn shown(cloud: &GaussianCloud, i: usize) -> [f32; 3] {
    cloud.sh[i * cloud.sh_stride()].map(|v| 0.5 + SH_C0 as f32 * v)
}

/// Makes Gaussian `i` brighter from all directions.
pub(super) fn brighten(cloud: &mut GaussianCloud, i: usize, gain: [f32; 3]) {
    let (stride, shown) = (cloud.sh_stride(), shown(cloud, i));
    let all = &mut cloud.sh[i * stride..(i + 1) * stride];
    let new = brighter(shown, gain);
    let ratio: [f32; 3] = std::array::from_fn(|c| if shown[c] > 1e-3 { new[c] / shown[c] } else { 1.0 });
    all[0] = new.map(|v| (v - 0.5) / SH_C0 as f32);
    all[1..].iter_mut().for_each(|sh| (0..3).for_each(|c| sh[c] *= ratio[c]));
}
