// What a pass needs to know of the camera and the picture. Twin of `layout::View`.
struct View {
    // Rows of camera_from_world: the camera's right, down and forward axes in the world.
    right: vec4<f32>,
    down: vec4<f32>,
    forward: vec4<f32>,
    // Cloud origin minus camera center, formed in f64 and split, so that far scenes stay exact.
    offset_hi: vec4<f32>,
    offset_lo: vec4<f32>,
    background: vec4<f32>,
    focal: vec2<f32>,
    principal: vec2<f32>,
    tangent_min: vec2<f32>,
    tangent_max: vec2<f32>,
    size_px: vec2<u32>,
    tiles: vec2<u32>,
    gaussians: u32,
    // Spherical-harmonics degree to use, and the one that is stored.
    sh_degree: u32,
    sh_stored: u32,
    // How many (splat, tile) pairs the buffers hold.
    capacity: u32,
    near: f32,
    antialias: u32,
    // Extra channels per Gaussian.
    channels: u32,
    // Variance added to each splat along both picture axes, px^2.
    blur: f32,
}
