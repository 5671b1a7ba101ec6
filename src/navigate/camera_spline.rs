//! A camera path of the user as a pose at every time: through all its keys, smooth in place and rotation, at even speed
//! between keys whose times are not fixed.

use glam::{DMat3, DVec3};

use super::flight::{CameraTrajectory, Speed};
use super::pose::{Pose, RotationSpline, between, quaternion};
use crate::scene::{CameraPath, PathKey};

/// Pieces in which a stretch between two keys is measured.
const PIECES: usize = 32;
/// Share of the path's mean step that a turn of one radian counts as.
const TURN: f64 = 0.5;

/// Most steps from picture to picture that a video is made of.
pub(crate) const MOST_PICTURES: f64 = 1e6;

/// A camera path with a pose at any time.
#[derive(Clone, Debug)]
pub(crate) struct CameraSpline {
    stretches: Vec<Stretch>,
    /// Times of arrival at and departure from each key.
    pub(crate) times: Vec<[f64; 2]>,
    spline: Spline,
    seconds: f64,
    speed: Speed,
}

/// Part between two stops: keys that are passed without a wait.
#[derive(Clone, Debug)]
struct Stretch {
    /// First and last time, seconds.
    from: f64,
    to: f64,
    /// Knots of the spline at both ends.
    ends: [f64; 2],
    /// Distance traveled at evenly spaced knots; empty if times are fixed.
    gone: Vec<f64>,
    /// Times and knots of its keys, where times are fixed.
    fixed: Vec<(f64, f64)>,
}

/// Position, rotation and field of view over knots.
#[derive(Clone, Debug)]
struct Spline {
    knots: Vec<f64>,
    centers: Vec<DVec3>,
    tangents: Vec<DVec3>,
    logs: Vec<f64>,
    slopes: Vec<f64>,
    turning: RotationSpline,
}

impl CameraSpline {
    /// The video of a path; `None` if it has no keys, or is not valid.
    pub(crate) fn new(path: &CameraPath, speed: Speed) -> Option<Self> {
        path.validate().ok()?;
        let mut keys: Vec<&PathKey> = path.keys.iter().collect();
        if path.closed && keys.len() > 2 {
            keys.push(&path.keys[0]);
        }
        keys.first()?;
        let steps = steps(&keys);
        let times = times(&keys, &steps, path.seconds);
        let seconds = times.last().map_or(0.0, |t| t[1]).max(if keys.len() == 1 { path.seconds } else { 0.0 });
        let mut knots = vec![0.0];
        // The square root of the distance: the curve neither overshoots nor loops (centripetal).
        steps.iter().for_each(|s| knots.push(knots[knots.len() - 1] + s.sqrt()));
        let waits: Vec<bool> = keys.iter().map(|k| k.dwell_secs > 0.0).collect();
        let closed = path.closed && keys.len() > 2;
        let spline = Spline::new(&keys, knots, closed)?;
        let mut stretches = Vec::new();
        let mut start = 0;
        for end in 1..keys.len() {
            if end + 1 == keys.len() || waits[end] {
                stretches.push(Stretch::new(&keys, &spline, &times, start, end));
                start = end;
            }
        }
        Some(Self { stretches, times, spline, seconds, speed })
    }

    /// Duration in seconds.
    pub(crate) fn seconds(&self) -> f64 {
        self.seconds
    }

    /// The pose at a time; before the start and after the end, those.
    pub(crate) fn at(&self, time: f64) -> Pose {
        let time = if time.is_finite() { time } else { 0.0 };
        let mut knot = 0.0;
        for stretch in &self.stretches {
            if time < stretch.from {
                break;
            }
            knot = stretch.knot(time, self.speed);
        }
        self.spline.at(knot)
    }

    /// Its poses for a video of `fps` pictures a second, both ends included; at most `most` + 1.
    pub(crate) fn poses(&self, fps: f64, most: f64) -> Vec<Pose> {
        self.flight(steps_of(self.seconds, fps, most) + 1).poses
    }

    /// Its poses at even times, as a flight.
    pub(crate) fn flight(&self, frames: usize) -> CameraTrajectory {
        let last = frames.max(2) - 1;
        let poses: Vec<Pose> = (0..=last).map(|i| self.at(self.seconds * i as f64 / last as f64)).collect();
        let length = poses.windows(2).map(|w| w[0].center.distance(w[1].center)).sum();
        CameraTrajectory { poses, seconds: self.seconds, length, sharp: 0, repaired: 0 }
    }
}

/// Steps from picture to picture in `seconds`: at least one, at most `most`.
pub(crate) fn steps_of(seconds: f64, fps: f64, most: f64) -> usize {
    (seconds * fps).round().clamp(1.0, most) as usize
}

