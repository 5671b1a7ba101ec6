//! Checkpoint: the whole state of a run in one file, so that a killed run resumes along the same trajectory.
//!
//! Layout: the magic bytes, the header's length (u64), a JSON header, then little-endian f32
//! arrays: the cloud, both moments (positions, log-scales, quaternions, opacity logits, SH each)
//! and the density statistics; at the end the SHA-256 of all that.

use std::io::{self, Write};
use std::path::Path;

use bytemuck::cast_slice;
use glam::DVec3;
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::TrainConfig;
use super::density::DensityStats;
use super::inputs::TrainInputs;
use super::photo_fits::StoredFit;
use super::refine::Refinement;
use super::trainer::Trainer;
use super::window::StepWindow;
use crate::io::files::{self, Summed};
use crate::io::trained::History;
use crate::io::{IoError, SceneFolder};
use crate::math::sh::coefficients;
use crate::scene::GaussianCloud;

pub use crate::io::scene_files::CHECKPOINT_FILE as FILE;

const MAGIC: &[u8; 8] = b"FMLGSCP4";
/// Magic bytes of earlier versions. Files of the first end without a checksum; the first and the second have one more
/// array at the end, which is ignored. Files of the third do not record the training inputs.
const MAGIC_1: &[u8; 8] = b"FMLGSCP1";
const MAGIC_2: &[u8; 8] = b"FMLGSCP2";
const MAGIC_3: &[u8; 8] = b"FMLGSCP3";

/// State of a run without its arrays.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "each name says what it is")]
pub struct Header {
    pub config: TrainConfig,
    /// Names of the photos trained on.
    pub photos: Vec<String>,
    /// Training inputs; absent in files of earlier versions.
    #[serde(default)]
    pub inputs: Option<TrainInputs>,
    pub step: u64,
    pub secs: f64,
    /// Gaussians.
    pub count: usize,
    pub sh_degree: u8,
    pub origin: DVec3,
    pub rng: Pcg64Mcg,
    /// Photos left in the round.
    pub round: Vec<u32>,
    /// Most Gaussians allowed.
    pub budget: usize,
    /// Factor on the learning rates.
    pub damping: f64,
    /// Training that this run refines, if it does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refinement: Option<Refinement>,
    pub history: History,
    /// Measurements since the last row of `history`; absent in files of earlier versions.
    #[serde(default)]
    pub unreported: StepWindow,
    /// Poses and exposures learned so far, by photo; empty where none are learned.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fits: Vec<StoredFit>,
}

/// Reasons for which a checkpoint cannot be used.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum CheckpointError {
    #[error(transparent)]
    Io(#[from] IoError),
    #[error("{path} is damaged or no checkpoint ({reason}); choose another folder to train anew")]
    Damaged { path: std::path::PathBuf, reason: String },
    #[error("{folder} holds a trained scene, but no checkpoint to resume from; choose another folder for the result")]
    Missing { folder: std::path::PathBuf },
    #[error("{path} belongs to a run with other {what}; choose another folder for the result")]
    OtherRun { path: std::path::PathBuf, what: &'static str },
    #[error("the training in {folder} began with other photos or poses: {}", .changes.join("; "))]
    OtherInputs { folder: std::path::PathBuf, changes: Vec<String> },
}

/// Writes the state atomically.
///
/// # Errors
/// If it cannot be written; the earlier checkpoint is then unchanged.
pub(crate) fn save(scene: &SceneFolder, trainer: &Trainer, header: &Header) -> Result<(), IoError> {
    scene.save_checkpoint(|w| {
        let mut w = Summed::new(w);
        let text = serde_json::to_vec(header)?;
        w.write_all(MAGIC)?;
        w.write_all(&(text.len() as u64).to_le_bytes())?;
        w.write_all(&text)?;
        for cloud in [&trainer.cloud, &trainer.moments[0], &trainer.moments[1]] {
            write_cloud(&mut w, cloud)?;
        }
        w.write_all(cast_slice(&trainer.stats.gradient))?;
        w.write_all(cast_slice(&trainer.stats.seen))?;
        let sum = w.sum.finalize();
        w.to.write_all(&sum)
    })
}

fn write_cloud(w: &mut dyn Write, c: &GaussianCloud) -> io::Result<()> {
    w.write_all(cast_slice(&c.positions))?;
    w.write_all(cast_slice(&c.log_scales))?;
    w.write_all(cast_slice(&c.quaternions))?;
    w.write_all(cast_slice(&c.opacity_logits))?;
    w.write_all(cast_slice(&c.sh))
}

/// Checkpoint in memory.
pub struct Checkpoint {
    /// State of the run.
    pub header: Header,
    pub(crate) cloud: GaussianCloud,
    pub(crate) moments: [GaussianCloud; 2],
    pub(crate) stats: DensityStats,
}

/// Reads a checkpoint, or `None` if there is no such file.
pub fn load(path: &Path) -> Result<Option<Checkpoint>, CheckpointError> {
    let damaged = |reason: &str| CheckpointError::Damaged { path: path.into(), reason: reason.into() };
    let bytes = match files::read(path, u64::MAX) {
        Ok(bytes) => bytes,
        Err(IoError::Read { cause, .. }) if cause.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(e.into()),
    };
    let body = match bytes.split_last_chunk::<32>() {
        Some((body, sum)) if [MAGIC, MAGIC_3, MAGIC_2].iter().any(|magic| bytes.starts_with(*magic)) => {
            if Sha256::digest(body).as_slice() != sum {
                return Err(damaged("its checksum is another"));
            }
            body
        }
        _ => &bytes,
    };
    let earlier = body.starts_with(MAGIC_1) || body.starts_with(MAGIC_2);
    let rest = [MAGIC, MAGIC_1, MAGIC_2, MAGIC_3].iter().find_map(|magic| body.strip_prefix(*magic));
    let rest = rest.ok_or_else(|| damaged("it does not begin like one"))?;
    let (length, rest) = rest.split_first_chunk::<8>().ok_or_else(|| damaged("it ends in the header"))?;
    let length = usize::try_from(u64::from_le_bytes(*length)).ok().filter(|&l| l <= rest.len());
    let (text, data) = rest.split_at(length.ok_or_else(|| damaged("it ends in the header"))?);
    let header: Header = serde_json::from_slice(text).map_err(|e| damaged(&e.to_string()))?;
    let (n, degree) = (header.count, header.sh_degree);
    let per_gaussian = (3 * (3 + 3 + 4 + 1 + 3 * coefficients(degree.min(3))) + 2 + usize::from(earlier)) * 4;
    if degree > 3 || n.checked_mul(per_gaussian) != Some(data.len()) {
        return Err(damaged("its arrays do not have the length that its header says"));
    }
    let mut at = Floats(data);
    let mut cloud = || at.cloud(n, degree, header.origin);
    let (cloud, moments) = (cloud(), [cloud(), cloud()]);
    [&cloud].into_iter().chain(&moments).try_for_each(GaussianCloud::validate).map_err(|e| damaged(&e.to_string()))?;
    let gradient = at.take(n);
    let seen = at.take(n).iter().map(|v| v.to_bits()).collect();
    Ok(Some(Checkpoint { header, cloud, moments, stats: DensityStats { gradient, seen } }))
}

/// Reader of arrays from a buffer whose length has been checked.
struct Floats<'a>(&'a [u8]);

