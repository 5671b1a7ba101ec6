//! Reading splats from `.ply`.

use std::path::Path;

use glam::DVec3;
use rayon::prelude::*;

use super::{ORIGIN, is_standard};
use crate::io::finite::finite_only;
use crate::io::ply::{Colors, Column, Ply, Scalar, Table};
use crate::io::quantized::{constant, logit};
use crate::io::{IoError, compressed_ply, render_mode, shift, vertical};
use crate::math::sh::coefficients;
use crate::scene::{Bounds, ExtraProperty, GaussianCloud, SplatRenderMode};

/// Parses the Gaussians of a file as they are.
pub(super) fn parse(bytes: &[u8], path: &Path) -> Result<GaussianCloud, IoError> {
    let ply = Ply::parse(bytes, path)?;
    if ply.element("chunk").is_some() {
        return compressed_ply::decode(&ply);
    }
    let Some(table) = ply.table("vertex")? else {
        return Err(ply.syntax("vertex", "missing".into()));
    };
    finite_only(Reading { ply: &ply, table: &table }.cloud()?, path)
}

/// Logarithm of the third standard deviation of 2D Gaussian Splatting's disks, which have none; as in other viewers.
pub(crate) const FLAT: f32 = -13.815_511;

pub(super) struct Reading<'a> {
    pub(crate) ply: &'a Ply<'a>,
    pub(crate) table: &'a Table<'a>,
}

