//! Identities seen in each photo, and its share of unknown pixels.

use std::time::Instant;

use super::super::error::FindError;
use super::super::segmenter::Segmenter;
use super::{CarryStage, SEE_SIDE_PX, Tracker, undrawn};
use crate::pipeline::observer::{Observer, Ticker};
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::Renderer;
use crate::scene::IdentityId;

#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub(crate) struct Sighting {
    /// Identity of the pixels.
    pub(crate) identity: IdentityId,
    pub(crate) pixels: usize,
    /// Mean share of its object in them, 0 to 1.
    pub(crate) confidence: f64,
}

#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub(crate) struct ViewReport {
    pub(crate) photo: usize,
    /// Share of its pixels that only Gaussians without a vote cover.
    pub(crate) unknown: f64,
    /// Identities seen in it, innermost ones.
    pub(crate) seen: Vec<Sighting>,
}

impl Tracker<'_> {
    /// Reports the identities seen in each photo, by the identity of each Gaussian.
    pub(super) fn look(
        &mut self,
        of: &[IdentityId],
        observer: &mut dyn Observer,
    ) -> Result<Vec<ViewReport>, FindError> {
        let mut ticker = Ticker::new("Checking labels", self.photos.len());
        observer.proceed()?;
        let photos: Vec<usize> = (0..self.photos.len()).collect();
        let mut views = Vec::with_capacity(photos.len());
        self.look_at(&photos, of, |view| {
            views.push(view);
            Ok(ticker.tick(views.len(), observer)?)
        })?;
        Ok(views)
    }

    /// Looks at some of the photos, and hands on their reports in this order.
    fn look_at(
        &mut self,
        photos: &[usize],
        of: &[IdentityId],
        mut then: impl FnMut(ViewReport) -> Result<(), FindError>,
    ) -> Result<(), FindError> {
        let start = Instant::now();
        let (cloud, settings, all) = (self.cloud, self.settings, self.photos);
        let (small, identities) = (&self.small, &self.identities);
        // A small picture suffices to measure the unknown share.
        let side_px = self.options.max_side_px.min(SEE_SIDE_PX);
        let look = |renderer: &mut Renderer, photo: &usize| {
            let camera = all[*photo].camera.limited_to(side_px);
            let mut view = small.weights(*photo, renderer, cloud, &camera, settings);
            let map = ViewMap::of(&mut view, of, identities).map_err(|e| undrawn(&all[*photo], e))?;
            Ok(report(*photo, &map, identities.len()))
        };
        self.renderers.each(photos, look, |_, view| then(view))?;
        self.secs.add(CarryStage::Look, start);
        Ok(())
    }

    /// Segments the photos with user-given names that are not found yet. If another photo marks such a thing as
    /// unlabeled, its pixels do not count as unknown.
    pub(super) fn seed_named(
        &mut self,
        seeds: &mut Vec<usize>,
        segmenter: &mut dyn Segmenter,
        observer: &mut dyn Observer,
    ) -> Result<(), FindError> {
        let photos = self.photos;
        for (i, photo) in photos.iter().enumerate() {
            if seeds.len() >= self.options.max_seeds {
                break;
            }
            if seeds.contains(&i) || !segmenter.covers(photo) {
                continue;
            }
            let names = segmenter.names(photo)?;
            let is_known = |name: &String| self.identities.iter().any(|(_, identity)| identity.names.contains(name));
            if !names.iter().all(is_known) && self.seed(i, segmenter, observer)?.is_some() {
                seeds.push(i);
            }
        }
        Ok(())
    }

    /// Returns the photo with most unknown pixels among the open views. Masks make pixels known, hardly ever unknown.
    /// So a view that was better known before than another one is now need not be rendered again.
    pub(super) fn most_unknown(
        &mut self,
        views: &mut [ViewReport],
        is_open: impl Fn(&ViewReport) -> bool,
        observer: &mut dyn Observer,
    ) -> Result<Option<usize>, FindError> {
        let of = self.decided();
        let mut fresh = vec![false; views.len()];
        let open = views.iter().filter(|v| is_open(v)).count();
        let mut ticker = Ticker::new("Looking where most is still unknown", open);
        for looked in 0.. {
            let open = views.iter().enumerate().filter(|(_, v)| is_open(v));
            let Some((i, _)) = open.max_by(|a, b| a.1.unknown.total_cmp(&b.1.unknown)) else { return Ok(None) };
            if fresh[i] {
                return Ok(Some(views[i].photo));
            }
            self.look_at(&[views[i].photo], &of, |view| {
                views[i] = view;
                Ok(())
            })?;
            fresh[i] = true;
            ticker.tick(looked + 1, observer)?;
        }
        Ok(None)
    }
}

pub(super) fn report(photo: usize, map: &ViewMap, identities: usize) -> ViewReport {
    let mut sums = vec![(0, 0.0); identities + 1];
    let mut unknown = 0;
    for (&id, &share) in map.identity.iter().zip(&map.share) {
        match sums.get_mut(id as usize) {
            Some(sum) => *sum = (sum.0 + 1, sum.1 + f64::from(share)),
            None => unknown += 1,
        }
    }
    let seen = sums.iter().enumerate().skip(1).filter(|(_, s)| s.0 > 0);
    ViewReport {
        photo,
        unknown: f64::from(unknown) / map.identity.len().max(1) as f64,
        seen: seen
            .map(|(id, s)| Sighting { identity: id as IdentityId, pixels: s.0, confidence: s.1 / s.0 as f64 })
            .collect(),
    }
}
