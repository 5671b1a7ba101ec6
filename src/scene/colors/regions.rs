//! Regions of the color space that people call by each basic term. Neighbors overlap: one's red is another's brown.
//!
//! Fitted to the 949 names of the xkcd color survey and to 267 pieces of five synthetic scenes, and widened where a
//! color had no name. Of the survey's colors that are named by one term, 95 % have it here, and 0.15 other terms on
//! average. Gray and white overlap: shaded white is gray.

use super::oklab::OkColor;
use super::terms::COLORS;

/// Box of colors, each limit included.
struct ColorRegion {
    /// Degrees; from the first to the second, past 360 if it is smaller.
    hue: [f64; 2],
    chroma: [f64; 2],
    saturation: [f64; 2],
    lightness: [f64; 2],
}

const fn of(hue: [f64; 2], chroma: [f64; 2], saturation: [f64; 2], lightness: [f64; 2]) -> ColorRegion {
    ColorRegion { hue, chroma, saturation, lightness }
}

const fn over(least: f64) -> [f64; 2] {
    [least, f64::INFINITY]
}

const fn under(most: f64) -> [f64; 2] {
    [0.0, most]
}

const ANY: [f64; 2] = over(0.0);
const ALL: [f64; 2] = [0.0, 360.0];

/// Regions of each row.
const REGIONS: [&[ColorRegion]; COLORS.len()] = [
    // Black.
    &[of(ALL, under(0.03), ANY, under(0.32))],
    // Blue, and ice.
    &[of([204.0, 285.0], over(0.03), over(0.05), ANY), of([185.0, 204.0], over(0.035), [0.04, 0.08], over(0.85))],
    // Brown, rust, dim olive, and dim purple.
    &[
        of([30.0, 84.0], under(0.1), over(0.08), under(0.8)),
        of([38.0, 45.0], under(0.15), over(0.28), under(0.47)),
        of([84.0, 108.0], under(0.1), over(0.12), under(0.48)),
        of([0.0, 30.0], [0.03, 0.08], [0.1, 0.24], under(0.5)),
    ],
    // Gray, and slate.
    &[of(ALL, under(0.045), under(0.08), [0.32, 0.84]), of(ALL, under(0.045), [0.08, 0.11], [0.32, 0.45])],
    // Green.
    &[of([108.0, 168.0], over(0.05), over(0.05), ANY)],
    // Orange.
    &[of([36.0, 72.0], ANY, over(0.17), over(0.48))],
    // Pink, salmon, and magenta.
    &[
        of([335.0, 18.0], over(0.05), ANY, over(0.45)),
        of([18.0, 38.0], over(0.05), [0.04, 0.26], over(0.62)),
        of([325.0, 335.0], over(0.2), ANY, over(0.5)),
    ],
    // Purple, and plum.
    &[of([285.0, 345.0], over(0.03), over(0.07), over(0.15)), of([345.0, 360.0], over(0.06), over(0.14), [0.15, 0.45])],
    // Red, and wine.
    &[of([5.0, 38.0], over(0.08), over(0.26), under(0.7)), of([350.0, 5.0], over(0.08), over(0.34), under(0.5))],
    // Turquoise.
    &[of([162.0, 210.0], over(0.045), [0.06, 0.22], ANY)],
    // White; a bluish one only if it is bright.
    &[of(ALL, ANY, under(0.04), over(0.68)), of([180.0, 270.0], ANY, under(0.05), over(0.9))],
    // Yellow.
    &[of([72.0, 111.0], ANY, over(0.14), over(0.52))],
    // Beige, and ivory.
    &[of([52.0, 120.0], ANY, [0.04, 0.14], over(0.58)), of([75.0, 120.0], over(0.025), under(0.04), over(0.88))],
];

/// Colors that are brown, or orange and yellow in the shade.
const DIM: ColorRegion = of([36.0, 95.0], [0.1, 0.125], ANY, under(0.55));

/// Lightness of a surface of each row that is neither dark nor light: between the median of the survey's plain names
/// and that of the scenes' pieces, which are 0.13 darker, as surfaces are where light does not fall straight on them.
pub(super) const USUAL: [f64; COLORS.len()] =
    [0.16, 0.48, 0.45, 0.55, 0.58, 0.63, 0.64, 0.52, 0.49, 0.6, 0.86, 0.78, 0.75];

