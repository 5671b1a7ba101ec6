//! Focal lengths in EXIF, the TIFF structure that cameras embed in photos. Nothing in it is trusted: a focal length that
//! no lens has is told apart.

use std::ops::RangeInclusive;
use std::path::Path;

use ::exif::{In, Rational, Reader, Tag, Value};

use super::{IoError, photo};

/// Focal lengths that are believed, in longer sides of the photo: from a circle of 136 degrees to a telescope.
const BELIEVED: RangeInclusive<f64> = 0.2..=30.0;
/// Diagonal of 35 mm film, mm, to which equivalent focal lengths refer.
const FILM_DIAGONAL_MM: f64 = 43.27;

/// Statement of EXIF about a focal length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ExifFocal {
    /// Nothing.
    Unsaid,
    /// In longer sides of the photo.
    Sides(f64),
    /// A number that no lens has.
    Absurd(f64),
}

/// Reads the focal length of a photo of this size, px.
pub(crate) fn focal(path: &Path, size: (u32, u32)) -> Result<ExifFocal, IoError> {
    Ok(parse(&photo::exif(path)?, size))
}

/// The focal length in an EXIF block.
fn parse(bytes: &[u8], (width, height): (u32, u32)) -> ExifFocal {
    let bytes = bytes.strip_prefix(b"Exif\0\0").unwrap_or(bytes);
    let mut reader = Reader::new();
    // One broken field, such as a maker's own, does not hide the others.
    let read = reader.continue_on_error(true).read_raw(bytes.to_vec()).or_else(|e| e.distill_partial_result(|_| {}));
    let Ok(block) = read else { return ExifFocal::Unsaid };
    let number = |tag: Tag| match &block.get_field(tag, In::PRIMARY)?.value {
        Value::Rational(ratios) => ratios.first().map(Rational::to_f64),
        other => other.get_uint(0).map(f64::from),
    };
    let tag = |tag: Tag| number(tag).filter(|v| *v != 0.0);
    let (width, height) = (f64::from(width), f64::from(height));
    let longer = width.max(height);
    let on_film = tag(Tag::FocalLengthIn35mmFilm).map(|mm| mm * width.hypot(height) / FILM_DIAGONAL_MM / longer);
    let on_sensor = || {
        let unit_mm = match tag(Tag::FocalPlaneResolutionUnit)? as u16 {
            2 => 25.4,
            3 => 10.0,
            4 => 1.0,
            _ => return None,
        };
        // The photo may have been made smaller since.
        Some(tag(Tag::FocalLength)? * tag(Tag::FocalPlaneXResolution)? / unit_mm / tag(Tag::PixelXDimension)?)
    };
    match on_film.or_else(on_sensor) {
        None => ExifFocal::Unsaid,
        Some(sides) if BELIEVED.contains(&sides) => ExifFocal::Sides(sides),
        Some(sides) => ExifFocal::Absurd(sides),
    }
}

