//! Color overlays of the view.

use strum::{IntoStaticStr, VariantArray};

/// Quantity that colors the frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, VariantArray, IntoStaticStr)]
pub enum ColorBy {
    /// Only the masks of the answers.
    #[default]
    Masks,
    /// Relevancy for the newest query.
    #[strum(serialize = "Relevancy")]
    Heat,
    /// One color per object.
    Objects,
    /// One color per part.
    Parts,
    /// Identity codes of the pixels, blended or exact.
    Codes,
    /// The first three principal components of the language features.
    #[strum(serialize = "Embeddings")]
    Features,
    /// Pixels whose blended codes differ from those of their identity by more than the tolerance.
    #[strum(serialize = "Blending errors")]
    Difference,
}

impl ColorBy {
    pub(crate) fn text(self) -> &'static str {
        self.into()
    }

    /// True if it colors by identity, so that unlabeled pixels are marked too.
    pub(crate) fn tells_unknown(self) -> bool {
        matches!(self, Self::Objects | Self::Parts)
    }
}
