//! A pose from points that were found in a photo, most of them wrongly: random sample consensus over
//! [three points](super::p3p), then least squares of the reprojection errors.

use glam::{DVec2, DVec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

use super::p3p;
use super::pose::{PARAMETERS, flow, moved};
use crate::math::Real;
use crate::math::cholesky::solve;
use crate::math::lanes::{LANES, Lane, LaneOp, Lanes};
use crate::scene::Camera;

/// Samples at most for each focal length.
const SAMPLES: usize = 6000;
/// Samples at least.
const LEAST_SAMPLES: usize = 60;
/// Certainty that a sample of right matches alone was drawn, after which sampling ends.
const CERTAINTY: f64 = 0.999;
/// Steps of least squares.
const STEPS: usize = 8;
/// Fewest matches that a pose is computed from.
const FEWEST: usize = 6;

/// A point of the scene and its place in the photo.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointMatch {
    pub(super) pixel: DVec2,
    pub(super) world: DVec3,
}

/// A pose that many matches agree on.
#[derive(Clone, Debug)]
pub(super) struct Consensus {
    pub(super) camera: Camera,
    /// Indices of the matches that agree.
    pub(super) inliers: Vec<usize>,
}

/// The pose that most of `matches` agree on within `within_px`. `template` has size and lens; each of `focals` times
/// its focal length is tried. If there are several, the focal length is refined, too.
pub(super) fn consensus(
    matches: &[PointMatch],
    template: &Camera,
    focals: &[f64],
    within_px: f64,
) -> Option<Consensus> {
    if matches.len() < FEWEST {
        return None;
    }
    let lanes = MatchLanes::of(matches);
    let with = |focal: &f64| {
        let lens = Camera { focal_px: template.focal_px * *focal, ..template.clone() };
        sampled(matches, &lanes, &lens, within_px)
    };
    let sampled: Vec<Option<(f32, Camera)>> = focals.par_iter().map(with).collect();
    let mut best: Option<(f32, Camera)> = None;
    for (cost, camera) in sampled.into_iter().flatten() {
        if best.as_ref().is_none_or(|(least, _)| cost < *least) {
            best = Some((cost, camera));
        }
    }
    let (_, mut camera) = best?;
    for _ in 0..2 {
        camera = fitted(matches, camera, within_px, focals.len() > 1);
    }
    let inliers = agreeing(matches, &camera, within_px);
    (inliers.len() >= FEWEST).then_some(Consensus { camera, inliers })
}

/// Squared reprojection error, px².
fn error(m: &PointMatch, camera: &Camera) -> f64 {
    camera.project(m.world).map_or(f64::INFINITY, |p| p.distance_squared(m.pixel))
}

fn agreeing(matches: &[PointMatch], camera: &Camera, within_px: f64) -> Vec<usize> {
    (0..matches.len()).filter(|&i| error(&matches[i], camera) <= within_px * within_px).collect()
}

/// Matches, eight at a time: places in the world, from that of the first one, and in the photo. After the last match
/// come some that no pose agrees with.
struct MatchLanes {
    origin: DVec3,
    of: Vec<[Lane<f32>; 5]>,
}

impl MatchLanes {
    fn of(matches: &[PointMatch]) -> Self {
        let origin = matches.first().map_or(DVec3::ZERO, |m| m.world);
        let mut of = vec![[[f32::NAN; LANES]; 5]; matches.len().div_ceil(LANES)];
        for (i, m) in matches.iter().enumerate() {
            let [x, y, z] = (m.world - origin).to_array();
            let values = [x, y, z, m.pixel.x, m.pixel.y].map(|v| v as f32);
            of[i / LANES].iter_mut().zip(values).for_each(|(lane, v)| lane[i % LANES] = v);
        }
        Self { origin, of }
    }

    /// Squared errors of a pose, each at most `bound`, px²; any sum of at least `most`, if it is more.
    fn cost(&self, camera: &Camera, bound: f64, most: f32) -> f32 {
        let t = camera.camera_from_world(self.origin);
        let rows = camera.world_from_camera.to_cols_array_2d();
        let line = |k: usize| [rows[k][0], rows[k][1], rows[k][2], t[k]].map(|v| v as f32);
        let [focal, principal] = [camera.focal_px, camera.principal_px].map(|v| v.to_array().map(|v| v as f32));
        f32::vectorize(Cost {
            of: &self.of,
            pose: [line(0), line(1), line(2)],
            focal,
            principal,
            bound: bound as f32,
            most,
        })
    }
}

