//! Node tree flattened to triangles in one frame.
//!
//! The frame has its origin in the middle of the scene and unit radius, so that single precision suffices for a scene
//! of any size and position. Triangles are split until their edges are short enough for light stored at vertices (see
//! [`super::light`]).

use std::collections::HashMap;

use glam::{DMat3, DVec3, Vec2, Vec3, Vec3A, Vec4};

use super::SynthError;
use super::levels::{NodeIds, TrueIdentities};
use crate::io::gltf_mesh::{Material, MeshPrimitive, MeshScene};
use crate::scene::Bounds;

/// Most triangles before splitting.
const MAX_TRIANGLES: usize = 8_000_000;
/// Most triangles that splitting adds.
const MOST_PIECES: usize = 400_000;
/// Least height of a triangle that is split, in the frame.
const THIN: f64 = 2e-5;
/// Flat faces are split to about this many squares over the whole scene.
const LIGHT_CELLS: f64 = 24_000.0;

/// Vertex in the scene's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vertex {
    pub(crate) position: Vec3A,
    /// Unit normal.
    pub(crate) normal: Vec3A,
    /// Texture coordinates of the base color and of the emission, transformed.
    pub(crate) uv: [Vec2; 2],
    pub(crate) color: Vec4,
}

/// Triangle: vertices, material, ids.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle {
    /// Indices into [`Surface::vertices`].
    pub(crate) vertices: [u32; 3],
    /// Index into the scene's materials.
    pub(crate) material: u32,
    pub(crate) ids: NodeIds,
}

/// All triangles of a scene.
pub(crate) struct Surface {
    pub(crate) vertices: Vec<Vertex>,
    pub(crate) triangles: Vec<Triangle>,
    /// Origin of the frame in the world.
    pub(crate) origin: DVec3,
    /// Length of the frame's unit in scene units.
    pub(crate) unit: f64,
    /// Box of each object in the world, by object id - 1.
    pub(crate) objects: Vec<Bounds>,
}

