//! Pixels of a picture by index, row-major.

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
}
