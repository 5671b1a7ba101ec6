//! Color words, and the visible colors of each identity: mean and spread over its Gaussians.

use std::sync::Arc;

use super::{GaussianCloud, IdentityId, SemanticMap};
use crate::math::Real;
use crate::math::sh::SH_C0;

/// Color words; near synonyms share a row.
pub(crate) const COLORS: [&[&str]; 12] = [
    &["black"],
    &["blue"],
    &["brown"],
    &["gray", "grey"],
    &["green"],
    &["orange"],
    &["pink"],
    &["purple", "violet"],
    &["red"],
    &["turquoise", "teal"],
    &["white"],
    &["yellow"],
];

/// Row of a color word.
pub(crate) fn row(word: &str) -> Option<usize> {
    COLORS.iter().position(|all| all.contains(&word))
}

/// Share of an identity from which it has a color, whatever its mean color.
const MOSTLY: f64 = 0.5;
/// Least share of an identity that has its mean color: the mean of red and blue stripes is purple.
const LEAST: f64 = 0.15;

/// Returns for each row whether its words fit an sRGB color, 0..1. Neighboring words overlap: one person's red is
/// another's brown.
fn can_be_called(rgb: [f64; 3]) -> [bool; COLORS.len()] {
    let [r, g, b] = rgb;
    let (most, least) = (r.max(g).max(b), r.min(g).min(b));
    let (chroma, s) = (most - least, (most - least) / most.max(1e-9));
    let sixth = match most {
        _ if chroma < 1e-9 => 0.0,
        m if m == r => ((g - b) / chroma).rem_euclid(6.0),
        m if m == g => (b - r) / chroma + 2.0,
        _ => (r - g) / chroma + 4.0,
    };
    let hue = 60.0 * sixth;
    let within = |from: f64, to: f64| if from <= to { (from..=to).contains(&hue) } else { hue >= from || hue <= to };
    let is_colored = chroma > 0.06;
    let is = |word: &str| match word {
        "black" => most < 0.25 || (most < 0.35 && s < 0.35),
        "white" => most > 0.65 && s < 0.25,
        "gray" => (0.12..=0.9).contains(&most) && s < 0.25,
        "red" => within(338.0, 20.0) && s > 0.35 && most > 0.2,
        "orange" => within(10.0, 45.0) && s > 0.4 && most > 0.5,
        "brown" => within(0.0, 50.0) && s > 0.2 && (0.1..=0.7).contains(&most),
        "yellow" => within(38.0, 72.0) && s > 0.3 && most > 0.45,
        "green" => within(62.0, 172.0) && s > 0.15 && most > 0.12,
        "turquoise" => within(155.0, 205.0) && s > 0.2 && most > 0.2,
        "blue" => within(190.0, 265.0) && s > 0.2 && most > 0.12,
        "purple" => within(250.0, 318.0) && s > 0.15 && most > 0.15,
        "pink" => within(295.0, 20.0) && (0.1..=0.8).contains(&s) && most > 0.6,
        _ => false,
    };
    COLORS.map(|words| (is_colored || matches!(words[0], "black" | "white" | "gray")) && is(words[0]))
}

/// Colors of one identity, pieces included.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct ColorSums {
    /// Visible amount of its Gaussians: opacity times area.
    weight: f64,
    /// Color by weight, sRGB 0..1.
    color: [f64; 3],
    /// Weight of the Gaussians that can be called by each row.
    called: [f64; COLORS.len()],
}

impl ColorSums {
    fn add(&mut self, other: &Self) {
        self.weight += other.weight;
        self.color.iter_mut().zip(other.color).for_each(|(sum, c)| *sum += c);
        self.called.iter_mut().zip(other.called).for_each(|(sum, c)| *sum += c);
    }
}

/// Colors of all identities, by number; empty until computed.
#[derive(Clone, Debug, Default)]
pub(crate) struct SeenColors(Arc<[ColorSums]>);

