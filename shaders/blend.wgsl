// Front-to-back blending: one workgroup a tile, one thread a pixel. `CHANNELS` extra channels go
// along; more than a pipeline holds are drawn in further passes over the same list.
#include "constants"
#include "shared/view.wgsl"
#include "shared/splat.wgsl"
#include "shared/chunk.wgsl"

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> chunk: Chunk;
@group(0) @binding(2) var<storage, read> ranges: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read> pair_splats: array<u32>;
@group(0) @binding(4) var<storage, read> splats: array<Splat>;
// [Gaussian][channel]
@group(0) @binding(5) var<storage, read> features: array<f32>;
// Color over the background, and what transmittance is left.
@group(0) @binding(6) var<storage, read_write> pixels: array<vec4<f32>>;
// Bits of the transmittance, and the end of the part of the tile's list that was blended.
@group(0) @binding(7) var<storage, read_write> ends: array<vec2<u32>>;
// Expected depth (not divided by alpha) and median depth.
@group(0) @binding(8) var<storage, read_write> depths: array<vec2<f32>>;
// [pixel][channel]
@group(0) @binding(9) var<storage, read_write> feature_pixels: array<f32>;

const BATCH: u32 = 256u;

var<workgroup> batch: array<Splat, 256>;
var<workgroup> batch_ids: array<u32, 256>;
var<workgroup> any_open: atomic<u32>;

@compute @workgroup_size(16, 16)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_id) local: vec3<u32>,
    @builtin(local_invocation_index) thread: u32,
) {
    let range = ranges[group.y * view.tiles.x + group.x];
    let pixel = group.xy * TILE_PX + local.xy;
    let center = vec2<f32>(pixel) + 0.5;
    let inside = all(pixel < view.size_px);

    var transmittance = 1.0;
    var color = vec3<f32>(0.0);
    var depth = 0.0;
    var median = 0.0;
    var end = range.x;
    var sums: array<f32, SLOTS>;
    var closed = !inside;

    for (var start = range.x; start < range.y; start += BATCH) {
        if thread == 0u {
            atomicStore(&any_open, 0u);
        }
        workgroupBarrier();
        if !closed {
            atomicStore(&any_open, 1u);
        }
        if workgroupUniformLoad(&any_open) == 0u {
            break;
        }
        if start + thread < range.y {
            let id = pair_splats[start + thread];
            batch_ids[thread] = id;
            batch[thread] = splats[id];
        }
        workgroupBarrier();
        let n = min(BATCH, range.y - start);
        for (var k = 0u; k < n && !closed; k++) {
            let q = distance2(batch[k].factor, center - batch[k].mean);
            let alpha = alpha_at(batch[k].opacity, q);
            if alpha == 0.0 {
                continue;
            }
            let left = transmittance * (1.0 - alpha);
            if left < TRANSMITTANCE_MIN {
                closed = true;
                continue;
            }
            let weight = alpha * transmittance;
            color += weight * batch[k].color;
            depth += weight * batch[k].depth;
            if transmittance > 0.5 && left <= 0.5 {
                median = batch[k].depth;
            }
            if CHANNELS > 0u {
                let at = batch_ids[k] * chunk.channels + chunk.first;
                for (var c = 0u; c < CHANNELS; c++) {
                    sums[c] += weight * features[at + c];
                }
            }
            transmittance = left;
            end = start + k + 1u;
        }
        workgroupBarrier();
    }

    if !inside {
        return;
    }
    let at = pixel.y * view.size_px.x + pixel.x;
    for (var c = 0u; c < CHANNELS; c++) {
        feature_pixels[at * chunk.channels + chunk.first + c] = sums[c];
    }
    if chunk.first == 0u {
        pixels[at] = vec4<f32>(color + transmittance * view.background.xyz, transmittance);
        ends[at] = vec2<u32>(bitcast<u32>(transmittance), end);
        depths[at] = vec2<f32>(depth, median);
    }
}
