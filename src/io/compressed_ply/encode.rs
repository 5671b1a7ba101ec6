//! Writing compressed `.ply` files.

use std::fmt::Write as _;
use std::io::{self, Write};

use glam::DVec3;
use rayon::prelude::*;

use super::{BOUNDS, CHUNK, HARMONICS, PACKED};
use crate::io::atomic::WriteProgress;
use crate::io::quantized::{color, opacity_byte, to_unorm, without_largest};
use crate::io::{morton, render_mode, shift};
use crate::scene::GaussianCloud;

/// Lowest and highest values of three numbers.
type Bounds3 = [[f32; 3]; 2];

/// Writes the bytes of a compressed `.ply` of a valid cloud, in Morton order, which keeps the chunks small.
pub(in crate::io) fn encode(
    out: &mut dyn Write,
    cloud: &GaussianCloud,
    progress: &mut WriteProgress<'_>,
) -> io::Result<()> {
    let (near, shift) = shift::near_zero(cloud);
    let cloud = &*near;
    let order = morton::order(cloud);
    let chunks: Vec<(Vec<u8>, Vec<u8>)> = order.par_chunks(CHUNK).map(|chunk| packed(cloud, chunk)).collect();
    out.write_all(header(cloud, shift).as_bytes())?;
    chunks.iter().try_for_each(|(bounds, _)| out.write_all(bounds))?;
    for (k, (_, rows)) in chunks.iter().enumerate() {
        progress(k * CHUNK)?;
        out.write_all(rows)?;
    }
    let stride = cloud.sh_stride();
    let byte = |v: f32| ((v / HARMONICS + 0.5) * 256.0) as u8;
    for chunk in order.chunks(CHUNK).filter(|_| stride > 1) {
        let rests = chunk.iter().map(|i| &cloud.sh[i * stride + 1..(i + 1) * stride]);
        let bytes =
            rests.flat_map(|rest| [0, 1, 2].into_iter().flat_map(move |c| rest.iter().map(move |v| byte(v[c]))));
        out.write_all(&bytes.collect::<Vec<u8>>())?;
    }
    Ok(())
}

fn header(cloud: &GaussianCloud, shift: Option<DVec3>) -> String {
    let mut text = String::from("ply\nformat binary_little_endian 1.0\n");
    let mode = render_mode::comment(cloud.render_mode).map(str::to_owned);
    for comment in mode.into_iter().chain(shift.map(shift::comment)) {
        let _ = writeln!(text, "comment {comment}");
    }
    let mut element = |name: &str, rows: usize, kind: &str, properties: &[String]| {
        let _ = writeln!(text, "element {name} {rows}");
        properties.iter().for_each(|p| text.push_str(&format!("property {kind} {p}\n")));
    };
    element("chunk", cloud.len().div_ceil(CHUNK), "float", &names(&BOUNDS.concat()));
    element("vertex", cloud.len(), "uint", &names(&PACKED));
    let harmonics: Vec<String> = (0..3 * (cloud.sh_stride() - 1)).map(|k| format!("f_rest_{k}")).collect();
    if !harmonics.is_empty() {
        element("sh", cloud.len(), "uchar", &harmonics);
    }
    text + "end_header\n"
}

fn names(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

/// Packs the bounds of a chunk and its rows.
fn packed(cloud: &GaussianCloud, chunk: &[usize]) -> (Vec<u8>, Vec<u8>) {
    let stride = cloud.sh_stride();
    let all = |of: &dyn Fn(usize) -> [f32; 3]| chunk.iter().map(|i| of(*i)).collect::<Vec<_>>();
    let groups = [
        all(&|i| cloud.world_position(i).as_vec3().to_array()),
        all(&|i| cloud.log_scales[i]),
        all(&|i| cloud.sh[i * stride].map(color)),
    ];
    let bounds = groups.each_ref().map(|values| bounds(values));
    let within = |group: usize, k: usize| {
        let ([min, max], v) = (bounds[group], groups[group][k]);
        [0, 1, 2].map(|a| if max[a] > min[a] { (v[a] - min[a]) / (max[a] - min[a]) } else { 0.0 })
    };
    let rows = chunk.iter().enumerate().flat_map(|(k, &i)| {
        let (largest, rest) = without_largest(cloud.quaternions[i]);
        let rotation = rest.into_iter().fold(largest as u32, |packed, t| packed << 10 | to_unorm(t, 10));
        let [r, g, b] = within(2, k).map(|t| to_unorm(t, 8));
        let color = r << 24 | g << 16 | b << 8 | u32::from(opacity_byte(cloud.opacity_logits[i]));
        [three(within(0, k)), rotation, three(within(1, k)), color].map(u32::to_le_bytes)
    });
    let rows = rows.flatten().collect();
    (bounds.as_flattened().as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect(), rows)
}

fn bounds(values: &[[f32; 3]]) -> Bounds3 {
    let ends = |end: fn(f32, f32) -> f32| {
        let first = values.first().copied().unwrap_or_default();
        values.iter().fold(first, |a, v| [0, 1, 2].map(|k| end(a[k], v[k])))
    };
    [ends(f32::min), ends(f32::max)]
}

/// 11, 10 and 11 bits.
fn three([x, y, z]: [f32; 3]) -> u32 {
    to_unorm(x, 11) << 21 | to_unorm(y, 10) << 11 | to_unorm(z, 11)
}
