// Sums by compare-and-exchange, for adapters without atomic addition of floats.
@group(0) @binding(9) var<storage, read_write> gradient: array<atomic<u32>>;

fn add_gradient(at: u32, value: f32) {
    var old = atomicLoad(&gradient[at]);
    loop {
        let sum = bitcast<u32>(bitcast<f32>(old) + value);
        let result = atomicCompareExchangeWeak(&gradient[at], old, sum);
        if result.exchanged {
            break;
        }
        old = result.old_value;
    }
}
