//! Focal lengths in EXIF, the TIFF structure that cameras embed in photos. Nothing in it is trusted: offsets are
//! checked, and a focal length that no lens has is `None`.

use std::ops::RangeInclusive;
use std::path::Path;

use super::{IoError, photo};

/// Focal lengths that are believed, in longer sides of the photo: from a circle of 136 degrees to a telescope.
const BELIEVED: RangeInclusive<f64> = 0.2..=30.0;
/// Diagonal of 35 mm film, mm, to which equivalent focal lengths refer.
const FILM_DIAGONAL_MM: f64 = 43.27;
/// Entries of a directory at most that are looked at.
const MOST_ENTRIES: u16 = 512;

const DIRECTORY: u16 = 0x8769;
const FOCAL_MM: u16 = 0x920A;
const FOCAL_ON_FILM_MM: u16 = 0xA405;
const SENSOR_RESOLUTION: u16 = 0xA20E;
const SENSOR_UNIT: u16 = 0xA210;
const SENSOR_WIDTH_PX: u16 = 0xA002;

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
    let Some(tiff) = Tiff::new(bytes) else { return ExifFocal::Unsaid };
    let Some(exif) = tiff.first_directory().and_then(|first| tiff.number(first, DIRECTORY)) else {
        return ExifFocal::Unsaid;
    };
    let tag = |tag: u16| tiff.number(exif as usize, tag).filter(|v| *v != 0.0);
    let (width, height) = (f64::from(width), f64::from(height));
    let longer = width.max(height);
    let on_film = tag(FOCAL_ON_FILM_MM).map(|mm| mm * width.hypot(height) / FILM_DIAGONAL_MM / longer);
    let on_sensor = || {
        let unit_mm = match tag(SENSOR_UNIT)? as u16 {
            2 => 25.4,
            3 => 10.0,
            4 => 1.0,
            _ => return None,
        };
        // The photo may have been made smaller since.
        Some(tag(FOCAL_MM)? * tag(SENSOR_RESOLUTION)? / unit_mm / tag(SENSOR_WIDTH_PX)?)
    };
    match on_film.or_else(on_sensor) {
        None => ExifFocal::Unsaid,
        Some(sides) if BELIEVED.contains(&sides) => ExifFocal::Sides(sides),
        Some(sides) => ExifFocal::Absurd(sides),
    }
}

/// A TIFF structure in memory.
struct Tiff<'a> {
    bytes: &'a [u8],
    big: bool,
}

impl<'a> Tiff<'a> {
    fn new(bytes: &'a [u8]) -> Option<Self> {
        match bytes.get(..4)? {
            b"II*\0" => Some(Self { bytes, big: false }),
            b"MM\0*" => Some(Self { bytes, big: true }),
            _ => None,
        }
    }

    fn u16(&self, at: usize) -> Option<u16> {
        let b = *self.bytes.get(at..)?.first_chunk()?;
        Some(if self.big { u16::from_be_bytes(b) } else { u16::from_le_bytes(b) })
    }

    fn u32(&self, at: usize) -> Option<u32> {
        let b = *self.bytes.get(at..)?.first_chunk()?;
        Some(if self.big { u32::from_be_bytes(b) } else { u32::from_le_bytes(b) })
    }

    fn first_directory(&self) -> Option<usize> {
        self.u32(4).map(|at| at as usize)
    }

    /// The first number of a tag in a directory: a short, a long, or a ratio of two longs.
    fn number(&self, directory: usize, tag: u16) -> Option<f64> {
        let entries = usize::from(self.u16(directory)?.min(MOST_ENTRIES));
        let mut places = (0..entries).filter_map(|i| directory.checked_add(2 + 12 * i));
        let entry = places.find(|&at| self.u16(at) == Some(tag))?;
        match self.u16(entry + 2)? {
            3 => self.u16(entry + 8).map(f64::from),
            4 => self.u32(entry + 8).map(f64::from),
            5 => {
                let at = self.u32(entry + 8)? as usize;
                Some(f64::from(self.u32(at)?) / f64::from(self.u32(at.checked_add(4)?)?))
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let behind = directory + 2 + 12 * tags.len() as u32;
        for (i, (tag, kind, value)) in tags.iter().enumerate() {
            [short(*tag), short(*kind)].iter().for_each(|b| out.extend(b));
            out.extend(long(1));
            match kind {
                3 => out.extend([short(value[0] as u16), short(0)].concat()),
                4 => out.extend(long(value[0])),
                _ => out.extend(long(behind + 8 * i as u32)),
            }
        }
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
