//! Features of Gaussians as rows: the codes that a method stores, and the embeddings that are decoded from them.

use std::ops::Range;

use rayon::prelude::*;

use super::blend::factor;
use super::descriptors::direction;
use crate::io::results::LevelValues;

/// Codes of some Gaussians, one after another; empty if Gaussians have numbers of clusters instead.
pub(crate) fn codes(values: &LevelValues, gaussians: Range<usize>) -> Vec<f32> {
    let dim = values.code_dim().unwrap_or(0);
    let mut all = vec![0.0; gaussians.len() * dim];
    if dim > 0 {
        let rows = all.par_chunks_exact_mut(dim).zip(gaussians);
        rows.for_each(|(row, i)| values.copy_code(i, row));
    }
    all
}

/// Embeddings of some Gaussians, of unit length, one after another; zeros for a Gaussian without one, the weighed mean
/// for one whose cluster has several. Empty if the method knows no language.
pub(crate) fn embeddings(values: &LevelValues, gaussians: Range<usize>) -> Vec<f32> {
    let dim = values.embedding_dim().unwrap_or(0);
    let mut all = vec![0.0; gaussians.len() * dim];
    if dim == 0 {
        return all;
    }
    let rows = all.par_chunks_exact_mut(dim).zip(gaussians);
    match values {
        LevelValues::Embedded(level) => rows.for_each(|(row, i)| {
            let mut code = vec![0.0; level.codes.dim()];
            level.codes.copy(i, 0, &mut code);
            let factor = factor(level, &code);
            code.iter_mut().for_each(|v| *v *= factor);
            row.copy_from_slice(&level.decoder.embedding(&code));
        }),
        LevelValues::Clusters(level) => rows.for_each(|(row, i)| {
            let own = level.of[i].and_then(|cluster| direction(level, cluster as usize));
            own.iter().for_each(|own| row.copy_from_slice(own));
        }),
        LevelValues::Classes { .. } | LevelValues::Affinity { .. } => {}
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::results::tests::{expected, sample};
    use crate::math::vector::{dot, unit};

    #[test]
    fn embeddings_are_decoded_from_the_codes_of_their_level() {
        let result = sample("langsplat/output");
        for (k, level) in result.levels.iter().enumerate() {
            let wanted = expected(&format!("langsplat/expected/decoded_first_rows_{}.npy", k + 1));
            let other = expected(&format!("langsplat/expected/decoded_first_rows_{}.npy", (k + 1) % 3 + 1));
            let rows = wanted.len() / 512;
            let found = embeddings(&level.values, 0..rows);
            let apart = |other: &[f32]| found.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert_eq!(found.len(), wanted.len());
            assert!(apart(&wanted) < 1e-4 && apart(&other) > 1e-3, "level {k}, and the control: another level");
            let later = embeddings(&level.values, 1..rows);
            assert_eq!(later, found[512..], "a range begins where it says");
            assert_eq!(codes(&level.values, 0..32), expected(&format!("langsplat/expected/codes_{}.npy", k + 1)));
        }
    }

    #[test]
    fn gaussians_have_the_embedding_of_their_cluster() {
        let result = sample("opengaussian");
        let LevelValues::Clusters(clusters) = &result.levels[0].values else { panic!("no clusters") };
        let found = embeddings(&result.levels[0].values, 0..32);
        for (own, cluster) in found.chunks_exact(512).zip(&clusters.of) {
            let row = clusters.features.row(cluster.expect("a cluster") as usize);
            match unit(&row) {
                Some(row) => assert!(dot(own, &row) > 1.0 - 1e-5),
                None => assert!(own.iter().all(|v| *v == 0.0), "seen three times"),
            }
        }
        assert!(codes(&result.levels[0].values, 0..32).is_empty());
    }

    #[test]
    fn methods_without_language_have_codes_alone() {
        let result = sample("gaussian_grouping");
        let values = &result.levels[0].values;
        assert_eq!(codes(values, 0..32), expected("gaussian_grouping/expected/features.npy"));
        assert!(embeddings(values, 0..32).is_empty());
    }
}
