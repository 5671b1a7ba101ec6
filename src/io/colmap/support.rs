//! Support of the poses in a binary reconstruction: how many points each photo sees, and how well they fit.

use std::collections::HashMap;
use std::path::Path;

use super::binary::{POINT_BYTES, TRACK_BYTES};
use super::find::ModelFolder;
use crate::io::reader::Reader;
use crate::io::{IoError, files};

/// Points that a photo's pose rests on.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct PhotoPoints {
    /// Number of points.
    pub(crate) points: usize,
    /// Mean reprojection error of these points, px; `None` if it is not known.
    pub(crate) error_px: Option<f64>,
}

/// Reads the support of each photo by name; empty for a reconstruction in text.
pub(crate) fn read(model: &Path) -> Result<HashMap<String, PhotoPoints>, IoError> {
    let Some(model) = ModelFolder::at(model, 0).filter(|model| model.is_binary) else { return Ok(HashMap::new()) };
    let path = model.file("points3D");
    let sums = sums(&files::read(&path, u64::MAX)?, &path)?;
    let of = |number: u32| {
        let (points, known, error) = sums.get(&number).copied().unwrap_or_default();
        PhotoPoints { points, error_px: (known > 0).then(|| error / known as f64) }
    };
    Ok(model.images()?.into_iter().map(|image| (image.name, of(image.number))).collect())
}

/// Points, points with an error, and the sum of the errors, by number of the photo.
fn sums(bytes: &[u8], path: &Path) -> Result<HashMap<u32, (usize, usize, f64)>, IoError> {
    let mut r = Reader::new(bytes, path);
    let mut sums: HashMap<u32, (usize, usize, f64)> = HashMap::new();
    for _ in 0..r.count("points", POINT_BYTES)? {
        r.take(POINT_BYTES - 16, "a point")?;
        let error = r.f64("a point")?;
        for _ in 0..r.count("track entries of a point", TRACK_BYTES)? {
            let number = r.u32("a point's track")?;
            r.u32("a point's track")?;
            let sum = sums.entry(number).or_default();
            sum.0 += 1;
            // Makers write -1 or 0 where they did not compute it.
            if error > 0.0 && error.is_finite() {
                sum.1 += 1;
                sum.2 += error;
            }
        }
    }
    Ok(sums)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_summed_by_photo_and_broken_files_refused() {
        let mut bytes = 2_u64.to_le_bytes().to_vec();
        for (id, error, seen_by) in [(1_u64, 0.5_f64, [3_u32, 4]), (2, -1.0, [3, 9])] {
            bytes.extend(id.to_le_bytes());
            bytes.extend([0; 27]);
            bytes.extend(error.to_le_bytes());
            bytes.extend(2_u64.to_le_bytes());
            seen_by.iter().for_each(|photo| bytes.extend([photo.to_le_bytes(), [0; 4]].concat()));
        }
        let path = Path::new("points3D.bin");
        let found = sums(&bytes, path).expect("whole");
        assert_eq!((found[&3], found[&4], found[&9]), ((2, 1, 0.5), (1, 1, 0.5), (1, 0, 0.0)));
        assert!((0..bytes.len()).all(|cut| sums(&bytes[..cut], path).is_err()), "cut anywhere");
    }
}
