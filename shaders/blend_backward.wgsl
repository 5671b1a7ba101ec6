// Gradient of blending: pictures' gradients to those of the splats in the picture. One workgroup
// a quarter of a tile; each thread owns one splat of a batch, back to front, and walks over the
// quarter's pixels.
//
// The threads walk one pixel apart: at step s, thread t is at item s - t, and item i is pixel
// i mod PIXELS of batch i / PIXELS. So each pixel meets the splats in order, its state is handed on
// through shared memory with one barrier a step, no two threads touch one pixel at once, nothing
// is reduced over threads, and a splat's sums leave with one atomic each. Since a batch is no
// longer than the walk, the next batch follows with no gap.
#include "constants"
#include "shared/view.wgsl"
#include "shared/splat.wgsl"
#include "shared/chunk.wgsl"

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> chunk: Chunk;
@group(0) @binding(2) var<storage, read> ranges: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read> pair_splats: array<u32>;
@group(0) @binding(4) var<storage, read> splats: array<Splat>;
@group(0) @binding(5) var<storage, read> features: array<f32>;
@group(0) @binding(6) var<storage, read> ends: array<vec2<u32>>;
// [pixel] with respect to color and alpha, then, where the loss has one, [pixel] to depth in x.
@group(0) @binding(7) var<storage, read> pixel_gradient: array<vec4<f32>>;
// [pixel][channel]
@group(0) @binding(8) var<storage, read> feature_pixel_gradient: array<f32>;
// [Gaussian][GRADIENT_BASE + channels], added up over tiles.
#include "atomic_add"

// Side of the part of a tile that a workgroup walks over, and its pixels.
const SIDE: u32 = 8u;
const PIXELS: u32 = SIDE * SIDE;
// Parts along a tile's side.
const PARTS: u32 = TILE_PX / SIDE;
// Splats in flight: threads of a workgroup.
const BATCH: u32 = 64u;

// Each pixel's transmittance behind the splats done so far, and what everything behind adds to
// the loss along the pixel's gradient.
var<workgroup> state: array<vec2<f32>, PIXELS>;
// Gradient with respect to color and depth.
var<workgroup> wanted: array<vec4<f32>, PIXELS>;
// End of the pixel's part of the tile's list.
var<workgroup> pixel_end: array<u32, PIXELS>;
var<workgroup> last_end: atomic<u32>;

// Pixel `p` of a workgroup's part of a tile.
fn pixel_of(group: vec3<u32>, p: u32) -> vec2<u32> {
    let part = vec2<u32>(group.z % PARTS, group.z / PARTS);
    return group.xy * TILE_PX + part * SIDE + vec2<u32>(p % SIDE, p / SIDE);
}

fn load_pixel(group: vec3<u32>, p: u32) {
    let pixel = pixel_of(group, p);
    var end = 0u;
    if all(pixel < view.size_px) {
        let at = pixel.y * view.size_px.x + pixel.x;
        let transmittance = bitcast<f32>(ends[at].x);
        end = ends[at].y;
        var behind = 0.0;
        var toward = vec4<f32>(0.0);
        if chunk.first == 0u {
            let g = pixel_gradient[at];
            toward = vec4<f32>(g.xyz, 0.0);
            if chunk.depth_gradient != 0u {
                toward.w = pixel_gradient[view.size_px.x * view.size_px.y + at].x;
            }
            behind = transmittance * (dot(g.xyz, view.background.xyz) - g.w);
        }
        state[p] = vec2<f32>(transmittance, behind);
        wanted[p] = toward;
    }
    pixel_end[p] = end;
    atomicMax(&last_end, end);
}

struct Sums {
    mean: vec2<f32>,
    covariance: vec3<f32>,
    opacity: f32,
    color: vec3<f32>,
    depth: f32,
    features: array<f32, SLOTS>,
}

