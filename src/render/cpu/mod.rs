//! The CPU renderer (generic over `f32` and `f64`).