impl Reading<'_> {
    /// Returns whether any block of rows alone has the origin and the color range of the whole file.
    pub(crate) fn is_told_by_any_row(&self) -> bool {
        let single = ["x", "y", "z"].iter().all(|n| self.table.column(n).is_some_and(|c| c.scalar != Scalar::F64));
        let one_origin = self.stated_origin().is_ok_and(|stated| stated.is_some() || single);
        one_origin && (self.table.column("f_dc_0").is_some() || Colors::has_one_range(&self.table.columns))
    }

    pub(crate) fn cloud(&self) -> Result<GaussianCloud, IoError> {
        let mut cloud = GaussianCloud::default();
        self.append_to(&mut cloud)?;
        Ok(cloud)
    }

    /// Appends the Gaussians of these rows.
    pub(crate) fn append_to(&self, cloud: &mut GaussianCloud) -> Result<(), IoError> {
        let (degree, rest) = self.rest_columns()?;
        let (flat, scales) = self.scales()?;
        cloud.render_mode = if flat { SplatRenderMode::Surfels } else { render_mode::of_comments(&self.ply.comments) };
        (cloud.sh_degree, cloud.up) = (degree, vertical::of_comments(&self.ply.comments));
        cloud.origin = self.positions(&mut cloud.positions)?;
        let row = |i: usize| self.table.row(i);
        let all = || (0..self.table.rows).into_par_iter();
        cloud.log_scales.par_extend(all().map(|i| scales.map(|c| c.map_or(FLAT, |c| c.f32(row(i))))));
        self.values(self.columns(["rot_0", "rot_1", "rot_2", "rot_3"])?, &mut cloud.quaternions);
        self.opacities(&mut cloud.opacity_logits)?;
        self.harmonics(degree, &rest, &mut cloud.sh)?;
        self.extras(&mut cloud.extras);
        Ok(())
    }

    /// Returns true for disks, and the columns of the scales; disks have two.
    fn scales(&self) -> Result<(bool, [Option<&Column>; 3]), IoError> {
        match self.table.column("scale_2") {
            Some(_) => Ok((false, self.columns(["scale_0", "scale_1", "scale_2"])?.map(Some))),
            None => {
                let [first, second] = self.columns(["scale_0", "scale_1"])?;
                Ok((true, [Some(first), Some(second), None]))
            }
        }
    }

    fn columns<const N: usize>(&self, names: [&'static str; N]) -> Result<[&Column; N], IoError> {
        self.table.all(names).map_err(|missing| IoError::Unsupported {
            path: self.ply.path.into(),
            what: format!("vertices without the property '{missing}' (points or a mesh, not Gaussians)"),
            remedy: "open a splat .ply, or the folder of posed photos that these points belong to",
        })
    }

    /// Appends the values of `N` columns.
    fn values<const N: usize>(&self, columns: [&Column; N], to: &mut Vec<[f32; N]>) {
        let row = |i: usize| self.table.row(i);
        to.par_extend((0..self.table.rows).into_par_iter().map(|i| columns.map(|c| c.f32(row(i)))));
    }

    /// Reads the logits; infinite ones, written by other programs for opacities of 0 and 1, are made finite. Without
    /// them, an alpha channel is the opacity.
    fn opacities(&self, to: &mut Vec<f32>) -> Result<(), IoError> {
        let finite = |v: f32| if v.is_infinite() { logit(f32::from(v > 0.0)) } else { v };
        let rows = (0..self.table.rows).into_par_iter();
        match (self.table.column("opacity"), self.table.column("alpha").filter(|c| c.scalar == Scalar::U8)) {
            (None, Some(alpha)) => to.par_extend(rows.map(|i| logit(alpha.f32(self.table.row(i)) / 255.0))),
            _ => {
                let [column] = self.columns(["opacity"])?;
                to.par_extend(rows.map(|i| finite(column.f32(self.table.row(i)))));
            }
        }
        Ok(())
    }

    /// Reads positions relative to an origin: the stated one, the middle of the scene if the file stores doubles, else
    /// zero (single precision loses nothing there).
    fn positions(&self, to: &mut Vec<[f32; 3]>) -> Result<DVec3, IoError> {
        let xyz = self.columns(["x", "y", "z"])?;
        let residual = self.table.all(["x_residual", "y_residual", "z_residual"]).ok();
        let doubles = xyz.iter().any(|c| c.scalar == Scalar::F64);
        let stated = self.stated_origin()?;
        let shift = shift::of_comments(&self.ply.comments).map_err(|reason| self.ply.syntax("vertex", reason))?;
        let shift = shift.unwrap_or_default();
        if !doubles && (residual.is_none() || stated.is_none()) {
            self.values(xyz, to);
            return Ok(shift);
        }
        let world: Vec<DVec3> = (0..self.table.rows)
            .into_par_iter()
            .map(|i| {
                let row = self.table.row(i);
                let fine = residual.map_or(DVec3::ZERO, |c| DVec3::from_array(c.map(|c| c.f64(row))));
                DVec3::from_array(xyz.map(|c| c.f64(row))) + fine
            })
            .collect();
        let finite = world.iter().copied().filter(|p| p.is_finite());
        let origin = stated.unwrap_or_else(|| Bounds::of(finite).map_or(DVec3::ZERO, |b| b.center()));
        to.par_extend(world.par_iter().map(|p| (*p - origin).as_vec3().to_array()));
        Ok(origin + shift)
    }

    fn stated_origin(&self) -> Result<Option<DVec3>, IoError> {
        let Some(text) = self.ply.comments.iter().find_map(|c| c.strip_prefix(ORIGIN)) else { return Ok(None) };
        let broken = || self.ply.syntax("vertex", format!("the comment '{ORIGIN}' does not hold three numbers"));
        shift::parsed(text).map(Some).ok_or_else(broken)
    }

    /// Returns degree and columns of the higher harmonics, in file order.
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

    /// Appends all harmonics: the constant ones from their columns, or from colors.
    fn harmonics(&self, degree: u8, rest: &[&Column], to: &mut Vec<[f32; 3]>) -> Result<(), IoError> {
        let (before, dc) = (to.len(), self.table.all(["f_dc_0", "f_dc_1", "f_dc_2"]).ok());
        let colors = if dc.is_none() { Colors::of(self.table) } else { None };
        if dc.is_none() && colors.is_none() {
            return self.columns(["f_dc_0", "f_dc_1", "f_dc_2"]).map(drop);
        }
        match degree {
            0 => self.coefficients::<1>(dc, rest, to),
            1 => self.coefficients::<4>(dc, rest, to),
            2 => self.coefficients::<9>(dc, rest, to),
            _ => self.coefficients::<16>(dc, rest, to),
        }
        if let Some(colors) = colors {
            let constants = to[before..].iter_mut().step_by(coefficients(degree)).enumerate();
            constants.for_each(|(i, out)| *out = colors.rgb(self.table.row(i)).map(|v| constant(v as f32)));
        }
        Ok(())
    }

    /// Appends `N` coefficients of each row. A compile-time `N` avoids a division per coefficient.
    fn coefficients<const N: usize>(&self, dc: Option<[&Column; 3]>, rest: &[&Column], to: &mut Vec<[f32; 3]>) {
        to.par_extend((0..self.table.rows * N).into_par_iter().map(|at| {
            let row = self.table.row(at / N);
            match at % N {
                0 => dc.map_or([0.0; 3], |dc| dc.map(|c| c.f32(row))),
                k => [0, 1, 2].map(|channel| rest[channel * (N - 1) + k - 1].f32(row)),
            }
        }));
    }

    fn extras(&self, to: &mut Vec<ExtraProperty>) {
        let plain = self.table.column("f_dc_0").is_some();
        let used = |name: &str| is_standard(name) || !plain && Colors::is_name(name);
        for (k, column) in self.table.columns.iter().filter(|c| !used(&c.name)).enumerate() {
            if to.len() == k {
                to.push(ExtraProperty { name: column.name.clone(), values: Vec::new() });
            }
            to[k].values.par_extend((0..self.table.rows).into_par_iter().map(|i| column.f32(self.table.row(i))));
        }
    }
}
