//! ONNX files with one graph, as the built-in engine needs them. Filled templates have many `graph` fields one after
//! another, which are one graph by the rules of protocol buffers (see [`super::template`]).

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

/// `ModelProto.graph` of ONNX.
const GRAPH: u64 = 7;
/// Bytes of an attribute that requests cubic resizing.
const CUBIC: &[u8] = b"\x22\x05cubic";
/// Graphs that are longer hold weights, not operations.
const SEARCHED_BYTES: u64 = 16 << 20;

/// Reads a network file and merges its graphs into one.
///
/// # Errors
/// If it cannot be read, is no protocol buffers message, or has an operation that the built-in engine gets wrong.
pub(super) fn with_one_graph(path: &Path) -> Result<Vec<u8>, String> {
    let mut file = File::open(path).map_err(|e| e.to_string())?;
    let length = file.metadata().map_err(|e| e.to_string())?.len();
    join(&mut file, length).map_err(|e| match e.kind() {
        io::ErrorKind::UnexpectedEof => "it ends too early".to_owned(),
        _ => e.to_string(),
    })
}

/// Refuses graphs with cubic resizing: the built-in engine would resize linearly instead.
pub(super) fn refuse_cubic(graph: &[u8]) -> Result<(), String> {
    match graph.windows(CUBIC.len()).any(|w| w == CUBIC) {
        true => Err("it resizes by cubic curves, which this engine cannot".into()),
        false => Ok(()),
    }
}

fn join(file: &mut (impl Read + Seek), length: u64) -> io::Result<Vec<u8>> {
    // Ranges of the file: other fields are copied whole, of graphs only the content.
    let (mut others, mut graphs) = (Vec::new(), Vec::new());
    let mut at = 0;
    while at < length {
        file.seek(SeekFrom::Start(at))?;
        let mut head = Vec::new();
        let key = varint(file, &mut head)?;
        let body = match key & 7 {
            0 => varint(file, &mut head).map(|_| 0)?,
            1 => 8,
            2 => varint(file, &mut head)?,
            5 => 4,
            _ => return Err(io::Error::other("it is no ONNX file")),
        };
        let begin = at + head.len() as u64;
        let end = begin.checked_add(body).filter(|end| *end <= length).ok_or(io::ErrorKind::UnexpectedEof)?;
        if key == GRAPH << 3 | 2 {
            graphs.push(begin..end)
        } else {
            others.push(at..end)
        }
        at = end;
    }
    let size = graphs.iter().map(|g| g.end - g.start).sum::<u64>();
    let mut bytes = Vec::with_capacity(usize::try_from(length).unwrap_or(0));
    let mut copy = |bytes: &mut Vec<u8>, range: &std::ops::Range<u64>| -> io::Result<()> {
        file.seek(SeekFrom::Start(range.start))?;
        let first = bytes.len();
        let copied = Read::by_ref(file).take(range.end - range.start).read_to_end(bytes)?;
        if copied as u64 != range.end - range.start {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        if copied as u64 <= SEARCHED_BYTES {
            refuse_cubic(&bytes[first..]).map_err(io::Error::other)?;
        }
        Ok(())
    };
    for range in &others {
        copy(&mut bytes, range)?;
    }
    bytes.push((GRAPH << 3 | 2) as u8);
    let mut left = size;
    while left >= 0x80 {
        bytes.push(left as u8 | 0x80);
        left >>= 7;
    }
    bytes.push(left as u8);
    for range in &graphs {
        copy(&mut bytes, range)?;
    }
    Ok(bytes)
}

/// Reads a variable-length number of one to ten bytes, which are appended to `read`.
fn varint(file: &mut impl Read, read: &mut Vec<u8>) -> io::Result<u64> {
    let mut number = 0;
    for shift in (0..64).step_by(7) {
        let mut byte = [0];
        file.read_exact(&mut byte)?;
        read.push(byte[0]);
        number |= u64::from(byte[0] & 0x7f) << shift;
        if byte[0] < 0x80 {
            return Ok(number);
        }
    }
    Err(io::Error::other("it is no ONNX file"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joined(bytes: &[u8]) -> io::Result<Vec<u8>> {
        join(&mut io::Cursor::new(bytes), bytes.len() as u64)
    }

    #[test]
    fn graphs_are_joined_and_the_rest_stays() {
        // A version, a graph, a name, a graph.
        let parts = [8, 3, 0x3a, 2, 10, 0, 0x12, 1, b'x', 0x3a, 3, 0x2a, 1, 7];
        assert_eq!(joined(&parts).expect("sound"), [8, 3, 0x12, 1, b'x', 0x3a, 5, 10, 0, 0x2a, 1, 7]);
        let long = [vec![0x3a, 0xac, 2], vec![1; 300]].concat();
        assert_eq!(joined(&long).expect("sound"), long);
    }

    #[test]
    fn what_is_cut_short_no_onnx_or_cubic_is_refused() {
        for bad in
            [&[0x3a, 5, 1][..], &[0x3a], &[0x3b], &[0x3a, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 1]]
        {
            assert!(joined(bad).is_err(), "{bad:?}");
        }
        let cubic = [&[0x3a, 7][..], CUBIC].concat();
        assert!(joined(&cubic).expect_err("refused").to_string().contains("cubic"));
    }
}