/// The sum of the squared errors of a pose.
struct Cost<'a> {
    of: &'a [[Lane<f32>; 5]],
    /// Rows of camera_from_world, each with its translation.
    pose: [[f32; 4]; 3],
    focal: [f32; 2],
    principal: [f32; 2],
    bound: f32,
    most: f32,
}

impl LaneOp<f32> for Cost<'_> {
    type Output = f32;

    #[inline(always)]
    fn run<L: Lanes<f32>>(self, l: L) -> f32 {
        let (zero, bound) = (l.splat(0.0), l.splat(self.bound));
        let mut sum = zero;
        let mut k = 0;
        while k < self.of.len() {
            let [x, y, z, u, v] = &self.of[k];
            let (x, y, z) = (l.load(x), l.load(y), l.load(z));
            let (row, mut seen) = (&self.pose, [zero; 3]);
            let mut c = 0;
            while c < 3 {
                let plane = l.mul_add(l.splat(row[c][2]), z, l.splat(row[c][3]));
                seen[c] = l.mul_add(l.splat(row[c][0]), x, l.mul_add(l.splat(row[c][1]), y, plane));
                c += 1;
            }
            let right = l
                .sub(l.mul_add(l.div(seen[0], seen[2]), l.splat(self.focal[0]), l.splat(self.principal[0])), l.load(u));
            let down = l
                .sub(l.mul_add(l.div(seen[1], seen[2]), l.splat(self.focal[1]), l.splat(self.principal[1])), l.load(v));
            let off = l.mul_add(right, right, l.mul(down, down));
            sum = l.add(sum, l.select(l.both(l.gt(seen[2], zero), l.gt(bound, off)), off, bound));
            k += 1;
            if k % 4 == 0 && l.sum(sum) >= self.most {
                break;
            }
        }
        l.sum(sum)
    }
}

/// The best pose of samples of three, and its cost.
fn sampled(matches: &[PointMatch], lanes: &MatchLanes, lens: &Camera, within_px: f64) -> Option<(f32, Camera)> {
    let mut rng = Pcg64Mcg::seed_from_u64(matches.len() as u64);
    let (n, bound) = (matches.len(), within_px * within_px);
    let mut best: Option<(f32, Camera)> = None;
    let mut enough = SAMPLES;
    let mut drawn = 0;
    while drawn < enough {
        drawn += 1;
        let sample: [usize; 3] = std::array::from_fn(|_| rng.random_range(0..n));
        let distinct = (0..3).all(|a| (0..a).all(|b| matches[sample[a]].pixel != matches[sample[b]].pixel));
        if !distinct {
            continue;
        }
        let of = |k: usize| matches[sample[k]];
        let ray = |k: usize| ((of(k).pixel - lens.principal_px) / lens.focal_px).extend(1.0);
        let found = p3p::poses([ray(0), ray(1), ray(2)], [of(0).world, of(1).world, of(2).world]);
        for (world_from_camera, center) in found {
            let camera = Camera { world_from_camera, center, ..lens.clone() };
            let least = best.as_ref().map_or(f32::INFINITY, |(least, _)| *least);
            let cost = lanes.cost(&camera, bound, least);
            if cost < least {
                let share = agreeing(matches, &camera, within_px).len() as f64 / n as f64;
                let misses = (1.0 - share.powi(3)).clamp(1e-12, 1.0 - 1e-12);
                enough = SAMPLES.min(((1.0 - CERTAINTY).ln() / misses.ln()).ceil() as usize).max(LEAST_SAMPLES);
                best = Some((cost, camera));
            }
        }
    }
    best
}

/// The pose after Gauss-Newton steps on the matches that agree, with weights that fall with their error.
fn fitted(matches: &[PointMatch], start: Camera, within_px: f64, with_focal: bool) -> Camera {
    let mut camera = start;
    let bound = within_px * within_px;
    for _ in 0..STEPS {
        let (mut normal, mut right) = ([[0.0; PARAMETERS]; PARAMETERS], [0.0; PARAMETERS]);
        for m in matches {
            let Some(seen) = camera.project(m.world) else { continue };
            let off = m.pixel - seen;
            if off.length_squared() > bound {
                continue;
            }
            let weight = (1.0 + 4.0 * off.length_squared() / bound).powi(-2);
            for (row, off) in flow(&camera, camera.camera_from_world(m.world)).iter().zip(off.to_array()) {
                for i in 0..PARAMETERS {
                    right[i] += weight * row[i] * off;
                    (0..PARAMETERS).for_each(|j| normal[i][j] += weight * row[i] * row[j]);
                }
            }
        }
        if !with_focal {
            hold_focal(&mut normal, &mut right);
        }
        (0..PARAMETERS).for_each(|i| normal[i][i] *= 1.0 + 1e-6);
        let Some(step) = solve(&normal, &right) else { break };
        camera = moved(&camera, &step);
    }
    camera
}

