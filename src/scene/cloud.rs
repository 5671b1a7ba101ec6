//! The Gaussians, as a structure of arrays with raw (unactivated) parameters.
//!
//! Log-scales, opacity logits and quaternions of any length; the activations are stable for every input.

use glam::DVec3;

use crate::math::{Real, sh};

/// `n` Gaussians. Parameters are stored raw: the renderer applies `exp` to log-scales, the
/// sigmoid to opacity logits, and normalizes quaternions.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GaussianCloud<R = f32> {
    /// World position of the local origin, in scene units: `world = origin + positions[i]`, added
    /// in f64. Keeps scenes far from zero exact.
    pub origin: DVec3,
    /// Centers relative to `origin`, `[n]`.
    pub positions: Vec<[R; 3]>,
    /// Natural logarithms of the standard deviations along the local axes, `[n]`.
    pub log_scales: Vec<[R; 3]>,
    /// Rotations world_from_local as quaternions `[w, x, y, z]` of any length, `[n]`.
    pub quaternions: Vec<[R; 4]>,
    /// Opacities before the sigmoid, `[n]`.
    pub opacity_logits: Vec<R>,
    /// Degree of the spherical harmonics, 0 to 3.
    pub sh_degree: u8,
    /// RGB coefficients, `[n * (sh_degree + 1)²]`, those of one Gaussian together.
    pub sh: Vec<[R; 3]>,
    /// Mode in which they were trained and are to be drawn.
    pub render_mode: SplatRenderMode,
    /// World up direction, unit length, if a file states one that is not `-y`.
    pub up: Option<DVec3>,
    /// Per-Gaussian properties that the program does not interpret but keeps from a file.
    pub extras: Vec<ExtraProperty>,
    /// Warnings about the file that it was read from.
    pub warnings: Vec<String>,
}

/// Render mode of Gaussians: the one that they were trained with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SplatRenderMode {
    /// As 3D Gaussian Splatting does.
    #[default]
    Plain,
    /// With the 2-D filter of Mip-Splatting.
    Mip,
    /// As disks: 2D Gaussian Splatting, which ignores the third scale.
    Surfels,
}

/// A named per-Gaussian scalar that came with a file.
#[derive(Clone, Debug, PartialEq)]
pub struct ExtraProperty {
    /// The property's name in the file.
    pub name: String,
    /// One value per Gaussian.
    pub values: Vec<f32>,
}

/// The raw parameters of one Gaussian; see [`GaussianCloud`] for the units.
#[derive(Clone, Copy, Debug)]
pub struct Gaussian<'a, R = f32> {
    /// Center relative to the cloud's origin.
    pub(crate) position: [R; 3],
    /// Logarithms of the standard deviations.
    pub(crate) log_scale: [R; 3],
    /// Rotation `[w, x, y, z]`.
    pub(crate) quaternion: [R; 4],
    /// Opacity before the sigmoid.
    pub opacity_logit: R,
    /// Its coefficients.
    pub sh: &'a [[R; 3]],
}

