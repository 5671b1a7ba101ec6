//! Splats as PlayCanvas's and SuperSplat's `.compressed.ply`: 16 bytes a Gaussian, quantized
//! within chunks of 256 whose bounds come first, and harmonics of 8 bits a coefficient.

use rayon::prelude::*;

use super::IoError;
use super::ply::{Column, Ply, Table};
use super::quantized::{logit, unit_quaternion, unorm};
use crate::math::sh::{SH_C0, coefficients};
use crate::scene::GaussianCloud;

const CHUNK: usize = 256;

/// The Gaussians of a compressed `.ply`.
pub(super) fn decode(ply: &Ply<'_>) -> Result<GaussianCloud, IoError> {
    let table = |name: &'static str| ply.table(name)?.ok_or_else(|| ply.syntax(name, "missing".into()));
    let chunks = Chunks::read(ply, &table("chunk")?)?;
    let vertices = table("vertex")?;
    let [position, rotation, scale, color] = vertices
        .all(["packed_position", "packed_rotation", "packed_scale", "packed_color"])
        .map_err(|name| ply.syntax("vertex", format!("property '{name}' is missing")))?;
    let n = vertices.rows;
    if n > chunks.0.len() * CHUNK {
        return Err(IoError::Count {
            path: ply.path.into(),
            what: "vertices".into(),
            claimed: n as u64,
            possible: (chunks.0.len() * CHUNK) as u64,
        });
    }
    let rows = || (0..n).into_par_iter().map(|i| (&chunks.0[i / CHUNK], vertices.row(i)));
    let colors: Vec<[f32; 4]> = rows().map(|(c, row)| c.color(color.u32(row))).collect();
    let (degree, rest) = harmonics(ply, n)?;
    let stride = coefficients(degree);
    let mut sh = vec![[0.0; 3]; n * stride];
    sh.par_chunks_exact_mut(stride).zip(&colors).enumerate().for_each(|(i, (out, color))| {
        out[0] = [0, 1, 2].map(|c| (color[c] - 0.5) / SH_C0 as f32);
        if stride > 1 {
            out[1..].copy_from_slice(&rest[i * (stride - 1)..(i + 1) * (stride - 1)]);
        }
    });
    let cloud = GaussianCloud {
        positions: rows().map(|(c, row)| c.position(position.u32(row))).collect(),
        log_scales: rows().map(|(c, row)| c.scale(scale.u32(row))).collect(),
        quaternions: rows().map(|(_, row)| quaternion(rotation.u32(row))).collect(),
        opacity_logits: colors.par_iter().map(|c| logit(c[3])).collect(),
        sh_degree: degree,
        sh,
        ..GaussianCloud::default()
    };
    // Bounds are finite, but their difference may not be.
    cloud.validate().map_err(|cause| IoError::Cloud { path: ply.path.into(), cause })?;
    Ok(cloud)
}

/// Bounds of a chunk: minimum and extent of position, log-scale and color.
struct Chunk {
    position: [[f32; 3]; 2],
    scale: [[f32; 3]; 2],
    color: [[f32; 3]; 2],
}

struct Chunks(Vec<Chunk>);

impl Chunks {
    fn read(ply: &Ply<'_>, table: &Table<'_>) -> Result<Self, IoError> {
        let columns = |names: [&'static str; 6]| {
            table.all(names).map_err(|name| ply.syntax("chunk", format!("property '{name}' is missing")))
        };
        let position = columns(["min_x", "min_y", "min_z", "max_x", "max_y", "max_z"])?;
        let scale =
            columns(["min_scale_x", "min_scale_y", "min_scale_z", "max_scale_x", "max_scale_y", "max_scale_z"])?;
        // Files of the first version have no color bounds: colors fill 0 to 1.
        let color = match table.column("min_r") {
            Some(_) => Some(columns(["min_r", "min_g", "min_b", "max_r", "max_g", "max_b"])?),
            None => None,
        };
        let bounds = |columns: [&Column; 6], index: usize| {
            let row = table.row(index);
            let v = columns.map(|c| c.f32(row));
            match v.iter().position(|x| !x.is_finite()) {
                None => Ok([[v[0], v[1], v[2]], [v[3] - v[0], v[4] - v[1], v[5] - v[2]]]),
                Some(k) => Err(IoError::NotFinite {
                    path: ply.path.into(),
                    element: "chunk",
                    index,
                    property: columns[k].name.clone(),
                }),
            }
        };
        let chunk = |i| {
            Ok(Chunk {
                position: bounds(position, i)?,
                scale: bounds(scale, i)?,
                color: color.map_or(Ok([[0.0; 3], [1.0; 3]]), |c| bounds(c, i))?,
            })
        };
        (0..table.rows).map(chunk).collect::<Result<_, _>>().map(Self)
    }
}

impl Chunk {
    fn position(&self, packed: u32) -> [f32; 3] {
        within(&self.position, three(packed))
    }

    fn scale(&self, packed: u32) -> [f32; 3] {
        within(&self.scale, three(packed))
    }

    fn color(&self, packed: u32) -> [f32; 4] {
        let [r, g, b, a] = [24, 16, 8, 0].map(|shift| unorm(packed >> shift, 8));
        let [r, g, b] = within(&self.color, [r, g, b]);
        [r, g, b, a]
    }
}

fn within([min, extent]: &[[f32; 3]; 2], t: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|k| min[k] + extent[k] * t[k])
}