/// Takes the focal length out of normal equations.
pub(crate) fn hold_focal(normal: &mut [[f64; PARAMETERS]; PARAMETERS], right: &mut [f64; PARAMETERS]) {
    let focal = PARAMETERS - 1;
    for i in 0..PARAMETERS {
        (normal[i][focal], normal[focal][i]) = (0.0, 0.0);
    }
    (normal[focal][focal], right[focal]) = (1.0, 0.0);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a made-up scene as a camera sees them, `wrong` of them at random places.
    fn made_up(camera: &Camera, n: usize, wrong: usize, noise_px: f64) -> Vec<PointMatch> {
        let mut rng = Pcg64Mcg::seed_from_u64(8);
        let mut v = |scale: f64| rng.random_range(-scale..=scale);
        (0..n)
            .map(|i| {
                let world = DVec3::new(v(1.2), v(1.2), v(1.0));
                let noise = DVec2::new(v(noise_px), v(noise_px));
                let chance = DVec2::new(320.0 + v(320.0), 240.0 + v(240.0));
                let seen = camera.project(world).expect("in front") + noise;
                PointMatch { world, pixel: if i < wrong { chance } else { seen } }
            })
            .collect()
    }

    fn camera() -> Camera {
        Camera::look_at(DVec3::new(1.0, -4.0, 1.0), DVec3::ZERO, DVec3::Z, 0.8, 640, 480).expect("valid")
    }

    #[test]
    fn a_pose_is_found_among_two_thirds_of_wrong_matches() {
        let truth = camera();
        let matches = made_up(&truth, 300, 200, 0.5);
        let elsewhere = Camera { center: DVec3::ONE, world_from_camera: glam::DMat3::IDENTITY, ..truth.clone() };
        let found = consensus(&matches, &elsewhere, &[1.0], 3.0).expect("a pose");
        assert!(found.camera.center.distance(truth.center) < 0.02, "{}", found.camera.center);
        assert!(found.inliers.len() >= 95 && found.inliers.len() < 110, "{}", found.inliers.len());
    }

    #[test]
    fn the_cost_of_a_pose_is_that_of_its_errors() {
        let (truth, bound) = (camera(), 9.0);
        let mut matches = made_up(&truth, 61, 20, 1.0);
        // One match is behind the camera.
        matches[40].world = truth.center - truth.forward();
        let lanes = MatchLanes::of(&matches);
        for turn in [0.0, 0.01, 1.0] {
            let camera = Camera {
                world_from_camera: glam::DMat3::from_rotation_z(turn) * truth.world_from_camera,
                ..truth.clone()
            };
            let padding = matches.len().next_multiple_of(LANES) - matches.len();
            let want = matches.iter().map(|m| error(m, &camera).min(bound)).sum::<f64>() + padding as f64 * bound;
            let found = f64::from(lanes.cost(&camera, bound, f32::INFINITY));
            assert!((found - want).abs() < 1e-3 * want, "{found} {want}");
            assert!(f64::from(lanes.cost(&camera, bound, 0.3 * want as f32)) >= 0.3 * want, "it may stop there");
        }
    }

    #[test]
    fn an_unknown_focal_length_is_found_with_the_pose() {
        let truth = camera();
        let matches = made_up(&truth, 200, 80, 0.3);
        let lens = Camera { focal_px: truth.focal_px / 1.4, ..truth.clone() };
        let found = consensus(&matches, &lens, &[0.64, 0.8, 1.0, 1.25, 1.56], 4.0).expect("a pose");
        let ratio = found.camera.focal_px.x / truth.focal_px.x;
        assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
        // Negative control: with the wrong focal length held, the matches fit far worse.
        let held = consensus(&matches, &lens, &[1.0], 4.0);
        assert!(held.is_none_or(|h| h.inliers.len() + 20 < found.inliers.len()));
    }

    #[test]
    fn matches_at_random_agree_on_nothing() {
        let matches = made_up(&camera(), 300, 300, 0.0);
        let found = consensus(&matches, &camera(), &[1.0], 3.0);
        assert!(found.as_ref().is_none_or(|f| f.inliers.len() < 12), "{found:?}");
        assert!(consensus(&matches[..5], &camera(), &[1.0], 3.0).is_none());
    }
}