/// Error of an invalid cloud.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum CloudError {
    #[error("array '{0}' holds {1} entries, expected {2}")]
    Length(&'static str, usize, usize),
    #[error("Gaussian {index}: {field} is not finite")]
    NotFinite { index: usize, field: &'static str },
    #[error("none of its {count} Gaussians is finite: {field} of the first is not")]
    NoneFinite { count: usize, field: &'static str },
    #[error("spherical-harmonics degree {0} is over 3")]
    Degree(u8),
}

impl GaussianCloud {
    /// Color of Gaussian `i` in the mean over all directions, 0 to 1 as displayed.
    pub(crate) fn mean_color(&self, i: usize) -> [f32; 3] {
        self.sh[i * self.sh_stride()].map(|v| (0.5 + sh::SH_C0 as f32 * v).clamp(0.0, 1.0))
    }
}

impl<R: Real> GaussianCloud<R> {
    /// Round gray Gaussians of one size and opacity.
    pub fn isotropic(positions: Vec<[R; 3]>, log_scale: R, opacity_logit: R) -> Self {
        let n = positions.len();
        Self {
            positions,
            log_scales: vec![[log_scale; 3]; n],
            quaternions: vec![[R::ONE, R::ZERO, R::ZERO, R::ZERO]; n],
            opacity_logits: vec![opacity_logit; n],
            sh: vec![[R::ZERO; 3]; n],
            ..Self::default()
        }
    }

    /// Number of Gaussians.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Returns whether there are no Gaussians.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Coefficients per Gaussian, `(sh_degree + 1)²`.
    pub fn sh_stride(&self) -> usize {
        sh::coefficients(self.sh_degree)
    }

    /// The parameters of Gaussian `i`.
    #[inline(always)]
    pub fn gaussian(&self, i: usize) -> Gaussian<'_, R> {
        let stride = self.sh_stride();
        Gaussian {
            position: self.positions[i],
            log_scale: self.log_scales[i],
            quaternion: self.quaternions[i],
            opacity_logit: self.opacity_logits[i],
            sh: &self.sh[i * stride..(i + 1) * stride],
        }
    }

    /// Bytes of all values.
    pub(crate) fn bytes(&self) -> u64 {
        let own = (self.len() * 11 + self.sh.len() * 3) * size_of::<R>();
        let extras: usize = self.extras.iter().map(|e| e.values.len() * size_of::<f32>()).sum();
        (own + extras) as u64
    }

    /// World position of Gaussian `i`.
    pub fn world_position(&self, i: usize) -> DVec3 {
        self.origin + DVec3::from_array(self.positions[i].map(Real::f64))
    }

    /// Checks lengths and finiteness; the error names the first offender.
    pub fn validate(&self) -> Result<(), CloudError> {
        self.lengths()?;
        if !self.origin.is_finite() {
            return Err(CloudError::NotFinite { index: 0, field: "origin" });
        }
        match (0..self.len()).find_map(|index| Some((index, self.flaw(index)?))) {
            Some((index, field)) => Err(CloudError::NotFinite { index, field }),
            None => Ok(()),
        }
    }

    /// Checks that all arrays hold the same number of Gaussians.
    pub(crate) fn lengths(&self) -> Result<(), CloudError> {
        let n = self.len();
        if self.sh_degree > 3 {
            return Err(CloudError::Degree(self.sh_degree));
        }
        let lengths = [
            ("log_scales", self.log_scales.len(), n),
            ("quaternions", self.quaternions.len(), n),
            ("opacity_logits", self.opacity_logits.len(), n),
            ("sh", self.sh.len(), n * self.sh_stride()),
        ];
        let extras = self.extras.iter().map(|e| ("extras", e.values.len(), n));
        match lengths.into_iter().chain(extras).find(|(_, have, want)| have != want) {
            Some((name, have, want)) => Err(CloudError::Length(name, have, want)),
            None => Ok(()),
        }
    }

    /// Name of the first parameter of Gaussian `i` that is not finite.
    pub(crate) fn flaw(&self, i: usize) -> Option<&'static str> {
        let Gaussian { position, log_scale, quaternion, opacity_logit, sh } = self.gaussian(i);
        let fields = [
            ("position", position.iter().all(|v| v.is_finite())),
            ("scale", log_scale.iter().all(|v| v.is_finite())),
            ("rotation", quaternion.iter().all(|v| v.is_finite())),
            ("opacity", opacity_logit.is_finite()),
            ("spherical harmonics", sh.iter().flatten().all(|v| v.is_finite())),
        ];
        fields.iter().find(|(_, finite)| !finite).map(|(name, _)| *name)
    }

    /// Adds the Gaussians of a cloud with the same origin, degree and extra properties.
    pub(crate) fn append(&mut self, mut other: Self) {
        self.positions.append(&mut other.positions);
        self.log_scales.append(&mut other.log_scales);
        self.quaternions.append(&mut other.quaternions);
        self.opacity_logits.append(&mut other.opacity_logits);
        self.sh.append(&mut other.sh);
        for (own, more) in self.extras.iter_mut().zip(&mut other.extras) {
            own.values.append(&mut more.values);
        }
    }

    /// One cloud of all parts, around the origin of the first, with the highest degree among them and the extra
    /// properties that all have.
    pub(crate) fn joined(parts: Vec<Self>) -> Self {
        let sh_degree = parts.iter().map(|p| p.sh_degree).max().unwrap_or(0);
        let stride = sh::coefficients(sh_degree);
        let mut all: Option<Self> = None;
        for mut part in parts {
            if part.sh_degree < sh_degree {
                let pad = |sh: &[[R; 3]]| {
                    let zeros = vec![[R::ZERO; 3]; stride - sh.len()];
                    [sh, &zeros].concat()
                };
                part.sh = part.sh.chunks_exact(part.sh_stride()).flat_map(pad).collect();
                part.sh_degree = sh_degree;
            }
            let Some(all) = &mut all else {
                all = Some(part);
                continue;
            };
            let shift = (part.origin - all.origin).to_array();
            part.positions.iter_mut().for_each(|p| *p = [0, 1, 2].map(|k| R::of(p[k].f64() + shift[k])));
            all.extras.retain(|e| part.extras.iter().any(|other| other.name == e.name));
            part.extras =
                all.extras.iter().filter_map(|e| part.extras.iter().find(|p| p.name == e.name).cloned()).collect();
            all.append(part);
        }
        all.unwrap_or_default()
    }

    /// The same cloud with room for `n` Gaussians in all, so that more can be added in place.
    pub(crate) fn with_room(mut self, n: usize) -> Self {
        let more = n.saturating_sub(self.len());
        self.positions.reserve_exact(more);
        self.log_scales.reserve_exact(more);
        self.quaternions.reserve_exact(more);
        self.opacity_logits.reserve_exact(more);
        self.sh.reserve_exact(more * self.sh_stride());
        self.extras.iter_mut().for_each(|e| e.values.reserve_exact(more));
        self
    }

    /// The same cloud without the bands of the spherical harmonics above `degree`, in its own memory.
    pub(crate) fn up_to_degree(mut self, degree: u8) -> Self {
        let (from, to) = (self.sh_stride(), sh::coefficients(degree.min(self.sh_degree)));
        if to < from {
            for i in 0..self.len() {
                self.sh.copy_within(i * from..i * from + to, i * to);
            }
            self.sh.truncate(self.len() * to);
            self.sh.shrink_to_fit();
            self.sh_degree = degree;
        }
        self
    }

    /// The same cloud in another precision (extras are kept as they are).
    pub fn cast<S: Real>(&self) -> GaussianCloud<S> {
        let three = |v: &Vec<[R; 3]>| v.iter().map(|a| a.map(|x| S::of(x.f64()))).collect();
        GaussianCloud {
            origin: self.origin,
            positions: three(&self.positions),
            log_scales: three(&self.log_scales),
            quaternions: self.quaternions.iter().map(|q| q.map(|x| S::of(x.f64()))).collect(),
            opacity_logits: self.opacity_logits.iter().map(|x| S::of(x.f64())).collect(),
            sh_degree: self.sh_degree,
            sh: three(&self.sh),
            render_mode: self.render_mode,
            up: self.up,
            extras: self.extras.clone(),
            warnings: self.warnings.clone(),
        }
    }

    /// A copy of the Gaussians at `indices`, in that order.
    pub fn select(&self, indices: &[usize]) -> Self {
        let stride = self.sh_stride();
        Self {
            origin: self.origin,
            positions: indices.iter().map(|&i| self.positions[i]).collect(),
            log_scales: indices.iter().map(|&i| self.log_scales[i]).collect(),
            quaternions: indices.iter().map(|&i| self.quaternions[i]).collect(),
            opacity_logits: indices.iter().map(|&i| self.opacity_logits[i]).collect(),
            sh_degree: self.sh_degree,
            sh: indices.iter().flat_map(|&i| self.sh[i * stride..(i + 1) * stride].iter().copied()).collect(),
            render_mode: self.render_mode,
            up: self.up,
            warnings: Vec::new(),
            extras: self
                .extras
                .iter()
                .map(|e| ExtraProperty { name: e.name.clone(), values: indices.iter().map(|&i| e.values[i]).collect() })
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one() -> GaussianCloud {
        GaussianCloud::isotropic(vec![[0.0; 3]; 2], 0.0, 0.0)
    }

    #[test]
    fn bands_that_are_left_out_are_those_above_a_degree() {
        let of = |degree: u8| {
            let stride = sh::coefficients(degree);
            let sh = (0..2 * stride).map(|k| [(k / stride * 100 + k % stride) as f32; 3]).collect();
            GaussianCloud { sh_degree: degree, sh, ..one() }
        };
        for (from, to) in [(3, 1), (3, 0), (2, 2), (1, 3)] {
            assert_eq!(of(from).up_to_degree(to), of(from.min(to)), "{from} to {to}");
        }
        assert_ne!(of(3).up_to_degree(2), of(3));
    }

    #[test]
    fn every_field_is_validated_by_name() {
        let spoilt = |spoil: &dyn Fn(&mut GaussianCloud)| {
            let mut c = one();
            spoil(&mut c);
            c.validate().map_err(|e| e.to_string())
        };
        type Spoil = Box<dyn Fn(&mut GaussianCloud)>;
        let cases: [(Spoil, &str); 11] = [
            (Box::new(|c| c.origin.z = f64::INFINITY), "Gaussian 0: origin is not finite"),
            (Box::new(|c| c.positions[0][1] = f32::NAN), "Gaussian 0: position is not finite"),
            (Box::new(|c| c.log_scales[1][0] = f32::INFINITY), "Gaussian 1: scale is not finite"),
            (Box::new(|c| c.quaternions[1][3] = f32::NAN), "Gaussian 1: rotation is not finite"),
            (Box::new(|c| c.opacity_logits[0] = f32::NAN), "Gaussian 0: opacity is not finite"),
            (Box::new(|c| c.sh[1][2] = f32::NAN), "Gaussian 1: spherical harmonics is not finite"),
            (Box::new(|c| c.sh_degree = 4), "spherical-harmonics degree 4 is over 3"),
            (Box::new(|c| c.quaternions.truncate(1)), "array 'quaternions' holds 1 entries, expected 2"),
            (Box::new(|c| c.opacity_logits.truncate(1)), "array 'opacity_logits' holds 1 entries, expected 2"),
            (Box::new(|c| c.sh_degree = 1), "array 'sh' holds 2 entries, expected 8"),
            (
                Box::new(|c| c.extras.push(ExtraProperty { name: "x".into(), values: vec![0.0] })),
                "array 'extras' holds 1 entries, expected 2",
            ),
        ];
        for (spoil, expected) in cases {
            assert_eq!(spoilt(&*spoil), Err(expected.to_owned()));
        }
    }

    #[test]
    fn clouds_are_counted_joined_and_cast() {
        let extra = |values: [f32; 2]| ExtraProperty { name: "x".into(), values: values.to_vec() };
        let mut c = GaussianCloud { extras: vec![extra([1.0, 2.0])], origin: DVec3::X, ..one() };
        c.positions[1] = [1.0, 2.0, 3.0];
        assert_eq!(c.world_position(1), DVec3::new(2.0, 2.0, 3.0));
        assert_eq!(c.gaussian(1).position, [1.0, 2.0, 3.0]);
        // 11 numbers and 3 of a color each, and one more: 2 x 15 x 4 bytes.
        assert_eq!((c.len(), c.is_empty(), c.bytes()), (2, false, 120));
        assert!(GaussianCloud::<f32>::default().is_empty());
        let wide: GaussianCloud<f64> = c.cast();
        assert_eq!((wide.positions[1], wide.origin, wide.extras.len()), ([1.0, 2.0, 3.0], DVec3::X, 1));
        assert_eq!(wide.cast::<f32>(), c);
        assert_eq!(wide.bytes(), 2 * 14 * 8 + 2 * 4);
        let mut both = c.clone().with_room(9);
        assert!(both.positions.capacity() >= 9 && both.sh.capacity() >= 9 && both.extras[0].values.capacity() >= 9);
        both.append(GaussianCloud { extras: vec![extra([3.0, 4.0])], ..c.clone() });
        both.validate().expect("valid");
        assert_eq!((both.len(), both.extras[0].values.clone()), (4, vec![1.0, 2.0, 3.0, 4.0]));
        assert_eq!(both.select(&[2, 3]).positions, c.positions);
        assert_eq!(both.select(&[3, 0]).extras[0].values, [4.0, 1.0]);
        let of_degree = |d: u8| {
            let stride = sh::coefficients(d);
            GaussianCloud { sh_degree: d, sh: (0..2 * stride).map(|k| [k as f32; 3]).collect(), ..one() }
        };
        let second = of_degree(1).select(&[1]);
        assert_eq!(second.sh, [[4.0; 3], [5.0; 3], [6.0; 3], [7.0; 3]]);
        assert_eq!((of_degree(1).gaussian(1).sh, of_degree(2).sh_stride()), (&second.sh[..], 9));
    }
}
