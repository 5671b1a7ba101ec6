//! Codes of a view's pixels, blended as the paper does: both levels in one pass, divided by alpha.

use crate::render::cpu::Renderer;
use crate::render::{Features, RenderError, RenderSettings};
use crate::scene::semantic_map::CODE_CHANNELS;
use crate::scene::{Camera, GaussianCloud, Level};

/// Channels of an object's code, which come first.
const OBJECT_CHANNELS: usize = CODE_CHANNELS / 2;

/// Blended codes of a view.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CodeMap {
    /// Width in px.
    pub width_px: usize,
    /// Height in px.
    pub height_px: usize,
    /// Planes of the object's code, then of the part's, row-major. NaN, which nothing matches, where
    /// less than half of the light is blocked. The part's are empty where they were left out.
    pub planes: [Vec<f32>; CODE_CHANNELS],
}

impl CodeMap {
    /// Blends the `codes` of the Gaussians of `cloud`, those of parts only if there are `parts`.
    ///
    /// # Errors
    /// If the camera is not usable or there is not one set of codes per Gaussian.
    pub fn render(
        renderer: &mut Renderer<f32>,
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

    /// The three planes of a level.
    pub fn level(&self, level: Level) -> &[Vec<f32>] {
        let (object, part) = self.planes.split_at(OBJECT_CHANNELS);
        if level == Level::Object { object } else { part }
    }
}
