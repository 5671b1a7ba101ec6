//! Weights of the Gaussians in a view, in as many passes as are wanted. Only the first projects, bins and sorts, and none
//! of a view that was kept.

use super::CpuRenderer;
use super::contributions::ContributionSink;
use super::kept_view::{KeptView, NotingSink, TileNotes};
use crate::render::{RenderError, RenderSettings};
use crate::scene::{Camera, GaussianCloud};

/// A view of a cloud whose weights are handed out.
pub(crate) struct ViewWeights<'a> {
    pub(crate) cloud: &'a GaussianCloud,
    pub(crate) camera: &'a Camera,
    source: Source<'a>,
    /// Notes of the first pass, if the view is to be kept.
    notes: Option<Vec<TileNotes>>,
}

enum Source<'a> {
    /// A renderer, and true if its last frame is this view.
    Drawn(&'a mut CpuRenderer<f32>, &'a RenderSettings, bool),
    Kept(&'a KeptView),
}

impl<'a> ViewWeights<'a> {
    /// The view through `camera`. If it `is_ready`, the renderer's last frame must be of it, seen alike.
    pub(crate) fn drawn(
        renderer: &'a mut CpuRenderer<f32>,
        cloud: &'a GaussianCloud,
        camera: &'a Camera,
        settings: &'a RenderSettings,
        is_ready: bool,
    ) -> Self {
        Self { cloud, camera, source: Source::Drawn(renderer, settings, is_ready), notes: None }
    }

    /// A view that was kept, of this cloud through this camera.
    pub(crate) fn kept(kept: &'a KeptView, cloud: &'a GaussianCloud, camera: &'a Camera) -> Self {
        Self { cloud, camera, source: Source::Kept(kept), notes: None }
    }

    /// The same, which can be kept after the first pass.
    pub(crate) fn noting(self) -> Self {
        Self { notes: Some(Vec::new()), ..self }
    }

    /// Hands the weight of every Gaussian at every pixel to `sinks`, one for each row of tiles.
    pub(crate) fn give<S: ContributionSink<f32>>(&mut self, sinks: &mut [S]) -> Result<(), RenderError> {
        if self.notes.as_ref().is_none_or(|notes| !notes.is_empty()) {
            return self.hand(sinks);
        }
        let mut noting: Vec<NotingSink<'_, S>> = sinks.iter_mut().map(NotingSink::new).collect();
        self.hand(&mut noting)?;
        self.notes = Some(noting.into_iter().map(|sink| sink.notes).collect());
        Ok(())
    }

    fn hand<S: ContributionSink<f32>>(&mut self, sinks: &mut [S]) -> Result<(), RenderError> {
        match &mut self.source {
            Source::Kept(kept) => {
                kept.give(sinks);
                Ok(())
            }
            Source::Drawn(renderer, settings, is_ready) => match std::mem::replace(is_ready, true) {
                true => renderer.contributions_again(self.cloud, self.camera, settings, sinks),
                false => renderer.contributions(self.cloud, self.camera, settings, sinks),
            },
        }
    }

    /// Keeps the view, if notes of it were taken.
    pub(crate) fn keep(self) -> Option<KeptView> {
        match self.source {
            Source::Drawn(renderer, ..) => renderer.keep(&self.notes?),
            Source::Kept(_) => None,
        }
    }

