//! Occupied space: the opacity of every voxel of a scene, and the distance of every point from occupied voxels.
//!
//! A Gaussian of opacity `a` is spread over space with the extinction whose integral along its thinnest axis is
//! `-ln(1 - a)`, so that a ray through it loses as much light as in the renderer. A voxel is occupied if the extinction
//! over its side takes half of the light (the renderer's median depth). Distances to it are exact between voxel centers
//! (Felzenszwalb and Huttenlocher 2012) and interpolated between them.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use crate::math::distance::squared_distances;
use crate::math::real::Real;
use crate::math::rotation::matrix_from_quaternion;
use crate::scene::{Bounds, GaussianCloud};

/// Voxels along the longest side of the grid.
const VOXELS: usize = 160;
/// Optical depth over a voxel's side from which it is occupied space: half of the light is taken.
const SOLID: f32 = std::f32::consts::LN_2;
/// Opacity under which a Gaussian is left out.
const FAINT: f64 = 0.02;
/// Standard deviations out to which a Gaussian is spread.
const REACH: f64 = 3.0;
/// Optical depth that a Gaussian has at most.
const MOST_DEPTH: f64 = 6.0;

/// Occupancy of a scene, in a box around all places for cameras.
#[derive(Clone, Debug, PartialEq)]
pub struct OccupancyGrid {
    /// Lower corner of the grid, world.
    corner: DVec3,
    /// Side of a voxel, scene units.
    voxel: f64,
    /// Voxels along x, y, z.
    size: [usize; 3],
    /// Optical depth over a voxel's side, x fastest.
    depth: Vec<f32>,
    /// Distance from each voxel's center to the nearest occupied space, scene units, less half a voxel.
    distance: Vec<f32>,
    /// Samples along every way, instead of as many as the distances demand, to measure their cost; `None` for the
    /// latter.
    pub(crate) samples: Option<u32>,
}

impl OccupancyGrid {
    /// Occupancy of `cloud` in the box that `eyes` and the scene itself span. `eyes` are places of cameras: `free`
    /// around each is empty, whatever the Gaussians say (floaters in front of cameras are the most common fault of
    /// trained scenes).
    pub(crate) fn of(cloud: &GaussianCloud, eyes: &[DVec3], free: f64) -> Self {
        let scene = Bounds::robust((0..cloud.len()).map(|i| cloud.world_position(i)));
        let both = Bounds::of(eyes.iter().copied().chain(scene.into_iter().flat_map(|b| [b.min, b.max])));
        let around = both.unwrap_or(Bounds { min: DVec3::ZERO, max: DVec3::ZERO });
        // Cameras may step back from the outermost photo.
        let margin = 0.2 * around.radius().max(1e-6) + free;
        let (min, max) = (around.min - margin, around.max + margin);
        let voxel = (max - min).max_element() / VOXELS as f64;
        let size = ((max - min) / voxel).to_array().map(|n| (n.ceil() as usize).clamp(1, VOXELS));
        let mut occupancy = Self {
            corner: min,
            voxel,
            size,
            depth: vec![0.0; size.iter().product()],
            distance: Vec::new(),
            samples: None,
        };
        occupancy.spread(cloud);
        occupancy.clear(eyes, free.max(voxel));
        occupancy.measure();
        occupancy
    }

