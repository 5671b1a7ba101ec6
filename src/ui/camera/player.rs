//! Playback of a flight or a path, with its frame rate.

use glam::DVec3;

use crate::navigate::{CameraSpline, CameraTrajectory, Pose};

/// Window of the frame rate, s.
const COUNTED_SECS: f64 = 1.0;

#[derive(Clone, Debug)]
pub(crate) enum Clip {
    /// A flight to a target.
    Flight(Box<CameraTrajectory>),
    /// The camera path under edit.
    Path(Box<CameraSpline>),
}

impl Clip {
    /// Duration in s.
    pub(crate) fn seconds(&self) -> f64 {
        match self {
            Self::Flight(flight) => flight.seconds,
            Self::Path(spline) => spline.seconds(),
        }
    }

    /// The pose at a time; for a flight, the nearest of its poses.
    pub(crate) fn at(&self, time: f64) -> Option<Pose> {
        match self {
            Self::Path(spline) => Some(spline.at(time)),
            Self::Flight(flight) => {
                let last = flight.poses.len().checked_sub(1)?;
                let share = if flight.seconds > 0.0 { time / flight.seconds } else { 1.0 };
                flight.poses.get((share.clamp(0.0, 1.0) * last as f64).round() as usize).copied()
            }
        }
    }
}

/// The state of playback.
#[derive(Debug)]
pub(crate) struct Player {
    clip: Option<Clip>,
    /// Position in the clip, s.
    pub(crate) time: f64,
    pub(crate) playing: bool,
    /// True if the clip repeats at its end.
    pub(crate) looped: bool,
    /// Playback speed, 1 as recorded.
    pub(crate) rate: f64,
    /// Window times of recent frames, s.
    shown: Vec<f64>,
}

impl Default for Player {
    fn default() -> Self {
        Self { clip: None, time: 0.0, playing: false, looped: false, rate: 1.0, shown: Vec::new() }
    }
}

impl Player {
    /// Loads a clip at its beginning; plays it if `playing`.
    pub(crate) fn load(&mut self, clip: Clip, playing: bool) {
        self.clip = Some(clip);
        self.time = 0.0;
        self.playing = playing;
        self.shown.clear();
    }

    /// Replaces the clip by a changed version; keeps time and playback state.
    pub(crate) fn replace(&mut self, clip: Option<Clip>) {
        self.time = self.time.min(clip.as_ref().map_or(0.0, Clip::seconds));
        self.playing &= clip.is_some();
        self.clip = clip;
    }

    pub(crate) fn clip(&self) -> Option<&Clip> {
        self.clip.as_ref()
    }

    /// The clip, if its way is drawn into the view of a camera at `eye`: a flight only on the way, not once it has ended
    /// or the camera has left it.
    pub(crate) fn shown_from(&self, eye: DVec3) -> Option<&Clip> {
        self.clip.as_ref().filter(|clip| match clip {
            Clip::Path(_) => true,
            Clip::Flight(flight) => {
                let is_on_way = |pose: Pose| pose.center.distance(eye) <= 1e-3 * flight.length;
                self.time < flight.seconds && clip.at(self.time).is_some_and(is_on_way)
            }
        })
    }

    /// Starts or stops; restarts at the end.
    pub(crate) fn toggle(&mut self) {
        let Some(clip) = &self.clip else { return };
        if !self.playing && self.time >= clip.seconds() {
            self.time = 0.0;
        }
        self.playing = !self.playing;
        self.shown.clear();
    }

    /// Advances by `step_secs` of window time; returns the pose to show while it plays.
    pub(crate) fn tick(&mut self, step_secs: f64) -> Option<Pose> {
        let clip = self.clip.as_ref().filter(|_| self.playing)?;
        let seconds = clip.seconds();
        let rate = if self.rate > 0.0 { self.rate } else { 1.0 };
        self.time += step_secs.clamp(0.0, 0.5) * rate;
        if self.time >= seconds {
            self.time = if self.looped && seconds > 0.0 { self.time % seconds } else { seconds };
            self.playing = self.looped && seconds > 0.0;
        }
        clip.at(self.time)
    }

    /// Stops and moves to a time; returns the pose there.
    pub(crate) fn seek(&mut self, time: f64) -> Option<Pose> {
        let clip = self.clip.as_ref()?;
        self.playing = false;
        self.time = time.clamp(0.0, clip.seconds());
        clip.at(self.time)
    }

    /// Counts a frame shown at this window time.
    pub(crate) fn count(&mut self, now: f64) {
        self.shown.push(now);
        self.shown.retain(|t| now - t <= COUNTED_SECS);
    }

    /// Recent frames per second; `None` before enough frames were shown.
    pub(crate) fn rate_shown(&self) -> Option<f64> {
        let (first, last) = (self.shown.first()?, self.shown.last()?);
        (last - first > 0.2).then(|| (self.shown.len() - 1) as f64 / (last - first))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DVec3};

    fn clip() -> Clip {
        let pose = |i: usize| Pose { center: DVec3::X * i as f64, world_from_camera: DMat3::IDENTITY, fov_y_rad: 0.8 };
        Clip::Flight(Box::new(CameraTrajectory {
            poses: (0..11).map(pose).collect(),
            seconds: 2.0,
            length: 10.0,
            sharp: 0,
            repaired: 0,
        }))
    }

    #[test]
    fn it_runs_to_its_end_and_begins_anew() {
        let mut p = Player::default();
        assert!(p.tick(0.1).is_none() && p.seek(1.0).is_none());
        p.load(clip(), true);
        assert_eq!(p.tick(0.4).map(|p| p.center.x), Some(2.0));
        (0..10).for_each(|_| assert!(p.time <= 2.0 && p.tick(0.4).is_some() || !p.playing));
        assert!(!p.playing && p.time == 2.0);
        p.toggle();
        assert!(p.playing && p.time == 0.0);
        p.looped = true;
        (0..20).for_each(|_| assert!(p.tick(0.3).is_some()));
        assert!(p.playing && p.time < 2.0);
        assert_eq!(p.seek(99.0).map(|p| p.center.x), Some(10.0));
        assert!(!p.playing);
    }

    #[test]
    fn the_way_of_a_flight_is_shown_only_on_it() {
        let mut p = Player::default();
        p.load(clip(), true);
        let here = p.seek(1.0).expect("a pose").center;
        assert!(p.shown_from(here).is_some(), "stopped on the way");
        assert!(p.shown_from(here + DVec3::Y).is_none(), "another move of the camera");
        let end = p.seek(2.0).expect("a pose").center;
        assert!(p.shown_from(end).is_none() && p.clip().is_some(), "it has ended, and can be played again");
    }

    #[test]
    fn pictures_are_counted_over_the_last_second() {
        let mut p = Player::default();
        assert_eq!(p.rate_shown(), None);
        (0..100).for_each(|i| p.count(f64::from(i) * 0.04));
        assert!((p.rate_shown().expect("counted") - 25.0).abs() < 0.1);
    }
}
