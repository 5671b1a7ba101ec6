//! LLFF: `poses_bounds.npy` beside a folder of photos.
//!
//! Each row holds a 3 x 5 block `[R | t | (height, width, focal)]`, row by row, with camera axes
//! down, right, back, then the nearest and farthest depth. Rows belong to the photos in the order
//! of their names.

use std::path::Path;

use glam::{DMat3, DVec2, DVec3};

use super::photo_list::{self, Focal, Lens, ListedPhoto, is_helper, photos};
use super::{IoError, files, npy, photo};
use crate::scene::{Camera, Dataset, Distortion};

pub(crate) const POSES_FILE: &str = "poses_bounds.npy";
/// Numbers per photo.
const ROW: usize = 17;

/// Reads the dataset in `root`.
pub fn read(root: &Path) -> Result<Dataset, IoError> {
    let file = root.join(POSES_FILE);
    let rows = poses(&files::read(&file, u64::MAX)?, &file)?;
    let folder = photo_list::photo_folder(root, &file)?;
    let names = names(&root.join(&folder))?;
    if names.len() != rows.len() {
        let all = files::names_in(&root.join(&folder)).unwrap_or_default();
        if let Some(unread) = all.iter().find(|name| photo::is_unread(name)) {
            let (path, what) = (root.join(&folder).join(unread), "a picture format that is not read".into());
            return Err(IoError::Unsupported { path, what, remedy: photo::CONVERT });
        }
        return Err(IoError::Count {
            path: file,
            what: format!("photos ({} holds another number)", root.join(&folder).display()),
            claimed: rows.len() as u64,
            possible: names.len() as u64,
        });
    }
    let listed =
        rows.iter().zip(&names).map(|(row, name)| listed(row, name, &folder, &file)).collect::<Result<_, _>>()?;
    let mut warnings = Vec::new();
    Ok(Dataset {
        name: files::data_set_name(root),
        root: root.into(),
        format: "LLFF".into(),
        photos: photos(listed, root, &file, &mut warnings)?,
        warnings,
        ..Dataset::default()
    })
}

/// Parses the rows of a `poses_bounds.npy`.
pub fn poses(bytes: &[u8], path: &Path) -> Result<Vec<[f64; ROW]>, IoError> {
    let array = npy::open(bytes, path)?;
    let &[n, ROW_U64] = array.shape() else {
        let reason = format!("the array's shape is {:?}, expected [photos, {ROW}]", array.shape());
        return Err(IoError::Syntax { path: path.into(), place: "npy".into(), reason });
    };
    let possible = array.possible / ROW_U64;
    if n > possible {
        return Err(IoError::Count { path: path.into(), what: "photos".into(), claimed: n, possible });
    }
    Ok(array.values()?.as_chunks::<ROW>().0.to_vec())
}

const ROW_U64: u64 = ROW as u64;

/// Lists the photos in a folder, sorted; SPIn-NeRF's helper pictures are left out.
pub(super) fn names(folder: &Path) -> Result<Vec<String>, IoError> {
    let failed = |cause| IoError::Read { path: folder.into(), cause };
    let mut names = files::names_in(folder).map_err(failed)?;
    names.retain(|name| photo::is_photo(name) && !is_helper(name));
    Ok(names)
}