/// The bytes of a JPEG without its EXIF blocks; of anything else, all of them.
pub(crate) fn without(bytes: &[u8]) -> Vec<u8> {
    let Some(mut rest) = bytes.strip_prefix(b"\xFF\xD8") else { return bytes.to_vec() };
    let mut kept = b"\xFF\xD8".to_vec();
    // Segments up to the start of the picture's data (DA): a marker, and a length that counts itself.
    while let [0xFF, marker, high, low, ..] = *rest {
        let length = 2 + usize::from(u16::from_be_bytes([high, low]));
        let Some((segment, after)) = rest.split_at_checked(length).filter(|_| marker != 0xDA) else { break };
        if !(marker == 0xE1 && segment.get(4..).is_some_and(|content| content.starts_with(b"Exif\0"))) {
            kept.extend(segment);
        }
        rest = after;
    }
    kept.extend(rest);
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    const DIRECTORY: u16 = 0x8769;
    const FOCAL_MM: u16 = 0x920A;
    const FOCAL_ON_FILM_MM: u16 = 0xA405;
    const SENSOR_RESOLUTION: u16 = 0xA20E;
    const SENSOR_UNIT: u16 = 0xA210;
    const SENSOR_WIDTH_PX: u16 = 0xA002;

    /// An EXIF block with these tags (tag, type, value) in its EXIF directory; ratios stand behind it.
    fn block(tags: &[(u16, u16, [u32; 2])], big: bool) -> Vec<u8> {
        let short = |v: u16| if big { v.to_be_bytes() } else { v.to_le_bytes() };
        let long = |v: u32| if big { v.to_be_bytes() } else { v.to_le_bytes() };
        let mut out = if big { b"MM\0*".to_vec() } else { b"II*\0".to_vec() };
        out.extend(long(8));
        let directory = 8 + 2 + 12 + 4;
        out.extend(short(1));
        [&short(DIRECTORY)[..], &short(4), &long(1), &long(directory)].iter().for_each(|b| out.extend(*b));
        out.extend(long(0));
        out.extend(short(tags.len() as u16));
        let behind = directory + 2 + 12 * tags.len() as u32 + 4;
        for (i, (tag, kind, value)) in tags.iter().enumerate() {
            [short(*tag), short(*kind)].iter().for_each(|b| out.extend(b));
            out.extend(long(1));
            match kind {
                3 => out.extend([short(value[0] as u16), short(0)].concat()),
                4 => out.extend(long(value[0])),
                _ => out.extend(long(behind + 8 * i as u32)),
            }
        }
        out.extend(long(0));
        tags.iter().for_each(|(.., value)| value.iter().for_each(|v| out.extend(long(*v))));
        out
    }

    #[test]
    fn focal_lengths_are_read_in_both_orders() {
        for big in [false, true] {
            let film = block(&[(FOCAL_ON_FILM_MM, 3, [26, 0])], big);
            let ExifFocal::Sides(sides) = parse(&film, (4000, 3000)) else { panic!("a focal length") };
            assert!((sides - 26.0 * 5000.0 / 43.27 / 4000.0).abs() < 1e-9, "{sides}");
            let sensor = block(
                &[
                    (FOCAL_MM, 5, [500, 10]),
                    (SENSOR_WIDTH_PX, 4, [6000, 0]),
                    (SENSOR_RESOLUTION, 5, [6000, 36]),
                    (SENSOR_UNIT, 3, [4, 0]),
                ],
                big,
            );
            let ExifFocal::Sides(sides) = parse(&[b"Exif\0\0", &*sensor].concat(), (3000, 2000)) else {
                panic!("a focal length")
            };
            assert!((sides - 50.0 / 36.0).abs() < 1e-9, "{sides}");
        }
    }

    #[test]
    fn a_photo_without_its_block_is_the_same_picture() {
        let mut plain = Vec::new();
        let picture = image::RgbImage::from_fn(16, 8, |x, y| image::Rgb([16 * x as u8, 30 * y as u8, 7]));
        picture.write_with_encoder(image::codecs::jpeg::JpegEncoder::new(&mut plain)).expect("encoded");
        let exif = [&b"Exif\0\0"[..], &block(&[(FOCAL_ON_FILM_MM, 3, [1, 0])], true)].concat();
        let segment = [&[0xFF, 0xE1][..], &(exif.len() as u16 + 2).to_be_bytes(), &exif].concat();
        let with = [&plain[..2], &segment, &plain[2..]].concat();
        assert_eq!(without(&with), plain);
        assert_eq!(without(&plain), plain, "the control");
        for cut in 0..with.len() {
            assert!(without(&with[..cut]).len() <= cut, "{cut}");
        }
        assert_eq!(without(b"no JPEG"), b"no JPEG");
    }

    #[test]
    fn absurd_missing_and_broken_ones_are_none() {
        let film = |mm: u32| block(&[(FOCAL_ON_FILM_MM, 3, [mm, 0])], false);
        assert!(matches!(parse(&film(1), (4000, 3000)), ExifFocal::Absurd(_)));
        assert!(matches!(parse(&film(60_000), (4000, 3000)), ExifFocal::Absurd(_)));
        assert_eq!(parse(&film(0), (4000, 3000)), ExifFocal::Unsaid);
        assert_eq!(parse(b"", (4000, 3000)), ExifFocal::Unsaid);
        let whole = film(26);
        for cut in 0..whole.len() - 16 {
            assert_eq!(parse(&whole[..cut], (4000, 3000)), ExifFocal::Unsaid, "{cut}");
        }
        let mut far = film(26);
        far[4..8].fill(0xFF);
        assert_eq!(parse(&far, (4000, 3000)), ExifFocal::Unsaid);
    }
}
