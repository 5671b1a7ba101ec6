//! Typed reads from buffers, every range checked.

use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::{Index, buffer::View, validation::Checked};

use super::File;
use crate::io::IoError;

/// Values of an accessor as `f32`, those of one element together.
pub(crate) struct AccessorValues {
    pub(crate) width: usize,
    /// `[count * width]`.
    pub(crate) data: Vec<f32>,
    pub(crate) signed_integer: bool,
}

impl AccessorValues {
    /// Elements as arrays, padded with `fill` if the accessor has fewer components.
    pub(crate) fn arrays<const N: usize>(&self, fill: f32) -> impl Iterator<Item = [f32; N]> + '_ {
        self.data.chunks_exact(self.width).map(move |c| std::array::from_fn(|i| c.get(i).copied().unwrap_or(fill)))
    }
}

impl File<'_> {
    /// Reads a numeric accessor; `normalized` integers are scaled to 0..1 or -1..1.
    pub(crate) fn values(&self, index: usize, place: &str) -> Result<AccessorValues, IoError> {
        let values = self.any_values(index, place)?;
        match values.data.iter().position(|v| !v.is_finite()) {
            None => Ok(values),
            Some(i) => {
                let (path, index, property) = (self.path.into(), i / values.width, format!("accessors[{index}]"));
                Err(IoError::NotFinite { path, element: "element", index, property })
            }
        }
    }

    /// As [`Self::values`], but floats need not be finite.
    pub(crate) fn any_values(&self, index: usize, place: &str) -> Result<AccessorValues, IoError> {
        let root = self.root;
        let accessor = self.item(&root.accessors, index, "accessors", place)?;
        let place = format!("accessors[{index}]");
        let width = match accessor.type_ {
            Checked::Valid(Type::Scalar) => 1,
            Checked::Valid(Type::Vec2) => 2,
            Checked::Valid(Type::Vec3) => 3,
            Checked::Valid(Type::Vec4) => 4,
            _ => return Err(self.content(place, "its type is not SCALAR, VEC2, VEC3 or VEC4")),
        };
        let component = self.component(accessor, &place)?;
        let count = accessor.count.0;
        self.spend(count.saturating_mul(width as u64))?;
        let count = count as usize;
        let normalized = accessor.normalized;
        let mut data = match accessor.buffer_view {
            Some(view) => {
                let offset = accessor.byte_offset.map_or(0, |o| o.0);
                let elements = self.elements(view, offset, count, component, width, &place)?;
                let mut out = Vec::with_capacity(count * width);
                for element in elements {
                    out.extend(element.chunks_exact(component.size()).map(|b| number(b, component, normalized)));
                }
                out
            }
            None => vec![0.0; count * width],
        };
        if let Some(sparse) = &accessor.sparse {
            let n = sparse.count.0;
            self.spend(n.saturating_mul(width as u64 + 1))?;
            let n = n as usize;
            let Checked::Valid(kind) = &sparse.indices.component_type else {
                return Err(self.content(place, "its sparse indices have an unknown component type"));
            };
            let indices =
                self.elements(sparse.indices.buffer_view, sparse.indices.byte_offset.0, n, kind.0, 1, &place)?;
            let rows =
                self.elements(sparse.values.buffer_view, sparse.values.byte_offset.0, n, component, width, &place)?;
            for (i, row) in indices.zip(rows) {
                let at = integer(i, kind.0) as usize;
                let Some(target) = data.get_mut(at.saturating_mul(width)..at.saturating_add(1).saturating_mul(width))
                else {
                    return Err(self.content(place, format!("a sparse index {at} is not below its count {count}")));
                };
                for (t, b) in target.iter_mut().zip(row.chunks_exact(component.size())) {
                    *t = number(b, component, normalized);
                }
            }
        }
        Ok(AccessorValues { width, data, signed_integer: matches!(component, ComponentType::I8 | ComponentType::I16) })
    }

    pub(super) fn indices(&self, index: usize, place: &str) -> Result<Vec<u32>, IoError> {
        let root = self.root;
        let accessor = self.item(&root.accessors, index, "accessors", place)?;
        let place = format!("accessors[{index}]");
        let component = self.component(accessor, &place)?;
        let whole = matches!(component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32);
        if !whole || !matches!(accessor.type_, Checked::Valid(Type::Scalar)) || accessor.sparse.is_some() {
            return Err(self.content(place, "is no list of unsigned integers, but is used as indices"));
        }
        let view = accessor.buffer_view.ok_or_else(|| self.content(&place, "has no bufferView"))?;
        self.spend(accessor.count.0)?;
        let (offset, count) = (accessor.byte_offset.map_or(0, |o| o.0), accessor.count.0 as usize);
        Ok(self.elements(view, offset, count, component, 1, &place)?.map(|b| integer(b, component)).collect())
    }

    fn component(&self, accessor: &Accessor, place: &str) -> Result<ComponentType, IoError> {
        match &accessor.component_type {
            Checked::Valid(c) => Ok(c.0),
            Checked::Invalid => Err(self.content(place, "its componentType is unknown")),
        }
    }

    /// Returns the bytes of each of `count` elements of `width` components.
    fn elements<'s>(
        &'s self,
        view: Index<View>,
        offset: u64,
        count: usize,
        component: ComponentType,
        width: usize,
        place: &str,
    ) -> Result<impl Iterator<Item = &'s [u8]> + use<'s>, IoError> {
        let bytes = self.view_bytes(view.value(), place)?;
        let size = component.size() * width;
        let stride = self.root.buffer_views[view.value()].byte_stride.map_or(size, |s| s.0);
        // A stride under the size of a value would yield more values than there are bytes.
        if stride < size {
            return Err(self.content(place, format!("its stride of {stride} bytes is less than the {size} of a value")));
        }
        let after = (bytes.len() as u64).checked_sub(offset);
        let after = after.ok_or_else(|| self.content(place, "it begins behind the end of its buffer view"))?;
        let possible = if after < size as u64 { 0 } else { (after - size as u64) / stride as u64 + 1 };
        if count as u64 > possible {
            let (path, what) = (self.path.into(), format!("values in {place}"));
            return Err(IoError::Count { path, what, claimed: count as u64, possible });
        }
        let offset = offset as usize;
        Ok((0..count).map(move |i| &bytes[offset + i * stride..][..size]))
    }

    pub(crate) fn view_bytes(&self, index: usize, place: &str) -> Result<&[u8], IoError> {
        let view = self.item(&self.root.buffer_views, index, "bufferViews", place)?;
        if let Some(bytes) = self.packed_view(index)? {
            return Ok(bytes);
        }
        let start = view.byte_offset.map_or(0, |o| o.0);
        self.buffer_bytes(view.buffer.value(), start, view.byte_length.0, &format!("bufferViews[{index}]"))
    }

    /// Returns `length` bytes of a buffer.
    pub(super) fn buffer_bytes(&self, buffer: usize, start: u64, length: u64, place: &str) -> Result<&[u8], IoError> {
        let buffer = self.item(&self.buffers, buffer, "buffers", place)?;
        let end = start.checked_add(length);
        let range = end.and_then(|end| Some(usize::try_from(start).ok()?..usize::try_from(end).ok()?));
        range.and_then(|r| buffer.get(r)).ok_or_else(|| {
            self.content(place, format!("{length} bytes from {start} lie outside its buffer of {}", buffer.len()))
        })
    }
}