    /// Adds every Gaussian's optical depth.
    fn spread(&mut self, cloud: &GaussianCloud) {
        let [nx, ny, nz] = self.size;
        let (corner, voxel) = (self.corner, self.voxel);
        let blobs: Vec<Blob> = (0..cloud.len()).into_par_iter().filter_map(|i| Blob::of(cloud, i, voxel)).collect();
        // Every slab of z takes the Gaussians that reach into it; no two threads write to one voxel.
        let mut slabs: Vec<Vec<u32>> = vec![Vec::new(); nz];
        for (i, blob) in blobs.iter().enumerate() {
            let lo = ((blob.center.z - blob.reach.z - corner.z) / voxel - 0.5).ceil().max(0.0) as usize;
            let hi = ((blob.center.z + blob.reach.z - corner.z) / voxel - 0.5).floor();
            if hi >= 0.0 {
                (lo..=(hi as usize).min(nz - 1)).for_each(|z| slabs[z].push(i as u32));
            }
        }
        self.depth.par_chunks_mut(nx * ny).zip(&slabs).enumerate().for_each(|(z, (slab, reaching))| {
            for &i in reaching {
                blobs[i as usize].add(slab, corner, voxel, [nx, ny], z);
            }
        });
    }

    /// Empties the voxels within `radius` of places of cameras.
    fn clear(&mut self, eyes: &[DVec3], radius: f64) {
        for eye in eyes {
            let at = |axis: usize, offset: f64| {
                let i = (eye[axis] + offset - self.corner[axis]) / self.voxel - 0.5;
                (i.round().max(0.0) as usize).min(self.size[axis] - 1)
            };
            let [xs, ys, zs] = [0, 1, 2].map(|axis| at(axis, -radius)..=at(axis, radius));
            for z in zs {
                for y in ys.clone() {
                    for x in xs.clone() {
                        if self.center_of(x, y, z).distance(*eye) <= radius {
                            let index = self.index(x, y, z);
                            self.depth[index] = 0.0;
                        }
                    }
                }
            }
        }
    }

    fn measure(&mut self) {
        let solid: Vec<bool> = self.depth.iter().map(|d| *d >= SOLID).collect();
        let squared = squared_distances(&solid, self.size);
        let voxel = self.voxel as f32;
        self.distance = squared.into_par_iter().map(|d| (d.sqrt() - 0.5).max(0.0) * voxel).collect();
    }

    fn index(&self, x: usize, y: usize, z: usize) -> usize {
        (z * self.size[1] + y) * self.size[0] + x
    }

    fn center_of(&self, x: usize, y: usize, z: usize) -> DVec3 {
        self.corner + (DVec3::new(x as f64, y as f64, z as f64) + 0.5) * self.voxel
    }

    /// Side of a voxel, scene units: nothing smaller is known.
    pub(crate) fn voxel(&self) -> f64 {
        self.voxel
    }

    /// Bytes of the grid.
    pub(crate) fn bytes(&self) -> u64 {
        ((self.depth.len() + self.distance.len()) * size_of::<f32>()) as u64
    }

