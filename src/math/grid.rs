//! Pixels of a picture by index, row-major.

/// The pixels left, right, above and below pixel `i`, of a picture of `n` pixels that is `width` wide.
pub fn neighbours(i: usize, width: usize, n: usize) -> impl Iterator<Item = usize> {
    let x = i % width;
    [(x > 0).then(|| i - 1), (x + 1 < width).then_some(i + 1), i.checked_sub(width), Some(i + width).filter(|j| *j < n)]
        .into_iter()
        .flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_do_not_join_at_their_ends() {
        let of = |i: usize| neighbours(i, 3, 6).collect::<Vec<_>>();
        assert_eq!((of(0), of(2), of(4)), (vec![1, 3], vec![1, 5], vec![3, 5, 1]));
        assert_eq!(neighbours(0, 1, 1).count(), 0);
    }
}
