//! The smallest pieces: the basins of the edge map (watershed).

use crate::math::grid::neighbors;

/// Label of pixels outside the domain.
pub(crate) const OUTSIDE: u32 = u32::MAX;
const DRY: u32 = u32::MAX - 1;

/// Splits the domain into connected basins of `strength`, numbered from 0 in the order of their first pixels. Returns
/// the label of each pixel and the number of basins. Pixels outside the domain are [`OUTSIDE`]. Differences of
/// strength under `step` make no basins.
pub(crate) fn basins(strength: &[f32], domain: &[bool], width: usize, step: f32) -> (Vec<u32>, u32) {
    let level = |v: f32| ((v / step) as usize).min(LEVELS - 1);
    let levels: Vec<u16> = strength.iter().map(|&v| level(v) as u16).collect();
    let mut label: Vec<u32> = domain.iter().map(|&d| if d { DRY } else { OUTSIDE }).collect();
    let mut count = minima(&levels, &mut label, width);
    // Flooding: pixels leave the queue level by level, those of a level in their order of arrival.
    let mut queue: Vec<std::collections::VecDeque<u32>> = vec![std::collections::VecDeque::new(); LEVELS];
    for i in 0..label.len() {
        if label[i] < DRY {
            queue[usize::from(levels[i])].push_back(i as u32);
        }
    }
    let mut at = 0;
    while at < LEVELS {
        let Some(i) = queue[at].pop_front() else {
            at += 1;
            continue;
        };
        let own = label[i as usize];
        for j in neighbors(i as usize, width, label.len()) {
            if label[j] == DRY {
                label[j] = own;
                queue[usize::from(levels[j]).max(at)].push_back(j as u32);
            }
        }
    }
    // Every part of the domain has a minimum, so nothing stays dry.
    for l in label.iter_mut().filter(|l| **l == DRY) {
        *l = count;
        count += 1;
    }
    (label, count)
}

/// Number of levels of strength.
const LEVELS: usize = 1024;

/// Labels every plateau without a lower neighbor; returns their number.
fn minima(levels: &[u16], label: &mut [u32], width: usize) -> u32 {
    let n = levels.len();
    let mut seen = vec![false; n];
    let mut plateau = Vec::new();
    let mut count = 0;
    for start in 0..n {
        if seen[start] || label[start] != DRY {
            continue;
        }
        plateau.clear();
        plateau.push(start);
        seen[start] = true;
        let mut lowest = true;
        let mut next = 0;
        while let Some(&i) = plateau.get(next) {
            next += 1;
            for j in neighbors(i, width, n).filter(|&j| label[j] != OUTSIDE) {
                if levels[j] < levels[i] {
                    lowest = false;
                } else if levels[j] == levels[i] && !seen[j] {
                    seen[j] = true;
                    plateau.push(j);
                }
            }
        }
        if lowest {
            plateau.iter().for_each(|&i| label[i] = count);
            count += 1;
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ridges_part_basins() {
        // Two valleys, the right one cut off from a third by pixels outside the domain.
        let width = 30;
        let strength: Vec<f32> = (0..width * 10).map(|i| if i % width == 10 { 9.0 } else { 0.0 }).collect();
        let domain: Vec<bool> = (0..width * 10).map(|i| i % width != 20).collect();
        let (label, count) = basins(&strength, &domain, width, 0.5);
        assert_eq!(count, 3);
        for (i, &l) in label.iter().enumerate() {
            let want = match i % width {
                0..=9 => Some(0),
                11..=19 => Some(1),
                20 => Some(OUTSIDE),
                21.. => Some(2),
                10 => None,
            };
            assert!(want.is_none_or(|w| w == l) && l != DRY, "{i}: {l}");
        }
    }

    #[test]
    fn slopes_belong_to_their_valley() {
        let strength: Vec<f32> = (0..50).map(|i| [20.0 - i as f32, i as f32 - 20.0][usize::from(i > 20)]).collect();
        assert_eq!(basins(&strength, &[true; 50], 50, 0.5).1, 1);
        assert_eq!(basins(&strength, &[false; 50], 50, 0.5).1, 0);
        assert_eq!(basins(&[], &[], 1, 0.5).1, 0);
    }
}
