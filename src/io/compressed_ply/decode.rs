//! Reading compressed `.ply` files.

use rayon::prelude::*;

use super::{BOUNDS, CHUNK, HARMONICS, PACKED};
use crate::io::finite::finite_only;
use crate::io::ply::{Column, Ply, Table};
use crate::io::quantized::{constant, logit, unit_quaternion, unorm};
use crate::io::{IoError, render_mode, shift, vertical};
use crate::math::sh::coefficients;
use crate::scene::GaussianCloud;

/// The Gaussians of a compressed `.ply`.
pub(in crate::io) fn decode(ply: &Ply<'_>) -> Result<GaussianCloud, IoError> {
    let table = |name: &'static str| ply.table(name)?.ok_or_else(|| ply.syntax(name, "missing".into()));
    let chunks = Chunks::read(ply, &table("chunk")?)?;
    let vertices = table("vertex")?;
    let [position, rotation, scale, color] =
        vertices.all(PACKED).map_err(|name| ply.syntax("vertex", format!("property '{name}' is missing")))?;
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
        out[0] = [0, 1, 2].map(|c| constant(color[c]));
        if stride > 1 {
            out[1..].copy_from_slice(&rest[i * (stride - 1)..(i + 1) * (stride - 1)]);
        }
    });
    let shift = shift::of_comments(&ply.comments).map_err(|reason| ply.syntax("vertex", reason))?;
    let cloud = GaussianCloud {
        origin: shift.unwrap_or_default(),
        positions: rows().map(|(c, row)| c.position(position.u32(row))).collect(),
        log_scales: rows().map(|(c, row)| c.scale(scale.u32(row))).collect(),
        quaternions: rows().map(|(_, row)| quaternion(rotation.u32(row))).collect(),
        opacity_logits: colors.par_iter().map(|c| logit(c[3])).collect(),
        sh_degree: degree,
        sh,
        render_mode: render_mode::of_comments(&ply.comments),
        up: vertical::of_comments(&ply.comments),
        ..GaussianCloud::default()
    };
    // Bounds are finite, but their difference may not be.
    finite_only(cloud, ply.path)
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
        let [position, scale] = [columns(BOUNDS[0])?, columns(BOUNDS[1])?];
        // Files of the first version have no color bounds: colors fill 0 to 1.
        let color = match table.column("min_r") {
            Some(_) => Some(columns(BOUNDS[2])?),
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
        0 => -HARMONICS / 2.0,
        255.. => HARMONICS / 2.0,
        b => ((b as f32 + 0.5) / 256.0 - 0.5) * HARMONICS,
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
