//! Gaussians for the tests of formats, and the errors allowed after reading them back.

use rand::{RngExt, SeedableRng};

use super::quantized::unit;
use crate::math::Real;
use crate::math::sh::coefficients;
use crate::scene::GaussianCloud;

/// `n` Gaussians with values as trained ones have them.
pub(super) fn random(n: usize, sh_degree: u8) -> GaussianCloud {
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(11);
    let mut v = |scale: f32| rng.random_range(-scale..scale);
    let stride = coefficients(sh_degree);
    GaussianCloud {
        positions: (0..n).map(|_| [v(3.0), v(2.0), v(1.0)]).collect(),
        log_scales: (0..n).map(|_| [0; 3].map(|_| v(2.0) - 4.0)).collect(),
        quaternions: (0..n).map(|_| [0; 4].map(|_| v(1.0))).collect(),
        opacity_logits: (0..n).map(|_| v(4.0)).collect(),
        sh_degree,
        sh: (0..n * stride).map(|k| [0; 3].map(|_| if k % stride == 0 { v(1.5) } else { v(0.3) })).collect(),
        ..GaussianCloud::default()
    }
}

/// Asserts that every Gaussian of `a` equals that of `b` up to these errors: of position, log-scale, rotation (1 less
/// the cosine of half the angle), opacity and harmonics.
pub(super) fn assert_near(a: &GaussianCloud, b: &GaussianCloud, most: [f32; 5]) {
    assert_eq!((a.len(), a.sh_degree, a.render_mode), (b.len(), b.sh_degree, b.render_mode));
    let stride = a.sh_stride();
    let far = |x: &[f32], y: &[f32]| x.iter().zip(y).map(|(x, y)| (x - y).abs()).fold(0.0, f32::max);
    for i in 0..a.len() {
        let (p, q) = (unit(a.quaternions[i]), unit(b.quaternions[i]));
        let cos: f32 = p.iter().zip(q).map(|(p, q)| p * q).sum();
        let world = |c: &GaussianCloud| c.world_position(i);
        let errors = [
            (world(a) - world(b)).abs().max_element() as f32,
            far(&a.log_scales[i], &b.log_scales[i]),
            1.0 - cos.abs(),
            (a.opacity_logits[i].sigmoid() - b.opacity_logits[i].sigmoid()).abs(),
            far(a.sh[i * stride..][..stride].as_flattened(), b.sh[i * stride..][..stride].as_flattened()),
        ];
        assert!(errors.iter().zip(most).all(|(e, most)| *e <= most), "Gaussian {i}: {errors:?}, at most {most:?}");
    }
}

/// Returns `a` in the Morton order that the writers use.
pub(super) fn in_order(a: &GaussianCloud) -> GaussianCloud {
    a.select(&super::morton::order(a))
}