    /// Nearest place to `p` with this clearance, by ascent of the distance field; `None` if it leads to none.
    pub(crate) fn pushed_out(&self, p: DVec3, clearance: f64) -> Option<DVec3> {
        const STEPS: usize = 8;
        let h = 0.5 * self.voxel;
        let mut at = p;
        for _ in 0..STEPS {
            let short = clearance - self.clearance(at);
            if short <= 0.0 {
                return Some(at);
            }
            let slope = |axis: DVec3| self.clearance(at + axis * h) - self.clearance(at - axis * h);
            let away = DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z)).try_normalize()?;
            at += away * (1.1 * short + 1e-3 * self.voxel);
        }
        (self.clearance(at) >= clearance).then_some(at)
    }

    /// Returns whether a point is inside occupied space or outside of the grid, as far as voxels can tell.
    pub(crate) fn is_inside(&self, p: DVec3) -> bool {
        self.clearance(p) < 0.5 * self.voxel
    }

    /// Box of the grid.
    pub(crate) fn bounds(&self) -> Bounds {
        let [x, y, z] = self.size.map(|n| n as f64);
        Bounds { min: self.corner, max: self.corner + DVec3::new(x, y, z) * self.voxel }
    }

    /// Distance from a point to the nearest occupied space, scene units: 0 inside it and outside of the grid, so that
    /// no flight leads there.
    pub(crate) fn clearance(&self, p: DVec3) -> f64 {
        self.known_clearance(p).unwrap_or(0.0)
    }

    /// The same; `None` outside of the grid.
    fn known_clearance(&self, p: DVec3) -> Option<f64> {
        let (base, f) = self.cell(p)?;
        let mut sum = 0.0;
        for corner in 0..8 {
            let bit = [corner & 1, (corner >> 1) & 1, (corner >> 2) & 1];
            let weight: f64 = (0..3).map(|a| if bit[a] == 1 { f[a] } else { 1.0 - f[a] }).product();
            if weight > 0.0 {
                sum +=
                    weight * f64::from(self.distance[self.index(base[0] + bit[0], base[1] + bit[1], base[2] + bit[2])]);
            }
        }
        Some(sum)
    }

    /// Voxel center below a point, and the point's position between it and the next, 0 to 1 per axis.
    fn cell(&self, p: DVec3) -> Option<([usize; 3], [f64; 3])> {
        let q = (p - self.corner) / self.voxel - 0.5;
        let mut base = [0; 3];
        let mut f = [0.0; 3];
        for a in 0..3 {
            // Up to half a voxel beyond the outermost centers the outermost values hold.
            if !(q[a] >= -0.5 && q[a] <= self.size[a] as f64 - 0.5) {
                return None;
            }
            let clamped = q[a].clamp(0.0, (self.size[a] - 1) as f64);
            base[a] = (clamped as usize).min(self.size[a].saturating_sub(2));
            f[a] = if self.size[a] > 1 { clamped - base[a] as f64 } else { 0.0 };
        }
        Some((base, f))
    }

    /// Share of the way from `a` toward `b`, 0 to 1, that keeps at least `clearance` to all occupied space and stays in
    /// the grid.
    ///
    /// Steps are as long as the distance field allows, which changes by no more than the way that is
    /// gone: nothing thicker than a voxel can be stepped over.
    pub(crate) fn free_share(&self, a: DVec3, b: DVec3, clearance: f64) -> f64 {
        let length = a.distance(b);
        if !length.is_finite() {
            return 0.0;
        }
        if !(length > 0.0) {
            return if self.clearance(a) >= clearance { 1.0 } else { 0.0 };
        }
        if let Some(samples) = self.samples {
            let share = |i: u32| f64::from(i) / f64::from(samples.max(1));
            let blocked = |i: &u32| self.clearance(a.lerp(b, share(*i))) < clearance;
            return (0..=samples.max(1)).find(blocked).map_or(1.0, |i| share(i.saturating_sub(1)));
        }
        let shortest = 0.25 * self.voxel;
        let mut gone = 0.0;
        loop {
            let at = (gone / length).min(1.0);
            let spare = self.known_clearance(a.lerp(b, at)).map_or(-1.0, |c| c - clearance);
            if spare < 0.0 {
                return ((gone - shortest).max(0.0) / length).min(1.0);
            }
            if gone >= length {
                return 1.0;
            }
            // Between voxel centers the field may change a little faster than the way that is gone.
            gone = (gone + (0.7 * spare).max(shortest)).min(length);
        }
    }

    /// Returns whether the straight line from `a` to `b` keeps this clearance.
    pub(crate) fn is_free(&self, a: DVec3, b: DVec3, clearance: f64) -> bool {
        self.free_share(a, b, clearance) >= 1.0
    }

    /// Share of the light that comes from `a` to `b`, 0 to 1. Space within `skip` of `b` is left out: the target's
    /// surface does not hide itself.
    pub(crate) fn transmittance(&self, a: DVec3, b: DVec3, skip: f64) -> f64 {
        let length = a.distance(b);
        let reach = length - skip;
        if !(reach > 0.0) {
            return 1.0;
        }
        let steps = (reach / (0.5 * self.voxel)).ceil().clamp(1.0, 4096.0);
        let step = reach / steps;
        let mut depth = 0.0;
        for i in 0..steps as usize {
            let p = a.lerp(b, (i as f64 + 0.5) * step / length);
            depth += f64::from(self.depth_at(p)) * step / self.voxel;
            if depth > 12.0 {
                return 0.0;
            }
        }
        (-depth).exp()
    }

    /// Optical depth over a voxel's side at a point; 0 outside.
    fn depth_at(&self, p: DVec3) -> f32 {
        let q = (p - self.corner) / self.voxel;
        let inside = (0..3).all(|a| q[a] >= 0.0 && q[a] < self.size[a] as f64);
        if inside { self.depth[self.index(q.x as usize, q.y as usize, q.z as usize)] } else { 0.0 }
    }
}

