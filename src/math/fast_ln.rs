//! Constants of the fast `f32` logarithm: `ln(x) = ln(m) + n ln(2)` with `x = m 2^n` and `m` around 1, and a polynomial
//! for `(ln(1 + f) - f + f² / 2) / f³`, `f = m - 1` (Cephes' `logf`).

/// The bits of the smallest `m`, the root of one half.
pub(crate) const LEAST: u32 = 0x3f35_04f3;
/// Coefficients from the highest power down.
pub(crate) const POLYNOMIAL: [f32; 9] = [
    7.037_683_6e-2,
    -1.151_461e-1,
    1.167_699_87e-1,
    -1.242_014_1e-1,
    1.424_932_3e-1,
    -1.666_805_8e-1,
    2.000_071_5e-1,
    -2.499_999_4e-1,
    3.333_333e-1,
];
