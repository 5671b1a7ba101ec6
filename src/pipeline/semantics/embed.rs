//! Language features of identities: an encoder looks at each in the photos that show it best.

use std::collections::{BTreeSet, HashMap};
use std::time::Instant;

use super::relevancy::{PART_WEIGHT, deviate};
use super::view_map::ViewMap;
use crate::io::{self, IoError};
use crate::models::{Encoder, ModelError, Tile};
use crate::pipeline::observer::{Observer, Progress, Signal};
use crate::render::cpu::Renderer;
use crate::render::{RenderError, RenderSettings};
use crate::scene::language::MAX_VIEWS;
use crate::scene::{
    GaussianCloud, Identities, IdentityId, LanguageFeatures, Level, Mask, Photo, PhotoPixels, SemanticMap, ViewFeatures,
};

/// Longer side of the photos that tiles are cut from, px.
const MAX_SIDE_PX: u32 = 1_024;
/// Longer side of the views in which visibility is counted, px.
const COUNT_SIDE_PX: u32 = 256;
/// Pixels of such a view that must show an identity for it to be looked at.
const LEAST_PX: usize = 12;

/// Why identities could not be looked at.
#[derive(Debug, thiserror::Error)]
pub enum EmbedError {
    /// A photo could not be read.
    #[error(transparent)]
    Photo(#[from] IoError),
    /// A view could not be drawn.
    #[error("photo {0}: {1}")]
    Render(String, RenderError),
    /// The encoder failed.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The observer asked to stop.
    #[error("cancelled")]
    Cancelled,
}

/// Lets `encoder` look at every identity of `map`, in up to [`MAX_VIEWS`] of the `photos`.
///
/// # Errors
/// If a photo cannot be read, the encoder fails, or the observer asks to stop.
pub fn embed(
    cloud: &GaussianCloud,
    map: &SemanticMap,
    photos: &[Photo],
    settings: &RenderSettings,
    encoder: &mut dyn Encoder,
    observer: &mut dyn Observer,
) -> Result<LanguageFeatures, EmbedError> {
    let mut looker = Looker { cloud, map, settings, renderer: Renderer::new() };
    let start = Instant::now();
    let mut report = |stage: &str, done: usize, total: usize| {
        let elapsed_secs = start.elapsed().as_secs_f64();
        let rate = done as f64 / elapsed_secs.max(1e-9);
        observer.progress(Progress { stage: stage.into(), done: done as u64, total: total as u64, elapsed_secs, rate });
        if observer.signal() == Signal::Cancel { Err(EmbedError::Cancelled) } else { Ok(()) }
    };
    let n = map.identities.len();
    let mut seen: Vec<Vec<(f64, usize)>> = vec![Vec::new(); n];
    for (i, photo) in photos.iter().enumerate() {
        let view = looker.draw(photo, COUNT_SIDE_PX)?;
        for (found, seen) in counts(&view, &map.identities).into_iter().zip(&mut seen) {
            seen.extend((found >= LEAST_PX as f64).then_some((found, i)));
        }
        report("Choosing views of the objects", i + 1, photos.len())?;
    }
    let mut wanted: HashMap<usize, Vec<IdentityId>> = HashMap::new();
    for (k, seen) in seen.iter_mut().enumerate() {
        seen.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        seen.iter().take(MAX_VIEWS).for_each(|(_, photo)| wanted.entry(*photo).or_default().push(k as IdentityId + 1));
    }
    let mut of = vec![ViewFeatures::default(); n];
    let mut order: Vec<usize> = wanted.keys().copied().collect();
    order.sort_unstable();
    for (done, photo) in order.iter().enumerate() {
        let pixels = io::photo::load(&photos[*photo], MAX_SIDE_PX)?;
        let view = looker.draw(&photos[*photo], MAX_SIDE_PX)?;
        let mut eye = Eye { rgb: to_float(&pixels), view, identities: &map.identities, looked: HashMap::new() };
        let whole_of = |id: IdentityId| {
            let whole = map.identities.object_of(id);
            let is_part = map.identities.get(id).is_some_and(|i| i.level == Level::Part);
            Some(whole).filter(|whole| is_part && *whole != id)
        };
        eye.look(wanted[photo].iter().flat_map(|id| [Some(*id), whole_of(*id)]).flatten(), encoder)?;
        for &id in &wanted[photo] {
            let Some(raw) = eye.seen(id) else { continue };
            let whole = whole_of(id).and_then(|whole| eye.seen(whole));
            let deviated = whole.and_then(|whole| deviate(&raw, &whole, PART_WEIGHT)).unwrap_or_else(|| raw.clone());
            let features = &mut of[id as usize - 1];
            features.raw.push(raw);
            features.deviated.push(deviated);
        }
        report("Looking at the objects", done + 1, order.len())?;
    }
    Ok(LanguageFeatures { encoder: encoder.name().into(), dimension: encoder.dimension(), of })
}

struct Looker<'a> {
    cloud: &'a GaussianCloud,
    map: &'a SemanticMap,
    settings: &'a RenderSettings,
    renderer: Renderer<f32>,
}

