//! Axis-aligned boxes and robust extents of point sets.

use glam::DVec3;

/// An axis-aligned box in world space, in scene units.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Bounds {
    /// Smallest corner.
    pub min: DVec3,
    /// Largest corner.
    pub max: DVec3,
}

impl Bounds {
    /// The box of the finite points, or `None` if there are none.
    pub(crate) fn of(points: impl IntoIterator<Item = DVec3>) -> Option<Self> {
        let mut finite = points.into_iter().filter(|p| p.is_finite());
        let first = finite.next()?;
        let start = Self { min: first, max: first };
        Some(finite.fold(start, |b, p| Self { min: b.min.min(p), max: b.max.max(p) }))
    }

    /// The box from the 2nd to the 98th percentile on each axis: the scene without its stray points.
    pub fn robust(points: impl IntoIterator<Item = DVec3>) -> Option<Self> {
        let points: Vec<DVec3> = points.into_iter().filter(|p| p.is_finite()).collect();
        if points.is_empty() {
            return None;
        }
        let last = points.len() - 1;
        let (lo, hi) = ((last as f64 * 0.02) as usize, (last as f64 * 0.98).ceil() as usize);
        let ends = |axis: usize| {
            let mut v: Vec<f64> = points.iter().map(|p| p[axis]).collect();
            let min = *v.select_nth_unstable_by(lo, f64::total_cmp).1;
            // Values before `lo` are smaller already.
            [min, *v[lo..].select_nth_unstable_by(hi - lo, f64::total_cmp).1]
        };
        let (x, (y, z)) = rayon::join(|| ends(0), || rayon::join(|| ends(1), || ends(2)));
        let [min, max] = [0, 1].map(|end| DVec3::new(x[end], y[end], z[end]));
        Some(Self { min, max })
    }

    /// The middle.
    pub fn center(&self) -> DVec3 {
        (self.min + self.max) * 0.5
    }

    /// The corners: bit 0, 1 or 2 of an index is set where x, y or z is that of the largest.
    pub(crate) fn corners(&self) -> [DVec3; 8] {
        let Self { min, max } = self;
        std::array::from_fn(|i| {
            DVec3::from_array(std::array::from_fn(|axis| if i >> axis & 1 == 1 { max[axis] } else { min[axis] }))
        })
    }

    pub(crate) fn size(&self) -> DVec3 {
        self.max - self.min
    }

    /// Half the diagonal.
    pub fn radius(&self) -> f64 {
        self.size().length() * 0.5
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn robust_bounds_ignore_strays() {
        let mut points: Vec<DVec3> = (0..1000).map(|i| DVec3::splat(f64::from(i) / 1000.0)).collect();
        points.push(DVec3::splat(1e9));
        points.push(DVec3::NAN);
        let b = Bounds::robust(points).expect("not empty");
        assert!(b.max.x < 1.0 && b.min.x < 0.03);
        assert!(Bounds::of([DVec3::NAN]).is_none());
    }

    #[test]
    fn boxes_hold_their_points() {
        let points = [DVec3::new(1.0, -2.0, 3.0), DVec3::new(-1.0, 4.0, 3.0), DVec3::splat(f64::NAN)];
        let b = Bounds::of(points).expect("some");
        assert_eq!((b.min, b.max), (DVec3::new(-1.0, -2.0, 3.0), DVec3::new(1.0, 4.0, 3.0)));
        assert_eq!((b.center(), b.size()), (DVec3::new(0.0, 1.0, 3.0), DVec3::new(2.0, 6.0, 0.0)));
        assert_eq!((Bounds::of([DVec3::NAN]), Bounds::robust([DVec3::NAN])), (None, None));
        // 0 to 100: from the second to the 98th of a hundred steps.
        let line = Bounds::robust((0..=100).map(|i| DVec3::splat(f64::from(i)))).expect("some");
        assert_eq!((line.min.x, line.max.y), (2.0, 98.0));
        assert_eq!(Bounds::robust([DVec3::ONE]).map(|b| b.size()), Some(DVec3::ZERO));
    }

    #[test]
    fn the_radius_is_half_the_diagonal() {
        let b = Bounds { min: DVec3::new(-1.0, -1.0, 0.0), max: DVec3::new(1.0, 2.0, 6.0) };
        assert_eq!(b.radius(), 3.5);
    }
}
