//! Phrases to a result without language whose classes have names: a phrase that is a name is answered by its class.

use super::ForeignError;
use super::asked::{ForeignScene, ForeignView};
use super::classes::share_at_pixels;
use super::own_rules::ForeignMask;
use crate::io::results::{Classifier, LevelValues};
use crate::pipeline::semantics::smoothing::peak;
use crate::scene::Mask;

/// Share of a class that belongs to its mask (Gaussian Grouping's rendering of texts).
const SHARE: f32 = 0.2;
/// The rule in words.
const BY_SHARE: &str = "class that is called so; share over 0.2";

impl ForeignScene {
    /// The first level with classes, and its classifier.
    fn classes(&self) -> Option<(usize, &Classifier)> {
        self.result.levels.iter().enumerate().find_map(|(k, level)| match &level.values {
            LevelValues::Classes { classifier, .. } => Some((k, classifier)),
            _ => None,
        })
    }

    /// Returns whether somebody named its classes.
    pub(crate) fn has_named_classes(&self) -> bool {
        self.classes().is_some_and(|(_, classifier)| !classifier.names.is_empty())
    }

    /// Share of the class of this name at each pixel of a view, 0 to 1; 0 where nothing is.
    ///
    /// # Errors
    /// If there are no classes, or none is called so.
    pub(crate) fn share_of_name(&self, view: &ForeignView, name: &str) -> Result<Vec<f32>, ForeignError> {
        let method = self.result.method.name();
        let (level, classifier) = self.classes().ok_or(ForeignError::NoIdentities(method))?;
        let blended = view.blended(level).ok_or(ForeignError::Level(level))?;
        let none = || ForeignError::NoClass { method, name: name.trim().to_owned() };
        let mut share = share_at_pixels(classifier, blended, classifier.named(name).ok_or_else(none)?);
        share.iter_mut().zip(&blended.alpha).filter(|(_, a)| **a == 0.0).for_each(|(s, _)| *s = 0.0);
        Ok(share)
    }

    /// The mask of the class of this name by the method's own rule.
    ///
    /// # Errors
    /// As [`Self::share_of_name`].
    pub(crate) fn mask_of_name(&self, view: &ForeignView, name: &str) -> Result<ForeignMask, ForeignError> {
        let (w, h) = view.size();
        let values = self.share_of_name(view, name)?;
        let mask = Mask::from_fn(w, h, |i| values[i] > SHARE);
        let peak = peak(&values).filter(|at| values[*at] > 0.0);
        Ok(ForeignMask { mask, level: 0, values, peak, rule: BY_SHARE })
    }
}
