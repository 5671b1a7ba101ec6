//! Photos: decoded within limits, undistorted, and reduced to the requested size.
//!
//! Orientation tags are left alone: poses and intrinsics refer to the pixels as stored.

use std::io::Cursor;
use std::path::Path;

use image::{
    ColorType, DynamicImage, ImageBuffer, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits, Luma, RgbaImage,
};

use super::resample::{Pixels, resample, shrink};
use super::{IoError, files, memory};
use crate::math::resize::nearest;
use crate::scene::{Camera, Photo, PhotoPixels};

/// Endings of the pictures that are read.
const ENDINGS: [&str; 7] = ["jpg", "jpeg", "png", "webp", "tif", "tiff", "bmp"];
/// Endings of known picture formats that cannot be read.
const UNREAD: [&str; 6] = ["heic", "heif", "hif", "avif", "jxl", "dng"];
/// Brands of picture files in ISO's base media file format, and their names.
const BRANDS: [([u8; 4], &str); 9] = [
    (*b"heic", "HEIC"),
    (*b"heix", "HEIC"),
    (*b"heim", "HEIC"),
    (*b"heis", "HEIC"),
    (*b"hevc", "HEIC"),
    (*b"mif1", "HEIF"),
    (*b"msf1", "HEIF"),
    (*b"avif", "AVIF"),
    (*b"avis", "AVIF"),
];
/// Remedy for pictures of formats that are not read.
pub(crate) const CONVERT: &str = "convert the photos, with ImageMagick: 'magick mogrify -format jpg *.heic' \
                                  (*.avif and the like), and open the folder again";

/// Returns the name of a picture without its ending; `None` for other files.
pub(crate) fn stem(name: &str) -> Option<&str> {
    let (stem, ending) = name.rsplit_once('.').filter(|(stem, _)| !stem.is_empty())?;
    ENDINGS.iter().chain(&UNREAD).any(|known| ending.eq_ignore_ascii_case(known)).then_some(stem)
}

/// Returns whether a file of this name is a picture that can be read.
pub(crate) fn is_photo(name: &str) -> bool {
    stem(name).is_some() && !is_unread(name) && !files::is_debris(name)
}

/// Returns whether a file of this name is a picture that cannot be read.
pub(crate) fn is_unread(name: &str) -> bool {
    let is = |ending: &str| UNREAD.iter().any(|known| ending.eq_ignore_ascii_case(known));
    name.rsplit_once('.').is_some_and(|(_, ending)| is(ending)) && !files::is_debris(name)
}

/// Makes the error of a known picture format that cannot be read; `None` for other files.
fn unread(bytes: &[u8], path: &Path) -> Option<IoError> {
    let what = match bytes {
        [_, _, _, _, b'f', b't', b'y', b'p', a, b, c, d, ..] => {
            BRANDS.iter().find(|(brand, _)| brand == &[*a, *b, *c, *d]).map(|(_, name)| *name)
        }
        [0xFF, 0x0A, ..] | [0, 0, 0, 0x0C, b'J', b'X', b'L', b' ', ..] => Some("JPEG XL"),
        // Its first picture is a preview.
        [b'I', b'I', ..] | [b'M', b'M', ..] if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("dng")) => {
            Some("DNG")
        }
        _ => None,
    };
    let what = format!("the picture format {}", what?);
    Some(IoError::Unsupported { path: path.into(), what, remedy: CONVERT })
}

/// Bytes at the start of a picture file that hold its size in all but rare cases.
const HEADER_BYTES: u64 = 256 << 10;

/// Loads the photo's pixels: undistorted to its pinhole camera and averaged down to at most `max_side_px` along the
/// longer side. The matching camera is `photo.camera.limited_to(max_side_px)`.
pub fn load(photo: &Photo, max_side_px: u32) -> Result<PhotoPixels, IoError> {
    if !photo.has_pixels() {
        let reason = "only its camera is known here; open the data set that it is of".into();
        return Err(IoError::Picture { path: (&*photo.name).into(), reason });
    }
    let expected = (photo.camera.width_px, photo.camera.height_px);
    let target = photo.camera.limited_to(max_side_px);
    let through_lens = |pixels: &Pixels| resample(pixels, &photo.camera, photo.distortion.as_ref(), &target);
    let mut pixels = decode(&photo.path, expected)?;
    let mut alpha = None;
    if let Some(background) = photo.background {
        if photo.cut_out && pixels.channels == 4 {
            alpha = Some(through_lens(&alpha_as_gray(&pixels)).rgb.iter().map(|p| p[0]).collect());
        }
        pixels = over(pixels, background);
    }
    if let Some(mask) = &photo.mask {
        pixels = masked(pixels, mask)?;
    }
    let seen = PhotoPixels { alpha, ..through_lens(&pixels) };
    // A photo without a counting pixel would match any rendering.
    match seen.coverage.as_ref().is_some_and(|c| c.iter().all(|c| *c == 0)) {
        true => Err(IoError::NothingShown { path: photo.path.clone() }),
        false => Ok(seen),
    }
}