impl Looker<'_> {
    fn draw(&mut self, photo: &Photo, max_side_px: u32) -> Result<ViewMap, EmbedError> {
        let camera = photo.camera.limited_to(max_side_px);
        let Self { cloud, map, settings, renderer } = self;
        ViewMap::render(renderer, cloud, &map.of, &map.identities, &camera, settings)
            .map_err(|e| EmbedError::Render(photo.name.clone(), e))
    }
}

/// One photo, and what was made of its identities.
struct Eye<'a> {
    rgb: Vec<[f32; 3]>,
    view: ViewMap,
    identities: &'a Identities,
    looked: HashMap<IdentityId, Vec<f32>>,
}

impl Eye<'_> {
    /// Looks at these identities, all together.
    fn look(&mut self, ids: impl Iterator<Item = IdentityId>, encoder: &mut dyn Encoder) -> Result<(), ModelError> {
        let ids: BTreeSet<IdentityId> = ids.collect();
        let tile = |id: &IdentityId| {
            let mask: Mask = self.view.mask(self.identities, *id);
            let own_side = mask.bounds().map_or(0, |b| b.x.len().max(b.y.len()));
            Some((*id, Tile::cut(&self.rgb, &mask, encoder.tile_side_px().unwrap_or(own_side))?))
        };
        let (ids, tiles): (Vec<IdentityId>, Vec<Tile>) = ids.iter().filter_map(tile).unzip();
        self.looked = ids.into_iter().zip(encoder.images(&tiles)?).collect();
        Ok(())
    }

    /// What was made of one of them; `None` if nothing of it is seen.
    fn seen(&self, id: IdentityId) -> Option<Vec<f32>> {
        self.looked.get(&id).cloned()
    }
}

/// How well each identity is seen, by number less one: its pixels, fewer where the picture's edge
/// cuts it off.
fn counts(view: &ViewMap, identities: &Identities) -> Vec<f64> {
    let (w, h) = (view.width_px, view.height_px);
    let mut inside = vec![0_usize; identities.len() + 1];
    let mut at_edge = vec![0_usize; identities.len() + 1];
    for (i, &id) in view.identity.iter().enumerate() {
        if identities.get(id).is_none() {
            continue;
        }
        let (x, y) = (i % w, i / w);
        let edge = x == 0 || y == 0 || x + 1 == w || y + 1 == h;
        for id in identities.line(id) {
            inside[id as usize] += 1;
            at_edge[id as usize] += usize::from(edge);
        }
    }
    let good = |(n, edge): (&usize, &usize)| *n as f64 / (1.0 + 4.0 * *edge as f64 / (*n as f64).sqrt().max(1.0));
    inside.iter().zip(&at_edge).skip(1).map(good).collect()
}

fn to_float(pixels: &PhotoPixels) -> Vec<[f32; 3]> {
    pixels.rgb.iter().map(|rgb| rgb.map(|c| f32::from(c) / 255.0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::NOBODY;

    #[test]
    fn a_whole_counts_its_pieces_and_a_cut_one_counts_less() {
        let mut all = Identities::default();
        let doll = all.add(Level::Object, NOBODY, vec![]);
        let eye = all.add(Level::Part, doll, vec![]);
        let cat = all.add(Level::Object, NOBODY, vec![]);
        let mut identity = vec![NOBODY; 100];
        identity[44] = eye;
        identity[45] = doll;
        identity[0] = cat;
        identity[11] = cat;
        let view = ViewMap { width_px: 10, height_px: 10, identity, share: vec![1.0; 100], alpha: vec![1.0; 100] };
        let c = counts(&view, &all);
        assert_eq!(c[..2], [2.0, 1.0]);
        assert!(c[2] < 1.0, "{c:?}");
    }
}
