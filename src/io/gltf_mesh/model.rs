//! Contents of a glTF scene after conversion.

use glam::{DMat4, Vec2, Vec3, Vec4};

/// A tree of named nodes with triangle meshes.
#[derive(Clone, Debug, Default)]
pub struct MeshScene {
    /// Nodes of the shown scene, parents before children.
    pub(crate) nodes: Vec<MeshNode>,
    /// Indices of the nodes without a parent, in the file's order.
    pub(crate) roots: Vec<usize>,
    /// Meshes, indexed by [`MeshNode::mesh`]; empty if no shown node uses one.
    pub(crate) meshes: Vec<Mesh>,
    /// Materials; the last is the default for primitives that name none.
    pub(crate) materials: Vec<Material>,
    /// Decoded images, indexed by [`TextureUse::image`].
    pub(crate) images: Vec<TextureImage>,
    pub(crate) warnings: Vec<String>,
}

#[derive(Clone, Debug)]
pub(crate) struct MeshNode {
    /// Name of the node, never blank.
    pub(crate) name: Option<String>,
    pub(crate) parent: Option<usize>,
    pub(crate) children: Vec<usize>,
    pub(crate) mesh: Option<usize>,
    /// Transform of points of the node to the world (glTF axes: y up, meters).
    pub(crate) world_from_node: DMat4,
}

/// A mesh: one primitive per material.
#[derive(Clone, Debug, Default)]
pub(crate) struct Mesh {
    pub(crate) name: Option<String>,
    /// Its primitives that are made of triangles.
    pub(crate) primitives: Vec<MeshPrimitive>,
}

/// Indexed triangles with one material. All vertex lists are as long as `positions` or empty.
#[derive(Clone, Debug, Default)]
pub(crate) struct MeshPrimitive {
    /// Vertex positions in node space, finite.
    pub(crate) positions: Vec<Vec3>,
    /// Vertex normals, not necessarily of unit length; empty means flat shading.
    pub(crate) normals: Vec<Vec3>,
    /// Texture coordinates by set number; a set that is absent is empty.
    pub(crate) uv_sets: Vec<Vec<Vec2>>,
    /// Linear vertex colors with alpha; empty means white.
    pub(crate) colors: Vec<Vec4>,
    /// Vertex indices, each below `positions.len()`.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Index into [`MeshScene::materials`].
    pub(crate) material: usize,
}

/// Appearance of a surface, as far as it is used.
#[derive(Clone, Debug)]
pub(crate) struct Material {
    /// Linear base color and alpha.
    pub(crate) base_color: Vec4,
    /// Texture multiplied with the base color.
    pub(crate) base_texture: Option<TextureUse>,
    /// Linear emitted color.
    pub(crate) emission: Vec3,
    pub(crate) emission_texture: Option<TextureUse>,
    /// 0 for plastic, 1 for metal.
    pub(crate) metallic: f32,
    /// 0 for a mirror, 1 for chalk.
    pub(crate) roughness: f32,
    pub(crate) alpha: AlphaMode,
    /// True if it is shown in its own color, independent of light.
    pub(crate) unlit: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum AlphaMode {
    Opaque,
    /// The surface is absent if alpha is below this.
    Mask(f32),
    /// The surface covers what is behind it by this share.
    Blend,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TextureUse {
    /// Index into [`MeshScene::images`].
    pub(crate) image: usize,
    pub(crate) uv_set: usize,
    /// `KHR_texture_transform`: added last.
    pub(crate) offset: Vec2,
    /// `KHR_texture_transform`: rotation in radians, as the extension defines its sign.
    pub(crate) rotation_rad: f32,
    /// `KHR_texture_transform`: applied first.
    pub(crate) scale: Vec2,
    /// Wrap modes outside 0..1 along u and v.
    pub(crate) wrap: [Wrap; 2],
    /// True for the nearest texel when enlarged, instead of interpolation.
    pub(crate) nearest: bool,
}

impl TextureUse {
    /// Texture coordinates after `KHR_texture_transform`.
    pub(crate) fn transform(&self, uv: Vec2) -> Vec2 {
        let (s, c) = self.rotation_rad.sin_cos();
        let p = uv * self.scale;
        Vec2::new(c * p.x + s * p.y, -s * p.x + c * p.y) + self.offset
    }
}

/// Wrap mode of a texture outside 0..1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wrap {
    Repeat,
    Mirror,
    Clamp,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TextureImage {
    /// Width in px, at least 1.
    pub(crate) width_px: u32,
    /// Height in px, at least 1.
    pub(crate) height_px: u32,
    /// Row-major, sRGB with linear alpha, top row first.
    pub(crate) rgba: Vec<[u8; 4]>,
}
