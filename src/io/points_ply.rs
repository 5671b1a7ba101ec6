//! Sparse points as `.ply`: `x y z` and, where present, colors.

use std::io::Write;
use std::path::{Path, PathBuf};

use glam::DVec3;
use rayon::prelude::*;

use super::ply::{Colors, Ply, Table};
use super::{IoError, atomic, files, photo_list};
use crate::scene::{Camera, SparsePoint};

/// Color of points that have none.
const GRAY: u8 = 128;

pub(crate) fn read(path: &Path) -> Result<Vec<SparsePoint>, IoError> {
    parse(&files::read(path, u64::MAX)?, path)
}

/// Names of files with sparse points that no list refers to.
const NAMES: [&str; 6] =
    ["points3d.ply", "sparse_pc.ply", "points.ply", "pointcloud.ply", "point_cloud.ply", "sparse.ply"];
/// Bytes at the start of a `.ply` that are checked for the columns of a splat.
const HEADER_BYTES: u64 = 8 << 10;

/// Finds the sparse points in a folder: a `.ply` with one of the usual names, in any letter case, that is not a splat.
pub(crate) fn beside(folder: &Path) -> Option<PathBuf> {
    let there = files::names_in(folder).ok()?;
    let called = |name: &&str| there.iter().find(|other| other.eq_ignore_ascii_case(name));
    let is_splat = |path: &PathBuf| {
        let start = files::read_start(path, HEADER_BYTES).unwrap_or_default();
        start.windows(8).any(|word| word == b" opacity" || word == b" scale_0")
    };
    let all = NAMES.iter().filter_map(called).map(|name| folder.join(name));
    all.filter(|path| path.is_file()).find(|path| !is_splat(path))
}

/// Parses the points of a `.ply`; `path` is for errors.
pub fn parse(bytes: &[u8], path: &Path) -> Result<Vec<SparsePoint>, IoError> {
    let ply = Ply::parse(bytes, path)?;
    let Some(table) = ply.table("vertex")? else {
        return Err(ply.syntax("vertex", "missing".into()));
    };
    let xyz =
        table.all(["x", "y", "z"]).map_err(|name| ply.syntax("vertex", format!("property '{name}' is missing")))?;
    let colors = Colors::of(&table);
    let byte = |v: f64| if v.is_finite() { (v * 255.0).round().clamp(0.0, 255.0) as u8 } else { GRAY };
    let points: Vec<SparsePoint> = (0..table.rows)
        .into_par_iter()
        .map(|i| {
            let row = table.row(i);
            SparsePoint {
                position: DVec3::from_array(xyz.map(|c| c.f64(row))),
                rgb: colors.as_ref().map_or([GRAY; 3], |c| c.rgb(row).map(byte)),
            }
        })
        .collect();
    first_bad(&points, &table, path)?;
    Ok(points)
}

/// Writes a binary `.ply` of colored points.
pub(crate) fn write(path: &Path, points: &[SparsePoint]) -> Result<(), IoError> {
    atomic::write(path, |f: &mut dyn Write| {
        writeln!(f, "ply\nformat binary_little_endian 1.0\nelement vertex {}", points.len())?;
        writeln!(f, "property float x\nproperty float y\nproperty float z")?;
        writeln!(f, "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header")?;
        for p in points {
            for c in p.position.to_array() {
                f.write_all(&(c as f32).to_le_bytes())?;
            }
            f.write_all(&p.rgb)?;
        }
        Ok(())
    })
}

