// One Adam step over a buffer of parameters, one thread a number. The rate depends on the number's
// place in its Gaussian's record of `stride` floats. The rule for outliers is that of
// `render/cpu/adam.rs`: no gradient counts for more than what doubles the second moment.
#include "shared/counters.wgsl"
#include "shared/flat.wgsl"

struct AdamStep {
    // Rate of each float of a record.
    rates: array<vec4<f32>, 7>,
    // Floats in all, and per record.
    floats: u32,
    stride: u32,
    // 1 / (1 - beta^t) of both moments.
    unbias_first: f32,
    unbias_second: f32,
    beta_first: f32,
    beta_second: f32,
    epsilon: f32,
    // Largest size of a gradient.
    clip: f32,
    // Square of the largest gradient in units of the second moment.
    growth: f32,
    // A gradient this many times too large is counted.
    outlier: f32,
    // Floats at the front that stay as they are.
    frozen: u32,
    pad0: f32,
}

@group(0) @binding(0) var<uniform> adam: AdamStep;
@group(0) @binding(1) var<storage, read_write> parameters: array<f32>;
@group(0) @binding(2) var<storage, read> gradient: array<f32>;
@group(0) @binding(3) var<storage, read_write> first: array<f32>;
@group(0) @binding(4) var<storage, read_write> second: array<f32>;
// The geometry's gradient, whose pad is negative for Gaussians that must not move: those that
// were not drawn keep their moments as they are.
@group(0) @binding(5) var<storage, read> marks: array<f32>;
@group(0) @binding(6) var<storage, read> counters: array<u32>;
@group(0) @binding(7) var<storage, read_write> outliers: array<atomic<u32>>;

// Floats of a record of `marks`, and the place of the mark.
const MARK_STRIDE: u32 = 12u;
const MARK: u32 = 11u;

@compute @workgroup_size(256)
fn main(@builtin(global_invocation_id) global: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = flat(global, groups, 256u);
    // A frame whose pairs did not fit was not drawn: its gradient means nothing.
    if i >= adam.floats || i < adam.frozen || counters[COUNT_OVERFLOW] != 0u {
        return;
    }
    let place = i % adam.stride;
    let rate = adam.rates[place / 4u][place % 4u];
    if rate == 0.0 || marks[(i / adam.stride) * MARK_STRIDE + MARK] < 0.0 {
        return;
    }
    let seen = second[i];
    let limit = select(adam.clip, min(sqrt(adam.growth * seen), adam.clip), seen > 0.0);
    if abs(gradient[i]) > adam.outlier * limit {
        atomicAdd(&outliers[0], 1u);
    }
    let g = clamp(gradient[i], -limit, limit);
    let m = mix(g, first[i], adam.beta_first);
    let v = mix(g * g, seen, adam.beta_second);
    first[i] = m;
    second[i] = v;
    parameters[i] -= rate * (m * adam.unbias_first) / (sqrt(v * adam.unbias_second) + adam.epsilon);
}
