//! The pose at which a rendering is most like a photo: damped Gauss-Newton steps from coarse to fine. The slope is the
//! rasterizer's own [`PoseGradient`](crate::render::PoseGradient); the curvature is that of the rendered colors moving
//! as their depth says.

use glam::{DVec2, DVec3};

use super::LocateError;
use super::consensus::hold_focal;
use super::gallery::Gallery;
use super::gray::slopes;
use super::photometric::{Exposure, PhotoLevel};
use super::pose::{PARAMETERS, PoseStep, flow, moved};
use crate::math::cholesky::solve;
use crate::render::{Frame, FrameGradient};
use crate::scene::Camera;

/// Steps of a level at most.
pub(super) const STEPS: usize = 10;
/// Damping at the start of a level, by share of the curvature.
const DAMPING: f64 = 1e-3;
/// Tries with larger damping before a level ends.
const TRIES: usize = 4;
/// A step that moves no pixel further than this ends a level, px.
const STILL_PX: f64 = 0.02;
/// Largest turn (radians), move (shares of the scene's usual depth) and change of focal length (logarithm) of a step.
const LARGEST: [f64; 3] = [0.1, 0.15, 0.1];

/// Curvature of a loss by the parameters of a pose.
pub(crate) type Curvature = [[f64; PARAMETERS]; PARAMETERS];

/// A pose that a rendering was aligned at.
pub(super) struct Aligned {
    /// At the size of the level.
    pub(super) camera: Camera,
    pub(super) exposure: Exposure,
    pub(super) curvature: Curvature,
    /// The rendering at the pose.
    pub(super) frame: Frame<f32>,
}

/// The focal lengths that are believed, as logarithms of ratios to the one at the start; `None` holds it.
pub(super) type FocalBounds = Option<[f64; 2]>;

/// Aligns a scene with a photo from a start nearby; `start` has the photo's size. `focal` bounds the change.
pub(super) fn align(
    gallery: &mut Gallery,
    photo: &PhotoLevel,
    start: &Camera,
    focal: FocalBounds,
    steps: usize,
) -> Result<Aligned, LocateError> {
    let mut camera = start.clone();
    let mut frame = gallery.draw(&camera)?;
    let mut exposure = Exposure::between(&frame.color, photo);
    let mut gradient = FrameGradient::<f32>::default();
    let mut weights = <[Vec<f32>; 3]>::default();
    let mut damping = DAMPING;
    for _ in 0..steps {
        let loss = exposure.loss(&frame.color, photo, &mut gradient.color, &mut weights);
        let (mut curvature, depth) = curvature(&frame, &camera, &weights);
        let slope = gallery.renderer.pose_gradient(&gallery.cloud, &camera, &gradient);
        let (t, r, f) = (slope.translation, slope.rotation, slope.focal.dot(camera.focal_px));
        let mut downhill = [t.x, t.y, t.z, r.x, r.y, r.z, f].map(|g| -g);
        if focal.is_none() {
            hold_focal(&mut curvature, &mut downhill);
        }
        let mut accepted = None;
        for _ in 0..TRIES {
            let mut damped = curvature;
            (0..PARAMETERS).for_each(|i| damped[i][i] = damped[i][i] * (1.0 + damping) + 1e-9);
            let Some(step) = solve(&damped, &downhill).map(|step| shortened(step, depth)) else { break };
            let candidate = within(moved(&camera, &step), start, focal);
            let drawn = gallery.draw(&candidate)?;
            let new = exposure.loss(&drawn.color, photo, &mut gradient.color, &mut weights);
            if new < loss {
                accepted = Some((candidate, drawn, step));
                damping = (damping * 0.2).max(1e-6);
                break;
            }
            damping *= 10.0;
        }
        let Some((candidate, drawn, step)) = accepted else { break };
        (camera, frame) = (candidate, drawn);
        exposure = Exposure::between(&frame.color, photo);
        if moves_px(&camera, &step, depth) < STILL_PX {
            break;
        }
    }
    exposure.loss(&frame.color, photo, &mut gradient.color, &mut weights);
    let (mut curvature, _) = curvature(&frame, &camera, &weights);
    if focal.is_none() {
        hold_focal(&mut curvature, &mut [0.0; PARAMETERS]);
    }
    Ok(Aligned { camera, exposure, curvature, frame })
}

