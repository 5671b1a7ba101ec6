//! Masks that a network found in a photo, kept on disk: a canceled search resumes photo by photo, and the next search
//! does not run the network again.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::error::FindError;
use super::frame_cache::{cache_name, written};
use super::segmenter::{FoundMask, Segmenter};
use crate::io::labels::rle::Rle;
use crate::io::{atomic, files};
use crate::pipeline::observer::Observer;
use crate::scene::{Level, Photo};

/// Largest file of kept masks, bytes.
const MOST_BYTES: u64 = 64 << 20;

/// Masks of a segmenter, computed once.
pub(crate) struct MaskCache {
    inner: Box<dyn Segmenter>,
    folder: PathBuf,
    /// Digest of the network and of its options.
    digest: String,
}

#[derive(Serialize, Deserialize)]
struct CachedMask {
    level: Level,
    parent: Option<usize>,
    mask: Rle,
}

impl MaskCache {
    /// Keeps the masks of `inner` in `folder`. `with` is everything that they depend on, besides the photo.
    pub(crate) fn new(inner: Box<dyn Segmenter>, folder: PathBuf, with: &[&[u8]]) -> Self {
        let mut sum = Sha256::new();
        for part in with {
            sum.update((part.len() as u64).to_le_bytes());
            sum.update(part);
        }
        let digest = files::hex(&sum.finalize());
        Self { inner, folder, digest }
    }

    fn file(&self, photo: &Photo, max_side_px: u32) -> PathBuf {
        let asked = format!("{} {max_side_px}", self.digest);
        self.folder.join(cache_name((self.inner.name(), &asked), photo, written(photo))).with_extension("masks.json")
    }
}

impl Segmenter for MaskCache {
    fn name(&self) -> &str {
        self.inner.name()
    }

    fn covers(&self, photo: &Photo) -> bool {
        self.inner.covers(photo)
    }

    fn segment(
        &mut self,
        photo: &Photo,
        max_side_px: u32,
        observer: &mut dyn Observer,
    ) -> Result<Vec<FoundMask>, FindError> {
        let file = self.file(photo, max_side_px);
        let camera = photo.camera.limited_to(max_side_px);
        if let Some(kept) = read(&file, (camera.width_px, camera.height_px)) {
            return Ok(kept);
        }
        let found = self.inner.segment(photo, max_side_px, observer)?;
        // A failed write (a full disk) only costs time later.
        let _ = write(&file, &found);
        Ok(found)
    }
}

fn write(file: &Path, found: &[FoundMask]) -> std::io::Result<()> {
    let kept = |f: &FoundMask| CachedMask { level: f.level, parent: f.parent, mask: Rle::of(&f.mask) };
    let kept: Vec<CachedMask> = found.iter().map(kept).collect();
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let text = serde_json::to_vec(&kept)?;
    atomic::write(file, |w| w.write_all(&text)).map_err(std::io::Error::other)
}

/// Reads kept masks of this size; `None` if there are none, or they are damaged.
fn read(file: &Path, size_px: (u32, u32)) -> Option<Vec<FoundMask>> {
    let kept: Vec<CachedMask> = serde_json::from_slice(&files::read(file, MOST_BYTES).ok()?).ok()?;
    let found = |(i, kept): (usize, CachedMask)| {
        let fits = kept.mask.size_px() == size_px && kept.parent.is_none_or(|p| p < i);
        let mask = fits.then(|| kept.mask.mask().ok()).flatten()?;
        Some(FoundMask { level: kept.level, parent: kept.parent, name: None, mask })
    };
    kept.into_iter().enumerate().map(found).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::observer::Silent;
    use crate::scene::{Camera, Mask};
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// Finds two masks, and counts its calls.
    struct Counting(Arc<AtomicUsize>);

    impl Segmenter for Counting {
        fn name(&self) -> &str {
            "counting"
        }

        fn covers(&self, _: &Photo) -> bool {
            true
        }

        fn segment(&mut self, photo: &Photo, side: u32, _: &mut dyn Observer) -> Result<Vec<FoundMask>, FindError> {
            self.0.fetch_add(1, Ordering::Relaxed);
            let camera = photo.camera.limited_to(side);
            let (w, h) = (camera.width_px as usize, camera.height_px as usize);
            let mask = |most: usize| Mask::from_fn(w, h, |i| i % w < most && i / w > 2);
            let object = FoundMask { level: Level::Object, parent: None, name: None, mask: mask(20) };
            let part = FoundMask { level: Level::Part, parent: Some(0), name: None, mask: mask(5) };
            Ok(vec![object, part])
        }
    }

    #[test]
    fn a_photo_is_looked_at_once_per_network_setting_and_size() {
        let folder = tempfile::tempdir().expect("folder");
        let camera = Camera::look_at(glam::DVec3::ONE, glam::DVec3::ZERO, glam::DVec3::Z, 0.8, 64, 48).expect("valid");
        let photos = ["a.jpg", "b.jpg"].map(|name| Photo::new(name, format!("/one/{name}"), camera.clone()));
        let looks = Arc::new(AtomicUsize::new(0));
        let open = |with: &str| {
            let inner = Box::new(Counting(Arc::clone(&looks)));
            MaskCache::new(inner, folder.path().join("cache"), &[with.as_bytes()])
        };
        let first = open("one").segment(&photos[0], 64, &mut Silent).expect("found");
        let again = open("one").segment(&photos[0], 64, &mut Silent).expect("found");
        assert_eq!((looks.load(Ordering::Relaxed), first.len()), (1, 2));
        assert_eq!(first, again);
        // The controls: another photo, another size, another network.
        open("one").segment(&photos[1], 64, &mut Silent).expect("found");
        open("one").segment(&photos[0], 32, &mut Silent).expect("found");
        open("two").segment(&photos[0], 64, &mut Silent).expect("found");
        assert_eq!(looks.load(Ordering::Relaxed), 4);
        // Damaged masks are computed again.
        let file = open("one").file(&photos[0], 64);
        let bytes = std::fs::read(&file).expect("kept");
        std::fs::write(&file, &bytes[..bytes.len() / 2]).expect("written");
        assert_eq!(open("one").segment(&photos[0], 64, &mut Silent).expect("found"), first);
        assert_eq!(looks.load(Ordering::Relaxed), 5);
    }
}