impl Surface {
    pub(crate) fn of(scene: &MeshScene, identities: &TrueIdentities) -> Result<Self, SynthError> {
        let instances: Vec<Instance<'_>> = scene
            .nodes
            .iter()
            .enumerate()
            .flat_map(|(n, node)| {
                let primitives = node.mesh.map_or(&[][..], |m| &scene.meshes[m].primitives[..]);
                primitives.iter().map(move |primitive| (n, node.world_from_node, primitive))
            })
            .map(|(node, world, primitive)| Instance { node, world, primitive, ids: identities.of_node[node] })
            .collect();
        let count = instances.iter().map(|i| i.primitive.triangles.len()).sum::<usize>();
        let vertices = instances.iter().map(|i| i.primitive.positions.len()).sum::<usize>();
        if count > MAX_TRIANGLES || vertices > 3 * MAX_TRIANGLES {
            return Err(SynthError::TooManyTriangles { count: count.max(vertices / 3), limit: MAX_TRIANGLES });
        }
        let corners = |i: &Instance<'_>| -> Vec<DVec3> {
            let world = i.world;
            let used = i.primitive.triangles.iter().flatten();
            used.map(|&v| world.transform_point3(i.primitive.positions[v as usize].as_dvec3())).collect()
        };
        let mut objects: Vec<Option<Bounds>> = Vec::new();
        for instance in &instances {
            let Some(slot) = usize::from(instance.ids.object).checked_sub(1) else { continue };
            objects.resize(objects.len().max(slot + 1), None);
            let known = objects[slot].iter().flat_map(|b| [b.min, b.max]).collect::<Vec<_>>();
            let corners = corners(instance);
            if corners.iter().any(|c| !c.is_finite()) {
                return Err(SynthError::NotFinite { node: instance.node });
            }
            objects[slot] = Bounds::of(corners.into_iter().chain(known));
        }
        let objects: Vec<Bounds> = objects.into_iter().flatten().collect();
        let all = Bounds::of(objects.iter().flat_map(|b| [b.min, b.max])).ok_or(SynthError::Empty)?;
        let unit = all.radius();
        if !(unit > 0.0 && unit.is_finite()) {
            return Err(SynthError::Empty);
        }
        let mut surface = Self { vertices: Vec::new(), triangles: Vec::new(), origin: all.center(), unit, objects };
        for instance in &instances {
            surface.add(instance, &scene.materials);
        }
        if surface.triangles.is_empty() {
            return Err(SynthError::Empty);
        }
        surface.split_for_light();
        Ok(surface)
    }

    /// Frame position of a world point.
    pub(crate) fn local(&self, p: DVec3) -> Vec3A {
        ((p - self.origin) / self.unit).as_vec3a()
    }

    fn add(&mut self, instance: &Instance<'_>, materials: &[Material]) {
        let primitive = instance.primitive;
        let material = &materials[primitive.material];
        let linear = DMat3::from_mat4(instance.world);
        // Normals go with the inverse transpose; times the determinant it always exists.
        let cofactor = DMat3::from_cols(
            linear.y_axis.cross(linear.z_axis),
            linear.z_axis.cross(linear.x_axis),
            linear.x_axis.cross(linear.y_axis),
        ) * linear.determinant().signum();
        let uses = [&material.base_texture, &material.emission_texture];
        let vertex = |i: usize, flat: Vec3A| {
            let world = instance.world.transform_point3(primitive.positions[i].as_dvec3());
            let normal = primitive.normals.get(i).map(|n| (cofactor * n.as_dvec3()).normalize_or_zero().as_vec3a());
            let uv = uses.map(|texture| {
                let Some(t) = texture else { return Vec2::ZERO };
                let uv = primitive.uv_sets.get(t.uv_set).and_then(|set| set.get(i)).copied().unwrap_or_default();
                t.transform(uv)
            });
            Vertex {
                position: self.local(world),
                normal: normal.filter(|n| *n != Vec3A::ZERO).unwrap_or(flat),
                uv,
                color: primitive.colors.get(i).copied().unwrap_or(Vec4::ONE),
            }
        };
        let first = self.vertices.len() as u32;
        let smooth = !primitive.normals.is_empty();
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        if smooth {
            vertices.extend((0..primitive.positions.len()).map(|i| vertex(i, Vec3A::Y)));
        }
        for t in &primitive.triangles {
            let corners = t.map(|i| {
                let p = instance.world.transform_point3(primitive.positions[i as usize].as_dvec3());
                self.local(p)
            });
            let flat = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
            // A triangle without area has no direction and cannot be hit.
            if flat == Vec3A::ZERO {
                continue;
            }
            let corners = if smooth {
                t.map(|i| first + i)
            } else {
                let at = first + vertices.len() as u32;
                vertices.extend(t.map(|i| vertex(i as usize, flat)));
                [at, at + 1, at + 2]
            };
            triangles.push(Triangle { vertices: corners, material: primitive.material as u32, ids: instance.ids });
        }
        self.vertices.extend(vertices);
        self.triangles.extend(triangles);
    }

    /// Splits every edge that is too long for light stored at vertices. The decision depends on the edge alone, so
    /// neighbors agree and no gaps open.
    fn split_for_light(&mut self) {
        let area: f64 = self.triangles.iter().map(|t| self.area(t)).sum();
        // An edge of length 2 becomes shorter than any useful limit in 14 halvings.
        let mut longest = ((2.0 * area / LIGHT_CELLS).sqrt() as f32).max(2e-4);
        let (whole, corners) = (self.triangles.clone(), self.vertices.len());
        // Slivers give far more pieces than their area suggests; then the edges may be longer.
        while !self.split(longest, whole.len() + MOST_PIECES) {
            self.triangles.clone_from(&whole);
            self.vertices.truncate(corners);
            longest *= 2.0;
        }
    }

    /// Splits edges that are longer than `longest`. Returns false if that makes more than `most` triangles; the surface
    /// is then incomplete.
    fn split(&mut self, longest: f32, most: usize) -> bool {
        let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
        let mut pending = std::mem::take(&mut self.triangles);
        let mut done = Vec::with_capacity(pending.len());
        while let Some(t) = pending.pop() {
            if done.len() + pending.len() >= most {
                return false;
            }
            if self.is_thin(&t) {
                done.push(t);
                continue;
            }
            let [a, b, c] = t.vertices;
            let mut middle = |i: u32, j: u32| {
                let (p, q) = (self.vertices[i as usize], self.vertices[j as usize]);
                (p.position.distance(q.position) > longest).then(|| {
                    *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                        self.vertices.push(between(&p, &q));
                        self.vertices.len() as u32 - 1
                    })
                })
            };
            let split = match (middle(a, b), middle(b, c), middle(c, a)) {
                (None, None, None) => {
                    done.push(t);
                    continue;
                }
                (Some(m), None, None) => vec![[a, m, c], [m, b, c]],
                (None, Some(m), None) => vec![[a, b, m], [a, m, c]],
                (None, None, Some(m)) => vec![[a, b, m], [m, b, c]],
                (Some(m), Some(n), None) => vec![[m, b, n], [a, m, n], [a, n, c]],
                (None, Some(m), Some(n)) => vec![[m, c, n], [a, b, m], [a, m, n]],
                (Some(m), None, Some(n)) => vec![[a, m, n], [m, b, c], [m, c, n]],
                (Some(l), Some(m), Some(n)) => vec![[a, l, n], [l, b, m], [n, m, c], [l, m, n]],
            };
            pending.extend(split.into_iter().map(|vertices| Triangle { vertices, ..t }));
        }
        self.triangles = done;
        true
    }

    /// Returns whether a triangle is too thin for visible changes of light along it. Its neighbors' new corners lie on
    /// its edges, so no gap opens.
    fn is_thin(&self, t: &Triangle) -> bool {
        let [a, b, c] = self.corners(t);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        2.0 * self.area(t) < f64::from(longest) * THIN
    }

    pub(crate) fn area(&self, t: &Triangle) -> f64 {
        let [a, b, c] = t.vertices.map(|v| self.vertices[v as usize].position.as_dvec3());
        0.5 * (b - a).cross(c - a).length()
    }

    /// Positions of a triangle's corners in the frame.
    pub(crate) fn corners(&self, t: &Triangle) -> [Vec3A; 3] {
        t.vertices.map(|v| self.vertices[v as usize].position)
    }
}

/// One primitive of one node.
struct Instance<'a> {
    node: usize,
    world: glam::DMat4,
    primitive: &'a MeshPrimitive,
    ids: NodeIds,
}

/// Vertex in the middle of an edge.
fn between(p: &Vertex, q: &Vertex) -> Vertex {
    let normal = (p.normal + q.normal).normalize_or_zero();
    Vertex {
        position: (p.position + q.position) * 0.5,
        normal: if normal == Vec3A::ZERO { p.normal } else { normal },
        uv: [(p.uv[0] + q.uv[0]) * 0.5, (p.uv[1] + q.uv[1]) * 0.5],
        color: (p.color + q.color) * 0.5,
    }
}

/// Weighted mean of the values of the three corners.
pub(crate) fn blend<T: std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>>(values: [T; 3], weights: Vec3) -> T {
    let [a, b, c] = values;
    a * weights.x + b * weights.y + c * weights.z
}
