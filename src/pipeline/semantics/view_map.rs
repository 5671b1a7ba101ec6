//! Identities of all pixels of a view, exactly: the one with the largest accumulated weight.
//!
//! Rendered once per view; queries only read it.

use crate::render::{
    BLUR_PX2, DrawError, LabelWinner, RenderError, RenderSettings, Renderer, ViewWeights, label_winners,
};
use crate::scene::{Camera, GaussianCloud, Identities, IdentityId, Mask};

/// Least blur with which identities are drawn, px²: with less, things get gaps.
pub(crate) const LEAST_BLUR_PX2: f64 = 0.1;

/// Identities of a view's pixels, row-major.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ViewMap {
    /// Width in px.
    pub width_px: usize,
    /// Height in px.
    pub height_px: usize,
    /// Innermost identity; `NO_IDENTITY` if none wins or the pixel is empty, `UNKNOWN` if Gaussians without a vote win.
    pub identity: Vec<IdentityId>,
    /// Share of the winner's object in the pixel's weight.
    pub(crate) share: Vec<f32>,
    pub(crate) alpha: Vec<f32>,
}

impl ViewMap {
    /// Creates opaque pixels with shares of 1, in rows of `width_px`.
    pub(crate) fn certain(width_px: usize, identity: Vec<IdentityId>) -> Self {
        let n = identity.len();
        Self { width_px, height_px: n / width_px.max(1), identity, share: vec![1.0; n], alpha: vec![1.0; n] }
    }

    /// Renders the identities `of` the Gaussians of `cloud`.
    pub fn render(
        renderer: &mut Renderer,
        cloud: &GaussianCloud,
        of: &[IdentityId],
        identities: &Identities,
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Result<Self, DrawError> {
        let settings = settings_for(identities, settings);
        let winners = renderer.label_winners(cloud, (of, &objects(identities)), camera, &settings)?;
        Ok(Self::of_winners(camera.width_px as usize, &winners))
    }

    /// The same on the CPU, of a view that further passes may follow.
    pub(crate) fn of(
        view: &mut ViewWeights<'_>,
        of: &[IdentityId],
        identities: &Identities,
    ) -> Result<Self, RenderError> {
        let winners = label_winners(view, (of, &objects(identities)))?;
        Ok(Self::of_winners(view.size_px()[0], &winners))
    }

    fn of_winners(width_px: usize, winners: &[LabelWinner]) -> Self {
        let height_px = winners.len() / width_px.max(1);
        let (identity, (share, alpha)) = winners.iter().map(|w| (w.label, (w.share, w.alpha))).unzip();
        Self { width_px, height_px, identity, share, alpha }
    }

    /// Returns the pixels of an identity and its pieces.
    pub fn mask(&self, identities: &Identities, id: IdentityId) -> Mask {
        let inside = identities.descendants(id);
        Mask::from_fn(self.width_px, self.height_px, |i| {
            inside.get(self.identity[i] as usize).copied().unwrap_or(false)
        })
    }
}

/// Settings for drawing identities. A file may say anything, so a blur counts only if it is one that may be found.
fn settings_for(identities: &Identities, settings: &RenderSettings) -> RenderSettings {
    let blur = identities.blur_px2.map(f64::from).filter(|b| (LEAST_BLUR_PX2..=BLUR_PX2).contains(b));
    settings.blurred_by(blur.unwrap_or(settings.blur_px2))
}

/// The object of each identity.
fn objects(identities: &Identities) -> Vec<IdentityId> {
    (0..=identities.len() as IdentityId).map(|i| identities.object_of(i)).collect()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::{Level, NO_IDENTITY};

    #[test]
    fn what_stands_in_front_hides_what_is_behind() {
        let mut all = Identities::default();
        let (front, behind) =
            (all.add(Level::Object, NO_IDENTITY, vec![]), all.add(Level::Object, NO_IDENTITY, vec![]));
        let cloud = GaussianCloud {
            log_scales: vec![[-1.8; 3], [-0.9; 3]],
            ..GaussianCloud::isotropic(vec![[0.0, 0.0, -0.5], [0.0, 0.0, 0.5]], 0.0, 4.0)
        };
        let camera =
            Camera::look_at(DVec3::new(0.0, 0.0, -3.0), DVec3::ZERO, DVec3::NEG_Y, 0.6, 50, 37).expect("valid");
        let settings = RenderSettings::default();
        let mut renderer = Renderer::new();
        let map = ViewMap::render(&mut renderer, &cloud, &[front, behind], &all, &camera, &settings).expect("drawn");
        let frame = renderer.render(&cloud, crate::render::Features::NONE, &camera, &settings).expect("drawn");
        for (a, b) in map.alpha.iter().zip(&frame.alpha) {
            assert!((a - b).abs() < 1e-4, "{a} {b}");
        }
        assert_eq!(map.identity[18 * 50 + 25], front);
        let (a, b) = (map.mask(&all, front), map.mask(&all, behind));
        assert!(b.area() > a.area() && a.overlap(&b) == 0 && !a.is_empty());
        // From the other side, the order is reversed.
        let back = Camera::look_at(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, DVec3::NEG_Y, 0.6, 50, 37).expect("valid");
        let map = ViewMap::render(&mut renderer, &cloud, &[front, behind], &all, &back, &settings).expect("drawn");
        assert!(map.mask(&all, front).is_empty());
    }

    #[test]
    fn a_line_thinner_than_a_pixel_keeps_its_pixels() {
        let mut all = Identities::default();
        let (wall, line) = (all.add(Level::Object, NO_IDENTITY, vec![]), all.add(Level::Object, NO_IDENTITY, vec![]));
        let camera =
            Camera::look_at(DVec3::new(0.0, 0.0, -2.0), DVec3::ZERO, DVec3::NEG_Y, 0.6, 51, 37).expect("valid");
        // Its deviation is 0.3 px, and its middle that of a column of pixels.
        let width = (0.3 * 2.0 / camera.focal_px.x).ln() as f32;
        let cloud = GaussianCloud {
            log_scales: vec![[width, -1.8, width], [1.0; 3]],
            ..GaussianCloud::isotropic(vec![[0.0; 3], [0.0, 0.0, 1.0]], 0.0, 6.0)
        };
        let (of, mut renderer) = ([line, wall], Renderer::new());
        let settings = RenderSettings { antialias: true, ..RenderSettings::default() };
        let mut columns = |all: &Identities| -> Vec<usize> {
            let map = ViewMap::render(&mut renderer, &cloud, &of, all, &camera, &settings).expect("drawn");
            map.mask(all, line).pixels().map(|i| i % 51).collect()
        };
        assert!(columns(&all).is_empty(), "the control: with the blur of pictures, nothing of it is left");
        all.blur_px2 = Some(0.2);
        let found = columns(&all);
        assert!(found.len() >= 5 && found.iter().all(|x| *x == 25), "{found:?}");
        for nonsense in [f32::NAN, -1.0, 0.0, 1e9] {
            all.blur_px2 = Some(nonsense);
            assert!(columns(&all).is_empty(), "as without one");
        }
    }
}