impl PartialEq for SeenColors {
    /// Always equal: colors follow from the Gaussians.
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl SeenColors {
    /// Colors of the identities of a cloud.
    pub(crate) fn of(cloud: &GaussianCloud, map: &SemanticMap) -> Self {
        let mut sums = vec![ColorSums::default(); map.identities.len() + 1];
        let stride = cloud.sh_stride();
        for (i, id) in map.identity_of.iter().enumerate().take(cloud.len()) {
            let Some((own, sh)) = sums.get_mut(*id as usize).zip(cloud.sh.get(i * stride)) else { continue };
            let [a, b, c] = cloud.log_scales[i].map(|s| f64::from(s).exp());
            // The two larger extents are the visible ones.
            let weight = f64::from(cloud.opacity_logits[i].sigmoid()) * (a * b).max(b * c).max(a * c);
            let color = sh.map(|v| (0.5 + SH_C0 * f64::from(v)).clamp(0.0, 1.0));
            if weight.is_finite() && color.iter().all(|c| c.is_finite()) {
                let called = can_be_called(color).map(|is| if is { weight } else { 0.0 });
                own.add(&ColorSums { weight, color: color.map(|c| c * weight), called });
            }
        }
        // Wholes have smaller numbers than their pieces.
        for id in (1..sums.len()).rev() {
            let whole = map.identities.get(id as IdentityId).map_or(0, |i| i.parent) as usize;
            if (1..id).contains(&whole) {
                let own = sums[id];
                sums[whole].add(&own);
            }
        }
        Self(sums.into())
    }

    /// Returns whether an identity has the color of a row; `None` if its colors are unknown.
    pub(crate) fn has(&self, id: IdentityId, row: usize) -> Option<bool> {
        let of = self.0.get(id as usize).filter(|of| of.weight > 0.0)?;
        let share = of.called.get(row)? / of.weight;
        let mean = can_be_called(of.color.map(|c| c / of.weight));
        Some(share >= MOSTLY || (mean.get(row) == Some(&true) && share >= LEAST))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Identities, Level, NO_IDENTITY};

    #[test]
    fn colors_can_be_called_by_the_words_that_people_use() {
        for (rgb, words, others) in [
            ([1.0, 0.0, 0.0], "red", "blue green white black yellow"),
            ([0.1, 0.2, 0.9], "blue", "red green yellow orange brown"),
            ([0.5, 0.1, 0.08], "red brown", "blue green yellow white"),
            ([0.5, 0.3, 0.15], "brown", "blue green white black pink"),
            ([1.0, 0.6, 0.1], "orange", "blue green red pink"),
            ([0.9, 0.85, 0.1], "yellow", "blue red green orange"),
            ([0.2, 0.7, 0.2], "green", "blue red yellow brown"),
            ([0.1, 0.7, 0.7], "turquoise", "red yellow brown purple"),
            ([0.95, 0.4, 0.7], "pink", "green blue yellow"),
            ([0.5, 0.2, 0.8], "purple", "green yellow brown white"),
            ([0.95, 0.93, 0.88], "white", "red blue green yellow"),
            ([0.5, 0.5, 0.52], "gray", "red blue green brown white"),
            ([0.02, 0.05, 0.01], "black", "red blue green white"),
        ] {
            let called = can_be_called(rgb);
            let is = |word: &str| called[row(word).expect("a color")];
            assert!(words.split(' ').all(is), "{rgb:?} is {words}");
            assert!(!others.split(' ').any(is), "{rgb:?} is none of {others}");
        }
        assert_eq!((row("grey"), row("lamp")), (row("gray"), None));
    }

    #[test]
    fn a_thing_has_the_colors_of_its_gaussians_and_pieces() {
        let mut all = Identities::default();
        let mug = all.add(Level::Object, NO_IDENTITY, vec![]);
        let handle = all.add(Level::Part, mug, vec![]);
        let lamp = all.add(Level::Object, NO_IDENTITY, vec![]);
        let dc = |rgb: [f64; 3]| rgb.map(|c| ((c - 0.5) / SH_C0) as f32);
        let (red, blue) = ([0.8, 0.1, 0.1], [0.1, 0.1, 0.8]);
        let colors = [red, red, red, blue, [1.0; 3], blue];
        let n = colors.len();
        let cloud = GaussianCloud {
            positions: vec![[0.0; 3]; n],
            log_scales: vec![[-3.0; 3]; n],
            quaternions: vec![[1.0, 0.0, 0.0, 0.0]; n],
            // The last one cannot be seen.
            opacity_logits: vec![4.0, 4.0, 4.0, 4.0, 4.0, -30.0],
            sh: colors.map(dc).to_vec(),
            ..GaussianCloud::default()
        };
        let map = SemanticMap::from_identities(all, vec![mug, mug, mug, handle, lamp, lamp], vec![1.0; n], vec![]);
        let seen = SeenColors::of(&cloud, &map);
        let has = |id, word: &str| seen.has(id, row(word).expect("a color"));
        assert_eq!((has(mug, "red"), has(mug, "blue")), (Some(true), Some(false)));
        assert_eq!((has(handle, "red"), has(handle, "blue")), (Some(false), Some(true)));
        assert_eq!((has(lamp, "white"), has(lamp, "blue"), has(9, "red")), (Some(true), Some(false), None));
        // Stripes have no color between them.
        let stripes =
            SemanticMap::from_identities(Identities::objects(1), vec![1, 0, 0, 1, 0, 0], vec![1.0; n], vec![]);
        let purple = SeenColors::of(&cloud, &stripes).has(1, row("purple").expect("a color"));
        assert_eq!((purple, SeenColors::default().has(1, 0)), (Some(false), None));
    }
}
