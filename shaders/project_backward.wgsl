// Gradient of projection: from the splats in the picture to every raw parameter. One thread a
// Gaussian. `statistics` then gathers what density control asks for.
#include "constants"
#include "shared/view.wgsl"
#include "shared/counters.wgsl"
#include "shared/finite.wgsl"
#include "shared/flat.wgsl"
#include "shared/splat.wgsl"
#include "shared/harmonics.wgsl"

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> geometry: array<f32>;
@group(0) @binding(2) var<storage, read> sh_low: array<f32>;
@group(0) @binding(3) var<storage, read> sh_high: array<f32>;
@group(0) @binding(4) var<storage, read> splats: array<Splat>;
// [Gaussian][GRADIENT_BASE + channels], see blend_backward.
@group(0) @binding(5) var<storage, read> gradient: array<f32>;
// Laid out like `geometry`; the pad holds the length of the screen gradient, or a mark for a
// Gaussian that must not move: -1 not drawn, -2 its gradient was not finite.
@group(0) @binding(6) var<storage, read_write> geometry_gradient: array<f32>;
@group(0) @binding(7) var<storage, read_write> sh_low_gradient: array<f32>;
@group(0) @binding(8) var<storage, read_write> sh_high_gradient: array<f32>;

// [Gaussian]: sum of screen gradients' lengths, frames in which it was drawn.
@group(0) @binding(9) var<storage, read_write> growth: array<vec2<f32>>;
@group(0) @binding(10) var<storage, read_write> counters: array<atomic<u32>>;

#include "shared/linearize.wgsl"

const NOT_DRAWN: f32 = -1.0;
const NOT_FINITE: f32 = -2.0;

fn store_coefficient(i: u32, k: u32, value: vec3<f32>) {
    if k < 9u {
        let at = (i * min(9u, harmonics_count(view.sh_stored)) + k) * 3u;
        sh_low_gradient[at] = value.x;
        sh_low_gradient[at + 1u] = value.y;
        sh_low_gradient[at + 2u] = value.z;
    } else {
        let at = (i * 7u + k - 9u) * 3u;
        sh_high_gradient[at] = value.x;
        sh_high_gradient[at + 1u] = value.y;
        sh_high_gradient[at + 2u] = value.z;
    }
}

// Gradient with respect to the coefficients, and, through the viewing direction, to the center.
fn color_backward(i: u32, world: vec3<f32>, color: vec3<f32>, to_color: vec3<f32>) -> vec3<f32> {
    // A channel at its floor of 0 does not move.
    let g = select(vec3<f32>(0.0), to_color, color > vec3<f32>(0.0));
    let degree = min(view.sh_degree, view.sh_stored);
    let away = length(world);
    let direction = towards(world);
    let basis = harmonics(degree, direction);
    let slopes = harmonics_gradient(degree, direction);
    var to_direction = vec3<f32>(0.0);
    for (var k = 0u; k < harmonics_count(view.sh_stored); k++) {
        if k < harmonics_count(degree) {
            store_coefficient(i, k, basis[k] * g);
            to_direction += slopes[k] * dot(coefficient(i, k), g);
        } else {
            store_coefficient(i, k, vec3<f32>(0.0));
        }
    }
    return (to_direction - direction * dot(direction, to_direction)) / away;
}

// Gradient with respect to the unit quaternion (x, y, z, w) from that of its rotation's columns.
fn rotation_backward(q: vec4<f32>, g: mat3x3<f32>) -> vec4<f32> {
    // g[column][row]
    let x = q.y * (g[1].x + g[0].y) + q.z * (g[2].x + g[0].z) - 2.0 * q.x * (g[1].y + g[2].z) + q.w * (g[1].z - g[2].y);
    let y = q.x * (g[1].x + g[0].y) + q.z * (g[2].y + g[1].z) - 2.0 * q.y * (g[0].x + g[2].z) + q.w * (g[2].x - g[0].z);
    let z = q.x * (g[2].x + g[0].z) + q.y * (g[2].y + g[1].z) - 2.0 * q.z * (g[0].x + g[1].y) + q.w * (g[0].y - g[1].x);
    let w = q.x * (g[1].z - g[2].y) + q.y * (g[2].x - g[0].z) + q.z * (g[0].y - g[1].x);
    return 2.0 * vec4<f32>(x, y, z, w);
}

