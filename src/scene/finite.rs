//! Removal of Gaussians with numbers that are not finite, reported as a warning.

use rayon::prelude::*;

use super::{CloudError, GaussianCloud};

impl GaussianCloud {
    /// The same cloud without those of its Gaussians that have a number that is not finite; a warning counts them.
    ///
    /// # Errors
    /// If its arrays do not fit one another, or every Gaussian has such a number.
    pub(crate) fn finite(self) -> Result<Self, CloudError> {
        self.lengths()?;
        if !self.origin.is_finite() {
            return Err(CloudError::NotFinite { index: 0, field: "origin" });
        }
        let arrays = [&self.positions, &self.log_scales, &self.sh].into_iter().all(|v| all_finite(v));
        if arrays && all_finite(&self.quaternions) && all_finite(self.opacity_logits.as_chunks::<1>().0) {
            return Ok(self);
        }
        let (n, kept): (usize, Vec<usize>) =
            (self.len(), (0..self.len()).into_par_iter().filter(|&i| self.flaw(i).is_none()).collect());
        // The first number that is not in its place.
        let at = kept.iter().enumerate().find(|(k, i)| k != *i).map_or(kept.len(), |(k, _)| k);
        let field = if at < n { self.flaw(at).unwrap_or_default() } else { "" };
        if kept.is_empty() {
            return Err(CloudError::NoneFinite { count: n, field });
        }
        let mut warnings = self.warnings.clone();
        warnings.push(format!(
            "{} of {n} Gaussians are left out, as numbers of theirs are not finite (first: Gaussian {at}, {field})",
            n - kept.len()
        ));
        Ok(Self { warnings, ..self.select(&kept) })
    }
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
        assert_eq!(c.clone().finite().expect("finite"), c);
        (c.positions[2][1], c.sh[5][0], c.quaternions[7][3]) = (f32::NAN, f32::INFINITY, f32::NAN);
        let left = c.clone().finite().expect("some are left");
        let x: Vec<f32> = left.positions.iter().map(|p| p[0]).collect();
        assert_eq!(x, [0.0, 1.0, 3.0, 4.0, 6.0, 8.0]);
        assert!(left.warnings[0].starts_with("3 of 9 Gaussians are left out"), "{:?}", left.warnings);
        assert!(left.warnings[0].contains("first: Gaussian 2, position"), "{:?}", left.warnings);
        c.opacity_logits = vec![f32::NAN; 9];
        let e = c.finite().expect_err("none is left").to_string();
        assert!(e.contains("none of its 9 Gaussians") && e.contains("opacity"), "{e}");
    }
}
