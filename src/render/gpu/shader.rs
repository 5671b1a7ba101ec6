//! Shader sources: the files of `shaders/`, put together by `#include`.

use std::collections::BTreeSet;
use std::fmt::Write;

use super::GpuError;
use super::layout::ROW_PX;
use crate::render::cpu::labels::{COMPETITORS, UNKNOWN};
use crate::render::{ALPHA_MAX, ALPHA_MIN, COLOR_MAX, TILE_PX, TRANSMITTANCE_MIN};

macro_rules! files {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!(concat!("../../../shaders/", $name)))),*]
    };
}

/// Every file of `shaders/`, by its path there.
pub(crate) const FILES: &[(&str, &str)] = files![
    "adam.wgsl",
    "bin.wgsl",
    "blend.wgsl",
    "blend_backward.wgsl",
    "labels.wgsl",
    "pack.wgsl",
    "project.wgsl",
    "project_backward.wgsl",
    "sort.wgsl",
    "ssim.wgsl",
    "shared/atomic_exchange.wgsl",
    "shared/atomic_float.wgsl",
    "shared/chunk.wgsl",
    "shared/counters.wgsl",
    "shared/finite.wgsl",
    "shared/flat.wgsl",
    "shared/harmonics.wgsl",
    "shared/linearize.wgsl",
    "shared/reach.wgsl",
    "shared/scan.wgsl",
    "shared/splat.wgsl",
    "shared/view.wgsl",
];

/// Variant of a shader file for a pipeline.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct ShaderVariant {
    /// Extra channels that a blending pass carries.
    pub channels: usize,
    /// True if sums use the adapter's float atomics.
    pub float_atomics: bool,
}

/// Names of the kernels: the files outside `shared/`, without their ending.
pub fn kernels() -> impl Iterator<Item = &'static str> {
    FILES.iter().filter_map(|(name, _)| if name.contains('/') { None } else { name.strip_suffix(".wgsl") })
}

/// The complete source of kernel `name`. A line `#include "path"` is replaced by that file, once;
/// `constants` and `atomic_add` stand for the constants of [`crate::render`] and for the variant's
/// way to add floats.
pub fn source(name: &str, variant: ShaderVariant) -> Result<String, GpuError> {
    let mut out = String::new();
    include(&mut out, &mut BTreeSet::new(), &format!("{name}.wgsl"), variant)?;
    Ok(out)
}

fn include(out: &mut String, seen: &mut BTreeSet<String>, path: &str, variant: ShaderVariant) -> Result<(), GpuError> {
    let path = match path {
        "constants" => {
            out.push_str(&constants(variant));
            return Ok(());
        }
        "atomic_add" if variant.float_atomics => "shared/atomic_float.wgsl",
        "atomic_add" => "shared/atomic_exchange.wgsl",
        file => file,
    };
    if !seen.insert(path.to_owned()) {
        return Ok(());
    }
    let missing = || GpuError::Shader(path.to_owned());
    let (_, text) = FILES.iter().find(|(name, _)| *name == path).ok_or_else(missing)?;
    for line in text.lines() {
        match line.strip_prefix("#include \"").and_then(|rest| rest.strip_suffix('"')) {
            Some(target) => include(out, seen, target, variant)?,
            None => {
                out.push_str(line);
                out.push('\n');
            }
        }
    }
    Ok(())
}

fn constants(variant: ShaderVariant) -> String {
    let mut out = format!("const TILE_PX: u32 = {TILE_PX}u;\n");
    let floats = [
        ("ALPHA_MIN", ALPHA_MIN),
        ("ALPHA_MAX", ALPHA_MAX),
        ("COLOR_MAX", COLOR_MAX),
        ("TRANSMITTANCE_MIN", TRANSMITTANCE_MIN),
    ];
    for (name, value) in floats {
        // Writing to a String cannot fail.
        let _ = writeln!(out, "const {name}: f32 = {:e};", value as f32);
    }
    for (name, value) in [("COMPETITORS", COMPETITORS as u32), ("UNKNOWN", UNKNOWN), ("ROW_PX", ROW_PX)] {
        let _ = writeln!(out, "const {name}: u32 = {value}u;");
    }
    let _ =
        writeln!(out, "const CHANNELS: u32 = {}u;\nconst SLOTS: u32 = {}u;", variant.channels, variant.channels.max(1));
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fragment_is_included_once() {
        let text = source("project", ShaderVariant::default()).expect("known");
        assert_eq!(text.matches("struct View {").count(), 1);
        assert!(!text.contains("#include"));
        assert!(source("nonesuch", ShaderVariant::default()).is_err());
    }

    #[test]
    fn variants_differ() {
        let with =
            |float_atomics| source("blend_backward", ShaderVariant { channels: 2, float_atomics }).expect("known");
        assert!(with(true).contains("atomic<f32>") && !with(true).contains("atomicCompareExchangeWeak"));
        assert!(with(false).contains("atomicCompareExchangeWeak") && !with(false).contains("atomic<f32>"));
        assert!(with(true).contains("const CHANNELS: u32 = 2u;"));
    }

    #[test]
    fn every_file_on_disk_is_listed() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
        let mut on_disk = 0;
        for folder in ["", "shared"] {
            for entry in std::fs::read_dir(root.join(folder)).expect("folder") {
                let path = entry.expect("entry").path();
                if path.extension().is_some_and(|e| e == "wgsl") {
                    on_disk += 1;
                }
            }
        }
        assert_eq!(on_disk, FILES.len());
    }
}
