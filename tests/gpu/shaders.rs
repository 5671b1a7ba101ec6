//! Every shader is valid WGSL, and every structure that it shares with the host has the host's
//! layout. Needs no GPU.

use std::collections::BTreeSet;

use fmlgs::render::gpu::layout::{TWINS, Twin};
use fmlgs::render::gpu::shader::{self, ShaderVariant};
use naga::TypeInner;
use naga::valid::{Capabilities, ValidationFlags, Validator};

fn variants() -> impl Iterator<Item = ShaderVariant> {
    [0, 1, 6, 16]
        .into_iter()
        .flat_map(|channels| [false, true].map(|float_atomics| ShaderVariant { channels, float_atomics }))
}

/// Reason for which `source` is not valid; `None` if it is.
fn fault(source: &str, float_atomics: bool) -> Option<String> {
    let module = match naga::front::wgsl::parse_str(source) {
        Ok(module) => module,
        Err(e) => return Some(e.emit_to_string(source)),
    };
    let mut capabilities = Capabilities::default();
    capabilities.set(Capabilities::SHADER_FLOAT32_ATOMIC, float_atomics);
    Validator::new(ValidationFlags::all(), capabilities).validate(&module).err().map(|e| e.emit_to_string(source))
}

/// The twins that `source` declares, and how they differ from the host's.
fn compare(source: &str, twins: &[Twin], seen: &mut BTreeSet<&'static str>) -> Vec<String> {
    let module = naga::front::wgsl::parse_str(source).unwrap();
    let mut complaints = Vec::new();
    for (_, ty) in module.types.iter() {
        let Some(twin) = ty.name.as_deref().and_then(|n| twins.iter().find(|t| t.name == n)) else { continue };
        let TypeInner::Struct { members, span } = &ty.inner else { continue };
        seen.insert(twin.name);
        let theirs: Vec<_> = members.iter().map(|m| (m.name.as_deref().unwrap_or(""), m.offset as usize)).collect();
        if theirs != twin.fields || *span as usize != twin.size {
            complaints
                .push(format!("{}: {theirs:?} span {span}, host {:?} size {}", twin.name, twin.fields, twin.size));
        }
    }
    complaints
}

#[test]
fn every_shader_is_valid() {
    let mut checked = 0;
    for name in shader::kernels() {
        for variant in variants() {
            let source = shader::source(name, variant).unwrap();
            if let Some(fault) = fault(&source, variant.float_atomics) {
                panic!("{name} {variant:?}:\n{fault}");
            }
            checked += 1;
        }
    }
    assert_eq!(checked, 10 * 8, "kernels times variants");
}

#[test]
fn validation_catches_faults() {
    let good = shader::source("blend", ShaderVariant::default()).unwrap();
    assert!(fault(&good, false).is_none());
    assert!(fault(&good.replace("var transmittance = 1.0;", "var transmittance = 1u;"), false).is_some());
    let atomics = shader::source("blend_backward", ShaderVariant { channels: 0, float_atomics: true }).unwrap();
    assert!(fault(&atomics, false).is_some(), "float atomics on an adapter without them");
}

#[test]
fn shared_structures_have_one_layout() {
    let mut seen = BTreeSet::new();
    for name in shader::kernels() {
        let source = shader::source(name, ShaderVariant::default()).unwrap();
        let complaints = compare(&source, TWINS, &mut seen);
        assert!(complaints.is_empty(), "{name}: {complaints:#?}");
    }
    let all: BTreeSet<_> = TWINS.iter().map(|t| t.name).collect();
    assert_eq!(seen, all, "every twin occurs in some shader");
}

#[test]
fn layout_comparison_catches_a_moved_field() {
    let source = shader::source("sort", ShaderVariant::default()).unwrap();
    let swapped = [Twin { name: "Pass", size: 16, fields: &[("counter", 0), ("shift", 4), ("pad0", 8), ("pad1", 12)] }];
    assert_eq!(compare(&source, &swapped, &mut BTreeSet::new()).len(), 1);
    let shorter = [Twin { name: "Pass", size: 12, fields: &[("shift", 0), ("counter", 4), ("pad0", 8)] }];
    assert_eq!(compare(&source, &shorter, &mut BTreeSet::new()).len(), 1);
}
