//! Codes of a view's pixels, blended as in the paper: both levels in one pass, divided by alpha.

use crate::render::{Features, RenderError, RenderSettings, Renderer};
use crate::scene::semantic_map::CODE_CHANNELS;
use crate::scene::{Camera, GaussianCloud, Level};

/// Channels of an object's code, the first ones.
const OBJECT_CHANNELS: usize = CODE_CHANNELS / 2;

/// Blended codes of a view.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CodeMap {
    pub(crate) width_px: usize,
    pub(crate) height_px: usize,
    /// Planes of the object's code, then of the part's, row-major. NaN, which matches nothing, if less than half of
    /// the light is blocked. The part's planes are empty if they were left out.
    pub planes: [Vec<f32>; CODE_CHANNELS],
}

impl CodeMap {
    /// Blends the `codes` of the Gaussians of `cloud`, those of parts only if `parts`.
    pub fn render(
        renderer: &mut Renderer,
        cloud: &GaussianCloud,
        codes: &[[f32; CODE_CHANNELS]],
        parts: bool,
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Result<Self, RenderError> {
        let of_objects: Vec<f32> = match parts {
            true => Vec::new(),
            false => codes.iter().flat_map(|c| &c[..OBJECT_CHANNELS]).copied().collect(),
        };
        let features = match parts {
            true => Features { channels: CODE_CHANNELS, values: codes.as_flattened() },
            false => Features { channels: OBJECT_CHANNELS, values: &of_objects },
        };
        let settings = RenderSettings { sh_degree: 0, depth: false, ..settings.clone() };
        let frame = renderer.render(cloud, features, camera, &settings)?;
        let mut planes: [Vec<f32>; CODE_CHANNELS] = Default::default();
        for (plane, blended) in planes.iter_mut().zip(frame.features) {
            let whole = blended.iter().zip(&frame.alpha);
            *plane = whole.map(|(code, alpha)| if *alpha < 0.5 { f32::NAN } else { code / alpha }).collect();
        }
        Ok(Self { width_px: frame.width_px, height_px: frame.height_px, planes })
    }

    pub(crate) fn level(&self, level: Level) -> &[Vec<f32>] {
        let (object, part) = self.planes.split_at(OBJECT_CHANNELS);
        if level == Level::Object { object } else { part }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn codes_are_means_weighed_by_what_is_seen() {
        // Two Gaussians in one place: both blend, and half of their light is not blocked further out.
        let cloud = GaussianCloud {
            opacity_logits: vec![0.0, 4.0],
            ..GaussianCloud::isotropic(vec![[0.0; 3], [0.0, 0.0, 0.1]], -1.2, 0.0)
        };
        let camera =
            Camera::look_at(DVec3::new(0.0, 0.0, -4.0), DVec3::ZERO, DVec3::NEG_Y, 0.8, 61, 41).expect("valid");
        let codes = [[1.0, 0.0, 0.25, 0.5, 1.0, 0.0], [0.0, 1.0, 0.25, 0.5, 0.0, 1.0]];
        let settings = RenderSettings::default();
        let mut renderer = Renderer::new();
        let map = CodeMap::render(&mut renderer, &cloud, &codes, true, &camera, &settings).expect("drawn");
        assert_eq!((map.width_px, map.height_px, map.level(Level::Part).len()), (61, 41, 3));
        let at = |c: usize| map.planes[c][20 * 61 + 30];
        // In the middle the first takes half, the second 0.98 of the rest: 0.5 and 0.49 of 0.99.
        let second = 0.5 / (1.0 + (-4.0_f32).exp());
        let share = 0.5 / (0.5 + second);
        let expected = [share, 1.0 - share, 0.25, 0.5, share, 1.0 - share];
        assert!(
            (0..6).all(|c| (at(c) - expected[c]).abs() < 2e-3),
            "{:?} {expected:?}",
            (0..6).map(at).collect::<Vec<_>>()
        );
        // NaN where less than half of the light is blocked, and nowhere else.
        let frame = renderer.render(&cloud, Features::NONE, &camera, &settings).expect("drawn");
        assert!(frame.alpha.iter().zip(&map.planes[3]).all(|(a, v)| (*a < 0.5) == v.is_nan()));
        assert!(frame.alpha.iter().any(|a| *a < 0.5) && frame.alpha.iter().any(|a| *a >= 0.5));
        // Without parts, those of objects are the same, and there are no others.
        let objects = CodeMap::render(&mut renderer, &cloud, &codes, false, &camera, &settings).expect("drawn");
        let same = |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| a == b || a.is_nan() && b.is_nan());
        assert!(objects.level(Level::Object).iter().zip(map.level(Level::Object)).all(|(a, b)| same(a, b)));
        assert!(objects.level(Level::Part).iter().all(Vec::is_empty) && objects.level(Level::Object).len() == 3);
    }
}
