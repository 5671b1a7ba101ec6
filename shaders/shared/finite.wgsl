// Shader compilers may assume that numbers are finite, so `x != x` proves nothing: test the bits.
fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

fn is_finite2(v: vec2<f32>) -> bool {
    return is_finite(v.x) && is_finite(v.y);
}

fn is_finite3(v: vec3<f32>) -> bool {
    return is_finite(v.x) && is_finite(v.y) && is_finite(v.z);
}
