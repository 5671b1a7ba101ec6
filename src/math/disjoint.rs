//! Disjoint sets: numbers that are joined step by step.

/// Representative of the set of `i`. Each number names another one of its set; the representative names itself.
pub(crate) fn root(of: &mut [u32], mut i: u32) -> u32 {
    while of[i as usize] != i {
        // Path halving: later searches are shorter.
        of[i as usize] = of[of[i as usize] as usize];
        i = of[i as usize];
    }
    i
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ways_end_at_what_stands_for_all_and_become_shorter() {
        let mut of = vec![0, 0, 1, 2, 4];
        assert_eq!((root(&mut of, 3), root(&mut of, 4), root(&mut of, 0)), (0, 4, 0));
        assert_eq!(of[3], 1);
    }
}
