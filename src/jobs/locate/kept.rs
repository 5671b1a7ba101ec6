//! A scene in which photos are located one after another: looked at once, with the first photo, and for the next ones.

use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::Duration;

use super::{DEFAULT_PX, LocateJob, LocateOptions, LocatedPhoto};
use crate::io::file_stamp::FileStamp;
use crate::jobs::{JobError, OpenedScene, Scene, open};
use crate::pipeline::observer::{Observer, begin};
use crate::render::RenderSettings;
use crate::scene::GaussianCloud;

/// Time between two looks at whether another photo is still being located.
const PATIENCE: Duration = Duration::from_millis(20);

const OPTIONS: LocateOptions = LocateOptions { focal_px: None, finest_px: DEFAULT_PX, dataset: None };

#[derive(Default)]
struct Kept {
    job: Option<LocateJob>,
    /// Photos that were located, the newest last.
    known: Vec<(Option<FileStamp>, LocatedPhoto)>,
}

struct LocatorParts {
    scene: Scene,
    kept: Mutex<Kept>,
}

/// Locates photos in a scene. Copies share what is known.
#[derive(Clone)]
pub struct PhotoLocator(Arc<LocatorParts>);

impl PhotoLocator {
    /// Nothing is looked at before the first photo.
    pub(crate) fn new(scene: Scene) -> Self {
        Self(Arc::new(LocatorParts { scene, kept: Mutex::default() }))
    }

    /// Locates in `cloud`, the present Gaussians of the scene; `None` if no camera of it is known. `every` tells which
    /// photos are held out, if the scene does not.
    pub(crate) fn of_opened(
        opened: &OpenedScene,
        cloud: Arc<GaussianCloud>,
        settings: RenderSettings,
        every: usize,
    ) -> Option<Self> {
        let dataset = opened.dataset.as_deref();
        let mut scene = Scene { cloud, settings, ..opened.scene.clone() };
        if scene.cameras.is_empty() {
            scene.cameras = open::cameras(dataset?, every);
        }
        match (dataset, &opened.remote) {
            // Paths of another computer name nothing here.
            (_, Some(_)) => scene.dataset_path = None,
            (Some(dataset), None) => scene.dataset_path = Some(dataset.source().to_path_buf()),
            (None, None) => {}
        }
        (!scene.cameras.is_empty()).then(|| Self::new(scene))
    }

    /// Returns whether it locates in these Gaussians, drawn in this way.
    pub(crate) fn is_of(&self, cloud: &Arc<GaussianCloud>, settings: &RenderSettings) -> bool {
        Arc::ptr_eq(&self.0.scene.cloud, cloud) && self.0.scene.settings == *settings
    }

    /// Locates a photo, or returns what is known of it if its file is the same. What is wrong with the photo is part of
    /// the answer.
    ///
    /// # Errors
    /// If the observer asks to stop, or the scene cannot be looked at.
    pub(crate) fn locate(&self, path: &Path, observer: &mut dyn Observer) -> Result<LocatedPhoto, JobError> {
        let path = path.canonicalize().unwrap_or_else(|_| path.into());
        let stamp = FileStamp::of(&path).ok();
        let mut kept = self.lock(observer)?;
        if let Some((_, found)) = kept.known.iter().find(|(known, found)| *known == stamp && found.photo == path) {
            return Ok(found.clone());
        }
        let job = match kept.job.take() {
            Some(job) => job,
            None => LocateJob::new(&self.0.scene, &OPTIONS, observer)?,
        };
        let job = kept.job.insert(job);
        begin("Matching the photo", observer)?;
        let found = job.locate(&path, &OPTIONS, observer)?;
        kept.known.retain(|(_, known)| known.photo != path);
        kept.known.push((stamp, found.clone()));
        Ok(found)
    }

    /// Waits until no other photo is being located.
    fn lock(&self, observer: &dyn Observer) -> Result<MutexGuard<'_, Kept>, JobError> {
        loop {
            match self.0.kept.try_lock() {
                Ok(kept) => return Ok(kept),
                Err(TryLockError::Poisoned(kept)) => return Ok(PoisonError::into_inner(kept)),
                Err(TryLockError::WouldBlock) => observer.proceed()?,
            }
            std::thread::sleep(PATIENCE);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jobs::locate::testing::{TestPlace, photo_of};
    use crate::pipeline::observer::Silent;
    use crate::pipeline::observer::testing::StopsAfter;

    #[test]
    fn a_photo_is_located_once_and_again_when_its_file_changes() {
        let place = TestPlace::new();
        let locator = PhotoLocator::new(place.scene());
        let first = locator.locate(&place.photo, &mut Silent).expect("looked for");
        assert!(first.located, "{first:?}");
        let again = locator.locate(&place.photo, &mut Silent).expect("known");
        assert!(again.secs == first.secs, "nothing was done again");
        // The control: another picture under the same name.
        photo_of(&place.photo, 2);
        let other = locator.locate(&place.photo, &mut Silent).expect("looked for");
        assert!(!other.located, "{other:?}");
        assert!(other.problem.is_some_and(|p| p.contains("does not show this scene")));
    }

    #[test]
    fn it_stops_when_asked_and_goes_on_with_the_next_photo() {
        let place = TestPlace::new();
        let locator = PhotoLocator::new(place.scene());
        assert!(locator.locate(&place.photo, &mut StopsAfter::new(0)).expect_err("stopped").is_cancelled());
        assert!(locator.locate(&place.photo, &mut Silent).expect("looked for").located);
        let gone = locator.locate(&place.photo.with_file_name("gone.jpg"), &mut Silent).expect("told");
        assert!(!gone.located && gone.problem.is_some_and(|p| p.contains("gone.jpg")));
    }

    #[test]
    fn without_cameras_there_is_nothing_to_look_around_and_other_gaussians_need_another_one() {
        let place = TestPlace::new();
        let scene = place.scene();
        let (cloud, settings) = (Arc::clone(&scene.cloud), scene.settings.clone());
        let opened = OpenedScene { scene, ..OpenedScene::default() };
        let locator = PhotoLocator::of_opened(&opened, Arc::clone(&cloud), settings.clone(), 8).expect("cameras");
        assert!(locator.is_of(&cloud, &settings));
        assert!(!locator.is_of(&Arc::new((*cloud).clone()), &settings));
        let bare =
            OpenedScene { scene: Scene { cameras: Vec::new(), ..opened.scene.clone() }, ..OpenedScene::default() };
        assert!(PhotoLocator::of_opened(&bare, cloud, settings, 8).is_none());
    }
}
