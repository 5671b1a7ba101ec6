// The training loss and its gradient: L1 and D-SSIM (11 x 11 Gaussian window of sigma 1.5, zeros
// around the picture). Where the photo's coverage is partial, the picture is faded towards it.
// `moments` -> `gradient`; `reduce` leaves the step's sums for the host.
#include "constants"
#include "shared/counters.wgsl"

struct Loss {
    size_px: vec2<u32>,
    // Where in the ring the sums go.
    slot: u32,
    // Tiles, whose partial sums `reduce` adds up.
    tiles: u32,
    // Weights of L1 and of D-SSIM in the loss, over the number of pixels and channels.
    l1: f32,
    dssim: f32,
    // 1 if alpha follows the photo's pixels.
    has_alpha: u32,
    pad0: u32,
    // Color in xyz that is added where the photo is transparent.
    shift: vec4<f32>,
}

@group(0) @binding(0) var<uniform> loss: Loss;
// Rendered color in xyz.
@group(0) @binding(1) var<storage, read> pixels: array<vec4<f32>>;
// Photo: red, green, blue, coverage from the low byte up; then, of a thing that was cut out, the
// alpha of each pixel.
@group(0) @binding(2) var<storage, read> photo: array<u32>;
// [channel][derivative][pixel]: of SSIM to the windowed means of x, x x and x y.
@group(0) @binding(3) var<storage, read_write> maps: array<f32>;
@group(0) @binding(4) var<storage, read_write> pixel_gradient: array<vec4<f32>>;
// [tile]: sums of absolute errors, SSIM, squared errors over pixels and channels.
@group(0) @binding(5) var<storage, read_write> partials: array<vec4<f32>>;
// [slot]: those sums over the picture and outliers, then overflow, wanted pairs, visible, bad gradients.
@group(0) @binding(6) var<storage, read_write> ring: array<vec4<f32>>;
@group(0) @binding(7) var<storage, read> counters: array<u32>;
@group(0) @binding(8) var<storage, read> outliers: array<u32>;

const RADIUS: u32 = 5u;
const TAPS: u32 = 11u;
// A tile with its surroundings.
const WIDE: u32 = 26u;
const C1: f32 = 1e-4;
const C2: f32 = 9e-4;

var<private> kernel: array<f32, 11> = array<f32, 11>(
    0.00102838, 0.00759876, 0.03600077, 0.10936069, 0.21300554, 0.26601173,
    0.21300554, 0.10936069, 0.03600077, 0.00759876, 0.00102838,
);

// Two or three planes of the tile and its surroundings.
var<workgroup> wide: array<f32, 2028>;
// The same after the window's horizontal pass, up to five planes.
var<workgroup> rows: array<f32, 2080>;
var<workgroup> sums: array<vec4<f32>, 64>;

// The pixel at place `e` of the tile's surroundings, and whether it lies in the picture.
fn surrounding(group: vec2<u32>, e: u32) -> vec3<u32> {
    let pixel = vec2<i32>(group * TILE_PX + vec2<u32>(e % WIDE, e / WIDE)) - i32(RADIUS);
    let inside = all(pixel >= vec2<i32>(0)) && all(pixel < vec2<i32>(loss.size_px));
    return vec3<u32>(vec2<u32>(pixel), u32(inside));
}

fn index_of(pixel: vec2<u32>) -> u32 {
    return pixel.y * loss.size_px.x + pixel.x;
}

// Rendered and wanted value of a channel of a pixel.
fn compared(at: u32, channel: u32) -> vec2<f32> {
    let stored = unpack4x8unorm(photo[at]);
    var wanted = stored[channel];
    if loss.has_alpha != 0u {
        let alpha = unpack4x8unorm(photo[loss.size_px.x * loss.size_px.y + at]).x;
        wanted += (1.0 - alpha) * loss.shift[channel];
    }
    return vec2<f32>(mix(wanted, pixels[at][channel], stored.w), wanted);
}

// Sum over the workgroup's 256 threads; the result is thread 0's.
fn sum_up(thread: u32, value: vec4<f32>) -> vec4<f32> {
    // In four rounds, so that the scratch memory stays small.
    var total = vec4<f32>(0.0);
    for (var part = 0u; part < 4u; part++) {
        workgroupBarrier();
        if thread / 64u == part {
            sums[thread % 64u] = value;
        }
        workgroupBarrier();
        for (var half = 32u; half > 0u; half = half >> 1u) {
            if thread < half {
                sums[thread] += sums[thread + half];
            }
            workgroupBarrier();
        }
        total += sums[0];
    }
    return total;
}

