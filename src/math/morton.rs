//! The Z-order curve: three coordinates as one number in which neighbors are near one another.

/// Bits of a coordinate.
pub(crate) const BITS: u32 = 21;

/// The bits of the coordinates in turns, x lowest. Higher bits than [`BITS`] are lost.
pub(crate) fn interleave([x, y, z]: [u64; 3]) -> u64 {
    spread(x) | spread(y) << 1 | spread(z) << 2
}

/// The low 21 bits, two zeros between each.
fn spread(v: u64) -> u64 {
    let mut v = v & 0x1f_ffff;
    for (shift, mask) in [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        v = (v | v << shift) & mask;
    }
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_take_turns() {
        assert_eq!((interleave([0b111, 0, 0]), interleave([0, 0b10, 1])), (0b1_001_001, 0b10_100));
        assert_eq!(interleave([0x1f_ffff; 3]), (1 << 63) - 1);
        assert_eq!(interleave([1 << 21, 0, 0]), 0, "beyond the last bit");
    }
}
