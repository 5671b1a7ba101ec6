//! LangSplat's arrays of masks and vectors, valid and broken.

use super::*;
use crate::io::labels::nested::NO_MASK;
use crate::io::results::numpy;
use crate::io::results::numpy::tests::npy;

const W: usize = 20;
const H: usize = 10;

/// A level of columns: masks of whole columns, -1 elsewhere.
fn level(masks: &[(i32, std::ops::Range<usize>)]) -> Vec<i32> {
    let of = |x: usize| masks.iter().find(|(_, columns)| columns.contains(&x)).map_or(-1, |m| m.0);
    (0..W * H).map(|i| of(i % W)).collect()
}

/// Three masks large, medium and small: a doll with an eye, and a cup at the medium level.
fn levels() -> [Vec<i32>; 4] {
    [level(&[(0, 0..20)]), level(&[(1, 2..5)]), level(&[(2, 12..18)]), level(&[(3, 0..10)])]
}

fn masks(levels: &[Vec<i32>; 4]) -> Vec<u8> {
    let data: Vec<u8> = levels.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    npy("<i4", &[4, H, W], &data)
}

/// Vectors of 16-bit floats: the n-th has a one at n.
fn vectors(count: usize, dimension: usize) -> Vec<u8> {
    let one = |i: usize| half::f16::from_f32(f32::from(u8::from(i / dimension == i % dimension)));
    let data: Vec<u8> = (0..count * dimension).flat_map(|i| one(i).to_le_bytes()).collect();
    npy("<f2", &[count, dimension], &data)
}

/// A folder with these files of the photo `a`.
fn folder(masks: &[u8], vectors: Option<&[u8]>) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("folder");
    fs::write(folder.path().join("a_s.npy"), masks).expect("write");
    vectors.into_iter().for_each(|v| fs::write(folder.path().join("a_f.npy"), v).expect("write"));
    folder
}

fn text(result: Result<impl Sized, IoError>) -> String {
    result.err().expect("refused").to_string()
}

#[test]
fn levels_are_objects_and_their_parts_with_vectors() {
    let folder = folder(&masks(&levels()), Some(&vectors(4, 512)));
    let labels = Labels::open(folder.path()).expect("labels");
    assert_eq!(labels.encoder(), Some("clip-vit-b16"));
    let a = photo("images/a.jpg", W as u32, H as u32);
    let regions = labels.of(&a, 4096).expect("regions");
    let found: Vec<_> = regions.iter().map(|r| (r.level, r.parent, r.mask.area(), r.name.as_str())).collect();
    let [object, part] = [Some(Level::Object), Some(Level::Part)];
    assert_eq!(found, [(object, None, 100, ""), (object, None, 60, ""), (part, Some(0), 30, "")]);
    // At half the size, in the order small, medium, large.
    let read = labels.vectors(&a, 10).expect("read").expect("vectors");
    let row: Vec<Vec<u16>> = read.levels.iter().map(|level| level[..10].to_vec()).collect();
    let none = NO_MASK;
    assert_eq!(row[0], [none, 1, none, none, none, none, none, none, none, none]);
    assert_eq!(row[1], [none, none, none, none, none, none, 2, 2, 2, none]);
    assert_eq!(row[2][..6], [3, 3, 3, 3, 3, none]);
    assert_eq!((read.levels[0].len(), read.of(2)[2], read.of(2)[1]), (50, 1.0, 0.0));
    // The folder around it is known by its name; a photo without files has no labels.
    let whole = tempfile::tempdir().expect("folder");
    let inner = whole.path().join("language_features");
    fs::create_dir(&inner).expect("folder");
    fs::copy(folder.path().join("a_s.npy"), inner.join("a_s.npy")).expect("copied");
    let labels = Labels::of_photos(whole.path(), &[a.clone(), photo("b.jpg", 20, 10)]).expect("labels");
    assert!(labels.has(&a) && !labels.has(&photo("b.jpg", 20, 10)) && !labels.has(&photo("a_s.png", 20, 10)));
    assert_eq!((labels.encoder(), labels.vectors(&a, 20).expect("read").is_none()), (None, true), "no vectors");
    assert_eq!(labels.of(&a, 20).expect("regions").len(), 3);
}

#[test]
fn the_default_level_counts_only_where_the_others_are_empty() {
    let nothing = || level(&[]);
    let only = [level(&[(0, 0..4), (1, 6..9)]), nothing(), nothing(), nothing()];
    let of = |levels: &[Vec<i32>; 4]| {
        let folder = folder(&masks(levels), None);
        let labels = Labels::open(folder.path()).expect("labels");
        labels.of(&photo("a.png", 20, 10), 20).expect("regions").iter().map(|r| r.mask.area()).collect::<Vec<_>>()
    };
    assert_eq!(of(&only), [40, 30]);
    let [_, small, ..] = levels();
    assert_eq!(of(&[only[0].clone(), small, nothing(), nothing()]), [30], "the control");
    assert_eq!(of(&[nothing(), nothing(), nothing(), nothing()]), [0; 0]);
}

