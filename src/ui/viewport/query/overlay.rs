//! The overlay of the view: outlines and fills of masks, and tints.

use egui::{Color32, ColorImage};
use rayon::prelude::*;

use super::super::outline::{Outline, with_alpha};
use super::settings::OverlaySettings;
use crate::math::vector::dot;
use crate::pipeline::semantics::code_map::CodeMap;
use crate::pipeline::semantics::query::matching::MatchMode;
use crate::pipeline::semantics::view_map::ViewMap;
use crate::scene::semantic_map::CODE_CHANNELS;
use crate::scene::{Identities, IdentityId, Level, Mask};
use crate::ui::color_by::ColorBy;

/// Dimming of everything neither found nor selected.
const DIM: Color32 = Color32::from_black_alpha(165);

/// Color of pixels with different blended codes.
const DIFFERENT: [u8; 3] = [255, 60, 160];

/// Stripe colors of unlabeled pixels, and stripe width in px.
pub(crate) const HATCH: [[u8; 3]; 2] = [[205; 3], [70; 3]];
const HATCH_PX: usize = 6;
/// Stripe color of pixels that a removal has filled.
pub(crate) const INVENTED: [u8; 3] = [255, 236, 150];

/// Layers of the overlay.
pub(crate) struct Layers<'a> {
    /// Identity map of the view.
    pub(crate) map: &'a ViewMap,
    /// Blended codes of the pixels, if drawn.
    pub(crate) codes: Option<&'a CodeMap>,
    pub(crate) identities: &'a Identities,
    /// Mask of unlabeled pixels, if drawn.
    pub(crate) unknown: Option<&'a Mask>,
    /// Mask of pixels that a removal has filled, if drawn.
    pub(crate) invented: Option<&'a Mask>,
    /// Masks of the answers, with their colors; later ones on top.
    pub(crate) masks: &'a [([u8; 3], Mask)],
    /// Mask that stays bright while everything else is dimmed.
    pub(crate) lit: Option<&'a Mask>,
    /// Relevancy of each identity by number.
    pub(crate) relevancy: &'a [f32],
    /// Colors of the language features of each identity by number.
    pub(crate) features: &'a [[u8; 3]],
    pub(crate) settings: OverlaySettings,
}

