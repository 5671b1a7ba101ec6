// The place of a thread in a row of workgroups of `size` threads, of which one axis holds too few.
fn flat(global: vec3<u32>, groups: vec3<u32>, size: u32) -> u32 {
    return global.y * groups.x * size + global.x;
}
