//! Language features of identities: an encoder embeds each in the photos that show it best.

use std::collections::{BTreeSet, HashMap};
use std::time::Instant;

use super::error::FindError;
use crate::io;
use crate::math::format::{self, things};
use crate::models::{Encoder, IdentityCrop, ModelError};
use crate::pipeline::observer::{Observer, Severity, Ticker};
use crate::pipeline::semantics::relevancy::deviate;
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::{RenderSettings, Renderer};
use crate::scene::language::MAX_VIEWS;
use crate::scene::{
    GaussianCloud, Identities, IdentityId, LanguageFeatures, Level, Mask, Photo, PhotoPixels, SemanticMap, ViewFeatures,
};

/// Longer side of the photos that tiles are cut from, px.
const MAX_SIDE_PX: u32 = 1_024;
/// Longer side of the views in which visibility is counted, px.
const COUNT_SIDE_PX: u32 = 256;
/// Tiles between two checks for cancellation.
const TILES_AT_ONCE: usize = 8;
/// Least number of pixels in such a view for an identity to be embedded.
pub(super) const LEAST_PX: usize = 12;

/// Embeds every identity of `map` that `encoder` has not embedded yet, in up to [`MAX_VIEWS`] of the `photos`. Parts
/// keep `part_weight` of their own embedding.
pub(crate) fn embed(
    cloud: &GaussianCloud,
    map: &SemanticMap,
    photos: &[Photo],
    settings: &RenderSettings,
    part_weight: f32,
    encoder: &mut dyn Encoder,
    observer: &mut dyn Observer,
) -> Result<LanguageFeatures, FindError> {
    let mut crop_renderer = CropRenderer { cloud, map, settings, renderer: Renderer::new() };
    let mut ticker = Ticker::new("Choosing views of the objects", photos.len());
    let n = map.identities.len();
    let mut seen: Vec<Vec<(f64, usize)>> = vec![Vec::new(); n];
    for (i, photo) in photos.iter().enumerate() {
        let view = crop_renderer.draw(photo, COUNT_SIDE_PX)?;
        for (found, seen) in counts(&view, &map.identities).into_iter().zip(&mut seen) {
            seen.extend((found >= LEAST_PX as f64).then_some((found, i)));
        }
        ticker.tick(i + 1, observer)?;
    }
    let mut wanted: HashMap<usize, Vec<IdentityId>> = HashMap::new();
    let (name, dimension) = (encoder.name().to_owned(), encoder.dimension());
    let before = map.language.as_ref().filter(|l| l.encoder == name && l.dimension == dimension);
    let mut of = before.map_or_else(Vec::new, |l| l.by_identity.clone());
    of.resize(n, ViewFeatures::default());
    for (k, seen) in seen.iter_mut().enumerate().filter(|(k, _)| of[*k].raw.is_empty()) {
        seen.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        seen.iter().take(MAX_VIEWS).for_each(|(_, photo)| wanted.entry(*photo).or_default().push(k as IdentityId + 1));
    }
    let mut order: Vec<usize> = wanted.keys().copied().collect();
    order.sort_unstable();
    let whole_of = |id: IdentityId| {
        let whole = map.identities.object_of(id);
        let is_part = map.identities.get(id).is_some_and(|i| i.level == Level::Part);
        Some(whole).filter(|whole| is_part && *whole != id)
    };
    // Parts are compared with the embedding of their whole in the same photo.
    let shown = |photo: &usize| -> BTreeSet<IdentityId> {
        wanted[photo].iter().flat_map(|id| [Some(*id), whole_of(*id)]).flatten().collect()
    };
    let mut ticker = Ticker::new("Embedding objects and parts", order.iter().map(|photo| shown(photo).len()).sum());
    let (mut done, mut told, start) = (0, false, Instant::now());
    for photo in &order {
        let pixels = io::photo::load(&photos[*photo], MAX_SIDE_PX)?;
        let view = crop_renderer.draw(&photos[*photo], MAX_SIDE_PX)?;
        let mut crops =
            PhotoCrops { rgb: to_float(&pixels), view, identities: &map.identities, looked: HashMap::new() };
        let shown: Vec<IdentityId> = shown(photo).into_iter().collect();
        for ids in shown.chunks(TILES_AT_ONCE) {
            crops.look(ids, encoder)?;
            done += ids.len();
            ticker.tick(done, observer)?;
            // The first tiles include the network's start-up; the time of those after them predicts the total.
            let secs = start.elapsed().as_secs_f64() * ticker.total as f64 / done as f64;
            if !told && done > TILES_AT_ONCE {
                told = true;
                let all = things(ticker.total as usize, "picture");
                let text = format!("{name} looks at {all} of objects and parts: {}", format::about(secs));
                observer.note(Severity::Info, text);
            }
        }
        for &id in &wanted[photo] {
            let Some(raw) = crops.seen(id) else { continue };
            let whole = whole_of(id).and_then(|whole| crops.seen(whole));
            let deviated = whole.and_then(|whole| deviate(&raw, &whole, part_weight)).unwrap_or_else(|| raw.clone());
            let features = &mut of[id as usize - 1];
            features.raw.push(raw);
            features.deviated.push(deviated);
        }
    }
    Ok(LanguageFeatures { encoder: name, dimension, by_identity: of })
}

