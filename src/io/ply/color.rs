//! Colors of a PLY element, under any of the usual names and in any usual range.

use rayon::prelude::*;

use super::{Column, Scalar, Table};
use crate::math::sh::SH_C0;

/// Names of red, green and blue; the first that exist are used.
const NAMES: [[&str; 3]; 4] = [
    ["red", "green", "blue"],
    ["diffuse_red", "diffuse_green", "diffuse_blue"],
    ["r", "g", "b"],
    ["f_dc_0", "f_dc_1", "f_dc_2"],
];
/// Largest values of colors, in the order tried.
const RANGES: [f64; 3] = [1.0, 255.0, 65_535.0];
/// Largest excess of floats over a range: colors may be brighter than white.
const ABOVE: f64 = 2.0;

/// The columns of colors.
pub(crate) struct Colors<'a> {
    columns: [&'a Column; 3],
    kind: Kind,
}

#[derive(Clone, Copy)]
enum Kind {
    /// Values up to this one.
    Range(f64),
    /// Constant harmonics.
    Harmonics,
}

impl<'a> Colors<'a> {
    /// Returns whether a name is that of a color without harmonics.
    pub(crate) fn is_name(name: &str) -> bool {
        NAMES[..3].iter().flatten().any(|known| *known == name)
    }

    /// Returns whether the type alone fixes the range, so that any block of rows is enough to decode.
    pub(crate) fn has_one_range(columns: &[Column]) -> bool {
        let of_colors = |c: &&Column| Self::is_name(&c.name);
        columns.iter().filter(of_colors).all(|c| c.scalar == Scalar::U8)
    }

    /// Finds the colors of a table, if it has any. Bytes fill their range; the range of other types is the smallest
    /// that holds all values.
    pub(crate) fn of(table: &'a Table<'_>) -> Option<Self> {
        let (columns, names) = NAMES.iter().find_map(|names| Some((table.all(*names).ok()?, names)))?;
        if names[0].starts_with("f_dc") {
            return Some(Self { columns, kind: Kind::Harmonics });
        }
        if columns.iter().all(|c| c.scalar == Scalar::U8) {
            return Some(Self { columns, kind: Kind::Range(RANGES[1]) });
        }
        let highest = |row: &[u8]| columns.iter().map(|c| c.f64(row)).fold(0.0, f64::max);
        let most = (0..table.rows).into_par_iter().map(|i| highest(table.row(i))).reduce(|| 0.0, f64::max);
        let float = columns.iter().any(|c| c.scalar.is_float());
        let fits = |range: &&f64| match **range {
            1.0 => float && most <= ABOVE,
            range => most <= range + if float { ABOVE } else { 0.0 },
        };
        Some(Self { columns, kind: Kind::Range(*RANGES.iter().find(fits).unwrap_or(&most)) })
    }

    /// Red, green and blue of a row, 0 to 1 within the range of a display.
    #[inline]
    pub(crate) fn rgb(&self, row: &[u8]) -> [f64; 3] {
        match self.kind {
            Kind::Range(most) => self.columns.map(|c| c.f64(row) / most),
            Kind::Harmonics => self.columns.map(|c| 0.5 + SH_C0 * c.f64(row)),
        }
    }
}
