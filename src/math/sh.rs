//! Real spherical harmonics up to degree 3, in the order and sign of the 3DGS `.ply` files.

use glam::{DMat3, DVec3};

use super::Real;
use super::number::Number;

/// Number of coefficients per channel of degree `degree`: `(degree + 1)²`.
pub const fn coefficients(degree: u8) -> usize {
    let d = degree as usize + 1;
    d * d
}

/// The constant harmonic; `color = 0.5 + SH_C0 * dc`.
pub(crate) const SH_C0: f64 = 0.282_094_791_773_878_14;
const C1: f64 = 0.488_602_511_902_919_9;
const C2: [f64; 5] = [
    1.092_548_430_592_079_2,
    -1.092_548_430_592_079_2,
    0.315_391_565_252_520_05,
    -1.092_548_430_592_079_2,
    0.546_274_215_296_039_6,
];
const C3: [f64; 7] = [
    -0.590_043_589_926_643_5,
    2.890_611_442_640_554,
    -0.457_045_799_464_465_8,
    0.373_176_332_590_115_4,
    -0.457_045_799_464_465_8,
    1.445_305_721_320_277,
    -0.590_043_589_926_643_5,
];

/// The basis at unit direction `[x, y, z]`; entries past `coefficients(degree)` are zero.
#[inline(always)]
pub fn basis<N: Number>(degree: u8, [x, y, z]: [N; 3]) -> [N; 16] {
    let k = |c: f64| x.like(N::Of::of(c));
    let mut b = [k(0.0); 16];
    b[0] = k(SH_C0);
    if degree == 0 {
        return b;
    }
    b[1] = -k(C1) * y;
    b[2] = k(C1) * z;
    b[3] = -k(C1) * x;
    if degree == 1 {
        return b;
    }
    let (xx, yy, zz, xy, yz, xz) = (x * x, y * y, z * z, x * y, y * z, x * z);
    b[4] = k(C2[0]) * xy;
    b[5] = k(C2[1]) * yz;
    b[6] = k(C2[2]) * (k(2.0) * zz - xx - yy);
    b[7] = k(C2[3]) * xz;
    b[8] = k(C2[4]) * (xx - yy);
    if degree == 2 {
        return b;
    }
    b[9] = k(C3[0]) * y * (k(3.0) * xx - yy);
    b[10] = k(C3[1]) * xy * z;
    b[11] = k(C3[2]) * y * (k(4.0) * zz - xx - yy);
    b[12] = k(C3[3]) * z * (k(2.0) * zz - k(3.0) * xx - k(3.0) * yy);
    b[13] = k(C3[4]) * x * (k(4.0) * zz - xx - yy);
    b[14] = k(C3[5]) * z * (xx - yy);
    b[15] = k(C3[6]) * x * (xx - k(3.0) * yy);
    b
}

/// Derivative of [`basis`] with respect to `x`, `y` and `z`, treating them as independent.
#[inline(always)]
pub(crate) fn basis_gradient<R: Real>(degree: u8, [x, y, z]: [R; 3]) -> [[R; 3]; 16] {
    let k = R::of;
    let o = R::ZERO;
    let mut g = [[o; 3]; 16];
    if degree == 0 {
        return g;
    }
    g[1] = [o, -k(C1), o];
    g[2] = [o, o, k(C1)];
    g[3] = [-k(C1), o, o];
    if degree == 1 {
        return g;
    }
    let two = k(2.0);
    g[4] = [k(C2[0]) * y, k(C2[0]) * x, o];
    g[5] = [o, k(C2[1]) * z, k(C2[1]) * y];
    g[6] = [-k(C2[2]) * two * x, -k(C2[2]) * two * y, k(C2[2]) * k(4.0) * z];
    g[7] = [k(C2[3]) * z, o, k(C2[3]) * x];
    g[8] = [k(C2[4]) * two * x, -k(C2[4]) * two * y, o];
    if degree == 2 {
        return g;
    }
    let (xx, yy, zz, xy, yz, xz) = (x * x, y * y, z * z, x * y, y * z, x * z);
    let (three, six, eight) = (k(3.0), k(6.0), k(8.0));
    g[9] = [k(C3[0]) * six * xy, k(C3[0]) * three * (xx - yy), o];
    g[10] = [k(C3[1]) * yz, k(C3[1]) * xz, k(C3[1]) * xy];
    g[11] = [-k(C3[2]) * two * xy, k(C3[2]) * (k(4.0) * zz - xx - three * yy), k(C3[2]) * eight * yz];
    g[12] = [-k(C3[3]) * six * xz, -k(C3[3]) * six * yz, k(C3[3]) * (six * zz - three * xx - three * yy)];
    g[13] = [k(C3[4]) * (k(4.0) * zz - three * xx - yy), -k(C3[4]) * two * xy, k(C3[4]) * eight * xz];
    g[14] = [k(C3[5]) * two * xz, -k(C3[5]) * two * yz, k(C3[5]) * (xx - yy)];
    g[15] = [k(C3[6]) * three * (xx - yy), -k(C3[6]) * six * xy, o];
    g
}

