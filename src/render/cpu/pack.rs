//! A frame's colors as bytes.

use crate::math::Real;
use crate::render::Frame;

impl<R: Real> Frame<R> {
    /// Interleaved 8-bit RGB, clamped and rounded.
    pub fn to_rgb8(&self) -> Vec<[u8; 3]> {
        let byte = |v: R| (v.f32().clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        let [r, g, b] = &self.color;
        r.iter().zip(g).zip(b).map(|((&r, &g), &b)| [byte(r), byte(g), byte(b)]).collect()
    }
}
