//! Tests of `.ksplat`.

use super::*;

/// A file of one section: header fields by position, then the bytes after the section's header.
fn file(level: u16, counts: [u32; 2], section: &[(usize, u32)], body: &[u8]) -> Vec<u8> {
    let mut out = vec![0; HEADER + SECTION_HEADER];
    out[1] = 1;
    let mut put = |at: usize, v: u32| out[at..at + 4].copy_from_slice(&v.to_le_bytes());
    [(4, counts[0]), (8, counts[0]), (12, counts[1]), (16, counts[1]), (20, level.into())]
        .into_iter()
        .for_each(|(at, v)| put(at, v));
    section.iter().for_each(|(at, v)| put(HEADER + at, *v));
    out.extend(body);
    out
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

fn halves(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| f16::from_f32(*v).to_le_bytes()).collect()
}

fn parsed(bytes: &[u8]) -> Result<GaussianCloud, IoError> {
    parse(bytes, Path::new("a.ksplat"))
}

const COLOR: [u8; 4] = [255, 0, 128, 51];

/// Harmonics of the first two bands, channel by channel within a band, as the format orders them.
fn ordered() -> Vec<f32> {
    (0..24).map(|k| k as f32 / 16.0).collect()
}

fn check(c: &GaussianCloud, at: usize, position: [f32; 3]) {
    let near = |a: f32, b: f32| assert!((a - b).abs() < 0.01, "{a} {b}");
    c.positions[at].iter().zip(position).for_each(|(a, b)| near(*a, b));
    near(c.log_scales[at][0], 0.5_f32.ln());
    assert_eq!(c.quaternions[at], [0.5, -0.5, 0.25, 0.75]);
    near(c.opacity_logits[at], (0.2_f32 / 0.8).ln());
    near(c.sh[at * c.sh_stride()][0], constant(1.0));
}

#[test]
fn plain_rows_hold_floats_and_harmonics_by_channel() {
    let mut body = floats(&[1.0, 2.0, 3.0, 0.5, 1.0, 2.0, 0.5, -0.5, 0.25, 0.75]);
    body.extend(COLOR);
    body.extend(floats(&ordered()));
    let c = parsed(&file(0, [1, 1], &[(0, 1), (4, 1), (40, 2)], &body)).expect("valid");
    assert_eq!((c.len(), c.sh_degree), (1, 2));
    check(&c, 0, [1.0, 2.0, 3.0]);
    // Red, green and blue of the first band lie 3 apart, those of the second 5.
    assert_eq!(c.sh[1], [0.0, 3.0, 6.0].map(|v| v / 16.0));
    assert_eq!(c.sh[3], [2.0, 5.0, 8.0].map(|v| v / 16.0));
    assert_eq!(c.sh[4], [9.0, 14.0, 19.0].map(|v| v / 16.0));
    assert_eq!(c.sh[8], [13.0, 18.0, 23.0].map(|v| v / 16.0));
}

/// Three rows in a full bucket of two and one that holds one, of blocks 4 wide.
fn bucketed(level: u16, degree: u32) -> Vec<u8> {
    let mut body = 1_u32.to_le_bytes().to_vec();
    body.extend(floats(&[10.0, 20.0, 30.0, -10.0, 0.0, 0.0]));
    for _ in 0..3 {
        // A quarter of the block right of the middle, in the middle, at its end.
        [32_767 + 16_384, 32_767, 65_534].into_iter().for_each(|v: u32| body.extend((v as u16).to_le_bytes()));
        body.extend(halves(&[0.5, 1.0, 2.0, 0.5, -0.5, 0.25, 0.75]));
        body.extend(COLOR);
        match (degree, level) {
            (0, _) => {}
            (_, 1) => body.extend(halves(&ordered()[..9])),
            _ => body.extend([0, 255, 128, 0, 255, 128, 0, 255, 128]),
        }
    }
    let section = [(0, 3), (4, 3), (8, 2), (12, 2), (16, 4.0_f32.to_bits()), (20, 12), (32, 1), (36, 1), (40, degree)];
    file(level, [1, 3], &section, &body)
}

#[test]
fn positions_count_from_the_centers_of_their_buckets() {
    for level in [1, 2] {
        for degree in [0, 1] {
            let c = parsed(&bucketed(level, degree)).expect("valid");
            assert_eq!((c.len(), u32::from(c.sh_degree)), (3, degree));
            check(&c, 1, [11.0, 20.0, 32.0]);
            check(&c, 2, [-9.0, 0.0, 2.0]);
        }
    }
    let c = parsed(&bucketed(1, 1)).expect("valid");
    assert_eq!(c.sh[1], [0.0, 3.0, 6.0].map(|v| v / 16.0));
    // Bytes span 1.5 on both sides of zero unless the header states a range.
    assert_eq!(parsed(&bucketed(2, 1)).expect("valid").sh[1..3], [[-1.5; 3], [1.5; 3]]);
    let mut other = bucketed(2, 1);
    other[36..40].copy_from_slice(&(-0.5_f32).to_le_bytes());
    assert_eq!(parsed(&other).expect("valid").sh[1], [-0.5; 3]);
}

#[test]
fn hostile_files_are_named() {
    let good = bucketed(1, 1);
    for n in [0, 1, 4095, 4096, 5119, 5120, 5123, good.len() - 1] {
        assert!(matches!(parsed(&good[..n]), Err(IoError::Truncated { .. })), "{n}");
    }
    let with = |at: usize, v: u32| {
        let mut bad = good.clone();
        bad[at..at + 4].copy_from_slice(&v.to_le_bytes());
        parsed(&bad).expect_err("changed").to_string()
    };
    for (at, v, told) in [
        (0, 1, "version"),
        (4, u32::MAX, "sections"),
        (4, 4, "ends early"),
        (20, 3, "level is 3"),
        (HEADER, 4, "Gaussians"),
        (HEADER + 4, u32::MAX, "ends early"),
        (HEADER + 8, 1, "buckets hold fewer"),
        (HEADER + 12, u32::MAX, "ends early"),
        (HEADER + 16, f32::NAN.to_bits(), "none of its 3 Gaussians is finite"),
        (HEADER + 20, 11, "bucket has 11"),
        (HEADER + 32, u32::MAX, "buckets"),
        (HEADER + 36, 2, "buckets"),
        (HEADER + 40, 3, "degree 3"),
        (HEADER, 0, "no section holds"),
    ] {
        assert!(with(at, v).contains(told), "{at} {v}: {}", with(at, v));
    }
    let (mut one, at) = (good.clone(), good.len() - 4 - 18 - 14);
    one[at..at + 2].copy_from_slice(&f16::NAN.to_le_bytes());
    let left = parsed(&one).expect("two are finite");
    assert!(left.len() == 2 && left.warnings.concat().contains("1 of 3 Gaussians"), "{:?}", left.warnings);
}