/// Reads one little-endian component; 0 if `b` is shorter than the type (never so here).
fn number(b: &[u8], component: ComponentType, normalized: bool) -> f32 {
    let (value, largest) = match (component, b) {
        (ComponentType::I8, [a, ..]) => (f32::from(*a as i8), 127.0),
        (ComponentType::U8, [a, ..]) => (f32::from(*a), 255.0),
        (ComponentType::I16, [a, b, ..]) => (f32::from(i16::from_le_bytes([*a, *b])), 32_767.0),
        (ComponentType::U16, [a, b, ..]) => (f32::from(u16::from_le_bytes([*a, *b])), 65_535.0),
        (ComponentType::U32, [a, b, c, d, ..]) => (u32::from_le_bytes([*a, *b, *c, *d]) as f32, 4_294_967_295.0),
        (ComponentType::F32, [a, b, c, d, ..]) => return f32::from_le_bytes([*a, *b, *c, *d]),
        _ => (0.0, 1.0),
    };
    if normalized { (value / largest).max(-1.0) } else { value }
}

fn integer(b: &[u8], component: ComponentType) -> u32 {
    match (component, b) {
        (ComponentType::U8, [a, ..]) => u32::from(*a),
        (ComponentType::U16, [a, b, ..]) => u32::from(u16::from_le_bytes([*a, *b])),
        (ComponentType::U32, [a, b, c, d, ..]) => u32::from_le_bytes([*a, *b, *c, *d]),
        _ => 0,
    }
}
