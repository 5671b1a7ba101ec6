//! The textual header of a PLY file.

use std::path::Path;

use half::f16;

use super::Ply;
use crate::io::IoError;

const MAX_HEADER_BYTES: usize = 1 << 20;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// Type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F16,
    F32,
    F64,
}

impl Scalar {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "half" | "float16" | "f16" => Self::F16,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    pub(crate) const fn is_float(self) -> bool {
        matches!(self, Self::F16 | Self::F32 | Self::F64)
    }

    pub(crate) const fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 | Self::F16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Reads the value at the front of `b`, little-endian; 0 if `b` is too short.
    #[inline]
    pub(crate) fn read(self, b: &[u8]) -> f64 {
        #[inline]
        fn get<const N: usize>(b: &[u8]) -> [u8; N] {
            b.first_chunk().copied().unwrap_or([0; N])
        }
        match self {
            Self::I8 => f64::from(i8::from_le_bytes(get(b))),
            Self::U8 => f64::from(u8::from_le_bytes(get(b))),
            Self::I16 => f64::from(i16::from_le_bytes(get(b))),
            Self::U16 => f64::from(u16::from_le_bytes(get(b))),
            Self::I32 => f64::from(i32::from_le_bytes(get(b))),
            Self::U32 => f64::from(u32::from_le_bytes(get(b))),
            Self::F16 => f64::from(f16::from_le_bytes(get(b))),
            Self::F32 => f64::from(f32::from_le_bytes(get(b))),
            Self::F64 => f64::from_le_bytes(get(b)),
        }
    }

    /// Appends `value`, little-endian; `None` if an integer type cannot hold it.
    pub(crate) fn push(self, out: &mut Vec<u8>, value: f64) -> Option<()> {
        let int = |lo: f64, hi: f64| (value.fract() == 0.0 && value >= lo && value <= hi).then_some(value);
        match self {
            Self::I8 => out.extend((int(-128.0, 127.0)? as i8).to_le_bytes()),
            Self::U8 => out.extend((int(0.0, 255.0)? as u8).to_le_bytes()),
            Self::I16 => out.extend((int(-32_768.0, 32_767.0)? as i16).to_le_bytes()),
            Self::U16 => out.extend((int(0.0, 65_535.0)? as u16).to_le_bytes()),
            Self::I32 => out.extend((int(f64::from(i32::MIN), f64::from(i32::MAX))? as i32).to_le_bytes()),
            Self::U32 => out.extend((int(0.0, f64::from(u32::MAX))? as u32).to_le_bytes()),
            Self::F16 => out.extend(f16::from_f64(value).to_le_bytes()),
            Self::F32 => out.extend((value as f32).to_le_bytes()),
            Self::F64 => out.extend(value.to_le_bytes()),
        }
        Some(())
    }
}

