//! Writes `assets/demo.glb` anew from the formulas in `src/pipeline/demo_scene`.

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/demo.glb");
    let bytes = fmlgs::pipeline::demo_scene::build()?;
    std::fs::write(path, &bytes)?;
    println!("{path}: {} bytes", bytes.len());
    Ok(())
}
