//! Mip-Splatting's 3-D filter, a property `filter_3D` of its `.ply`: no Gaussian is smaller than what the cameras
//! resolve. It is built into scales and opacities here, as Mip-Splatting itself does to draw them.

use rayon::prelude::*;

use crate::scene::{GaussianCloud, SplatRenderMode};

const NAME: &str = "filter_3D";

/// Returns the cloud with the filter in its Gaussians, if it has one.
pub(super) fn applied(mut cloud: GaussianCloud) -> GaussianCloud {
    let Some(at) = cloud.extras.iter().position(|e| e.name == NAME) else { return cloud };
    let filter = cloud.extras.remove(at).values;
    if cloud.render_mode == SplatRenderMode::Plain {
        cloud.render_mode = SplatRenderMode::Mip;
    }
    let gaussians = cloud.log_scales.par_iter_mut().zip(&mut cloud.opacity_logits).zip(&filter);
    gaussians.filter(|(_, filter)| filter.is_finite()).for_each(|((scales, logit), filter)| {
        let least = f64::from(*filter).powi(2);
        let mut share = 1.0;
        for scale in scales {
            let own = (2.0 * f64::from(*scale)).exp();
            let wider = own + least;
            share *= (own / wider).sqrt();
            *scale = (0.5 * wider.ln()) as f32;
        }
        let opacity = share / (1.0 + (-f64::from(*logit)).exp());
        // As far from 0 as single precision can tell.
        *logit = (opacity / (1.0 - opacity)).max(f64::from(f32::MIN_POSITIVE)).ln() as f32;
    });
    cloud
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::ExtraProperty;

    #[test]
    fn a_filter_widens_gaussians_and_keeps_what_they_cover() {
        let mut cloud = GaussianCloud::isotropic(vec![[0.0; 3]; 3], -2.0, 1.0);
        cloud.log_scales[1] = [-1.0, -2.0, -30.0];
        let plain = cloud.clone();
        assert_eq!(applied(cloud.clone()), plain, "without a filter");
        let of = |name: &str, values: &[f32]| ExtraProperty { name: name.into(), values: values.to_vec() };
        cloud.extras = vec![of("other", &[7.0; 3]), of(NAME, &[0.1, 0.2, f32::NAN])];
        let all = applied(cloud);
        assert_eq!((all.extras.len(), all.render_mode), (1, SplatRenderMode::Mip));
        for i in 0..2 {
            let filter: f64 = [0.1, 0.2][i];
            let own = plain.log_scales[i].map(|s| f64::from(s).exp());
            let wider = own.map(|s| (s * s + filter * filter).sqrt());
            let opacity = own.iter().product::<f64>() / wider.iter().product::<f64>() / (1.0 + (-1.0_f64).exp());
            for (got, expected) in all.log_scales[i].iter().zip(wider) {
                assert!((f64::from(*got) - expected.ln()).abs() < 1e-6, "{i}");
            }
            let got = 1.0 / (1.0 + (-f64::from(all.opacity_logits[i])).exp());
            assert!((got / opacity - 1.0).abs() < 1e-5, "{i}: {got} {opacity}");
        }
        assert_eq!((all.log_scales[2], all.opacity_logits[2]), (plain.log_scales[2], 1.0), "not a number");
        assert_eq!(all.validate(), Ok(()));
    }
}
