//! Smooth shapes to build things from.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

use glam::{DVec2, DVec3};

use super::mesh::Mesh;

/// Consecutive pieces of a profile that turn by more than this make an edge, in radians.
const CREASE: f64 = 0.6;

/// A curve through the points, `steps` pieces between two (Catmull and Rom).
pub fn curve<V>(points: &[V], steps: usize) -> Vec<V>
where
    V: Copy + std::ops::Add<Output = V> + std::ops::Sub<Output = V> + std::ops::Mul<f64, Output = V>,
{
    let last = points.len() - 1;
    let mut out = vec![points[0]];
    for i in 0..last {
        let (p1, p2) = (points[i], points[i + 1]);
        let p0 = if i == 0 { p1 + (p1 - p2) } else { points[i - 1] };
        let p3 = if i + 2 > last { p2 + (p2 - p1) } else { points[i + 2] };
        for s in 1..=steps {
            let t = s as f64 / steps as f64;
            let a = p2 - p0;
            let b = p0 * 2.0 - p1 * 5.0 + p2 * 4.0 - p3;
            let c = p1 * 3.0 - p2 * 3.0 + p3 - p0;
            out.push(p1 + (a * t + b * (t * t) + c * (t * t * t)) * 0.5);
        }
    }
    out
}

/// A surface of revolution about the y axis. The profile is a list of (radius, height) from the
/// bottom up, outside to the right; where it turns sharply it makes an edge.
pub fn lathe(profile: &[DVec2], segments: usize) -> Mesh {
    let turns: Vec<DVec2> = profile.windows(2).map(|w| (w[1] - w[0]).try_normalize().unwrap_or(DVec2::Y)).collect();
    // One row per profile point, two where there is an edge: (point, direction of the profile).
    let mut rows: Vec<(DVec2, DVec2)> = Vec::new();
    for (i, p) in profile.iter().enumerate() {
        let before = (i > 0).then(|| turns[i - 1]);
        let after = turns.get(i).copied();
        match (before, after) {
            (Some(a), Some(b)) if a.dot(b) < CREASE.cos() => rows.extend([(*p, a), (*p, b)]),
            (Some(a), Some(b)) => rows.push((*p, (a + b).try_normalize().unwrap_or(a))),
            (Some(a), None) | (None, Some(a)) => rows.push((*p, a)),
            (None, None) => {}
        }
    }
    let length: f64 = profile.windows(2).map(|w| w[0].distance(w[1])).sum::<f64>().max(1e-9);
    let mut along = 0.0;
    let mut previous = rows[0].0;
    let mut v = Vec::new();
    for (p, _) in &rows {
        along += p.distance(previous) / length;
        previous = *p;
        v.push(1.0 - along);
    }
    Mesh::grid(rows.len(), segments + 1, |r, c| {
        let (p, d) = rows[r];
        // The last column repeats the first, exactly.
        let (sin, cos) = (TAU * (c % segments) as f64 / segments as f64).sin_cos();
        let normal = DVec3::new(d.y * cos, -d.x, -d.y * sin);
        (DVec3::new(p.x * cos, p.y, -p.x * sin), normal, DVec2::new(c as f64 / segments as f64, v[r]))
    })
}

/// A lathe through a smoothed profile.
pub fn turned_profile(points: &[[f64; 2]], steps: usize, segments: usize) -> Mesh {
    let points: Vec<DVec2> = points.iter().map(|p| DVec2::from_array(*p)).collect();
    lathe(&curve(&points, steps), segments)
}

/// An upright cylinder on y = 0 with a rounded rim of radius `round` at both ends.
pub fn cylinder(radius: f64, height: f64, round: f64, segments: usize) -> Mesh {
    let mut profile = vec![DVec2::ZERO];
    let arc =
        |center: DVec2, from: f64| (0..=4).map(move |i| center + polar(round, from + FRAC_PI_2 * f64::from(i) / 4.0));
    profile.extend(arc(DVec2::new(radius - round, round), -FRAC_PI_2));
    profile.extend(arc(DVec2::new(radius - round, height - round), 0.0));
    profile.push(DVec2::new(0.0, height));
    lathe(&profile, segments)
}

/// A sphere about the origin.
pub fn sphere(radius: f64, segments: usize) -> Mesh {
    let rows = segments / 2;
    let profile: Vec<DVec2> = (0..=rows).map(|i| polar(radius, -FRAC_PI_2 + PI * i as f64 / rows as f64)).collect();
    lathe(&profile, segments)
}

/// The top of a sphere, `base` wide in radius at y = 0 and `height` high (a lens, a lid).
pub fn cap(base: f64, height: f64, segments: usize) -> Mesh {
    let radius = (base * base + height * height) / (2.0 * height);
    let from = ((radius - height) / radius).asin();
    let profile: Vec<DVec2> = (0..=6)
        .map(|i| polar(radius, from + (FRAC_PI_2 - from) * f64::from(i) / 6.0) - DVec2::new(0.0, radius - height))
        .collect();
    lathe(&profile, segments)
}

fn polar(radius: f64, angle: f64) -> DVec2 {
    DVec2::new((radius * angle.cos()).max(0.0), radius * angle.sin())
}