/// Distances of neighboring keys, turns included; never 0.
fn steps(keys: &[&PathKey]) -> Vec<f64> {
    let ways: Vec<f64> = keys.windows(2).map(|w| w[0].center.distance(w[1].center)).collect();
    let mean = ways.iter().sum::<f64>() / ways.len().max(1) as f64;
    let unit = if mean > 0.0 { mean } else { 1.0 };
    let turn = |w: &[&PathKey]| between(quaternion(&w[0].rotation()), quaternion(&w[1].rotation())).length();
    keys.windows(2).zip(&ways).map(|(w, way)| (way + TURN * unit * turn(w)).max(1e-6 * unit)).collect()
}

/// Times of arrival at and departure from each key. Keys without a time of their own share the time between those that
/// have one, by distance.
fn times(keys: &[&PathKey], steps: &[f64], seconds: f64) -> Vec<[f64; 2]> {
    let n = keys.len();
    let mut times = vec![[0.0; 2]; n];
    let waits = |i: usize| keys[i].dwell_secs;
    let mut at = 0;
    let mut start = keys.first().and_then(|k| k.time_secs).unwrap_or(0.0);
    times[0] = [start, start + waits(0)];
    while at + 1 < n {
        let next = (at + 1..n).find(|i| keys[*i].time_secs.is_some());
        let last = next.unwrap_or(n - 1);
        let waiting: f64 = (at + 1..last).map(waits).sum();
        let leave = start + waits(at);
        let end = match next {
            Some(i) => keys[i].time_secs.unwrap_or(leave),
            // The rest of the whole, less the last wait.
            None => seconds - waits(n - 1),
        };
        let moving = (end - leave - waiting).max(1e-3 * (last - at) as f64);
        let way: f64 = steps[at..last].iter().sum();
        let mut now = leave;
        for i in at + 1..=last {
            now += moving * steps[i - 1] / way;
            times[i] = [now, now + waits(i)];
            now += waits(i);
        }
        (at, start) = (last, times[last][0]);
    }
    times
}

impl Stretch {
    fn new(keys: &[&PathKey], spline: &Spline, times: &[[f64; 2]], start: usize, end: usize) -> Self {
        let (from, to) = (times[start][1], times[end][0]);
        let ends = [spline.knots[start], spline.knots[end]];
        let timed = (start + 1..end).any(|i| keys[i].time_secs.is_some());
        let fixed = if timed {
            (start..=end).map(|i| (times[i][usize::from(i == start)], spline.knots[i])).collect()
        } else {
            Vec::new()
        };
        let mut gone = Vec::new();
        if !timed {
            let pieces = PIECES * (end - start);
            let knot = |k: usize| ends[0] + (ends[1] - ends[0]) * k as f64 / pieces as f64;
            let poses: Vec<Pose> = (0..=pieces).map(|k| spline.at(knot(k))).collect();
            let unit = spline.unit();
            gone.push(0.0);
            for w in poses.windows(2) {
                let turn = between(quaternion(&w[0].world_from_camera), quaternion(&w[1].world_from_camera)).length();
                let step = w[0].center.distance(w[1].center) + TURN * unit * turn;
                gone.push(gone[gone.len() - 1] + step.max(1e-12 * unit));
            }
        }
        Self { from, to, ends, gone, fixed }
    }

    /// Knot of the spline at a time.
    fn knot(&self, time: f64, speed: Speed) -> f64 {
        let share =
            if self.to > self.from { ((time - self.from) / (self.to - self.from)).clamp(0.0, 1.0) } else { 1.0 };
        if !self.fixed.is_empty() {
            return self.fixed_knot(time);
        }
        let all = self.gone[self.gone.len() - 1];
        let wanted = speed.way(share) * all;
        let after = self.gone.partition_point(|g| *g <= wanted).clamp(1, self.gone.len() - 1);
        let (a, b) = (self.gone[after - 1], self.gone[after]);
        let k = (after - 1) as f64 + ((wanted - a) / (b - a)).clamp(0.0, 1.0);
        self.ends[0] + (self.ends[1] - self.ends[0]) * k / (self.gone.len() - 1) as f64
    }

    /// The same where times are fixed: a monotone cubic through them (Fritsch and Carlson), so that
    /// speed does not jump at a key and nothing runs backwards.
    fn fixed_knot(&self, time: f64) -> f64 {
        let f = &self.fixed;
        let after = f.partition_point(|(t, _)| *t <= time).clamp(1, f.len() - 1);
        let rate = |i: usize| (f[i + 1].1 - f[i].1) / (f[i + 1].0 - f[i].0).max(1e-9);
        let slope = |i: usize| {
            if i == 0 || i + 1 == f.len() {
                return rate(if i == 0 { 0 } else { i - 1 });
            }
            let (a, b) = (rate(i - 1), rate(i));
            if a * b > 0.0 { 2.0 * a * b / (a + b) } else { 0.0 }
        };
        let (t0, k0) = f[after - 1];
        let (t1, k1) = f[after];
        let h = (t1 - t0).max(1e-9);
        let u = ((time - t0) / h).clamp(0.0, 1.0);
        hermite(u, k0, k1, slope(after - 1) * h, slope(after) * h)
    }
}

