//! Closed-form lifting: every Gaussian takes the weighted vote of the pixels it contributed to
//! (weight = alpha x transmittance), which gives its identity at all levels in one pass.

use rayon::prelude::*;

use super::view_votes::ViewVotes;
use crate::math::finite::{CHECKED, all_finite};
use crate::render::{self, RenderError, RenderSettings, Renderer};
use crate::scene::{Camera, GaussianCloud, Identities, IdentityId, NO_IDENTITY, SemanticMap};

/// Label of an unknown pixel.
pub(crate) const UNKNOWN: IdentityId = render::UNKNOWN;

/// Most identities with votes per Gaussian.
const KEPT: usize = 8;

/// Votes of pixels for the identities of Gaussians.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Votes {
    /// Per Gaussian: identity and weight in px, any order, each identity once.
    by_gaussian: Vec<Vec<(IdentityId, f32)>>,
    /// Per Gaussian: its largest area in any view.
    best: Vec<f32>,
    /// Least share of its largest area for a Gaussian to be voted on in a view.
    least_seen: f32,
}

/// Votes of a Gaussian with a known identity, and of one known to be unlabeled, px: any mask outweighs the latter.
const KNOWN: f32 = 10.0;
const KNOWN_NOBODY: f32 = 0.1;

/// Largest factor for the votes of small pieces.
const MOST_GAIN: f64 = 3.0;

/// Least votes for a Gaussian to be decided, px.
pub(crate) const LEAST_VOTES: f32 = 0.05;
/// Default least share of its largest area for a Gaussian to be voted on in a view.
pub(crate) const LEAST_SEEN: f32 = 0.1;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Assignment {
    /// Innermost identity; `NO_IDENTITY` if unlabeled, `UNKNOWN` without a vote.
    pub(crate) identity: IdentityId,
    /// Share of votes for that identity's object minus the share of the runner-up; 0 without a vote.
    pub(crate) margin: f32,
}

impl Votes {
    /// Creates empty votes for `n` Gaussians.
    pub(crate) fn new(n: usize) -> Self {
        Self::with_least_seen(n, LEAST_SEEN)
    }

    pub(crate) fn with_least_seen(n: usize, least_seen: f32) -> Self {
        Self { by_gaussian: vec![Vec::new(); n], best: vec![0.0; n], least_seen }
    }

    /// Creates one vote for each Gaussian that is not unknown.
    pub(crate) fn known(map: &SemanticMap, least_seen: f32) -> Self {
        let mut votes = Self::with_least_seen(map.identity_of.len(), least_seen);
        let known = (0..map.identity_of.len()).filter(|i| !map.is_unknown(*i));
        let weight = |id: IdentityId| if id == NO_IDENTITY { KNOWN_NOBODY } else { KNOWN };
        known.for_each(|i| votes.by_gaussian[i].push((map.identity_of[i], weight(map.identity_of[i]))));
        votes
    }

    /// Votes for Gaussian `i`: identity and weight, px.
    pub(crate) fn of(&self, i: usize) -> &[(IdentityId, f32)] {
        &self.by_gaussian[i]
    }

    /// Weight of all votes for Gaussian `i`, px.
    pub(crate) fn weight(&self, i: usize) -> f32 {
        self.by_gaussian[i].iter().map(|v| v.1).sum()
    }

    /// Records the area of each Gaussian in a view. If a Gaussian is seen much worse in a view than elsewhere, it is
    /// occluded there, and the photo's labels do not apply to it.
    pub(crate) fn note(&mut self, areas: &[f32]) {
        self.best.iter_mut().zip(areas).for_each(|(best, area)| *best = best.max(*area));
    }

