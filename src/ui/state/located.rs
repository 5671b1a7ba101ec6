//! Photos that were located in the open scene. In lists, they follow the scene's own photos.

use std::path::{Path, PathBuf};

use super::AppState;
use crate::jobs::locate::LocatedPhoto;
use crate::scene::Photo;

/// Photo that was located, with its camera.
#[derive(Clone, Debug)]
pub struct PlacedPhoto {
    pub(crate) photo: Photo,
    pub(crate) found: LocatedPhoto,
}

/// Photos that are located in the open scene, as long as it is open.
#[derive(Clone, Debug, Default)]
pub struct LocatedPhotos {
    list: Vec<PlacedPhoto>,
    /// Counts the changes of the list.
    pub(crate) revision: u64,
    /// Files that were to be located, the newest last.
    pub(crate) given: Vec<PathBuf>,
    /// Files that are being located, or wait for it.
    pub(crate) running: Vec<PathBuf>,
}

impl LocatedPhotos {
    /// Adds a photo, in place of an earlier one from the same file; returns its place in the list if it was located.
    pub(crate) fn add(&mut self, found: LocatedPhoto) -> Option<usize> {
        let placed = PlacedPhoto { photo: found.posed()?, found };
        self.revision += 1;
        match self.place_of(&placed.photo.path) {
            Some(at) => {
                self.list[at] = placed;
                Some(at)
            }
            None => {
                self.list.push(placed);
                Some(self.list.len() - 1)
            }
        }
    }

    /// Removes the photo at a place of the list.
    pub(crate) fn remove(&mut self, at: usize) -> Option<PlacedPhoto> {
        self.revision += 1;
        (at < self.list.len()).then(|| self.list.remove(at))
    }

    /// Counts a file as the newest that was to be located.
    pub(crate) fn give(&mut self, path: PathBuf) {
        self.given.retain(|known| *known != path);
        self.given.push(path);
    }

    /// Place of the photo from a file.
    pub(crate) fn place_of(&self, path: &Path) -> Option<usize> {
        self.list.iter().position(|placed| placed.photo.path == path)
    }

    /// Files of all photos, in their order.
    pub(crate) fn files(&self) -> Vec<PathBuf> {
        self.list.iter().map(|placed| placed.photo.path.clone()).collect()
    }

    /// Number of photos.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Returns whether no photo was located.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }
}

impl AppState {
    /// Number of photos of the scene itself.
    pub(crate) fn own_photos(&self) -> usize {
        self.scene.as_ref().and_then(|scene| scene.dataset.as_ref()).map_or(0, |dataset| dataset.photos.len())
    }

    /// Number of all photos.
    pub(crate) fn photo_count(&self) -> usize {
        self.own_photos() + self.located.len()
    }

    /// The photo with this index: one of the scene, or a located one.
    pub(crate) fn photo(&self, index: usize) -> Option<&Photo> {
        let dataset = self.scene.as_ref().and_then(|scene| scene.dataset.as_ref());
        let own = dataset.and_then(|dataset| dataset.photos.get(index));
        own.or_else(|| self.placed(index).map(|placed| &placed.photo))
    }

    /// The located photo with this index; `None` for photos of the scene.
    pub(crate) fn placed(&self, index: usize) -> Option<&PlacedPhoto> {
        self.located.list.get(index.checked_sub(self.own_photos())?)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec3;

    use super::*;
    use crate::jobs::OpenedScene;
    use crate::jobs::locate::testing::found;
    use crate::scene::{Camera, Dataset};

    #[test]
    fn located_photos_follow_those_of_the_scene_once_each_and_go_with_it() {
        let camera = Camera::look_at(DVec3::ONE, DVec3::ZERO, DVec3::Z, 0.8, 64, 48).expect("valid");
        let own = Photo::new("own.jpg", "/photos/own.jpg", camera.clone());
        let dataset = Dataset { photos: vec![own], ..Dataset::default() };
        let scene = || OpenedScene { dataset: Some(Arc::new(dataset.clone())), ..OpenedScene::default() };
        let mut state = AppState::new(Vec::new());
        state.opened(scene(), true);
        let add = |state: &mut AppState, name: &str, is_located| {
            state.located.add(LocatedPhoto { located: is_located, ..found(Path::new(name), camera.clone()) })
        };
        assert_eq!(add(&mut state, "/a.jpg", true), Some(0));
        assert_eq!(add(&mut state, "/b.jpg", true), Some(1));
        assert_eq!(add(&mut state, "/a.jpg", true), Some(0), "the same file again");
        assert_eq!(add(&mut state, "/c.jpg", false), None, "the control: it was not located");
        let names =
            |state: &AppState| (0..5).map_while(|i| state.photo(i)).map(|p| p.title().into_owned()).collect::<Vec<_>>();
        assert_eq!((names(&state), state.photo_count()), (vec!["own.jpg".into(), "a.jpg".into(), "b.jpg".into()], 3));
        assert!(state.placed(0).is_none() && state.placed(1).is_some() && state.placed(3).is_none());
        assert_eq!(state.located.files(), [PathBuf::from("/a.jpg"), "/b.jpg".into()]);
        assert!(state.located.remove(0).is_some() && state.located.remove(9).is_none());
        assert_eq!(names(&state), ["own.jpg", "b.jpg"]);
        state.opened(scene(), true);
        assert_eq!(names(&state), ["own.jpg"], "they go with the scene");
    }
}
