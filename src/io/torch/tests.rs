//! Files written by the official code (`tools/export/fixture_checkpoints.py`), and hostile ones.

use std::io::{Cursor, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::*;

fn fixture(name: &str) -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/networks").join(name);
    std::fs::read(path).expect("a fixture")
}

fn open(bytes: &[u8]) -> Result<WeightFile, WeightFileError> {
    let mut file = tempfile::tempfile().expect("a file");
    file.write_all(bytes).expect("written");
    file.seek(SeekFrom::Start(0)).expect("turned back");
    WeightFile::read(file)
}

/// Returns `n` numbers; the k-th is k / 8.
fn counted(n: u16) -> Vec<f32> {
    (0..n).map(|k| f32::from(k) / 8.0).collect()
}

#[test]
fn every_kind_of_number_and_layout_is_read() {
    let mut file = open(&fixture("tiny.pt")).expect("opens");
    for (name, shape, n) in [
        ("single", vec![2, 3], 6),
        ("half", vec![7], 7),
        ("brain", vec![2, 2], 4),
        ("double", vec![3], 3),
        ("parameter", vec![4], 4),
    ] {
        let name = format!("model.{name}");
        assert_eq!(file.tensors[&name].shape, shape, "{name}");
        assert_eq!(file.floats(&name).expect("numbers"), counted(n), "{name}");
    }
    // A transposed 4 x 6 table, and a slice of the table: both share one storage.
    let whole = counted(24);
    let turned: Vec<f32> = (0..24).map(|i| whole[i % 4 * 6 + i / 4]).collect();
    let piece: Vec<f32> = (0..6).map(|i| whole[(1 + i / 3) * 6 + 2 + i % 3]).collect();
    assert_eq!(file.tensors["model.turned"].shape, [6, 4]);
    assert_eq!(file.floats("model.turned").expect("numbers"), turned);
    assert_eq!(file.floats("model.piece").expect("numbers"), piece);
    assert_ne!(turned, whole, "the control");
    assert_eq!(file.floats("model.scalar").expect("a number"), [0.5]);
    assert_eq!(file.tensors["model.count"].dtype, Dtype::Whole(8));
    let error = file.floats("model.count").expect_err("whole numbers").to_string();
    assert!(error.contains("model.count") && error.contains("whole numbers"), "{error}");
    assert_eq!(file.tensors.len(), 9, "{:?}", file.tensors.keys());
}

#[test]
fn torch_script_and_safetensors_are_read() {
    let mut file = open(&fixture("tiny_script.pt")).expect("opens");
    assert_eq!(file.tensors.keys().collect::<Vec<_>>(), ["inner.steps", "inner.weight", "scale"]);
    assert_eq!(
        (&file.tensors["inner.weight"].shape[..], file.tensors["inner.weight"].dtype),
        (&[3, 4][..], Dtype::F16)
    );
    assert_eq!(file.floats("inner.weight").expect("numbers"), counted(12));
    assert_eq!(file.floats("scale").expect("numbers"), counted(5));
    let mut file = open(&fixture("tiny.safetensors")).expect("opens");
    for (name, n) in [("single", 6), ("half", 7), ("brain", 4), ("double", 3), ("parameter", 4)] {
        assert_eq!(file.floats(name).expect("numbers"), counted(n), "{name}");
    }
    assert!(file.floats("count").is_err() && file.floats("none").is_err());
}

/// Reads every float tensor.
fn all(bytes: &[u8]) -> Result<usize, WeightFileError> {
    let mut file = open(bytes)?;
    let floats: Vec<String> = file.tensors.iter().filter(|(_, t)| t.dtype.is_float()).map(|(n, _)| n.clone()).collect();
    floats.iter().try_for_each(|name| file.floats(name).map(drop))?;
    Ok(floats.len())
}

#[test]
fn a_file_that_was_cut_off_is_refused_wherever_it_ends() {
    for (name, tensors) in [("tiny.pt", 8), ("tiny_script.pt", 2), ("tiny.safetensors", 6), ("clip.pt", 62)] {
        let bytes = fixture(name);
        assert_eq!(all(&bytes).expect("whole"), tensors, "{name}");
        for i in 0..50 {
            let length = bytes.len() * i / 50;
            assert!(all(&bytes[..length]).is_err(), "{name} ends after {length} bytes");
        }
        assert!(all(&bytes[..bytes.len() - 1]).is_err(), "{name}");
    }
}

#[test]
fn no_changed_byte_makes_it_fail_otherwise_than_by_an_error() {
    for name in ["tiny.pt", "tiny_script.pt", "tiny.safetensors"] {
        let whole = fixture(name);
        let mut refused = 0;
        for at in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[at] ^= 1 << (at % 8);
            refused += usize::from(all(&bytes).is_err());
        }
        assert!(refused > whole.len() / 4, "{name}: {refused} of {}", whole.len());
    }
}

