//! Buffer views packed by meshoptimizer (`EXT_meshopt_compression`, version 0 of its vertex codec).
//!
//! Vertices are bytes in planes: each plane differences to the vertex before, in groups of 16 of 0, 2, 4 or 8 bits.
//! Triangles are codes that refer to edges and vertices seen before.

/// Content of a packed view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Mode {
    Attributes,
    Triangles,
    Indices,
}

/// Filter applied to vertices before packing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum MeshoptFilter {
    None,
    Octahedral,
    Exponential,
}

/// Most bytes and vertices of a block.
const BLOCK_BYTES: usize = 8192;
const BLOCK_VERTICES: usize = 256;
/// Vertices that share a bit width.
const GROUP: usize = 16;
/// Least bytes behind the blocks, which end in the first vertex.
const TAIL: usize = 32;
/// Bytes of a table of codes behind triangles, and behind indices.
const TABLE: usize = 16;
const INDEX_TAIL: usize = 4;

/// Unpacks `count` elements of `stride` bytes from `data`; the error is the reason.
pub(super) fn unpack(
    data: &[u8],
    count: usize,
    stride: usize,
    mode: Mode,
    filter: MeshoptFilter,
) -> Result<Vec<u8>, String> {
    let mut out = match mode {
        Mode::Attributes => vertices(data, count, stride)?,
        Mode::Triangles => written(triangles(data, count)?, stride)?,
        Mode::Indices => written(indices(data, count)?, stride)?,
    };
    match (filter, stride) {
        (MeshoptFilter::None, _) => {}
        (MeshoptFilter::Octahedral, 4) => out.chunks_exact_mut(4).for_each(|v| {
            let unit = octahedral([v[0], v[1], v[2]].map(|b| f32::from(b as i8)), 127.0);
            (0..3).for_each(|i| v[i] = unit[i] as i8 as u8);
        }),
        (MeshoptFilter::Octahedral, 8) => out.chunks_exact_mut(8).for_each(|v| {
            let unit = octahedral([0, 2, 4].map(|i| f32::from(i16::from_le_bytes([v[i], v[i + 1]]))), 32767.0);
            (0..3).for_each(|i| v[2 * i..2 * i + 2].copy_from_slice(&(unit[i] as i16).to_le_bytes()));
        }),
        (MeshoptFilter::Exponential, s) if s % 4 == 0 => out.chunks_exact_mut(4).for_each(|v| {
            let word = i32::from_le_bytes([v[0], v[1], v[2], v[3]]);
            let (mantissa, exponent) = (word << 8 >> 8, word >> 24);
            v.copy_from_slice(&(mantissa as f32 * (exponent as f32).exp2()).to_le_bytes());
        }),
        _ => return Err(format!("its filter does not go with {stride} bytes")),
    }
    Ok(out)
}

/// Decodes a unit vector from its point on an octahedron, in steps of 1 / `one`.
fn octahedral([x, y, z]: [f32; 3], one: f32) -> [f32; 3] {
    // The third component starts as the bound on the sum of the first two.
    let z = z - x.abs() - y.abs();
    let fold = z.min(0.0);
    let [x, y] = [x, y].map(|v| v + if v >= 0.0 { fold } else { -fold });
    let scale = one / (x * x + y * y + z * z).sqrt();
    [x, y, z].map(|v| (v * scale).round())
}

fn written(list: Vec<u32>, stride: usize) -> Result<Vec<u8>, String> {
    match stride {
        2 => Ok(list.into_iter().flat_map(|v| (v as u16).to_le_bytes()).collect()),
        4 => Ok(list.into_iter().flat_map(u32::to_le_bytes).collect()),
        _ => Err(format!("an index has 2 or 4 bytes, not {stride}")),
    }
}

/// Takes bytes off the start of a slice.
struct Bytes<'a>(&'a [u8]);

