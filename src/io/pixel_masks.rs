//! Masks of the pixels that count in a photo: `mask_path` of `transforms.json`, and a folder `masks` beside `images` as
//! in COLMAP's `ImageReader.mask_path`. Black pixels do not count.
//!
//! A folder of that name may hold labels of objects, too; these have more than two values and are skipped.

use std::fs;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::photo_list::is_scaled;
use super::{IoError, photo};
use crate::scene::{Dataset, Photo};

/// Pictures sampled to tell masks from labels.
const SAMPLE: usize = 12;
/// Values this close to black or to the brightest count as these: noise of JPEG.
const NOISE: u8 = 24;
/// Largest share of other values, as at smoothed edges.
const BETWEEN: f64 = 0.03;
/// Endings of masks that are named after the photo's stem.
const ENDINGS: [&str; 4] = ["png", "jpg", "jpeg", "webp"];

/// Kind of a picture's content.
#[derive(Debug, PartialEq)]
enum Content {
    /// Black and this value.
    Mask(u8),
    /// Colors, or several values: labels.
    Labels,
    /// Nothing but black.
    Black,
}

/// Finds the masks beside the photos' folder, for photos that have none yet. Warnings name pictures that are skipped.
pub(super) fn find(dataset: &mut Dataset) {
    let root = dataset.root.clone();
    let mut folders: Vec<PathBuf> = Vec::new();
    let mut found: Vec<(usize, PathBuf)> = Vec::new();
    for (i, photo) in dataset.photos.iter().enumerate().filter(|(_, p)| p.mask.is_none()) {
        let Some((folder, inside)) = place(&root, photo) else { continue };
        for masks in mask_folders(&root, &folder) {
            if !folders.contains(&masks) {
                folders.push(masks.clone());
            }
            if let Some(mask) = names(&masks, &inside).into_iter().find(|p| p.is_file()) {
                found.push((i, mask));
                break;
            }
        }
    }
    let Some(first) = folders.first() else { return };
    if found.is_empty() {
        let pictures = fs::read_dir(first).map_or(0, |all| all.flatten().filter(|e| is_picture(&e.path())).count());
        if pictures > 0 {
            dataset.warnings.push(format!(
                "{} is passed over: none of its {pictures} pictures is named like a photo (<photo>.png)",
                first.display()
            ));
        }
        return;
    }
    let step = found.len().div_ceil(SAMPLE).max(1);
    let sample: Vec<(&Path, Content)> =
        found.par_iter().step_by(step).filter_map(|(_, path)| Some((path.as_path(), content(path).ok()?))).collect();
    let mut levels: Vec<u8> =
        sample.iter().filter_map(|s| if let Content::Mask(v) = s.1 { Some(v) } else { None }).collect();
    levels.sort_unstable();
    let labels = sample.iter().find(|s| s.1 == Content::Labels).map(|s| s.0);
    // Pictures of one value each, with different values, hold ids of objects.
    let numbers = levels.last().zip(levels.first()).is_some_and(|(a, b)| a - b > 2 * NOISE || (*a < 64 && a != b));
    if let Some(labels) = labels.or_else(|| sample.first().map(|s| s.0).filter(|_| numbers)) {
        dataset.warnings.push(format!(
            "{} pictures beside the photos are passed over: they have colors or more than two values, so they are labels and no \
             masks of the pixels that count (first: {})",
            found.len(),
            labels.display()
        ));
        return;
    }
    let found: Vec<(usize, PathBuf, Option<String>)> = found
        .into_par_iter()
        .map(|(i, path)| {
            let fault = fault(&path, &dataset.photos[i]);
            (i, path, fault)
        })
        .collect();
    let broken: Vec<&String> = found.iter().filter_map(|f| f.2.as_ref()).collect();
    if let Some(first) = broken.first() {
        dataset.warnings.push(format!(
            "{} of {} masks cannot be used, so all pixels of those photos count (first: {first})",
            broken.len(),
            found.len()
        ));
    }
    for (i, path, _) in found.into_iter().filter(|f| f.2.is_none()) {
        dataset.photos[i].mask = Some(path);
    }
}

/// Splits a photo's path into its folder below `root` and the path inside of it.
fn place(root: &Path, photo: &Photo) -> Option<(PathBuf, PathBuf)> {
    let relative = photo.path.strip_prefix(root).ok()?;
    let mut parts = relative.components();
    let folder = parts.next()?;
    let inside = parts.as_path();
    Some(if inside.as_os_str().is_empty() {
        (PathBuf::new(), relative.into())
    } else {
        (PathBuf::from(folder.as_os_str()), inside.into())
    })
}

/// Lists folders for masks of photos in `folder`: for `images_2`, `masks_2` or `masks`.
fn mask_folders(root: &Path, folder: &Path) -> Vec<PathBuf> {
    let name = folder.to_string_lossy();
    let reduced = name.strip_prefix("images").filter(|rest| !rest.is_empty());
    let own = reduced.map(|rest| format!("masks{rest}"));
    own.into_iter().chain(["masks".into()]).map(|n| root.join(n)).filter(|p| p.is_dir()).collect()
}

