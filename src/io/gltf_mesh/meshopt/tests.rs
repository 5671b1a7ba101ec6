//! Data packed by meshoptimizer's own encoder (1.3.0), compared with the output of its decoder.

use super::*;

/// 300 vertices of four 16-bit numbers: rows, steps, a rare number, and noise at the end.
const VERTICES: &str = "oKqqqqoO7u7u7u7u7u7u/u7u7u7u9u7u7u7+7u7u9u7u7u7u7v7u9u7u7u7u7u7u/u7u7u7u7u727u7+7u7u7u727u7u7v7u7u72\
    7u7u7u7u/u727u7u7u7u7u7+7u7u7u7u7vbu7v7u7u7u7vbu7u7u/u7u7vbu7u7u7u7+7vbu7u7u7u7u7v7u7u7u7u7u9gAAAABU\
    VFFFAMAAAPcAAMAA9wAAAMD3wAAAAPcAwAAA9wAAwAD3AAAAwPfAAAAA9wDAAAD3AADAAPcAAADA98AAAAD3VFRRRQDAAAAGAADA\
    AAgAAADABsAAAAAIAMAAAAYAAMAACAAAAMAGwAAAAAgAwAAABgAAwAAIAAAAwAbAAAAACEEQBEEwAAAA8Q8AAAAJCgDwAAAJCgAP\
    AAAJCgAA8AAJCgAADwAJCkEQBEEwAAAAKw8AAABQTwDwAABwbwAPAAAQDwAA8ADP0AAADwAvMAAAAEAAAADwgH8AAABAAAAD/w9f\
    Vpe3Ku7u/u7u7u7u9u7u7u7+7u7u9u7u7u7u7gAAAAUAwAAA9wAAwAD3BQDAAAAGAADAAAgAABUD/w8AgH+AgP+AfwA8MDyAgP+A\
    fwA/wACAf4B/P1eIFzehL8Z5X9+gqWhIqHfoyNcIl7feQ/Mcf39/f7ZIqHfoyNcInhAGp3jnAAAAAAAAAAAAAAAAAAAAAAAAAAAA\
    AAAAAAAAAAAAAAB+FgAA";

/// A grid of 6 x 6 squares, then scattered triangles.
const TRIANGLES: &str = "4f4eEA4QDhAOEA4QDv4eGw4aDhkOGA4XDv8eFw4XDhcOFw4XDv8eFw4XDhcOFw4XDv8eFw4XDhcOFw4XDv8eFw4XDhcOFw4XDv//\
    /v//Dw6/Am8LDm8LDm8LDm8LDv8PSRz/PlsDAP+QA8cBY/9LAQQAdodWZ3iphmWJaJgBaQAA";

fn bytes(text: &str) -> Vec<u8> {
    base64::decode(text).expect("base64")
}

/// FNV-1a.
fn sum(bytes: &[u8]) -> u32 {
    bytes.iter().fold(2_166_136_261, |sum, b| (sum ^ u32::from(*b)).wrapping_mul(16_777_619))
}

