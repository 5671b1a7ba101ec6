//! Tests of values beside the tensors, and of tensors in blocks.

use std::io::Write;

use super::written::{Saved, saved};
use super::*;

fn open(value: &Saved) -> Result<WeightFile, WeightFileError> {
    read(&saved(value))
}

fn read(bytes: &[u8]) -> Result<WeightFile, WeightFileError> {
    let mut file = tempfile::tempfile().expect("a file");
    file.write_all(bytes).expect("written");
    file.seek(SeekFrom::Start(0)).expect("turned back");
    WeightFile::read(file)
}

#[test]
fn numbers_and_texts_beside_the_tensors_are_found_by_their_path() {
    let scalar = |module, dtype, bytes: &[u8]| Saved::Scalar(module, dtype, bytes.to_vec());
    let (old, new) = ("numpy.core.multiarray", "numpy._core.multiarray");
    let file = open(&Saved::Tuple(vec![
        Saved::Tuple(vec![
            Saved::Int(3),
            Saved::Tensor(vec![2], vec![1.0, 2.0]),
            Saved::Nothing,
            scalar(old, "f8", &1.375_f64.to_le_bytes()),
            scalar(new, "f4", &(-0.25_f32).to_le_bytes()),
            scalar(new, "i8", &(-7_i64).to_le_bytes()),
            scalar(old, "i2", &(-300_i16).to_le_bytes()),
            scalar(old, "u1", &[200]),
            scalar(old, "b1", &[1]),
        ]),
        Saved::dict([
            ("step", Saved::Int(-30_000)),
            ("rate", Saved::Float(0.1)),
            ("a.b", Saved::dict([("c.d", Saved::Text("deep".into()))])),
            ("ok", Saved::Bool(true)),
            ("all", Saved::List(vec![Saved::Nothing; 4])),
        ]),
    ]))
    .expect("opens");
    let tree = &file.tree;
    let numbers: Vec<Option<f64>> = (0..9).map(|k| tree.number(&format!("0.{k}"))).collect();
    let expected = [Some(3.0), None, None, Some(1.375), Some(-0.25), Some(-7.0), Some(-300.0), Some(200.0), Some(1.0)];
    assert_eq!(numbers, expected);
    let of = |key| tree.number(&format!("1.{key}"));
    assert_eq!([of("step"), of("rate"), of("ok"), of("nothing")], [Some(-30_000.0), Some(0.1), Some(1.0), None]);
    assert_eq!((tree.text("1.a.b.c.d"), tree.text("1.a.b"), tree.text("1.a.b.c")), (Some("deep"), None, None));
    assert_eq!(
        [tree.length(""), tree.length("0"), tree.length("1.all"), tree.length("1.step")],
        [Some(2), Some(9), Some(4), None]
    );
    assert_eq!(tree.keys("1"), ["step", "rate", "a.b", "ok", "all"]);
    assert_eq!(file.tensors.keys().collect::<Vec<_>>(), ["0.1"]);
}

#[test]
fn numbers_of_numpy_of_another_size_or_order_are_refused() {
    let of = |dtype, bytes: &[u8]| open(&Saved::Scalar("numpy.core.multiarray", dtype, bytes.to_vec()));
    assert!(of("f8", &[0; 8]).is_ok());
    for (dtype, length) in [("f8", 4), ("f8", 9), ("f3", 3), ("O8", 8), ("U1", 4), ("", 0), ("f", 0), ("f0", 0)] {
        let error = of(dtype, &vec![0; length]).err().expect("refused").to_string();
        assert!(error.contains("number of NumPy"), "{dtype}: {error}");
    }
    let turned = b"cnumpy\ndtype\nX\x02\0\0\0f8\x85R(K\x03X\x01\0\0\0>tb".to_vec();
    assert!(open(&Saved::Raw(turned)).err().expect("turned").to_string().contains("little-endian"));
    let other = b"cnumpy\nload\nX\x01\0\0\0x\x85R".to_vec();
    assert!(open(&Saved::Raw(other)).err().expect("no").to_string().contains("numpy.load"));
    // A module that is its own attributes.
    let own = b"c__torch__\nM\n)\x81q\0h\0b".to_vec();
    let error = open(&Saved::Raw(own)).err().expect("endless").to_string();
    assert!(error.contains("levels"), "{error}");
}

