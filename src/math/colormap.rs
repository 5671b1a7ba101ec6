//! Colour maps from a number between 0 and 1 to sRGB.

/// The turbo map (Mikhailov, 2019) by its fifth-degree polynomial fit. `t` is clamped to 0..1; NaN
/// is black, so that holes stand out.
pub fn turbo(t: f32) -> [u8; 3] {
    const RED: [f32; 6] = [0.135_721_38, 4.615_392_6, -42.660_324, 132.131_09, -152.942_4, 59.286_38];
    const GREEN: [f32; 6] = [0.091_402_61, 2.194_188_4, 4.842_966_7, -14.185_033, 4.277_298_6, 2.829_566];
    const BLUE: [f32; 6] = [0.106_673_3, 12.641_946, -60.582_05, 110.362_77, -89.903_11, 27.348_25];
    if t.is_nan() {
        return [0; 3];
    }
    let t = t.clamp(0.0, 1.0);
    [RED, GREEN, BLUE].map(|k| {
        let v = k.iter().rev().fold(0.0, |sum, c| sum * t + c);
        (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turbo_runs_from_blue_over_green_to_red() {
        let [low, middle, high] = [0.1, 0.5, 0.9].map(turbo);
        assert!(low[2] > low[0] && low[2] > low[1], "{low:?}");
        assert!(middle[1] > middle[0] && middle[1] > middle[2], "{middle:?}");
        assert!(high[0] > high[1] && high[0] > high[2], "{high:?}");
    }

    #[test]
    fn outside_values_are_clamped_and_holes_are_black() {
        assert_eq!(turbo(-1.0), turbo(0.0));
        assert_eq!(turbo(f32::INFINITY), turbo(1.0));
        assert_eq!(turbo(f32::NAN), [0; 3]);
    }
}