/// Lists the possible paths of a photo's mask.
fn names(masks: &Path, inside: &Path) -> Vec<PathBuf> {
    let whole = masks.join(inside);
    let longer = PathBuf::from(format!("{}.png", whole.display()));
    std::iter::once(longer).chain(ENDINGS.map(|e| whole.with_extension(e))).collect()
}

fn is_picture(path: &Path) -> bool {
    path.extension().is_some_and(|e| ENDINGS.contains(&&*e.to_string_lossy().to_lowercase()))
}

fn content(path: &Path) -> Result<Content, IoError> {
    // Decided by the header alone, as the pixels can hold nothing else.
    if photo::is_black_and_white(path)? {
        return Ok(Content::Mask(u8::MAX));
    }
    let picture = photo::open(path)?;
    let is_gray = |p: &[u8; 3]| p[0].abs_diff(p[1]).max(p[1].abs_diff(p[2])) <= NOISE;
    if !picture.rgb.iter().all(is_gray) {
        return Ok(Content::Labels);
    }
    let brightest = picture.rgb.iter().map(|p| p[1]).max().unwrap_or(0);
    if brightest == 0 {
        return Ok(Content::Black);
    }
    let noise = if brightest >= 128 { NOISE } else { 0 };
    let between = picture.rgb.iter().filter(|p| p[1] > noise && p[1] < brightest - noise).count();
    let is_mask = between as f64 <= BETWEEN * picture.rgb.len() as f64;
    Ok(if is_mask { Content::Mask(brightest) } else { Content::Labels })
}

/// Returns the reason why a mask cannot be used for a photo.
fn fault(path: &Path, photo: &Photo) -> Option<String> {
    let (found, expected) = (photo::size(path), (photo.camera.width_px, photo.camera.height_px));
    match found {
        Err(e) => Some(e.to_string()),
        Ok(found) if !is_scaled(expected, found) => {
            Some(IoError::PhotoSize { path: path.into(), found, expected }.to_string())
        }
        Ok(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use image::{GrayImage, Luma, Rgb, RgbImage};

    use super::*;
    use crate::io::resample::Pixels;

    #[test]
    fn masks_are_told_from_labels() {
        let folder = tempfile::tempdir().expect("folder");
        let of = |name: &str, value: fn(u32, u32) -> u8| {
            let path = folder.path().join(name);
            GrayImage::from_fn(40, 30, |x, y| Luma([value(x, y)])).save(&path).expect("save");
            content(&path).expect("read")
        };
        assert_eq!(of("a.png", |x, _| if x < 20 { 0 } else { 255 }), Content::Mask(255));
        assert!(matches!(of("a.jpg", |x, _| if x < 20 { 0 } else { 255 }), Content::Mask(240..)));
        assert_eq!(of("b.png", |x, _| u8::from(x < 20)), Content::Mask(1));
        assert_eq!(of("c.png", |x, _| (x / 10) as u8), Content::Labels);
        assert_eq!(of("d.png", |x, _| (x / 10 * 80) as u8), Content::Labels);
        assert_eq!(of("e.png", |_, _| 0), Content::Black);
        // One bit a pixel, by the header alone: these pixels are those of labels.
        let path = folder.path().join("c.png");
        let mut bytes = fs::read(&path).expect("read");
        bytes[24] = 1;
        fs::write(&path, bytes).expect("write");
        assert_eq!(content(&path).expect("read"), Content::Mask(255));
        let path = folder.path().join("f.png");
        RgbImage::from_fn(9, 9, |x, _| Rgb([if x < 3 { 200 } else { 0 }, 0, 0])).save(&path).expect("save");
        assert_eq!(content(&path).expect("read"), Content::Labels);
    }

    #[test]
    fn what_is_black_in_a_mask_of_half_the_size_does_not_count() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("m.png");
        GrayImage::from_fn(2, 1, |x, _| Luma([if x == 0 { 0 } else { 255 }])).save(&path).expect("save");
        let pixels = Pixels { width: 4, height: 2, channels: 3, data: vec![7; 24] };
        let alpha: Vec<u8> = photo::masked(pixels, &path).expect("read").data.chunks_exact(4).map(|p| p[3]).collect();
        assert_eq!(alpha, [0, 0, 255, 255, 0, 0, 255, 255]);
        let folders = |folder: &str| mask_folders(Path::new("/nowhere"), Path::new(folder)).len();
        assert_eq!(folders("images_2"), 0);
        let stems: Vec<String> =
            names(Path::new("masks"), Path::new("a/b.jpg")).iter().map(|p| p.display().to_string()).collect();
        assert_eq!(stems[..3], ["masks/a/b.jpg.png", "masks/a/b.png", "masks/a/b.jpg"]);
    }
}
