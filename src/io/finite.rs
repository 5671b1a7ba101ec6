//! Removal of Gaussians with numbers that are not finite, reported as a warning.

use std::path::Path;

use rayon::prelude::*;

use super::IoError;
use crate::math::format::count;
use crate::scene::{CloudError, GaussianCloud};

/// Returns the cloud of a file without those of its Gaussians that have a number that is not finite; a warning counts
/// them.
///
/// # Errors
/// If its arrays do not fit one another, or every Gaussian has such a number.
pub(super) fn finite_only(cloud: GaussianCloud, path: &Path) -> Result<GaussianCloud, IoError> {
    without_flaws(cloud).map_err(|cause| IoError::Cloud { path: path.into(), cause })
}

fn without_flaws(cloud: GaussianCloud) -> Result<GaussianCloud, CloudError> {
    cloud.lengths()?;
    if !cloud.origin.is_finite() {
        return Err(CloudError::NotFinite { index: 0, field: "origin" });
    }
    let arrays = [&cloud.positions, &cloud.log_scales, &cloud.sh].into_iter().all(|v| all_finite(v));
    if arrays && all_finite(&cloud.quaternions) && all_finite(cloud.opacity_logits.as_chunks::<1>().0) {
        return Ok(cloud);
    }
    let n = cloud.len();
    let kept: Vec<usize> = (0..n).into_par_iter().filter(|&i| cloud.flaw(i).is_none()).collect();
    // The first number that is not in its place.
    let at = kept.iter().enumerate().find(|(k, i)| k != *i).map_or(kept.len(), |(k, _)| k);
    let field = if at < n { cloud.flaw(at).unwrap_or_default() } else { "" };
    if kept.is_empty() {
        return Err(CloudError::NoneFinite { count: n, field });
    }
    let mut warnings = cloud.warnings.clone();
    warnings.push(format!(
        "{} of {} Gaussians are left out, as numbers of theirs are not finite (first: Gaussian {at}, {field})",
        count((n - kept.len()) as u64),
        count(n as u64)
    ));
    Ok(GaussianCloud { warnings, ..cloud.select(&kept) })
}

/// Returns whether all numbers are finite. Without an early exit in a chunk, so that it is fast if they are.
fn all_finite<const N: usize>(values: &[[f32; N]]) -> bool {
    let finite = |part: &[[f32; N]]| part.as_flattened().iter().fold(true, |all, x| all & x.is_finite());
    values.par_chunks(1 << 12).all(finite)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn those_that_are_not_finite_are_left_out_and_counted() {
        let mut c = GaussianCloud::isotropic((0..9).map(|i| [i as f32; 3]).collect(), 0.0, 0.0);
        assert_eq!(without_flaws(c.clone()).expect("finite"), c);
        (c.positions[2][1], c.sh[5][0], c.quaternions[7][3]) = (f32::NAN, f32::INFINITY, f32::NAN);
        let left = without_flaws(c.clone()).expect("some are left");
        let x: Vec<f32> = left.positions.iter().map(|p| p[0]).collect();
        assert_eq!(x, [0.0, 1.0, 3.0, 4.0, 6.0, 8.0]);
        assert!(left.warnings[0].starts_with("3 of 9 Gaussians are left out"), "{:?}", left.warnings);
        assert!(left.warnings[0].contains("first: Gaussian 2, position"), "{:?}", left.warnings);
        c.opacity_logits = vec![f32::NAN; 9];
        let e = without_flaws(c).expect_err("none is left").to_string();
        assert!(e.contains("none of its 9 Gaussians") && e.contains("opacity"), "{e}");
    }
}
