//! Triangle meshes under construction.

use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};

/// Indexed triangles with smooth normals and texture coordinates, in meters, y up.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Positions.
    pub positions: Vec<DVec3>,
    /// Unit normals, one per position.
    pub normals: Vec<DVec3>,
    /// Texture coordinates, one per position.
    pub uvs: Vec<DVec2>,
    /// Counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// A grid of `rows x columns` vertices given by position, normal and texture coordinates.
    pub fn grid(rows: usize, columns: usize, vertex: impl Fn(usize, usize) -> (DVec3, DVec3, DVec2)) -> Self {
        let mut mesh = Self::default();
        for r in 0..rows {
            for c in 0..columns {
                let (p, n, uv) = vertex(r, c);
                mesh.positions.push(p);
                mesh.normals.push(n);
                mesh.uvs.push(uv);
            }
        }
        for r in 0..rows.saturating_sub(1) {
            for c in 0..columns.saturating_sub(1) {
                let at = |r: usize, c: usize| (r * columns + c) as u32;
                let (a, b, d, e) = (at(r, c), at(r, c + 1), at(r + 1, c), at(r + 1, c + 1));
                mesh.triangles.extend([[a, b, e], [a, e, d]]);
            }
        }
        mesh
    }

    /// A grid whose normals come from its own shape.
    pub fn sheet(rows: usize, columns: usize, vertex: impl Fn(usize, usize) -> (DVec3, DVec2)) -> Self {
        let mut mesh = Self::grid(rows, columns, |r, c| {
            let (p, uv) = vertex(r, c);
            (p, DVec3::ZERO, uv)
        });
        mesh.smooth_normals();
        mesh
    }

    /// Normals as the mean of the adjoining triangles', weighted by area; vertices at the same
    /// place share theirs, so that a seam does not show.
    pub fn smooth_normals(&mut self) {
        let key = |p: &DVec3| (*p * 65_536.0).round().as_i64vec3();
        let mut sums: std::collections::HashMap<_, DVec3> = std::collections::HashMap::new();
        for t in &self.triangles {
            let [a, b, c] = t.map(|v| self.positions[v as usize]);
            let n = (b - a).cross(c - a);
            for p in [a, b, c] {
                *sums.entry(key(&p)).or_default() += n;
            }
        }
        self.normals = self.positions.iter().map(|p| sums.get(&key(p)).copied().unwrap_or_default()).collect();
        for n in &mut self.normals {
            *n = n.try_normalize().unwrap_or(DVec3::Y);
        }
    }

    /// The mesh after an affine map.
    pub fn mapped(mut self, map: DAffine3) -> Self {
        let linear = map.matrix3;
        let cofactor = DMat3::from_cols(
            linear.y_axis.cross(linear.z_axis),
            linear.z_axis.cross(linear.x_axis),
            linear.x_axis.cross(linear.y_axis),
        );
        let flips = linear.determinant() < 0.0;
        for p in &mut self.positions {
            *p = map.transform_point3(*p);
        }
        for n in &mut self.normals {
            let m = cofactor * *n;
            *n = (if flips { -m } else { m }).try_normalize().unwrap_or(DVec3::Y);
        }
        if flips {
            self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        self
    }

    /// Moved.
    pub fn at(self, x: f64, y: f64, z: f64) -> Self {
        self.mapped(DAffine3::from_translation(DVec3::new(x, y, z)))
    }

    /// Turned about an axis through the origin.
    pub fn turned(self, axis: DVec3, degrees: f64) -> Self {
        self.mapped(DAffine3::from_quat(DQuat::from_axis_angle(axis, degrees.to_radians())))
    }

    /// Scaled along the axes.
    pub fn scaled(self, x: f64, y: f64, z: f64) -> Self {
        self.mapped(DAffine3::from_scale(DVec3::new(x, y, z)))
    }

    /// With another mesh added.
    pub fn with(mut self, other: Self) -> Self {
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.normals.extend(other.normals);
        self.uvs.extend(other.uvs);
        self.triangles.extend(other.triangles.into_iter().map(|t| t.map(|v| v + first)));
        self
    }

    /// Both this and its mirror image at x = 0.
    pub fn mirrored_pair(self) -> Self {
        let other = self.clone().scaled(-1.0, 1.0, 1.0);
        self.with(other)
    }

    /// Texture coordinates replaced by the position seen from above, in units of `size` meters.
    pub fn uv_from_above(mut self, size: f64) -> Self {
        self.uvs = self.positions.iter().map(|p| DVec2::new(p.x, p.z) / size + 0.5).collect();
        self
    }

    /// Texture coordinates scaled.
    pub fn uv_scaled(mut self, u: f64, v: f64) -> Self {
        self.uvs.iter_mut().for_each(|uv| *uv *= DVec2::new(u, v));
        self
    }
}