fn archive(entries: &[(&str, &[u8])], method: CompressionMethod) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in entries {
        zip.start_file(*name, SimpleFileOptions::default().compression_method(method)).expect("started");
        zip.write_all(bytes).expect("written");
    }
    zip.finish().expect("finished").into_inner()
}

/// Error for a pickle of these opcodes.
fn refused(pickle: &[u8]) -> String {
    let bytes = archive(&[("x/data.pkl", pickle), ("x/data/0", &[0; 16])], CompressionMethod::Stored);
    all(&bytes).expect_err("refused").to_string()
}

#[test]
fn nothing_but_tensors_is_asked_for() {
    for (pickle, says) in [
        (&b"\x80\x02cposix\nsystem\nX\x02\0\0\0id\x85R."[..], "posix.system"),
        (b"\x80\x04\x8c\x08builtins\x8c\x04eval\x93\x8c\x011\x85R.", "builtins.eval"),
        (b"\x80\x02ctorch\nload\nX\x01\0\0\0x\x85R.", "torch.load"),
        (b"\x80\x02ctorch._utils\n_rebuild_tensor\n.", "_rebuild_tensor"),
        (b"(iposix\nsystem\n.", "opcode 0x69"),
        (b"\x80\x02c__torch__\nM\n)R.", "no function"),
        (b"\x80\x02ccollections\nOrderedDict\n)\x81.", "no module"),
        (b"\x80\x02X\xff\xff\xff\x7fab.", "its end"),
        (b"\x80\x02h\x05.", "not kept"),
        (b"\x80\x02e.", "not there"),
        (b"\x80\x02cposix", "without end"),
        (b"", "its end"),
    ] {
        let error = refused(pickle);
        assert!(error.contains(says), "{says}: {error}");
    }
}

#[test]
fn what_grows_or_never_ends_is_refused() {
    let deep = [&b"\x80\x02"[..], &[b']'; 200_000], &[b'a'; 199_999], b"."].concat();
    assert!(refused(&deep).contains("levels"));
    assert!(refused(b"\x80\x02]q\0h\0a.").contains("levels"), "a list in itself");
    // Every list contains the previous one twenty times.
    let mut laughs = b"\x80\x02]q\0".to_vec();
    for i in 1..60_u8 {
        laughs.extend([b']', b'q', i, b'(']);
        laughs.extend([b'h', i - 1].repeat(20));
        laughs.push(b'e');
    }
    laughs.push(b'.');
    assert!(refused(&laughs).contains("values"));
    assert!(refused(&vec![b'N'; 3 << 20]).contains("objects"));
    let name = [&b"\x80\x02}X\x00\x10\0\0"[..], &[b'n'; 4096], b"]s."].concat();
    assert!(refused(&name).contains("letters"));
    let large = archive(&[("x/data.pkl", &vec![b'N'; 9 << 20])], CompressionMethod::Stored);
    assert!(all(&large).expect_err("large").to_string().contains("more than"));
    let bomb = archive(&[("x/data.pkl", &vec![b'N'; 9 << 20])], CompressionMethod::Deflated);
    assert!(bomb.len() < 1 << 16);
    assert!(all(&bomb).expect_err("a bomb").to_string().contains("compressed"));
}

