//! Photos as evidence: known labels of a view, rendered into its photo, grow over unknown pixels ([`super::growth`]) up to the
//! borders in the photo or in the shape of the scene.

use std::time::Instant;

use super::super::error::FindError;
use super::super::kept_views::{KEPT_BYTES, KeptViews};
use super::super::regions::shape::ends_of;
use super::super::removed::RemovedThings;
use super::super::view_votes::ViewVotes;
use super::super::votes::UNKNOWN;
use super::growth::{ColorCounts, GrowOptions, GrowthGrid, grow};
use super::{CarryStage, Tracker, ViewReport, gone, undrawn};
use crate::io::{self, IoError};
use crate::pipeline::observer::{Observer, Severity, Ticker};
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::{RenderSettings, Renderer};
use crate::scene::{GaussianCloud, Identities, IdentityId, Photo};

/// Longer side of the photos, px.
const SIDE_PX: u32 = 320;

impl Tracker<'_> {
    /// Completes the labels in the photos, those with most known pixels first; each completed photo helps the next.
    pub(super) fn complete(&mut self, views: &[ViewReport], observer: &mut dyn Observer) -> Result<(), FindError> {
        let (options, start) = (GrowOptions::default(), Instant::now());
        let mut order: Vec<&ViewReport> = views.iter().filter(|v| v.unknown > 0.0).collect();
        order.sort_by(|a, b| a.unknown.total_cmp(&b.unknown).then(a.photo.cmp(&b.photo)));
        let mut ticker = Ticker::new("Completing identities in the photos", 2 * order.len());
        let mut counts = ColorCounts::new(self.identities.len());
        let mut terrains = Vec::with_capacity(order.len());
        let (mut of, photos, mut done) = (self.decided(), self.photos, 0);
        let kept = KeptViews::new(photos.len(), KEPT_BYTES.saturating_sub(self.small.bytes()));
        let known = KnownPixels {
            cloud: self.cloud,
            settings: self.settings,
            removed: self.removed.as_ref(),
            identities: &self.identities,
            of: &of,
            options: &options,
            kept: &kept,
        };
        let read = |renderer: &mut Renderer, view: &&ViewReport| known.read(renderer, view.photo, &photos[view.photo]);
        self.renderers.each(&order, read, |view, read| {
            match read {
                Ok((grid, known)) => {
                    counts.add(&grid, &known);
                    terrains.push((view.photo, grid));
                }
                Err(e) => observer.note(Severity::Warning, format!("Nothing is completed in a photo: {e}")),
            }
            done += 1;
            Ok(ticker.tick(done, observer)?)
        })?;
        let colors = counts.compare(options.unseen);
        self.secs.add(CarryStage::Read, start);
        let start = Instant::now();
        for (i, (photo, grid)) in terrains.iter().enumerate() {
            let (place, photo, renderer) = (*photo, &photos[*photo], self.renderers.one());
            let camera = photo.camera.limited_to(SIDE_PX);
            let gone = gone::pixels(renderer, self.removed.as_ref(), &camera, self.settings);
            let gone = gone.map_err(|e| undrawn(photo, e))?;
            let mut view = kept.weights(place, renderer, self.cloud, &camera, self.settings);
            let map = ViewMap::of(&mut view, &of, &self.identities).map_err(|e| undrawn(photo, e))?;
            let known = sure(&map, options.share);
            let mut labels = grow(grid, &known, &colors, &options);
            // Known pixels come from earlier votes, so only the grown ones vote.
            labels.iter_mut().zip(&known).filter(|(_, k)| **k != UNKNOWN).for_each(|(l, _)| *l = UNKNOWN);
            gone::forget(&mut labels, gone.as_ref());
            // Without new votes the next photo is labeled like this one.
            if labels.iter().any(|label| *label != UNKNOWN) {
                let votes = ViewVotes::of(&mut view, &labels).map_err(|e| undrawn(photo, e))?;
                self.votes.add(&votes).map_err(|e| undrawn(photo, e))?;
                of = self.decided();
            }
            ticker.tick(order.len() + i + 1, observer)?;
        }
        self.secs.add(CarryStage::Grow, start);
        Ok(())
    }
}

/// Scene whose known labels are read into its photos.
struct KnownPixels<'a> {
    cloud: &'a GaussianCloud,
    settings: &'a RenderSettings,
    removed: Option<&'a RemovedThings>,
    identities: &'a Identities,
    /// Identity of each Gaussian.
    of: &'a [IdentityId],
    options: &'a GrowOptions,
    kept: &'a KeptViews,
}

impl KnownPixels<'_> {
    /// Returns the terrain of the photo at `place` and its known pixels; an error inside if the photo cannot be read.
    fn read(
        &self,
        renderer: &mut Renderer,
        place: usize,
        photo: &Photo,
    ) -> Result<Result<(GrowthGrid, Vec<IdentityId>), IoError>, FindError> {
        let pixels = match io::photo::load(photo, SIDE_PX) {
            Ok(pixels) => pixels,
            Err(e) => return Ok(Err(e)),
        };
        let (cloud, settings, camera) = (self.cloud, self.settings, photo.camera.limited_to(SIDE_PX));
        let ends = ends_of(renderer, cloud, settings, &camera);
        let grid = GrowthGrid::new(pixels.width_px as usize, &pixels.rgb, ends.as_deref(), self.options);
        let view = match ends {
            Some(_) => renderer.weights_of_picture(cloud, &camera, settings),
            None => renderer.weights(cloud, &camera, settings),
        };
        let mut view = self.kept.watch(view);
        let map = ViewMap::of(&mut view, self.of, self.identities).map_err(|e| undrawn(photo, e))?;
        self.kept.offer(place, view);
        let mut known = sure(&map, self.options.share);
        let gone = gone::pixels(renderer, self.removed, &camera, settings).map_err(|e| undrawn(photo, e))?;
        gone::forget(&mut known, gone.as_ref());
        Ok(Ok((grid, known)))
    }
}

/// Returns the certain labels of a view; `UNKNOWN` elsewhere.
fn sure(map: &ViewMap, share: f32) -> Vec<IdentityId> {
    let sure = |i: usize| map.alpha[i] >= 0.5 && map.share[i] >= share;
    (0..map.identity.len()).map(|i| if sure(i) { map.identity[i] } else { UNKNOWN }).collect()
}
