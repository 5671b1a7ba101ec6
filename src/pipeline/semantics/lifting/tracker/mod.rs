//! Identities in every view, carried by the trained Gaussians. Masks of a first photo vote, and the votes are
//! rendered into the other views. Photos with too many unknown pixels are segmented too, and their masks linked to
//! known identities. The tree of Gaussians that belong together decides. No network is needed.

mod complete;
mod gone;
mod growth;
mod options;
mod sharpness;
mod tracked;
mod views;

use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::Instant;

pub(crate) use options::TrackOptions;
pub(crate) use tracked::Tracked;
use tracked::{CarrySeconds, CarryStage};
pub(crate) use views::ViewReport;

use super::associate::{Link, conflicts, link};
use super::error::FindError;
use super::floaters::drop_floaters;
use super::kept_views::{KEPT_BYTES, KeptViews};
use super::mirror::guess;
use super::nearest::{NearestGaussians, nearest};
use super::propagate::extend;
use super::removed::RemovedThings;
use super::renderers::Renderers;
use super::sam2_tracker::{LABEL_SIDE_PX, Sam2Tracker};
use super::segmenter::{FoundMask, Segmenter};
use super::splat_tree::hierarchy::Hierarchy;
use super::splat_tree::surface::{NEIGHBORS, SplatSurface};
use super::train_codes::{CODE_SIDE_PX, CodeView};
use super::view_votes::ViewVotes;
use super::votes::{Assignment, LEAST_VOTES, UNKNOWN, Votes};
use crate::math::format::things;
use crate::pipeline::observer::{Observer, Severity, Ticker, begin};
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::{DrawError, RenderSettings, Renderer};
use crate::scene::findings::ConflictKind;
use crate::scene::{GaussianCloud, Identities, IdentityId, NO_IDENTITY, Photo};

/// IoU under which a followed mask and that of the Gaussians contradict each other.
const DRIFT: f64 = 0.2;
/// Least number of pixels of each for a contradiction.
const DRIFT_PX: usize = 30;

/// Least share of unlabeled pixels of a mask that shows something new.
const NEWS: f64 = 0.5;

/// Longer side of the views in which visibility is measured, px.
const SEE_SIDE_PX: u32 = 256;

