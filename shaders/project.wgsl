// Raw Gaussians to splats in the picture: EWA projection, activation, color towards the camera,
// and how many tiles each one reaches. One thread a Gaussian.
#include "constants"
#include "shared/view.wgsl"
#include "shared/counters.wgsl"
#include "shared/finite.wgsl"
#include "shared/flat.wgsl"
#include "shared/splat.wgsl"
#include "shared/reach.wgsl"
#include "shared/harmonics.wgsl"

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> geometry: array<f32>;
// Coefficients of degrees 0 to 2, and of degree 3, RGB of one coefficient together. Two buffers,
// so that a binding of 128 MiB holds 1.2 million Gaussians instead of 0.7.
@group(0) @binding(2) var<storage, read> sh_low: array<f32>;
@group(0) @binding(3) var<storage, read> sh_high: array<f32>;
@group(0) @binding(4) var<storage, read_write> splats: array<Splat>;
// Sort keys: the bits of a positive float order like the float. All ones where nothing is drawn.
@group(0) @binding(5) var<storage, read_write> depth_keys: array<u32>;
@group(0) @binding(6) var<storage, read_write> order: array<u32>;
@group(0) @binding(7) var<storage, read_write> tile_counts: array<u32>;
@group(0) @binding(8) var<storage, read_write> counters: array<atomic<u32>>;

#include "shared/linearize.wgsl"

var<workgroup> drawn_here: atomic<u32>;
var<workgroup> degenerate_here: atomic<u32>;

fn color_towards(i: u32, world: vec3<f32>) -> vec3<f32> {
    let degree = min(view.sh_degree, view.sh_stored);
    let basis = harmonics(degree, towards(world));
    var sum = vec3<f32>(0.5);
    var sound = true;
    for (var k = 0u; k < harmonics_count(degree); k++) {
        let c = coefficient(i, k);
        sound = sound && is_finite3(c);
        sum += basis[k] * c;
    }
    // Sums that overflow are very bright; one of a coefficient that is no number stays none.
    return select(sum, clamp(sum, vec3<f32>(0.0), vec3<f32>(COLOR_MAX)), sound);
}

// The splat of Gaussian `i`; radius 0 where it is not drawn.
fn splat_of(i: u32) -> Splat {
    var splat: Splat;
    let p = linearize(i);
    if !p.ok {
        return splat;
    }
    let det = p.determinant;
    let sane = is_finite2(p.mean) && is_finite3(p.covariance) && is_finite(det) && det > 0.0
        && is_finite(p.opacity) && is_finite(p.camera.z);
    if !sane {
        atomicAdd(&degenerate_here, 1u);
        return splat;
    }
    var opacity = p.opacity;
    if view.antialias != 0u {
        opacity *= compensation(p);
    }
    if opacity < ALPHA_MIN {
        return splat;
    }
    splat.mean = p.mean;
    splat.depth = p.camera.z;
    splat.opacity = opacity;
    let across = sqrt(p.covariance.z / det);
    splat.factor = vec3<f32>(across, -across * p.covariance.y / p.covariance.z, inverseSqrt(p.covariance.z));
    splat.reach = 2.0 * log(opacity / ALPHA_MIN);
    splat.color = color_towards(i, p.world);
    if !is_finite3(splat.color) || !is_finite3(splat.factor) {
        atomicAdd(&degenerate_here, 1u);
        return splat;
    }
    let half_difference = 0.5 * (p.covariance.x - p.covariance.z);
    let half_sum = 0.5 * (p.covariance.x + p.covariance.z);
    splat.radius = 3.0 * sqrt(half_sum + length(vec2<f32>(half_difference, p.covariance.y)));
    return splat;
}

@compute @workgroup_size(256)
fn main(
    @builtin(global_invocation_id) global: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let i = flat(global, groups, 256u);
    if i < view.gaussians {
        var splat = splat_of(i);
        var count = 0u;
        if splat.radius > 0.0 {
            let bounds = tile_bounds(splat.mean, splat.factor, splat.reach, view.tiles);
            for (var y = bounds.y; y < bounds.w; y++) {
                for (var x = bounds.x; x < bounds.z; x++) {
                    count += u32(reaches_tile(splat.mean, splat.factor, splat.reach, vec2<u32>(x, y)));
                }
            }
        }
        if count == 0u {
            splat.radius = 0.0;
        } else {
            atomicAdd(&drawn_here, 1u);
        }
        splats[i] = splat;
        tile_counts[i] = count;
        depth_keys[i] = select(0xffffffffu, bitcast<u32>(splat.depth), count > 0u);
        order[i] = i;
    }
    workgroupBarrier();
    if thread == 0u {
        atomicAdd(&counters[COUNT_VISIBLE], atomicLoad(&drawn_here));
        atomicAdd(&counters[COUNT_DEGENERATE], atomicLoad(&degenerate_here));
    }
}
