//! Surfaces of objects and parts: triangles in the world, and points on them with the colors of their materials.

use glam::{DMat4, DVec3, Vec2, Vec4};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;
use rayon::prelude::*;
use rstar::{AABB, PointDistance, RTree, RTreeObject};

use crate::io::gltf_mesh::{AlphaMode, MeshPrimitive, MeshScene};
use crate::pipeline::synth::SynthError;
use crate::pipeline::synth::levels::TrueIdentities;
use crate::pipeline::synth::texture::Texture;

/// Points on the surface of each object and part.
const SAMPLES: usize = 1500;
/// Seed of the points: the truth is the same for every choice of sentences.
const SEED: u64 = 0x7207;
/// Emission above which a surface has no color of its own.
const SHINES: f32 = 0.05;
/// Opacity below which a surface shows what is behind it.
const OPAQUE: f32 = 0.9;

/// Surface of an object (with its parts) or of a part.
pub(super) struct MeshSolid {
    /// Corners of its triangles.
    pub(super) corners: Vec<DVec3>,
    /// Points spread evenly over its area.
    pub(super) points: Vec<DVec3>,
    /// Linear color of each point; none where it shines or lets light pass.
    pub(super) colors: Vec<Option<[f32; 3]>>,
    tree: RTree<MeshFace>,
}

impl MeshSolid {
    /// Point of the surface that is nearest to `p`.
    pub(super) fn nearest(&self, p: DVec3) -> Option<DVec3> {
        self.tree.nearest_neighbor(p.to_array()).map(|face| face.nearest(p))
    }
}

/// Collects the surfaces of all identities, in their order.
pub(super) fn solids(scene: &MeshScene, identities: &TrueIdentities) -> Result<Vec<MeshSolid>, SynthError> {
    let mut faces: Vec<Vec<PaintedFace>> = identities.list.iter().map(|_| Vec::new()).collect();
    for (index, node) in scene.nodes.iter().enumerate() {
        let ids = identities.of_node[index];
        let primitives = node.mesh.map_or(&[][..], |m| &scene.meshes[m].primitives[..]);
        for face in primitives.iter().flat_map(|p| painted(scene, p, node.world_from_node)) {
            if !face.corners.iter().all(|c| c.is_finite()) {
                return Err(SynthError::NotFinite { node: index });
            }
            for id in [ids.object, ids.part] {
                if let Some(list) = usize::from(id).checked_sub(1).and_then(|i| faces.get_mut(i)) {
                    list.push(face);
                }
            }
        }
    }
    if faces.is_empty() || faces.iter().any(Vec::is_empty) {
        return Err(SynthError::Empty);
    }
    let textures: Vec<Texture> = scene.images.iter().map(Texture::new).collect();
    Ok(faces.into_par_iter().map(|faces| solid(scene, &textures, &faces)).collect())
}

/// Triangle in the world.
struct MeshFace([DVec3; 3]);

impl MeshFace {
    /// Point of the triangle that is nearest to `p`: at a corner, on an edge, or inside.
    fn nearest(&self, p: DVec3) -> DVec3 {
        let [a, b, c] = self.0;
        let (ab, ac) = (b - a, c - a);
        let [(a1, a2), (b1, b2), (c1, c2)] = [a, b, c].map(|corner| (ab.dot(p - corner), ac.dot(p - corner)));
        if a1 <= 0.0 && a2 <= 0.0 {
            return a;
        }
        if b1 >= 0.0 && b2 <= b1 {
            return b;
        }
        if c2 >= 0.0 && c1 <= c2 {
            return c;
        }
        // Areas of the triangles that p makes with each edge.
        let (on_ab, on_ac, on_bc) = (a1 * b2 - b1 * a2, c1 * a2 - a1 * c2, b1 * c2 - c1 * b2);
        if on_ab <= 0.0 && a1 >= 0.0 && b1 <= 0.0 {
            return a + ab * (a1 / (a1 - b1));
        }
        if on_ac <= 0.0 && a2 >= 0.0 && c2 <= 0.0 {
            return a + ac * (a2 / (a2 - c2));
        }
        let (from_b, from_c) = (b2 - b1, c1 - c2);
        if on_bc <= 0.0 && from_b >= 0.0 && from_c >= 0.0 {
            return b + (c - b) * (from_b / (from_b + from_c));
        }
        let sum = on_ab + on_ac + on_bc;
        a + ab * (on_ac / sum) + ac * (on_ab / sum)
    }
}

impl RTreeObject for MeshFace {
    type Envelope = AABB<[f64; 3]>;

    fn envelope(&self) -> Self::Envelope {
        let [a, b, c] = self.0;
        AABB::from_corners(a.min(b).min(c).to_array(), a.max(b).max(c).to_array())
    }
}

impl PointDistance for MeshFace {
    fn distance_2(&self, point: &[f64; 3]) -> f64 {
        let p = DVec3::from_array(*point);
        self.nearest(p).distance_squared(p)
    }
}

