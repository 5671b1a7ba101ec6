//! Reading splats from `.ply`.

use std::path::Path;

use glam::DVec3;
use rayon::prelude::*;

use super::{ORIGIN, is_standard};
use crate::io::ply::{Column, Ply, Scalar, Table};
use crate::io::quantized::logit;
use crate::io::{IoError, compressed_ply, render_mode};
use crate::math::sh::coefficients;
use crate::scene::{ExtraProperty, GaussianCloud};

/// The Gaussians of a splat `.ply`'s bytes; `path` is for errors.
pub fn parse(bytes: &[u8], path: &Path) -> Result<GaussianCloud, IoError> {
    let ply = Ply::parse(bytes, path)?;
    if ply.element("chunk").is_some() {
        return compressed_ply::decode(&ply);
    }
    let Some(table) = ply.table("vertex")? else {
        return Err(ply.syntax("vertex", "missing".into()));
    };
    Reading { ply: &ply, table: &table, first: 0 }.cloud()
}

pub(super) struct Reading<'a> {
    pub(crate) ply: &'a Ply<'a>,
    pub(crate) table: &'a Table<'a>,
    /// Number of the first row, for errors.
    pub(crate) first: usize,
}

impl Reading<'_> {
    /// Whether positions of any rows alone have the origin that those of all have.
    pub(crate) fn has_one_origin(&self) -> bool {
        let single = ["x", "y", "z"].iter().all(|n| self.table.column(n).is_some_and(|c| c.scalar != Scalar::F64));
        self.stated_origin().is_ok_and(|stated| stated.is_some() || single)
    }

    pub(crate) fn cloud(&self) -> Result<GaussianCloud, IoError> {
        let mut cloud = GaussianCloud::default();
        self.append_to(&mut cloud)?;
        Ok(cloud)
    }

    /// Adds the Gaussians of these rows to those of the rows before them.
    pub(crate) fn append_to(&self, cloud: &mut GaussianCloud) -> Result<(), IoError> {
        let dc = self.columns(["f_dc_0", "f_dc_1", "f_dc_2"])?;
        let (degree, rest) = self.rest_columns()?;
        (cloud.sh_degree, cloud.render_mode) = (degree, render_mode::of_comments(&self.ply.comments));
        cloud.origin = self.positions(&mut cloud.positions)?;
        self.values(self.columns(["scale_0", "scale_1", "scale_2"])?, &mut cloud.log_scales)?;
        self.values(self.columns(["rot_0", "rot_1", "rot_2", "rot_3"])?, &mut cloud.quaternions)?;
        self.opacities(&mut cloud.opacity_logits)?;
        self.harmonics(degree, dc, &rest, &mut cloud.sh)?;
        self.extras(&mut cloud.extras);
        Ok(())
    }

    fn columns<const N: usize>(&self, names: [&'static str; N]) -> Result<[&Column; N], IoError> {
        self.table.all(names).map_err(|missing| IoError::Unsupported {
            path: self.ply.path.into(),
            what: format!("vertices without the property '{missing}' (points or a mesh, not Gaussians)"),
            remedy: "open a splat .ply, or the folder of posed photos that these points belong to",
        })
    }

    /// Adds what `N` columns hold, every value checked.
    fn values<const N: usize>(&self, columns: [&Column; N], to: &mut Vec<[f32; N]>) -> Result<(), IoError> {
        let before = to.len();
        let row = |i: usize| self.table.row(i);
        to.par_extend((0..self.table.rows).into_par_iter().map(|i| columns.map(|c| c.f32(row(i)))));
        self.check(&to[before..], |k| &columns[k].name)
    }

    /// Logits; infinite ones, which other programs make of opacities of 0 and 1, become large ones.
    fn opacities(&self, to: &mut Vec<f32>) -> Result<(), IoError> {
        let before = to.len();
        let [column] = self.columns(["opacity"])?;
        let finite = |v: f32| if v.is_infinite() { logit(f32::from(v > 0.0)) } else { v };
        to.par_extend((0..self.table.rows).into_par_iter().map(|i| finite(column.f32(self.table.row(i)))));
        self.check(to[before..].as_chunks::<1>().0, |_| &column.name)
    }

    fn check<'n, const N: usize>(&self, values: &[[f32; N]], name: impl Fn(usize) -> &'n str) -> Result<(), IoError> {
        if all_finite(values) {
            return Ok(());
        }
        let index = values.iter().position(|v| v.iter().any(|x| !x.is_finite())).unwrap_or(0);
        let k = values[index].iter().position(|x| !x.is_finite()).unwrap_or(0);
        Err(self.not_finite(index, name(k)))
    }

    fn not_finite(&self, index: usize, property: &str) -> IoError {
        let index = self.first + index;
        IoError::NotFinite { path: self.ply.path.into(), element: "vertex", index, property: property.into() }
    }

    /// Positions relative to an origin: the one that the file states, the middle of the scene
    /// where the file stores doubles, else zero (single precision loses nothing there).
    fn positions(&self, to: &mut Vec<[f32; 3]>) -> Result<DVec3, IoError> {
        let xyz = self.columns(["x", "y", "z"])?;
        let residual = self.table.all(["x_residual", "y_residual", "z_residual"]).ok();
        let doubles = xyz.iter().any(|c| c.scalar == Scalar::F64);
        let stated = self.stated_origin()?;
        if !doubles && (residual.is_none() || stated.is_none()) {
            self.values(xyz, to)?;
            return Ok(DVec3::ZERO);
        }
        let world: Vec<DVec3> = (0..self.table.rows)
            .into_par_iter()
            .map(|i| {
                let row = self.table.row(i);
                let fine = residual.map_or(DVec3::ZERO, |c| DVec3::from_array(c.map(|c| c.f64(row))));
                DVec3::from_array(xyz.map(|c| c.f64(row))) + fine
            })
            .collect();
        let origin = stated
            .unwrap_or_else(|| crate::scene::Bounds::of(world.iter().copied()).map_or(DVec3::ZERO, |b| b.center()));
        let before = to.len();
        to.par_extend(world.par_iter().map(|p| (*p - origin).as_vec3().to_array()));
        self.check(&to[before..], |k| &xyz[k].name)?;
        Ok(origin)
    }

    fn stated_origin(&self) -> Result<Option<DVec3>, IoError> {
        let Some(text) = self.ply.comments.iter().find_map(|c| c.strip_prefix(ORIGIN)) else { return Ok(None) };
        let numbers: Vec<f64> = text.split_ascii_whitespace().filter_map(|w| w.parse().ok()).collect();
        match numbers[..] {
            [x, y, z] if numbers.iter().all(|v| v.is_finite()) => Ok(Some(DVec3::new(x, y, z))),
            _ => Err(self.ply.syntax("vertex", format!("the comment '{ORIGIN}' does not hold three numbers"))),
        }
    }

    /// Degree and columns of the higher harmonics, in file order.
    fn rest_columns(&self) -> Result<(u8, Vec<&Column>), IoError> {
        let columns: Vec<&Column> = (0..).map_while(|k| self.table.column(&format!("f_rest_{k}"))).collect();
        let named = self.table.columns.iter().filter(|c| c.name.starts_with("f_rest_")).count();
        let degree = (0..=3_u8).find(|&d| 3 * (coefficients(d) - 1) == columns.len());
        match degree {
            Some(d) if named == columns.len() => Ok((d, columns)),
            _ => {
                Err(self.ply.syntax("vertex", format!("{named} properties f_rest_*, expected 0, 9, 24 or 45 in a row")))
            }
        }
    }

    fn harmonics(&self, degree: u8, dc: [&Column; 3], rest: &[&Column], to: &mut Vec<[f32; 3]>) -> Result<(), IoError> {
        let (before, stride) = (to.len(), coefficients(degree));
        let per_channel = stride - 1;
        match degree {
            0 => self.coefficients::<1>(dc, rest, to),
            1 => self.coefficients::<4>(dc, rest, to),
            2 => self.coefficients::<9>(dc, rest, to),
            _ => self.coefficients::<16>(dc, rest, to),
        }
        let sh = &to[before..];
        if !all_finite(sh) {
            let at = sh.iter().position(|v| v.iter().any(|x| !x.is_finite())).unwrap_or(0);
            let channel = sh[at].iter().position(|x| !x.is_finite()).unwrap_or(0);
            let name = match at % stride {
                0 => &dc[channel].name,
                k => &rest[channel * per_channel + k - 1].name,
            };
            return Err(self.not_finite(at / stride, name));
        }
        Ok(())
    }

    /// Adds `N` coefficients of each row. Known to the compiler, their number costs no division for each.
    fn coefficients<const N: usize>(&self, dc: [&Column; 3], rest: &[&Column], to: &mut Vec<[f32; 3]>) {
        to.par_extend((0..self.table.rows * N).into_par_iter().map(|at| {
            let row = self.table.row(at / N);
            match at % N {
                0 => dc.map(|c| c.f32(row)),
                k => [0, 1, 2].map(|channel| rest[channel * (N - 1) + k - 1].f32(row)),
            }
        }));
    }

    fn extras(&self, to: &mut Vec<ExtraProperty>) {
        for (k, column) in self.table.columns.iter().filter(|c| !is_standard(&c.name)).enumerate() {
            if to.len() == k {
                to.push(ExtraProperty { name: column.name.clone(), values: Vec::new() });
            }
            to[k].values.par_extend((0..self.table.rows).into_par_iter().map(|i| column.f32(self.table.row(i))));
        }
    }
}

/// Whether all numbers are. Without a way out early, so that it is fast where they are.
fn all_finite<const N: usize>(values: &[[f32; N]]) -> bool {
    let finite = |part: &[[f32; N]]| part.as_flattened().iter().fold(true, |all, x| all & x.is_finite());
    values.par_chunks(1 << 12).all(finite)
}
