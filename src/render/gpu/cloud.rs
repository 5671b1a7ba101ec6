//! A cloud on the device: three buffers of parameters, and the way there and back.

use super::scratch::BIN_BLOCK;
use super::{Device, GpuError};
use crate::math::sh;
use crate::scene::GaussianCloud;

/// Floats of one Gaussian in the geometry buffer: position 3, log-scales 3, quaternion 4 (w first),
/// opacity logit, pad.
pub(crate) const GEOMETRY_STRIDE: usize = 12;
/// Coefficients per channel in the low buffer: degrees 0 to 2.
const LOW: usize = 9;

/// Floats per Gaussian in the three buffers, for a stored spherical-harmonics degree.
pub(crate) fn strides(degree: u8) -> [usize; 3] {
    let coefficients = sh::coefficients(degree);
    [GEOMETRY_STRIDE, coefficients.min(LOW) * 3, coefficients.saturating_sub(LOW) * 3]
}

/// Values laid out like a cloud's parameters: the parameters, a gradient, or a moment of Adam.
#[derive(Debug)]
pub struct Parameters {
    /// Geometry, coefficients of degrees 0 to 2, coefficients of degree 3.
    pub(crate) buffers: [wgpu::Buffer; 3],
}

impl Parameters {
    /// Zeroed room for `capacity` Gaussians. `what` names it in errors.
    pub fn new(device: &Device, what: &str, capacity: usize, degree: u8) -> Result<Self, GpuError> {
        check(device, what, capacity, degree)?;
        let bytes = strides(degree).map(|s| (s * capacity * 4) as u64);
        let [a, b, c] = bytes.map(|b| device.storage(what, b));
        Ok(Self { buffers: [a?, b?, c?] })
    }

    /// Overwrites the first Gaussians.
    pub(crate) fn write(&self, device: &Device, packed: &Packed) {
        for (buffer, floats) in self.buffers.iter().zip(&packed.floats) {
            if !floats.is_empty() {
                device.queue().write_buffer(buffer, 0, bytemuck::cast_slice(floats));
            }
        }
    }

    /// Reads the first `n` Gaussians back.
    pub(crate) fn read(&self, device: &Device, n: usize, degree: u8) -> Result<Packed, GpuError> {
        let [a, b, c] = strides(degree).map(|s| (s * n * 4) as u64);
        let [x, y, z] = &self.buffers;
        let copies = device.read(&[(x, a), (y, b), (z, c)])?;
        Ok(Packed { floats: [0, 1, 2].map(|k| copies.values(k)), degree })
    }
}

/// Refuses a cloud that the device cannot bind, with the numbers, before anything is allocated.
fn check(device: &Device, what: &str, capacity: usize, degree: u8) -> Result<(), GpuError> {
    let remedy = "use fewer Gaussians or a lower spherical-harmonics degree";
    for stride in strides(degree) {
        let what = format!("{what} of {capacity} Gaussians of degree {degree} (bytes in one binding)");
        device.fits_binding(&what, (stride * capacity * 4) as u64, remedy)?;
    }
    device.fits_dispatch("blocks of Gaussians", capacity.div_ceil(BIN_BLOCK as usize) as u64, remedy)
}

/// Parameters on the host in the device's layout.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Packed {
    /// As [`Parameters::buffers`].
    pub floats: [Vec<f32>; 3],
    /// Degree that they are laid out for.
    pub(crate) degree: u8,
}

impl Packed {
    /// The parameters of `cloud`.
    pub(crate) fn of(cloud: &GaussianCloud) -> Self {
        Self::up_to(cloud, cloud.sh_degree)
    }

    /// The parameters of `cloud` without bands above `degree`.
    pub fn up_to(cloud: &GaussianCloud, degree: u8) -> Self {
        let degree = degree.min(cloud.sh_degree);
        let [_, low, high] = strides(degree);
        let n = cloud.len();
        let mut floats =
            [Vec::with_capacity(n * GEOMETRY_STRIDE), Vec::with_capacity(n * low), Vec::with_capacity(n * high)];
        for i in 0..n {
            let g = cloud.gaussian(i);
            floats[0].extend(g.position);
            floats[0].extend(g.log_scale);
            floats[0].extend(g.quaternion);
            floats[0].extend([g.opacity_logit, 0.0]);
            for (k, rgb) in g.sh.iter().take(sh::coefficients(degree)).enumerate() {
                floats[if k < LOW { 1 } else { 2 }].extend(rgb);
            }
        }
        Self { floats, degree }
    }

    /// The pad of each Gaussian's geometry; a gradient keeps the screen gradient's length there.
    pub(crate) fn pads(&self) -> impl Iterator<Item = f32> + '_ {
        self.floats[0].chunks_exact(GEOMETRY_STRIDE).map(|g| g[GEOMETRY_STRIDE - 1])
    }

    /// A cloud with these parameters, at the origin and without extra properties.
    pub(crate) fn to_cloud(&self) -> GaussianCloud {
        let [_, low, high] = strides(self.degree);
        let mut cloud = GaussianCloud { sh_degree: self.degree, ..GaussianCloud::default() };
        let n = self.floats[0].len() / GEOMETRY_STRIDE;
        cloud.positions.reserve_exact(n);
        cloud.log_scales.reserve_exact(n);
        cloud.quaternions.reserve_exact(n);
        cloud.opacity_logits.reserve_exact(n);
        cloud.sh.reserve_exact(n * sh::coefficients(self.degree));
        for (i, g) in self.floats[0].chunks_exact(GEOMETRY_STRIDE).enumerate() {
            cloud.positions.push([g[0], g[1], g[2]]);
            cloud.log_scales.push([g[3], g[4], g[5]]);
            cloud.quaternions.push([g[6], g[7], g[8], g[9]]);
            cloud.opacity_logits.push(g[10]);
            let bands = [(&self.floats[1], low), (&self.floats[2], high)];
            for (floats, stride) in bands {
                let own = floats.get(i * stride..(i + 1) * stride).unwrap_or(&[]);
                cloud.sh.extend(own.chunks_exact(3).map(|c| [c[0], c[1], c[2]]));
            }
        }
        cloud
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packing_and_unpacking_give_the_cloud_back() {
        for degree in 0..=3 {
            let coefficients = sh::coefficients(degree);
            let number = |i: usize| i as f32 * 0.5 - 3.0;
            let cloud = GaussianCloud {
                positions: (0..3).map(|i| [number(i), 1.0, 2.0]).collect(),
                log_scales: (0..3).map(|i| [number(i), -1.0, -2.0]).collect(),
                quaternions: (0..3).map(|i| [number(i), 0.1, 0.2, 0.3]).collect(),
                opacity_logits: (0..3).map(number).collect(),
                sh_degree: degree,
                sh: (0..3 * coefficients).map(|i| [number(i), number(i + 1), 7.0]).collect(),
                ..GaussianCloud::default()
            };
            let packed = Packed::of(&cloud);
            assert_eq!(packed.to_cloud(), cloud);
            assert_eq!(packed.floats.each_ref().map(Vec::len), strides(degree).map(|s| 3 * s));
            assert_eq!(Packed::up_to(&cloud, 1).to_cloud(), cloud.up_to_degree(1));
        }
    }
}
