//! Axis conventions of splat files, and the conversion of Gaussians between them.

use std::str::FromStr;

use glam::{DMat3, DQuat, DVec3};
use rayon::prelude::*;

use super::GaussianCloud;
use crate::math::sh;

/// Directions in which x, y and z of a file increase, a letter for each: right or left, up or down, front or back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Axes([char; 3]);

impl Axes {
    /// Right, down, front: those of a `.ply` of 3D Gaussian Splatting, and of a scene without cameras here.
    pub const PLY: Self = Self(['R', 'D', 'F']);
    /// Right, up, back: those that SPZ documents.
    pub const SPZ: Self = Self(['R', 'U', 'B']);
    /// Left, up, front: those of glTF.
    pub const GLTF: Self = Self(['L', 'U', 'F']);

    /// The directions in words.
    pub(crate) fn words(self) -> String {
        let word = |letter| match letter {
            'R' => "right",
            'L' => "left",
            'U' => "up",
            'D' => "down",
            'F' => "front",
            _ => "back",
        };
        self.0.map(word).join(", ")
    }

    /// The scene's directions of the three axes, as columns. Left-handed axes mirror.
    pub(crate) fn scene_from_file(self) -> DMat3 {
        let direction = |letter| match letter {
            'R' => DVec3::X,
            'L' => DVec3::NEG_X,
            'U' => DVec3::NEG_Y,
            'D' => DVec3::Y,
            'F' => DVec3::Z,
            _ => DVec3::NEG_Z,
        };
        let [x, y, z] = self.0.map(direction);
        DMat3::from_cols(x, y, z)
    }
}

impl FromStr for Axes {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let letters: Vec<char> = text.chars().map(|c| c.to_ascii_uppercase()).collect();
        let axis = |c: &char| ["RL", "UD", "FB"].iter().position(|pair| pair.contains(*c));
        let mut seen: Vec<Option<usize>> = letters.iter().map(axis).collect();
        seen.sort_unstable();
        match (letters.as_slice(), seen.as_slice()) {
            (&[x, y, z], [Some(0), Some(1), Some(2)]) => Ok(Self([x, y, z])),
            _ => {
                Err("three letters are needed, where x, y and z count to: r or l, u or d, f or b; a .ply has rdf, SPZ \
                      rub, glTF luf"
                    .into())
            }
        }
    }
}