#[test]
fn blocks_are_the_whole_tensor_and_damage_is_told_at_the_end() {
    let values: Vec<f32> = (0..35).map(|k| k as f32 / 8.0).collect();
    let tree = Saved::dict([
        ("t", Saved::Tensor(vec![7, 5], values.clone())),
        ("none", Saved::Tensor(vec![0, 5], Vec::new())),
        ("ids", Saved::Whole(vec![3], vec![-1, 0, 1 << 40])),
    ]);
    let bytes = saved(&tree);
    let mut file = read(&bytes).expect("opens");
    for rows in [1, 2, 7, 100] {
        let mut got = Vec::new();
        file.blocks("t", rows, &mut |first, part| {
            assert_eq!((first * 5, part.len() % 5), (got.len(), 0));
            assert!(part.len() <= rows * 5);
            got.extend_from_slice(part);
        })
        .expect("read");
        assert_eq!(got, values, "{rows}");
    }
    file.blocks("none", 4, &mut |_, part| assert!(part.is_empty())).expect("nothing");
    assert_eq!(file.floats("none").expect("none"), [0.0; 0]);
    assert_eq!(file.integers("ids").expect("whole"), [-1, 0, 1 << 40]);
    assert!(file.integers("t").is_err() && file.blocks("ids", 1, &mut |_, _| {}).is_err());
    // One bit of a number: the checksum tells it.
    let at = bytes.windows(8).position(|w| w == [0_u8, 0, 0, 0x3e, 0, 0, 0x80, 0x3e]).expect("1/8, 2/8");
    let mut damaged = bytes.clone();
    damaged[at] ^= 1;
    let error = read(&damaged).expect("the list is sound").blocks("t", 2, &mut |_, _| {}).expect_err("damaged");
    assert!(error.to_string().contains("damaged"), "{error}");
}

#[test]
fn what_is_not_asked_for_is_not_read_and_what_repeats_is_refused() {
    let tree = |optimizer| Saved::Tuple(vec![Saved::Tensor(vec![2], vec![1.0, 2.0]), optimizer]);
    let mut bytes = saved(&tree(Saved::Tensor(vec![4], vec![9.0; 4])));
    let at = bytes.windows(4).position(|w| w == 9.0_f32.to_le_bytes()).expect("there");
    bytes[at] ^= 1;
    let mut file = read(&bytes).expect("opens");
    assert_eq!(file.floats("0").expect("sound"), [1.0, 2.0]);
    assert!(file.floats("1").is_err(), "the control");
    assert!(open(&tree(Saved::Missing)).err().expect("missing").to_string().contains("not in the archive"));
    // A stride of zero: 2^30 values of one.
    let pickle = b"ctorch._utils\n_rebuild_tensor_v2\n((X\x07\0\0\0storagectorch\nFloatStorage\nX\x01\0\0\x000X\x03\0\0\0cpuK\x01tQK\0J\0\0\0\x40\x85K\0\x85N)tR";
    let whole = Saved::Tuple(vec![Saved::Tensor(vec![1], vec![1.0]), Saved::Raw(pickle.to_vec())]);
    let mut file = open(&whole).expect("opens");
    assert_eq!(file.tensors["1"].shape, [1 << 30]);
    for error in [file.floats("1").expect_err("floats"), file.blocks("1", 9, &mut |_, _| {}).expect_err("blocks")] {
        assert!(error.to_string().contains("repeats"), "{error}");
    }
    assert_eq!(file.floats("0").expect("sound"), [1.0]);
}

#[test]
fn a_storage_is_never_larger_than_its_file() {
    let of = |claimed| saved(&Saved::dict([("t", Saved::Claimed(claimed, vec![0.5; 4]))]));
    assert!(read(&of(4)).is_ok());
    // Pickle and directory agree on 4 MiB that are not there.
    let mut lying = of(1 << 20);
    let entries: Vec<usize> = (0..lying.len() - 4).filter(|i| lying[*i..].starts_with(b"PK\x01\x02")).collect();
    assert_eq!(entries.len(), 4);
    for field in [20, 24] {
        lying[entries[2] + field..][..4].copy_from_slice(&(4_u32 << 20).to_le_bytes());
    }
    let error = read(&lying).err().expect("refused").to_string();
    assert!(error.contains("in a file of") || error.contains("archive is broken"), "{error}");
    assert!(read(&of(1 << 20)).err().expect("refused").to_string().contains("has 16 bytes"));
}