@compute @workgroup_size(16, 16)
fn moments(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_id) local: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let pixel = group.xy * TILE_PX + local.xy;
    let inside = all(pixel < loss.size_px);
    let at = index_of(pixel);
    let plane = loss.size_px.x * loss.size_px.y;
    var found = vec4<f32>(0.0);
    for (var channel = 0u; channel < 3u; channel++) {
        for (var e = thread; e < WIDE * WIDE; e += 256u) {
            let place = surrounding(group.xy, e);
            var xy = vec2<f32>(0.0);
            if place.z != 0u {
                xy = compared(index_of(place.xy), channel);
            }
            wide[e] = xy.x;
            wide[WIDE * WIDE + e] = xy.y;
        }
        workgroupBarrier();
        for (var e = thread; e < WIDE * TILE_PX; e += 256u) {
            let start_at = (e / TILE_PX) * WIDE + e % TILE_PX;
            var s = array<f32, 5>();
            for (var k = 0u; k < TAPS; k++) {
                let x = wide[start_at + k];
                let y = wide[WIDE * WIDE + start_at + k];
                s[0] += kernel[k] * x;
                s[1] += kernel[k] * y;
                s[2] += kernel[k] * x * x;
                s[3] += kernel[k] * y * y;
                s[4] += kernel[k] * x * y;
            }
            for (var p = 0u; p < 5u; p++) {
                rows[p * WIDE * TILE_PX + e] = s[p];
            }
        }
        workgroupBarrier();
        if inside {
            var s = array<f32, 5>();
            for (var p = 0u; p < 5u; p++) {
                for (var k = 0u; k < TAPS; k++) {
                    s[p] += kernel[k] * rows[p * WIDE * TILE_PX + (local.y + k) * TILE_PX + local.x];
                }
            }
            let mx = s[0];
            let my = s[1];
            let a1 = 2.0 * mx * my + C1;
            let a2 = 2.0 * (s[4] - mx * my) + C2;
            let b1 = mx * mx + my * my + C1;
            let b2 = (s[2] - mx * mx) + (s[3] - my * my) + C2;
            let ssim = (a1 * a2) / (b1 * b2);
            let to_xx = -ssim / b2;
            let to_xy = 2.0 * a1 / (b1 * b2);
            let to_x = 2.0 * my * a2 / (b1 * b2) - 2.0 * mx * ssim / b1 - 2.0 * mx * to_xx - my * to_xy;
            maps[(channel * 3u) * plane + at] = to_x;
            maps[(channel * 3u + 1u) * plane + at] = to_xx;
            maps[(channel * 3u + 2u) * plane + at] = to_xy;
            let xy = compared(at, channel);
            let difference = xy.x - xy.y;
            found += vec4<f32>(abs(difference), ssim, difference * difference, 0.0);
        }
        workgroupBarrier();
    }
    let total = sum_up(thread, found);
    if thread == 0u {
        partials[group.y * groups.x + group.x] = total;
    }
}

@compute @workgroup_size(16, 16)
fn gradient(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_id) local: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let pixel = group.xy * TILE_PX + local.xy;
    let inside = all(pixel < loss.size_px);
    let at = index_of(pixel);
    let plane = loss.size_px.x * loss.size_px.y;
    var found = vec3<f32>(0.0);
    for (var channel = 0u; channel < 3u; channel++) {
        for (var e = thread; e < WIDE * WIDE; e += 256u) {
            let place = surrounding(group.xy, e);
            for (var d = 0u; d < 3u; d++) {
                var value = 0.0;
                if place.z != 0u {
                    value = maps[(channel * 3u + d) * plane + index_of(place.xy)];
                }
                wide[d * WIDE * WIDE + e] = value;
            }
        }
        workgroupBarrier();
        for (var e = thread; e < WIDE * TILE_PX; e += 256u) {
            let start_at = (e / TILE_PX) * WIDE + e % TILE_PX;
            for (var d = 0u; d < 3u; d++) {
                var s = 0.0;
                for (var k = 0u; k < TAPS; k++) {
                    s += kernel[k] * wide[d * WIDE * WIDE + start_at + k];
                }
                rows[d * WIDE * TILE_PX + e] = s;
            }
        }
        workgroupBarrier();
        if inside {
            var s = vec3<f32>(0.0);
            for (var k = 0u; k < TAPS; k++) {
                let e = (local.y + k) * TILE_PX + local.x;
                s += kernel[k] * vec3<f32>(rows[e], rows[WIDE * TILE_PX + e], rows[2u * WIDE * TILE_PX + e]);
            }
            let xy = compared(at, channel);
            let to_ssim = s.x + 2.0 * xy.x * s.y + xy.y * s.z;
            let coverage = unpack4x8unorm(photo[at]).w;
            found[channel] = coverage * (loss.l1 * sign(xy.x - xy.y) - loss.dssim * to_ssim);
        }
        workgroupBarrier();
    }
    if inside {
        pixel_gradient[at] = vec4<f32>(found, 0.0);
    }
}

// A single workgroup.
@compute @workgroup_size(256)
fn reduce(@builtin(local_invocation_index) thread: u32) {
    var found = vec4<f32>(0.0);
    for (var t = thread; t < loss.tiles; t += 256u) {
        found += partials[t];
    }
    let total = sum_up(thread, found);
    if thread == 0u {
        ring[2u * loss.slot] = vec4<f32>(total.xyz, f32(outliers[0]));
        ring[2u * loss.slot + 1u] = vec4<f32>(
            f32(counters[COUNT_OVERFLOW]),
            f32(counters[COUNT_WANTED]),
            f32(counters[COUNT_VISIBLE]),
            f32(counters[COUNT_BAD_GRADIENTS]),
        );
    }
}
