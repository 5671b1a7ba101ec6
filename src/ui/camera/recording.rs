//! Places of new keyframes in a path: at the playhead, or at the end.

use crate::scene::{CameraPath, PathKey};

/// Least time between the playhead and a keyframe for a new one to have room, s.
const GAP_SECS: f64 = 0.02;

/// Inserts `key` at the time of the playhead if that lies between two keys, which arrive and leave at `times`; every
/// other key keeps its time. Returns its place, or `None` if it lies nowhere between.
pub(super) fn insert(path: &mut CameraPath, times: &[[f64; 2]], playhead: f64, key: &PathKey) -> Option<usize> {
    let between = |pair: &[[f64; 2]]| pair[0][1] + GAP_SECS < playhead && playhead < pair[1][0] - GAP_SECS;
    let before = times.windows(2).position(between)?;
    let keys = &mut path.keys;
    // Keys without a time share the time between those that have one, so a new one among them would move them. The
    // first and the last keep theirs anyway.
    let is_fixed = |i: &usize| keys.get(*i).is_some_and(|key| key.time_secs.is_some());
    let from = (0..=before).rev().find(is_fixed).unwrap_or(0);
    let to = (before + 1..keys.len()).find(is_fixed).unwrap_or(times.len() - 1);
    for (key, [arrives, _]) in keys.iter_mut().zip(times).take(to).skip(from + 1) {
        key.time_secs = Some(*arrives);
    }
    let place = (before + 1).min(keys.len());
    keys.insert(place, PathKey { time_secs: Some(playhead), ..key.clone() });
    Some(place)
}

/// Appends `key`. If the last key fills the whole time, the path takes longer. Returns the key's place.
pub(super) fn append(path: &mut CameraPath, key: PathKey) -> usize {
    let place = path.keys.len();
    if let Some(end) = path.keys.last().and_then(|last| Some(last.time_secs? + last.dwell_secs)) {
        let step = if place > 1 { end / (place - 1) as f64 } else { 1.0 };
        path.seconds = path.seconds.max(end + step.max(GAP_SECS)).min(CameraPath::MAX_SECONDS);
    }
    path.keys.push(key);
    place
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};

    use super::*;
    use crate::navigate::{CameraSpline, Speed};

    fn key(x: f64) -> PathKey {
        PathKey::of_pose(DVec3::X * x, DMat3::IDENTITY, 0.8)
    }

    fn path(closed: bool) -> CameraPath {
        let keys = [0.0, 1.0, 1.5, 4.0].map(key).to_vec();
        CameraPath { keys, closed, fps: 30.0, seconds: 6.0 }
    }

    fn times(path: &CameraPath) -> Vec<f64> {
        let spline = CameraSpline::new(path, Speed::Constant).expect("a path");
        spline.times.iter().take(path.keys.len()).map(|t| t[0]).collect()
    }

    fn inserted(path: &mut CameraPath, playhead: f64) -> Option<usize> {
        let spline = CameraSpline::new(path, Speed::Constant).expect("a path");
        insert(path, &spline.times, playhead, &key(9.0))
    }

    #[test]
    fn a_key_at_the_playhead_leaves_the_times_of_the_others_alone() {
        for closed in [false, true] {
            for playhead in [0.5, 2.0, 4.0, 5.9] {
                let (mut p, before) = (path(closed), times(&path(closed)));
                let Some(place) = inserted(&mut p, playhead) else { panic!("{playhead} is between two keys") };
                let mut after = times(&p);
                assert!((after.remove(place) - playhead).abs() < 1e-9, "{after:?}");
                assert!(before.iter().zip(&after).all(|(a, b)| (a - b).abs() < 1e-9), "{before:?} {after:?}");
                p.validate().expect("a valid path");
            }
        }
        // Control: without a time, the new key moves the others.
        let mut p = path(false);
        p.keys.insert(1, key(9.0));
        assert!((times(&p)[2] - times(&path(false))[1]).abs() > 0.1);
    }

    #[test]
    fn a_playhead_at_a_key_or_outside_inserts_nothing() {
        let at = times(&path(false));
        for playhead in [0.0, at[1], at[2] + 0.01, 6.0, 7.0] {
            let mut p = path(false);
            assert_eq!(inserted(&mut p, playhead), None, "{playhead}");
            assert_eq!(p, path(false), "nothing has changed");
        }
        // Control: a little later there is room.
        assert_eq!(inserted(&mut path(false), at[1] + 0.1), Some(2));
        let mut waits = path(false);
        waits.keys[1].dwell_secs = 1.0;
        let arrives = times(&waits)[1];
        assert_eq!(inserted(&mut waits, arrives + 0.5), None, "it waits there");
    }

    #[test]
    fn an_appended_key_gets_time_of_its_own() {
        let mut p = path(false);
        p.keys[3].time_secs = Some(6.0);
        assert_eq!(append(&mut p, key(5.0)), 4);
        assert_eq!((times(&p)[3], p.seconds), (6.0, 8.0));
        // Control: where no time is fixed, the duration stays.
        let mut p = path(false);
        append(&mut p, key(5.0));
        assert_eq!(p.seconds, 6.0);
    }
}
