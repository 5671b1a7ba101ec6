//! Lens distortion relative to a pinhole: the models of COLMAP, OpenCV and nerfstudio as one.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// Samples of the search for the field of a lens.
const STEPS: u32 = 4096;
/// Largest distance from the axis, at a focal length of 1, in that search for a perspective lens.
const FARTHEST: f64 = 32.0;
/// Angle from the axis, rad, beyond which a wide lens is not made a pinhole's: pixels would be stretched over 8 times.
const WIDEST: f64 = 70.0 * PI / 180.0;
/// Newton's steps, and the distance at a focal length of 1 at which they are done.
const MOST_STEPS: usize = 40;
const CLOSE: f64 = 1e-12;

/// Distance of a ray from the axis before the coefficients, by its angle θ and `r` = tan θ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Projection {
    /// `r`: a pinhole.
    #[default]
    Perspective,
    /// θ: an equidistant fisheye.
    Fisheye,
    /// `atan(2 r tan(ω / 2)) / ω`: COLMAP's FOV; ω in rad.
    Fov(f64),
    /// The `d` of which `r = d / (1 + k d²)`: COLMAP's DIVISION.
    Division(f64),
    /// `r / (α √(β r² + 1) + 1 - α)`: COLMAP's EUCM.
    Unified(f64, f64),
}

/// Distortion of the picture on disk relative to a pinhole's. With `(a, b)` the point after the [`Projection`], `s` its
/// squared distance from the axis, `g = (1 + k1 s + k2 s² + ...) / (1 + d1 s + d2 s² + d3 s³)`:
/// `x' = a g + 2 p1 a b + p2 (s + 2 a²) + s1 s + s2 s²`, `y' = b g + p1 (s + 2 b²) + 2 p2 a b + s3 s + s4 s²`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Distortion {
    /// Quadratic radial coefficient.
    pub k1: f64,
    pub(crate) k2: f64,
    pub(crate) p1: f64,
    pub(crate) p2: f64,
    /// k3 to k6.
    pub(crate) more: [f64; 4],
    /// d1 to d3.
    pub(crate) divisor: [f64; 3],
    /// s1 to s4: a thin prism.
    pub(crate) prism: [f64; 4],
    /// True if p1, p2 and the prism apply after the radial part.
    pub(crate) radial_first: bool,
    pub(crate) projection: Projection,
}

impl Distortion {
    /// Returns whether k1, k2, p1 and p2 on a pinhole describe it completely.
    pub(crate) fn is_plain(&self) -> bool {
        *self == Self { k1: self.k1, k2: self.k2, p1: self.p1, p2: self.p2, ..Self::default() }
    }

    /// Returns whether the projection is no pinhole's.
    pub(crate) fn is_wide(&self) -> bool {
        self.projection != Projection::Perspective
    }

