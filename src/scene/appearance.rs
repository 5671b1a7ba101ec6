//! Descriptions of unnamed identities by color and size.

use super::{Bounds, GaussianCloud, SemanticMap};
use crate::math::Real;
use crate::math::format;
use crate::math::sh::SH_C0;

/// Color and size of an identity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Appearance {
    /// Mean color of its Gaussians by opacity, sRGB 0..1.
    color: [f64; 3],
    /// Longest edge of its box, without stray Gaussians, in scene units.
    length: f64,
}

/// Appearance of every unnamed identity, by number less one; `None` for named ones and those without Gaussians.
pub(crate) fn of_unnamed(cloud: &GaussianCloud, map: &SemanticMap) -> Vec<Option<Appearance>> {
    map.identities.iter().map(|(id, i)| if i.names.is_empty() { of(cloud, &map.members(id)) } else { None }).collect()
}

fn of(cloud: &GaussianCloud, members: &[usize]) -> Option<Appearance> {
    let size = Bounds::robust(members.iter().map(|&i| cloud.world_position(i)))?.size();
    let per_gaussian = cloud.sh.len() / cloud.len().max(1);
    let (mut sum, mut weight) = ([0.0; 3], 0.0);
    for &i in members {
        let opacity = f64::from(cloud.opacity_logits[i]).sigmoid();
        let color = cloud.sh[i * per_gaussian].map(|c| (0.5 + SH_C0 * f64::from(c)).clamp(0.0, 1.0));
        (0..3).for_each(|c| sum[c] += opacity * color[c]);
        weight += opacity;
    }
    (weight > 0.0).then(|| Appearance { color: sum.map(|c| c / weight), length: size.max_element() })
}

impl Appearance {
    /// "pale blue region, 12 cm"; in "units" where their length in meters is not known.
    pub(crate) fn text(&self, meters_per_unit: Option<f64>) -> String {
        format!("{} region, {}", color_word(self.color), format::length(self.length, meters_per_unit))
    }
}

/// An English word for a color.
fn color_word(rgb: [f64; 3]) -> String {
    let (most, least) = (rgb.iter().fold(0.0, |m: f64, c| m.max(*c)), rgb.iter().fold(1.0, |m: f64, c| m.min(*c)));
    let (chroma, saturation) = (most - least, (most - least) / most.max(1e-9));
    if most < 0.15 {
        return "black".into();
    }
    if saturation < 0.12 {
        let gray = match most {
            v if v > 0.85 => "white",
            v if v > 0.65 => "pale gray",
            v if v > 0.35 => "gray",
            _ => "dark gray",
        };
        return gray.into();
    }
    let [r, g, b] = rgb;
    let sixth = match most {
        m if m == r => ((g - b) / chroma).rem_euclid(6.0),
        m if m == g => (b - r) / chroma + 2.0,
        _ => (r - g) / chroma + 4.0,
    };
    let hue = match 60.0 * sixth {
        h if !(15.0..345.0).contains(&h) => "red",
        h if h < 45.0 && most < 0.65 => return if most < 0.35 { "dark brown" } else { "brown" }.into(),
        h if h < 45.0 => "orange",
        h if h < 70.0 => "yellow",
        h if h < 165.0 => "green",
        h if h < 195.0 => "cyan",
        h if h < 255.0 => "blue",
        h if h < 290.0 => "purple",
        _ => "pink",
    };
    match (most, saturation) {
        (v, _) if v < 0.4 => format!("dark {hue}"),
        (v, s) if s < 0.4 && v > 0.6 => format!("pale {hue}"),
        _ => hue.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Identities, Level, NO_IDENTITY};

    #[test]
    fn colors_have_the_words_that_people_use() {
        let words = [
            ([1.0, 0.0, 0.0], "red"),
            ([0.1, 0.2, 0.9], "blue"),
            ([0.6, 0.75, 0.95], "pale blue"),
            ([0.05, 0.1, 0.3], "dark blue"),
            ([0.5, 0.3, 0.15], "brown"),
            ([1.0, 0.6, 0.1], "orange"),
            ([0.9, 0.85, 0.1], "yellow"),
            ([0.2, 0.7, 0.2], "green"),
            ([0.1, 0.8, 0.8], "cyan"),
            ([0.95, 0.3, 0.7], "pink"),
            ([0.55, 0.2, 0.8], "purple"),
            ([0.95, 0.95, 0.95], "white"),
            ([0.5, 0.5, 0.52], "gray"),
            ([0.02, 0.05, 0.01], "black"),
        ];
        for (rgb, word) in words {
            assert_eq!(color_word(rgb), word, "{rgb:?}");
        }
    }

    #[test]
    fn what_has_no_name_is_called_by_color_and_size() {
        let mut all = Identities::default();
        let region = all.add(Level::Object, NO_IDENTITY, vec![]);
        let lamp = all.add(Level::Object, NO_IDENTITY, vec!["lamp".into()]);
        all.add(Level::Object, NO_IDENTITY, vec![]);
        let n = 21;
        let dc = |c: f64| ((c - 0.5) / SH_C0) as f32;
        let cloud = GaussianCloud {
            positions: (0..n).map(|i| [i as f32 * 0.01, 0.0, 0.0]).collect(),
            log_scales: vec![[-3.0; 3]; n],
            quaternions: vec![[1.0, 0.0, 0.0, 0.0]; n],
            // The last one is red and cannot be seen.
            opacity_logits: (0..n).map(|i| if i < 19 { 4.0 } else { -20.0 }).collect(),
            sh: (0..n).map(|i| if i < 19 { [0.6, 0.75, 0.95] } else { [1.0, 0.0, 0.0] }.map(dc)).collect(),
            ..GaussianCloud::default()
        };
        let of = (0..n).map(|i| if i < 20 { region } else { lamp }).collect();
        let map = SemanticMap::from_identities(all, of, vec![1.0; n], vec![]);
        let found = of_unnamed(&cloud, &map);
        assert!(found[1].is_none() && found[2].is_none(), "one has a name, one has no Gaussians");
        let region = found[0].expect("Gaussians");
        assert_eq!(region.text(Some(1.0)), "pale blue region, 19 cm");
        assert_eq!(region.text(None), "pale blue region, 0.19 units");
    }
}
