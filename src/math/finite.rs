//! Finiteness of the results of a stage, asserted after every stage under `debug-validation`.
//!
//! Stages that can fail return an error with stage, field and index. Others panic with the same text, and the worker
//! reports it.

use super::Real;

/// True if stages are checked: the Cargo feature `debug-validation`. Constant, so that checks cost nothing without the
/// feature.
pub(crate) const CHECKED: bool = cfg!(feature = "debug-validation");

/// A number that is not finite, and its place.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("after {stage}: {field} {index} is not finite")]
pub struct NotFinite {
    pub(crate) stage: &'static str,
    pub(crate) field: &'static str,
    /// Index in the field, from 0.
    pub(crate) index: usize,
}

/// Finds the first number that is not finite.
pub(crate) fn all_finite<'a, R: Real>(
    stage: &'static str,
    field: &'static str,
    values: impl IntoIterator<Item = &'a R>,
) -> Result<(), NotFinite> {
    match values.into_iter().position(|v| !v.is_finite()) {
        Some(index) => Err(NotFinite { stage, field, index }),
        None => Ok(()),
    }
}

/// For stages that cannot fail: under `debug-validation` a number that is not finite ends the job with a panic that
/// names it and that the worker reports.
pub(crate) fn insist(found: impl FnOnce() -> Result<(), NotFinite>) {
    if CHECKED {
        let text = found().err().map(|e| e.to_string());
        assert!(text.is_none(), "{}", text.unwrap_or_default());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_number_that_is_none_is_named() {
        assert_eq!(all_finite("blending", "alpha", &[0.0, -1e300, 5e-324]), Ok(()));
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let found = all_finite("blending", "alpha", &[0.0, 1.0, bad, bad]);
            assert_eq!(found, Err(NotFinite { stage: "blending", field: "alpha", index: 2 }));
            let text = found.expect_err("bad").to_string();
            assert_eq!(text, "after blending: alpha 2 is not finite");
        }
    }

    #[test]
    fn stages_that_cannot_fail_panic_only_under_the_feature() {
        let poisoned = std::panic::catch_unwind(|| insist(|| all_finite("codes", "code", &[f32::NAN])));
        assert_eq!(poisoned.is_err(), CHECKED);
        insist(|| all_finite("codes", "code", &[0.5_f32]));
    }
}
