//! Color maps from a number between 0 and 1 to sRGB.

use strum::{IntoStaticStr, VariantArray};

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "lowercase")]
pub(crate) enum Colormap {
    /// Blue over green to red.
    #[default]
    Turbo,
    /// Dark violet to yellow, evenly brighter; safe for the color-blind.
    Viridis,
    Gray,
}

impl Colormap {
    pub(crate) fn text(self) -> &'static str {
        self.into()
    }

    /// The color of `t`, clamped to 0..1; NaN is black, so that holes stand out.
    pub(crate) fn color(self, t: f32) -> [u8; 3] {
        match self {
            _ if t.is_nan() => [0; 3],
            Self::Turbo => turbo(t),
            Self::Viridis => viridis(t),
            Self::Gray => [(t.clamp(0.0, 1.0) * 255.0 + 0.5) as u8; 3],
        }
    }
}

/// One channel of a polynomial fit, coefficients by rising power.
fn channel<const N: usize>(k: [f32; N], t: f32) -> u8 {
    let v = k.iter().rev().fold(0.0, |sum, c| sum * t + c);
    (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// The viridis map (van der Walt and Smith, 2015) by a sixth-degree polynomial fit.
fn viridis(t: f32) -> [u8; 3] {
    const RED: [f32; 7] = [0.277_727_3, 0.105_093_04, -0.330_861_8, -4.634_230_6, 6.228_27, 4.776_385, -5.435_456];
    const GREEN: [f32; 7] =
        [0.005_407_345, 1.404_613_5, 0.214_847_56, -5.799_101, 14.179_934, -13.745_145, 4.645_852_6];
    const BLUE: [f32; 7] = [0.334_099_8, 1.384_590_1, 0.095_095_16, -19.332_441, 56.690_55, -65.353_03, 26.312_435];
    let t = t.clamp(0.0, 1.0);
    [channel(RED, t), channel(GREEN, t), channel(BLUE, t)]
}

/// The turbo map (Mikhailov, 2019) by its fifth-degree polynomial fit. `t` is clamped to 0..1; NaN
/// is black, so that holes stand out.
fn turbo(t: f32) -> [u8; 3] {
    const RED: [f32; 6] = [0.135_721_38, 4.615_392_6, -42.660_324, 132.131_09, -152.942_4, 59.286_38];
    const GREEN: [f32; 6] = [0.091_402_61, 2.194_188_4, 4.842_966_7, -14.185_033, 4.277_298_6, 2.829_566];
    const BLUE: [f32; 6] = [0.106_673_3, 12.641_946, -60.582_05, 110.362_77, -89.903_11, 27.348_25];
    if t.is_nan() {
        return [0; 3];
    }
    let t = t.clamp(0.0, 1.0);
    [RED, GREEN, BLUE].map(|k| channel(k, t))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outside_values_are_clamped_and_holes_are_black() {
        assert_eq!(turbo(-1.0), turbo(0.0));
        assert_eq!(turbo(f32::INFINITY), turbo(1.0));
        assert_eq!(turbo(f32::NAN), [0; 3]);
    }

    #[test]
    fn viridis_and_gray_get_evenly_brighter() {
        for map in [Colormap::Viridis, Colormap::Gray] {
            let brightness = |t: f32| {
                let [r, g, b] = map.color(t).map(f32::from);
                0.21 * r + 0.72 * g + 0.07 * b
            };
            let steps: Vec<f32> = (0..=20).map(|i| brightness(i as f32 / 20.0)).collect();
            assert!(steps.windows(2).all(|w| w[1] > w[0]), "{map:?} {steps:?}");
        }
        // The published ends of viridis: 440154 and fde725.
        let near = |a: [u8; 3], b: [u8; 3]| a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 8);
        assert!(near(Colormap::Viridis.color(0.0), [0x44, 0x01, 0x54]), "{:?}", Colormap::Viridis.color(0.0));
        assert!(near(Colormap::Viridis.color(1.0), [0xfd, 0xe7, 0x25]), "{:?}", Colormap::Viridis.color(1.0));
        assert_eq!(Colormap::Viridis.color(f32::NAN), [0; 3]);
    }

    #[test]
    fn ends_and_middle_are_those_of_the_fits() {
        assert_eq!(Colormap::VARIANTS.iter().map(|m| m.text()).collect::<Vec<_>>(), ["turbo", "viridis", "gray"]);
        // The polynomials by hand: their first coefficients at 0, their sums at 1, both within a rounding.
        for (map, t, expected) in [
            (Colormap::Turbo, 0.0, [35, 23, 27]),
            (Colormap::Turbo, 0.4, [78, 249, 131]),
            (Colormap::Turbo, 1.0, [144, 13, 0]),
            (Colormap::Viridis, 0.0, [71, 1, 85]),
            (Colormap::Viridis, 0.4, [40, 120, 142]),
            (Colormap::Viridis, 1.0, [252, 231, 33]),
            (Colormap::Gray, 0.0, [0; 3]),
            (Colormap::Gray, 0.4, [102; 3]),
            (Colormap::Gray, 1.0, [255; 3]),
            (Colormap::Gray, 0.25, [64; 3]),
        ] {
            let found = map.color(t);
            assert!(found.iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= 1), "{map:?} {t}: {found:?}");
        }
    }
}
