//! Language features of identities from vectors that came with the masks, without a network: the mean of the vectors of
//! the masks that show an identity.

use std::collections::{BTreeMap, HashMap};

use super::embed::{CropRenderer, LEAST_PX};
use super::error::FindError;
use super::segmenter::Segmenter;
use crate::io::labels::language_features::MaskVectors;
use crate::io::labels::nested::NO_MASK;
use crate::math::format::things;
use crate::math::vector::unit;
use crate::pipeline::observer::{Observer, Severity, Ticker};
use crate::pipeline::semantics::relevancy::deviate;
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::{RenderSettings, Renderer};
use crate::scene::{GaussianCloud, Identities, IdentityId, LanguageFeatures, Level, Photo, SemanticMap, ViewFeatures};

/// Longer side of the views in which masks and identities are compared, px.
const SIDE_PX: u32 = 512;
/// Most photos whose masks are read.
const MOST_PHOTOS: usize = 128;
/// Least IoU of a mask and the identity that it shows.
const SHOWS: f64 = 0.5;

/// Embeds every identity of `map` that `encoder` has not embedded yet, by the masks of the `photos`. Parts keep
/// `part_weight` of their own embedding. Each mask counts by the pixels that it shares with the identity.
pub(super) fn embed_by_masks(
    cloud: &GaussianCloud,
    map: &SemanticMap,
    photos: &[Photo],
    settings: &RenderSettings,
    part_weight: f32,
    (encoder, segmenter): (&str, &dyn Segmenter),
    observer: &mut dyn Observer,
) -> Result<LanguageFeatures, FindError> {
    let dimension = MaskVectors::dimension();
    let mut renderer = CropRenderer { cloud, map, settings, renderer: Renderer::new() };
    let covered: Vec<&Photo> = photos.iter().filter(|photo| segmenter.covers(photo)).collect();
    let read: Vec<&Photo> = covered.iter().copied().step_by(covered.len().div_ceil(MOST_PHOTOS).max(1)).collect();
    let mut sums = vec![vec![0.0_f64; dimension]; map.identities.len()];
    let mut ticker = Ticker::new("Comparing masks with objects and parts", read.len());
    for (k, photo) in read.into_iter().enumerate() {
        if let Some(masks) = segmenter.vectors(photo, SIDE_PX)? {
            let view = renderer.draw(photo, SIDE_PX)?;
            for (id, mask, pixels) in shown(&view, &masks.levels, &map.identities) {
                let sum = sums[id as usize - 1].iter_mut();
                sum.zip(masks.of(mask)).for_each(|(sum, v)| *sum += pixels as f64 * f64::from(*v));
            }
        }
        ticker.tick(k + 1, observer)?;
    }
    let means: Vec<Option<Vec<f32>>> =
        sums.into_iter().map(|sum| unit(&sum.into_iter().map(|v| v as f32).collect::<Vec<_>>())).collect();
    let before = map.language.as_ref().filter(|l| l.encoder == encoder && l.dimension == dimension);
    let mut of = before.map_or_else(Vec::new, |l| l.by_identity.clone());
    of.resize(map.identities.len(), ViewFeatures::default());
    for (id, identity) in map.identities.iter() {
        let features = &mut of[id as usize - 1];
        let Some(raw) = means[id as usize - 1].clone().filter(|_| features.raw.is_empty()) else { continue };
        let whole = Some(map.identities.object_of(id)).filter(|o| identity.level == Level::Part && *o != id);
        let whole = whole.and_then(|whole| means[whole as usize - 1].as_ref());
        let deviated = whole.and_then(|whole| deviate(&raw, whole, part_weight)).unwrap_or_else(|| raw.clone());
        *features = ViewFeatures { raw: vec![raw], deviated: vec![deviated] };
    }
    let without = of.iter().filter(|features| features.raw.is_empty()).count();
    if without > 0 {
        let text = format!(
            "{} of {} have no mask that shows just them, and are found by name only",
            without,
            things(of.len(), "object or part")
        );
        observer.note(Severity::Info, text);
    }
    Ok(LanguageFeatures { encoder: encoder.to_owned(), dimension, by_identity: of })
}

/// Finds the identity that each mask fits best in a view, if it shows just this: the identity, the number of the mask,
/// and the pixels they share.
fn shown(view: &ViewMap, levels: &[Vec<u16>], identities: &Identities) -> Vec<(IdentityId, u16, usize)> {
    let mut seen = vec![0_usize; identities.len() + 1];
    view.identity.iter().for_each(|id| identities.ancestors(*id).for_each(|id| seen[id as usize] += 1));
    let mut found = Vec::new();
    for level in levels {
        let mut area: HashMap<u16, usize> = HashMap::new();
        let mut innermost: HashMap<(u16, IdentityId), usize> = HashMap::new();
        for (&id, &mask) in view.identity.iter().zip(level).filter(|(_, mask)| **mask != NO_MASK) {
            *area.entry(mask).or_default() += 1;
            *innermost.entry((mask, id)).or_default() += 1;
        }
        // In one order: sums depend on it, and so does the choice among equals.
        let mut shared: BTreeMap<(u16, IdentityId), usize> = BTreeMap::new();
        for ((mask, id), pixels) in innermost {
            identities.ancestors(id).for_each(|id| *shared.entry((mask, id)).or_default() += pixels);
        }
        let mut best: BTreeMap<u16, (f64, IdentityId, usize)> = BTreeMap::new();
        for ((mask, id), pixels) in shared {
            let iou = pixels as f64 / (area[&mask] + seen[id as usize] - pixels) as f64;
            let fits = pixels >= LEAST_PX && iou >= SHOWS;
            if fits && best.get(&mask).is_none_or(|(most, ..)| iou > *most) {
                best.insert(mask, (iou, id, pixels));
            }
        }
        found.extend(best.into_iter().map(|(mask, (_, id, pixels))| (id, mask, pixels)));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::NO_IDENTITY;

    #[test]
    fn a_mask_counts_for_the_identity_that_it_fits_best() {
        let mut all = Identities::default();
        let pot = all.add(Level::Object, NO_IDENTITY, vec![]);
        let lid = all.add(Level::Part, pot, vec![]);
        let identity = (0..100)
            .map(|i| {
                if i < 20 {
                    pot
                } else if i < 45 {
                    lid
                } else {
                    NO_IDENTITY
                }
            })
            .collect();
        let view = ViewMap::certain(100, identity);
        let level = |masks: &[(u16, std::ops::Range<usize>)]| {
            let mut level = vec![NO_MASK; 100];
            masks.iter().for_each(|(number, range)| level[range.clone()].fill(*number));
            level
        };
        // The whole pot fits its lid by half, too; a mask of the table and one of a few pixels show neither.
        let levels = [level(&[(0, 22..45), (1, 60..70)]), level(&[(2, 0..45), (3, 45..100)]), level(&[(4, 0..100)])];
        assert_eq!(shown(&view, &levels, &all), [(lid, 0, 23), (pot, 2, 45)]);
        assert_eq!(shown(&view, &[level(&[(5, 20..31)])], &all), [], "11 pixels are too few");
    }
}
