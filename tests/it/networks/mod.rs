//! CLIP, SAM and SAM 2 against the official code: reduced networks with fixed random weights, exported
//! by `tools/export`, with the official results beside them. Every comparison has a negative control.

mod clip;
mod fixture;
mod sam;
mod video;
