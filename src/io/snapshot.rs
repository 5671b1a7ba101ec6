//! Gaussians sent over the network: compressed while they are trained, the scene's own files afterwards.
//!
//! Eight bytes of signature, then sections: a tag of four bytes, the length of the content and its unpacked length (two
//! `u64`, little-endian), and the content.
//!
//! | tag | what |
//! |---|---|
//! | `spz ` | the Gaussians as [`spz`], a tenth of the size, enough to view a training run |
//! | `ply ` | the Gaussians as [`splat_ply`], bit for bit those of the file, packed by zlib |
//! | `objs` | objects and parts as [`semantic_map`], for the Gaussians of the same snapshot |

use std::io::{self, Read, Write};
use std::path::Path;

use flate2::Compression;
use flate2::read::ZlibDecoder;
use flate2::write::{GzEncoder, ZlibEncoder};

use super::reader::Reader;
use super::scene_files::{CLOUD_FILE, MAP_FILE};
use super::{IoError, files, semantic_map, splat_ply, spz};
use crate::scene::{Axes, GaussianCloud, SemanticMap};

const MAGIC: &[u8; 8] = b"FMLGSNP1";
const PACKED: &[u8; 4] = b"spz ";
const PLY: &[u8; 4] = b"ply ";
const OBJECTS: &[u8; 4] = b"objs";
/// Most bytes unpacked from one packed byte: zlib's own limit.
const MAX_RATIO: u64 = 1032;

/// Sections of a snapshot.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct SceneSnapshot {
    /// The Gaussians' file, if the scene is not in training.
    pub(crate) ply: Option<Vec<u8>>,
    packed: Option<Vec<u8>>,
    objects: Option<Vec<u8>>,
}

/// Makes the snapshot of Gaussians in training: positions to 24 bits, most else to 8.
///
/// # Errors
/// Only if the Gaussians cannot be written at all.
pub(crate) fn of_training(cloud: &GaussianCloud) -> io::Result<Vec<u8>> {
    // Positions beyond the range of 24 bits are sent unpacked.
    let Ok(unpacked) = spz::unpacked(cloud, &mut |_| Ok(())) else { return of_cloud(cloud) };
    let mut gzip = GzEncoder::new(Vec::new(), Compression::fast());
    gzip.write_all(&unpacked)?;
    let mut out = MAGIC.to_vec();
    let bytes = gzip.finish()?;
    section(&mut out, PACKED, &bytes, bytes.len());
    Ok(out)
}

/// Makes the snapshot of Gaussians without a folder, in full precision.
///
/// # Errors
/// Only if the Gaussians cannot be written at all.
pub(crate) fn of_cloud(cloud: &GaussianCloud) -> io::Result<Vec<u8>> {
    let mut ply = Vec::new();
    splat_ply::encode(&mut ply, cloud, None)?;
    of_files(&ply, None)
}

/// Makes the snapshot of the trained scene in `folder` from its files, which must be of one save.
///
/// # Errors
/// If a file cannot be read, or the two are of different saves.
pub(crate) fn of_folder(folder: &Path) -> Result<Vec<u8>, IoError> {
    let path = folder.join(CLOUD_FILE);
    let failed = |cause| IoError::Read { path: path.clone(), cause };
    let ply = files::read(&path, u64::MAX)?;
    let map_path = folder.join(MAP_FILE);
    let objects = map_path.exists().then(|| files::read(&map_path, semantic_map::MAX_BYTES)).transpose()?;
    if let Some(objects) = &objects {
        semantic_map::belongs(objects, splat_ply::state_in(&ply, &path).as_deref(), &map_path)?;
    }
    of_files(&ply, objects.as_deref()).map_err(failed)
}

fn of_files(ply: &[u8], objects: Option<&[u8]>) -> io::Result<Vec<u8>> {
    let mut zlib = ZlibEncoder::new(Vec::new(), Compression::fast());
    zlib.write_all(ply)?;
    let mut out = MAGIC.to_vec();
    section(&mut out, PLY, &zlib.finish()?, ply.len());
    if let Some(objects) = objects {
        section(&mut out, OBJECTS, objects, objects.len());
    }
    Ok(out)
}

fn section(out: &mut Vec<u8>, tag: &[u8; 4], bytes: &[u8], unpacked: usize) {
    out.extend_from_slice(tag);
    out.extend_from_slice(&(bytes.len() as u64).to_le_bytes());
    out.extend_from_slice(&(unpacked as u64).to_le_bytes());
    out.extend_from_slice(bytes);
}

impl SceneSnapshot {
    /// Parses the sections of a snapshot; `path` is for errors.
    ///
    /// # Errors
    /// If it is cut off, is of another kind, or claims more than it can hold.
    pub(crate) fn parse(bytes: &[u8], path: &Path) -> Result<Self, IoError> {
        let mut file = Reader::new(bytes, path);
        if file.take(MAGIC.len(), "the start")? != MAGIC {
            return Err(IoError::syntax(path, "the start", "it is no snapshot of a scene"));
        }
        let mut all = Self::default();
        while !file.is_at_end() {
            let tag: [u8; 4] = file.array("a section")?;
            let (length, unpacked) = (file.u64("a section")?, file.u64("a section")?);
            let place = String::from_utf8_lossy(&tag).trim().to_owned();
            let body = file.take(usize::try_from(length).unwrap_or(usize::MAX), &place)?;
            match &tag {
                PACKED => all.packed = Some(body.to_vec()),
                PLY => all.ply = Some(inflate(body, unpacked, path)?),
                OBJECTS => all.objects = Some(body.to_vec()),
                // Of a later version.
                _ => {}
            }
        }
        Ok(all)
    }

