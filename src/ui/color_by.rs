//! What colors the view besides the picture itself.

use strum::{IntoStaticStr, VariantArray};

/// What tints the frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, VariantArray, IntoStaticStr)]
pub enum ColorBy {
    /// Only the masks of the answers.
    #[default]
    Masks,
    /// Relevancy for the newest query.
    #[strum(serialize = "Relevancy")]
    Heat,
    /// A color per object.
    Objects,
    /// A color per part.
    Parts,
    /// The codes of the pixels, blended or exact.
    Codes,
    /// The three main directions of the language features.
    #[strum(serialize = "Embeddings")]
    Features,
    /// Where blended codes mean something else than the winning identities.
    #[strum(serialize = "Blending errors")]
    Difference,
}

impl ColorBy {
    pub(crate) fn text(self) -> &'static str {
        self.into()
    }

    /// Whether it shows whose things are, and so what of that is not known.
    pub(crate) fn tells_unknown(self) -> bool {
        matches!(self, Self::Objects | Self::Parts)
    }
}