fn listed(row: &[f64; ROW], name: &str, folder: &str, source: &Path) -> Result<ListedPhoto, IoError> {
    let column = |c: usize| DVec3::new(row[c], row[5 + c], row[10 + c]);
    let DVec3 { x: height, y: width, z: focal } = column(4);
    let side = |v: f64| (v >= 1.0 && v <= f64::from(Camera::MAX_SIDE_PX)).then_some(v.round() as u32);
    let (Some(w), Some(h)) = (side(width), side(height)) else {
        return Err(IoError::syntax(
            source,
            format!("photo '{name}'"),
            format!("size {width} x {height} px is not between 1 and {} px a side", Camera::MAX_SIDE_PX),
        ));
    };
    Ok(ListedPhoto {
        entry: name.into(),
        folder: folder.into(),
        lens: Lens {
            size_px: Some((w, h)),
            focal: Focal::Px(DVec2::splat(focal)),
            principal_px: None,
            distortion: Distortion::default(),
        },
        // Down, right, back to right, down, forward.
        world_from_camera: DMat3::from_cols(column(1), column(0), -column(2)),
        center: column(3),
        normalized: false,
        broken: None,
        test_split: false,
        background: None,
        mask: None,
    })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use image::RgbImage;
    use npyz::WriterBuilder;

    use super::*;
    use crate::scene::CameraError;

    /// A camera at (1, 2, 3) that looks along +y with +z up: down is -z, right x, back -y.
    const POSE: [f64; ROW] = [0.0, 1.0, 0.0, 1.0, 48.0, 0.0, 0.0, -1.0, 2.0, 64.0, -1.0, 0.0, 0.0, 3.0, 50.0, 0.5, 9.0];

    fn npy(values: &[f64], shape: &[u64]) -> Vec<u8> {
        let mut out = Vec::new();
        let mut w = npyz::WriteOptions::new().default_dtype().shape(shape).writer(&mut out).begin_nd().expect("begin");
        w.extend(values.iter().copied()).expect("write");
        w.finish().expect("finish");
        out
    }

    fn folder(rows: usize) -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("folder");
        fs::write(folder.path().join(POSES_FILE), npy(&POSE.repeat(rows), &[rows as u64, 17])).expect("write");
        fs::create_dir(folder.path().join("images_2")).expect("create");
        for name in ["b.png", "a.png", "a_cutout.png", "pseudo_b.png"] {
            RgbImage::new(32, 24).save(folder.path().join("images_2").join(name)).expect("save");
        }
        folder
    }

    #[test]
    fn a_known_point_projects_where_it_should() {
        let d = read(folder(2).path()).expect("read");
        assert_eq!(d.photos.iter().map(|p| p.name.as_str()).collect::<Vec<_>>(), ["a.png", "b.png"]);
        let c = &d.photos[0].camera;
        assert_eq!((c.width_px, c.height_px, c.focal_px), (32, 24, DVec2::splat(25.0)));
        // Ten ahead (+y), two to the right (+x), one up (+z), at half size.
        let p = c.project(DVec3::new(3.0, 12.0, 4.0)).expect("in front");
        assert!((p - DVec2::new(16.0 + 25.0 * 0.2, 12.0 - 25.0 * 0.1)).length() < 1e-12, "{p}");
        assert_eq!(c.project(DVec3::new(1.0, -5.0, 3.0)), None, "behind");
    }

    #[test]
    fn the_number_of_photos_must_match() {
        assert!(matches!(read(folder(3).path()), Err(IoError::Count { claimed: 3, possible: 2, .. })));
    }

    #[test]
    fn hostile_arrays_are_named() {
        let path = Path::new(POSES_FILE);
        let good = npy(&POSE, &[1, 17]);
        assert_eq!(poses(&good, path).expect("good"), [POSE]);
        for n in [0, 5, 9, 60] {
            assert!(matches!(poses(&good[..n], path), Err(IoError::Syntax { .. })), "{n}");
        }
        assert!(matches!(poses(&good[..good.len() - 1], path), Err(IoError::Count { claimed: 1, possible: 0, .. })));
        let with_shape = |shape: &str| {
            let text = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n");
            let mut bytes = b"\x93NUMPY\x01\0".to_vec();
            bytes.extend((text.len() as u16).to_le_bytes());
            bytes.extend(text.as_bytes());
            bytes.extend(POSE.map(f64::to_le_bytes).concat());
            poses(&bytes, path)
        };
        assert_eq!(with_shape("(1, 17)").expect("good"), [POSE]);
        assert!(matches!(with_shape("(2, 17)"), Err(IoError::Count { claimed: 2, possible: 1, .. })));
        let e = with_shape("(1152921504606846976, 17)").expect_err("too many");
        assert!(matches!(e, IoError::Count { claimed: u64::MAX, .. }), "{e}");
        assert!(matches!(with_shape("7"), Err(IoError::Count { .. })));
        let other = String::from_utf8_lossy(&good).replace("<f8", "<i8");
        assert!(matches!(poses(other.as_bytes(), path), Err(IoError::Syntax { .. })));
        assert!(matches!(with_shape("(17, 1)"), Err(IoError::Syntax { .. })));
        assert!(matches!(with_shape("(17,)"), Err(IoError::Syntax { .. })));
        let f = folder(2);
        let mut bad = POSE;
        bad[7] = f64::NAN;
        fs::write(f.path().join(POSES_FILE), npy(&[POSE, bad].concat(), &[2, 17])).expect("write");
        let d = read(f.path()).expect("one is good");
        assert_eq!((d.photos.len(), &*d.photos[0].name), (1, "a.png"));
        assert!(d.warnings[0].contains("1 of 2 listed photos have no usable pose") && d.warnings[0].contains("b.png"));
        let mut mirrored = POSE;
        mirrored[7] = 1.0;
        fs::write(f.path().join(POSES_FILE), npy(&mirrored.repeat(2), &[2, 17])).expect("write");
        assert!(matches!(read(f.path()), Err(IoError::Camera { cause: CameraError::Rotation(_), .. })));
    }
}
