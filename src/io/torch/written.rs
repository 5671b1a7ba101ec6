//! Checkpoints for tests, written as `torch.save` writes them.

use std::io::{Cursor, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// Value of a checkpoint to write.
#[derive(Clone)]
pub(crate) enum Saved {
    Nothing,
    Bool(bool),
    Int(i32),
    Float(f64),
    /// Number of NumPy: its module, its type, its bytes.
    Scalar(&'static str, &'static str, Vec<u8>),
    Text(String),
    Tuple(Vec<Saved>),
    List(Vec<Saved>),
    Dict(Vec<(String, Saved)>),
    Tensor(Vec<usize>, Vec<f32>),
    Whole(Vec<usize>, Vec<i64>),
    /// Tensor of so many numbers, and those that are stored for it.
    Claimed(usize, Vec<f32>),
    /// Tensor with a storage that is not in the file.
    Missing,
    /// Opcodes.
    Raw(Vec<u8>),
}

impl Saved {
    pub(crate) fn dict<const N: usize>(entries: [(&str, Saved); N]) -> Self {
        Self::Dict(entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect())
    }
}

/// Bytes of the file with this value.
pub(crate) fn saved(value: &Saved) -> Vec<u8> {
    let mut pickle = b"\x80\x02".to_vec();
    let mut storages = Vec::new();
    put(value, &mut pickle, &mut storages);
    pickle.push(b'.');
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    let mut entry = |name: &str, bytes: &[u8]| {
        zip.start_file(name, options).expect("started");
        zip.write_all(bytes).expect("written");
    };
    entry("archive/data.pkl", &pickle);
    entry("archive/byteorder", b"little");
    storages.iter().enumerate().for_each(|(k, bytes)| entry(&format!("archive/data/{k}"), bytes));
    entry("archive/version", b"3\n");
    zip.finish().expect("finished").into_inner()
}

fn text(text: &str) -> Vec<u8> {
    [&b"X"[..], &(text.len() as u32).to_le_bytes(), text.as_bytes()].concat()
}

fn tuple(lengths: &[usize]) -> Vec<u8> {
    let items: Vec<u8> = lengths.iter().flat_map(|n| int(*n as i32)).collect();
    [&b"("[..], &items, b"t"].concat()
}

fn int(n: i32) -> Vec<u8> {
    [&b"J"[..], &n.to_le_bytes()].concat()
}

/// A parameter on a GPU, as in a training.
fn tensor(class: &str, key: &str, shape: &[usize], count: usize) -> Vec<u8> {
    let mut strides = vec![1; shape.len()];
    for axis in (1..strides.len()).rev() {
        strides[axis - 1] = shape[axis] * strides[axis];
    }
    let hooks = b"ccollections\nOrderedDict\n)R";
    [
        &b"ctorch._utils\n_rebuild_parameter\n(ctorch._utils\n_rebuild_tensor_v2\n(("[..],
        &text("storage"),
        format!("ctorch\n{class}Storage\n").as_bytes(),
        &text(key),
        &text("cuda:0"),
        &int(count as i32),
        b"tQ",
        &int(0),
        &tuple(shape),
        &tuple(&strides),
        b"\x89",
        hooks,
        b"tR\x88",
        hooks,
        b"tR",
    ]
    .concat()
}

fn put(value: &Saved, out: &mut Vec<u8>, storages: &mut Vec<Vec<u8>>) {
    match value {
        Saved::Nothing => out.push(b'N'),
        Saved::Bool(b) => out.push(if *b { 0x88 } else { 0x89 }),
        Saved::Int(n) => out.extend(int(*n)),
        Saved::Float(x) => {
            out.push(b'G');
            out.extend(x.to_be_bytes());
        }
        Saved::Scalar(module, dtype, bytes) => {
            let letters: String = bytes.iter().map(|b| char::from(*b)).collect();
            out.extend(format!("c{module}\nscalar\n(cnumpy\ndtype\n(").as_bytes());
            out.extend(text(dtype));
            out.extend(b"\x89\x88tR(");
            out.extend([int(3), text("<"), b"NNN".to_vec(), int(-1), int(-1), int(0)].concat());
            out.extend(b"tbc_codecs\nencode\n(");
            out.extend([text(&letters), text("latin1")].concat());
            out.extend(b"tRtR");
        }
        Saved::Text(t) => out.extend(text(t)),
        Saved::Tuple(items) => {
            out.push(b'(');
            items.iter().for_each(|item| put(item, out, storages));
            out.push(b't');
        }
        Saved::List(items) => {
            out.extend(b"](");
            items.iter().for_each(|item| put(item, out, storages));
            out.push(b'e');
        }
        Saved::Dict(entries) => {
            out.extend(b"}(");
            for (key, value) in entries {
                out.extend(text(key));
                put(value, out, storages);
            }
            out.push(b'u');
        }
        Saved::Tensor(shape, values) => {
            out.extend(tensor("Float", &storages.len().to_string(), shape, values.len()));
            storages.push(values.iter().flat_map(|v| v.to_le_bytes()).collect());
        }
        Saved::Whole(shape, values) => {
            out.extend(tensor("Long", &storages.len().to_string(), shape, values.len()));
            storages.push(values.iter().flat_map(|v| v.to_le_bytes()).collect());
        }
        Saved::Claimed(n, values) => {
            out.extend(tensor("Float", &storages.len().to_string(), &[*n], *n));
            storages.push(values.iter().flat_map(|v| v.to_le_bytes()).collect());
        }
        Saved::Missing => out.extend(tensor("Float", "9999", &[1], 1)),
        Saved::Raw(opcodes) => out.extend(opcodes),
    }
}
