//! Color grading: brightness, saturation and tint of what photos have shown.

use glam::{DMat3, DVec3};

use super::BRIGHTNESS;
use crate::math::sh::SH_C0;
use crate::scene::GaussianCloud;

/// Change of colors, the same for all Gaussians of a thing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grade {
    /// Factor of all colors.
    pub(crate) brightness: f64,
    /// Factor of the distance from gray; 0 is gray.
    pub(crate) saturation: f64,
    /// Color (red, green, blue, 0 to 1, as displayed) that white takes on, at its brightness.
    pub(crate) tint: [f32; 3],
}

impl Default for Grade {
    fn default() -> Self {
        Self { brightness: 1.0, saturation: 1.0, tint: [1.0; 3] }
    }
}

impl Grade {
    /// The change as a matrix of displayed colors; `None` if a number is negative or not finite, or the tint is black.
    ///
    /// A matrix applies to the coefficients of all bands alike, so a color that changes with the direction is graded in
    /// every direction.
    pub(super) fn matrix(&self) -> Option<DMat3> {
        let weights = DVec3::from(BRIGHTNESS);
        let tint = DVec3::from(self.tint.map(f64::from));
        let numbers = [self.brightness, self.saturation, tint.x, tint.y, tint.z];
        let light = tint.dot(weights);
        if !numbers.iter().all(|v| v.is_finite() && *v >= 0.0) || light <= 0.0 {
            return None;
        }
        let gray = DMat3::from_cols(DVec3::splat(weights.x), DVec3::splat(weights.y), DVec3::splat(weights.z));
        let saturated = DMat3::IDENTITY * self.saturation + gray * (1.0 - self.saturation);
        Some(DMat3::from_diagonal(tint * (self.brightness / light)) * saturated)
    }
}

/// Applies a matrix of displayed colors to these Gaussians.
pub(super) fn apply(cloud: &mut GaussianCloud, thing: &[usize], matrix: &DMat3) {
    let stride = cloud.sh_stride();
    // Displayed colors are half of white plus what the bands add.
    let shift = (*matrix * DVec3::splat(0.5) - 0.5) / SH_C0;
    for &i in thing {
        let own = &mut cloud.sh[i * stride..(i + 1) * stride];
        for (k, c) in own.iter_mut().enumerate() {
            let graded = *matrix * DVec3::from(c.map(f64::from)) + if k == 0 { shift } else { DVec3::ZERO };
            *c = graded.as_vec3().to_array();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn graded(color: [f64; 3], grade: Grade) -> [f64; 3] {
        let mut cloud = GaussianCloud::isotropic(vec![[0.0; 3]; 2], -3.0, 2.0);
        let own = color.map(|v| ((v - 0.5) / SH_C0) as f32);
        cloud.sh = vec![own; 2];
        apply(&mut cloud, &[1], &grade.matrix().expect("valid"));
        assert_eq!(cloud.sh[0], own, "another Gaussian stays");
        cloud.sh[1].map(|c| 0.5 + SH_C0 * f64::from(c))
    }

    fn is_near(a: [f64; 3], b: [f64; 3]) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5)
    }

    #[test]
    fn brightness_saturation_and_tint_do_what_they_say() {
        let color = [0.8, 0.4, 0.2];
        let light = |c: [f64; 3]| BRIGHTNESS.iter().zip(c).map(|(w, v)| w * v).sum::<f64>();
        let none = Grade::default();
        assert!(is_near(graded(color, none), color), "nothing");
        assert!(is_near(graded(color, Grade { brightness: 0.5, ..none }), [0.4, 0.2, 0.1]));
        assert!(is_near(graded(color, Grade { saturation: 0.0, ..none }), [light(color); 3]), "gray");
        let vivid = graded(color, Grade { saturation: 2.0, ..none });
        assert!((light(vivid) - light(color)).abs() < 1e-5 && vivid[0] > 0.8 && vivid[2] < 0.2, "{vivid:?}");
        let warm = graded([0.5; 3], Grade { tint: [1.0, 0.8, 0.6], ..none });
        assert!((light(warm) - 0.5).abs() < 1e-5 && warm[0] > warm[1] && warm[1] > warm[2], "{warm:?}");
        let gray_tint = graded(color, Grade { tint: [0.3; 3], ..none });
        assert!(is_near(gray_tint, color), "a gray tint changes nothing");
    }

    #[test]
    fn extreme_grades_are_refused_by_name() {
        let none = Grade::default();
        for (name, bad) in [
            ("negative brightness", Grade { brightness: -0.1, ..none }),
            ("infinite brightness", Grade { brightness: f64::INFINITY, ..none }),
            ("no number", Grade { saturation: f64::NAN, ..none }),
            ("black tint", Grade { tint: [0.0; 3], ..none }),
        ] {
            assert!(bad.matrix().is_none(), "{name}");
        }
        assert!(Grade { brightness: 0.0, ..none }.matrix().is_some(), "black is a color");
    }
}