/// Finds the identities of `cloud` in `photos`. With a `follower`, the first photo's masks are followed to the others
/// and vote there too.
pub(crate) fn track(
    cloud: &GaussianCloud,
    photos: &[Photo],
    settings: &RenderSettings,
    segmenter: &mut dyn Segmenter,
    follower: Option<&mut Sam2Tracker>,
    options: &TrackOptions,
    observer: &mut dyn Observer,
) -> Result<Tracked, FindError> {
    let usable = |i: &usize| segmenter.covers(&photos[*i]);
    let first = match options.seed {
        Some(seed) => Some(seed).filter(|s| *s < photos.len()).filter(usable),
        None => segmenter.first(photos, observer)?,
    };
    let first = first.ok_or(FindError::NoSeed(segmenter.name().to_owned()))?;
    let mut t = Tracker {
        cloud,
        photos,
        settings,
        options,
        renderers: Renderers::new(cloud.len()),
        small: KeptViews::new(photos.len(), KEPT_BYTES),
        removed: options.removed.as_deref().map(|gone| RemovedThings::new(cloud, gone)),
        identities: options.known.as_ref().map_or_else(Identities::default, |map| map.identities.clone()),
        votes: match &options.known {
            Some(map) => Votes::known(map, options.least_seen),
            None => Votes::with_least_seen(cloud.len(), options.least_seen),
        },
        conflicts: Vec::new(),
        masks: Vec::new(),
        told: Vec::new(),
        segment_secs: 0.0,
        secs: CarrySeconds::default(),
    };
    let (start, mut follow_secs, mut encode_secs) = (Instant::now(), 0.0, 0.0);
    t.see(observer)?;
    let (mut seeds, mut tried) = (vec![first], vec![false; photos.len()]);
    let seeded = t.seed(first, segmenter, observer)?;
    tried[first] = true;
    if let (Some(follower), Some((found, ids))) = (follower, seeded) {
        let among = t.worth_following(first, observer)?;
        let start = Instant::now();
        t.follow(follower, (&among, first), (&found, &ids), observer)?;
        encode_secs = follower.encode_secs;
        follow_secs = start.elapsed().as_secs_f64() - encode_secs;
    }
    let mut views = t.look(&t.decided(), observer)?;
    while seeds.len() < options.max_seeds {
        let is_open = |v: &ViewReport| {
            let is_needy = options.keep_masks || v.unknown > options.reseed_share;
            !tried[v.photo] && is_needy && segmenter.covers(&photos[v.photo])
        };
        let Some(next) = t.most_unknown(&mut views, is_open, observer)? else { break };
        tried[next] = true;
        if t.seed(next, segmenter, observer)?.is_some() {
            seeds.push(next);
        }
    }
    t.seed_named(&mut seeds, segmenter, observer)?;
    if seeds.len() > 1 {
        views = t.look(&t.decided(), observer)?;
    }
    let (said, inferred) = (t.votes.clone(), views.iter().map(|v| v.unknown).collect());
    let surface = options.by_tree.then(|| t.surface(observer)).transpose()?;
    let (surface, near) = surface.unzip();
    // The tree is made without any label, so completion goes on beside it. After a stop, no tree is begun.
    let is_over = AtomicBool::new(false);
    let (completed, tree) = rayon::join(
        || {
            let done = if options.by_photos { t.complete(&views, observer) } else { Ok(()) };
            is_over.store(done.is_err(), Relaxed);
            done
        },
        || surface.filter(|_| !is_over.load(Relaxed)).map(|surface| Hierarchy::of(&surface)),
    );
    completed?;
    let begun = Instant::now();
    let mut assignments = match tree {
        Some(tree) => tree.label(&said, &t.votes, &t.identities, LEAST_VOTES),
        None => t.votes.decide(&t.identities, LEAST_VOTES),
    };
    t.secs.add(CarryStage::Group, begun);
    let views = t.look(&identities_of(&assignments), observer)?;
    t.small = KeptViews::new(0, 0);
    if options.by_mirror {
        guess(cloud, &t.identities, &said, &mut assignments, observer)?;
    }
    extend(cloud, near, &mut assignments, options.hidden_steps);
    drop_floaters(cloud, &t.identities, &mut assignments);
    if let Some(map) = &options.known {
        for (i, now) in assignments.iter_mut().enumerate() {
            // Unlabeled Gaussians may become something new, unknown ones anything: one more photo only adds things.
            let is_new = now.identity != UNKNOWN && now.identity as usize > map.identities.len();
            if map.identity_of[i] != NO_IDENTITY || now.identity == NO_IDENTITY || !map.is_unknown(i) && !is_new {
                *now = Assignment { identity: map.identity_of[i], margin: map.margin[i] };
            }
        }
    }
    t.identities.blur_px2 = t.best_blur(&identities_of(&assignments))?;
    let told = ConflictKind::summary(&t.conflicts, |i| photos[i].name.clone(), |id| t.identities.full_name(id));
    told.into_iter().for_each(|text| observer.note(Severity::Warning, text));
    let models = [("segment", t.segment_secs), ("encode frames", encode_secs), ("follow masks", follow_secs)];
    let rest = start.elapsed().as_secs_f64() - models.iter().map(|m| m.1).sum::<f64>() - t.secs.total();
    let secs = models.into_iter().chain(t.secs.named()).chain([("carry by Gaussians", rest)]).collect();
    let Tracker { identities, conflicts, masks, .. } = t;
    Ok(Tracked { identities, assignments, seeds, views, inferred, conflicts, masks, secs })
}

