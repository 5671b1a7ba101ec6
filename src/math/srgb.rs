//! The sRGB transfer function.

/// Linear light of an sRGB value in 0..1.
pub(crate) fn linear(srgb: f32) -> f32 {
    if srgb <= 0.040_45 { srgb / 12.92 } else { ((srgb + 0.055) / 1.055).powf(2.4) }
}

/// sRGB byte of linear light; clamps.
pub(crate) fn byte(linear: f32) -> u8 {
    (encode(linear.clamp(0.0, 1.0)).0 * 255.0 + 0.5) as u8
}

/// The bytes of a color written in six hexadecimal digits.
pub(crate) fn from_hex(digits: &str) -> Option<[u8; 3]> {
    let value = u32::from_str_radix(digits, 16).ok().filter(|_| digits.len() == 6 && !digits.starts_with('+'))?;
    Some([16, 8, 0].map(|shift| (value >> shift & 0xff) as u8))
}

/// sRGB value of linear light, and its slope there.
pub fn encode(linear: f32) -> (f32, f32) {
    if linear <= 0.003_130_8 {
        (12.92 * linear, 12.92)
    } else {
        (1.055 * linear.powf(1.0 / 2.4) - 0.055, 1.055 / 2.4 * linear.powf(1.0 / 2.4 - 1.0))
    }
}

/// Scales a color in linear light by `gain`, a factor per channel.
pub(crate) fn brighter(rgb: [f32; 3], gain: [f32; 3]) -> [f32; 3] {
    let one = |c: usize| {
        if gain[c] == 1.0 { rgb[c] } else { encode(linear(rgb[c].max(0.0)) * gain[c]).0.min(1.0) }
    };
    [0, 1, 2].map(one)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_survive_the_way_to_light_and_back() {
        for v in 0..=255_u8 {
            assert_eq!(byte(linear(f32::from(v) / 255.0)), v);
        }
        assert_eq!((byte(-1.0), byte(2.0), byte(f32::NAN)), (0, 255, 0));
    }

    #[test]
    fn slopes_are_those_of_the_curve() {
        for x in [0.001_f32, 0.01, 0.2, 0.9] {
            let (step, slope) = (1e-3 * x, encode(x).1);
            let difference = (encode(x + step).0 - encode(x - step).0) / (2.0 * step);
            assert!((slope - difference).abs() < 2e-3 * slope, "{x}: {slope} {difference}");
        }
    }

    #[test]
    fn the_curve_is_the_standards() {
        // IEC 61966-2-1: linear below, 2.4th power above; 0.5 is 0.214 041 14 in light.
        for (srgb, light) in
            [(0.0, 0.0), (0.02, 0.02 / 12.92), (0.040_45, 0.003_130_805), (0.5, 0.214_041_14), (1.0, 1.0)]
        {
            assert!((linear(srgb) - light).abs() < 1e-6, "{srgb}: {}", linear(srgb));
            assert!((encode(light).0 - srgb).abs() < 1e-5, "{light}: {}", encode(light).0);
        }
        assert_eq!([0.0, 0.001, 0.2, 0.7, 1.0].map(byte), [0, 3, 124, 218, 255]);
        assert!((encode(0.001).1 - 12.92).abs() < 1e-6);
    }
}
