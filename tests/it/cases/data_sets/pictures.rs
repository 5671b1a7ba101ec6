//! Pictures of other formats, and data sets in an archive.

use std::fs;
use std::io::Write;
use std::path::Path;

use super::{Copy, info, refusal, right, warnings, warns};

/// Replaces the photos by ones of another format, and their names in the list if that is wanted.
fn convert(set: &Copy, ending: &str, listed: bool) {
    for i in 0..8 {
        let (from, to) = (set.at(&format!("images/img_0{i}.png")), set.at(&format!("images/img_0{i}.{ending}")));
        image::open(&from).expect("a picture").to_rgb8().save(&to).expect("saved");
        fs::remove_file(from).expect("removed");
    }
    if listed {
        set.edit("transforms.json", |text| text.replace(".png", &format!(".{ending}")));
    }
}

#[test]
fn tiff_and_bmp_are_photos() {
    for ending in ["tif", "tiff", "bmp"] {
        for listed in [true, false] {
            let Some(set) = Copy::of("06_val_filenames") else { return };
            convert(&set, ending, listed);
            let found = info(set.path());
            right(&found, 8);
            assert_eq!(warnings(&found).len(), usize::from(!listed), "{ending}");
            if !listed {
                fs::remove_file(set.at("transforms.json")).expect("removed");
                assert!(refusal(set.path()).contains("8 photos, no camera poses"), "{ending}");
            }
        }
    }
    // Their pixels are those of the photos: 16 bits and a palette of grays too.
    let Some(set) = Copy::of("06_val_filenames") else { return };
    let Ok(fmlgs::io::Opened::Dataset(before)) = fmlgs::io::open(set.path()) else { panic!("photos") };
    let pixels = |photo: &fmlgs::scene::Photo| fmlgs::io::photo::load(photo, 4096).expect("loaded").rgb;
    let right: Vec<_> = before.photos.iter().map(pixels).collect();
    for i in 0..8 {
        let (from, to) = (set.at(&format!("images/img_0{i}.png")), set.at(&format!("images/img_0{i}.tif")));
        image::open(&from).expect("a picture").to_rgb16().save(&to).expect("saved");
        fs::remove_file(from).expect("removed");
    }
    let Ok(fmlgs::io::Opened::Dataset(after)) = fmlgs::io::open(set.path()) else { panic!("photos") };
    assert_eq!(after.photos.iter().map(pixels).collect::<Vec<_>>(), right);
    // Floating-point numbers have no white.
    image::Rgb32FImage::new(84, 63).save(set.at("images/img_00.tif")).expect("saved");
    let Ok(fmlgs::io::Opened::Dataset(float)) = fmlgs::io::open(set.path()) else { panic!("photos") };
    let e = fmlgs::io::photo::load(&float.photos[0], 4096).expect_err("floats").to_string();
    assert!(e.contains("floating-point"), "{e}");
}

#[test]
fn pictures_that_are_not_read_are_named_with_the_command() {
    let heic = b"\0\0\0\x18ftypheic\0\0\0\0mif1heic";
    let avif = b"\0\0\0\x1cftypavif\0\0\0\0avifmif1";
    let jxl = b"\xff\x0a\x10\x10";
    for (ending, bytes, name) in
        [("heic", &heic[..], "HEIC"), ("avif", &avif[..], "AVIF"), ("jxl", &jxl[..], "JPEG XL")]
    {
        let Some(set) = Copy::of("06_val_filenames") else { return };
        // Listed with that ending; listed as a .png; called .png though it is none.
        for i in 0..8 {
            fs::remove_file(set.at(&format!("images/img_0{i}.png"))).expect("removed");
            fs::write(set.at(&format!("images/img_0{i}.{ending}")), bytes).expect("write");
        }
        let is_named = |e: &str| e.contains(name) && e.contains("magick mogrify -format jpg");
        let e = refusal(set.path());
        assert!(is_named(&e), "{e}");
        set.edit("transforms.json", |text| text.replace(".png", &format!(".{ending}")));
        let e = refusal(set.path());
        assert!(is_named(&e), "{e}");
        // Without poses: the command first, then COLMAP's.
        fs::remove_file(set.at("transforms.json")).expect("removed");
        let e = refusal(set.path());
        assert!(e.contains("8 pictures of formats that are not read") && e.contains("magick mogrify"), "{e}");
        for i in 0..2 {
            image::RgbImage::new(8, 6).save(set.at(&format!("images/new_{i}.png"))).expect("saved");
        }
        let e = refusal(set.path());
        assert!(e.contains("2 photos, no camera poses (8 pictures are of formats that are not read"), "{e}");
        fs::write(set.at("images/new_0.png"), bytes).expect("write");
        let e = fmlgs::io::photo::size(&set.at("images/new_0.png")).expect_err("another format").to_string();
        assert!(is_named(&e), "{e}");
    }
}