impl<'a> Bytes<'a> {
    fn take(&mut self, n: usize) -> Result<&'a [u8], String> {
        let (head, rest) = self.0.split_at_checked(n).ok_or("its data ends early")?;
        self.0 = rest;
        Ok(head)
    }

    fn byte(&mut self) -> Result<u8, String> {
        Ok(self.take(1)?[0])
    }

    /// Reads a number of seven bits a byte, the lowest first.
    fn number(&mut self) -> Result<u32, String> {
        let mut value = 0_u32;
        for shift in (0..35).step_by(7) {
            let byte = self.byte()?;
            value |= u32::from(byte & 127).wrapping_shl(shift);
            if byte < 128 {
                return Ok(value);
            }
        }
        Err("a number of more than five bytes".into())
    }

    /// Reads the next zigzag difference and adds it to `last`.
    fn after(&mut self, last: u32) -> Result<u32, String> {
        let number = self.number()?;
        Ok(last.wrapping_add(number >> 1 ^ (number & 1).wrapping_neg()))
    }

    fn end(&self) -> Result<(), String> {
        if self.0.is_empty() { Ok(()) } else { Err(format!("{} bytes too many", self.0.len())) }
    }
}

/// Returns version, body and the last `tail` bytes; the first byte must be `magic` and a version up to `newest`.
fn between(data: &[u8], magic: u8, newest: u8, tail: usize) -> Result<(u8, Bytes<'_>, &[u8]), String> {
    let (&first, rest) = data.split_first().ok_or("it is empty")?;
    if first & 0xf0 != magic || first & 15 > newest {
        return Err(format!(
            "its codec {first:#04x} is not known ({:#04x} is); pack it with an older gltfpack",
            magic | newest
        ));
    }
    let end = rest.len().checked_sub(tail).ok_or("its data ends early")?;
    Ok((first & 15, Bytes(&rest[..end]), &rest[end..]))
}