/// Rotation of the coefficients: `c'[m] = sum_n matrix[m][n] c[n]` is the same function after its directions were
/// rotated by `turn` (world_from_before). Bands do not mix.
pub(crate) fn rotation(turn: &DMat3) -> [[f64; 16]; 16] {
    // Gauss-Legendre along z and equal steps around it: exact for products of two harmonics up to degree 3.
    const NODES: [(f64, f64); 4] = [
        (-0.861_136_311_594_052_6, 0.347_854_845_137_453_8),
        (-0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
        (0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
        (0.861_136_311_594_052_6, 0.347_854_845_137_453_8),
    ];
    const AROUND: usize = 7;
    let before_from_world = turn.transpose();
    let mut matrix = [[0.0; 16]; 16];
    for ((z, weight), k) in NODES.into_iter().flat_map(|node| (0..AROUND).map(move |k| (node, k))) {
        let step = std::f64::consts::TAU / AROUND as f64;
        let (sin, cos) = (k as f64 * step).sin_cos();
        let direction = DVec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
        let (now, before) = (basis(3, direction.to_array()), basis(3, (before_from_world * direction).to_array()));
        for (row, now) in matrix.iter_mut().zip(now) {
            row.iter_mut().zip(before).for_each(|(entry, before)| *entry += weight * step * now * before);
        }
    }
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradient_matches_central_differences() {
        let d = [0.36_f64, -0.48, 0.8];
        let g = basis_gradient(3, d);
        for axis in 0..3 {
            let h = 1e-6;
            let (mut a, mut b) = (d, d);
            a[axis] += h;
            b[axis] -= h;
            let (pa, pb) = (basis(3, a), basis(3, b));
            for i in 0..16 {
                let numeric = (pa[i] - pb[i]) / (2.0 * h);
                assert!((numeric - g[i][axis]).abs() < 1e-8, "coefficient {i} axis {axis}");
            }
        }
    }

    #[test]
    fn harmonics_are_orthonormal_on_the_sphere() {
        // A Fibonacci sphere integrates products of degree <= 6 closely.
        let n = 20_000;
        let mut gram = [[0.0_f64; 16]; 16];
        for i in 0..n {
            let z = 1.0 - (2.0 * i as f64 + 1.0) / n as f64;
            let phi = i as f64 * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
            let r = (1.0 - z * z).sqrt();
            let b = basis(3, [r * phi.cos(), r * phi.sin(), z]);
            for (j, row) in gram.iter_mut().enumerate() {
                for (k, e) in row.iter_mut().enumerate() {
                    *e += b[j] * b[k] * 4.0 * std::f64::consts::PI / n as f64;
                }
            }
        }
        for (j, row) in gram.iter().enumerate() {
            for (k, e) in row.iter().enumerate() {
                let want = f64::from(u8::from(j == k));
                assert!((e - want).abs() < 1e-3, "{j} {k} {e}");
            }
        }
    }

    #[test]
    fn turned_coefficients_are_those_of_the_turned_function() {
        let turn = DMat3::from_quat(glam::DQuat::from_scaled_axis(DVec3::new(0.7, -1.1, 2.0)));
        let matrix = rotation(&turn);
        let c: Vec<f64> = (0..16).map(|k| ((k * k + 3) as f64).sin()).collect();
        let turned: Vec<f64> = matrix.iter().map(|row| row.iter().zip(&c).map(|(m, c)| m * c).sum()).collect();
        let value = |c: &[f64], d: DVec3| basis(3, d.to_array()).iter().zip(c).map(|(b, c)| b * c).sum::<f64>();
        for before in [DVec3::X, DVec3::new(0.36, -0.48, 0.8), DVec3::new(-0.6, 0.0, -0.8)] {
            assert!((value(&turned, turn * before) - value(&c, before)).abs() < 1e-12);
        }
        assert!((value(&c, turn * DVec3::X) - value(&c, DVec3::X)).abs() > 0.1, "it matters");
        let mixes = |m: usize, n: usize| (m as f64).sqrt() as usize != (n as f64).sqrt() as usize;
        let mixed = (0..16).flat_map(|m| (0..16).map(move |n| (m, n))).filter(|(m, n)| mixes(*m, *n));
        assert!(mixed.into_iter().all(|(m, n)| matrix[m][n].abs() < 1e-12));
    }
}