/// A number, or a list of them with its length in front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Scalar(Scalar),
    List {
        /// Type of the length.
        count: Scalar,
        /// Type of the entries.
        item: Scalar,
    },
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Property {
    pub(crate) name: String,
    pub(crate) kind: Kind,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Element {
    /// Its name: `vertex`, `face`, `chunk`.
    pub(crate) name: String,
    /// Number of rows, as the header claims.
    pub(crate) count: u64,
    pub(crate) properties: Vec<Property>,
}

impl Element {
    /// Returns whether a row holds lists, and so may have any size.
    pub(super) fn has_lists(&self) -> bool {
        self.properties.iter().any(|p| matches!(p.kind, Kind::List { .. }))
    }
}

pub(super) fn parse<'a>(bytes: &'a [u8], path: &'a Path) -> Result<Ply<'a>, IoError> {
    let mut rest = bytes;
    let mut number = 0_usize;
    let bad = |line: usize, reason: &str| IoError::syntax(path, format!("header line {line}"), reason);
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut comments = Vec::new();
    loop {
        number += 1;
        let window = &rest[..rest.len().min(MAX_HEADER_BYTES)];
        let Some(end) = window.iter().position(|&b| b == b'\n') else {
            return Err(bad(number, "the header has no end; expected 'end_header'"));
        };
        let line = std::str::from_utf8(&rest[..end]).map_err(|_| bad(number, "not text"))?;
        rest = &rest[end + 1..];
        if bytes.len() - rest.len() > MAX_HEADER_BYTES {
            return Err(bad(number, "the header is longer than 1 MiB"));
        }
        let line = line.trim_end_matches('\r');
        let mut words = line.split_ascii_whitespace();
        let first = words.next();
        if number == 1 {
            if first != Some("ply") {
                return Err(bad(1, "a PLY file starts with the line 'ply'"));
            }
            continue;
        }
        match (first, words.next(), words.next(), words.next(), words.next()) {
            (Some("end_header"), ..) => break,
            (Some("comment" | "obj_info"), ..) => {
                comments.push(line.split_once(' ').map_or("", |(_, text)| text.trim()));
            }
            (Some("format"), Some(name), ..) => {
                encoding = Some(match name {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::LittleEndian,
                    "binary_big_endian" => Encoding::BigEndian,
                    _ => return Err(bad(number, &format!("unknown format '{name}'"))),
                });
            }
            (Some("element"), Some(name), Some(count), ..) => {
                let count = count.parse().map_err(|_| bad(number, &format!("'{count}' is not a count")))?;
                if elements.iter().any(|e| e.name == name) {
                    return Err(bad(number, &format!("element '{name}' comes twice")));
                }
                elements.push(Element { name: name.into(), count, properties: Vec::new() });
            }
            (Some("property"), Some("list"), Some(count), Some(item), Some(name)) => {
                let (Some(count), Some(item)) = (Scalar::named(count), Scalar::named(item)) else {
                    return Err(bad(number, "unknown type"));
                };
                add(&mut elements, name, Kind::List { count, item }).map_err(|e| bad(number, &e))?;
            }
            (Some("property"), Some(kind), Some(name), ..) => {
                let Some(scalar) = Scalar::named(kind) else {
                    return Err(bad(number, &format!("unknown type '{kind}'")));
                };
                add(&mut elements, name, Kind::Scalar(scalar)).map_err(|e| bad(number, &e))?;
            }
            (None, ..) => {}
            _ => {
                return Err(bad(number, &format!("'{}' is not understood", line.chars().take(60).collect::<String>())));
            }
        }
    }
    let encoding = encoding.ok_or_else(|| bad(number, "no 'format' line"))?;
    Ok(Ply { path, encoding, comments, elements, body: rest })
}

fn add(elements: &mut [Element], name: &str, kind: Kind) -> Result<(), String> {
    let element = elements.last_mut().ok_or("a property before any element")?;
    // Thousands of properties would make this quadratic check slow; no format has that many.
    if element.properties.len() >= 1024 {
        return Err("more than 1024 properties".into());
    }
    if element.properties.iter().any(|p| p.name == name) {
        return Err(format!("property '{name}' comes twice"));
    }
    element.properties.push(Property { name: name.into(), kind });
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse_text(text: &str) -> Result<Vec<Element>, IoError> {
        Ply::parse(text.as_bytes(), Path::new("x.ply")).map(|p| p.elements)
    }

    #[test]
    fn reads_elements_and_types() {
        let e = parse_text("ply\r\nformat ascii 1.0\r\ncomment hi\r\nelement vertex 2\r\nproperty float x\r\nelement face 1\r\nproperty list uchar int vertex_indices\r\nend_header\r\n")
            .expect("valid");
        assert_eq!(e[0].properties[0].kind, Kind::Scalar(Scalar::F32));
        assert_eq!(e[1].properties[0].kind, Kind::List { count: Scalar::U8, item: Scalar::I32 });
    }

    #[test]
    fn bad_headers_are_named() {
        for (text, reason) in [
            ("plx\n", "starts with"),
            ("ply\nformat ascii 1.0\n", "no end"),
            ("ply\nformat morse 1.0\nend_header\n", "morse"),
            ("ply\nelement vertex 1\nend_header\n", "no 'format'"),
            ("ply\nformat ascii 1.0\nelement vertex many\nend_header\n", "many"),
            ("ply\nformat ascii 1.0\nelement vertex 99999999999999999999999\nend_header\n", "not a count"),
            ("ply\nformat ascii 1.0\nproperty float x\nend_header\n", "before any element"),
            ("ply\nformat ascii 1.0\nelement v 1\nproperty float x\nproperty float x\nend_header\n", "twice"),
            ("ply\nformat ascii 1.0\nelement v 1\nelement v 1\nend_header\n", "twice"),
            ("ply\nformat ascii 1.0\nelement v 1\nproperty quad x\nend_header\n", "quad"),
            ("ply\nfoo\nend_header\n", "foo"),
        ] {
            let e = parse_text(text).expect_err(text);
            assert!(matches!(e, IoError::Syntax { .. }), "{e}");
            assert!(e.to_string().contains(reason), "{e} lacks '{reason}'");
        }
    }
}
