// Real spherical harmonics to degree 3, order and sign of the 3DGS files; see math::sh.
const C0: f32 = 0.28209479;
const C1: f32 = 0.48860251;
const C20: f32 = 1.0925485;
const C22: f32 = 0.31539157;
const C24: f32 = 0.54627424;
const C30: f32 = -0.59004359;
const C31: f32 = 2.8906114;
const C32: f32 = -0.45704579;
const C33: f32 = 0.37317633;
const C35: f32 = 1.4453057;

// Coefficients of one channel up to degree `degree`.
fn harmonics_count(degree: u32) -> u32 {
    return (degree + 1u) * (degree + 1u);
}

fn harmonics(degree: u32, d: vec3<f32>) -> array<f32, 16> {
    var b: array<f32, 16>;
    b[0] = C0;
    if degree >= 1u {
        b[1] = -C1 * d.y;
        b[2] = C1 * d.z;
        b[3] = -C1 * d.x;
    }
    let s = d * d;
    if degree >= 2u {
        b[4] = C20 * d.x * d.y;
        b[5] = -C20 * d.y * d.z;
        b[6] = C22 * (2.0 * s.z - s.x - s.y);
        b[7] = -C20 * d.x * d.z;
        b[8] = C24 * (s.x - s.y);
    }
    if degree >= 3u {
        b[9] = C30 * d.y * (3.0 * s.x - s.y);
        b[10] = C31 * d.x * d.y * d.z;
        b[11] = C32 * d.y * (4.0 * s.z - s.x - s.y);
        b[12] = C33 * d.z * (2.0 * s.z - 3.0 * s.x - 3.0 * s.y);
        b[13] = C32 * d.x * (4.0 * s.z - s.x - s.y);
        b[14] = C35 * d.z * (s.x - s.y);
        b[15] = C30 * d.x * (s.x - 3.0 * s.y);
    }
    return b;
}

// Derivatives of `harmonics` with respect to x, y and z, taken as independent.
fn harmonics_gradient(degree: u32, d: vec3<f32>) -> array<vec3<f32>, 16> {
    var g: array<vec3<f32>, 16>;
    if degree >= 1u {
        g[1] = vec3<f32>(0.0, -C1, 0.0);
        g[2] = vec3<f32>(0.0, 0.0, C1);
        g[3] = vec3<f32>(-C1, 0.0, 0.0);
    }
    if degree >= 2u {
        g[4] = C20 * vec3<f32>(d.y, d.x, 0.0);
        g[5] = -C20 * vec3<f32>(0.0, d.z, d.y);
        g[6] = C22 * vec3<f32>(-2.0 * d.x, -2.0 * d.y, 4.0 * d.z);
        g[7] = -C20 * vec3<f32>(d.z, 0.0, d.x);
        g[8] = C24 * vec3<f32>(2.0 * d.x, -2.0 * d.y, 0.0);
    }
    if degree >= 3u {
        let s = d * d;
        let xy = d.x * d.y;
        let yz = d.y * d.z;
        let xz = d.x * d.z;
        g[9] = C30 * vec3<f32>(6.0 * xy, 3.0 * (s.x - s.y), 0.0);
        g[10] = C31 * vec3<f32>(yz, xz, xy);
        g[11] = C32 * vec3<f32>(-2.0 * xy, 4.0 * s.z - s.x - 3.0 * s.y, 8.0 * yz);
        g[12] = C33 * vec3<f32>(-6.0 * xz, -6.0 * yz, 6.0 * s.z - 3.0 * s.x - 3.0 * s.y);
        g[13] = C32 * vec3<f32>(4.0 * s.z - 3.0 * s.x - s.y, -2.0 * xy, 8.0 * xz);
        g[14] = C35 * vec3<f32>(2.0 * xz, -2.0 * yz, s.x - s.y);
        g[15] = C30 * vec3<f32>(3.0 * (s.x - s.y), -6.0 * xy, 0.0);
    }
    return g;
}

// Unit direction of a center relative to the camera. Scaled first: the square of what is far away overflows.
fn towards(world: vec3<f32>) -> vec3<f32> {
    return normalize(world / max(abs(world.x), max(abs(world.y), abs(world.z))));
}