impl Floats<'_> {
    fn take(&mut self, n: usize) -> Vec<f32> {
        let (own, rest) = self.0.split_at(n * 4);
        self.0 = rest;
        own.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect()
    }

    fn arrays<const K: usize>(&mut self, n: usize) -> Vec<[f32; K]> {
        self.take(n * K).as_chunks::<K>().0.to_vec()
    }

    fn cloud(&mut self, n: usize, sh_degree: u8, origin: DVec3) -> GaussianCloud {
        GaussianCloud {
            origin,
            positions: self.arrays(n),
            log_scales: self.arrays(n),
            quaternions: self.arrays(n),
            opacity_logits: self.take(n),
            sh_degree,
            sh: self.arrays(n * coefficients(sh_degree)),
            ..GaussianCloud::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn what_earlier_versions_wrote_is_read() {
        let folder = tempfile::tempdir().expect("folder");
        let scene = SceneFolder::hold(folder.path(), "a test").expect("held");
        let config = TrainConfig { sh_degree: 0, ..TrainConfig::default() };
        let cloud = GaussianCloud { sh: vec![[0.5; 3]; 2], ..GaussianCloud::isotropic(vec![[1.0; 3]; 2], -1.0, 0.0) };
        let mut trainer = Trainer::new(cloud, &config, [0.0; 3], 1.0, Pcg64Mcg::seed_from_u64(1));
        (trainer.stats.gradient, trainer.stats.seen) = (vec![0.25, 0.5], vec![3, 4]);
        let header = Header {
            config,
            photos: Vec::new(),
            inputs: Some(TrainInputs::default()),
            step: 7,
            secs: 0.0,
            count: 2,
            sh_degree: 0,
            origin: DVec3::ZERO,
            rng: trainer.rng.clone(),
            round: Vec::new(),
            budget: 2,
            damping: 1.0,
            refinement: None,
            history: History::default(),
            unreported: StepWindow::default(),
            fits: Vec::new(),
        };
        save(&scene, &trainer, &header).expect("saved");
        let path = folder.path().join(FILE);
        let now = std::fs::read(&path).expect("there");
        assert!(now.starts_with(MAGIC));
        let read = |bytes: &[u8]| {
            std::fs::write(&path, bytes).expect("written");
            load(&path).map(|saved| saved.expect("there")).map(|c| (c.header.step, c.stats, c.cloud))
        };
        let want = (7, trainer.stats.clone(), trainer.cloud.clone());
        assert_eq!(read(&now).expect("today's"), want);
        let mut earlier = now[..now.len() - 32].to_vec();
        earlier.extend([0; 8]);
        earlier[..8].copy_from_slice(MAGIC_1);
        assert_eq!(read(&earlier).expect("the first version's"), want);
        earlier[..8].copy_from_slice(MAGIC_2);
        let sum = Sha256::digest(&earlier);
        let second = [&earlier, sum.as_slice()].concat();
        assert_eq!(read(&second).expect("the second version's"), want);
        let body = [MAGIC_3, &now[8..now.len() - 32]].concat();
        let third = [&body, Sha256::digest(&body).as_slice()].concat();
        assert_eq!(read(&third).expect("the third version's"), want);
        // The controls: without its array, and with another sum.
        assert!(read(&[&now[..8], &second[8..]].concat()).is_err());
        assert!(read(&earlier).is_err());
    }
}
