// Splats in depth order to (tile, splat) pairs, and, after those are sorted by tile, to each
// tile's range of pairs: `sum_counts` -> `scan_sums` -> `emit`, the sort, then `ranges`.
#include "constants"
#include "shared/view.wgsl"
#include "shared/counters.wgsl"
#include "shared/splat.wgsl"
#include "shared/reach.wgsl"
#include "shared/scan.wgsl"

// Splats that one workgroup handles: 4 neighbors a thread.
const BLOCK: u32 = 1024u;
const EACH: u32 = 4u;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> order: array<u32>;
@group(0) @binding(2) var<storage, read> tile_counts: array<u32>;
// Pairs of each block; after `scan_sums`, those of earlier blocks.
@group(0) @binding(3) var<storage, read_write> sums: array<u32>;
@group(0) @binding(4) var<storage, read_write> counters: array<u32>;
@group(0) @binding(5) var<storage, read> splats: array<Splat>;
@group(0) @binding(6) var<storage, read_write> pair_tiles: array<u32>;
@group(0) @binding(7) var<storage, read_write> pair_splats: array<u32>;
@group(0) @binding(8) var<storage, read_write> ranges: array<vec2<u32>>;

fn count_at(j: u32) -> u32 {
    if j >= view.gaussians {
        return 0u;
    }
    return tile_counts[order[j]];
}

@compute @workgroup_size(256)
fn sum_counts(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    var sum = 0u;
    for (var k = 0u; k < EACH; k++) {
        sum += count_at(group.x * BLOCK + thread * EACH + k);
    }
    let scanned = scan_workgroup(thread, sum);
    if thread == 0u {
        sums[group.x] = scanned.total;
    }
}

var<workgroup> too_many: atomic<u32>;

// A single workgroup. A total past 32 bits saturates, and so counts as an overflow.
@compute @workgroup_size(256)
fn scan_sums(@builtin(local_invocation_index) thread: u32) {
    let n = (view.gaussians + BLOCK - 1u) / BLOCK;
    var carried = 0u;
    var saturated = false;
    for (var start = 0u; start < n; start += 256u) {
        let i = start + thread;
        var value = 0u;
        if i < n {
            // 2^24 pairs a block at most, so that 256 of them cannot wrap.
            value = min(sums[i], 0xffffffu);
            if value == 0xffffffu {
                atomicStore(&too_many, 1u);
            }
        }
        let scanned = scan_workgroup(thread, value);
        if i < n {
            sums[i] = carried + scanned.before;
        }
        saturated = saturated || carried + scanned.total < carried;
        carried += scanned.total;
    }
    if thread == 0u {
        let wanted = select(carried, 0xffffffffu, saturated || atomicLoad(&too_many) != 0u);
        let fits = wanted <= view.capacity;
        counters[COUNT_WANTED] = wanted;
        counters[COUNT_PAIRS] = select(0u, wanted, fits);
        counters[COUNT_OVERFLOW] = select(1u, 0u, fits);
    }
}

@compute @workgroup_size(256)
fn emit(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    if counters[COUNT_OVERFLOW] != 0u {
        return;
    }
    let first = group.x * BLOCK + thread * EACH;
    var sum = 0u;
    for (var k = 0u; k < EACH; k++) {
        sum += count_at(first + k);
    }
    var at = sums[group.x] + scan_workgroup(thread, sum).before;
    let nowhere = view.tiles.x * view.tiles.y;
    for (var k = 0u; k < EACH; k++) {
        let count = count_at(first + k);
        if count == 0u {
            continue;
        }
        let id = order[first + k];
        let splat = splats[id];
        let bounds = tile_bounds(splat.mean, splat.factor, splat.reach, view.tiles);
        let end = at + count;
        for (var y = bounds.y; y < bounds.w; y++) {
            for (var x = bounds.x; x < bounds.z; x++) {
                if at < end && reaches_tile(splat.mean, splat.factor, splat.reach, vec2<u32>(x, y)) {
                    pair_tiles[at] = y * view.tiles.x + x;
                    pair_splats[at] = id;
                    at++;
                }
            }
        }
        // Two kernels may round the same test differently. What `project` counted and this one
        // did not find goes to a tile that does not exist, so that no slot keeps an old pair.
        for (; at < end; at++) {
            pair_tiles[at] = nowhere;
            pair_splats[at] = id;
        }
    }
}

@compute @workgroup_size(256)
fn ranges_of_tiles(@builtin(global_invocation_id) global: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let n = counters[COUNT_PAIRS];
    let nowhere = view.tiles.x * view.tiles.y;
    for (var i = global.x; i < n; i += groups.x * 256u) {
        let tile = pair_tiles[i];
        if tile >= nowhere {
            continue;
        }
        if i == 0u || pair_tiles[i - 1u] != tile {
            ranges[tile].x = i;
        }
        if i + 1u == n || pair_tiles[i + 1u] != tile {
            ranges[tile].y = i + 1u;
        }
    }
}