/// The camera with a focal length within bounds of that of the start.
fn within(camera: Camera, start: &Camera, focal: FocalBounds) -> Camera {
    let Some([low, high]) = focal else { return Camera { focal_px: start.focal_px, ..camera } };
    let ratio = (camera.focal_px.x / start.focal_px.x).ln().clamp(low, high);
    Camera { focal_px: start.focal_px * ratio.exp(), ..camera }
}

/// Curvature of the loss, and the usual depth of what is seen.
pub(crate) fn curvature(frame: &Frame<f32>, camera: &Camera, weights: &[Vec<f32>; 3]) -> (Curvature, f64) {
    let width = frame.width_px;
    let depths = frame.expected_depth();
    let slopes = [0, 1, 2].map(|c| slopes(&frame.color[c], width));
    let mut out = [[0.0; PARAMETERS]; PARAMETERS];
    let (mut logs, mut seen) = (0.0, 0_usize);
    for (i, depth) in depths.iter().enumerate().filter(|(_, d)| **d > 0.0) {
        let depth = f64::from(*depth);
        logs += depth.ln();
        seen += 1;
        // Products of slopes, summed over the channels.
        let [mut xx, mut xy, mut yy] = [0.0_f64; 3];
        for c in 0..3 {
            let (w, x, y) = (f64::from(weights[c][i]), f64::from(slopes[c][0][i]), f64::from(slopes[c][1][i]));
            xx += w * x * x;
            xy += w * x * y;
            yy += w * y * y;
        }
        if xx + yy <= 0.0 {
            continue;
        }
        let at = DVec2::new((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
        let on_plane = (at - camera.principal_px) / camera.focal_px;
        let [u, v] = flow(camera, DVec3::new(on_plane.x, on_plane.y, 1.0) * depth);
        for a in 0..PARAMETERS {
            let (pu, pv) = (xx * u[a] + xy * v[a], xy * u[a] + yy * v[a]);
            for b in 0..=a {
                out[a][b] += pu * u[b] + pv * v[b];
            }
        }
    }
    for a in 0..PARAMETERS {
        for b in a + 1..PARAMETERS {
            out[a][b] = out[b][a];
        }
    }
    (out, if seen > 0 { (logs / seen as f64).exp() } else { 1.0 })
}

/// The step, shortened to what the slope may hold for.
fn shortened(step: PoseStep, depth: f64) -> PoseStep {
    let length = |part: &[f64]| part.iter().map(|v| v * v).sum::<f64>().sqrt();
    let parts = [length(&step[3..6]), length(&step[..3]) / depth, step[6].abs()];
    let over = parts.iter().zip(LARGEST).map(|(part, most)| part / most).fold(1.0, f64::max);
    step.map(|v| v / over)
}

/// Largest movement of a pixel of the picture's axes by a step, px, at the usual depth.
fn moves_px(camera: &Camera, step: &PoseStep, depth: f64) -> f64 {
    let size = DVec2::new(f64::from(camera.width_px), f64::from(camera.height_px));
    let places = [size * 0.5, DVec2::ZERO, size, DVec2::new(size.x, 0.0), DVec2::new(0.0, size.y)];
    let moves = |at: DVec2| {
        let on_plane = (at - camera.principal_px) / camera.focal_px;
        let rows = flow(camera, on_plane.extend(1.0) * depth);
        let along = |row: &PoseStep| row.iter().zip(step).map(|(a, b)| a * b).sum::<f64>();
        along(&rows[0]).hypot(along(&rows[1]))
    };
    places.into_iter().map(moves).fold(0.0, f64::max)
}