impl Layers<'_> {
    /// All layers in one frame of the view's size.
    pub(crate) fn paint(&self) -> ColorImage {
        let (w, h) = (self.map.width_px, self.map.height_px);
        let tints: Vec<Option<[u8; 3]>> = (0..=self.identities.len() as IdentityId).map(|id| self.tint(id)).collect();
        let hot: Option<Mask> = (self.settings.threshold > 0.0)
            .then(|| Mask::from_fn(w, h, |i| self.relevancy_of(self.map.identity[i]) >= self.settings.threshold));
        let codes: Vec<_> = (0..=self.identities.len() as IdentityId).map(|id| self.identities.codes(id)).collect();
        let pixel = |i: usize| {
            if hot.as_ref().is_some_and(|m| Outline::at(m, i) == Outline::Line) {
                return Color32::WHITE;
            }
            let outlines = self.masks.iter().rev().map(|(color, mask)| (color, Outline::at(mask, i)));
            let filled = self.settings.color_by == ColorBy::Masks;
            // A mask covers another's halo; with a tint, masks are outlines only.
            let topmost = outlines.filter(|o| o.1 != Outline::Outside).min_by_key(|o| o.1 == Outline::Halo);
            match topmost.filter(|o| filled || o.1 != Outline::Fill) {
                Some((color, outline)) => outline.color(*color).unwrap_or_default(),
                None if self.lit.is_some_and(|lit| !lit.contains(i)) => DIM,
                None => {
                    let own = || tints.get(self.map.identity[i] as usize).copied().flatten();
                    let tint = match self.settings.color_by {
                        ColorBy::Difference => {
                            codes.get(self.map.identity[i] as usize).and_then(|c| self.difference(i, c))
                        }
                        _ => self.striped(i).or_else(|| self.blended(i)).or_else(own).or_else(|| self.hatch(i)),
                    };
                    tint.map_or(Color32::TRANSPARENT, |c| with_alpha(c, self.settings.opacity))
                }
            }
        };
        ColorImage::new([w, h], (0..w * h).into_par_iter().map(pixel).collect())
    }

    fn relevancy_of(&self, id: IdentityId) -> f32 {
        self.relevancy.get(id as usize).copied().unwrap_or(0.0)
    }

    /// Color of a pixel in the codes view in blended mode.
    fn blended(&self, i: usize) -> Option<[u8; 3]> {
        let codes = self
            .codes
            .filter(|_| self.settings.color_by == ColorBy::Codes && self.settings.recipe.masks == MatchMode::Codes)?;
        let of = |level: Level| codes.level(level).iter().map(move |plane| plane.get(i).copied().unwrap_or(f32::NAN));
        // A part if there is one, else the object.
        let part: Vec<f32> = of(Level::Part).collect();
        let is_part = part.iter().any(|c| (c - 0.5).abs() > 0.1);
        let shown: Vec<f32> = if is_part { part } else { of(Level::Object).collect() };
        shown.iter().all(|c| c.is_finite()).then(|| std::array::from_fn(|c| (shown[c].clamp(0.0, 1.0) * 255.0) as u8))
    }

    /// Color of a pixel whose blended codes differ from those of its identity by more than the match tolerance; `None`
    /// without Gaussians there.
    fn difference(&self, i: usize, own: &[f32; CODE_CHANNELS]) -> Option<[u8; 3]> {
        let blended = self.codes?.planes.iter().map(|plane| plane.get(i).copied().unwrap_or(f32::NAN));
        let far = blended.zip(own).any(|(b, o)| (b - o).abs() > self.settings.recipe.tolerance);
        far.then_some(DIFFERENT)
    }

    /// Stripes on an unlabeled pixel, so that it does not look like an object.
    fn hatch(&self, i: usize) -> Option<[u8; 3]> {
        self.unknown.filter(|m| m.contains(i))?;
        let across = (i % self.map.width_px + i / self.map.width_px) / HATCH_PX;
        Some(HATCH[across % 2])
    }

    /// Stripes over filled pixels, across those of unlabeled ones; the pixel's own color shows between them.
    fn striped(&self, i: usize) -> Option<[u8; 3]> {
        self.invented.filter(|m| m.contains(i))?;
        let across = (self.map.width_px + i / self.map.width_px - i % self.map.width_px) / HATCH_PX;
        across.is_multiple_of(2).then_some(INVENTED)
    }

    /// Color of an identity; `None` leaves the frame as it is.
    fn tint(&self, id: IdentityId) -> Option<[u8; 3]> {
        let code = |id: IdentityId| self.identities.get(id).map(|i| i.code.map(|c| (c * 255.0) as u8));
        match self.settings.color_by {
            ColorBy::Masks | ColorBy::Difference => None,
            ColorBy::Heat => Some(self.settings.colormap.color(self.relevancy_of(id))),
            ColorBy::Objects => code(self.identities.object_of(id)),
            ColorBy::Parts => code(id).filter(|_| self.identities.get(id).is_some_and(|i| i.level == Level::Part)),
            ColorBy::Codes => code(id),
            ColorBy::Features => self.features.get(id as usize).copied().filter(|_| self.identities.get(id).is_some()),
        }
    }
}