#[test]
fn vertices_of_several_blocks_are_as_they_were() {
    let packed = bytes(VERTICES);
    let found = unpack(&packed, 300, 8, Mode::Attributes, MeshoptFilter::None).expect("unpacked");
    assert_eq!((found.len(), sum(&found)), (2400, 141664302));
    let vertex =
        |i: usize| found[8 * i..8 * i + 8].chunks(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect::<Vec<_>>();
    assert_eq!(vertex(249), [249 % 20 * 7, 249 / 20 * 900, 5, 0]);
}

#[test]
fn triangles_and_indices_are_as_they_were() {
    let found = unpack(&bytes(TRIANGLES), 231, 4, Mode::Triangles, MeshoptFilter::None).expect("unpacked");
    assert_eq!(sum(&found), 3959947290);
    let list: Vec<u32> = found.chunks(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    assert_eq!(list[..12], [0, 1, 7, 7, 1, 8, 8, 1, 2, 8, 2, 9]);
    let short = unpack(&bytes(TRIANGLES), 231, 2, Mode::Triangles, MeshoptFilter::None).expect("unpacked");
    assert_eq!(short.len() * 2, found.len());
    let found =
        unpack(&bytes("0QAEBAyhHwUG3bMOBAQEFgAAAAA="), 12, 2, Mode::Indices, MeshoptFilter::None).expect("unpacked");
    let list: Vec<u16> = found.chunks(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
    assert_eq!(list, [0, 1, 2, 5, 1000, 1001, 3, 60000, 4, 5, 6, 0]);
}

#[test]
fn filters_are_undone() {
    let four = "oAE/AAAA/kriAQ8AAACm+QAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAfwA=";
    let found = unpack(&bytes(four), 4, 4, Mode::Attributes, MeshoptFilter::Octahedral).expect("unpacked");
    assert_eq!(
        found.iter().map(|b| *b as i8).collect::<Vec<_>>(),
        [0, 0, 127, 0, 127, 0, 0, 0, -76, 60, -82, 0, 34, -67, 102, 0]
    );
    let eight = "oAEfAAAAi80BPwAAAP5I5AEPAAAAsgYBDwAAAKb7AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAD/fwAA";
    let found = unpack(&bytes(eight), 4, 8, Mode::Attributes, MeshoptFilter::Octahedral).expect("unpacked");
    let list: Vec<i16> = found.chunks(2).map(|b| i16::from_le_bytes([b[0], b[1]])).collect();
    assert_eq!(list, [0, 0, 32767, 0, 32767, 0, 0, 0, -19660, 15728, -20972, 0, 8751, -17502, 26283, 0]);
    let floats = "oAE/AAAACnYSAT8AAABAB0IAAT8AAAAfGiABPAAAADgIAT8AAAAEP0ABJgAAAAE/AAAAHxogAQ8AAAD//wE/AAAAY0hHAAE/AAAA\
        HxogAAAAAAAAAAAAAAAAAAAAAAAAAADAAAD54P7/+QAyAPk=";
    let found = unpack(&bytes(floats), 4, 12, Mode::Attributes, MeshoptFilter::Exponential).expect("unpacked");
    let list: Vec<f32> = found.chunks(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    assert_eq!(list, [1.5, -2.25, 100.0, 0.001_000_046_7, 0.000_030_040_741, 0.0, 7.0, -8.0, 9.125, 1e6, 0.0, 0.0]);
}

#[test]
fn what_is_cut_off_or_of_another_version_is_refused() {
    let (vertices, triangles) = (bytes(VERTICES), bytes(TRIANGLES));
    for n in 0..vertices.len() {
        assert!(unpack(&vertices[..n], 300, 8, Mode::Attributes, MeshoptFilter::None).is_err(), "{n} bytes");
    }
    for n in 0..triangles.len() {
        assert!(unpack(&triangles[..n], 231, 4, Mode::Triangles, MeshoptFilter::None).is_err(), "{n} bytes");
    }
    let e =
        |data: &[u8], count, stride, mode| unpack(data, count, stride, mode, MeshoptFilter::None).expect_err("refused");
    assert!(e(&[vec![0xa1], vertices[1..].to_vec()].concat(), 300, 8, Mode::Attributes).contains("0xa1"));
    assert!(unpack(&vertices, 600, 8, Mode::Attributes, MeshoptFilter::None).is_err(), "another block");
    assert!(e(&vertices, 16, 8, Mode::Attributes).contains("too many"));
    assert!(e(&vertices, 300, 6, Mode::Attributes).contains("multiple of 4"));
    assert!(e(&triangles, 4, 4, Mode::Triangles).contains("no triangles"));
    assert!(e(&triangles, 231, 3, Mode::Triangles).contains("2 or 4 bytes"));
    assert!(unpack(&vertices, 300, 8, Mode::Attributes, MeshoptFilter::Exponential).is_ok());
    assert!(unpack(&bytes("oAAA"), 0, 12, Mode::Attributes, MeshoptFilter::Octahedral).is_err());
}
