//! A box that Gaussians are cropped to, by their centers.

use glam::DVec3;

use super::{Bounds, GaussianCloud};

/// Part of a cloud that is kept: inside a box, or outside it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CropBox {
    /// The box; its faces belong to it.
    pub bounds: Bounds,
    /// True if the outside is kept.
    pub outside: bool,
}

impl CropBox {
    /// Returns whether a point is kept.
    pub(crate) fn keeps(&self, p: DVec3) -> bool {
        let inside = p.cmpge(self.bounds.min).all() && p.cmple(self.bounds.max).all();
        inside != self.outside
    }

    /// The numbers of the Gaussians that are kept.
    pub(crate) fn kept(&self, cloud: &GaussianCloud) -> Vec<usize> {
        (0..cloud.len()).filter(|&i| self.keeps(cloud.world_position(i))).collect()
    }

    /// The Gaussians that are kept.
    pub fn crop(&self, cloud: &GaussianCloud) -> GaussianCloud {
        cloud.select(&self.kept(cloud))
    }

    /// Puts one face, the higher one of its axis or the lower, elsewhere; never beyond the one opposite.
    pub(crate) fn put_face(&mut self, axis: usize, high: bool, at: f64) {
        let Bounds { min, max } = &mut self.bounds;
        match high {
            true => max[axis] = at.max(min[axis]),
            false => min[axis] = at.min(max[axis]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_keeps_what_is_in_it_or_all_else() {
        let positions = (0..5).map(|i| [i as f32, 0.0, 0.0]).collect();
        let cloud =
            GaussianCloud { origin: DVec3::new(10.0, 0.0, 0.0), ..GaussianCloud::isotropic(positions, 0.0, 0.0) };
        let bounds = Bounds { min: DVec3::new(11.0, -1.0, 0.0), max: DVec3::new(13.0, 1.0, 0.0) };
        let xs = |crop: CropBox| crop.crop(&cloud).positions.iter().map(|p| p[0] as i32).collect::<Vec<_>>();
        let mut crop = CropBox { bounds, outside: false };
        assert_eq!(xs(crop), [1, 2, 3], "its faces belong to it, and the cloud's origin counts");
        assert_eq!(xs(CropBox { outside: true, ..crop }), [0, 4]);
        crop.put_face(0, false, 12.5);
        assert_eq!(xs(crop), [3]);
        crop.put_face(0, true, 5.0);
        assert_eq!((crop.bounds.max.x, crop.bounds.min.x), (12.5, 12.5), "no face passes the one opposite");
        assert!(!crop.keeps(DVec3::NAN));
    }
}