/// Masks of a photo, and their identities.
type Seeded = (Vec<FoundMask>, Vec<IdentityId>);

struct Tracker<'a> {
    cloud: &'a GaussianCloud,
    photos: &'a [Photo],
    settings: &'a RenderSettings,
    options: &'a TrackOptions,
    renderers: Renderers,
    /// Views of [`SEE_SIDE_PX`], which are looked at after every change of labels.
    small: KeptViews,
    removed: Option<RemovedThings>,
    identities: Identities,
    votes: Votes,
    conflicts: Vec<(usize, ConflictKind)>,
    masks: Vec<CodeView>,
    /// Segmented photos, a few, and their labels.
    told: Vec<(usize, Vec<IdentityId>)>,
    segment_secs: f64,
    secs: CarrySeconds,
}

impl Tracker<'_> {
    /// Returns the identity of each Gaussian by the votes so far.
    fn decided(&self) -> Vec<IdentityId> {
        identities_of(&self.votes.decide(&self.identities, LEAST_VOTES))
    }

    /// Measures the visibility of each Gaussian in every photo, before any votes.
    fn see(&mut self, observer: &mut dyn Observer) -> Result<(), FindError> {
        let (start, mut ticker) = (Instant::now(), Ticker::new("Analyzing photos", self.photos.len()));
        let photos: Vec<usize> = (0..self.photos.len()).collect();
        let (cloud, settings, all, small) = (self.cloud, self.settings, self.photos, &self.small);
        let areas = |renderer: &mut Renderer, photo: &usize| {
            let camera = all[*photo].camera.limited_to(SEE_SIDE_PX);
            let mut view = small.watch(renderer.weights(cloud, &camera, settings));
            let areas = ViewVotes::areas_of(&mut view).map_err(|e| undrawn(&all[*photo], e))?;
            small.offer(*photo, view);
            Ok(areas)
        };
        let votes = &mut self.votes;
        self.renderers.each(&photos, areas, |photo, areas| {
            votes.note(&areas);
            Ok(ticker.tick(photo + 1, observer)?)
        })?;
        self.secs.add(CarryStage::See, start);
        Ok(())
    }

    /// Returns the surface of the Gaussians, and the nearest ones of each.
    fn surface(&mut self, observer: &mut dyn Observer) -> Result<(SplatSurface, NearestGaussians), FindError> {
        let start = Instant::now();
        begin("Grouping Gaussians", observer)?;
        let cameras: Vec<_> = self.photos.iter().map(|p| p.camera.clone()).collect();
        let near = nearest(self.cloud, NEIGHBORS);
        let surface = SplatSurface::new(&mut self.renderers, self.cloud, &near, &cameras, self.settings, observer)?;
        self.secs.add(CarryStage::Group, start);
        Ok((surface, near))
    }

    /// Segments a photo, links its masks to known identities, and lets them vote. Returns the masks and their
    /// identities; `None` if there are no masks.
    fn seed(
        &mut self,
        photo: usize,
        segmenter: &mut dyn Segmenter,
        observer: &mut dyn Observer,
    ) -> Result<Option<Seeded>, FindError> {
        let start = Instant::now();
        let name = &self.photos[photo].name;
        begin(format!("Finding masks in {name}"), observer)?;
        let found = segmenter.segment(&self.photos[photo], self.options.max_side_px, observer);
        self.segment_secs += start.elapsed().as_secs_f64();
        let (found, gone) = gone::masks_left(self, photo, found?)?;
        if found.is_empty() {
            return Ok(None);
        }
        begin(format!("Comparing the {} of {name} with what is known", things(found.len(), "mask")), observer)?;
        let known = if self.identities.is_empty() { None } else { Some(self.map(photo, self.options.max_side_px)?) };
        let links = link(&found, known.as_ref(), &self.identities);
        let stays = known.as_ref().filter(|_| self.options.known.is_some());
        // A mask of known pixels makes no new identity.
        let is_free = |id: IdentityId| id == UNKNOWN || id == NO_IDENTITY;
        let is_old = |mask: &FoundMask| {
            let new = |map: &ViewMap| mask.mask.pixels().filter(|i| is_free(map.identity[*i])).count();
            stays.is_some_and(|map| (new(map) as f64) < NEWS * mask.mask.area() as f64)
        };
        if let Some(known) = &known {
            let told = conflicts(&found, &links, known, &self.identities);
            for what in told.into_iter().filter(|d| stays.is_none() || !matches!(d, ConflictKind::Split(_))) {
                self.conflicts.push((photo, what));
            }
        }
        let mut ids = Vec::with_capacity(found.len());
        for (mask, link) in found.iter().zip(&links) {
            let parent = mask.parent.map_or(NO_IDENTITY, |p| ids[p]);
            ids.push(match link {
                Link::Known(id) => *id,
                _ if parent == UNKNOWN || is_old(mask) => UNKNOWN,
                Link::New | Link::Split(_) => {
                    self.identities.add(mask.level, parent, mask.name.iter().cloned().collect())
                }
            });
        }
        let camera = self.photos[photo].camera.limited_to(self.options.max_side_px);
        let mut labels = labels_of(&found, &ids, camera.width_px as usize * camera.height_px as usize);
        if let Some(map) = stays {
            let known = labels.iter_mut().zip(&map.identity).filter(|(_, known)| !is_free(**known));
            known.for_each(|(label, _)| *label = UNKNOWN);
        }
        gone::forget(&mut labels, gone.as_ref());
        self.votes
            .add_view(self.renderers.one(), self.cloud, &camera, self.settings, &labels)
            .map_err(|e| undrawn(&self.photos[photo], e))?;
        self.keep(photo, (camera.width_px, camera.height_px), &labels);
        self.tell(photo, labels);
        Ok(Some((found, ids)))
    }

    /// Returns the photos through which masks of `seed` are followed, in their order: those that it does not explain
    /// by itself, or all if codes are trained on the followed masks.
    fn worth_following(&mut self, seed: usize, observer: &mut dyn Observer) -> Result<Vec<usize>, FindError> {
        let all = self.photos.len();
        if self.options.keep_masks {
            return Ok((0..all).collect());
        }
        let views = self.look(&self.decided(), observer)?;
        let open = views.iter().filter(|v| v.photo == seed || v.unknown > self.options.reseed_share);
        let mut among: Vec<usize> = open.map(|v| v.photo).collect();
        among.sort_unstable();
        if among.len() < all {
            let text =
                format!("Masks are followed through {} of {all} photos; the Gaussians explain the rest", among.len());
            observer.note(Severity::Info, text);
        }
        Ok(among)
    }

    /// Follows the masks of the photo `seed` through the photos `among`, and lets them vote there.
    fn follow(
        &mut self,
        follower: &mut Sam2Tracker,
        (among, seed): (&[usize], usize),
        seeded: (&[FoundMask], &[IdentityId]),
        observer: &mut dyn Observer,
    ) -> Result<(), FindError> {
        let photos: Vec<Photo> = among.iter().map(|i| self.photos[*i].clone()).collect();
        let first = among.iter().position(|i| *i == seed).unwrap_or_default();
        let followed = follower.follow(&photos, first, seeded, self.options.prompt, observer)?;
        // Labels from the seed alone, so that the follower's labels do not take part in their own check.
        let of = self.decided();
        for (&photo, mut labels) in among.iter().zip(followed).filter(|(photo, _)| **photo != seed) {
            if self.options.veto {
                let known = self.map_of(photo, LABEL_SIDE_PX, &of)?;
                for id in contradicted(&labels, &known.identity, self.identities.len()) {
                    labels.iter_mut().filter(|l| **l == id).for_each(|l| *l = UNKNOWN);
                    self.conflicts.push((photo, ConflictKind::Drift(id)));
                }
            }
            let camera = self.photos[photo].camera.limited_to(LABEL_SIDE_PX);
            let shown = gone::pixels(self.renderers.one(), self.removed.as_ref(), &camera, self.settings);
            gone::forget(&mut labels, shown.map_err(|e| undrawn(&self.photos[photo], e))?.as_ref());
            self.votes
                .add_view(self.renderers.one(), self.cloud, &camera, self.settings, &labels)
                .map_err(|e| undrawn(&self.photos[photo], e))?;
            self.keep(photo, (camera.width_px, camera.height_px), &labels);
        }
        Ok(())
    }

    /// Keeps the labels of a photo, of this width and height, for the training of codes.
    fn keep(&mut self, photo: usize, (w, h): (u32, u32), labels: &[IdentityId]) {
        if !self.options.keep_masks {
            return;
        }
        let camera = self.photos[photo].camera.limited_to(CODE_SIDE_PX);
        let (cw, ch) = (camera.width_px, camera.height_px);
        let at = |i: u32| {
            let (x, y) = ((i % cw * 2 + 1) * w / (2 * cw), (i / cw * 2 + 1) * h / (2 * ch));
            labels[(y * w + x) as usize]
        };
        self.masks.push(CodeView { labels: (0..cw * ch).map(at).collect(), camera });
    }

    /// Renders the identities known so far into a view.
    fn map(&mut self, photo: usize, max_side_px: u32) -> Result<ViewMap, FindError> {
        let of = self.decided();
        self.map_of(photo, max_side_px, &of)
    }

    fn map_of(&mut self, photo: usize, max_side_px: u32, of: &[IdentityId]) -> Result<ViewMap, FindError> {
        let photo = &self.photos[photo];
        let camera = photo.camera.limited_to(max_side_px);
        ViewMap::of(&mut self.renderers.one().weights(self.cloud, &camera, self.settings), of, &self.identities)
            .map_err(|e| undrawn(photo, e))
    }
}

