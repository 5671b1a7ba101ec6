//! What a glTF scene is turned into.

use glam::{DMat4, Vec2, Vec3, Vec4};

/// A tree of named nodes with triangle meshes.
#[derive(Clone, Debug, Default)]
pub struct MeshScene {
    /// Nodes of the shown scene, parents before children.
    pub nodes: Vec<MeshNode>,
    /// Indices of the nodes without a parent, in the file's order.
    pub roots: Vec<usize>,
    /// Meshes, indexed by [`MeshNode::mesh`]; empty where no shown node uses one.
    pub meshes: Vec<Mesh>,
    /// Materials; the last is the default for primitives that name none.
    pub materials: Vec<Material>,
    /// Decoded images, indexed by [`TextureUse::image`].
    pub images: Vec<TextureImage>,
    /// What was left out, for display.
    pub warnings: Vec<String>,
}

/// A node of the tree.
#[derive(Clone, Debug)]
pub struct MeshNode {
    /// Its name, never blank.
    pub name: Option<String>,
    /// Index of its parent.
    pub parent: Option<usize>,
    /// Indices of its children.
    pub children: Vec<usize>,
    /// Index of its own mesh.
    pub mesh: Option<usize>,
    /// Points of the node to world points (glTF axes: y up, meters).
    pub world_from_node: DMat4,
}

/// A mesh: one primitive per material.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Its name.
    pub name: Option<String>,
    /// Its primitives that are made of triangles.
    pub primitives: Vec<Primitive>,
}

/// Indexed triangles with one material. All vertex lists are as long as `positions` or empty.
#[derive(Clone, Debug, Default)]
pub struct Primitive {
    /// Vertex positions in node space, finite.
    pub positions: Vec<Vec3>,
    /// Vertex normals, not necessarily of unit length; empty means flat shading.
    pub normals: Vec<Vec3>,
    /// Texture coordinates by set number; a set that is absent is empty.
    pub uv_sets: Vec<Vec<Vec2>>,
    /// Linear vertex colors with alpha; empty means white.
    pub colors: Vec<Vec4>,
    /// Vertex indices, each below `positions.len()`.
    pub triangles: Vec<[u32; 3]>,
    /// Index into [`MeshScene::materials`].
    pub material: usize,
}

/// How a surface looks, as far as it is used.
#[derive(Clone, Debug)]
pub struct Material {
    /// Linear base color and alpha.
    pub base_color: Vec4,
    /// Texture multiplied with the base color.
    pub base_texture: Option<TextureUse>,
    /// Linear emitted color.
    pub emission: Vec3,
    /// Texture multiplied with the emission.
    pub emission_texture: Option<TextureUse>,
    /// 0 for plastic, 1 for metal.
    pub metallic: f32,
    /// 0 for a mirror, 1 for chalk.
    pub roughness: f32,
    /// What alpha means.
    pub alpha: AlphaMode,
    /// Shown in its own color whatever the light.
    pub unlit: bool,
}

/// What a material's alpha means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AlphaMode {
    /// Nothing.
    Opaque,
    /// The surface is absent where alpha is below this.
    Mask(f32),
    /// The surface covers what is behind it by this share.
    Blend,
}

/// A texture as a material uses it.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureUse {
    /// Index into [`MeshScene::images`].
    pub image: usize,
    /// Texture coordinate set.
    pub uv_set: usize,
    /// `KHR_texture_transform`: added last.
    pub offset: Vec2,
    /// `KHR_texture_transform`: rotation in radians, as the extension defines its sign.
    pub rotation_rad: f32,
    /// `KHR_texture_transform`: applied first.
    pub scale: Vec2,
    /// Outside 0..1 along u and v.
    pub wrap: [Wrap; 2],
    /// Nearest texel when enlarged, instead of interpolation.
    pub nearest: bool,
}

impl TextureUse {
    /// Texture coordinates after `KHR_texture_transform`.
    pub fn transform(&self, uv: Vec2) -> Vec2 {
        let (s, c) = self.rotation_rad.sin_cos();
        let p = uv * self.scale;
        Vec2::new(c * p.x + s * p.y, -s * p.x + c * p.y) + self.offset
    }
}

/// What lies outside a texture's 0..1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The texture again.
    Repeat,
    /// The texture mirrored.
    Mirror,
    /// Its edge.
    Clamp,
}

/// A decoded image.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureImage {
    /// Width in px, at least 1.
    pub width_px: u32,
    /// Height in px, at least 1.
    pub height_px: u32,
    /// Row-major, sRGB with linear alpha, top row first.
    pub rgba: Vec<[u8; 4]>,
}