fn vertices(data: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, String> {
    if stride == 0 || stride > 256 || stride % 4 != 0 {
        return Err(format!("a vertex has a multiple of 4 bytes, up to 256, not {stride}"));
    }
    let (_, mut bytes, tail) = between(data, 0xa0, 0, stride.max(TAIL))?;
    let mut last = tail[tail.len() - stride..].to_vec();
    let block = (BLOCK_BYTES / stride / GROUP * GROUP).min(BLOCK_VERTICES);
    let mut out = vec![0_u8; count * stride];
    let mut deltas = [0_u8; BLOCK_VERTICES];
    for part in out.chunks_mut(block * stride) {
        let n = part.len() / stride;
        let groups = n.div_ceil(GROUP);
        for k in 0..stride {
            let header = bytes.take(groups.div_ceil(4))?;
            for (g, group) in deltas.chunks_exact_mut(GROUP).take(groups).enumerate() {
                let bits = [0, 2, 4, 8][usize::from(header[g / 4] >> (g % 4 * 2) & 3)];
                unpack_group(&mut bytes, group, bits)?;
            }
            for (i, delta) in deltas[..n].iter().enumerate() {
                last[k] = last[k].wrapping_add(delta >> 1 ^ (delta & 1).wrapping_neg());
                part[i * stride + k] = last[k];
            }
        }
    }
    bytes.end()?;
    Ok(out)
}

/// Reads 16 numbers of so many bits each, the highest first; if all bits are set, the number follows in a byte.
fn unpack_group(bytes: &mut Bytes<'_>, group: &mut [u8], bits: usize) -> Result<(), String> {
    match bits {
        0 => group.fill(0),
        8 => group.copy_from_slice(bytes.take(GROUP)?),
        _ => {
            let packed = bytes.take(GROUP * bits / 8)?;
            let most = (1_u8 << bits) - 1;
            for (i, value) in group.iter_mut().enumerate() {
                let shift = 8 - bits - i * bits % 8;
                let short = packed[i * bits / 8] >> shift & most;
                *value = if short == most { bytes.byte()? } else { short };
            }
        }
    }
    Ok(())
}

/// Ring of the last 16 values, the newest at 0.
struct Recent<T>([T; 16], usize);

impl<T: Copy> Recent<T> {
    fn push(&mut self, value: T) {
        self.0[self.1 & 15] = value;
        self.1 = self.1.wrapping_add(1);
    }

    fn at(&self, back: u8) -> T {
        self.0[self.1.wrapping_sub(1 + usize::from(back)) & 15]
    }
}

fn triangles(data: &[u8], count: usize) -> Result<Vec<u32>, String> {
    let (version, mut bytes, table) = between(data, 0xe0, 1, TABLE)?;
    if count % 3 != 0 {
        return Err(format!("{count} indices are no triangles"));
    }
    let codes = bytes.take(count / 3)?;
    let mut out = Vec::with_capacity(count);
    let (mut edges, mut seen) = (Recent([[u32::MAX; 2]; 16], 0), Recent([u32::MAX; 16], 0));
    let (mut next, mut last) = (0_u32, 0_u32);
    let plain = if version > 0 { 13 } else { 15 };
    let new = |next: &mut u32| {
        *next = next.wrapping_add(1);
        next.wrapping_sub(1)
    };
    for &code in codes {
        let (high, low) = (code >> 4, code & 15);
        if high < 15 {
            let [a, b] = edges.at(high);
            let c = match low {
                0 => new(&mut next),
                _ if low < plain => seen.at(low),
                _ => {
                    // 13 and 14 are the index before and after the last explicit one.
                    last = match low {
                        13 => last.wrapping_sub(1),
                        14 => last.wrapping_add(1),
                        _ => bytes.after(last)?,
                    };
                    last
                }
            };
            out.extend([a, b, c]);
            if low == 0 || low >= plain {
                seen.push(c);
            }
            edges.push([c, b]);
            edges.push([a, c]);
            continue;
        }
        // Vertices of a triangle without a known edge: new, seen, or explicit.
        let (first, pair) = match low {
            14 => (0, bytes.byte()?),
            15 => (15, bytes.byte()?),
            _ => (0, table[usize::from(low)]),
        };
        if low >= 14 && pair == 0 {
            next = 0;
        }
        let marks = [first, pair >> 4, pair & 15];
        let is_told = |mark: u8| mark == 15 && low >= 14;
        let mut triangle = [0; 3];
        for (i, mark) in marks.into_iter().enumerate() {
            triangle[i] = match mark {
                0 => new(&mut next),
                _ if is_told(mark) => 0,
                // Counted before the vertices of this triangle are remembered.
                _ => seen.at(mark - 1),
            };
        }
        for (vertex, _) in triangle.iter_mut().zip(marks).filter(|(_, mark)| is_told(*mark)) {
            last = bytes.after(last)?;
            *vertex = last;
        }
        out.extend(triangle);
        let [a, b, c] = triangle;
        triangle
            .into_iter()
            .zip(marks)
            .filter(|(_, mark)| *mark == 0 || is_told(*mark))
            .for_each(|(v, _)| seen.push(v));
        [[b, a], [c, b], [a, c]].into_iter().for_each(|edge| edges.push(edge));
    }
    bytes.end()?;
    Ok(out)
}

fn indices(data: &[u8], count: usize) -> Result<Vec<u32>, String> {
    let (_, mut bytes, _) = between(data, 0xd0, 1, INDEX_TAIL)?;
    let mut last = [0_u32; 2];
    let mut out = Vec::with_capacity(count.min(bytes.0.len()));
    for _ in 0..count {
        let number = bytes.number()?;
        let (which, number) = ((number & 1) as usize, number >> 1);
        last[which] = last[which].wrapping_add(number >> 1 ^ (number & 1).wrapping_neg());
        out.push(last[which]);
    }
    bytes.end()?;
    Ok(out)
}

#[cfg(test)]
mod tests;
