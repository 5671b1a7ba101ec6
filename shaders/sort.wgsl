// One pass of a stable least-significant-digit radix sort of (key, value) pairs by eight bits:
// `count` -> `scan` -> `scatter`. No workgroup waits for another, and no subgroup width is assumed.
#include "shared/scan.wgsl"

// Pairs that one workgroup handles: 16 rounds of one pair a thread.
const ROUNDS: u32 = 16u;
const BLOCK: u32 = 4096u;

struct Pass {
    // Lowest bit of this pass's digit.
    shift: u32,
    // Where in `counters` the number of pairs stands.
    counter: u32,
    pad0: u32,
    pad1: u32,
}

@group(0) @binding(0) var<uniform> radix_pass: Pass;
@group(0) @binding(1) var<storage, read> counters: array<u32>;
@group(0) @binding(2) var<storage, read> keys_in: array<u32>;
@group(0) @binding(3) var<storage, read> values_in: array<u32>;
@group(0) @binding(4) var<storage, read_write> keys_out: array<u32>;
@group(0) @binding(5) var<storage, read_write> values_out: array<u32>;
// [digit][block]: pairs of the block with that digit; after `scan`, those in earlier blocks.
@group(0) @binding(6) var<storage, read_write> histogram: array<u32>;
// Pairs with each digit.
@group(0) @binding(7) var<storage, read_write> totals: array<u32>;

fn pairs() -> u32 {
    return counters[radix_pass.counter];
}

fn blocks() -> u32 {
    return (pairs() + BLOCK - 1u) / BLOCK;
}

fn digit_of(key: u32) -> u32 {
    return (key >> radix_pass.shift) & 255u;
}

var<workgroup> bins: array<atomic<u32>, 256>;

@compute @workgroup_size(256)
fn count(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let n = pairs();
    if group.x >= blocks() {
        return;
    }
    atomicStore(&bins[thread], 0u);
    workgroupBarrier();
    for (var round = 0u; round < ROUNDS; round++) {
        let i = group.x * BLOCK + round * 256u + thread;
        if i < n {
            atomicAdd(&bins[digit_of(keys_in[i])], 1u);
        }
    }
    workgroupBarrier();
    histogram[thread * blocks() + group.x] = atomicLoad(&bins[thread]);
}

// One workgroup a digit.
@compute @workgroup_size(256)
fn scan(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let n = blocks();
    let row = group.x * n;
    var carried = 0u;
    for (var start = 0u; start < n; start += 256u) {
        let i = start + thread;
        var value = 0u;
        if i < n {
            value = histogram[row + i];
        }
        let scanned = scan_workgroup(thread, value);
        if i < n {
            histogram[row + i] = carried + scanned.before;
        }
        carried += scanned.total;
    }
    if thread == 0u {
        totals[group.x] = carried;
    }
}

// Which threads of this round hold each digit: 256 bits a digit.
var<workgroup> holders: array<atomic<u32>, 2048>;
// Where the next pair with each digit goes.
var<workgroup> next: array<u32, 256>;

@compute @workgroup_size(256)
fn scatter(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let n = pairs();
    if group.x >= blocks() {
        return;
    }
    let before_digit = scan_workgroup(thread, totals[thread]).before;
    next[thread] = before_digit + histogram[thread * blocks() + group.x];
    for (var w = 0u; w < 8u; w++) {
        atomicStore(&holders[w * 256u + thread], 0u);
    }
    workgroupBarrier();
    let word = thread >> 5u;
    let bit = thread & 31u;
    for (var round = 0u; round < ROUNDS; round++) {
        let start = group.x * BLOCK + round * 256u;
        if start >= n {
            break;
        }
        let i = start + thread;
        let held = i < n;
        var key = 0u;
        if held {
            key = keys_in[i];
            atomicOr(&holders[digit_of(key) * 8u + word], 1u << bit);
        }
        workgroupBarrier();
        let digit = digit_of(key);
        // Equal digits keep the order of their threads, which is that of the input.
        var rank = 0u;
        var equal = 0u;
        if held {
            for (var w = 0u; w < 8u; w++) {
                let bits = atomicLoad(&holders[digit * 8u + w]);
                equal += countOneBits(bits);
                if w < word {
                    rank += countOneBits(bits);
                } else if w == word {
                    rank += countOneBits(bits & ((1u << bit) - 1u));
                }
            }
            let to = next[digit] + rank;
            keys_out[to] = key;
            values_out[to] = values_in[i];
        }
        workgroupBarrier();
        if held && rank + 1u == equal {
            next[digit] += equal;
            for (var w = 0u; w < 8u; w++) {
                atomicStore(&holders[digit * 8u + w], 0u);
            }
        }
        workgroupBarrier();
    }
}
