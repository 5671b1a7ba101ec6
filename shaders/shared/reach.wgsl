// Which tiles a splat reaches: the one place where this is decided on the GPU.

// Tiles [xy, zw) that the bounding box of the splat's visible ellipse touches.
fn tile_bounds(mean: vec2<f32>, factor: vec3<f32>, reach: f32, tiles: vec2<u32>) -> vec4<u32> {
    // Variances along x and y, back from the factor.
    let vy = 1.0 / (factor.z * factor.z);
    let vx = (factor.y * factor.y * vy + 1.0) / (factor.x * factor.x);
    let half_px = sqrt(max(reach, 0.0) * vec2<f32>(vx, vy)) + 0.01;
    let side = f32(TILE_PX);
    let last = vec2<f32>(tiles);
    let lo = clamp(floor((mean - half_px - 0.5) / side), vec2<f32>(0.0), last);
    let hi = clamp(floor((mean + half_px - 0.5) / side) + 1.0, vec2<f32>(0.0), last);
    return vec4<u32>(vec2<u32>(lo), vec2<u32>(max(hi, lo)));
}

// Whether the smallest q over the rectangle of the tile's pixel centers is within reach. A little
// slack, so that rounding never leaves out a pixel that blending would have drawn.
fn reaches_tile(mean: vec2<f32>, factor: vec3<f32>, reach: f32, tile: vec2<u32>) -> bool {
    let lo = vec2<f32>(tile * TILE_PX) + 0.5 - mean;
    let hi = lo + f32(TILE_PX - 1u);
    let nearest = clamp(vec2<f32>(0.0), lo, hi);
    if all(nearest == vec2<f32>(0.0)) {
        return true;
    }
    // A convex function whose minimizer lies outside a rectangle is smallest on an edge that
    // faces the minimizer: at most one upright and one level edge.
    var q = 3.0e38;
    if nearest.x != 0.0 {
        let along = factor.y * factor.y + factor.z * factor.z;
        let dy = clamp(-factor.x * factor.y * nearest.x / along, lo.y, hi.y);
        q = distance2(factor, vec2<f32>(nearest.x, dy));
    }
    if nearest.y != 0.0 {
        let dx = clamp(-factor.y * nearest.y / factor.x, lo.x, hi.x);
        q = min(q, distance2(factor, vec2<f32>(dx, nearest.y)));
    }
    return q <= reach * 1.0001 + 1e-3;
}
