// Counters of one frame. Twin of `layout::Counters`; kernels see it as an array of words.
const COUNT_GAUSSIANS: u32 = 0u;
// Pairs that are sorted and blended: 0 when they did not fit.
const COUNT_PAIRS: u32 = 1u;
// Pairs that the frame needs.
const COUNT_WANTED: u32 = 2u;
// 1 when they did not fit.
const COUNT_OVERFLOW: u32 = 3u;
const COUNT_VISIBLE: u32 = 4u;
const COUNT_DEGENERATE: u32 = 5u;
const COUNT_BAD_GRADIENTS: u32 = 6u;