/// A Gaussian, smoothed to the size of voxels.
struct Blob {
    center: DVec3,
    inverse: DMat3,
    /// Half sides of the box that it reaches.
    reach: DVec3,
    /// Optical depth over a voxel's side at its center.
    peak: f64,
}

impl Blob {
    /// `None` if it is too faint or degenerate to count.
    fn of(cloud: &GaussianCloud, i: usize, voxel: f64) -> Option<Self> {
        let g = cloud.gaussian(i);
        let opacity = 1.0 / (1.0 + (-f64::from(g.opacity_logit)).exp());
        if !(opacity > FAINT) {
            return None;
        }
        let rows = matrix_from_quaternion(g.quaternion.map(Real::f64))?;
        let rotation = DMat3::from_cols_array_2d(&rows).transpose();
        let scales = DVec3::from_array(g.log_scale.map(|s| f64::from(s).exp()));
        let thinnest = scales.min_element().max(1e-12);
        // A voxel averages its content: the same as widening by its own variance.
        let wide = scales * scales + voxel * voxel / 12.0;
        let spread = DMat3::from_diagonal(wide);
        let covariance = rotation * spread * rotation.transpose();
        let depth = (-(-opacity).ln_1p()).min(MOST_DEPTH);
        let extinction = depth / ((2.0 * std::f64::consts::PI).sqrt() * thinnest);
        let thinned = (scales / DVec3::from_array(wide.to_array().map(f64::sqrt))).to_array().iter().product::<f64>();
        let reach = DVec3::new(covariance.x_axis.x, covariance.y_axis.y, covariance.z_axis.z);
        let blob = Self {
            center: cloud.world_position(i),
            inverse: rotation * DMat3::from_diagonal(1.0 / wide) * rotation.transpose(),
            reach: DVec3::from_array(reach.to_array().map(f64::sqrt)) * REACH,
            peak: extinction * thinned * voxel,
        };
        let usable =
            blob.inverse.is_finite() && blob.reach.is_finite() && blob.peak.is_finite() && blob.center.is_finite();
        usable.then_some(blob)
    }

