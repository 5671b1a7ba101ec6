//! Colors of a frame as bytes.

use crate::math::Real;

/// Interleaved 8-bit RGB of planes of red, green and blue, clamped and rounded.
pub(crate) fn rgb8<R: Real>([r, g, b]: &[Vec<R>; 3]) -> Vec<[u8; 3]> {
    let byte = |v: R| (v.f32().clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    r.iter().zip(g).zip(b).map(|((&r, &g), &b)| [byte(r), byte(g), byte(b)]).collect()
}
