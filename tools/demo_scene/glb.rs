//! The scene as a binary glTF file.

use std::collections::HashMap;

use glam::{DQuat, DVec3};
use serde_json::{Value, json};

use super::mesh::Mesh;
use super::paint::Picture;

/// Positions are rounded to this share of a meter: far finer than anything seen, and coarse enough
/// that the last bits of a machine's sine do not reach the file.
const POSITION_STEPS: f64 = 65_536.0;
/// The same for unit normals and for texture coordinates.
const UNIT_STEPS: f64 = 4_096.0;

/// A surface.
#[derive(Clone, Debug)]
pub struct Look {
    /// sRGB color, multiplied with the picture.
    pub color: [u8; 3],
    /// Painted on.
    pub picture: Option<Picture>,
    /// 0 for a mirror, 1 for chalk.
    pub roughness: f32,
    /// True if it is metal.
    pub metal: bool,
    /// Linear emitted light.
    pub glow: [f32; 3],
}

/// Smooth plastic or glaze of one color.
pub fn glossy(color: [u8; 3]) -> Look {
    Look { color, picture: None, roughness: 0.4, metal: false, glow: [0.0; 3] }
}

/// Rubber, paper or paint of one color.
pub fn matt(color: [u8; 3]) -> Look {
    Look { roughness: 0.9, ..glossy(color) }
}

/// Metal of one color.
pub fn metal(color: [u8; 3]) -> Look {
    Look { roughness: 0.45, metal: true, ..glossy(color) }
}

/// Covered by a picture.
pub fn painted(picture: Picture, roughness: f32) -> Look {
    Look { color: [255; 3], picture: Some(picture), roughness, metal: false, glow: [0.0; 3] }
}

/// A named piece of an object.
#[derive(Clone, Debug)]
pub struct Part {
    /// Its name, as a person would say it.
    pub name: &'static str,
    /// In the object's own axes.
    pub mesh: Mesh,
    /// Its surface.
    pub look: Look,
}

/// A part.
pub fn part(name: &'static str, mesh: Mesh, look: Look) -> Part {
    Part { name, mesh, look }
}

/// A named thing of several parts.
#[derive(Clone, Debug)]
pub struct Object {
    /// Its name.
    pub name: &'static str,
    /// Position of its own origin, in meters.
    pub position: DVec3,
    /// Turned about the vertical by this.
    pub turn_deg: f64,
    /// Its parts.
    pub parts: Vec<Part>,
}

/// Writes objects as top-level nodes with their parts as children.
pub fn write(objects: &[Object]) -> Result<Vec<u8>, image::ImageError> {
    let mut file = File::default();
    let (mut nodes, mut tops) = (Vec::new(), Vec::new());
    for object in objects {
        let children: Vec<usize> = object
            .parts
            .iter()
            .map(|part| {
                let mesh = file.mesh(part)?;
                nodes.push(json!({ "name": part.name, "mesh": mesh }));
                Ok(nodes.len() - 1)
            })
            .collect::<Result<_, image::ImageError>>()?;
        let turn = DQuat::from_rotation_y(object.turn_deg.to_radians());
        let round = |v: f64, steps: f64| (v * steps).round() / steps;
        nodes.push(json!({
            "name": object.name,
            "translation": object.position.to_array().map(|c| round(c, POSITION_STEPS)),
            "rotation": turn.to_array().map(|c| round(c, 1_048_576.0)),
            "children": children,
        }));
        tops.push(nodes.len() - 1);
    }
    let root = json!({
        "asset": { "version": "2.0", "generator": "fmlgs demo scene" },
        "scene": 0,
        "scenes": [{ "name": "demo", "nodes": tops }],
        "nodes": nodes,
        "meshes": file.meshes,
        "materials": file.materials,
        "textures": file.textures,
        "images": file.images,
        "samplers": [{ "magFilter": 9729, "minFilter": 9987 }],
        "accessors": file.accessors,
        "bufferViews": file.views,
        "buffers": [{ "byteLength": file.bytes.len() }],
    });
    Ok(container(root.to_string().into_bytes(), file.bytes))
}

/// Header and two chunks, each padded to four bytes.
fn container(mut text: Vec<u8>, bytes: Vec<u8>) -> Vec<u8> {
    text.resize(text.len().next_multiple_of(4), b' ');
    let word = |n: usize| (n as u32).to_le_bytes();
    let mut out = Vec::with_capacity(28 + text.len() + bytes.len());
    out.extend(b"glTF");
    out.extend(2_u32.to_le_bytes());
    out.extend(word(28 + text.len() + bytes.len()));
    for (kind, chunk) in [(b"JSON", &text), (b"BIN\0", &bytes)] {
        out.extend(word(chunk.len()));
        out.extend(kind);
        out.extend(chunk);
    }
    out
}

/// The lists of a glTF file as they fill. Equal geometry, materials and pictures are stored once.
#[derive(Default)]
struct File {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    materials: Vec<Value>,
    textures: Vec<Value>,
    images: Vec<Value>,
    known_accessors: HashMap<Vec<u8>, usize>,
    known_pictures: HashMap<Picture, usize>,
}