/// Triangle with its color.
#[derive(Clone, Copy)]
struct PaintedFace {
    corners: [DVec3; 3],
    /// Coordinates in the base color's texture.
    uv: [Vec2; 3],
    color: [Vec4; 3],
    material: usize,
}

impl PaintedFace {
    fn area(&self) -> f64 {
        let [a, b, c] = self.corners;
        0.5 * (b - a).cross(c - a).length()
    }

    /// Linear color at a point.
    fn color(&self, scene: &MeshScene, textures: &[Texture], weights: [f64; 3]) -> Option<[f32; 3]> {
        let [u, v, w] = weights.map(|w| w as f32);
        let material = &scene.materials[self.material];
        let texel = material.base_texture.as_ref().map_or(Vec4::ONE, |usage| {
            textures[usage.image].sample(usage, self.uv[0] * u + self.uv[1] * v + self.uv[2] * w, 1.0)
        });
        let color = material.base_color * texel * (self.color[0] * u + self.color[1] * v + self.color[2] * w);
        let shines = material.emission.max_element() > SHINES;
        let passes = material.alpha != AlphaMode::Opaque && color.w < OPAQUE;
        (!shines && !passes).then(|| [color.x, color.y, color.z])
    }
}

/// Triangles of a primitive in the world.
fn painted(scene: &MeshScene, primitive: &MeshPrimitive, world: DMat4) -> Vec<PaintedFace> {
    let usage = scene.materials[primitive.material].base_texture.as_ref();
    let uv = |i: usize| {
        let set = usage.and_then(|usage| primitive.uv_sets.get(usage.uv_set));
        let uv = set.and_then(|set| set.get(i)).copied().unwrap_or_default();
        usage.map_or(uv, |usage| usage.transform(uv))
    };
    let face = |triangle: &[u32; 3]| {
        let corners = triangle.map(|i| i as usize);
        PaintedFace {
            corners: corners.map(|i| world.transform_point3(primitive.positions[i].as_dvec3())),
            uv: corners.map(uv),
            color: corners.map(|i| primitive.colors.get(i).copied().unwrap_or(Vec4::ONE)),
            material: primitive.material,
        }
    };
    primitive.triangles.iter().map(face).collect()
}

fn solid(scene: &MeshScene, textures: &[Texture], faces: &[PaintedFace]) -> MeshSolid {
    let corners: Vec<DVec3> = faces.iter().flat_map(|f| f.corners).collect();
    let mut total = 0.0;
    let mut sums = Vec::with_capacity(faces.len());
    for face in faces {
        total += face.area();
        sums.push(total);
    }
    let mut rng = Pcg32::seed_from_u64(SEED);
    let sample = |k: usize| {
        let at = (k as f64 + rng.random::<f64>()) / SAMPLES as f64 * total;
        let face = &faces[sums.partition_point(|sum| *sum <= at).min(faces.len() - 1)];
        let (u, v) = (rng.random::<f64>(), rng.random::<f64>());
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        let weights = [1.0 - u - v, u, v];
        let [a, b, c] = face.corners;
        (a * weights[0] + b * weights[1] + c * weights[2], face.color(scene, textures, weights))
    };
    let (points, colors) = (0..SAMPLES).map(sample).unzip();
    // A triangle without area has no nearest point of its own; its neighbors have it.
    let whole = faces.iter().filter(|f| f.area() > 0.0).map(|f| MeshFace(f.corners)).collect();
    MeshSolid { corners, points, colors, tree: RTree::bulk_load(whole) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_point_of_a_triangle_is_at_a_corner_on_an_edge_or_inside() {
        let face = MeshFace([DVec3::ZERO, DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.0, 2.0, 0.0)]);
        for (p, nearest) in [
            ([-1.0, -1.0, 3.0], [0.0, 0.0, 0.0]),
            ([4.0, -1.0, 0.0], [2.0, 0.0, 0.0]),
            ([-1.0, 5.0, 0.0], [0.0, 2.0, 0.0]),
            ([1.0, -2.0, 1.0], [1.0, 0.0, 0.0]),
            ([-2.0, 0.5, 1.0], [0.0, 0.5, 0.0]),
            ([3.0, 3.0, 0.0], [1.0, 1.0, 0.0]),
            ([0.5, 0.25, -7.0], [0.5, 0.25, 0.0]),
        ] {
            let found = face.nearest(DVec3::from_array(p));
            assert!(found.distance(DVec3::from_array(nearest)) < 1e-12, "{p:?}: {found}");
        }
        // Nothing on a fine grid of the triangle is nearer.
        let p = DVec3::new(1.7, 0.9, 0.4);
        let far = face.nearest(p).distance(p);
        for i in 0..=40 {
            for j in 0..=40 - i {
                let q = DVec3::new(f64::from(i) / 20.0, f64::from(j) / 20.0, 0.0);
                assert!(q.distance(p) >= far - 1e-12, "{q}");
            }
        }
    }
}