pub(super) struct CropRenderer<'a> {
    pub(super) cloud: &'a GaussianCloud,
    pub(super) map: &'a SemanticMap,
    pub(super) settings: &'a RenderSettings,
    pub(super) renderer: Renderer,
}

impl CropRenderer<'_> {
    pub(super) fn draw(&mut self, photo: &Photo, max_side_px: u32) -> Result<ViewMap, FindError> {
        let camera = photo.camera.limited_to(max_side_px);
        let Self { cloud, map, settings, renderer } = self;
        ViewMap::render(renderer, cloud, &map.identity_of, &map.identities, &camera, settings)
            .map_err(|e| FindError::Render(photo.name.clone(), e))
    }
}

/// One photo, and the embeddings of its identities.
struct PhotoCrops<'a> {
    rgb: Vec<[f32; 3]>,
    view: ViewMap,
    identities: &'a Identities,
    looked: HashMap<IdentityId, Vec<f32>>,
}

impl PhotoCrops<'_> {
    fn look(&mut self, ids: &[IdentityId], encoder: &mut dyn Encoder) -> Result<(), ModelError> {
        let tile = |id: &IdentityId| {
            let mask: Mask = self.view.mask(self.identities, *id);
            let own_side = mask.bounds().map_or(0, |b| b.x.len().max(b.y.len()));
            Some((*id, IdentityCrop::cut(&self.rgb, &mask, encoder.tile_side_px().unwrap_or(own_side))?))
        };
        let (ids, tiles): (Vec<IdentityId>, Vec<IdentityCrop>) = ids.iter().filter_map(tile).unzip();
        self.looked.extend(ids.into_iter().zip(encoder.images(&tiles)?));
        Ok(())
    }

    /// Embedding of an identity; `None` if none of it is seen.
    fn seen(&self, id: IdentityId) -> Option<Vec<f32>> {
        self.looked.get(&id).cloned()
    }
}