    /// Reads the Gaussians, and their objects and parts if they have any.
    ///
    /// # Errors
    /// If a section does not follow its format, or the two do not belong together.
    pub(crate) fn read(&self, path: &Path) -> Result<(GaussianCloud, Option<SemanticMap>), IoError> {
        let Some(ply) = &self.ply else {
            let missing = || IoError::syntax(path, "the sections", "there are no Gaussians");
            let packed = self.packed.as_deref().ok_or_else(missing)?;
            // They are packed with the axes of the scene.
            return Ok((spz::parse_in(packed, path, spz::SpzAxes::Given(Axes::PLY))?, None));
        };
        let cloud = splat_ply::parse(ply, path)?;
        let state = splat_ply::state_in(ply, path);
        let map =
            self.objects.as_deref().map(|o| semantic_map::decode(o, state.as_deref(), &cloud, path)).transpose()?;
        Ok((cloud, map))
    }

    /// Returns whether the Gaussians have the full precision of the file.
    pub(crate) fn is_exact(&self) -> bool {
        self.ply.is_some()
    }
}

fn inflate(packed: &[u8], length: u64, path: &Path) -> Result<Vec<u8>, IoError> {
    let possible = (packed.len() as u64).saturating_mul(MAX_RATIO);
    if length > possible {
        return Err(IoError::Count { path: path.into(), what: "bytes".into(), claimed: length, possible });
    }
    let mut all = Vec::new();
    let broken = |e: io::Error| IoError::syntax(path, "ply", format!("it cannot be unpacked: {e}"));
    ZlibDecoder::new(packed).take(length.saturating_add(1)).read_to_end(&mut all).map_err(broken)?;
    match all.len() as u64 == length {
        true => Ok(all),
        false => Err(IoError::syntax(path, "ply", "it is longer or shorter than it says")),
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::io::trained::{self, SceneInfo};
    use crate::scene::{Identities, Level, NO_IDENTITY};

    fn cloud(shift: f32) -> GaussianCloud {
        let at = |i: usize| [i as f32 * 0.37 + shift, (i as f32).sin(), 0.1];
        GaussianCloud::isotropic((0..50).map(at).collect(), -3.2, 1.0)
    }

    #[test]
    fn a_scene_at_rest_arrives_bit_for_bit() {
        let folder = tempfile::tempdir().expect("folder");
        let mut identities = Identities::default();
        let doll = identities.add(Level::Object, NO_IDENTITY, vec!["doll".into()]);
        let map = SemanticMap::from_identities(identities, vec![doll; 50], vec![1.0; 50], vec!["a".into()]);
        trained::save(folder.path(), &SceneInfo::default(), &cloud(0.0), Some(&map)).expect("save");
        let sent = SceneSnapshot::parse(&of_folder(folder.path()).expect("packed"), folder.path()).expect("sections");
        let file = std::fs::read(folder.path().join(CLOUD_FILE)).expect("file");
        assert!(sent.ply.as_deref() == Some(&*file) && sent.is_exact());
        let (got, objects) = sent.read(folder.path()).expect("scene");
        assert_eq!((got, objects), (trained::load(folder.path()).expect("load").cloud, Some(map)));
        let other = SceneSnapshot::parse(&of_cloud(&cloud(0.5)).expect("packed"), folder.path()).expect("sections");
        assert!(other.ply.as_deref() != Some(&*file), "another scene's snapshot is another");
        // Objects of another save do not pass.
        let torn = SceneSnapshot { objects: sent.objects, ..other };
        assert!(matches!(torn.read(folder.path()), Err(IoError::Torn { .. })));
    }

    #[test]
    fn a_training_arrives_as_it_looks() {
        let sent = of_training(&cloud(0.0)).expect("packed");
        let whole = of_cloud(&cloud(0.0)).expect("packed");
        assert!(sent.len() < whole.len());
        // As many and as varied as in a training, it is less than half of the whole.
        let mut many = GaussianCloud::isotropic(vec![[0.0; 3]; 3000], -3.2, 1.0);
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(5);
        for i in 0..many.len() {
            for column in [&mut many.positions[i], &mut many.log_scales[i], &mut many.sh[i]] {
                *column = column.map(|v| v + random.random_range(-1.0..1.0_f32));
            }
        }
        let [sent_len, whole_len] = [of_training(&many), of_cloud(&many)].map(|bytes| bytes.expect("packed").len());
        assert!(2 * sent_len < whole_len, "{sent_len} of {whole_len}");
        let sent = SceneSnapshot::parse(&sent, Path::new("x")).expect("sections");
        let (got, map) = sent.read(Path::new("x")).expect("Gaussians");
        let far = |of: &GaussianCloud| {
            (0..50).map(|i| got.world_position(i).distance(of.world_position(i))).fold(0.0, f64::max)
        };
        assert!(map.is_none() && !sent.is_exact() && far(&cloud(0.0)) < 1e-3 && far(&cloud(0.5)) > 0.4);
    }

    #[test]
    fn what_lies_about_its_size_is_refused() {
        let good = of_cloud(&cloud(0.0)).expect("packed");
        let parse = |bytes: &[u8]| SceneSnapshot::parse(bytes, Path::new("x"));
        assert!(parse(&good).is_ok());
        for cut in [0, 7, 8 + 3, 8 + 19, good.len() - 1] {
            assert_eq!(parse(&good[..cut]).is_ok(), cut == 8, "{cut}");
        }
        for (at, byte) in [(0, 0xff), (8 + 4 + 7, 0x7f), (8 + 12 + 7, 0x7f), (8 + 12, 0), (8 + 20, 0xff)] {
            let mut bad = good.clone();
            bad[at] = byte;
            assert!(parse(&bad).is_err(), "byte {at}");
        }
    }
}