fn store_zero(i: u32, mark: f32) {
    for (var k = 0u; k < GEOMETRY_STRIDE; k++) {
        geometry_gradient[i * GEOMETRY_STRIDE + k] = 0.0;
    }
    geometry_gradient[i * GEOMETRY_STRIDE + 11u] = mark;
    for (var k = 0u; k < harmonics_count(view.sh_stored); k++) {
        store_coefficient(i, k, vec3<f32>(0.0));
    }
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) global: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = flat(global, groups, 64u);
    if i >= view.gaussians {
        return;
    }
    let radius = splats[i].radius;
    if radius == 0.0 {
        store_zero(i, NOT_DRAWN);
        return;
    }
    let p = linearize(i);
    let start_at = i * (GRADIENT_BASE + view.channels);
    let to_mean = vec2<f32>(gradient[start_at], gradient[start_at + 1u]);
    let to_covariance = vec3<f32>(gradient[start_at + 2u], gradient[start_at + 3u], gradient[start_at + 4u]);
    let to_peak = gradient[start_at + 5u];
    let to_color = vec3<f32>(gradient[start_at + 6u], gradient[start_at + 7u], gradient[start_at + 8u]);
    let to_depth = gradient[start_at + 9u];

    var to_u = 2.0 * to_covariance.x * p.u + to_covariance.y * p.v;
    var to_v = 2.0 * to_covariance.z * p.v + to_covariance.y * p.u;
    var to_opacity = to_peak;
    if view.antialias != 0u {
        // d rho = d|n| / sqrt(det) - rho / 2 d(det) / det with n = u x v: its direction stays
        // bounded where n vanishes.
        let rho = compensation(p);
        let to_rho = to_peak * p.opacity;
        let n = cross(p.u, p.v);
        let unit = n * inverseSqrt(max(p.sharp, 1e-30));
        let swing = to_rho * (unit * inverseSqrt(p.determinant) - n * (rho / p.determinant));
        let pull = to_rho * rho * view.blur / p.determinant;
        to_u += cross(p.v, swing) - pull * p.u;
        to_v += cross(swing, p.u) - pull * p.v;
        to_opacity *= rho;
    }
    let to_logit = to_opacity * p.opacity * (1.0 - p.opacity);

    // u_j = s_j (row_x . r_j), and v likewise.
    let to_log_scale = to_u * p.u + to_v * p.v;
    let su = to_u * p.scale;
    let sv = to_v * p.scale;
    let to_row_x = p.rotation * su;
    let to_row_y = p.rotation * sv;
    let to_rotation = mat3x3<f32>(
        su.x * p.row_x + sv.x * p.row_y,
        su.y * p.row_x + sv.y * p.row_y,
        su.z * p.row_x + sv.z * p.row_y,
    );
    let to_unit = rotation_backward(p.unit, to_rotation);
    let to_quaternion = (to_unit - p.unit * dot(p.unit, to_unit)) / p.quaternion_length;

    // row_x = focal.x / z (right - tangent.x forward); mean = focal slope + principal.
    let z = p.camera.z;
    let slope = p.camera.xy / z;
    let per_px = view.focal / z;
    let to_tangent = -per_px * vec2<f32>(dot(to_row_x, view.forward.xyz), dot(to_row_y, view.forward.xyz));
    let free = slope == p.tangent;
    let to_slope = to_mean * view.focal + select(vec2<f32>(0.0), to_tangent, free);
    let to_z = to_depth - (dot(to_row_x, p.row_x) + dot(to_row_y, p.row_y)) / z - dot(to_slope, slope) / z;
    let to_camera = vec3<f32>(to_slope / z, to_z);
    let to_position = to_camera.x * view.right.xyz + to_camera.y * view.down.xyz + to_camera.z * view.forward.xyz
        + color_backward(i, p.world, splats[i].color, to_color);

    let screen = length(to_mean * vec2<f32>(view.size_px) * 0.5);
    let finite = is_finite3(to_position) && is_finite3(to_log_scale) && is_finite2(to_quaternion.xy)
        && is_finite2(to_quaternion.zw) && is_finite(to_logit) && is_finite3(to_color) && is_finite(screen);
    if !finite {
        store_zero(i, NOT_FINITE);
        return;
    }
    let to = i * GEOMETRY_STRIDE;
    for (var k = 0u; k < 3u; k++) {
        geometry_gradient[to + k] = to_position[k];
        geometry_gradient[to + 3u + k] = to_log_scale[k];
        geometry_gradient[to + 7u + k] = to_quaternion[k];
    }
    geometry_gradient[to + 6u] = to_quaternion.w;
    geometry_gradient[to + 10u] = to_logit;
    geometry_gradient[to + 11u] = screen;
}

@compute @workgroup_size(256)
fn statistics(@builtin(global_invocation_id) global: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = flat(global, groups, 256u);
    let drawn = atomicLoad(&counters[COUNT_OVERFLOW]) == 0u;
    if i >= view.gaussians || splats[i].radius == 0.0 || !drawn {
        return;
    }
    let screen = geometry_gradient[i * GEOMETRY_STRIDE + 11u];
    if screen == NOT_FINITE {
        atomicAdd(&counters[COUNT_BAD_GRADIENTS], 1u);
        return;
    }
    growth[i] += vec2<f32>(screen, 1.0);
}