fn first_bad(points: &[SparsePoint], table: &Table<'_>, path: &Path) -> Result<(), IoError> {
    debug_assert_eq!(points.len(), table.rows);
    let is_bad = |p: &SparsePoint| p.position.to_array().iter().any(|v| !(v.abs() <= Camera::FARTHEST));
    match points.par_iter().position_first(is_bad) {
        None => Ok(()),
        Some(index) => photo_list::place(points[index].position, "vertex", index, path).map(drop),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse_bytes(bytes: &[u8]) -> Result<Vec<SparsePoint>, IoError> {
        parse(bytes, Path::new("points.ply"))
    }

    const ASCII: &str = "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int i\nelement vertex 2\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty double x\nproperty double y\nproperty double z\nend_header\n3 7 8 9\n255 0 9 1.5 -2 3e2\n1 2 3 0 0 0.1\n";

    fn binary(big: bool) -> Vec<u8> {
        let mut out = ASCII.split_inclusive("end_header\n").next().unwrap_or_default().to_owned();
        out = out.replace("ascii", if big { "binary_big_endian" } else { "binary_little_endian" });
        let mut out = out.into_bytes();
        let int = |v: i32| if big { v.to_be_bytes() } else { v.to_le_bytes() };
        let double = |v: f64| if big { v.to_be_bytes() } else { v.to_le_bytes() };
        out.push(3);
        for v in [7, 8, 9] {
            out.extend(int(v));
        }
        for (rgb, xyz) in [([255, 0, 9], [1.5, -2.0, 300.0]), ([1, 2, 3], [0.0, 0.0, 0.1])] {
            out.extend(rgb);
            xyz.into_iter().for_each(|v| out.extend(double(v)));
        }
        out
    }

    #[test]
    fn all_encodings_agree() {
        let ascii = parse_bytes(ASCII.as_bytes()).expect("ascii");
        assert_eq!(ascii.len(), 2);
        assert_eq!(ascii[0], SparsePoint { position: DVec3::new(1.5, -2.0, 300.0), rgb: [255, 0, 9] });
        assert_eq!(ascii, parse_bytes(&binary(false)).expect("little endian"));
        assert_eq!(ascii, parse_bytes(&binary(true)).expect("big endian"));
    }

    /// Parses the colors of points with these three columns, as text.
    fn colors(header: &str, rows: &[&str]) -> Vec<[u8; 3]> {
        let head = format!("ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\n{header}", rows.len());
        let rows: String = rows.iter().map(|row| format!("0 {row} 0 0\n")).collect();
        let text = format!("{head}property float y\nproperty float z\nend_header\n{rows}");
        parse_bytes(text.as_bytes()).expect("points").iter().map(|p| p.rgb).collect()
    }

    #[test]
    fn colors_are_read_by_name_and_range() {
        let three = |kind: &str, names: [&str; 3]| names.map(|name| format!("property {kind} {name}\n")).concat();
        let rgb = ["red", "green", "blue"];
        for (header, rows, first) in [
            (three("float", rgb), ["0.2 0.4 1", "0 0 0.5"], [51, 102, 255]),
            (three("float", rgb), ["51 102 255", "0 0 1"], [51, 102, 255]),
            (three("double", rgb), ["51.0 102.4 254.6", "0 0 1"], [51, 102, 255]),
            (three("half", rgb), ["0.2 0.4 1", "0 0 0"], [51, 102, 255]),
            (three("ushort", rgb), ["13107 26214 65535", "0 0 1"], [51, 102, 255]),
            (three("ushort", rgb), ["51 102 255", "0 0 1"], [51, 102, 255]),
            (three("float", rgb), ["13107 26214 65535", "0 0 1"], [51, 102, 255]),
            (three("uchar", rgb), ["1 0 1", "0 0 1"], [1, 0, 1]),
            (three("int", rgb), ["1 0 1", "0 0 1"], [1, 0, 1]),
            (three("uchar", ["diffuse_red", "diffuse_green", "diffuse_blue"]), ["51 102 255", "0 0 0"], [51, 102, 255]),
            (three("float", ["r", "g", "b"]), ["0.2 0.4 1.5", "0 0 0"], [51, 102, 255]),
            (three("float", ["f_dc_0", "f_dc_1", "f_dc_2"]), ["-1.06347 0 3", "0 0 0"], [51, 128, 255]),
            (three("float", rgb), ["nan 0.4 1", "0 0 0"], [GRAY, 102, 255]),
        ] {
            assert_eq!(colors(&header, &rows)[0], first, "{header}{rows:?}");
        }
        // Alpha and lists beside the colors are skipped.
        let beside = "property list uchar int seen\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n";
        assert_eq!(colors(beside, &["2 7 8 51 102 255 9", "0 1 2 3 4"]), [[51, 102, 255], [1, 2, 3]]);
    }

    #[test]
    fn lists_among_the_points_are_passed_over_in_every_encoding() {
        let header = |format: &str| {
            format!(
                "ply\nformat {format} 1.0\nelement vertex 2\nproperty float x\nproperty list uchar short seen\nproperty float y\nproperty float z\nend_header\n"
            )
        };
        let ascii = parse_bytes(format!("{}1 2 7 8 2 3\n4 0 5 6\n", header("ascii")).as_bytes()).expect("ascii");
        assert_eq!(ascii.iter().map(|p| p.position.to_array()).collect::<Vec<_>>(), [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
        for big in [false, true] {
            let mut bytes = header(if big { "binary_big_endian" } else { "binary_little_endian" }).into_bytes();
            let float = |v: f32| if big { v.to_be_bytes() } else { v.to_le_bytes() };
            for (x, seen, yz) in [(1.0, &[7_u8, 0, 8, 0][..], [2.0, 3.0]), (4.0, &[], [5.0, 6.0])] {
                bytes.extend(float(x));
                bytes.push(seen.len() as u8 / 2);
                bytes.extend(seen);
                yz.into_iter().for_each(|v| bytes.extend(float(v)));
            }
            assert_eq!(parse_bytes(&bytes).expect("binary"), ascii);
            for n in bytes.len() - 20..bytes.len() {
                parse_bytes(&bytes[..n]).expect_err("cut off");
            }
        }
    }

    #[test]
    fn truncated_files_are_named_at_every_length() {
        for full in [ASCII.as_bytes().to_vec(), binary(false), binary(true)] {
            // The last digits of the last number and its line end are no loss of structure.
            for n in 0..full.len() - 4 {
                let e = parse_bytes(&full[..n]).expect_err("truncated");
                assert!(
                    matches!(e, IoError::Syntax { .. } | IoError::Truncated { .. } | IoError::Count { .. }),
                    "{n}: {e}"
                );
            }
        }
    }

    #[test]
    fn absurd_counts_are_refused_without_allocating() {
        for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
            let text = format!(
                "ply\nformat {format} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n",
                1_u64 << 60
            );
            let e = parse_bytes(text.as_bytes()).expect_err("too many");
            assert!(matches!(e, IoError::Count { claimed, .. } if claimed == 1 << 60), "{e}");
        }
    }

    #[test]
    fn non_finite_points_name_vertex_and_property() {
        let text = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 3\n1 NaN 3\n";
        let e = parse_bytes(text.as_bytes()).expect_err("NaN");
        assert!(matches!(&e, IoError::NotFinite { index: 1, property, .. } if property == "y"), "{e}");
        let e = parse_bytes(text.replace("NaN", "-1e30").as_bytes()).expect_err("far");
        let told = e.to_string();
        assert!(told.contains("vertex 1: y = -1") && told.contains("is farther than 1e12 units"), "{e}");
        assert_eq!(parse_bytes(text.replace("NaN", "2").as_bytes()).expect("finite")[1].rgb, [GRAY; 3]);
    }

    #[test]
    fn a_negative_list_length_is_refused() {
        let mut bytes = b"ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list int int i\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n".to_vec();
        bytes.extend((-1_i32).to_le_bytes());
        bytes.extend([0; 64]);
        assert!(matches!(parse_bytes(&bytes), Err(IoError::Truncated { .. })));
    }
}
