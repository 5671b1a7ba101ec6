//! The radix sort: ordered, stable, a permutation, at the sizes where blocks begin and end.

use crate::gpu_common::with_context;
use fmlgs::render::gpu::sort::sort_pairs;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Returns whether `(keys, values)` is the stable sort of `input` by the low `bits` bits with the values 0, 1, 2, ...
fn is_sorted(input: &[u32], keys: &[u32], values: &[u32], bits: u32) -> bool {
    let mask = if bits >= 32 { u32::MAX } else { (1 << bits) - 1 };
    let mut want: Vec<u32> = (0..input.len() as u32).collect();
    want.sort_by_key(|&i| input[i as usize] & mask);
    values == want && keys.iter().zip(&want).all(|(&k, &i)| k == input[i as usize]) && keys.len() == input.len()
}

fn keys(n: usize, distinct: u32, seed: u64) -> Vec<u32> {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    (0..n).map(|_| if distinct == 0 { rng.next_u32() } else { rng.random_range(0..distinct) * 0x0101_0101 }).collect()
}

#[test]
fn sorts_stably_at_every_size_with_and_without_ties() {
    with_context(|context| {
        for n in [0_usize, 1, 255, 256, 257, 4095, 4096, 4097, 31_000, 1_000_000] {
            for distinct in [0, 7, 200] {
                if n == 1_000_000 && distinct == 7 {
                    continue;
                }
                let input = keys(n, distinct, n as u64);
                let values: Vec<u32> = (0..n as u32).collect();
                let (k, v) = sort_pairs(context, &input, &values, 32).unwrap();
                assert!(is_sorted(&input, &k, &v, 32), "{n} keys, {distinct} distinct");
            }
        }
    });
}

#[test]
fn sorts_by_the_bits_it_is_told_and_no_others() {
    with_context(|context| {
        let input = keys(10_000, 0, 3);
        let values: Vec<u32> = (0..10_000).collect();
        for bits in [8, 16, 24] {
            let (k, v) = sort_pairs(context, &input, &values, bits).unwrap();
            assert!(is_sorted(&input, &k, &v, bits), "{bits} bits");
            assert!(!is_sorted(&input, &k, &v, 32), "{bits} bits are not 32");
        }
    });
}

#[test]
fn all_equal_keys_keep_their_order() {
    with_context(|context| {
        let input = vec![0xffff_ffff; 9_000];
        let values: Vec<u32> = (0..9_000).collect();
        let (_, v) = sort_pairs(context, &input, &values, 32).unwrap();
        assert_eq!(v, values);
    });
}

#[test]
fn the_check_itself_catches_inversions_losses_and_instability() {
    let input = [5, 3, 3, 9];
    assert!(is_sorted(&input, &[3, 3, 5, 9], &[1, 2, 0, 3], 32));
    assert!(!is_sorted(&input, &[3, 3, 5, 9], &[2, 1, 0, 3], 32), "unstable");
    assert!(!is_sorted(&input, &[3, 5, 3, 9], &[1, 0, 2, 3], 32), "not ordered");
    assert!(!is_sorted(&input, &[3, 3, 5, 5], &[1, 2, 0, 0], 32), "no permutation");
    assert!(!is_sorted(&input, &[3, 3, 5], &[1, 2, 0], 32), "one lost");
}
