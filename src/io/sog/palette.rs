//! Palettes: vector quantization of many vectors to a few.

use std::collections::BinaryHeap;

/// Palette for a list of vectors of `dimensions` numbers each.
pub(super) struct VectorPalette {
    /// Its entries, one after another.
    pub(super) entries: Vec<f32>,
    /// Index of the entry for each of the vectors.
    pub(super) labels: Vec<u16>,
}

/// Range of similar vectors in the sorted list of all.
struct Group {
    start: usize,
    end: usize,
    mean: Vec<f64>,
    /// Axis of the largest variance.
    axis: usize,
}

/// Builds a palette of at most `most` entries, up to 65,536. The group with the largest squared error is split at the
/// mean of its widest axis until there are `most` groups. The result is deterministic.
pub(super) fn palette(vectors: &[f32], dimensions: usize, most: usize) -> VectorPalette {
    let n = vectors.len() / dimensions;
    let mut order: Vec<u32> = (0..n as u32).collect();
    let value = |i: u32, axis: usize| f64::from(vectors[i as usize * dimensions + axis]);
    let group = |order: &[u32], start: usize| {
        let count = order.len().max(1) as f64;
        let sum = |axis: usize, of: &dyn Fn(f64) -> f64| order.iter().map(|i| of(value(*i, axis))).sum::<f64>();
        let mean: Vec<f64> = (0..dimensions).map(|axis| sum(axis, &|v| v) / count).collect();
        let spread: Vec<f64> = (0..dimensions).map(|axis| sum(axis, &|v| (v - mean[axis]).powi(2))).collect();
        let axis = (0..dimensions).max_by(|a, b| spread[*a].total_cmp(&spread[*b])).unwrap_or(0);
        // Bits of non-negative floats have the order of the floats.
        (spread.iter().sum::<f64>().to_bits(), Group { start, end: start + order.len(), mean, axis })
    };
    let (error, all) = group(&order, 0);
    let mut groups = vec![all];
    let mut widest = BinaryHeap::from([(error, 0)]);
    while groups.len() < most.min(1 << 16) {
        let Some((_, at)) = widest.pop().filter(|(error, _)| f64::from_bits(*error) > 0.0) else { break };
        let Group { start, end, axis, .. } = groups[at];
        let (part, middle) = (&mut order[start..end], groups[at].mean[axis]);
        let left = partition(part, |i| value(i, axis) < middle);
        // A rounded mean may leave one half empty.
        if left == 0 || left == part.len() {
            continue;
        }
        let halves = [group(&part[..left], start), group(&part[left..], start + left)];
        for (place, (error, half)) in [at, groups.len()].into_iter().zip(halves) {
            widest.push((error, place));
            match groups.get_mut(place) {
                Some(old) => *old = half,
                None => groups.push(half),
            }
        }
    }
    let mut labels = vec![0; n];
    for (label, group) in groups.iter().enumerate() {
        order[group.start..group.end].iter().for_each(|i| labels[*i as usize] = label as u16);
    }
    VectorPalette { entries: groups.iter().flat_map(|g| g.mean.iter().map(|v| *v as f32)).collect(), labels }
}

/// Moves the elements that satisfy `first` to the front, and counts them.
fn partition(all: &mut [u32], first: impl Fn(u32) -> bool) -> usize {
    let mut count = 0;
    for k in 0..all.len() {
        if first(all[k]) {
            all.swap(k, count);
            count += 1;
        }
    }
    count
}

/// Returns a palette of 256 numbers in ascending order, and for each value the index of the nearest.
pub(super) fn codebook(values: &[f32]) -> ([f32; 256], Vec<u8>) {
    /// Rounds in which every entry moves to the mean of its nearest values.
    const ROUNDS: usize = 8;
    let mut entries = palette(values, 1, 256).entries;
    entries.sort_by(f32::total_cmp);
    let mut labels = Vec::new();
    for round in 0..=ROUNDS {
        labels = values.iter().map(|v| entries.partition_point(|e| e < v)).map(|k| k.min(entries.len() - 1)).collect();
        for (label, v) in labels.iter_mut().zip(values) {
            if *label > 0 && v - entries[*label - 1] < entries[*label] - v {
                *label -= 1;
            }
        }
        if round < ROUNDS {
            let mut sums = vec![(0.0_f64, 0_u32); entries.len()];
            labels.iter().zip(values).for_each(|(label, v)| {
                sums[*label].0 += f64::from(*v);
                sums[*label].1 += 1;
            });
            for (entry, (sum, count)) in entries.iter_mut().zip(sums).filter(|(_, (_, count))| *count > 0) {
                *entry = (sum / f64::from(count)) as f32;
            }
        }
    }
    let last = entries.last().copied().unwrap_or_default();
    (std::array::from_fn(|k| entries.get(k).copied().unwrap_or(last)), labels.into_iter().map(|l| l as u8).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_that_are_apart_get_entries_of_their_own() {
        // Four places, 100 vectors around each.
        let at = |k: usize| [(k % 2) as f32 * 10.0, (k / 2 % 2) as f32 * 10.0, 5.0];
        let vectors: Vec<f32> = (0..400).flat_map(|k| at(k).map(|v| v + (k / 4) as f32 * 1e-3)).collect();
        let found = palette(&vectors, 3, 4);
        assert_eq!((found.entries.len(), found.labels.len()), (12, 400));
        for k in 0..400 {
            let entry = &found.entries[usize::from(found.labels[k]) * 3..][..3];
            assert!(entry.iter().zip(at(k)).all(|(a, b)| (a - b).abs() < 0.11), "{k}: {entry:?}");
        }
        assert_eq!(palette(&vectors, 3, 4).labels, found.labels, "the same again");
    }

    #[test]
    fn few_values_are_kept_as_they_are() {
        let values: Vec<f32> = (0..1000).map(|i| [0.5, -3.0, 7.25, 0.5000001][i % 4]).collect();
        let (entries, labels) = codebook(&values);
        assert!(values.iter().zip(labels).all(|(v, l)| entries[usize::from(l)] == *v));
        assert!(entries.is_sorted());
        let (same, labels) = codebook(&[2.5; 7]);
        assert_eq!((same, labels), ([2.5; 256], vec![0; 7]));
        assert_eq!(palette(&[1.0, 2.0, 3.0, 4.0], 2, 1 << 20).entries.len(), 4);
    }

    #[test]
    fn a_codebook_is_denser_where_the_values_are() {
        let values: Vec<f32> =
            (0..20_000).map(|i| (i as f32 / 20_000.0 - 0.5) * 2.0).map(|t| t * t * t * 10.0).collect();
        let (entries, labels) = codebook(&values);
        let error = values.iter().zip(&labels).map(|(v, l)| (v - entries[usize::from(*l)]).powi(2)).sum::<f32>();
        let even = values.iter().map(|v| ((v + 10.0) / 20.0 * 255.0).round() / 255.0 * 20.0 - 10.0 - v);
        assert!(error < 0.85 * even.map(|e| e * e).sum::<f32>(), "{error}");
    }
}