fn hermite(u: f64, a: f64, b: f64, da: f64, db: f64) -> f64 {
    let v = 1.0 - u;
    v * v * (1.0 + 2.0 * u) * a + u * u * (3.0 - 2.0 * u) * b + v * v * u * da - u * u * v * db
}

impl Spline {
    fn new(keys: &[&PathKey], knots: Vec<f64>, closed: bool) -> Option<Self> {
        let centers: Vec<DVec3> = keys.iter().map(|k| k.center).collect();
        let logs: Vec<f64> = keys.iter().map(|k| k.fov_y_rad.ln()).collect();
        let n = keys.len();
        // Rates before and after a key, each weighted by the other's length.
        let around = |i: usize| match (i, closed) {
            (0, true) => (n - 2, 0),
            (0, false) => (0, 0),
            (i, true) if i == n - 1 => (n - 2, 0),
            (i, false) if i == n - 1 => (n - 2, n - 2),
            (i, _) => (i - 1, i),
        };
        let span = |k: usize| knots[k + 1] - knots[k];
        let (mut tangents, mut slopes) = (vec![DVec3::ZERO; n], vec![0.0; n]);
        if n > 1 {
            for i in 0..n {
                let (a, b) = around(i);
                let (ha, hb) = (span(a), span(b));
                let rate = |k: usize, h: f64| (centers[k + 1] - centers[k]) / h;
                tangents[i] = (rate(a, ha) * hb + rate(b, hb) * ha) / (ha + hb);
                let rate = |k: usize, h: f64| (logs[k + 1] - logs[k]) / h;
                slopes[i] = (rate(a, ha) * hb + rate(b, hb) * ha) / (ha + hb);
            }
        }
        let rotations: Vec<(f64, DMat3)> = keys.iter().zip(&knots).map(|(k, t)| (*t, k.rotation())).collect();
        let turning = RotationSpline::new(&rotations, closed)?;
        Some(Self { knots, centers, tangents, logs, slopes, turning })
    }

    /// Mean step between keys, scene units; 1 if they are all in one place.
    fn unit(&self) -> f64 {
        let all: f64 = self.centers.windows(2).map(|w| w[0].distance(w[1])).sum();
        let mean = all / (self.centers.len() - 1).max(1) as f64;
        if mean > 0.0 { mean } else { 1.0 }
    }

