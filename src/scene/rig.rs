//! Outliers among camera centers, as wrong poses are.

use glam::DVec3;

use super::Camera;
use crate::math::stats::median;

/// Multiple of the median distance from the middle beyond which a camera is far.
const FAR: f64 = 5.0;
/// One in so many cameras may be an outlier; if more are far, they were meant to be.
const FEW: usize = 10;
/// Fewest cameras among which outliers are looked for.
const LEAST: usize = 5;

/// Flags of the camera centers that are far from all others.
pub(crate) fn strays(centers: &[DVec3]) -> Vec<bool> {
    let none = vec![false; centers.len()];
    if centers.len() < LEAST {
        return none;
    }
    let along = |axis: usize| median(&centers.iter().map(|c| c[axis]).collect::<Vec<_>>());
    let middle = DVec3::new(along(0), along(1), along(2));
    let distances: Vec<f64> = centers.iter().map(|c| c.distance(middle)).collect();
    let usual = median(&distances);
    let far: Vec<bool> = distances.iter().map(|d| usual > 0.0 && *d > FAR * usual).collect();
    let count = far.iter().filter(|f| **f).count();
    if count <= (centers.len() / FEW).max(1) { far } else { none }
}

/// These cameras without those far from all others.
pub(super) fn together<'a>(cameras: impl Iterator<Item = &'a Camera>) -> impl Iterator<Item = &'a Camera> {
    let cameras: Vec<&Camera> = cameras.collect();
    let far = strays(&cameras.iter().map(|c| c.center).collect::<Vec<_>>());
    cameras.into_iter().zip(far).filter(|(_, far)| !far).map(|(c, _)| c)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(n: usize) -> Vec<DVec3> {
        let at = |i: usize| std::f64::consts::TAU * i as f64 / n as f64;
        (0..n).map(|i| DVec3::new(at(i).cos(), at(i).sin(), 0.3)).collect()
    }

    #[test]
    fn one_wild_camera_is_found_and_a_long_walk_has_none() {
        let mut centers = ring(20);
        assert!(!strays(&centers).contains(&true));
        centers.push(DVec3::new(300.0, 0.0, 0.0));
        assert_eq!(strays(&centers).iter().position(|s| *s), Some(20));
        let walk: Vec<DVec3> = (0..200).map(|i| DVec3::X * f64::from(i)).collect();
        assert!(!strays(&walk).contains(&true));
        // Two groups: many are far, so none is wild.
        let two: Vec<DVec3> = (0..20).map(|i| ring(20)[i] + DVec3::X * if i < 4 { 90.0 } else { 0.0 }).collect();
        assert!(!strays(&two).contains(&true));
        assert!(!strays(&[DVec3::ZERO; 30]).contains(&true) && strays(&[]).is_empty());
    }

    #[test]
    fn extent_and_focus_do_not_change_with_a_wild_camera() {
        let camera = |c: DVec3, to: DVec3| Camera::look_at(c, to, DVec3::Z, 0.8, 64, 48).expect("valid");
        let mut cameras: Vec<Camera> = ring(24).into_iter().map(|c| camera(c, DVec3::ZERO)).collect();
        let (extent, focus) = (Camera::extent_of(cameras.iter()), Camera::focus_of(cameras.iter()));
        cameras.push(camera(DVec3::new(500.0, -200.0, 90.0), DVec3::new(600.0, 0.0, 0.0)));
        assert_eq!((Camera::extent_of(cameras.iter()), Camera::focus_of(cameras.iter())), (extent, focus));
        // Negative control: one that is not far counts.
        cameras.push(camera(DVec3::new(3.0, 0.0, 0.0), DVec3::ZERO));
        assert!(Camera::extent_of(cameras.iter()).1 > 2.0 * extent.1);
    }
}
