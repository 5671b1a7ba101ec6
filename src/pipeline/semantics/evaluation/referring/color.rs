//! Basic color terms of surfaces, in clear cases only.
//!
//! A term has two ranges of hue, saturation and value: all people call what is in the narrow one so, and nobody what is
//! outside of the wide one. What lies between counts for neither.

use super::clarity::Clarity;
use crate::math::srgb;

/// Range in degrees of hue (around the circle if it begins above its end), saturation and value.
type Range = [[f32; 2]; 3];

/// Basic color term.
pub(super) struct ColorTerm {
    pub(super) name: &'static str,
    narrow: Range,
    wide: Range,
}

/// Terms that sentences use.
pub(super) static TERMS: [ColorTerm; 11] = [
    term("red", [[352.0, 9.0], [0.62, 1.0], [0.4, 1.0]], [[340.0, 18.0], [0.45, 1.0], [0.25, 1.0]]),
    term("orange", [[20.0, 34.0], [0.65, 1.0], [0.75, 1.0]], [[12.0, 44.0], [0.5, 1.0], [0.5, 1.0]]),
    term("yellow", [[44.0, 62.0], [0.5, 1.0], [0.75, 1.0]], [[36.0, 75.0], [0.3, 1.0], [0.55, 1.0]]),
    term("green", [[95.0, 150.0], [0.3, 1.0], [0.3, 1.0]], [[65.0, 190.0], [0.15, 1.0], [0.15, 1.0]]),
    term("blue", [[205.0, 240.0], [0.45, 1.0], [0.35, 1.0]], [[170.0, 258.0], [0.2, 1.0], [0.2, 1.0]]),
    term("purple", [[258.0, 290.0], [0.35, 1.0], [0.35, 1.0]], [[240.0, 325.0], [0.2, 1.0], [0.2, 1.0]]),
    term("pink", [[325.0, 350.0], [0.2, 0.6], [0.75, 1.0]], [[305.0, 15.0], [0.12, 0.75], [0.6, 1.0]]),
    term("brown", [[14.0, 36.0], [0.35, 0.8], [0.2, 0.5]], [[5.0, 45.0], [0.2, 1.0], [0.1, 0.65]]),
    term("black", [[0.0, 360.0], [0.0, 0.3], [0.0, 0.2]], [[0.0, 360.0], [0.0, 1.0], [0.0, 0.35]]),
    term("white", [[0.0, 360.0], [0.0, 0.08], [0.85, 1.0]], [[0.0, 360.0], [0.0, 0.22], [0.7, 1.0]]),
    term("grey", [[0.0, 360.0], [0.0, 0.1], [0.4, 0.7]], [[0.0, 360.0], [0.0, 0.22], [0.2, 0.88]]),
];

const fn term(name: &'static str, narrow: Range, wide: Range) -> ColorTerm {
    ColorTerm { name, narrow, wide }
}

impl ColorTerm {
    /// Answers whether a linear color is called so.
    fn holds(&self, linear: [f32; 3]) -> Clarity {
        let color = hsv(linear.map(|c| srgb::encode(c.clamp(0.0, 1.0)).0));
        Clarity::of(within(self.narrow, color), !within(self.wide, color))
    }

    /// Shares of points that are surely and perhaps called so; those without a color are perhaps.
    pub(super) fn shares(&self, colors: &[Option<[f32; 3]>]) -> [f64; 2] {
        let answers = || colors.iter().map(|c| c.map_or(Clarity::Unclear, |c| self.holds(c)));
        let all = colors.len().max(1) as f64;
        let sure = answers().filter(|a| *a == Clarity::Yes).count();
        let perhaps = answers().filter(|a| *a != Clarity::No).count();
        [sure as f64 / all, perhaps as f64 / all]
    }

    /// Returns whether the word names the color, in either spelling.
    pub(super) fn is(&self, word: &str) -> bool {
        word == self.name || (self.name == "grey" && word == "gray")
    }
}

/// Returns whether a word names a color.
pub(super) fn is_color(word: &str) -> bool {
    TERMS.iter().any(|term| term.is(word))
}

fn within([hue, saturation, value]: Range, [h, s, v]: [f32; 3]) -> bool {
    let inside = |[low, high]: [f32; 2], x: f32| low <= x && x <= high;
    let turned = if hue[0] > hue[1] { h >= hue[0] || h <= hue[1] } else { inside(hue, h) };
    turned && inside(saturation, s) && inside(value, v)
}

/// Hue in degrees, saturation and value of a color in 0..1.
fn hsv([r, g, b]: [f32; 3]) -> [f32; 3] {
    let (most, least) = (r.max(g).max(b), r.min(g).min(b));
    let spread = most - least;
    if spread <= 0.0 {
        return [0.0, 0.0, most];
    }
    let sixth = if most == r {
        (g - b) / spread
    } else if most == g {
        (b - r) / spread + 2.0
    } else {
        (r - g) / spread + 4.0
    };
    [(60.0 * sixth).rem_euclid(360.0), spread / most, most]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn called(hex: &str) -> (Vec<&'static str>, Vec<&'static str>) {
        let linear = srgb::from_hex(hex).unwrap().map(|c| srgb::linear(f32::from(c) / 255.0));
        let names = |answer: Clarity| TERMS.iter().filter(|t| t.holds(linear) == answer).map(|t| t.name).collect();
        (names(Clarity::Yes), names(Clarity::Unclear))
    }

    #[test]
    fn clear_colors_have_one_name() {
        for (hex, name) in [
            ("cd2328", "red"),
            ("ee7d1e", "orange"),
            ("f5cd32", "yellow"),
            ("2d9641", "green"),
            ("2355cd", "blue"),
            ("824bbe", "purple"),
            ("f078a0", "pink"),
            ("734628", "brown"),
            ("202024", "black"),
            ("f4f2ee", "white"),
            ("8c8e94", "grey"),
        ] {
            assert_eq!(called(hex).0, [name], "{hex}");
        }
    }

    #[test]
    fn colors_between_terms_have_none() {
        // Teal is green to some and blue to others.
        let (sure, perhaps) = called("1e9691");
        assert!(sure.is_empty() && perhaps.contains(&"green") && perhaps.contains(&"blue"), "{perhaps:?}");
        let (sure, perhaps) = called("f0b428");
        assert!(sure.is_empty() && perhaps.contains(&"orange") && perhaps.contains(&"yellow"), "{perhaps:?}");
    }

    #[test]
    fn shares_count_points() {
        let blue = Some([0.02, 0.1, 0.6]);
        let [sure, perhaps] = TERMS[4].shares(&[blue, blue, None, Some([0.6, 0.02, 0.02])]);
        assert_eq!((TERMS[4].name, sure, perhaps), ("blue", 0.5, 0.75));
        assert!(is_color("gray") && is_color("grey") && !is_color("table"));
    }
}
