//! A set of posed photos with whatever sparse geometry came with it.

use std::path::{Path, PathBuf};

use glam::DVec3;

use super::rig;
use super::{AlphaUse, Bounds, Camera, Photo};

/// Posed photos, as read from any of the supported layouts.
#[derive(Clone, Debug, Default)]
pub struct Dataset {
    /// Short name for titles: the folder's.
    pub name: String,
    pub(crate) root: PathBuf,
    /// Path to reopen it by, if that is not [`Self::root`]: one of several files or reconstructions.
    pub(crate) source: Option<PathBuf>,
    /// Layout that it was read from, for display: "COLMAP binary", "transforms.json", ...
    pub format: String,
    /// The photos that exist, sorted by name.
    pub photos: Vec<Photo>,
    /// Sparse points, possibly none.
    pub points: Vec<SparsePoint>,
    /// The color behind everything (Blender's renders are composited over it); `None` = unknown.
    pub(crate) background: Option<[f32; 3]>,
    /// Meaning of transparent pixels of its photos; `None` = there are none.
    pub(crate) alpha: Option<AlphaUse>,
    /// Length of a scene unit in meters, if known; photos alone do not determine it.
    pub(crate) meters_per_unit: Option<f64>,
    /// Warnings for the user: photos that are listed but missing, and so on.
    pub warnings: Vec<String>,
}

/// A point of a structure-from-motion reconstruction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SparsePoint {
    /// World position, scene units.
    pub position: DVec3,
    /// sRGB color.
    pub(crate) rgb: [u8; 3],
}

impl Dataset {
    /// Indices of the photos to train on and of those held out. Photos that the dataset marks as
    /// test are held out; without such marks it is every `every`-th of the sorted list, starting
    /// with the first (the convention of the 3DGS literature). `every == 0` holds none out.
    pub(crate) fn split(&self, every: usize) -> (Vec<usize>, Vec<usize>) {
        let every = super::plan::holdout(self.photos.len(), every);
        let marked = self.test_photos() > 0;
        (0..self.photos.len()).partition(|&i| {
            let held = if marked { self.photos[i].test_split } else { every > 0 && i % every == 0 };
            !held
        })
    }

    /// Path to reopen it by.
    pub(crate) fn source(&self) -> &Path {
        self.source.as_deref().unwrap_or(&self.root)
    }

    /// Number of photos that the dataset marks as test.
    pub(crate) fn test_photos(&self) -> usize {
        self.photos.iter().filter(|p| p.test_split).count()
    }

    /// The cameras of all photos.
    pub fn cameras(&self) -> Vec<super::Camera> {
        self.photos.iter().map(|p| p.camera.clone()).collect()
    }

    /// Mean camera center, and 1.1 times the largest distance from it: the `extent` that
    /// position learning rates and densification thresholds scale with (3DGS `getNerfppNorm`).
    /// Cameras far from all others do not count.
    pub(crate) fn camera_extent(&self) -> (DVec3, f64) {
        Camera::extent_of(self.photos.iter().map(|p| &p.camera))
    }

    /// Indices of photos whose cameras stand far from all others, as wrong poses do.
    pub(crate) fn strays(&self) -> Vec<usize> {
        let centers: Vec<DVec3> = self.photos.iter().map(|p| p.camera.center).collect();
        let stray = rig::strays(&centers);
        (0..stray.len()).filter(|&i| stray[i]).collect()
    }

    /// A warning that names those photos, if there are any.
    pub(crate) fn stray_warning(&self) -> Option<String> {
        let strays = self.strays();
        let first = strays.first()?;
        let (center, extent) = self.camera_extent();
        let times = self.photos[*first].camera.center.distance(center) / extent;
        let of = if strays.len() == 1 {
            "The camera of 1 photo stands".into()
        } else {
            format!("The cameras of {} photos stand", strays.len())
        };
        Some(format!(
            "{of} far from all others (first: {}, {times:.0} times as far as the rest); sizes are taken without, but if its pose \
             is wrong, leave it out",
            self.photos[*first].title()
        ))
    }

    /// World up direction: the negated mean of the cameras' down axes, or `+z` if they cancel.
    pub(crate) fn up(&self) -> DVec3 {
        Camera::up_of(self.photos.iter().map(|p| &p.camera)).unwrap_or(DVec3::Z)
    }

    /// Point nearest to all viewing axes. If the axes are parallel: the center of the sparse points without stray ones,
    /// or a point in front of the first camera.
    pub(crate) fn focus(&self) -> DVec3 {
        if let Some(focus) = Camera::focus_of(self.photos.iter().map(|p| &p.camera)) {
            return focus;
        }
        Bounds::robust(self.points.iter().map(|p| p.position)).map_or_else(
            || self.photos.first().map_or(DVec3::ZERO, |p| p.camera.center + p.camera.forward()),
            |b| b.center(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Camera;

    fn ring(n: usize) -> Dataset {
        let photos = (0..n)
            .map(|i| {
                let a = i as f64 / n as f64 * std::f64::consts::TAU;
                let eye = DVec3::new(3.0 * a.cos(), 3.0 * a.sin(), 1.0);
                Photo::new(
                    format!("{i:03}.png"),
                    PathBuf::new(),
                    Camera::look_at(eye, DVec3::ZERO, DVec3::Z, 0.8, 64, 48).expect("valid"),
                )
            })
            .collect();
        Dataset { photos, ..Dataset::default() }
    }

    #[test]
    fn every_eighth_is_held_out() {
        let (train, test) = ring(17).split(8);
        assert_eq!(test, vec![0, 8, 16]);
        assert_eq!(train.len(), 14);
        assert!(ring(5).split(0).1.is_empty());
    }

    #[test]
    fn a_ring_of_cameras_has_its_focus_and_up() {
        let d = ring(12);
        assert!(d.focus().length() < 1e-9);
        assert!(d.up().dot(DVec3::Z) > 0.999);
        let (mean, extent) = d.camera_extent();
        assert!((mean - DVec3::Z).length() < 1e-9 && (extent - 3.3).abs() < 1e-9);
    }

    #[test]
    fn the_focus_is_what_is_looked_at_and_parallel_views_have_that_of_their_points() {
        let mut d = ring(7);
        let shift = DVec3::new(2.0, -1.0, 0.5);
        d.photos.iter_mut().for_each(|p| p.camera.center += shift);
        assert!((d.focus() - shift).length() < 1e-9, "{}", d.focus());
        assert_eq!(d.cameras(), d.photos.iter().map(|p| p.camera.clone()).collect::<Vec<_>>());
        // Side by side, all looking the same way: no point is nearest to all axes.
        let first = d.photos[0].camera.clone();
        for (i, p) in d.photos.iter_mut().enumerate() {
            p.camera = Camera { center: first.center + first.world_from_camera.x_axis * i as f64, ..first.clone() };
        }
        assert!((d.focus() - (first.center + first.forward())).length() < 1e-9);
        assert_eq!(Dataset::default().focus(), DVec3::ZERO);
        assert_eq!(Dataset::default().camera_extent(), (DVec3::ZERO, 1.0));
    }
}
