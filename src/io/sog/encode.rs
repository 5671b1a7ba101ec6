//! Encoding of Gaussians as SOG pictures, version 2.

use std::io::{self, Cursor};

use image::ExtendedColorType;
use image::codecs::webp::WebPEncoder;
use rayon::prelude::*;
use serde_json::json;

use super::palette::{codebook, palette};
use super::{FIRST_TAG, META_FILE, PALETTE_ROW};
use crate::io::atomic::WriteProgress;
use crate::io::quantized::{opacity_byte, to_byte, to_unorm, without_largest};
use crate::io::{morton, render_mode, shift};
use crate::scene::GaussianCloud;

/// Longest side of a WebP picture in px.
const MOST_PX: usize = 16_383;
/// Most entries of the palette of harmonics.
const MOST_ENTRIES: usize = 1 << 16;

/// Pixels of a picture, the used ones only.
struct Picture {
    name: &'static str,
    size_px: [usize; 2],
    pixels: Vec<[u8; 4]>,
}

/// Encodes a valid cloud that is not empty as the files of a SOG, `meta.json` last, with its Gaussians in Morton order.
///
/// # Errors
/// If there are more Gaussians than a picture has pixels.
pub(super) fn files(cloud: &GaussianCloud, progress: &mut WriteProgress<'_>) -> io::Result<Vec<(String, Vec<u8>)>> {
    let (near, shift) = shift::near_zero(cloud);
    let cloud = &*near;
    let order = morton::order(cloud);
    let n = order.len();
    let width = ((n as f64).sqrt() / 4.0).ceil() as usize * 4;
    let size_px = [width, n.div_ceil(width).next_multiple_of(4)];
    if size_px.iter().any(|side| *side > MOST_PX) {
        let text = format!("a SOG holds {} Gaussians, the scene has {n}: use .ply", MOST_PX * MOST_PX);
        return Err(io::Error::new(io::ErrorKind::InvalidInput, text));
    }
    let picture = |name: &'static str, pixels: Vec<[u8; 4]>| Picture { name, size_px, pixels };
    let in_order = |of: &(dyn Fn(usize) -> [u8; 4] + Sync)| order.par_iter().map(|i| of(*i)).collect::<Vec<_>>();
    let (places, mins, maxs) = places(cloud);
    let mut pictures = vec![
        picture("means_l.webp", in_order(&|i| with(places[i].map(|v| v as u8), 255))),
        picture("means_u.webp", in_order(&|i| with(places[i].map(|v| (v >> 8) as u8), 255))),
        picture(
            "quats.webp",
            in_order(&|i| {
                let (largest, rest) = without_largest(cloud.quaternions[i]);
                with(rest.map(to_byte), FIRST_TAG + largest as u8)
            }),
        ),
    ];
    progress(n / 4)?;
    let stride = cloud.sh_stride();
    let (scales, labels) = codebook(cloud.log_scales.as_flattened());
    pictures.push(picture("scales.webp", in_order(&|i| with([0, 1, 2].map(|k| labels[3 * i + k]), 255))));
    let constant: Vec<f32> = cloud.sh.iter().step_by(stride).flatten().copied().collect();
    let (colors, labels) = codebook(&constant);
    let opacity = |i: usize| opacity_byte(cloud.opacity_logits[i]);
    pictures.push(picture("sh0.webp", in_order(&|i| with([0, 1, 2].map(|k| labels[3 * i + k]), opacity(i)))));
    progress(n / 2)?;
    let part = |codebook: &[f32], name: &str| json!({ "codebook": codebook, "files": [name] });
    let mut meta = json!({
        "version": 2,
        "asset": { "generator": "fmlgs" },
        "count": n,
        "means": { "mins": mins, "maxs": maxs, "files": ["means_l.webp", "means_u.webp"] },
        "scales": part(&scales, "scales.webp"),
        "quats": { "files": ["quats.webp"] },
        "sh0": part(&colors, "sh0.webp"),
    });
    if let Some(shift) = shift {
        meta["fmlgs_shift"] = json!(shift.to_array());
    }
    if let Some(model) = render_mode::sog_model(cloud.render_mode) {
        meta["model"] = json!(model);
    }
    if stride > 1 {
        let rest: Vec<f32> = cloud.sh.chunks_exact(stride).flat_map(|sh| sh[1..].as_flattened()).copied().collect();
        let found = palette(&rest, 3 * (stride - 1), MOST_ENTRIES.min(1 << n.ilog2()));
        let (levels, bytes) = codebook(&found.entries);
        let label = |i: usize| found.labels[i].to_le_bytes();
        pictures.push(picture("shN_labels.webp", in_order(&|i| [label(i)[0], label(i)[1], 0, 255])));
        let pixels: Vec<[u8; 4]> = bytes.as_chunks::<3>().0.iter().map(|rgb| with(*rgb, 255)).collect();
        let entries = pixels.len() / (stride - 1);
        let size_px = [PALETTE_ROW * (stride - 1), entries.div_ceil(PALETTE_ROW)];
        pictures.push(Picture { name: "shN_centroids.webp", size_px, pixels });
        meta["shN"] = json!({
            "count": entries, "bands": cloud.sh_degree, "codebook": levels.as_slice(),
            "files": ["shN_centroids.webp", "shN_labels.webp"],
        });
    }
    progress(3 * (n / 4))?;
    let written: io::Result<Vec<_>> = pictures.into_par_iter().map(webp).collect();
    let mut files = written?;
    files.push((META_FILE.to_owned(), serde_json::to_vec(&meta)?));
    progress(n)?;
    Ok(files)
}

fn with([r, g, b]: [u8; 3], alpha: u8) -> [u8; 4] {
    [r, g, b, alpha]
}

/// Encodes positions in 16 bits an axis on a logarithmic scale; returns the ends of that scale too.
fn places(cloud: &GaussianCloud) -> (Vec<[u16; 3]>, [f32; 3], [f32; 3]) {
    let logarithm = |v: f32| v.abs().ln_1p().copysign(v);
    let all: Vec<[f32; 3]> =
        (0..cloud.len()).map(|i| cloud.world_position(i).as_vec3().to_array().map(logarithm)).collect();
    let ends = |end: fn(f32, f32) -> f32| all.iter().fold(all[0], |a, p| [0, 1, 2].map(|k| end(a[k], p[k])));
    let (min, max) = (ends(f32::min), ends(f32::max));
    let place = |p: &[f32; 3]| {
        [0, 1, 2].map(|k| to_unorm((p[k] - min[k]) / (max[k] - min[k]).max(f32::MIN_POSITIVE), 16) as u16)
    };
    (all.iter().map(place).collect(), min, max)
}

/// Encodes a lossless picture; unused pixels are black.
fn webp(picture: Picture) -> io::Result<(String, Vec<u8>)> {
    let Picture { name, size_px: [width, height], mut pixels } = picture;
    pixels.resize(width * height, [0, 0, 0, 255]);
    let mut out = Cursor::new(Vec::new());
    WebPEncoder::new_lossless(&mut out)
        .encode(pixels.as_flattened(), width as u32, height as u32, ExtendedColorType::Rgba8)
        .map_err(io::Error::other)?;
    Ok((name.to_owned(), out.into_inner()))
}
