// A Gaussian's projection to first order, which `project` draws with and `project_backward`
// differentiates. Needs `view`, and `geometry`,
// `sh_low` and `sh_high` bound as array<f32>.

// Floats of one Gaussian in `geometry`: position, log-scales, quaternion w x y z, opacity logit, pad.
const GEOMETRY_STRIDE: u32 = 12u;

struct Projection {
    ok: bool,
    // Center relative to the camera's, along the world's axes and along the camera's.
    world: vec3<f32>,
    camera: vec3<f32>,
    // Viewing tangents, clamped.
    tangent: vec2<f32>,
    mean: vec2<f32>,
    // Rows of J W: pixels per world displacement.
    row_x: vec3<f32>,
    row_y: vec3<f32>,
    // Unit quaternion (x, y, z, w), the length it had, and its rotation's columns.
    unit: vec4<f32>,
    quaternion_length: f32,
    rotation: mat3x3<f32>,
    scale: vec3<f32>,
    // Rows of J W R S: the picture-plane covariance is their Gram matrix plus the blur.
    u: vec3<f32>,
    v: vec3<f32>,
    // |u x v|^2, the determinant without the blur.
    sharp: f32,
    // Covariance xx, xy, yy, and its determinant.
    covariance: vec3<f32>,
    determinant: f32,
    opacity: f32,
}

fn stable_sigmoid(x: f32) -> f32 {
    let e = exp(-abs(x));
    return select(e, 1.0, x >= 0.0) / (1.0 + e);
}

fn rotation_columns(q: vec4<f32>) -> mat3x3<f32> {
    let s = q * q;
    let xy = q.x * q.y;
    let xz = q.x * q.z;
    let yz = q.y * q.z;
    let wx = q.w * q.x;
    let wy = q.w * q.y;
    let wz = q.w * q.z;
    return mat3x3<f32>(
        vec3<f32>(1.0 - 2.0 * (s.y + s.z), 2.0 * (xy + wz), 2.0 * (xz - wy)),
        vec3<f32>(2.0 * (xy - wz), 1.0 - 2.0 * (s.x + s.z), 2.0 * (yz + wx)),
        vec3<f32>(2.0 * (xz + wy), 2.0 * (yz - wx), 1.0 - 2.0 * (s.x + s.y)),
    );
}

// Fills everything from the raw parameters of Gaussian `i`. `ok` is false behind the near plane;
// degenerate numbers are left for the caller to find in `determinant`.
fn linearize(i: u32) -> Projection {
    var p: Projection;
    let at = i * GEOMETRY_STRIDE;
    let position = vec3<f32>(geometry[at], geometry[at + 1u], geometry[at + 2u]);
    p.world = (position + view.offset_hi.xyz) + view.offset_lo.xyz;
    p.camera = vec3<f32>(dot(view.right.xyz, p.world), dot(view.down.xyz, p.world), dot(view.forward.xyz, p.world));
    let z = p.camera.z;
    p.ok = z >= view.near && z > 0.0;
    if !p.ok {
        return p;
    }
    let slope = p.camera.xy / z;
    p.mean = slope * view.focal + view.principal;
    p.tangent = clamp(slope, view.tangent_min, view.tangent_max);
    p.row_x = (view.focal.x / z) * (view.right.xyz - p.tangent.x * view.forward.xyz);
    p.row_y = (view.focal.y / z) * (view.down.xyz - p.tangent.y * view.forward.xyz);
    p.scale = exp(vec3<f32>(geometry[at + 3u], geometry[at + 4u], geometry[at + 5u]));
    let raw = vec4<f32>(geometry[at + 7u], geometry[at + 8u], geometry[at + 9u], geometry[at + 6u]);
    // Scaled by the largest component first, so that neither tiny nor huge quaternions are lost.
    let largest = max(max(abs(raw.x), abs(raw.y)), max(abs(raw.z), abs(raw.w)));
    let scaled = raw / largest;
    let relative = length(scaled);
    p.unit = scaled / relative;
    p.quaternion_length = relative * largest;
    p.rotation = rotation_columns(p.unit);
    p.u = (p.row_x * p.rotation) * p.scale;
    p.v = (p.row_y * p.rotation) * p.scale;
    let normal = cross(p.u, p.v);
    let uu = dot(p.u, p.u);
    let vv = dot(p.v, p.v);
    p.sharp = dot(normal, normal);
    p.covariance = vec3<f32>(uu + view.blur, dot(p.u, p.v), vv + view.blur);
    p.determinant = p.sharp + view.blur * (uu + vv) + view.blur * view.blur;
    p.opacity = stable_sigmoid(geometry[at + 10u]);
    return p;
}

// Factor by which the blur lowers a splat's peak so that it keeps its energy.
fn compensation(p: Projection) -> f32 {
    return sqrt(p.sharp / p.determinant);
}

// RGB of spherical-harmonics coefficient `k` of Gaussian `i`.
fn coefficient(i: u32, k: u32) -> vec3<f32> {
    if k < 9u {
        let at = (i * min(9u, harmonics_count(view.sh_stored)) + k) * 3u;
        return vec3<f32>(sh_low[at], sh_low[at + 1u], sh_low[at + 2u]);
    }
    let at = (i * 7u + k - 9u) * 3u;
    return vec3<f32>(sh_high[at], sh_high[at + 1u], sh_high[at + 2u]);
}