    /// Its coefficients with their names, those that are 0 left out.
    pub(crate) fn coefficients(&self) -> Vec<(String, f64)> {
        let own = match self.projection {
            Projection::Fov(omega) => vec![("omega".to_owned(), omega)],
            Projection::Division(k) => vec![("k".to_owned(), k)],
            Projection::Unified(alpha, beta) => vec![("alpha".to_owned(), alpha), ("beta".to_owned(), beta)],
            _ => Vec::new(),
        };
        let named = [("k1", self.k1), ("k2", self.k2), ("p1", self.p1), ("p2", self.p2)];
        let numbered = |letter: &'static str, from: usize, list: &[f64]| {
            list.iter().enumerate().map(|(i, v)| (format!("{letter}{}", from + i), *v)).collect::<Vec<_>>()
        };
        let named = named.into_iter().map(|(name, value)| (name.to_owned(), value));
        let all = own.into_iter().chain(named).chain(numbered("k", 3, &self.more));
        let all = all.chain(numbered("divisor ", 1, &self.divisor)).chain(numbered("s", 1, &self.prism));
        all.filter(|(_, value)| *value != 0.0).collect()
    }

    /// Point of the picture on disk for the pinhole's point `q`, both at a focal length of 1; valid within
    /// [`reach`](Self::reach).
    pub(crate) fn bend(&self, q: DVec2) -> DVec2 {
        let r2 = q.length_squared();
        let factor = match self.projection {
            Projection::Perspective => 1.0,
            Projection::Division(k) => 2.0 / (1.0 + (1.0 - 4.0 * k * r2).sqrt()),
            Projection::Unified(alpha, beta) => 1.0 / (alpha * (beta * r2 + 1.0).sqrt() + 1.0 - alpha),
            Projection::Fisheye | Projection::Fov(_) if r2 == 0.0 => self.projected(1e-9) / 1e-9,
            Projection::Fisheye | Projection::Fov(_) => self.projected(r2.sqrt().atan()) / r2.sqrt(),
        };
        self.bend_projected(q * factor)
    }

    /// Applies the coefficients to a point after the projection.
    fn bend_projected(&self, p: DVec2) -> DVec2 {
        let radial = p * self.radial(p.length_squared());
        let t = if self.radial_first { radial } else { p };
        let s = t.length_squared();
        let [s1, s2, s3, s4] = self.prism;
        let (p1, p2, ab) = (self.p1, self.p2, t.x * t.y);
        let x = 2.0 * p1 * ab + p2 * (s + 2.0 * t.x * t.x) + s * (s1 + s * s2);
        let y = p1 * (s + 2.0 * t.y * t.y) + 2.0 * p2 * ab + s * (s3 + s * s4);
        radial + DVec2::new(x, y)
    }

    fn radial(&self, s: f64) -> f64 {
        let ([k3, k4, k5, k6], [d1, d2, d3]) = (self.more, self.divisor);
        let above = 1.0 + s * (self.k1 + s * (self.k2 + s * (k3 + s * (k4 + s * (k5 + s * k6)))));
        above / (1.0 + s * (d1 + s * (d2 + s * d3)))
    }

    /// Distance of a ray from the axis by its angle, before the coefficients; not finite if the projection has none.
    fn projected(&self, angle: f64) -> f64 {
        let (sin, cos) = angle.sin_cos();
        let narrow = || if angle < FRAC_PI_2 { angle.tan() } else { f64::NAN };
        match self.projection {
            Projection::Perspective => narrow(),
            Projection::Fisheye => angle,
            // Without an angle of view it is a pinhole.
            Projection::Fov(omega) if omega.abs() < 1e-9 => narrow(),
            Projection::Fov(omega) => (2.0 * (0.5 * omega).tan() * sin).atan2(cos) / omega,
            Projection::Division(k) => {
                let r = narrow();
                2.0 * r / (1.0 + (1.0 - 4.0 * k * r * r).sqrt())
            }
            Projection::Unified(alpha, beta) => {
                sin / (alpha * (beta * sin * sin + cos * cos).sqrt() + (1.0 - alpha) * cos)
            }
        }
    }

    /// The same with the radial coefficients.
    fn profile(&self, angle: f64) -> f64 {
        let p = self.projected(angle);
        p * self.radial(p * p)
    }

    /// Largest distance from the axis in the pinhole's picture, at a focal length of 1, up to which the lens shows
    /// each thing once.
    pub(crate) fn reach(&self) -> f64 {
        if self.is_plain() {
            return fold(self.k1, self.k2).sqrt();
        }
        match self.projection {
            Projection::Perspective => grows_until(|r| r * self.radial(r * r), FARTHEST),
            _ => grows_until(|angle| self.profile(angle), WIDEST).tan(),
        }
    }

    /// Largest angle from the axis, rad, up to which the lens shows each thing once.
    fn most_angle(&self) -> f64 {
        if self.is_wide() { grows_until(|angle| self.profile(angle), PI) } else { self.reach().min(1e6).atan() }
    }

    /// Solver for the rays of the lens.
    pub(crate) fn rays(&self) -> Rays {
        Rays { lens: *self, most_angle: self.most_angle() }
    }
}

