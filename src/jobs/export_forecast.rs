//! Size and loss of Gaussians in every format, before they are saved: each is written to a temporary place and drawn.

use std::sync::Arc;

use strum::VariantArray;

use super::JobError;
use super::export_splat::{self, ExportedSplat, LossViews};
use crate::io::splat_format::SplatFormat;
use crate::pipeline::observer::Observer;
use crate::scene::GaussianCloud;

/// Most Gaussians that are written; of more, some are taken in equal steps.
pub(crate) const MOST: usize = 200_000;

/// Facts about one format.
#[derive(Clone, Debug)]
pub(crate) struct SplatForecast {
    pub(crate) format: SplatFormat,
    /// The report of an export, or why there can be none.
    pub(crate) written: Result<ExportedSplat, String>,
}

/// Writes the Gaussians in every format and draws them; gives each result to `found`.
///
/// # Errors
/// If there is no temporary place, or the observer asks to stop.
pub(crate) fn run(
    cloud: &Arc<GaussianCloud>,
    mut found: impl FnMut(SplatForecast),
    observer: &mut dyn Observer,
) -> Result<(), JobError> {
    let n = cloud.len();
    let sample = match n > MOST {
        true => Arc::new(cloud.select(&(0..MOST).map(|i| i * n / MOST).collect::<Vec<_>>())),
        false => Arc::clone(cloud),
    };
    let views = LossViews::of_cloud(cloud);
    for &format in SplatFormat::VARIANTS {
        let folder = tempfile::tempdir().map_err(|e| JobError::Output(format!("no temporary place: {e}")))?;
        let name = if format == SplatFormat::SogFolder { String::new() } else { "a".to_owned() };
        let path = folder.path().join(name + format.ending());
        let written = match export_splat::run(&sample, &path, Some(&views), observer) {
            Err(e) if e.is_cancelled() => return Err(e),
            Err(e) => Err(e.to_string()),
            Ok(mut written) => {
                // Sizes of all are nearly proportional to the number of Gaussians.
                written.bytes = (written.bytes as f64 * n as f64 / sample.len().max(1) as f64) as u64;
                Ok(written)
            }
        };
        found(SplatForecast { format, written });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::observer::{Progress, Signal, Silent};

    fn cloud(n: usize) -> Arc<GaussianCloud> {
        let at = |i: usize| [0.37, 0.71, 0.13].map(|step| (i as f32 * step).fract() * 2.0 - 1.0);
        let mut cloud = GaussianCloud::isotropic((0..n).map(at).collect(), -3.0, 1.0);
        cloud.sh = (0..n).map(|i| [(i % 7) as f32 / 10.0, 0.2, (i % 5) as f32 / -10.0]).collect();
        Arc::new(cloud)
    }

    #[test]
    fn sizes_and_losses_are_those_of_the_written_files() {
        let (cloud, mut all) = (cloud(900), Vec::new());
        run(&cloud, |one| all.push(one), &mut Silent).expect("measured");
        assert_eq!(all.iter().map(|one| one.format).collect::<Vec<_>>(), SplatFormat::VARIANTS);
        let folder = tempfile::tempdir().expect("folder");
        let views = LossViews::of_cloud(&cloud);
        for one in &all {
            let ending = one.format.ending();
            let path = folder.path().join(if ending == "meta.json" { ending.into() } else { format!("b{ending}") });
            let written = export_splat::run(&cloud, &path, Some(&views), &mut Silent).expect("written");
            let foreseen = one.written.as_ref().expect("it can be written");
            assert_eq!((foreseen.bytes, foreseen.drawn), (written.bytes, written.drawn), "{ending}");
        }
        let bytes = |i: usize| all[i].written.as_ref().expect("written").bytes;
        assert!(bytes(0) > 2 * bytes(1), "not all are equal");
    }

    #[test]
    fn more_gaussians_than_are_written_are_estimated_and_none_is_a_refusal() {
        let large = cloud(MOST + 1);
        let mut first = None;
        struct Once(bool);
        impl Observer for Once {
            fn signal(&self) -> Signal {
                if self.0 { Signal::Cancel } else { Signal::Continue }
            }
            fn progress(&mut self, at: Progress) {
                self.0 |= at.stage.starts_with("Measuring");
            }
        }
        let e = run(&large, |one| first = Some(one), &mut Once(false)).expect_err("canceled");
        assert!(e.is_cancelled() && first.is_none());
        let mut all = Vec::new();
        run(&Arc::default(), |one| all.push(one), &mut Silent).expect("done");
        assert!(all.iter().filter(|one| one.written.is_err()).count() >= 6, "only a .ply can be empty");
    }
}
