//! Gaussians as they are drawn: without bands that are zero, and with a near plane that fits their size.

use std::sync::Arc;

use crate::render::RenderSettings;
use crate::scene::plan::used_degree;
use crate::scene::resource_log::{self, ResourceKind};
use crate::scene::{Bounds, Camera, GaussianCloud};

/// Returns the near plane's distance for Gaussians without cameras. Small scenes would lie before the default one; in
/// large ones, near things may be visible, too.
pub(super) fn near_without_cameras(cloud: &GaussianCloud) -> f64 {
    let usual = RenderSettings::default().near;
    let bounds = Bounds::robust((0..cloud.len()).map(|i| cloud.world_position(i)));
    let near = bounds.map_or(0.0, |b| Camera::near_plane(b.radius()));
    if near > 0.0 { usual.min(near) } else { usual }
}

/// Drops zero bands of spherical harmonics; returns the degree in the file, too.
pub(super) fn compact(cloud: GaussianCloud) -> (Arc<GaussianCloud>, u8) {
    let stored = cloud.sh_degree;
    let used = used_degree(&cloud);
    let cloud = cloud.up_to_degree(used);
    resource_log::record(
        ResourceKind::Gaussians,
        crate::math::format::things(cloud.len(), "Gaussian"),
        "the scene was opened",
        cloud.bytes(),
    );
    (Arc::new(cloud), stored)
}
