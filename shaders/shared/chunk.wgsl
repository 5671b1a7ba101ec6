// Which of the extra channels a pass draws. Twin of `layout::Chunk`. `CHANNELS` (how many) and
// `SLOTS` (at least one, for array sizes) are put in when a pipeline is made.
struct Chunk {
    // Channels per Gaussian in the buffers.
    channels: u32,
    // First channel of this pass. Pass 0 also handles color, alpha and depth.
    first: u32,
    // Whether the loss has a gradient with respect to expected depth.
    depth_gradient: u32,
    pad0: u32,
}