/// Halves a loaded photo and its camera; pixels that the photo does not cover do not count.
pub(crate) fn half(pixels: &PhotoPixels, camera: &Camera) -> (PhotoPixels, Camera) {
    let small = camera.reduced(2);
    let alpha = pixels.alpha.as_ref().map(|alpha| {
        let gray = PhotoPixels { rgb: alpha.iter().map(|&a| [a; 3]).collect(), alpha: None, ..pixels.clone() };
        shrink(&gray, camera, &small).rgb.iter().map(|p| p[0]).collect()
    });
    (PhotoPixels { alpha, ..shrink(pixels, camera, &small) }, small)
}

/// Reads width, height and alpha of every pixel of a picture file; `None`, from its header, if it has no alpha.
pub(super) fn alpha(path: &Path) -> Result<Option<(usize, usize, Vec<u8>)>, IoError> {
    if !header(path)?.1.has_alpha() {
        return Ok(None);
    }
    let picture = decode_rgba(&read_whole(path)?, MOST_PX, path)?;
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    Ok(Some((width, height, picture.pixels().map(|p| p.0[3]).collect())))
}

/// Reads width and height in px of a picture file, from its header.
pub fn size(path: &Path) -> Result<(u32, u32), IoError> {
    header(path).map(|(size, _)| size)
}

/// Reads size in px and pixel type of a picture file without decoding pixels. A PNG with a transparent color has alpha.
fn header(path: &Path) -> Result<((u32, u32), ColorType), IoError> {
    let of = |bytes: &[u8]| decoder(bytes, path).map(|d| (d.dimensions(), d.color_type()));
    let start = files::read_start(path, HEADER_BYTES)?;
    let is_whole = (start.len() as u64) < HEADER_BYTES;
    match of(&start) {
        // A large color profile or preview can push it past the start, and a TIFF may have it at its end.
        Err(_) if !is_whole => of(&files::read(path, files::MAX_PICTURE_BYTES)?),
        known => known,
    }
}

/// Reads the EXIF block of a picture file; empty if it has none that can be read.
pub(super) fn exif(path: &Path) -> Result<Vec<u8>, IoError> {
    let bytes = read_whole(path)?;
    let mut decoder = decoder(&bytes, path)?;
    Ok(decoder.exif_metadata().ok().flatten().unwrap_or_default())
}

/// Returns whether a file is a gray PNG of one bit a pixel, by its first bytes; such a picture is black and white only.
pub(super) fn is_black_and_white(path: &Path) -> Result<bool, IoError> {
    let start = files::read_start(path, 26)?;
    Ok(start.starts_with(b"\x89PNG\r\n\x1a\n") && start.get(24..) == Some([1, 0].as_slice()))
}

/// Largest picture that is opened on its own, px.
const MOST_PX: u64 = 1 << 28;

/// Opens a picture as stored; transparent pixels keep their color.
pub(crate) fn open(path: &Path) -> Result<PhotoPixels, IoError> {
    let picture = decode_rgba(&read_whole(path)?, MOST_PX, path)?;
    let (width_px, height_px) = picture.dimensions();
    let rgb = picture.pixels().map(|p| [p[0], p[1], p[2]]).collect();
    Ok(PhotoPixels { width_px, height_px, rgb, coverage: None, alpha: None })
}

/// Reads the bytes of a picture file; a truncated JPEG is an error.
fn read_whole(path: &Path) -> Result<Vec<u8>, IoError> {
    let bytes = files::read(path, files::MAX_PICTURE_BYTES)?;
    if is_cut_jpeg(&bytes) {
        return Err(IoError::Picture {
            path: path.into(),
            reason: "the JPEG data has no end; the file is cut off".into(),
        });
    }
    Ok(bytes)
}

