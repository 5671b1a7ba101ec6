//! Pixels of a picture by index, row-major.

use std::collections::VecDeque;

use super::distance::squared_distances;

/// The pixels left, right, above and below pixel `i`, of a picture of `n` pixels that is `width` wide.
pub(crate) fn neighbors(i: usize, width: usize, n: usize) -> impl Iterator<Item = usize> {
    let x = i % width;
    [(x > 0).then(|| i - 1), (x + 1 < width).then_some(i + 1), i.checked_sub(width), Some(i + width).filter(|j| *j < n)]
        .into_iter()
        .flatten()
}

/// Connected regions of the pixels for which `is` holds, diagonals included: the number of each
/// pixel's region from 1, 0 for none, and the areas of the regions, in the order of their first
/// pixels.
pub(crate) fn regions(width: usize, n: usize, is: impl Fn(usize) -> bool) -> (Vec<u32>, Vec<usize>) {
    let mut label = vec![0_u32; n];
    let (mut areas, mut open) = (Vec::new(), Vec::new());
    for first in 0..n {
        if label[first] != 0 || !is(first) {
            continue;
        }
        let number = areas.len() as u32 + 1;
        let mut area = 0;
        label[first] = number;
        open.push(first);
        while let Some(i) = open.pop() {
            area += 1;
            let x = i % width;
            for (row, at) in [i.checked_sub(width), Some(i), Some(i + width).filter(|j| *j < n)].into_iter().enumerate()
            {
                let Some(at) = at else { continue };
                let near = [(x > 0).then(|| at - 1), (row != 1).then_some(at), (x + 1 < width).then_some(at + 1)];
                for j in near.into_iter().flatten() {
                    if label[j] == 0 && is(j) {
                        label[j] = number;
                        open.push(j);
                    }
                }
            }
        }
        areas.push(area);
    }
    (label, areas)
}

/// Spreads the values `known` at some pixels to the pixels that are `open`: each takes the nearest by steps to
/// neighbors, the first if several are as near; `None` if none can be reached.
pub(crate) fn spread<T: Copy>(
    width: usize,
    n: usize,
    known: impl IntoIterator<Item = (usize, T)>,
    open: impl Fn(usize) -> bool,
) -> Vec<Option<T>> {
    let mut of = vec![None; n];
    let mut front = VecDeque::new();
    for (i, value) in known {
        if of[i].is_none() {
            of[i] = Some(value);
            front.push_back(i);
        }
    }
    while let Some(i) = front.pop_front() {
        for j in neighbors(i, width, n) {
            if of[j].is_none() && open(j) {
                of[j] = of[i];
                front.push_back(j);
            }
        }
    }
    of
}

/// The pixels for which `is` holds, and those that are at most `steps` neighbors away from one.
pub(crate) fn grown(width: usize, mut is: Vec<bool>, steps: usize) -> Vec<bool> {
    for _ in 0..steps {
        is = (0..is.len()).map(|i| is[i] || neighbors(i, width, is.len()).any(|j| is[j])).collect();
    }
    is
}

/// Distance of each pixel from the nearest one for which `is` holds, px; infinite if that is more than `most`.
pub(crate) fn distances(width: usize, is: &[bool], most: usize) -> Vec<f64> {
    if !is.contains(&true) {
        return vec![f64::INFINITY; is.len()];
    }
    let squared = squared_distances(is, [width, is.len() / width.max(1), 1]);
    let distance = |d: f32| if d <= (most * most) as f32 { f64::from(d).sqrt() } else { f64::INFINITY };
    squared.into_iter().map(distance).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_do_not_join_at_their_ends() {
        let of = |i: usize| neighbors(i, 3, 6).collect::<Vec<_>>();
        assert_eq!((of(0), of(2), of(4)), (vec![1, 3], vec![1, 5], vec![3, 5, 1]));
        assert_eq!(neighbors(0, 1, 1).count(), 0);
    }

    #[test]
    fn regions_hang_together_over_corners_but_not_around_ends() {
        let picture = b"#..#.\
                        .#..#\
                        #....";
        let (label, areas) = regions(5, 15, |i| picture[i] == b'#');
        assert_eq!(areas, [3, 2]);
        assert_eq!((label[0], label[6], label[10], label[3], label[9], label[1]), (1, 1, 1, 2, 2, 0));
        assert_eq!(regions(1, 0, |_| true).1.len(), 0);
    }

    #[test]
    fn diagonals_join_in_both_directions() {
        let picture = b".#.\
                        #.#\
                        .#.";
        let (label, areas) = regions(3, 9, |i| picture[i] == b'#');
        assert_eq!((areas, label), (vec![4], vec![0, 1, 0, 1, 0, 1, 0, 1, 0]));
        // One column: left and right are nothing, above and below are near.
        assert_eq!(regions(1, 4, |i| i != 1), (vec![1, 0, 2, 2], vec![1, 2]));
        assert_eq!(neighbors(1, 1, 3).collect::<Vec<_>>(), [0, 2]);
    }

    #[test]
    fn the_nearest_spreads_around_what_is_closed() {
        // a # .
        // . # b
        // . . .
        let of = spread(3, 9, [(0, 'a'), (5, 'b')], |i| i != 1 && i != 4);
        let text: String = of.iter().map(|v| v.unwrap_or('#')).collect();
        assert_eq!(text, "a#ba#babb");
        assert_eq!(spread(2, 4, [(0, 1)], |_| false), [Some(1), None, None, None]);
    }

    #[test]
    fn growing_takes_in_neighbors_step_by_step() {
        let one = |i: usize| (0..9).map(|k| k == i).collect::<Vec<_>>();
        let count = |v: Vec<bool>| v.iter().filter(|b| **b).count();
        assert_eq!([0, 1, 2].map(|steps| count(grown(3, one(4), steps))), [1, 5, 9]);
        assert_eq!(grown(3, one(0), 1), [true, true, false, true, false, false, false, false, false]);
    }

    #[test]
    fn distances_are_those_of_the_nearest_pixel() {
        let (w, h) = (17, 11);
        let marked = [(3, 2), (12, 9), (13, 9)];
        let is: Vec<bool> = (0..w * h).map(|i| marked.contains(&(i % w, i / w))).collect();
        let found = distances(w, &is, 6);
        for (i, found) in found.iter().enumerate() {
            let to = |&(x, y): &(usize, usize)| (x as f64 - (i % w) as f64).hypot(y as f64 - (i / w) as f64);
            let nearest = marked.iter().map(to).fold(f64::INFINITY, f64::min);
            let expected = if nearest <= 6.0 { nearest } else { f64::INFINITY };
            assert!(*found == expected || (found - expected).abs() < 1e-12, "{i}: {found}, not {expected}");
        }
        assert!(found.iter().any(|d| d.is_infinite()) && found.iter().filter(|d| **d == 0.0).count() == 3);
        assert_eq!(distances(4, &[false; 8], 9), [f64::INFINITY; 8]);
        assert!(distances(0, &[], 3).is_empty());
    }
}