/// Solver for the ray that a point of the picture on disk shows.
pub(crate) struct Rays {
    lens: Distortion,
    /// Largest angle from the axis that the lens shows, rad.
    pub(crate) most_angle: f64,
}

impl Rays {
    /// The ray, of length 1, that is seen at `place`, at a focal length of 1; `None` where the lens shows nothing.
    pub(crate) fn at(&self, place: DVec2) -> Option<DVec3> {
        // A vector as long as the ray's angle, in its direction: smooth at and beyond a right angle.
        let image = |a: DVec2| {
            let angle = a.length();
            let p = if angle < 1e-12 {
                a * (self.lens.projected(1e-9) / 1e-9)
            } else {
                a * (self.lens.projected(angle) / angle)
            };
            self.lens.bend_projected(p)
        };
        let mut a = self.radial(place);
        let mut error = image(a) - place;
        for _ in 0..MOST_STEPS {
            if error.length() < CLOSE {
                break;
            }
            const H: f64 = 1e-6;
            let dx = (image(a + DVec2::X * H) - image(a - DVec2::X * H)) / (2.0 * H);
            let dy = (image(a + DVec2::Y * H) - image(a - DVec2::Y * H)) / (2.0 * H);
            let det = dx.x * dy.y - dy.x * dx.y;
            let step = DVec2::new(dy.y * error.x - dy.x * error.y, dx.x * error.y - dx.y * error.x) / det;
            // Shorter steps until one leads closer: none leads away.
            let shorter = (0..20).map(|k| a - step / f64::from(1_u32 << k));
            let closer = shorter
                .map(|a| (a, image(a) - place))
                .find(|(a, e)| a.length() <= self.most_angle && e.length() < error.length());
            match closer {
                Some(next) => (a, error) = next,
                None => break,
            }
        }
        // Written so that NaN is nothing.
        if !(error.length() < 1e-9) {
            return None;
        }
        let angle = a.length();
        let across = if angle < 1e-12 { a } else { a * (angle.sin() / angle) };
        Some(across.extend(angle.cos()))
    }

    /// The angle that the radial part alone has at `place`, in its direction, by halving.
    fn radial(&self, place: DVec2) -> DVec2 {
        let (far, mut range) = (place.length(), [0.0, self.most_angle]);
        for _ in 0..60 {
            let middle = 0.5 * (range[0] + range[1]);
            range[usize::from(self.lens.profile(middle) > far)] = middle;
        }
        if far > 0.0 { place * (range[0] / far) } else { DVec2::ZERO }
    }
}

/// The smallest `r²` at which `r (1 + k1 r² + k2 r⁴)` stops growing; infinite if it never does.
pub(crate) fn fold(k1: f64, k2: f64) -> f64 {
    // Derivative: 1 + 3 k1 t + 5 k2 t² with t = r².
    let (a, b) = (5.0 * k2, 3.0 * k1);
    let discriminant = b * b - 4.0 * a;
    if discriminant < 0.0 {
        return f64::INFINITY;
    }
    // Both roots in the form that does not cancel: q / a and 1 / q.
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    [q / a, 1.0 / q].into_iter().filter(|t| *t > 0.0).fold(f64::INFINITY, f64::min)
}

/// The place between 0 and `most` at which `f`, which begins at 0, stops growing; `most` if it never does.
fn grows_until(f: impl Fn(f64) -> f64, most: f64) -> f64 {
    let at = |i: u32| most * f64::from(i) / f64::from(STEPS);
    let mut before = 0.0;
    for i in 1..=STEPS {
        let now = f(at(i));
        // Written so that NaN is no growth.
        if !(now > before) {
            // The peak of a function that rises and falls, or the end of its domain.
            let [mut low, mut high] = [at(i.saturating_sub(2)), at(i)];
            for _ in 0..100 {
                let [a, b] = [(2.0 * low + high) / 3.0, (low + 2.0 * high) / 3.0];
                if f(a) < f(b) { low = a } else { high = b }
            }
            return low;
        }
        before = now;
    }
    most
}

#[cfg(test)]
mod tests;