    /// Width and height, px.
    pub(crate) fn size_px(&self) -> [usize; 2] {
        [self.camera.width_px as usize, self.camera.height_px as usize]
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::math::lanes::Lane;
    use crate::render::{Features, TILE_PX};

    /// Notes every call.
    #[derive(Clone, Debug, Default, PartialEq)]
    struct Calls(Vec<(u32, usize, usize, Lane<f32>)>);

    impl ContributionSink<f32> for Calls {
        fn add(&mut self, gaussian: u32, x: usize, y: usize, weights: &Lane<f32>) {
            self.0.push((gaussian, x, y, *weights));
        }
    }

    fn calls(view: &mut ViewWeights<'_>) -> Vec<Calls> {
        let mut rows = vec![Calls::default(); view.size_px()[1].div_ceil(TILE_PX)];
        view.give(&mut rows).expect("given");
        rows
    }

    /// Asserts that a kept view gives every weight of the drawn one. Drawing ends a tile at the splat that makes it
    /// opaque, or some splats later: what a kept view gives beyond that is what light is left there.
    fn assert_alike(kept: &[Calls], drawn: &[Calls]) {
        let most = 2.0 * crate::render::TRANSMITTANCE_MIN as f32;
        assert_eq!(kept.len(), drawn.len());
        for (kept, drawn) in kept.iter().zip(drawn) {
            let mut left = drawn.0.iter().peekable();
            for call in &kept.0 {
                if left.next_if_eq(&call).is_none() {
                    assert!(call.3.iter().all(|weight| *weight < most), "{call:?}");
                }
            }
            assert_eq!(left.next(), None, "a weight is missing");
        }
    }

    /// A cloud of 5,000 in three layers, of which the first hides much of the others.
    fn cloud() -> GaussianCloud {
        let mut random = 11_u32;
        let mut next = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 8) as f32 / (1 << 24) as f32
        };
        let places = (0..5_000).map(|i| [3.0 * next() - 1.5, 3.0 * next() - 1.5, (i % 3) as f32]).collect();
        GaussianCloud::isotropic(places, -2.5, 3.0)
    }

    fn camera(x: f64) -> Camera {
        Camera::look_at(DVec3::new(x, 0.2, -3.0), DVec3::ZERO, DVec3::NEG_Y, 0.7, 75, 52).expect("valid")
    }

    #[test]
    fn a_kept_view_gives_the_weights_of_a_drawn_one() {
        let (cloud, camera, settings) = (cloud(), camera(0.0), RenderSettings::default());
        let mut renderer = CpuRenderer::forward_only();
        let drawn = calls(&mut ViewWeights::drawn(&mut renderer, &cloud, &camera, &settings, false));
        let mut view = ViewWeights::drawn(&mut renderer, &cloud, &camera, &settings, false).noting();
        assert_eq!(calls(&mut view), drawn, "noting changes nothing");
        assert_eq!(calls(&mut view), drawn, "nor does a second pass");
        let kept = view.keep().expect("kept");
        // The renderer draws something else meanwhile.
        let other = calls(&mut ViewWeights::drawn(&mut renderer, &cloud, &self::camera(0.2), &settings, false));
        assert_ne!(other, drawn, "the control, of another camera");
        assert_alike(&calls(&mut ViewWeights::kept(&kept, &cloud, &camera)), &drawn);
        assert_eq!(kept.size_px(), [75, 52]);
        // Less than all splats in all of their tiles: what is hidden was left out.
        let mut seen: Vec<u32> = drawn.iter().flat_map(|row| &row.0).map(|call| call.0).collect();
        seen.sort_unstable();
        seen.dedup();
        assert!(
            seen.len() < 4_000 && kept.bytes() < 120 * seen.len() + (2_048 * 60),
            "{} {}",
            seen.len(),
            kept.bytes()
        );
        // Without notes, nothing is kept.
        assert!(ViewWeights::drawn(&mut renderer, &cloud, &camera, &settings, false).keep().is_none());
        assert!(ViewWeights::kept(&kept, &cloud, &camera).noting().keep().is_none());
    }

    #[test]
    fn a_picture_with_its_depth_has_the_weights_of_its_view() {
        let (cloud, camera) = (cloud(), camera(0.0));
        let mut renderer = CpuRenderer::forward_only();
        for surfels in [false, true] {
            let settings = RenderSettings { surfels, ..RenderSettings::default() };
            let drawn = calls(&mut ViewWeights::drawn(&mut renderer, &cloud, &camera, &settings, false));
            let with_depth = RenderSettings { depth: true, ..settings.clone() };
            renderer.render(&cloud, Features::NONE, &camera, &with_depth).expect("drawn");
            let mut view = ViewWeights::drawn(&mut renderer, &cloud, &camera, &settings, true).noting();
            assert_eq!(calls(&mut view), drawn, "surfels: {surfels}");
            let kept = view.keep().expect("kept");
            assert_alike(&calls(&mut ViewWeights::kept(&kept, &cloud, &camera)), &drawn);
        }
        // The control: a view that is not the last frame is not ready.
        renderer.render(&cloud, Features::NONE, &self::camera(0.2), &RenderSettings::default()).expect("drawn");
        let settings = RenderSettings::default();
        let stale = calls(&mut ViewWeights::drawn(&mut renderer, &cloud, &camera, &settings, true));
        assert_ne!(stale, calls(&mut ViewWeights::drawn(&mut renderer, &cloud, &camera, &settings, false)));
    }
}