/// Decodes a picture that must be of `expected` size, as 8-bit RGB or RGBA.
fn decode(path: &Path, expected: (u32, u32)) -> Result<Pixels, IoError> {
    let bytes = read_whole(path)?;
    let decoder = decoder(&bytes, path)?;
    let found = decoder.dimensions();
    if found != expected {
        return Err(IoError::PhotoSize { path: path.into(), found, expected });
    }
    let picture = DynamicImage::from_decoder(decoder).map_err(|e| failed(path, &e))?;
    if matches!(picture.color(), ColorType::Rgb32F | ColorType::Rgba32F) {
        let reason =
            "its colors are floating-point numbers, of which nobody says what is white; save it with 8 or 16 bits";
        return Err(IoError::Picture { path: path.into(), reason: reason.into() });
    }
    let (width, height) = (found.0 as usize, found.1 as usize);
    Ok(if picture.color().has_alpha() {
        Pixels { width, height, channels: 4, data: picture.into_rgba8().into_raw() }
    } else {
        Pixels { width, height, channels: 3, data: picture.into_rgb8().into_raw() }
    })
}

/// Decodes the bytes of a picture of at most `limit_px` pixels as 8-bit RGBA; `path` is for errors.
pub(super) fn decode_rgba(bytes: &[u8], limit_px: u64, path: &Path) -> Result<RgbaImage, IoError> {
    let decoder = decoder(bytes, path)?;
    let (w, h) = decoder.dimensions();
    let pixels = u64::from(w) * u64::from(h);
    if pixels > limit_px {
        return Err(IoError::OverBudget {
            path: path.into(),
            what: "the picture",
            bytes: 4 * pixels,
            limit: 4 * limit_px,
            remedy: "it is larger than what refers to it can use",
        });
    }
    Ok(DynamicImage::from_decoder(decoder).map_err(|e| failed(path, &e))?.into_rgba8())
}

/// Decodes the bytes of a gray picture, 8 or 16 bits a pixel; `path` is for errors.
pub(super) fn decode_gray16(bytes: &[u8], path: &Path) -> Result<ImageBuffer<Luma<u16>, Vec<u16>>, IoError> {
    match DynamicImage::from_decoder(decoder(bytes, path)?).map_err(|e| failed(path, &e))? {
        DynamicImage::ImageLuma16(gray) => Ok(gray),
        DynamicImage::ImageLuma8(gray) => {
            let (width, height) = gray.dimensions();
            Ok(ImageBuffer::from_fn(width, height, |x, y| Luma([u16::from(gray.get_pixel(x, y).0[0])])))
        }
        _ => Err(IoError::Picture { path: path.into(), reason: "a map of ids has one gray channel".into() }),
    }
}

/// Decodes width, height and the brightest color channel of every pixel, 0 to 255. Pixels that are not black stay at
/// least 1.
pub(super) fn decode_brightest(bytes: &[u8], path: &Path) -> Result<(usize, usize, Vec<u8>), IoError> {
    let picture = DynamicImage::from_decoder(decoder(bytes, path)?).map_err(|e| failed(path, &e))?;
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let values = match picture {
        DynamicImage::ImageLuma8(gray) => gray.into_raw(),
        DynamicImage::ImageLumaA8(gray) => gray.pixels().map(|p| p.0[0]).collect(),
        DynamicImage::ImageRgb8(rgb) => rgb.pixels().map(|p| p.0[0].max(p.0[1]).max(p.0[2])).collect(),
        DynamicImage::ImageRgba8(rgb) => rgb.pixels().map(|p| p.0[0].max(p.0[1]).max(p.0[2])).collect(),
        other => {
            let narrow = |v: u16| v.div_ceil(257) as u8;
            other.into_rgb16().pixels().map(|p| narrow(p.0[0].max(p.0[1]).max(p.0[2]))).collect()
        }
    };
    Ok((width, height, values))
}

