//! CLIP, SAM and SAM 2 against the official code: reduced networks with fixed random weights, exported
//! by `tools/export`, with the official results beside them. Every comparison has a negative control.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "networks/clip.rs"]
mod clip;
mod common;
#[path = "networks/fixture.rs"]
mod fixture;
#[path = "networks/sam.rs"]
mod sam;
#[path = "networks/video.rs"]
mod video;
