// A Gaussian in the picture. Twin of `layout::Splat`.
struct Splat {
    // Center in px, depth along the viewing axis.
    mean: vec2<f32>,
    depth: f32,
    // After the sigmoid and the anti-aliasing compensation.
    opacity: f32,
    // Factor of the inverse covariance: q = (f.x dx + f.y dy)^2 + (f.z dy)^2. Unlike the conic's
    // three entries it does not cancel for long thin splats.
    factor: vec3<f32>,
    // Largest q at which alpha still reaches ALPHA_MIN.
    reach: f32,
    color: vec3<f32>,
    // 3 sigma along the longer axis, px; 0 where nothing is drawn.
    radius: f32,
}

// Gradient of one splat, ahead of its extra channels: mean 2, covariance xx xy yy, opacity,
// color 3, depth.
const GRADIENT_BASE: u32 = 10u;

// The splat's squared Mahalanobis distance at `d` px from its center.
fn distance2(factor: vec3<f32>, d: vec2<f32>) -> f32 {
    let a = factor.x * d.x + factor.y * d.y;
    let b = factor.z * d.y;
    return a * a + b * b;
}

// Alpha at squared distance `q`; 0 where it does not count.
fn alpha_at(opacity: f32, q: f32) -> f32 {
    let alpha = min(ALPHA_MAX, opacity * exp(-0.5 * q));
    return select(0.0, alpha, alpha >= ALPHA_MIN);
}