    /// Draws a view, and records the areas in it.
    pub(crate) fn see(
        &mut self,
        renderer: &mut Renderer,
        cloud: &GaussianCloud,
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Result<(), RenderError> {
        self.note(&ViewVotes::areas_of(&mut renderer.weights(cloud, camera, settings))?);
        Ok(())
    }

    /// Draws a view, and adds its votes. `labels` holds the innermost identity of each pixel, row-major.
    pub(crate) fn add_view(
        &mut self,
        renderer: &mut Renderer,
        cloud: &GaussianCloud,
        camera: &Camera,
        settings: &RenderSettings,
        labels: &[IdentityId],
    ) -> Result<(), RenderError> {
        self.add(&ViewVotes::of(&mut renderer.weights(cloud, camera, settings), labels)?)
    }

    /// Adds the votes of one view.
    pub(crate) fn add(&mut self, view: &ViewVotes) -> Result<(), RenderError> {
        for (gaussian, identity, weight) in view.all().filter(|f| f.1 != UNKNOWN) {
            let g = gaussian as usize;
            if view.areas[g] >= self.least_seen * self.best[g] {
                add(&mut self.by_gaussian[g], identity, weight);
            }
        }
        if CHECKED {
            let weights = self.by_gaussian.iter().flatten().map(|v| &v.1);
            all_finite("voting", "vote", weights)?;
        }
        Ok(())
    }

    /// Decides the identity of each Gaussian: the object with most votes, then the innermost identity in it with
    /// most, of small pieces by their [gain](Self::gains). Gaussians with less than `least` px of votes count as
    /// unseen.
    pub(crate) fn decide(&self, identities: &Identities, least: f32) -> Vec<Assignment> {
        let objects: Vec<IdentityId> = (0..=identities.len() as IdentityId).map(|i| identities.object_of(i)).collect();
        let by = |gains: &[f32]| -> Vec<Assignment> {
            self.by_gaussian.par_iter().map(|votes| decide(votes, &objects, gains, least)).collect()
        };
        let mut decided = by(&vec![1.0; objects.len()]);
        let gains = self.gains(&decided, &objects);
        // Where there is no choice, gains change nothing.
        let contested = decided.par_iter_mut().zip(&self.by_gaussian).filter(|(_, votes)| votes.len() > 1);
        contested.for_each(|(now, votes)| *now = decide(votes, &objects, &gains, least));
        decided
    }

    /// Factors for the votes of each identity against others of its object, from the `plain` decisions.
    ///
    /// Plain votes erode small pieces: a Gaussian over a border goes to the larger side. The mean IoU is largest if it
    /// goes to a piece from a share of J / (1 + J) of the votes on, for the IoU J of the piece (Lipton et al. 2014,
    /// Optimal Thresholding of Classifiers to Maximize F1 Measure): a factor of 1 / J. The pixels of several Gaussians
    /// are decided in the same way once more, so it is 1 / J^2.
    fn gains(&self, plain: &[Assignment], objects: &[IdentityId]) -> Vec<f32> {
        // By identity: votes given to it, all votes of those Gaussians in the object, and its own votes in the object.
        let mut sums = vec![[0.0_f64; 3]; objects.len()];
        for (votes, now) in self.by_gaussian.iter().zip(plain) {
            let Some(object) = objects.get(now.identity as usize) else { continue };
            for &(id, weight) in votes.iter().filter(|v| objects.get(v.0 as usize) == Some(object)) {
                let weight = f64::from(weight);
                sums[now.identity as usize][1] += weight;
                sums[id as usize][2] += weight;
                if id == now.identity {
                    sums[id as usize][0] += weight;
                }
            }
        }
        let gain = |[right, taken, own]: [f64; 3]| {
            let iou = right / (taken + own - right);
            if iou > 0.0 { (1.0 / iou.powi(2)).min(MOST_GAIN) as f32 } else { 1.0 }
        };
        sums.into_iter().map(gain).collect()
    }
}

fn add(votes: &mut Vec<(IdentityId, f32)>, identity: IdentityId, weight: f32) {
    if let Some(v) = votes.iter_mut().find(|v| v.0 == identity) {
        v.1 += weight;
    } else if votes.len() < KEPT {
        votes.push((identity, weight));
    } else if let Some(least) = votes.iter_mut().min_by(|a, b| a.1.total_cmp(&b.1)).filter(|v| v.1 < weight) {
        *least = (identity, weight);
    }
}

fn decide(votes: &[(IdentityId, f32)], objects: &[IdentityId], gains: &[f32], least: f32) -> Assignment {
    let total: f32 = votes.iter().map(|v| v.1).sum();
    if !(total > 0.0 && total >= least) {
        return Assignment { identity: UNKNOWN, margin: 0.0 };
    }
    if let [(identity, _)] = *votes {
        return Assignment { identity, margin: 1.0 };
    }
    let object_of = |id: IdentityId| objects.get(id as usize).copied().unwrap_or(NO_IDENTITY);
    // Objects are at most as many as the identities that are kept.
    let (mut sums, mut count) = ([(NO_IDENTITY, 0.0_f32); KEPT], 0);
    for &(id, weight) in votes {
        let object = object_of(id);
        match sums[..count].iter_mut().find(|s| s.0 == object) {
            Some(s) => s.1 += weight,
            None => {
                sums[count] = (object, weight);
                count += 1;
            }
        }
    }
    let sums = &mut sums[..count];
    sums.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let object = sums[0].0;
    let gained = |v: &(IdentityId, f32)| v.1 * gains.get(v.0 as usize).unwrap_or(&1.0);
    let inner = votes.iter().filter(|v| object_of(v.0) == object);
    let identity = inner.max_by(|a, b| gained(a).total_cmp(&gained(b)).then(b.0.cmp(&a.0))).map_or(object, |v| v.0);
    let second = sums.get(1).map_or(0.0, |s| s.1);
    Assignment { identity, margin: (sums[0].1 - second) / total }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::Level;

    #[test]
    fn objects_win_together_before_their_pieces_compete() {
        let mut all = Identities::default();
        let doll = all.add(Level::Object, NO_IDENTITY, vec![]);
        let cat = all.add(Level::Object, NO_IDENTITY, vec![]);
        let (eye, ear) = (all.add(Level::Part, doll, vec![]), all.add(Level::Part, doll, vec![]));
        let votes = Votes {
            by_gaussian: vec![
                vec![(eye, 2.0), (ear, 3.0), (cat, 4.0)],
                vec![(NO_IDENTITY, 1.0)],
                vec![],
                vec![(cat, 0.01)],
            ],
            ..Votes::default()
        };
        let b = votes.decide(&all, 0.05);
        assert_eq!(b[0].identity, ear);
        assert!((b[0].margin - 1.0 / 9.0).abs() < 1e-6);
        assert_eq!((b[1].identity, b[2].identity, b[3].identity), (NO_IDENTITY, UNKNOWN, UNKNOWN));
    }

    #[test]
    fn small_pieces_keep_their_borders() {
        let mut all = Identities::default();
        let pad = all.add(Level::Object, NO_IDENTITY, vec![]);
        let (body, button) = (all.add(Level::Part, pad, vec![]), all.add(Level::Part, pad, vec![]));
        let sure = |id| vec![(id, 1.0)];
        // Two Gaussians of the button are its own, and two lie over its border.
        let rim = vec![(body, 0.55), (button, 0.45)];
        let mut by_gaussian = vec![sure(button), sure(button), rim.clone(), rim];
        let most = vec![(body, 0.8), (button, 0.2)];
        by_gaussian.push(most.clone());
        by_gaussian.extend((0..40).map(|_| sure(body)));
        let decided = |by_gaussian: &[Vec<(IdentityId, f32)>]| {
            let votes = Votes { by_gaussian: by_gaussian.to_vec(), ..Votes::default() };
            votes.decide(&all, 0.05).iter().map(|a| a.identity).collect::<Vec<_>>()
        };
        assert_eq!(decided(&by_gaussian)[..6], [button, button, button, button, body, body]);
        // The control: among things of one size, most votes win.
        by_gaussian.extend((0..40).map(|_| sure(button)));
        assert_eq!(decided(&by_gaussian)[..6], [button, button, body, body, body, body]);
        // Objects do not gain, and the gain has a limit.
        let other = all.add(Level::Object, NO_IDENTITY, vec![]);
        let votes = Votes { by_gaussian: vec![vec![(other, 0.4), (body, 0.6)], most], ..Votes::default() };
        let gains = votes.gains(&votes.decide(&all, 0.05), &[NO_IDENTITY, pad, pad, pad, other]);
        assert_eq!((gains[other as usize], gains[button as usize]), (1.0, 1.0), "never decided");
        assert!(gains.iter().all(|g| (1.0..=MOST_GAIN as f32).contains(g)), "{gains:?}");
    }

    #[test]
    fn pixels_vote_for_what_they_show() {
        // Two Gaussians side by side, labeled left and right; the middle columns say nothing.
        let cloud = GaussianCloud::isotropic(vec![[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]], -2.0, 2.0);
        let camera =
            Camera::look_at(DVec3::new(0.0, 0.0, -3.0), DVec3::ZERO, DVec3::NEG_Y, 0.6, 45, 33).expect("valid");
        let labels: Vec<IdentityId> = (0..45 * 33).map(|i| [1, UNKNOWN, 2][(i % 45) / 15]).collect();
        let mut votes = Votes::new(2);
        let mut renderer = Renderer::new();
        votes.add_view(&mut renderer, &cloud, &camera, &RenderSettings::default(), &labels).expect("drawn");
        let all = Identities::objects(2);
        let left = camera.project(DVec3::new(-0.5, 0.0, 0.0)).map(|p| p.x).expect("in front");
        let expected = if left < 22.0 { [1, 2] } else { [2, 1] };
        let b = votes.decide(&all, 0.0);
        assert_eq!([b[0].identity, b[1].identity], expected);
        assert!(b[0].margin > 0.9);
        // The votes of a Gaussian are its share of the pixels that have a label.
        let frame =
            renderer.render(&cloud, crate::render::Features::NONE, &camera, &RenderSettings::default()).expect("drawn");
        let known: f32 = frame.alpha.iter().zip(&labels).filter(|(_, l)| **l != UNKNOWN).map(|(a, _)| a).sum();
        let voted = votes.weight(0) + votes.weight(1);
        assert!((voted - known).abs() < 1e-3 * known, "{voted} {known}");
    }

    #[test]
    fn what_is_behind_something_in_a_photo_is_not_voted_on_there() {
        // An opaque disc before a wall's Gaussian; from the side both are seen.
        let mut cloud = GaussianCloud::isotropic(vec![[0.0, 0.0, 0.0], [0.0, 0.0, 2.0]], -1.0, 8.0);
        cloud.log_scales = vec![[0.2; 3], [-1.5; 3]];
        let from = |x: f64, z: f64| Camera::look_at(DVec3::new(x, 0.0, z), DVec3::Z, DVec3::NEG_Y, 0.9, 64, 48);
        let [front, side] = [from(0.0, -4.0), from(6.0, 1.0)].map(|c| c.expect("valid"));
        let (mut renderer, settings, all) = (Renderer::new(), RenderSettings::default(), Identities::objects(1));
        let mut voted = |seen: bool| {
            let mut votes = Votes::new(2);
            if seen {
                votes.see(&mut renderer, &cloud, &side, &settings).expect("drawn");
            }
            let labels = vec![1; 64 * 48];
            votes.add_view(&mut renderer, &cloud, &front, &settings, &labels).expect("drawn");
            votes.decide(&all, 1e-6).iter().map(|a| a.identity).collect::<Vec<_>>()
        };
        assert_eq!(voted(true), [1, UNKNOWN]);
        assert_eq!(voted(false), [1, 1], "the control: some light gets through");
    }

    #[test]
    fn the_lightest_vote_of_many_gives_way() {
        let mut votes = Vec::new();
        (1..=KEPT as IdentityId).for_each(|id| add(&mut votes, id, id as f32));
        add(&mut votes, 3, 0.5);
        assert_eq!(votes[2], (3, 3.5), "the same identity is added up");
        add(&mut votes, 50, 0.9);
        assert!(votes.iter().all(|v| v.0 != 50), "lighter than all");
        add(&mut votes, 51, 1.0);
        assert!(votes.iter().all(|v| v.0 != 51), "as light as the lightest");
        add(&mut votes, 52, 1.5);
        assert!(votes.contains(&(52, 1.5)) && votes.iter().all(|v| v.0 != 1) && votes.len() == KEPT);
        let all = Votes { by_gaussian: vec![votes, vec![]], ..Votes::default() };
        assert_eq!(all.weight(1), 0.0);
        assert_eq!(all.weight(0), 2.0 + 3.5 + 4.0 + 5.0 + 6.0 + 7.0 + 8.0 + 1.5);
    }

    #[test]
    fn votes_are_decided_by_weight_and_ties_by_number() {
        let all = Identities::objects(3);
        let by_gaussian = vec![vec![(3, 1.0), (2, 1.0), (1, 0.5)], vec![(2, 0.05)], vec![(1, 0.0)]];
        let votes = Votes { by_gaussian, ..Votes::default() };
        let b = votes.decide(&all, 0.05);
        assert_eq!(
            (b[0], b[1].identity),
            (Assignment { identity: 2, margin: 0.0 }, 2),
            "as much as is needed is enough"
        );
        assert_eq!(b[2], Assignment { identity: UNKNOWN, margin: 0.0 });
        assert_eq!(b[1].margin, 1.0);
    }
}
