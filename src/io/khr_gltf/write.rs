//! Writing splats as glTF, binary or with the buffer in the text.

use std::io::{self, Write};

use base64::write::EncoderWriter;
use serde_json::{Map, Value, json};

use super::{EXTENSION, EXTRA};
use crate::io::atomic::WriteProgress;
use crate::io::quantized::unit;
use crate::math::Real;
use crate::scene::{Axes, GaussianCloud};

/// Gaussians between two reports.
const BLOCK: usize = 4096;
/// Component type of floats.
const FLOAT: u32 = 5126;

/// Appends the numbers of a Gaussian as bytes.
type Put<'a> = Box<dyn Fn(usize, &mut Vec<u8>) + 'a>;

/// An attribute: one number or several per Gaussian.
struct Attribute<'a> {
    name: String,
    kind: &'static str,
    components: usize,
    put: Put<'a>,
}

/// Writes the bytes of a `.glb` of a valid cloud that is not empty.
pub(in crate::io) fn encode_binary(
    out: &mut dyn Write,
    cloud: &GaussianCloud,
    progress: &mut WriteProgress<'_>,
) -> io::Result<()> {
    let cloud = &turned(cloud);
    let attributes = attributes(cloud);
    let (mut text, bytes) = (document(cloud, &attributes, None).to_string(), buffer_bytes(cloud, &attributes));
    // Chunks end at multiples of four; the buffer's length already is one.
    text.extend(std::iter::repeat_n(' ', text.len().next_multiple_of(4) - text.len()));
    let size = |n: usize| {
        u32::try_from(n).map(u32::to_le_bytes).map_err(|_| {
            io::Error::new(io::ErrorKind::InvalidInput, "a .glb holds up to 4 GiB, the scene is larger: use .ply")
        })
    };
    let all = [&b"glTF\x02\0\0\0"[..], &size(28 + text.len() + bytes)?].concat();
    out.write_all(&all)?;
    out.write_all(&[&size(text.len())?, &b"JSON"[..]].concat())?;
    out.write_all(text.as_bytes())?;
    out.write_all(&[&size(bytes)?, &b"BIN\0"[..]].concat())?;
    buffer(cloud, &attributes, out, progress)
}

/// Writes the text of a `.gltf` of a valid cloud that is not empty, its buffer within.
pub(in crate::io) fn encode_text(
    out: &mut dyn Write,
    cloud: &GaussianCloud,
    progress: &mut WriteProgress<'_>,
) -> io::Result<()> {
    const HERE: &str = "data:application/octet-stream;base64,";
    let cloud = &turned(cloud);
    let attributes = attributes(cloud);
    let text = document(cloud, &attributes, Some(HERE)).to_string();
    let (before, after) = text.split_once(HERE).unwrap_or((&text, ""));
    write!(out, "{before}{HERE}")?;
    let mut encoded = EncoderWriter::new(&mut *out, base64::STANDARD);
    buffer(cloud, &attributes, &mut encoded, progress)?;
    encoded.finish()?;
    drop(encoded);
    out.write_all(after.as_bytes())
}

/// Turns the cloud to the axes of glTF.
fn turned(cloud: &GaussianCloud) -> GaussianCloud {
    cloud.clone().turned(&Axes::GLTF.scene_from_file().transpose(), false)
}

fn attributes(cloud: &GaussianCloud) -> Vec<Attribute<'_>> {
    let stride = cloud.sh_stride();
    let mut all = vec![
        attribute("POSITION".into(), |i| cloud.positions[i]),
        attribute(format!("{EXTENSION}:ROTATION"), |i| {
            let [w, x, y, z] = unit(cloud.quaternions[i]);
            [x, y, z, w]
        }),
        attribute(format!("{EXTENSION}:SCALE"), |i| cloud.log_scales[i].map(f32::exp)),
        attribute(format!("{EXTENSION}:OPACITY"), |i| [cloud.opacity_logits[i].sigmoid()]),
    ];
    for degree in 0..=usize::from(cloud.sh_degree) {
        for k in 0..2 * degree + 1 {
            let name = format!("{EXTENSION}:SH_DEGREE_{degree}_COEF_{k}");
            all.push(attribute(name, move |i| cloud.sh[i * stride + degree * degree + k]));
        }
    }
    all.extend(cloud.extras.iter().map(|e| attribute(format!("{EXTRA}{}", e.name), |i| [e.values[i]])));
    all
}

fn attribute<'a, const N: usize>(name: String, value: impl Fn(usize) -> [f32; N] + 'a) -> Attribute<'a> {
    let put = move |i: usize, out: &mut Vec<u8>| value(i).iter().for_each(|v| out.extend(v.to_le_bytes()));
    let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
    Attribute { name, kind, components: N, put: Box::new(put) }
}

fn buffer_bytes(cloud: &GaussianCloud, attributes: &[Attribute<'_>]) -> usize {
    attributes.iter().map(|a| 4 * a.components * cloud.len()).sum()
}

/// Writes the values, attribute after attribute.
fn buffer(
    cloud: &GaussianCloud,
    attributes: &[Attribute<'_>],
    out: &mut dyn Write,
    progress: &mut WriteProgress<'_>,
) -> io::Result<()> {
    let mut block = Vec::new();
    for (k, attribute) in attributes.iter().enumerate() {
        for first in (0..cloud.len()).step_by(BLOCK) {
            progress((k * cloud.len() + first) / attributes.len())?;
            block.clear();
            (first..cloud.len().min(first + BLOCK)).for_each(|i| (attribute.put)(i, &mut block));
            out.write_all(&block)?;
        }
    }
    Ok(())
}

/// Makes the JSON part. The origin of the cloud is the translation of two nested nodes, as readers keep single
/// precision for each.
fn document(cloud: &GaussianCloud, attributes: &[Attribute<'_>], uri: Option<&str>) -> Value {
    let (mut accessors, mut views, mut names) = (Vec::new(), Vec::new(), Map::new());
    let mut offset = 0;
    for attribute in attributes {
        names.insert(attribute.name.clone(), json!(accessors.len()));
        let (view, count, kind) = (views.len(), cloud.len(), attribute.kind);
        accessors.push(json!({ "bufferView": view, "componentType": FLOAT, "count": count, "type": kind }));
        let bytes = 4 * attribute.components * count;
        views.push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes }));
        offset += bytes;
    }
    let ends = |end: fn(f32, f32) -> f32, from: f32| {
        cloud.positions.iter().fold([from; 3], |a, p| [0, 1, 2].map(|k| end(a[k], p[k])))
    };
    accessors[0]["min"] = json!(ends(f32::min, f32::INFINITY));
    accessors[0]["max"] = json!(ends(f32::max, f32::NEG_INFINITY));
    let coarse = cloud.origin.as_vec3();
    let fine = (cloud.origin - coarse.as_dvec3()).as_vec3();
    let mut buffer = json!({ "byteLength": offset });
    if let Some(uri) = uri {
        buffer["uri"] = json!(uri);
    }
    json!({
        "asset": { "version": "2.0", "generator": concat!("fmlgs ", env!("CARGO_PKG_VERSION")) },
        "extensionsUsed": [EXTENSION],
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [
            { "translation": coarse.to_array(), "children": [1] },
            { "translation": fine.to_array(), "mesh": 0 },
        ],
        "meshes": [{ "primitives": [{
            "mode": 0,
            "attributes": names,
            "extensions": { EXTENSION: {
                "kernel": "ellipse", "colorSpace": "srgb_rec709_display",
                "projection": "perspective", "sortingMethod": "cameraDistance",
            } },
        }] }],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [buffer],
    })
}
