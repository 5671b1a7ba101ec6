//! The demo scene, made from formulas: a table with things on it, each of several named parts.
//!
//! [`build`] gives the bytes of `assets/demo.glb`; `tests/it/architecture/mod.rs` includes it and compares the two. After a
//! change here, `cargo test --test it write_the_demo_scene -- --ignored` writes the file anew. Units are
//! meters, y is up, the table's middle stands on the origin.

mod glb;
mod mesh;
mod objects;
mod paint;
mod shapes;
#[cfg(test)]
mod tests;

/// The scene as a binary glTF file, the same bytes on every machine.
///
/// # Errors
/// Only if a texture does not compress.
pub fn build() -> Result<Vec<u8>, image::ImageError> {
    glb::write(&objects::all())
}