impl GaussianCloud {
    /// The same Gaussians in other axes; `turn` (to_from_these, orthogonal) may mirror. With `own`, a `turn` that only
    /// flips signs flips the Gaussians' local axes too, as SPZ's readers do: the same Gaussians, with other signs.
    pub(crate) fn turned(mut self, turn: &DMat3, own: bool) -> Self {
        if *turn == DMat3::IDENTITY {
            return self;
        }
        let mirrored = turn.determinant() < 0.0;
        let diagonal = DMat3::from_diagonal(DVec3::new(turn.x_axis.x, turn.y_axis.y, turn.z_axis.z));
        let local = match own && diagonal == *turn {
            true => *turn,
            false if mirrored => DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)),
            false => DMat3::IDENTITY,
        };
        let rotation = |m: DMat3| DQuat::from_mat3(&(m * m.determinant().signum()));
        let (before, after) = (rotation(*turn), rotation(local).conjugate());
        let place = |p: [f32; 3]| (*turn * DVec3::from_array(p.map(f64::from))).as_vec3().to_array();
        self.origin = *turn * self.origin;
        self.up = self.up.map(|up| *turn * up);
        self.positions.par_iter_mut().for_each(|p| *p = place(*p));
        self.quaternions.par_iter_mut().for_each(|q| {
            let [w, x, y, z] = q.map(f64::from);
            let turned = before * DQuat::from_xyzw(x, y, z, w) * after;
            *q = [turned.w, turned.x, turned.y, turned.z].map(|v| v as f32);
        });
        self.turn_harmonics(turn);
        self
    }

    fn turn_harmonics(&mut self, turn: &DMat3) {
        // Quadrature leaves errors of 1e-16 where axes are permuted; rounding makes the values exact.
        let whole = |v: f64| if (v - v.round()).abs() < 1e-9 { v.round() } else { v };
        let matrix = sh::rotation(turn).map(|row| row.map(whole));
        for degree in 1..=usize::from(self.sh_degree) {
            let band = degree * degree..(degree + 1) * (degree + 1);
            let stride = self.sh_stride();
            self.sh.par_chunks_exact_mut(stride).for_each(|all| {
                let mut turned = [[0.0_f32; 3]; 7];
                for (row, out) in band.clone().zip(&mut turned) {
                    *out = [0, 1, 2]
                        .map(|c| band.clone().map(|k| matrix[row][k] * f64::from(all[k][c])).sum::<f64>() as f32);
                }
                all[band.clone()].copy_from_slice(&turned[..band.len()]);
            });
        }
    }

    /// The same Gaussians with `-y` up, for formats that cannot state an up direction: turned about the right axis if
    /// their file stated another one.
    pub(crate) fn upright(self) -> Self {
        let Some(up) = self.up else { return self };
        let right = DVec3::X.reject_from(up).try_normalize().unwrap_or(DVec3::Y);
        let mut turned = self.turned(&DMat3::from_cols(right, -up, right.cross(-up)).transpose(), false);
        turned.up = None;
        turned
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rotation::unit_quaternion;

    fn cloud() -> GaussianCloud {
        let sh = (0..16).map(|k| [0.1 * k as f32, 0.5 - 0.07 * k as f32, (k as f32).sin()]).collect();
        GaussianCloud {
            origin: DVec3::new(1e6 + 0.5, -2.0, 3.0),
            quaternions: vec![[0.1, -0.5, 0.7, 0.3]],
            sh_degree: 3,
            sh,
            ..GaussianCloud::isotropic(vec![[1.0, 2.0, -3.0]], 0.0, 0.0)
        }
    }

    /// The matrix R S Rᵀ of the Gaussian with standard deviations 1, 2, 3.
    fn covariance(c: &GaussianCloud) -> DMat3 {
        let [w, x, y, z] = unit_quaternion(c.quaternions[0].map(f64::from)).expect("a rotation");
        let turn = DQuat::from_xyzw(x, y, z, w);
        let r = DMat3::from_quat(turn);
        r * DMat3::from_diagonal(DVec3::new(1.0, 4.0, 9.0)) * r.transpose()
    }

    fn color(c: &GaussianCloud, direction: DVec3) -> [f64; 3] {
        let basis = sh::basis(3, direction.to_array());
        [0, 1, 2].map(|k| c.sh.iter().zip(basis).map(|(v, b)| f64::from(v[k]) * b).sum())
    }

    #[test]
    fn letters_name_axes() {
        assert_eq!(("rdf".parse(), "RUB".parse(), "Luf".parse()), (Ok(Axes::PLY), Ok(Axes::SPZ), Ok(Axes::GLTF)));
        assert_eq!(Axes::SPZ.words(), "right, up, back");
        assert!(["", "rd", "rrf", "rdx", "rdfb", "rud"].iter().all(|text| text.parse::<Axes>().is_err()));
    }

    #[test]
    fn gaussians_look_the_same_from_the_turned_side() {
        for (letters, own) in
            [("rub", true), ("luf", false), ("rfu", true), ("ruf", true), ("ldb", false), ("bul", false)]
        {
            let turn = letters.parse::<Axes>().expect("axes").scene_from_file();
            let (a, b) = (cloud(), cloud().turned(&turn, own));
            assert!((b.world_position(0) - turn * a.world_position(0)).length() < 1e-9, "{letters}");
            let moved = turn * covariance(&a) * turn.transpose();
            assert!(moved.abs_diff_eq(covariance(&b), 1e-5), "{letters}: {moved} {}", covariance(&b));
            let control = DVec3::new(-0.48, 0.6, 0.64);
            let apart = color(&a, control)[0] - color(&b, control)[0];
            assert!(apart.abs() > 1e-2, "{letters}: it turned");
            for d in [DVec3::new(0.6, 0.0, 0.8), control, DVec3::NEG_Y] {
                let (was, is) = (color(&a, d), color(&b, turn * d));
                assert!(was.iter().zip(is).all(|(p, q)| (p - q).abs() < 1e-5), "{letters}: {was:?} {is:?}");
            }
        }
    }

    #[test]
    fn axes_counted_the_other_way_come_back_bit_for_bit() {
        for axes in [Axes::SPZ, Axes::GLTF] {
            let turn = axes.scene_from_file();
            assert_eq!(cloud().turned(&turn, true).turned(&turn.transpose(), true), cloud());
        }
    }

    #[test]
    fn what_is_upwards_comes_upright() {
        for up in [DVec3::Z, DVec3::Y, DVec3::X, DVec3::NEG_X, DVec3::NEG_Z] {
            let lying =
                GaussianCloud { up: Some(up), origin: 5.0 * up, ..GaussianCloud::isotropic(vec![[0.0; 3]], 0.0, 0.0) };
            let right = lying.clone().upright();
            assert!((right.world_position(0) - 5.0 * DVec3::NEG_Y).length() < 1e-9 && right.up.is_none(), "{up}");
        }
        // With z upwards, what is far along y is in front.
        let far = GaussianCloud { up: Some(DVec3::Z), ..GaussianCloud::isotropic(vec![[1.0, 7.0, 2.0]], 0.0, 0.0) };
        assert_eq!(far.upright().positions[0], [1.0, -2.0, 7.0]);
    }
}
