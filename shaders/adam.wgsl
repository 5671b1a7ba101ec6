// One Adam step over a buffer of parameters, one thread a number. The rate depends on the number's
// place in its Gaussian's record of `stride` floats.
#include "shared/counters.wgsl"

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
    // Components of the gradient are cut to this size; 0 = not.
    clip: f32,
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

// Floats of a record of `marks`, and the place of the mark.
const MARK_STRIDE: u32 = 12u;
const MARK: u32 = 11u;

@compute @workgroup_size(256)
fn main(@builtin(global_invocation_id) global: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = global.y * groups.x * 256u + global.x;
    // A frame whose pairs did not fit was not drawn: its gradient means nothing.
    if i >= adam.floats || counters[COUNT_OVERFLOW] != 0u {
        return;
    }
    let place = i % adam.stride;
    let rate = adam.rates[place / 4u][place % 4u];
    if rate == 0.0 || marks[(i / adam.stride) * MARK_STRIDE + MARK] < 0.0 {
        return;
    }
    var g = gradient[i];
    if adam.clip > 0.0 {
        g = clamp(g, -adam.clip, adam.clip);
    }
    let m = mix(g, first[i], adam.beta_first);
    let v = mix(g * g, second[i], adam.beta_second);
    first[i] = m;
    second[i] = v;
    parameters[i] -= rate * (m * adam.unbias_first) / (sqrt(v * adam.unbias_second) + adam.epsilon);
}