#[test]
fn headers_of_safetensors_are_not_believed() {
    let with = |stated: u64, header: &str, body: usize| {
        [&stated.to_le_bytes()[..], header.as_bytes(), &vec![0; body]].concat()
    };
    let of = |header: &str, body: usize| with(header.len() as u64, header, body);
    let tensor = |shape: &str, from: u64, to: u64| {
        format!(r#"{{"t":{{"dtype":"F32","shape":[{shape}],"data_offsets":[{from},{to}]}}}}"#)
    };
    assert_eq!(all(&of(&tensor("2,2", 0, 16), 16)).expect("sound"), 1);
    let huge = u64::MAX.to_string();
    for (what, bytes) in [
        ("a header longer than the file", with(1 << 20, "{", 16)),
        ("a header longer than memory", with(u64::MAX, "{", 16)),
        ("numbers beyond the file", of(&tensor("2,2", 0, 1 << 40), 16)),
        ("numbers that begin beyond the file", of(&tensor("2,2", 1 << 40, (1 << 40) + 16), 16)),
        ("an end before the beginning", of(&tensor("2,2", 16, 0), 16)),
        ("a shape larger than its numbers", of(&tensor("2,200", 0, 16), 16)),
        ("a shape that overflows", of(&tensor(&format!("{huge},{huge}"), 0, 16), 16)),
        ("a deep header", of(&format!("{}{}", r#"{"a":"#.repeat(5_000), "}".repeat(5_000)), 16)),
        ("no JSON", of("{\u{0}}", 16)),
    ] {
        assert!(all(&bytes).is_err(), "{what}");
    }
}

#[test]
fn sizes_in_an_archive_are_not_believed() {
    let pickle = tensor("0", 4, 0, &[2, 2], &[2, 1]);
    let sound = archive(&[("x/data.pkl", &pickle), ("x/data/0", &[7; 16])], CompressionMethod::Stored);
    assert_eq!(all(&sound).expect("sound"), 1);
    let entries: Vec<usize> = (0..sound.len() - 4).filter(|i| sound[*i..].starts_with(b"PK\x01\x02")).collect();
    assert_eq!(entries.len(), 2);
    // The storage's sizes in the directory at the end: packed, unpacked, both.
    for fields in [&[20][..], &[24], &[20, 24]] {
        for stated in [0_u32, 15, 17, u32::MAX - 1, u32::MAX] {
            let mut lying = sound.clone();
            for field in fields {
                lying[entries[1] + field..][..4].copy_from_slice(&stated.to_le_bytes());
            }
            assert!(all(&lying).is_err(), "{stated} at {fields:?}");
        }
    }
    // Two entries of one name, and many empty ones.
    let names: Vec<String> = (0..2_000).map(|i| format!("x/{i}")).collect();
    let many: Vec<(&str, &[u8])> = names.iter().map(|n| (&**n, &b""[..])).collect();
    assert!(matches!(all(&archive(&many, CompressionMethod::Stored)), Err(WeightFileError::Kind)));
}

/// Pickle of one tensor 't' of `shape` in the entry `key`.
fn tensor(key: &str, elements: u8, offset: u8, shape: &[u8], strides: &[u8]) -> Vec<u8> {
    let text = |s: &str| [&[b'X'][..], &(s.len() as u32).to_le_bytes(), s.as_bytes()].concat();
    let tuple = |n: &[u8]| [&b"("[..], &n.iter().flat_map(|n| [b'K', *n]).collect::<Vec<_>>(), b"t"].concat();
    let storage =
        [b"(", &text("storage")[..], b"ctorch\nFloatStorage\n", &text(key), &text("cpu"), &[b'K', elements], b"tQ"]
            .concat();
    let view = [&[b'K', offset][..], &tuple(shape), &tuple(strides), b"N)"].concat();
    [b"\x80\x02}", &text("t")[..], b"ctorch._utils\n_rebuild_tensor_v2\n(", &storage, &view, b"tRs."].concat()
}

#[test]
fn tensors_lie_within_what_is_stored_for_them() {
    let with = |pickle: Vec<u8>| archive(&[("x/data.pkl", &pickle), ("x/data/0", &[0; 16])], CompressionMethod::Stored);
    assert_eq!(all(&with(tensor("0", 4, 0, &[2, 2], &[2, 1]))).expect("sound"), 1);
    for (pickle, says) in [
        (tensor("0", 4, 1, &[2, 2], &[2, 1]), "reaches beyond"),
        (tensor("0", 4, 0, &[2, 2], &[200, 1]), "reaches beyond"),
        (tensor("0", 200, 0, &[2, 2], &[2, 1]), "has 16 bytes"),
        (tensor("0", 4, 0, &[2, 2], &[1]), "without storage or shape"),
        (tensor("0", 4, 0, &[1; 9], &[1; 9]), "without storage or shape"),
        (tensor("1", 4, 0, &[2, 2], &[2, 1]), "not in the archive"),
        (tensor("../../secret", 4, 0, &[2, 2], &[2, 1]), "no name of an entry"),
    ] {
        let error = all(&with(pickle)).expect_err(says).to_string();
        assert!(error.contains(says) && (error.contains("'t'") || error.contains("byte")), "{says}: {error}");
    }
    let sound = tensor("0", 4, 0, &[2, 2], &[2, 1]);
    let nan = archive(&[("x/data.pkl", &sound), ("x/data/0", &[0xff; 16])], CompressionMethod::Stored);
    assert!(all(&nan).expect_err("no numbers").to_string().contains("NaN at place 0"));
    let big =
        archive(&[("x/data.pkl", &sound), ("x/data/0", &[0; 16]), ("x/byteorder", b"big")], CompressionMethod::Stored);
    assert!(all(&big).expect_err("turned").to_string().contains("little-endian"));
    let other = archive(&[("readme.txt", b"hello")], CompressionMethod::Stored);
    for bytes in [&other[..], b"", b"\x80\x02cposix\nsystem\n", &[0; 100]] {
        assert!(matches!(all(bytes), Err(WeightFileError::Kind)));
    }
}
