//! Language features of a scene's identities: what an encoder makes of their pictures.

use super::{Identities, IdentityId};

/// Views of an identity whose features are kept at most. Averaging views blurs what they mean, so a
/// few are kept and the best one counts.
pub const MAX_VIEWS: usize = 4;

/// Embeddings of all identities.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LanguageFeatures {
    /// The encoder that made them.
    pub encoder: String,
    /// Numbers per embedding.
    pub dimension: usize,
    /// By identity number less one.
    pub of: Vec<ViewFeatures>,
}

/// Embeddings of one identity, one per view, unit length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ViewFeatures {
    /// Of the identity's own picture.
    pub raw: Vec<Vec<f32>>,
    /// Of a part, moved towards its whole's (the paper's semantic deviation); of an object, as raw.
    pub deviated: Vec<Vec<f32>>,
}

impl LanguageFeatures {
    /// Features of an identity; `None` if it has none.
    pub fn get(&self, id: IdentityId) -> Option<&ViewFeatures> {
        self.of.get((id as usize).checked_sub(1)?).filter(|f| !f.raw.is_empty())
    }

    /// Whether the numbers fit together, and fit these identities.
    pub fn is_valid(&self, identities: &Identities) -> bool {
        let good = |v: &Vec<f32>| v.len() == self.dimension && v.iter().all(|x| x.is_finite());
        self.of.len() == identities.len()
            && self.of.iter().all(|f| {
                f.raw.len() == f.deviated.len() && f.raw.len() <= MAX_VIEWS && f.raw.iter().chain(&f.deviated).all(good)
            })
    }
}
