//! `.splat`: 32 bytes a Gaussian and nothing else, as the first viewers on the web read it (antimatter15's).
//!
//! Position and standard deviations as floats, color and opacity as four bytes, the unit quaternion `w x y z` as four
//! bytes around 128. The format has no signature: only the name and a size that is a multiple of 32 identify it.

use std::io::{self, Write};
use std::path::Path;

use rayon::prelude::*;

use super::atomic::WriteProgress;
use super::finite::finite_only;
use super::quantized::{color, constant, log_scale, logit, opacity_byte, to_byte, unit, unorm};
use super::{IoError, files, shift};
use crate::scene::GaussianCloud;

/// Bytes of a Gaussian.
const ROW: usize = 32;
/// Gaussians per write.
const BLOCK: usize = 4096;

pub(crate) fn read(path: &Path) -> Result<GaussianCloud, IoError> {
    parse(&files::read(path, u64::MAX)?, path)
}

/// Parses the Gaussians of a `.splat`; `path` is for errors.
///
/// # Errors
/// If the size is no multiple of 32 bytes, or no Gaussian is finite.
pub fn parse(bytes: &[u8], path: &Path) -> Result<GaussianCloud, IoError> {
    let (rows, rest) = bytes.as_chunks::<ROW>();
    if rows.is_empty() || !rest.is_empty() {
        let reason = format!("{} bytes are no rows of {ROW} bytes: the file is cut off or no .splat", bytes.len());
        return Err(IoError::syntax(path, "its size", reason));
    }
    let floats = |row: &[u8; ROW], at: usize| {
        [0, 4, 8].map(|k| f32::from_le_bytes([row[at + k], row[at + k + 1], row[at + k + 2], row[at + k + 3]]))
    };
    let cloud = GaussianCloud {
        positions: rows.par_iter().map(|row| floats(row, 0)).collect(),
        log_scales: rows.par_iter().map(|row| floats(row, 12).map(log_scale)).collect(),
        quaternions: rows
            .par_iter()
            .map(|r| unit([28, 29, 30, 31].map(|k| (f32::from(r[k]) - 128.0) / 128.0)))
            .collect(),
        opacity_logits: rows.par_iter().map(|row| logit(unorm(row[27].into(), 8))).collect(),
        sh: rows.par_iter().map(|row| [24, 25, 26].map(|k| constant(unorm(row[k].into(), 8)))).collect(),
        ..GaussianCloud::default()
    };
    finite_only(cloud, path)
}

/// Writes the bytes of a `.splat` of a valid cloud, in its order.
pub(super) fn encode(out: &mut dyn Write, cloud: &GaussianCloud, progress: &mut WriteProgress<'_>) -> io::Result<()> {
    let (near, _) = shift::near_zero(cloud);
    let cloud = &*near;
    let stride = cloud.sh_stride();
    for first in (0..cloud.len()).step_by(BLOCK) {
        progress(first)?;
        let last = cloud.len().min(first + BLOCK);
        let rows: Vec<[u8; ROW]> = (first..last)
            .into_par_iter()
            .map(|i| {
                let mut row = [0; ROW];
                let numbers = [cloud.world_position(i).as_vec3().to_array(), cloud.log_scales[i].map(f32::exp)];
                for (to, v) in row.chunks_exact_mut(4).zip(numbers.as_flattened()) {
                    to.copy_from_slice(&v.to_le_bytes());
                }
                let [r, g, b] = cloud.sh[i * stride].map(|dc| to_byte(color(dc)));
                row[24..28].copy_from_slice(&[r, g, b, opacity_byte(cloud.opacity_logits[i])]);
                row[28..].copy_from_slice(&unit(cloud.quaternions[i]).map(|c| (c * 128.0 + 128.0).round() as u8));
                row
            })
            .collect();
        out.write_all(rows.as_flattened())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::test_clouds;

    fn bytes(cloud: &GaussianCloud) -> Vec<u8> {
        let mut out = Vec::new();
        encode(&mut out, cloud, &mut |_| Ok(())).expect("encode");
        out
    }

    #[test]
    fn fields_are_where_the_format_puts_them() {
        let mut row = Vec::new();
        [1.0_f32, -2.0, 3.5, 0.5, 1.0, 2.0].iter().for_each(|v| row.extend(v.to_le_bytes()));
        // Red 255, green 0, blue 128, opacity 51; a quarter turn about z, roughly.
        row.extend([255, 0, 128, 51, 219, 128, 128, 219]);
        let c = parse(&row, Path::new("a.splat")).expect("valid");
        assert_eq!((c.len(), c.sh_degree, c.positions[0]), (1, 0, [1.0, -2.0, 3.5]));
        assert!((c.log_scales[0][0] - 0.5_f32.ln()).abs() < 1e-6 && c.log_scales[0][1] == 0.0);
        let half = 0.5_f32.sqrt();
        assert!((c.quaternions[0][0] - half).abs() < 1e-6 && (c.quaternions[0][3] - half).abs() < 1e-6);
        assert!((c.opacity_logits[0] - (0.2_f32 / 0.8).ln()).abs() < 1e-6);
        assert!((color(c.sh[0][0]) - 1.0).abs() < 1e-6 && (color(c.sh[0][2]) - 128.0 / 255.0).abs() < 1e-6);
        assert_eq!(bytes(&c), row, "written back as it was");
    }

    #[test]
    fn what_is_written_comes_back_as_near_as_bytes_are() {
        let cloud = test_clouds::random(BLOCK + 100, 2);
        let back = parse(&bytes(&cloud), Path::new("a.splat")).expect("valid");
        test_clouds::assert_near(&back, &cloud.up_to_degree(0), [1e-6, 1e-5, 0.02, 0.01, 0.01]);
    }

    #[test]
    fn what_is_cut_off_or_not_finite_is_named() {
        let good = bytes(&test_clouds::random(3, 0));
        for n in [0, 1, 31, 33, 95] {
            assert!(matches!(parse(&good[..n], Path::new("a.splat")), Err(IoError::Syntax { .. })), "{n}");
        }
        let mut bad = good.clone();
        for (at, name) in [(32 + 8, "position"), (12, "scale")] {
            bad[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
            let told = parse(&bad, Path::new("a.splat")).expect("others are finite").warnings.concat();
            assert!(told.contains(&format!("Gaussian {}, {name}", at / 32)), "{told}");
        }
        bad[64..68].copy_from_slice(&f32::INFINITY.to_le_bytes());
        assert!(matches!(parse(&bad, Path::new("a.splat")), Err(IoError::Cloud { .. })));
    }
}