    /// Adds it to the slab of voxels at height `z`.
    fn add(&self, slab: &mut [f32], corner: DVec3, voxel: f64, [nx, ny]: [usize; 2], z: usize) {
        let range = |axis: usize, n: usize| {
            let lo = ((self.center[axis] - self.reach[axis] - corner[axis]) / voxel - 0.5).ceil().max(0.0);
            let hi = ((self.center[axis] + self.reach[axis] - corner[axis]) / voxel - 0.5).floor();
            (hi >= lo && hi >= 0.0 && lo < n as f64).then(|| lo as usize..=(hi as usize).min(n - 1))
        };
        let (Some(xs), Some(ys)) = (range(0, nx), range(1, ny)) else { return };
        let at = |i: usize, axis: usize| corner[axis] + (i as f64 + 0.5) * voxel - self.center[axis];
        let dz = at(z, 2);
        let m = &self.inverse;
        for y in ys {
            let dy = at(y, 1);
            // The quadratic form as a polynomial in dx.
            let c = m.y_axis.y * dy * dy + 2.0 * m.y_axis.z * dy * dz + m.z_axis.z * dz * dz;
            let b = 2.0 * (m.x_axis.y * dy + m.x_axis.z * dz);
            for x in xs.clone() {
                let dx = at(x, 0);
                let power = (m.x_axis.x * dx + b) * dx + c;
                if power < REACH * REACH {
                    slab[y * nx + x] += (self.peak * (-0.5 * power).exp()) as f32;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigate::testing::{cloud_of_wall, wall_with_hole};

    #[test]
    fn a_wall_blocks_and_a_hole_does_not() {
        let eyes = [DVec3::new(0.0, 0.0, -2.0), DVec3::new(0.0, 0.0, 2.0)];
        let wall = OccupancyGrid::of(&cloud_of_wall(0.0), &eyes, 0.1);
        assert!(wall.clearance(DVec3::ZERO) < 1e-6, "inside the wall");
        let away = wall.clearance(DVec3::new(0.0, 0.0, 1.0));
        assert!((away - 1.0).abs() < 2.0 * wall.voxel(), "{away}");
        assert!(!wall.is_free(eyes[0], eyes[1], 0.1));
        let share = wall.free_share(eyes[0], eyes[1], 0.2);
        assert!((share - 0.45).abs() < 0.04, "stops 0.2 before the wall at 2 of 4: {share}");
        assert!(wall.transmittance(eyes[0], eyes[1], 0.0) < 0.1);
        assert!(wall.transmittance(eyes[0], DVec3::new(0.0, 0.0, -0.5), 0.0) > 0.99);
        assert!(wall.transmittance(eyes[0], DVec3::ZERO, 0.2) > 0.9, "a surface does not hide itself");
        let hole = OccupancyGrid::of(&wall_with_hole(0.0, 0.5), &eyes, 0.1);
        assert!(hole.is_free(eyes[0], eyes[1], 0.2));
        assert!(!hole.is_free(eyes[0], eyes[1], 0.7), "too narrow for this");
    }

    #[test]
    fn glass_is_no_occupancy() {
        let mut glass = cloud_of_wall(0.0);
        glass.opacity_logits.fill(-4.0);
        let eyes = [DVec3::new(0.0, 0.0, -2.0), DVec3::new(0.0, 0.0, 2.0)];
        assert!(OccupancyGrid::of(&glass, &eyes, 0.1).is_free(eyes[0], eyes[1], 0.1));
    }

    #[test]
    fn where_a_camera_was_there_is_room() {
        let eyes = [DVec3::new(0.0, 0.0, 0.0), DVec3::new(0.0, 0.0, 2.0)];
        let occupancy = OccupancyGrid::of(&cloud_of_wall(0.0), &eyes, 0.3);
        assert!(occupancy.clearance(DVec3::ZERO) > 0.15, "{}", occupancy.clearance(DVec3::ZERO));
    }

    #[test]
    fn nothing_is_known_outside_and_nothing_breaks_on_odd_clouds() {
        let empty = OccupancyGrid::of(&GaussianCloud::default(), &[], 0.1);
        assert_eq!(empty.clearance(DVec3::splat(5.0)), 0.0);
        let one = OccupancyGrid::of(&GaussianCloud::default(), &[DVec3::splat(3.0)], 0.1);
        assert!(one.clearance(DVec3::splat(3.0)) >= 0.0);
        let mut odd = cloud_of_wall(0.0);
        odd.log_scales[0] = [80.0, -80.0, 0.0];
        odd.log_scales[1] = [-80.0; 3];
        odd.quaternions[2] = [0.0; 4];
        odd.opacity_logits[3] = 80.0;
        let eyes = [DVec3::new(0.0, 0.0, 2.0)];
        let occupancy = OccupancyGrid::of(&odd, &eyes, 0.1);
        assert!(occupancy.clearance(DVec3::new(0.0, 0.0, 1.0)).is_finite());
        assert_eq!(occupancy.clearance(DVec3::splat(f64::NAN)), 0.0);
    }
}
