//! Language features of a scene's identities: embeddings of their pictures.

use super::Identities;

/// Views of an identity whose features are kept at most. Averaging views blurs what they mean, so a
/// few are kept and the best one counts.
pub(crate) const MAX_VIEWS: usize = 4;

/// Embeddings of all identities.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LanguageFeatures {
    /// The encoder that made them.
    pub encoder: String,
    /// Numbers per embedding.
    pub dimension: usize,
    /// By identity number less one.
    pub by_identity: Vec<ViewFeatures>,
}

/// Embeddings of one identity, one per view, unit length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ViewFeatures {
    /// Of the identity's own picture.
    pub raw: Vec<Vec<f32>>,
    /// Of a part, moved toward its whole's (the paper's semantic deviation); of an object, as raw.
    pub deviated: Vec<Vec<f32>>,
}

impl LanguageFeatures {
    /// Returns whether the lengths fit together and fit these identities, and all numbers are finite.
    pub fn is_valid(&self, identities: &Identities) -> bool {
        let good = |v: &Vec<f32>| v.len() == self.dimension && v.iter().all(|x| x.is_finite());
        self.by_identity.len() == identities.len()
            && self.by_identity.iter().all(|f| {
                f.raw.len() == f.deviated.len() && f.raw.len() <= MAX_VIEWS && f.raw.iter().chain(&f.deviated).all(good)
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn features_fit_their_identities_or_are_refused() {
        let all = Identities::objects(2);
        let seen = |views: usize, dimension: usize| ViewFeatures {
            raw: vec![vec![0.5; dimension]; views],
            deviated: vec![vec![0.5; dimension]; views],
        };
        let of = |of: Vec<ViewFeatures>| LanguageFeatures { encoder: "t".into(), dimension: 3, by_identity: of };
        let good = of(vec![seen(MAX_VIEWS, 3), seen(0, 3)]);
        assert!(good.is_valid(&all));
        assert!(!of(vec![seen(1, 3)]).is_valid(&all), "one is missing");
        assert!(!of(vec![seen(1, 3), seen(1, 2)]).is_valid(&all), "too short");
        assert!(!of(vec![seen(1, 3), seen(MAX_VIEWS + 1, 3)]).is_valid(&all), "too many");
        let mut odd = good.clone();
        odd.by_identity[0].deviated.pop();
        assert!(!odd.is_valid(&all), "raw and deviated are pairs");
        for (k, bad) in [f32::NAN, f32::INFINITY].into_iter().enumerate() {
            let mut poisoned = good.clone();
            let of = &mut poisoned.by_identity[0];
            (if k == 0 { &mut of.raw } else { &mut of.deviated })[2][1] = bad;
            assert!(!poisoned.is_valid(&all), "{bad}");
        }
    }
}