/// 11, 10 and 11 bits.
fn three(packed: u32) -> [f32; 3] {
    [unorm(packed >> 21, 11), unorm(packed >> 11, 10), unorm(packed, 11)]
}

/// 2 bits for the largest component, 10 for each of the others.
fn quaternion(packed: u32) -> [f32; 4] {
    let rest = [20, 10, 0].map(|shift| unorm(packed >> shift, 10));
    unit_quaternion((packed >> 30) as usize, rest)
}

/// Degree and higher harmonics of the optional element `sh`, those of one Gaussian together.
fn harmonics(ply: &Ply<'_>, n: usize) -> Result<(u8, Vec<[f32; 3]>), IoError> {
    let Some(table) = ply.table("sh")? else { return Ok((0, Vec::new())) };
    let columns: Vec<&Column> = (0..).map_while(|k| table.column(&format!("f_rest_{k}"))).collect();
    let Some(degree) = (1..=3_u8).find(|&d| 3 * (coefficients(d) - 1) == columns.len()) else {
        return Err(ply.syntax("sh", format!("{} properties f_rest_*, expected 9, 24 or 45", columns.len())));
    };
    if table.rows != n {
        return Err(IoError::Count {
            path: ply.path.into(),
            what: "vertices".into(),
            claimed: n as u64,
            possible: table.rows as u64,
        });
    }
    let per_channel = coefficients(degree) - 1;
    // The ends of the range are exact, the values between them lie in the middle of their step.
    let value = |byte: u32| match byte {
        0 => -4.0,
        255.. => 4.0,
        b => ((b as f32 + 0.5) / 256.0 - 0.5) * 8.0,
    };
    let mut rest = vec![[0.0; 3]; n * per_channel];
    rest.par_chunks_exact_mut(per_channel).enumerate().for_each(|(i, out)| {
        let row = table.row(i);
        for (k, rgb) in out.iter_mut().enumerate() {
            *rgb = [0, 1, 2].map(|channel| value(columns[channel * per_channel + k].u32(row)));
        }
    });
    Ok((degree, rest))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// One chunk of `n` Gaussians, all with the same packed values.
    fn file(n: usize, packed: [u32; 4]) -> Vec<u8> {
        let mut text = String::from("ply\nformat binary_little_endian 1.0\nelement chunk 1\n");
        let mut bounds = Vec::new();
        for (group, lo, hi) in [("", -1.0_f32, 3.0_f32), ("scale_", -8.0, 0.0)] {
            for (end, value) in [("min", lo), ("max", hi)] {
                for axis in ["x", "y", "z"] {
                    text += &format!("property float {end}_{group}{axis}\n");
                    bounds.extend(value.to_le_bytes());
                }
            }
        }
        text += &format!("element vertex {n}\n");
        for name in ["position", "rotation", "scale", "color"] {
            text += &format!("property uint packed_{name}\n");
        }
        let mut out = (text + "end_header\n").into_bytes();
        out.extend(bounds);
        (0..n).for_each(|_| packed.iter().for_each(|v| out.extend(v.to_le_bytes())));
        out
    }

    fn parse(bytes: &[u8]) -> Result<GaussianCloud, IoError> {
        crate::io::splat_ply::parse(bytes, Path::new("a.compressed.ply"))
    }

    #[test]
    fn fields_are_where_the_format_puts_them() {
        // Position: x at its top, y at 0, z at its top. Scale the other way round.
        let position = (2047 << 21) | 2047;
        let scale = 1023 << 11;
        // Largest component y (2), the others 0 (511.5 is the middle; 512 is just above).
        let rotation = (2 << 30) | (512 << 20) | (512 << 10) | 512;
        let color = (255 << 24) | (128 << 8) | 51;
        let c = parse(&file(2, [position, rotation, scale, color])).expect("valid");
        assert_eq!(c.len(), 2);
        assert_eq!(c.positions[1], [3.0, -1.0, 3.0]);
        assert_eq!(c.log_scales[1], [-8.0, 0.0, -8.0]);
        let [w, x, y, z] = c.quaternions[0];
        assert!(y > 0.9999 && w.abs() < 1e-3 && x.abs() < 1e-3 && z.abs() < 1e-3);
        let rgb = c.sh[0].map(|v| v * SH_C0 as f32 + 0.5);
        assert!((rgb[0] - 1.0).abs() < 1e-6 && rgb[1].abs() < 1e-6 && (rgb[2] - 128.0 / 255.0).abs() < 1e-6);
        assert!((c.opacity_logits[0] - (0.2_f32 / 0.8).ln()).abs() < 1e-6);
        c.validate().expect("finite");
    }

    #[test]
    fn more_vertices_than_chunks_hold_are_refused() {
        let e = parse(&file(257, [0; 4])).expect_err("too many");
        assert!(matches!(e, IoError::Count { claimed: 257, possible: 256, .. }), "{e}");
        assert!(parse(&file(256, [0; 4])).is_ok());
    }

    #[test]
    fn bounds_that_are_not_finite_are_named() {
        let mut bytes = file(1, [0; 4]);
        let body = bytes.len() - 16 - 48;
        bytes[body + 16..body + 20].copy_from_slice(&f32::NAN.to_le_bytes());
        let e = parse(&bytes).expect_err("NaN");
        assert!(matches!(&e, IoError::NotFinite { element: "chunk", property, .. } if property == "max_y"), "{e}");
    }
}