/// Error of a photo's view that could not be drawn.
fn undrawn(photo: &Photo, e: impl Into<DrawError>) -> FindError {
    FindError::Render(photo.name.clone(), e.into())
}

fn identities_of(assignments: &[Assignment]) -> Vec<IdentityId> {
    assignments.iter().map(|a| a.identity).collect()
}

/// Returns the identities that two label maps of one view put in different places: both show them, and they hardly
/// overlap.
fn contradicted(followed: &[IdentityId], known: &[IdentityId], identities: usize) -> Vec<IdentityId> {
    let mut counts = vec![[0_usize; 3]; identities + 1];
    for (&a, &b) in followed.iter().zip(known) {
        for (at, id) in [(0, a), (1, b)] {
            if let Some(count) = counts.get_mut(id as usize) {
                count[at] += 1;
                count[2] += usize::from(a == b && at == 0);
            }
        }
    }
    let apart =
        |c: &[usize; 3]| c[0] >= DRIFT_PX && c[1] >= DRIFT_PX && (c[2] as f64) < DRIFT * (c[0] + c[1] - c[2]) as f64;
    (1..counts.len()).filter(|id| apart(&counts[*id])).map(|id| id as IdentityId).collect()
}

/// Returns the innermost identity of each pixel of a segmented photo; `NO_IDENTITY` without a mask.
pub(crate) fn labels_of(found: &[FoundMask], ids: &[IdentityId], pixels: usize) -> Vec<IdentityId> {
    let mut labels = vec![NO_IDENTITY; pixels];
    // Wholes come before pieces, so the innermost is painted last.
    for (mask, id) in found.iter().zip(ids) {
        mask.mask.pixels().for_each(|i| labels[i] = *id);
    }
    labels
}

#[cfg(test)]
mod tests;
