//! Camera placement.

use std::f64::consts::TAU;

use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;

use super::options::{Rig, SynthOptions};
use super::surface::Surface;
use super::trace::Tracer;
use crate::scene::{Bounds, Camera};

/// Up in every glTF scene.
const UP: DVec3 = DVec3::Y;
/// Golden angle: azimuths that never repeat.
const GOLDEN: f64 = TAU * 0.381_966_011_250_105;
/// Attempts to find a close-up with a free line of sight.
const ATTEMPTS: usize = 24;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RigSubject {
    pub(crate) focus: DVec3,
    /// Radius around the focus that should fill a picture.
    pub(crate) radius: f64,
}

/// Places the cameras of a data set, in the order of the photos.
pub(crate) fn cameras(surface: &Surface, tracer: &Tracer, options: &SynthOptions) -> Vec<Camera> {
    let objects = &surface.objects;
    let supports = supports(objects);
    let things: Vec<&Bounds> = objects.iter().zip(&supports).filter(|(_, s)| !**s).map(|(b, _)| b).collect();
    let found = subject(&things);
    let subject =
        RigSubject { focus: options.focus.unwrap_or(found.focus), radius: options.radius.unwrap_or(found.radius) };
    let placer = Placer { surface, tracer, options };
    let mut rng = Pcg32::seed_from_u64(options.seed);
    let start = rng.random::<f64>() * TAU;
    let n = options.views;
    (0..n)
        .map(|i| {
            let share = (i as f64 + 0.5) / n as f64;
            match options.rig {
                Rig::Dome => placer.dome(subject, share, start + GOLDEN * i as f64),
                Rig::Orbit => {
                    let (ring, rings) = (i * 3 / n, 3.0);
                    let elevation = (15.0 + 50.0 * ring as f64 / (rings - 1.0)).to_radians();
                    placer.around(subject, elevation, start + TAU * share * rings, 1.0)
                }
                Rig::Handheld => {
                    let sway = |f: f64, phase: f64| (TAU * (f * share + phase)).sin();
                    let elevation = (32.0 + 14.0 * sway(2.0, 0.1) + 3.0 * sway(11.0, 0.4)).to_radians();
                    let away = 1.0 + 0.12 * sway(3.0, 0.7) + 0.02 * sway(13.0, 0.2);
                    let shift = DVec3::new(sway(5.0, 0.3), sway(7.0, 0.6), sway(9.0, 0.9)) * (0.06 * subject.radius);
                    let aim = RigSubject { focus: subject.focus + shift, ..subject };
                    placer.around(aim, elevation, start + TAU * 1.25 * share, away)
                }
                Rig::Survey if i % 2 == 1 && !things.is_empty() => {
                    let k = i / 2;
                    placer.close_up(subject, things[k % things.len()], k, &mut rng)
                }
                Rig::Survey => placer.dome(subject, share, start + GOLDEN * (i / 2) as f64),
            }
        })
        .collect()
}

struct Placer<'a> {
    surface: &'a Surface,
    tracer: &'a Tracer,
    options: &'a SynthOptions,
}

impl Placer<'_> {
    /// Camera at 12 to 70 degrees of elevation, evenly over the dome's area, steeper as `share` grows.
    fn dome(&self, subject: RigSubject, share: f64, azimuth: f64) -> Camera {
        let (low, high) = (12.0_f64.to_radians().sin(), 70.0_f64.to_radians().sin());
        self.around(subject, (low + (high - low) * share).asin(), azimuth, 1.0)
    }

    /// Camera that sees the whole subject from the given direction, `away` times as far as needed.
    fn around(&self, subject: RigSubject, elevation: f64, azimuth: f64, away: f64) -> Camera {
        let o = self.options;
        let (e, a) = (elevation.sin_cos(), azimuth.sin_cos());
        let direction = DVec3::new(e.1 * a.1, e.0, e.1 * a.0);
        let half_y = 0.5 * o.fov_y_deg.to_radians();
        let half_x = (half_y.tan() * f64::from(o.width_px) / f64::from(o.height_px)).atan();
        let distance = away * subject.radius / half_y.min(half_x).sin();
        let eye = subject.focus + direction * distance;
        let camera = Camera::look_at(eye, subject.focus, UP, 2.0 * half_y, o.width_px, o.height_px);
        // The elevation keeps the view off the vertical, and the distance is not zero.
        camera.unwrap_or(Camera {
            width_px: o.width_px,
            height_px: o.height_px,
            focal_px: glam::DVec2::splat(0.5 * f64::from(o.height_px) / half_y.tan()),
            principal_px: glam::DVec2::new(f64::from(o.width_px), f64::from(o.height_px)) * 0.5,
            world_from_camera: glam::DMat3::from_cols(DVec3::X, DVec3::Z, -DVec3::Y),
            center: eye,
        })
    }

    /// Close-up of one object with a free line of sight.
    fn close_up(&self, scene: RigSubject, object: &Bounds, k: usize, rng: &mut Pcg32) -> Camera {
        // Nearer than a third of the whole scene's radius would show a spoon and nothing else.
        let radius = (object.radius() * 1.5).clamp(0.3 * scene.radius, scene.radius);
        let aim = RigSubject { focus: object.center(), radius };
        let mut best = None;
        for attempt in 0..ATTEMPTS {
            let elevation = (18.0 + 42.0 * rng.random::<f64>()).to_radians();
            let camera = self.around(aim, elevation, GOLDEN * (k * 5 + attempt * 3) as f64, 1.0);
            if self.sees(&camera, object) {
                return camera;
            }
            best.get_or_insert(camera);
        }
        best.unwrap_or_else(|| self.around(aim, 1.0, GOLDEN * k as f64, 1.0))
    }

    /// Returns whether the first surface toward the object's middle is near the object.
    fn sees(&self, camera: &Camera, object: &Bounds) -> bool {
        let target = self.surface.local(object.center());
        let origin = self.surface.local(camera.center);
        let reach = (object.radius() / self.surface.unit) as f32;
        let distance = origin.distance(target);
        let hit = self.tracer.nearest(origin, target - origin, 0.0);
        hit.is_none_or(|h| h.t * distance > distance - reach)
    }
}

/// Objects on or above which most others stand: tables, floors. The cameras do not aim at them.
fn supports(objects: &[Bounds]) -> Vec<bool> {
    let stands_on = |a: &Bounds, b: &Bounds| {
        let c = a.center();
        let inside = c.x > b.min.x && c.x < b.max.x && c.z > b.min.z && c.z < b.max.z;
        inside && c.y > b.max.y - 0.02 * b.size().length()
    };
    let count = |b: &Bounds| objects.iter().filter(|a| stands_on(a, b)).count();
    objects.iter().map(|b| objects.len() >= 4 && 2 * count(b) > objects.len()).collect()
}

fn subject(things: &[&Bounds]) -> RigSubject {
    let all = Bounds::of(things.iter().flat_map(|b| [b.min, b.max]));
    all.map_or(RigSubject { focus: DVec3::ZERO, radius: 1.0 }, |b| RigSubject { focus: b.center(), radius: b.radius() })
}