/// Packs a folder under a name of its own.
fn zip(folder: &Path, to: &Path) {
    let mut zip = zip::ZipWriter::new(fs::File::create(to).expect("create"));
    let mut folders = vec![folder.to_path_buf()];
    while let Some(at) = folders.pop() {
        for entry in fs::read_dir(at).expect("list").flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let inside = path.strip_prefix(folder).expect("inside").to_string_lossy().into_owned();
            zip.start_file(format!("fox/{inside}"), zip::write::SimpleFileOptions::default()).expect("start");
            zip.write_all(&fs::read(path).expect("read")).expect("write");
        }
    }
    zip.finish().expect("finish");
}

#[test]
fn an_archive_says_that_it_has_to_be_unpacked() {
    let place = tempfile::tempdir().expect("folder");
    let Some(set) = Copy::of("06_val_filenames") else { return };
    let archive = place.path().join("fox.zip");
    zip(set.path(), &archive);
    let e = refusal(&archive);
    assert!(e.contains("a zip archive of 10 files, fox/transforms.json among them"), "{e}");
    assert!(e.contains("unpack it, with unzip '") && e.contains("and open the folder"), "{e}");
    for (name, start, command) in [
        ("a.tar.gz", &b"\x1f\x8b\x08\0"[..], "tar xf"),
        ("a.7z", b"7z\xbc\xaf'\x1c", "7z x"),
        ("a.rar", b"Rar!", "unrar x"),
    ] {
        let path = place.path().join(name);
        fs::write(&path, start).expect("write");
        assert!(refusal(&path).contains(command), "{name}");
    }
    fs::write(place.path().join("cut.zip"), b"PK\x03\x04").expect("write");
    assert!(refusal(&place.path().join("cut.zip")).contains("the archive"), "a broken one is named");
}

#[test]
fn a_raw_picture_beside_a_photo_is_no_second_one() {
    let Some(set) = Copy::of("06_val_filenames") else { return };
    for i in 0..8 {
        set.rename(&format!("images/img_0{i}.png"), &format!("images/img_0{i}.PNG"));
        fs::write(set.at(&format!("images/img_0{i}.dng")), b"II*\0").expect("write");
    }
    set.edit("transforms.json", |text| text.replace(".png", ".jpg"));
    let found = info(set.path());
    right(&found, 8);
    assert_eq!(warnings(&found).len(), 1);
    warns(&found, &["8 of 8 listed photos were found under other names"]);
}

#[test]
fn a_data_set_of_numbered_rows_passes_over_what_systems_leave() {
    let Some(set) = Copy::of("12_colmap_elsewhere") else { return };
    // LLFF counts the photos in the folder: a picture that is none must not count.
    fs::remove_dir_all(set.at("colmap")).expect("removed");
    let row = [1.0, 0.0, 0.0, 0.0, 63.0, 0.0, 1.0, 0.0, 0.0, 84.0, 0.0, 0.0, 1.0, 0.0, 68.0, 0.5, 9.0_f64];
    let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (8, 17), }\n";
    let mut bytes = b"\x93NUMPY\x01\0".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    for i in 0..8 {
        let mut row = row;
        row[3] = f64::from(i);
        row[0] = if i == 4 { f64::NAN } else { 1.0 };
        bytes.extend(row.iter().flat_map(|v| v.to_le_bytes()));
    }
    fs::write(set.at("poses_bounds.npy"), bytes).expect("write");
    fs::write(set.at("images/._img_00.png"), "x").expect("write");
    let found = info(set.path());
    assert_eq!(found["photos"], 7);
    warns(&found, &["1 of 8 listed photos have no usable pose", "img_04.png"]);
}
