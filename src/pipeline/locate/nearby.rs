//! Alignment of photos whose poses are nearly right: the colors alone, from small pictures to the photo's own size.

use std::sync::Arc;

use super::align::{STEPS, align};
use super::gallery::Gallery;
use super::photometric::PhotoLevel;
use super::{LEVELS_PX, LocateError};
use crate::pipeline::observer::Silent;
use crate::render::RenderSettings;
use crate::scene::{Camera, GaussianCloud, PhotoPixels};

/// A scene with which photos are aligned.
pub(crate) struct PoseAligner {
    gallery: Gallery,
}

impl PoseAligner {
    pub(crate) fn new(cloud: Arc<GaussianCloud>, settings: &RenderSettings) -> Result<Self, LocateError> {
        Ok(Self { gallery: Gallery::new(cloud, settings, &[], &mut Silent)? })
    }

    /// The pose near `start` at which the scene looks most like the photo, whatever its exposure; the focal length is
    /// held. `start` has the photo's size.
    pub(crate) fn aligned(&mut self, photo: &PhotoPixels, start: &Camera) -> Result<Camera, LocateError> {
        let own = photo.width_px.max(photo.height_px);
        let mut camera = start.clone();
        for px in LEVELS_PX.into_iter().filter(|px| *px < own).chain([own]) {
            let size = start.limited_to(px);
            let level = PhotoLevel::of(photo, size.width_px as usize, size.height_px as usize);
            let from = camera.resized(size.width_px, size.height_px);
            camera = align(&mut self.gallery, &level, &from, None, STEPS)?.camera;
        }
        Ok(Camera { world_from_camera: camera.world_from_camera, center: camera.center, ..start.clone() })
    }
}
