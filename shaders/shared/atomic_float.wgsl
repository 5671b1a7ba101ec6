// Sums by the adapter's own atomic addition of floats.
@group(0) @binding(9) var<storage, read_write> gradient: array<atomic<f32>>;

fn add_gradient(at: u32, value: f32) {
    atomicAdd(&gradient[at], value);
}