/// A tube along a path with a radius at each of its points. Open ends are rounded.
pub fn tube(path: &[DVec3], radii: &[f64], segments: usize, closed: bool) -> Mesh {
    let n = path.len();
    let tangent = |i: usize| {
        let (a, b) = if closed { ((i + n - 1) % n, (i + 1) % n) } else { (i.saturating_sub(1), (i + 1).min(n - 1)) };
        (path[b] - path[a]).try_normalize().unwrap_or(DVec3::Y)
    };
    // A frame carried along the path without twist.
    let mut side = tangent(0).any_orthonormal_vector();
    let mut frames = Vec::new();
    for i in 0..n {
        let t = tangent(i);
        side = (side - t * side.dot(t)).try_normalize().unwrap_or_else(|| t.any_orthonormal_vector());
        frames.push((path[i], t, side, radii[i.min(radii.len() - 1)]));
    }
    // Rings: center, tangent, side, radius, lean of the normal along the tangent.
    let mut rings: Vec<(DVec3, DVec3, DVec3, f64, f64)> = Vec::new();
    let end = |i: usize, sign: f64| {
        let (p, t, s, r) = frames[i];
        (0..4).map(move |k| {
            let a = FRAC_PI_2 * (1.0 - f64::from(k) / 4.0);
            (p + t * (sign * r * a.sin()), t, s, r * a.cos().max(0.0), sign * a)
        })
    };
    if !closed {
        rings.extend(end(0, -1.0));
    }
    rings.extend(frames.iter().map(|&(p, t, s, r)| (p, t, s, r, 0.0)));
    if closed {
        // The frame may come back turned; the first ring itself closes the tube.
        rings.push(rings[0]);
    } else {
        rings.extend(end(n - 1, 1.0).collect::<Vec<_>>().into_iter().rev());
    }
    let count = rings.len();
    Mesh::grid(count, segments + 1, |i, c| {
        let (p, t, s, r, lean) = rings[i];
        let (sin, cos) = (TAU * (c % segments) as f64 / segments as f64).sin_cos();
        let out = s * cos + t.cross(s) * sin;
        let normal = out * lean.cos() + t * lean.sin();
        (p + out * r, normal, DVec2::new(c as f64 / segments as f64, i as f64 / (count - 1) as f64))
    })
}

/// A tube of one radius along a smoothed path.
pub fn bent_tube(points: &[[f64; 3]], radius: f64, steps: usize, segments: usize) -> Mesh {
    let points: Vec<DVec3> = points.iter().map(|p| DVec3::from_array(*p)).collect();
    tube(&curve(&points, steps), &[radius], segments, false)
}

/// A ring about the y axis at y = 0.
pub fn torus(radius: f64, thickness: f64, segments: usize, around: usize) -> Mesh {
    let path: Vec<DVec3> = (0..segments)
        .map(|i| {
            let (s, c) = (TAU * i as f64 / segments as f64).sin_cos();
            DVec3::new(radius * c, 0.0, -radius * s)
        })
        .collect();
    tube(&path, &[thickness], around, true)
}

/// A box about the origin with rounded edges; `steps` pieces for half an edge's arc. Texture
/// coordinates run over each side.
pub fn rounded_box(x: f64, y: f64, z: f64, round: f64, steps: usize) -> Mesh {
    let half = DVec3::new(x, y, z) * 0.5;
    let inner = half - DVec3::splat(round);
    let line = |inner: f64| -> Vec<f64> {
        let arc = |j: usize| inner + round * (FRAC_PI_4 * j as f64 / steps as f64).tan();
        (0..=steps).rev().map(|j| -arc(j)).chain((0..=steps).map(arc)).collect()
    };
    let mut mesh = Mesh::default();
    // (normal, u, v) of each side with u x v = normal.
    let axes = [
        (DVec3::X, -DVec3::Z, DVec3::Y),
        (-DVec3::X, DVec3::Z, DVec3::Y),
        (DVec3::Y, DVec3::X, -DVec3::Z),
        (-DVec3::Y, DVec3::X, DVec3::Z),
        (DVec3::Z, DVec3::X, DVec3::Y),
        (-DVec3::Z, -DVec3::X, DVec3::Y),
    ];
    for (n, u, v) in axes {
        let (us, vs) = (line(inner.dot(u.abs())), line(inner.dot(v.abs())));
        mesh = mesh.with(Mesh::grid(vs.len(), us.len(), |r, c| {
            let p = n * half.dot(n.abs()) + u * us[c] + v * vs[r];
            let core = p.clamp(-inner, inner);
            let out = (p - core).try_normalize().unwrap_or(n);
            let uv = DVec2::new(0.5 + 0.5 * us[c] / half.dot(u.abs()), 0.5 - 0.5 * vs[r] / half.dot(v.abs()));
            (core + out * round, out, uv)
        }));
    }
    mesh
}

/// A flat pad: an outline, given by its radius at each angle, inflated to `height` above and
/// `depth` below y = 0. A larger `fullness` keeps it flat for longer before it bends to the rim.
pub fn pillow(outline: impl Fn(f64) -> f64, height: f64, depth: f64, fullness: f64, segments: usize) -> Mesh {
    let rings = 9;
    let half = |top: bool| {
        let tall = if top { height } else { -depth };
        let mut mesh = Mesh::sheet(rings + 1, segments + 1, |r, c| {
            let angle = TAU * (c % segments) as f64 / segments as f64;
            // Rings close up towards the rim, where the surface bends.
            let s = (FRAC_PI_2 * r as f64 / rings as f64).sin();
            let lift = (1.0 - s.powf(fullness)).max(0.0).powf(1.0 / fullness.min(2.5));
            let (sin, cos) = angle.sin_cos();
            let radius = outline(angle) * s;
            let p = DVec3::new(radius * cos, tall * lift, -radius * sin);
            (p, DVec2::new(0.5 + 0.5 * s * cos, 0.5 + 0.5 * s * sin))
        });
        if top {
            mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        mesh
    };
    let mut mesh = half(true).with(half(false));
    // Both halves share the rim, so it is smooth.
    mesh.smooth_normals();
    mesh
}