/// Visibility of each identity, by number less one: its pixels, fewer if the picture's edge cuts it off.
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
        for id in identities.ancestors(id) {
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
    use glam::DVec3;

    use super::*;
    use crate::pipeline::observer::Silent;
    use crate::pipeline::observer::testing::StopsAfter;
    use crate::scene::{Camera, NO_IDENTITY, PART_WEIGHT};

    /// Sees whether there is red in a picture, and nothing else.
    struct Reddish {
        side_px: Option<usize>,
        tiles: Vec<usize>,
    }

    impl Encoder for Reddish {
        fn name(&self) -> &str {
            "reddish"
        }

        fn dimension(&self) -> usize {
            2
        }

        fn tile_side_px(&self) -> Option<usize> {
            self.side_px
        }

        fn images(&mut self, tiles: &[IdentityCrop]) -> Result<Vec<Vec<f32>>, ModelError> {
            self.tiles.extend(tiles.iter().map(|t| t.side_px));
            let red = |t: &IdentityCrop| t.rgb.iter().any(|c| c[0] > 0.5);
            Ok(tiles.iter().map(|t| if red(t) { vec![1.0, 0.0] } else { vec![0.0, 1.0] }).collect())
        }

        fn texts(&mut self, phrases: &[&str]) -> Vec<Result<Vec<f32>, ModelError>> {
            phrases.iter().map(|p| Err(ModelError::NoKnownWord { unknown: vec![(*p).into()] })).collect()
        }

        fn unknown_words(&self, _: &str) -> Vec<String> {
            Vec::new()
        }
    }

    /// A doll on the left whose eye is on the right, photographed from six distances. Red is the far end
    /// of the doll alone.
    fn doll(folder: &std::path::Path) -> (GaussianCloud, SemanticMap, Vec<Photo>) {
        let mut all = Identities::default();
        let doll = all.add(Level::Object, NO_IDENTITY, vec![]);
        let eye = all.add(Level::Part, doll, vec![]);
        let nowhere = all.add(Level::Object, NO_IDENTITY, vec![]);
        assert_eq!((doll, eye, nowhere), (1, 2, 3));
        let cloud = GaussianCloud::isotropic(vec![[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]], -1.4, 4.0);
        let photo = |k: usize, eye: DVec3| {
            let camera = Camera::look_at(eye, DVec3::ZERO, DVec3::NEG_Y, 0.8, 96, 64).expect("valid");
            let left = camera.project(DVec3::new(-0.5, 0.0, 0.0)).expect("in front").x;
            let mirrored = left > 48.0;
            let red = |x: u32| if mirrored { f64::from(x) > left } else { f64::from(x) < left };
            let pixel = |x: u32, _: u32| image::Rgb(if red(x) { [255, 0, 0] } else { [0, 0, 255] });
            let path = folder.join(format!("{k}.png"));
            image::RgbImage::from_fn(96, 64, pixel).save(&path).expect("written");
            Photo::new(k.to_string(), path, camera)
        };
        let photos = (0..MAX_VIEWS + 2).map(|k| photo(k, DVec3::new(0.0, 0.0, -3.0 - 0.2 * k as f64))).collect();
        let map = SemanticMap::from_identities(all, vec![doll, eye], vec![1.0; 2], vec![]);
        (cloud, map, photos)
    }

    #[test]
    fn a_part_keeps_most_of_its_own_look_and_takes_some_of_its_wholes() {
        let folder = tempfile::tempdir().expect("a folder");
        let (cloud, map, photos) = doll(folder.path());
        let mut encoder = Reddish { side_px: None, tiles: vec![] };
        let settings = RenderSettings::default();
        let language = embed(&cloud, &map, &photos, &settings, PART_WEIGHT, &mut encoder, &mut Silent).expect("looks");
        assert_eq!((language.encoder.as_str(), language.dimension), ("reddish", 2));
        assert!(language.is_valid(&map.identities));
        let [doll, eye, nowhere] = &language.by_identity[..] else { panic!("{language:?}") };
        // The doll is partly red, its eye is not: 0.3 of the doll and 0.7 of the eye, of unit length.
        let length = 0.3_f32.hypot(0.7);
        assert_eq!((doll.raw.len(), eye.raw.len(), nowhere.raw.len()), (MAX_VIEWS, MAX_VIEWS, 0));
        assert!(doll.raw.iter().chain(&doll.deviated).all(|v| *v == [1.0, 0.0]), "{doll:?}");
        assert!(eye.raw.iter().all(|v| *v == [0.0, 1.0]), "{eye:?}");
        let far = |v: &Vec<f32>| (v[0] - 0.3 / length).abs().max((v[1] - 0.7 / length).abs());
        assert!(eye.deviated.iter().all(|v| far(v) < 1e-6), "{eye:?}");
        // Tiles as large as the visible part, unless the encoder wants them otherwise.
        assert!(encoder.tiles.iter().all(|side| (10..=96).contains(side)), "{:?}", encoder.tiles);
        let mut encoder = Reddish { side_px: Some(7), tiles: vec![] };
        embed(&cloud, &map, &photos, &settings, PART_WEIGHT, &mut encoder, &mut Silent).expect("looks");
        assert_eq!(encoder.tiles, [7; 2 * MAX_VIEWS], "one tile of each identity in each of the best views");
    }

    #[test]
    fn looking_can_be_stopped() {
        let folder = tempfile::tempdir().expect("a folder");
        let (cloud, map, photos) = doll(folder.path());
        let mut encoder = Reddish { side_px: None, tiles: vec![] };
        let stopped = embed(
            &cloud,
            &map,
            &photos,
            &RenderSettings::default(),
            PART_WEIGHT,
            &mut encoder,
            &mut StopsAfter::new(0),
        );
        assert!(matches!(stopped, Err(FindError::Interrupted(_))), "{stopped:?}");
    }

    #[test]
    fn a_whole_counts_its_pieces_and_a_cut_one_counts_less() {
        let mut all = Identities::default();
        let doll = all.add(Level::Object, NO_IDENTITY, vec![]);
        let eye = all.add(Level::Part, doll, vec![]);
        let cat = all.add(Level::Object, NO_IDENTITY, vec![]);
        let mut identity = vec![NO_IDENTITY; 100];
        identity[44] = eye;
        identity[45] = doll;
        identity[0] = cat;
        identity[11] = cat;
        let view = ViewMap::certain(10, identity);
        let c = counts(&view, &all);
        assert_eq!(c[..2], [2.0, 1.0]);
        assert!(c[2] < 1.0, "{c:?}");
    }

    #[test]
    fn every_edge_of_the_picture_cuts() {
        let all = Identities::objects(5);
        // Left, right, upper and lower edge: four pixels each, two of them at the edge; one in the middle.
        let places = [[20, 21, 30, 31], [28, 29, 38, 39], [4, 5, 14, 15], [84, 85, 94, 95], [44, 45, 54, 55]];
        let mut identity = vec![NO_IDENTITY; 100];
        places.iter().enumerate().for_each(|(k, p)| p.iter().for_each(|i| identity[*i] = k as IdentityId + 1));
        let view = ViewMap::certain(10, identity);
        // 4 / (1 + 4 x 2 / sqrt(4)) = 0.8.
        let c = counts(&view, &all);
        assert!(c[..4].iter().all(|c| (c - 0.8).abs() < 1e-12) && c[4] == 4.0, "{c:?}");
    }
}