/// Colors of vectors by their first three principal components, by number from 0; gray for those without a vector.
pub(crate) fn main_directions(vectors: &[Option<&[f32]>]) -> Vec<[u8; 3]> {
    let some: Vec<&[f32]> = vectors.iter().flatten().copied().collect();
    let Some(dimension) = some.first().map(|v| v.len()) else { return vec![[128; 3]; vectors.len()] };
    let mean: Vec<f32> = (0..dimension).map(|c| some.iter().map(|v| v[c]).sum::<f32>() / some.len() as f32).collect();
    let mut centered: Vec<Vec<f32>> = some.iter().map(|v| v.iter().zip(&mean).map(|(a, m)| a - m).collect()).collect();
    let mut colors = vec![[128_u8; 3]; some.len()];
    // One scale for all components, or the least of them would look too strong.
    let mut widest = 1e-6_f32;
    for channel in 0..3 {
        let direction = main_direction(&centered);
        let along: Vec<f32> = centered.iter().map(|v| dot(v, &direction)).collect();
        widest = along.iter().fold(widest, |m, a| m.max(a.abs()));
        for ((color, v), a) in colors.iter_mut().zip(&mut centered).zip(&along) {
            color[channel] = (127.5 + 110.0 * a / widest) as u8;
            v.iter_mut().zip(&direction).for_each(|(x, d)| *x -= a * d);
        }
    }
    let mut next = colors.into_iter();
    vectors.iter().map(|v| v.and_then(|_| next.next()).unwrap_or([128; 3])).collect()
}