fn flush(id: u32, sums: Sums) {
    let at = id * (GRADIENT_BASE + chunk.channels);
    let any_base = any(sums.mean != vec2<f32>(0.0)) || any(sums.covariance != vec3<f32>(0.0)) || sums.opacity != 0.0
        || any(sums.color != vec3<f32>(0.0)) || sums.depth != 0.0;
    if any_base {
        add_gradient(at, sums.mean.x);
        add_gradient(at + 1u, sums.mean.y);
        add_gradient(at + 2u, sums.covariance.x);
        add_gradient(at + 3u, sums.covariance.y);
        add_gradient(at + 4u, sums.covariance.z);
        add_gradient(at + 5u, sums.opacity);
        add_gradient(at + 6u, sums.color.x);
        add_gradient(at + 7u, sums.color.y);
        add_gradient(at + 8u, sums.color.z);
        add_gradient(at + 9u, sums.depth);
    }
    for (var c = 0u; c < CHANNELS; c++) {
        if sums.features[c] != 0.0 {
            add_gradient(at + GRADIENT_BASE + chunk.first + c, sums.features[c]);
        }
    }
}

@compute @workgroup_size(BATCH)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    for (var p = thread; p < PIXELS; p += BATCH) {
        load_pixel(group, p);
    }
    let first = ranges[group.y * view.tiles.x + group.x].x;
    let end = workgroupUniformLoad(&last_end);
    if end <= first {
        return;
    }
    let batches = (end - first + BATCH - 1u) / BATCH;
    let items = batches * PIXELS;

    // The splat in hand, the one fetched for the next batch, and the sums waiting to leave. Fetches
    // and flushes happen at one step for all threads, so that they do not stall one another.
    var id = 0u;
    var splat: Splat;
    var sums: Sums;
    var next_id = 0u;
    var next_splat: Splat;
    var done_id = 0u;
    var done: Sums;
    // Position in the list, plus one; 0 where the batch has no splat for this thread.
    var slot = 0u;
    // The steps after the last item hand over and flush the last batch.
    for (var s = 0u; s <= items + BATCH; s++) {
        let phase = s % PIXELS;
        if phase == 0u && s < items {
            let back = (s / PIXELS) * BATCH + thread;
            if first + back < end {
                next_id = pair_splats[end - 1u - back];
                next_splat = splats[next_id];
            }
        }
        if phase == BATCH % PIXELS && s > PIXELS {
            flush(done_id, done);
        }
        if s >= thread && s - thread <= items {
            let item = s - thread;
            let p = item % PIXELS;
            if p == 0u {
                done_id = id;
                done = sums;
                id = next_id;
                splat = next_splat;
                sums = Sums();
                let back = (item / PIXELS) * BATCH + thread;
                slot = 0u;
                if item < items && first + back < end {
                    slot = end - back;
                }
            }
            if slot != 0u && slot <= pixel_end[p] {
                let pixel = pixel_of(group, p);
                let d = vec2<f32>(pixel) + 0.5 - splat.mean;
                let alpha = alpha_at(splat.opacity, distance2(splat.factor, d));
                if alpha > 0.0 {
                    let before = state[p];
                    let transmittance = before.x / (1.0 - alpha);
                    let weight = alpha * transmittance;
                    let toward = wanted[p];
                    var along = 0.0;
                    if chunk.first == 0u {
                        along = dot(toward.xyz, splat.color) + toward.w * splat.depth;
                        sums.color += weight * toward.xyz;
                        sums.depth += weight * toward.w;
                    }
                    if CHANNELS > 0u {
                        let at = (pixel.y * view.size_px.x + pixel.x) * chunk.channels + chunk.first;
                        let own = id * chunk.channels + chunk.first;
                        for (var c = 0u; c < CHANNELS; c++) {
                            let g = feature_pixel_gradient[at + c];
                            along += g * features[own + c];
                            sums.features[c] += weight * g;
                        }
                    }
                    let to_alpha = transmittance * along - before.y / (1.0 - alpha);
                    state[p] = vec2<f32>(transmittance, before.y + weight * along);
                    // A clamped alpha does not move with the splat's shape.
                    if alpha < ALPHA_MAX {
                        sums.opacity += to_alpha * alpha / splat.opacity;
                        let to_q = -0.5 * alpha * to_alpha;
                        // Inverse covariance times d, from the factor: no cancellation.
                        let a = splat.factor.x * d.x + splat.factor.y * d.y;
                        let b = splat.factor.z * d.y;
                        let h = vec2<f32>(splat.factor.x * a, splat.factor.y * a + splat.factor.z * b);
                        sums.mean -= 2.0 * to_q * h;
                        sums.covariance -= to_q * vec3<f32>(h.x * h.x, 2.0 * h.x * h.y, h.y * h.y);
                    }
                }
            }
        }
        workgroupBarrier();
    }
}
