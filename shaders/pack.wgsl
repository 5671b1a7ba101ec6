// A picture's colors as bytes, red, green, blue and 255, each row on its own as copies into textures want it. One
// thread a pixel.
#include "constants"
#include "shared/view.wgsl"
#include "shared/flat.wgsl"

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> pixels: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> bytes: array<u32>;

@compute @workgroup_size(256)
fn main(@builtin(global_invocation_id) global: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let at = flat(global, groups, 256u);
    let width = view.size_px.x;
    if at >= width * view.size_px.y {
        return;
    }
    // Clamped and rounded as by `Frame::to_rgb8`.
    let c = vec3<u32>(clamp(pixels[at].xyz, vec3<f32>(0.0), vec3<f32>(1.0)) * 255.0 + 0.5);
    let stride = (width + ROW_PX - 1u) / ROW_PX * ROW_PX;
    bytes[at / width * stride + at % width] = c.x | (c.y << 8u) | (c.z << 16u) | 0xff000000u;
}