/// Power iteration on the covariance, from the longest centered vector.
fn main_direction(centered: &[Vec<f32>]) -> Vec<f32> {
    let longest = centered.iter().max_by(|a, b| dot(a, a).total_cmp(&dot(b, b)));
    let mut direction = longest.cloned().unwrap_or_default();
    for _ in 0..30 {
        let mut next = vec![0.0; direction.len()];
        for v in centered {
            let along = dot(v, &direction);
            next.iter_mut().zip(v).for_each(|(n, x)| *n += along * x);
        }
        match crate::math::vector::unit(&next) {
            Some(unit) => direction = unit,
            None => return vec![0.0; direction.len()],
        }
    }
    direction
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::colormap::Colormap;
    use crate::scene::NO_IDENTITY;

    fn scene() -> (Identities, ViewMap) {
        let mut all = Identities::default();
        let lamp = all.add(Level::Object, NO_IDENTITY, vec!["lamp".into()]);
        all.add(Level::Part, lamp, vec!["shade".into()]);
        let identity = [[0, 0, 2, 2, 2, 2, 2, 1]; 3].concat();
        (all, ViewMap::certain(8, identity))
    }

    fn paint(settings: OverlaySettings) -> ColorImage {
        let (identities, map) = scene();
        let masks = [([255, 179, 0], map.mask(&identities, 2))];
        let relevancy = [0.0, 0.5, 1.0];
        let layers = Layers {
            map: &map,
            codes: None,
            unknown: None,
            invented: None,
            identities: &identities,
            masks: &masks,
            lit: None,
            relevancy: &relevancy,
            features: &[],
            settings,
        };
        layers.paint()
    }

    #[test]
    fn masks_have_an_outline_and_a_fill() {
        let image = paint(OverlaySettings::default());
        let of = |outline: Outline| outline.color([255, 179, 0]).expect("a color");
        assert_eq!((image.pixels[8], image.pixels[9]), (Color32::TRANSPARENT, of(Outline::Halo)));
        assert_eq!((image.pixels[10], image.pixels[12]), (of(Outline::Line), of(Outline::Fill)));
    }

    #[test]
    fn all_is_dimmed_but_what_is_lit() {
        let (identities, map) = scene();
        let masks = [([255, 179, 0], map.mask(&identities, 2))];
        let lit = map.mask(&identities, 2);
        let mut layers = Layers {
            map: &map,
            codes: None,
            unknown: None,
            invented: None,
            identities: &identities,
            masks: &masks,
            lit: Some(&lit),
            relevancy: &[],
            features: &[],
            settings: OverlaySettings::default(),
        };
        let image = layers.paint();
        assert_eq!((image.pixels[8], image.pixels[12]), (DIM, Outline::Fill.color([255, 179, 0]).expect("a fill")));
        assert_eq!(image.pixels.iter().filter(|p| **p == DIM).count(), 3, "not the halo");
        layers.lit = None;
        assert!(layers.paint().pixels.iter().all(|p| *p != DIM), "the control");
    }

    #[test]
    fn what_is_unknown_is_hatched_and_what_is_nobodys_is_not() {
        let (identities, map) = scene();
        let unknown = Mask::from_fn(8, 3, |i| i % 8 == 0);
        let settings = OverlaySettings { color_by: ColorBy::Objects, opacity: 1.0, ..OverlaySettings::default() };
        let mut layers = Layers {
            map: &map,
            codes: None,
            unknown: Some(&unknown),
            invented: None,
            identities: &identities,
            masks: &[],
            lit: None,
            relevancy: &[],
            features: &[],
            settings,
        };
        let image = layers.paint();
        let [r, g, b] = HATCH[0];
        assert_eq!((image.pixels[0], image.pixels[1]), (Color32::from_rgb(r, g, b), Color32::TRANSPARENT));
        let own = image.pixels[2];
        layers.unknown = None;
        let image = layers.paint();
        assert_eq!((image.pixels[0], image.pixels[2]), (Color32::TRANSPARENT, own), "the control");
    }

    #[test]
    fn heat_and_threshold_follow_relevancy() {
        let image = paint(OverlaySettings { color_by: ColorBy::Heat, opacity: 1.0, ..OverlaySettings::default() });
        let [r, g, b] = Colormap::Turbo.color(1.0);
        assert_eq!(image.pixels[12], Color32::from_rgb(r, g, b));
        let image = paint(OverlaySettings { threshold: 0.4, ..OverlaySettings::default() });
        assert_eq!(image.pixels[10], Color32::WHITE, "where it begins");
        assert_eq!(image.pixels[8], Color32::TRANSPARENT);
    }

    #[test]
    fn blended_codes_that_are_not_their_own_are_shown() {
        let (identities, map) = scene();
        let mut codes = CodeMap { width_px: 8, height_px: 3, ..CodeMap::default() };
        for (c, plane) in codes.planes.iter_mut().enumerate() {
            *plane = map.identity.iter().map(|id| identities.codes(*id)[c]).collect();
        }
        // One pixel of the shade is blended with something else; the first is empty.
        codes.planes[4][12] += 0.1;
        codes.planes[0][0] = f32::NAN;
        let settings = OverlaySettings { color_by: ColorBy::Difference, opacity: 1.0, ..OverlaySettings::default() };
        let layers = Layers {
            map: &map,
            codes: Some(&codes),
            unknown: None,
            invented: None,
            identities: &identities,
            masks: &[],
            lit: None,
            relevancy: &[],
            features: &[],
            settings,
        };
        let [r, g, b] = DIFFERENT;
        let image = layers.paint();
        let different: Vec<usize> = (0..24).filter(|i| image.pixels[*i] != Color32::TRANSPARENT).collect();
        assert_eq!((different, image.pixels[12]), (vec![12], Color32::from_rgb(r, g, b)));
    }

    #[test]
    fn alike_features_have_alike_colors() {
        let v: [&[f32]; 4] = [&[1.0, 0.0, 0.0], &[0.98, 0.05, 0.0], &[0.0, 1.0, 0.0], &[0.0, 0.0, 1.0]];
        let colors = main_directions(&[None, Some(v[0]), Some(v[1]), Some(v[2]), Some(v[3])]);
        let far = |a: [u8; 3], b: [u8; 3]| a.iter().zip(b).map(|(a, b)| a.abs_diff(b) as u32).sum::<u32>();
        assert_eq!(colors[0], [128; 3]);
        assert!(far(colors[1], colors[2]) * 4 < far(colors[1], colors[3]), "{colors:?}");
        assert_eq!(main_directions(&[None, None]), [[128; 3]; 2]);
        assert_eq!(main_directions(&[Some(v[0]), Some(v[0])]), [[127; 3]; 2], "nothing to tell apart");
    }
}