impl ColorRegion {
    fn has(&self, color: &OkColor) -> bool {
        let within = |[least, most]: [f64; 2], value: f64| (least..=most).contains(&value);
        let [from, to] = self.hue;
        let has_hue = if from <= to { within(self.hue, color.hue) } else { color.hue >= from || color.hue <= to };
        has_hue
            && within(self.chroma, color.chroma)
            && within(self.saturation, color.saturation)
            && within(self.lightness, color.lightness)
    }
}

/// Returns for each row whether its words fit a color.
pub(super) fn called(color: &OkColor) -> [bool; COLORS.len()] {
    REGIONS.map(|regions| regions.iter().any(|region| region.has(color)))
}

/// Returns whether a color is brown beside dark things, and the shade of orange or yellow beside bright ones.
pub(super) fn is_dim(color: &OkColor) -> bool {
    DIM.has(color)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::srgb::encode;
    use crate::scene::colors::terms::row;

    fn terms(rgb: [f64; 3]) -> Vec<&'static str> {
        let called = called(&OkColor::of(rgb));
        (0..COLORS.len()).filter(|row| called[*row]).map(|row| COLORS[row][0]).collect()
    }

    #[test]
    fn colors_can_be_called_by_the_words_that_people_use() {
        for (rgb, words, others) in [
            ([1.0, 0.0, 0.0], "red", "blue green white black yellow orange pink"),
            ([0.1, 0.2, 0.9], "blue", "red green yellow orange brown purple"),
            ([0.5, 0.1, 0.08], "red", "blue green yellow white orange pink"),
            ([0.4, 0.25, 0.13], "brown", "blue green white black pink orange red"),
            ([1.0, 0.6, 0.1], "orange", "blue green red pink brown"),
            ([0.9, 0.85, 0.1], "yellow", "blue red green orange brown"),
            ([0.86, 0.71, 0.05], "yellow", "brown orange beige"),
            ([0.2, 0.7, 0.2], "green", "blue red yellow brown turquoise"),
            ([0.1, 0.7, 0.7], "turquoise", "red yellow brown purple"),
            ([0.95, 0.4, 0.7], "pink", "green blue yellow red purple"),
            ([0.5, 0.2, 0.8], "purple", "green yellow brown white pink"),
            ([0.95, 0.93, 0.88], "white", "red blue green yellow gray"),
            ([0.9, 0.85, 0.65], "beige", "white yellow brown pink"),
            ([0.5, 0.5, 0.52], "gray", "red blue green brown white black"),
            ([0.77, 0.79, 0.78], "gray", "blue green beige"),
            ([0.0, 0.08, 0.24], "blue", "black purple"),
            ([0.02, 0.05, 0.01], "black", "red blue green white gray"),
        ] {
            let called = called(&OkColor::of(rgb));
            let is = |word: &str| called[row(word).expect("a color")];
            assert!(words.split(' ').all(is), "{rgb:?} is {words}");
            assert!(!others.split(' ').any(is), "{rgb:?} is none of {others}");
        }
    }

    #[test]
    fn a_thing_of_one_hue_keeps_its_name_in_the_shade() {
        for (linear, term) in [([0.6, 0.02, 0.02], "red"), ([0.02, 0.1, 0.6], "blue"), ([0.05, 0.35, 0.08], "green")] {
            for light in [1.0, 0.6, 0.3, 0.15_f32] {
                let shaded = terms(linear.map(|c: f32| f64::from(encode(c * light).0)));
                assert_eq!(shaded, [term], "{light}");
            }
        }
        // The control: the shade of orange is brown.
        let orange = [0.7, 0.2, 0.01].map(|c: f32| c * 0.2);
        assert!(!terms(orange.map(|c| f64::from(encode(c).0))).contains(&"orange"));
    }

    #[test]
    fn grays_go_from_black_to_white() {
        let grays: Vec<Vec<&str>> = (0..=10).map(|step| terms([f64::from(step) / 10.0; 3])).collect();
        assert!(grays[..=1].iter().all(|all| all == &["black"]), "{grays:?}");
        assert!(grays[2..=5].iter().all(|all| all == &["gray"]), "{grays:?}");
        assert!(grays[9..].iter().all(|all| all == &["white"]), "{grays:?}");
        assert!(grays.iter().all(|all| !all.is_empty()), "{grays:?}");
    }

    #[test]
    fn nearly_every_color_has_a_name() {
        let steps = || (0..16).map(|v| f64::from(v) / 15.0);
        let colors = steps().flat_map(|r| steps().flat_map(move |g| steps().map(move |b| [r, g, b])));
        let nameless = colors.filter(|rgb| terms(*rgb).is_empty()).count();
        assert!(nameless < 4096 / 25, "{nameless} of 4096");
    }
}