#[test]
fn fractions_are_read_as_numbers_and_what_is_none_is_refused() {
    let values = |v: f32| {
        let mut data: Vec<f32> = levels().iter().flatten().map(|v| *v as f32).collect();
        data[2 * W * H + 3] = v;
        let data: Vec<u8> = data.into_iter().flat_map(f32::to_le_bytes).collect();
        let folder = folder(&npy("<f4", &[4, H, W], &data), None);
        Labels::open(folder.path()).expect("labels").of(&photo("a.png", 20, 10), 20)
    };
    assert_eq!(values(2.0).expect("regions").len(), 3);
    for bad in [1.5, f32::NAN, 4096.0, f32::INFINITY] {
        let text = text(values(bad));
        assert!(text.contains("a_s.npy") && text.contains("level 2, row 0, column 3"), "{text}");
    }
}

#[test]
fn arrays_that_do_not_fit_are_refused_by_name() {
    let good = masks(&levels());
    let read = |masks: &[u8], vectors: Option<&[u8]>, w: u32, h: u32| {
        let folder = folder(masks, vectors);
        let labels = Labels::open(folder.path())?;
        let photo = photo("a.png", w, h);
        labels.of(&photo, 64)?;
        labels.vectors(&photo, 64)
    };
    assert!(read(&good, Some(&vectors(4, 512)), 20, 10).expect("read").is_some());
    assert!(
        read(&good, Some(&vectors(9, 512)), 40, 20).is_ok(),
        "a copy of half the size, and vectors of hidden masks"
    );
    let few = text(read(&good, Some(&vectors(3, 512)), 20, 10));
    assert!(few.contains("a_f.npy") && few.contains("3 vectors") && few.contains("up to 3"), "{few}");
    let compressed = text(read(&good, Some(&vectors(4, 3)), 20, 10));
    assert!(compressed.contains("autoencoder") && compressed.contains("language_features"), "{compressed}");
    assert!(text(read(&good, Some(&vectors(4, 768)), 20, 10)).contains("[4, 768]"));
    assert!(matches!(read(&good, None, 25, 10), Err(IoError::PhotoSize { .. })));
    let three = npy("<i4", &[3, H, W], &vec![0; 12 * W * H]);
    assert!(text(read(&three, None, 20, 10)).contains("[4, height, width]"));
    let empty = npy("<i4", &[4, 0, 20], &[]);
    assert!(matches!(read(&empty, None, 20, 10), Err(IoError::EmptyPicture { .. })));
    let claims = npy("<i4", &[4, 1_000_000, 1_000_000], &[0; 16]);
    assert!(text(read(&claims, None, 20, 10)).contains("does not fit"));
    let mut endless = vectors(4, 512);
    let at = endless.len() - 2;
    endless[at..].copy_from_slice(&[0x00, 0x7c]);
    assert!(text(read(&good, Some(&endless), 20, 10)).contains("vector 3 is not finite"));
    let cut = &good[..good.len() - 1];
    assert!(text(read(cut, None, 20, 10)).contains("does not fit"));
}

#[test]
fn compressed_vectors_are_decoded_by_the_autoencoder_beside() {
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/results/langsplat");
    let expected =
        |name: &str| numpy::parse(fs::read(samples.join("expected").join(name)).expect(name)).expect(name).floats();
    let whole = tempfile::tempdir().expect("folder");
    let inner = whole.path().join("made_up/language_features_dim3");
    fs::create_dir_all(&inner).expect("folder");
    fs::write(inner.join("a_s.npy"), masks(&levels())).expect("write");
    let codes = expected("codes_1.npy");
    let codes: Vec<f32> = codes[..12].chunks(3).flat_map(|c| crate::math::vector::unit(c).expect("not zero")).collect();
    let data: Vec<u8> = codes.iter().flat_map(|v| v.to_le_bytes()).collect();
    fs::write(inner.join("a_f.npy"), npy("<f4", &[4, 3], &data)).expect("write");
    let data_set = whole.path().join("made_up");
    let refused = text(Labels::open(&data_set));
    assert!(refused.contains("autoencoder/ckpt/made_up/best_ckpt.pth"), "{refused}");
    let autoencoder = whole.path().join("autoencoder/ckpt/made_up");
    fs::create_dir_all(&autoencoder).expect("folder");
    fs::copy(samples.join("autoencoder/ckpt/made_up/best_ckpt.pth"), autoencoder.join("best_ckpt.pth"))
        .expect("copied");
    let labels = Labels::open(&data_set).expect("labels");
    let read = labels.vectors(&photo("a.png", 20, 10), 20).expect("read").expect("vectors");
    let far = |wanted: &[f32]| {
        let off = |mask: usize| read.of(mask as u16).iter().zip(&wanted[512 * mask..]).map(|(a, b)| (a - b).abs());
        (0..4).flat_map(off).fold(0.0, f32::max)
    };
    assert!(far(&expected("decoded_first_rows_1.npy")) < 1e-4);
    assert!(far(&expected("decoded_first_rows_2.npy")) > 1e-3, "the control: codes of another level");
}
