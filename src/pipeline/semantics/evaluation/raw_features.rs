//! Raw features per Gaussian, the baseline without identities: every Gaussian carries the mean raw feature of its
//! identity. Features are blended like colors, and a pixel's relevancy is that of its blend.
//!
//! A blend is a sum over the few identities of a pixel's Gaussians. So it is exact from the pixel's weights by
//! identity, without rendering hundreds of channels; products of features are computed once.

use crate::math::vector::dot;
use crate::pipeline::semantics::query::by_embedding::TextEmbeddings;
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::pipeline::semantics::relevancy::{nearest, score};
use crate::render::PixelWeights;
use crate::scene::LanguageFeatures;

/// Mean raw feature of each identity by number; zero for unlabeled Gaussians.
pub(crate) struct RawFeatures {
    of: Vec<Vec<f32>>,
    /// Products of all pairs.
    products: Vec<Vec<f32>>,
}

impl RawFeatures {
    pub(crate) fn new(language: &LanguageFeatures) -> Self {
        let mean = |views: &Vec<Vec<f32>>| -> Vec<f32> {
            let n = views.len().max(1) as f32;
            (0..language.dimension).map(|c| views.iter().map(|v| v[c]).sum::<f32>() / n).collect()
        };
        let nobody = vec![0.0; language.dimension];
        let of: Vec<_> = std::iter::once(nobody).chain(language.by_identity.iter().map(|f| mean(&f.raw))).collect();
        let products = of.iter().map(|a| of.iter().map(|b| dot(a, b)).collect()).collect();
        Self { of, products }
    }

    /// Relevancy of every pixel, 0 to 1; `None` if the phrase was never learned.
    pub(crate) fn relevancy(
        &self,
        view: &[PixelWeights],
        phrase: &str,
        phrases: &TextEmbeddings,
        recipe: &QueryConfig,
    ) -> Option<Vec<f32>> {
        let toward = |phrase: &str| {
            let phrase = phrases.get(phrase)?;
            Some(self.of.iter().map(|f| dot(f, phrase)).collect::<Vec<f32>>())
        };
        let query = toward(phrase)?;
        let canonical: Vec<Vec<f32>> = recipe.canonical.iter().filter_map(toward).collect();
        let pixel = |slots: &PixelWeights| {
            let known = || slots.iter().filter(|s| s.1 > 0.0 && (s.0 as usize) < self.of.len());
            let blended = |v: &[f32]| known().map(|s| s.1 * v[s.0 as usize]).sum::<f32>();
            let length = known().map(|s| s.1 * blended(&self.products[s.0 as usize])).sum::<f32>().sqrt();
            let nearest = nearest(canonical.iter().map(|c| blended(c)));
            if length > 1e-6 { score((blended(&query) - nearest) / length, recipe.temperature) } else { 0.0 }
        };
        Some(view.iter().map(pixel).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::semantics::query::parse::ParsedQuery;
    use crate::pipeline::semantics::relevancy::advantage;
    use crate::scene::{NO_IDENTITY, ViewFeatures};

    #[test]
    fn a_blend_is_as_relevant_as_the_unit_vector_of_its_sum() {
        let of = |raw: [f32; 3]| ViewFeatures { raw: vec![raw.to_vec(); 2], deviated: vec![vec![0.0; 3]; 2] };
        let features = [[1.0, 0.0, 0.0], [0.0, 0.6, 0.8]];
        let by_identity = features.map(of).to_vec();
        let raw = RawFeatures::new(&LanguageFeatures { encoder: "t".into(), dimension: 3, by_identity });
        let mut phrases = TextEmbeddings::default();
        let mut encode = |p: &str| {
            Ok::<_, ()>(match p {
                "mug" => vec![0.8, 0.6, 0.0],
                "stuff" => vec![0.0, 0.0, 1.0],
                _ => vec![0.0, 1.0, 0.0],
            })
        };
        let recipe = QueryConfig::default();
        phrases.learn(&ParsedQuery::parse("mug").expect("a phrase"), &recipe, &mut encode).expect("encodes");
        let mut mixed: PixelWeights = [(NO_IDENTITY, 0.0); 8];
        mixed[..3].copy_from_slice(&[(1, 0.3), (2, 0.5), (NO_IDENTITY, 0.1)]);
        let mut alone = mixed;
        alone[1].1 = 0.0;
        let nothing = [(NO_IDENTITY, 0.0); 8];
        let got = raw.relevancy(&[mixed, alone, nothing], "mug", &phrases, &recipe).expect("learned");
        let canonical: Vec<Vec<f32>> = recipe.canonical.iter().map(|c| encode(c).expect("encodes")).collect();
        let expected = |sum: [f32; 3]| {
            let unit = crate::math::vector::unit(&sum).expect("not zero");
            score(advantage(&unit, &[0.8, 0.6, 0.0], &canonical), recipe.temperature)
        };
        assert!((got[0] - expected([0.3, 0.3, 0.4])).abs() < 1e-5, "{got:?}");
        assert!((got[1] - expected([0.3, 0.0, 0.0])).abs() < 1e-5 && got[2] == 0.0, "{got:?}");
        assert!((got[0] - got[1]).abs() > 0.1, "what is blended in counts");
        assert_eq!(raw.relevancy(&[mixed], "never learned", &phrases, &recipe), None);
    }
}