    fn at(&self, knot: f64) -> Pose {
        let last = self.knots.len() - 1;
        let rotation = self.turning.at(knot);
        if last == 0 {
            return Pose { center: self.centers[0], world_from_camera: rotation, fov_y_rad: self.logs[0].exp() };
        }
        let after = self.knots.partition_point(|k| *k <= knot).clamp(1, last);
        let (i, h) = (after - 1, self.knots[after] - self.knots[after - 1]);
        let u = ((knot - self.knots[i]) / h).clamp(0.0, 1.0);
        let axis = |a: usize| {
            let (from, to) = (self.centers[i][a], self.centers[after][a]);
            hermite(u, from, to, self.tangents[i][a] * h, self.tangents[after][a] * h)
        };
        let fov = hermite(u, self.logs[i], self.logs[after], self.slopes[i] * h, self.slopes[after] * h).exp();
        Pose { center: DVec3::new(axis(0), axis(1), axis(2)), world_from_camera: rotation, fov_y_rad: fov.min(3.1) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rotation::rotation_error;
    use crate::navigate::pose::angle;

    fn key(x: f64, turn: f64) -> PathKey {
        PathKey {
            center: DVec3::new(x, (2.0 * x).sin(), 0.3 * x * x),
            world_from_camera: DMat3::from_rotation_y(turn),
            fov_y_rad: 0.8,
            roll_rad: 0.0,
            dwell_secs: 0.0,
            time_secs: None,
            name: None,
        }
    }

    fn path(keys: Vec<PathKey>) -> CameraPath {
        CameraPath { keys, closed: false, fps: 30.0, seconds: 6.0 }
    }

    #[test]
    fn a_film_passes_its_keys_in_its_time_without_jumps() {
        let p = path([0.0, 1.0, 1.3, 3.0].iter().enumerate().map(|(i, x)| key(*x, 0.7 * i as f64)).collect());
        let spline = CameraSpline::new(&p, Speed::Constant).expect("a spline");
        assert!((spline.seconds() - 6.0).abs() < 1e-9);
        for (k, [arrives, _]) in p.keys.iter().zip(&spline.times) {
            // Even speed shifts arrivals a little from their share of the straight distances.
            let nearest = (-40..=40).map(|i| spline.at(arrives + 0.01 * f64::from(i)).center.distance(k.center));
            assert!(nearest.fold(f64::INFINITY, f64::min) < 0.02, "key at {arrives}");
        }
        let poses: Vec<Pose> = (0..=6000).map(|i| spline.at(f64::from(i) * 1e-3)).collect();
        let steps: Vec<DVec3> = poses.windows(2).map(|w| w[1].center - w[0].center).collect();
        let mean = steps.iter().map(|s| s.length()).sum::<f64>() / steps.len() as f64;
        for w in steps.windows(2) {
            assert!((w[1] - w[0]).length() < 0.15 * mean, "the speed jumps");
        }
        assert!(poses.iter().all(|p| rotation_error(&p.world_from_camera) < 1e-9));
    }

    #[test]
    fn waits_and_fixed_times_are_kept() {
        let mut keys: Vec<PathKey> = (0..4).map(|i| key(f64::from(i), 0.3 * f64::from(i))).collect();
        keys[1].dwell_secs = 1.0;
        let spline = CameraSpline::new(&path(keys.clone()), Speed::Eased).expect("a spline");
        let [arrives, leaves] = spline.times[1];
        assert!((leaves - arrives - 1.0).abs() < 1e-9);
        for t in [arrives, 0.5 * (arrives + leaves), leaves] {
            assert!(spline.at(t).center.distance(keys[1].center) < 1e-9, "it waits");
        }
        keys[1].dwell_secs = 0.0;
        (keys[1].time_secs, keys[2].time_secs) = (Some(4.0), Some(4.5));
        let spline = CameraSpline::new(&path(keys.clone()), Speed::Constant).expect("a spline");
        assert!(spline.at(4.0).center.distance(keys[1].center) < 1e-9);
        assert!(spline.at(4.5).center.distance(keys[2].center) < 1e-9);
        assert!(spline.at(99.0).center.distance(keys[3].center) < 1e-9);
        assert!(spline.at(-1.0).center.distance(keys[0].center) < 1e-9);
    }

    #[test]
    fn closed_paths_close_smoothly() {
        let ring = |i: i32| {
            let a = f64::from(i) * 1.3;
            PathKey { center: DVec3::new(a.cos(), a.sin(), 0.0), ..key(0.0, a) }
        };
        let p = CameraPath { closed: true, ..path((0..5).map(ring).collect()) };
        let spline = CameraSpline::new(&p, Speed::Constant).expect("a spline");
        let (a, b) = (spline.at(0.0), spline.at(spline.seconds()));
        assert!(a.center.distance(b.center) < 1e-9 && angle(&a.world_from_camera, &b.world_from_camera) < 1e-6);
        let h = 1e-3;
        let leaving = (spline.at(h).center - a.center) / h;
        let arriving = (b.center - spline.at(spline.seconds() - h).center) / h;
        assert!((leaving - arriving).length() < 0.05 * leaving.length(), "{leaving} {arriving}");
    }

    #[test]
    fn degenerate_paths_are_defined() {
        assert!(CameraSpline::new(&path(vec![]), Speed::Eased).is_none());
        let one = CameraSpline::new(&path(vec![key(1.0, 0.2)]), Speed::Eased).expect("one key");
        assert_eq!(one.at(3.0).center, key(1.0, 0.0).center);
        assert_eq!(one.seconds(), 6.0);
        let turning = path(vec![key(0.0, 0.0), key(0.0, 1.0), key(0.0, 4.0)]);
        let spline = CameraSpline::new(&turning, Speed::Constant).expect("in one place");
        let rates: Vec<f64> = (10..590)
            .map(|i| {
                let [a, b] = [i, i + 1].map(|i| spline.at(0.01 * f64::from(i)).world_from_camera);
                angle(&a, &b)
            })
            .collect();
        assert!(rates.iter().all(|r| *r > 0.0 && *r < 0.03), "it turns evenly");
        let same = CameraSpline::new(&path(vec![key(0.0, 0.0); 3]), Speed::Eased).expect("all the same");
        assert!(same.at(2.0).center.is_finite());
        let mut bad = path(vec![key(0.0, 0.0)]);
        bad.keys[0].fov_y_rad = f64::NAN;
        assert!(CameraSpline::new(&bad, Speed::Eased).is_none());
        let many = path((0..10_000).map(|i| key(f64::from(i % 97) * 0.1, f64::from(i))).collect());
        let spline = CameraSpline::new(&many, Speed::Constant).expect("many");
        assert!(spline.at(3.0).center.is_finite());
    }
}