impl File {
    fn mesh(&mut self, part: &Part) -> Result<usize, image::ImageError> {
        let mesh = &part.mesh;
        let f = |v: f64, steps: f64| ((v * steps).round() / steps) as f32;
        let positions: Vec<f32> =
            mesh.positions.iter().flat_map(|p| p.to_array()).map(|c| f(c, POSITION_STEPS)).collect();
        let normals: Vec<f32> = mesh.normals.iter().flat_map(|n| n.to_array()).map(|c| f(c, UNIT_STEPS)).collect();
        let mut attributes = json!({
            "POSITION": self.floats(&positions, 3, true),
            "NORMAL": self.floats(&normals, 3, false),
        });
        if part.look.picture.is_some() {
            let uvs: Vec<f32> = mesh.uvs.iter().flat_map(|uv| uv.to_array()).map(|c| f(c, UNIT_STEPS)).collect();
            attributes["TEXCOORD_0"] = self.floats(&uvs, 2, false).into();
        }
        let indices = self.indices(mesh);
        let material = self.material(part)?;
        self.meshes.push(json!({
            "name": part.name,
            "primitives": [{ "attributes": attributes, "indices": indices, "material": material }],
        }));
        Ok(self.meshes.len() - 1)
    }

    fn floats(&mut self, values: &[f32], width: usize, bounds: bool) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let mut accessor = json!({
            "componentType": 5126,
            "count": values.len() / width,
            "type": if width == 2 { "VEC2" } else { "VEC3" },
        });
        if bounds {
            let fold = |start: f32, pick: fn(f32, f32) -> f32| -> Vec<f32> {
                (0..width).map(|i| values.iter().skip(i).step_by(width).copied().fold(start, pick)).collect()
            };
            accessor["min"] = json!(fold(f32::INFINITY, f32::min));
            accessor["max"] = json!(fold(f32::NEG_INFINITY, f32::max));
        }
        self.accessor(bytes, accessor, 34_962)
    }

    fn indices(&mut self, mesh: &Mesh) -> usize {
        let flat = mesh.triangles.as_flattened();
        let short = mesh.positions.len() < 65_535;
        let bytes: Vec<u8> = if short {
            flat.iter().flat_map(|&i| (i as u16).to_le_bytes()).collect()
        } else {
            flat.iter().flat_map(|i| i.to_le_bytes()).collect()
        };
        let kind = if short { 5123 } else { 5125 };
        self.accessor(bytes, json!({ "componentType": kind, "count": flat.len(), "type": "SCALAR" }), 34_963)
    }

    fn accessor(&mut self, bytes: Vec<u8>, mut accessor: Value, target: u32) -> usize {
        if let Some(&known) = self.known_accessors.get(&bytes) {
            return known;
        }
        accessor["bufferView"] = self.view(&bytes, Some(target)).into();
        self.accessors.push(accessor);
        self.known_accessors.insert(bytes, self.accessors.len() - 1);
        self.accessors.len() - 1
    }

    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        let mut view = json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.bytes.extend(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(view);
        self.views.len() - 1
    }

    fn material(&mut self, part: &Part) -> Result<usize, image::ImageError> {
        let look = &part.look;
        // glTF's factors are linear. Five digits of an f64, so that no machine's power function shows.
        let linear = |c: u8| {
            let s = f64::from(c) / 255.0;
            let l = if s <= 0.040_45 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) };
            (l * 1e5).round() / 1e5
        };
        let [r, g, b] = look.color.map(linear);
        let two_digits = |v: f32| (f64::from(v) * 100.0).round() / 100.0;
        let mut pbr = json!({
            "baseColorFactor": [r, g, b, 1.0],
            "metallicFactor": if look.metal { 1.0 } else { 0.0 },
            "roughnessFactor": two_digits(look.roughness),
        });
        if let Some(picture) = &look.picture {
            pbr["baseColorTexture"] = json!({ "index": self.texture(picture)? });
        }
        let mut material = json!({ "pbrMetallicRoughness": pbr });
        if look.glow != [0.0; 3] {
            material["emissiveFactor"] = json!(look.glow.map(two_digits));
        }
        if let Some(known) = self.materials.iter().position(|m| *m == material) {
            return Ok(known);
        }
        self.materials.push(material);
        Ok(self.materials.len() - 1)
    }

    fn texture(&mut self, picture: &Picture) -> Result<usize, image::ImageError> {
        if let Some(&known) = self.known_pictures.get(picture) {
            return Ok(known);
        }
        let view = self.view(&picture.png()?, None);
        self.images.push(json!({ "bufferView": view, "mimeType": "image/png" }));
        self.textures.push(json!({ "source": self.images.len() - 1, "sampler": 0 }));
        self.known_pictures.insert(picture.clone(), self.textures.len() - 1);
        Ok(self.textures.len() - 1)
    }
}
