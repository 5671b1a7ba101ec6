//! Constants of the fast `f32` exponential: `exp(x) = 2^n exp(r)` with `n = round(x / ln 2)`,
//! `|r| <= ln(2) / 2`, a minimax polynomial for `exp(r)`, and `n` added to the exponent field.

/// Smaller arguments give the result of this one.
pub(crate) const SMALLEST: f32 = -87.0;
/// Adding 1.5 * 2^23 rounds to the nearest integer and leaves it in the low mantissa bits.
pub(crate) const ROUND: f32 = 12_582_912.0;
/// Upper part of ln 2, short enough for exact products with n.
pub(crate) const LN2_HI: f32 = 0.693_359_4;
/// Lower part of ln 2.
pub(crate) const LN2_LO: f32 = -2.121_944_4e-4;
/// Coefficients from the highest power down.
pub(crate) const POLYNOMIAL: [f32; 8] =
    [1.987_569_1e-4, 1.398_199_9e-3, 8.333_452e-3, 4.166_579_6e-2, 1.666_666_5e-1, 5.000_000_3e-1, 1.0, 1.0];
