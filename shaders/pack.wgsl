// A picture's colors as bytes: three for each pixel, four pixels in three words. One thread four pixels.
#include "constants"
#include "shared/view.wgsl"
#include "shared/flat.wgsl"

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> pixels: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> bytes: array<u32>;

// Clamped and rounded as by `Frame::to_rgb8`.
fn rgb_of(at: u32) -> vec3<u32> {
    if at >= view.size_px.x * view.size_px.y {
        return vec3<u32>(0u);
    }
    return vec3<u32>(clamp(pixels[at].xyz, vec3<f32>(0.0), vec3<f32>(1.0)) * 255.0 + 0.5);
}

@compute @workgroup_size(256)
fn main(@builtin(global_invocation_id) global: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let four = flat(global, groups, 256u);
    if 4u * four >= view.size_px.x * view.size_px.y {
        return;
    }
    let a = rgb_of(4u * four);
    let b = rgb_of(4u * four + 1u);
    let c = rgb_of(4u * four + 2u);
    let d = rgb_of(4u * four + 3u);
    bytes[3u * four] = a.x | (a.y << 8u) | (a.z << 16u) | (b.x << 24u);
    bytes[3u * four + 1u] = b.y | (b.z << 8u) | (c.x << 16u) | (c.y << 24u);
    bytes[3u * four + 2u] = c.z | (d.x << 8u) | (d.y << 16u) | (d.z << 24u);
}
