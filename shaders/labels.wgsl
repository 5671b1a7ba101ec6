// The label that wins every pixel: what `src/render/cpu/labels.rs` finds on the CPU, in the same order. One workgroup a
// tile, one thread a pixel.
#include "constants"
#include "shared/view.wgsl"
#include "shared/splat.wgsl"

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> ranges: array<vec2<u32>>;
@group(0) @binding(2) var<storage, read> pair_splats: array<u32>;
@group(0) @binding(3) var<storage, read> splats: array<Splat>;
// [Gaussian]
@group(0) @binding(4) var<storage, read> labels: array<u32>;
// The group of each label.
@group(0) @binding(5) var<storage, read> groups: array<u32>;
// [pixel]: label, bits of its group's share, bits of alpha.
@group(0) @binding(6) var<storage, read_write> found: array<u32>;

const BATCH: u32 = 256u;

// A label of which nothing is known is a group of its own.
fn group_of(label: u32) -> u32 {
    if label < arrayLength(&groups) {
        return groups[label];
    }
    return select(0u, UNKNOWN, label == UNKNOWN);
}

var<workgroup> batch: array<Splat, 256>;
var<workgroup> batch_labels: array<u32, 256>;
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
    var names: array<u32, COMPETITORS>;
    var weights: array<f32, COMPETITORS>;
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
            batch_labels[thread] = labels[id];
            batch[thread] = splats[id];
        }
        workgroupBarrier();
        let n = min(BATCH, range.y - start);
        for (var k = 0u; k < n && !closed; k++) {
            let alpha = alpha_at(batch[k].opacity, distance2(batch[k].factor, center - batch[k].mean));
            if alpha == 0.0 {
                continue;
            }
            let left = transmittance * (1.0 - alpha);
            if left < TRANSMITTANCE_MIN {
                closed = true;
                continue;
            }
            let weight = alpha * transmittance;
            transmittance = left;
            let label = batch_labels[k];
            // The label's own place, or that of the least.
            var own = COMPETITORS;
            var least = 0u;
            for (var c = 0u; c < COMPETITORS; c++) {
                if own == COMPETITORS && names[c] == label && weights[c] > 0.0 {
                    own = c;
                }
                if weights[c] < weights[least] {
                    least = c;
                }
            }
            if own < COMPETITORS {
                weights[own] += weight;
            } else if weights[least] < weight {
                names[least] = label;
                weights[least] = weight;
            }
        }
        workgroupBarrier();
    }

    if !inside {
        return;
    }
    var alpha = 0.0;
    for (var c = 0u; c < COMPETITORS; c++) {
        alpha += weights[c];
    }
    var label = 0u;
    var share = 0.0;
    if alpha >= 0.5 {
        var best = 0u;
        var most = 0.0;
        for (var c = 0u; c < COMPETITORS; c++) {
            let own = group_of(names[c]);
            var sum = 0.0;
            for (var d = 0u; d < COMPETITORS; d++) {
                sum += select(0.0, weights[d], group_of(names[d]) == own);
            }
            if weights[c] > 0.0 && sum > most {
                best = own;
                most = sum;
            }
        }
        var heaviest = 0.0;
        for (var c = 0u; c < COMPETITORS; c++) {
            if weights[c] > 0.0 && weights[c] >= heaviest && group_of(names[c]) == best {
                label = names[c];
                heaviest = weights[c];
            }
        }
        share = most / alpha;
    }
    let at = 3u * (pixel.y * view.size_px.x + pixel.x);
    found[at] = label;
    found[at + 1u] = bitcast<u32>(share);
    found[at + 2u] = bitcast<u32>(alpha);
}