/// Makes a decoder that has read the header and has bounded memory.
fn decoder<'a>(bytes: &'a [u8], path: &Path) -> Result<impl ImageDecoder + 'a, IoError> {
    let mut reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|cause| IoError::Read { path: path.into(), cause })?;
    if let Some(known) = unread(bytes, path) {
        return Err(known);
    }
    let read = [ImageFormat::Jpeg, ImageFormat::Png, ImageFormat::WebP, ImageFormat::Tiff, ImageFormat::Bmp];
    if !reader.format().is_some_and(|format| read.contains(&format)) {
        let reason = "not a JPEG, PNG, WebP, TIFF or BMP picture".into();
        return Err(IoError::Picture { path: path.into(), reason });
    }
    let mut limits = Limits::default();
    limits.max_image_width = Some(Camera::MAX_SIDE_PX);
    limits.max_image_height = Some(Camera::MAX_SIDE_PX);
    limits.max_alloc = Some(memory::budget());
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|e| failed(path, &e))?;
    let (width_px, height_px) = decoder.dimensions();
    if width_px == 0 || height_px == 0 {
        return Err(IoError::EmptyPicture { path: path.into(), width_px, height_px });
    }
    Ok(decoder)
}

fn failed(path: &Path, e: &ImageError) -> IoError {
    IoError::Picture { path: path.into(), reason: e.to_string() }
}

/// Returns whether this is a JPEG without its end marker. The decoder fills missing parts with gray.
fn is_cut_jpeg(bytes: &[u8]) -> bool {
    // Inside the coded data every 0xFF is followed by 0 or a restart marker, so the end marker
    // cannot occur by chance; a preview embedded before the coded data can contain one, which is
    // why the search starts at the main picture's scan.
    bytes.starts_with(&[0xFF, 0xD8, 0xFF])
        && !jpeg_scan(bytes).is_some_and(|scan| scan.windows(2).any(|w| w == [0xFF, 0xD9]))
}

/// Returns the bytes after the first start-of-scan marker.
fn jpeg_scan(bytes: &[u8]) -> Option<&[u8]> {
    let mut rest = bytes.get(2..)?;
    loop {
        let [0xFF, marker, tail @ ..] = rest else { return None };
        match *marker {
            0xDA => return Some(tail),
            // Padding before a marker.
            0xFF => rest = &rest[1..],
            // Markers without a segment.
            0x01 | 0xD0..=0xD8 => rest = tail,
            _ => {
                let length = usize::from(u16::from_be_bytes(*tail.first_chunk()?));
                rest = tail.get(length..)?;
            }
        }
    }
}

/// Leaves out the pixels that are black in a mask, which may have another size of the same shape.
pub(super) fn masked(pixels: Pixels, mask: &Path) -> Result<Pixels, IoError> {
    let (w, h, values) = decode_brightest(&files::read(mask, files::MAX_PICTURE_BYTES)?, mask)?;
    let least = if values.iter().max().is_some_and(|m| *m >= 128) { 128 } else { 1 };
    let Pixels { width, height, channels, data } = pixels;
    let columns: Vec<usize> = (0..width).map(|x| nearest(x, w, width)).collect();
    let mut out = Vec::with_capacity(width * height * 4);
    for (y, row) in data.chunks_exact(width * channels).enumerate() {
        let of = &values[nearest(y, h, height) * w..][..w];
        for (p, x) in row.chunks_exact(channels).zip(&columns) {
            let alpha = if channels == 4 { p[3] } else { u8::MAX };
            out.extend([p[0], p[1], p[2], if of[*x] >= least { alpha } else { 0 }]);
        }
    }
    Ok(Pixels { width, height, channels: 4, data: out })
}

/// Returns the alpha of an RGBA picture as its color.
fn alpha_as_gray(pixels: &Pixels) -> Pixels {
    let data = pixels.data.chunks_exact(4).flat_map(|p| [p[3]; 3]).collect();
    Pixels { channels: 3, data, ..*pixels }
}

/// Composites transparent pixels over a color.
fn over(mut pixels: Pixels, background: [f32; 3]) -> Pixels {
    if pixels.channels == 3 {
        return pixels;
    }
    let data = pixels.data.chunks_exact(4).flat_map(|p| {
        let a = f32::from(p[3]) / 255.0;
        [0, 1, 2].map(|c| (f32::from(p[c]) * a + 255.0 * background[c] * (1.0 - a)).round() as u8)
    });
    pixels.data = data.collect();
    pixels.channels = 3;
    pixels
}

#[cfg(test)]
mod tests;
