//! Materials: color of the surface at a point.

use glam::{Vec2, Vec3, Vec3A, Vec4};

use super::surface::{Surface, Triangle, blend};
use super::texture::Texture;
use crate::io::gltf_mesh::{AlphaMode, Material, MeshScene, TextureUse};

/// Appearance of a point, linear.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Look {
    pub(crate) albedo: Vec3A,
    pub(crate) emission: Vec3A,
    /// Opacity of the point.
    pub(crate) alpha: f32,
}

/// Materials with their textures.
pub(crate) struct Materials {
    list: Vec<Material>,
    textures: Vec<Texture>,
    /// True if all materials are opaque.
    opaque: bool,
}

impl Materials {
    pub(crate) fn of(scene: &MeshScene) -> Self {
        Self {
            list: scene.materials.clone(),
            textures: scene.images.iter().map(Texture::new).collect(),
            opaque: scene.materials.iter().all(|m| m.alpha == AlphaMode::Opaque),
        }
    }

    pub(crate) fn get(&self, index: u32) -> &Material {
        &self.list[index as usize]
    }

    /// Mean base color of a material.
    pub(crate) fn mean(&self, index: usize) -> Vec4 {
        let m = &self.list[index];
        m.base_color * m.base_texture.as_ref().map_or(Vec4::ONE, |t| self.textures[t.image].mean())
    }

    /// Appearance of a point of a triangle, filtered over `width` in the frame's units.
    pub(crate) fn look(&self, surface: &Surface, triangle: &Triangle, weights: Vec3, width: f32) -> Look {
        let m = self.get(triangle.material);
        let corners = triangle.vertices.map(|v| &surface.vertices[v as usize]);
        let sampled = |usage: &Option<TextureUse>, set: usize| {
            let Some(usage) = usage else { return Vec4::ONE };
            let texture = &self.textures[usage.image];
            let uv = corners.map(|c| c.uv[set]);
            let texels = uv_area(uv) * texture.texels();
            let area = 0.5
                * (corners[1].position - corners[0].position).cross(corners[2].position - corners[0].position).length();
            let footprint = if area > 0.0 { width * (texels / area).sqrt() } else { 1.0 };
            texture.sample(usage, blend(uv, weights), footprint)
        };
        let base = m.base_color * sampled(&m.base_texture, 0) * blend(corners.map(|c| c.color), weights);
        let emission = if m.emission == Vec3::ZERO {
            Vec3A::ZERO
        } else {
            Vec3A::from(m.emission) * Vec3A::from_vec4(sampled(&m.emission_texture, 1))
        };
        let alpha = match m.alpha {
            AlphaMode::Opaque => 1.0,
            AlphaMode::Mask(cutoff) => f32::from(u8::from(base.w >= cutoff)),
            AlphaMode::Blend => base.w.clamp(0.0, 1.0),
        };
        Look { albedo: Vec3A::from_vec4(base).max(Vec3A::ZERO), emission, alpha }
    }

    /// Returns whether light passes the point: masked out, or with an opacity below one half.
    pub(crate) fn passes(&self, surface: &Surface, triangle: &Triangle, weights: Vec3) -> bool {
        !self.opaque
            && self.get(triangle.material).alpha != AlphaMode::Opaque
            && self.look(surface, triangle, weights, 0.0).alpha < 0.5
    }
}

fn uv_area([a, b, c]: [Vec2; 3]) -> f32 {
    0.5 * (b - a).perp_dot(c - a).abs()
}
