//! OKLab, a perceptual color space. Shade scales lightness and chroma alike: hue and saturation of a thing stay.

use crate::math::srgb::linear;

/// Color in OKLab; all numbers are finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct OkColor {
    /// 0 is black, 1 is white.
    pub(super) lightness: f64,
    /// From green to red.
    pub(super) a: f64,
    /// From blue to yellow.
    pub(super) b: f64,
    /// Distance from gray.
    pub(super) chroma: f64,
    /// Chroma by lightness, which is the same in light and shade.
    pub(super) saturation: f64,
    /// Degrees, 0..360: red is 29, yellow 110, green 142, blue 264.
    pub(super) hue: f64,
}

impl OkColor {
    /// Converts sRGB; channels are clamped to 0..1, and what is no number counts as 0.
    pub(super) fn of(srgb: [f64; 3]) -> Self {
        let bounded = |c: f64| if c.is_nan() { 0.0 } else { c.clamp(0.0, 1.0) };
        let [r, g, b] = srgb.map(|c| f64::from(linear(bounded(c) as f32)));
        let l = (0.412_221_470_8 * r + 0.536_332_536_3 * g + 0.051_445_992_9 * b).cbrt();
        let m = (0.211_903_498_2 * r + 0.680_699_545_1 * g + 0.107_396_956_6 * b).cbrt();
        let s = (0.088_302_461_9 * r + 0.281_718_837_6 * g + 0.629_978_700_5 * b).cbrt();
        let lightness = 0.210_454_255_3 * l + 0.793_617_785 * m - 0.004_072_046_8 * s;
        let a = 1.977_998_495_1 * l - 2.428_592_205 * m + 0.450_593_709_9 * s;
        let b = 0.025_904_037_1 * l + 0.782_771_766_2 * m - 0.808_675_766 * s;
        let chroma = a.hypot(b);
        let (saturation, hue) = (chroma / lightness.max(0.05), b.atan2(a).to_degrees().rem_euclid(360.0));
        Self { lightness, a, b, chroma, saturation, hue }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_colors_have_known_places() {
        // Values of the definition's author, rounded.
        for (srgb, lightness, chroma, hue) in [
            ([1.0, 0.0, 0.0], 0.628, 0.258, 29.2),
            ([0.0, 1.0, 0.0], 0.866, 0.295, 142.5),
            ([0.0, 0.0, 1.0], 0.452, 0.313, 264.1),
            ([1.0, 1.0, 0.0], 0.968, 0.211, 109.8),
        ] {
            let color = OkColor::of(srgb);
            assert!((color.lightness - lightness).abs() < 1e-3 && (color.chroma - chroma).abs() < 1e-3, "{color:?}");
            assert!((color.hue - hue).abs() < 0.1, "{}", color.hue);
        }
        let (white, black) = (OkColor::of([1.0; 3]), OkColor::of([0.0; 3]));
        assert!((white.lightness - 1.0).abs() < 1e-6 && white.chroma < 1e-6);
        assert_eq!((black.lightness, black.chroma, black.saturation), (0.0, 0.0, 0.0));
    }

    #[test]
    fn shade_changes_neither_hue_nor_saturation() {
        let lit =
            |light: f32| OkColor::of([0.6, 0.05, 0.08].map(|c| f64::from(crate::math::srgb::encode(c * light).0)));
        let (bright, dim) = (lit(1.0), lit(0.1));
        assert!((bright.hue - dim.hue).abs() < 0.1 && (bright.saturation - dim.saturation).abs() < 1e-3);
        assert!(bright.lightness > 2.0 * dim.lightness, "the control");
    }

    #[test]
    fn any_input_has_finite_numbers() {
        for wild in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -3.0, 7.0] {
            let color = OkColor::of([wild, 0.5, wild]);
            let all = [color.lightness, color.chroma, color.saturation, color.hue];
            assert!(all.iter().all(|v| v.is_finite()), "{wild}: {all:?}");
        }
    }
}
