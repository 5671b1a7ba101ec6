//! Photos that the agent locates in the scene.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use super::{Effect, SceneWorld, moves};
use crate::agent::world::{PhotoSight, WorldError};
use crate::jobs::error::chain;
use crate::jobs::locate::kept::PhotoLocator;
use crate::jobs::locate::{LocatedPhoto, file_name};
use crate::math::format::things;
use crate::navigate::Pose;
use crate::pipeline::observer::{Observer, Signal};

/// Photos that a scene is asked about.
#[derive(Clone, Default)]
pub struct ScenePhotos {
    /// `None` if photos cannot be located in the scene.
    pub(crate) locator: Option<PhotoLocator>,
    /// Files that the user has given, the newest last.
    pub(crate) given: Vec<PathBuf>,
}

impl ScenePhotos {
    /// The file that is meant: a given one of this name, or that at this path; without a name, the newest.
    fn file(&self, photo: Option<&str>) -> Result<PathBuf, WorldError> {
        let Some(photo) = photo else {
            let newest = self.given.last().cloned();
            return newest.ok_or_else(|| {
                WorldError("no photo was given yet: name its file, or drop it on the view of the window".into())
            });
        };
        let is_meant = |given: &&PathBuf| {
            let name = given.file_name().map(|name| name.to_string_lossy());
            name.is_some_and(|name| name.eq_ignore_ascii_case(photo)) || given.as_path() == Path::new(photo)
        };
        let known = self.given.iter().rev().find(is_meant).cloned();
        let path = known.unwrap_or_else(|| PathBuf::from(photo));
        match path.is_file() {
            true => Ok(path),
            false => Err(WorldError(format!("there is no file '{photo}': give its path"))),
        }
    }

    /// Files and folders that are meant: the given file of this name, or what is at this path; without a name, all given
    /// files.
    fn added(&self, photos: Option<&str>) -> Result<Vec<PathBuf>, WorldError> {
        match photos {
            Some(path) if Path::new(path).is_dir() => Ok(vec![path.into()]),
            None if !self.given.is_empty() => Ok(self.given.clone()),
            photo => Ok(vec![self.file(photo)?]),
        }
    }
}

/// Adds photos to the scene, and returns their name or number.
pub(super) fn add(scene: &mut SceneWorld, photos: Option<&str>) -> Result<String, WorldError> {
    let paths = scene.photos.added(photos)?;
    if scene.parts.folder.is_none() {
        return Err(WorldError("photos are added only to a trained scene with a folder of its own".into()));
    }
    let said = match paths.as_slice() {
        [one] => file_name(one),
        all => things(all.len(), "photo"),
    };
    (scene.emit)(Effect::AddPhotos(paths));
    Ok(said)
}

/// Observer of a request of the agent.
struct RequestObserver<'a>(&'a AtomicBool);

impl Observer for RequestObserver<'_> {
    fn signal(&self) -> Signal {
        if self.0.load(Ordering::Relaxed) { Signal::Cancel } else { Signal::Continue }
    }
}

/// Locates a photo, flies there, and compares it with the view; with `differs`, shows the difference.
pub(super) fn locate(
    scene: &mut SceneWorld,
    photo: Option<&str>,
    differs: bool,
    cancel: &AtomicBool,
) -> Result<PhotoSight, WorldError> {
    let path = scene.photos.file(photo)?;
    let locator = scene.photos.locator.clone();
    let locator = locator.ok_or_else(|| {
        WorldError("no photo or camera of this scene is known, around which photos are looked for".into())
    })?;
    let found = locator.locate(&path, &mut RequestObserver(cancel)).map_err(|e| WorldError(chain(&e)))?;
    scene.photos.given.retain(|known| *known != path && *known != found.photo);
    scene.photos.given.push(found.photo.clone());
    let sight = go_to(scene, &found)?;
    (scene.emit)(Effect::Located(Box::new(found), differs));
    Ok(sight)
}

/// Flies to where a photo was taken.
fn go_to(scene: &mut SceneWorld, found: &LocatedPhoto) -> Result<PhotoSight, WorldError> {
    let Some(place) = found.place.as_ref().filter(|_| found.located) else {
        return Err(WorldError(found.refusal_text()));
    };
    let camera = &place.camera;
    let to = Pose::of(camera);
    if to != scene.eye {
        moves::fly_pose(scene, to, format!("going to {}", found.name())).map_err(|e| WorldError(e.reason))?;
    }
    scene.aspect = f64::from(camera.width_px) / f64::from(camera.height_px);
    Ok(PhotoSight {
        name: found.name(),
        center: camera.center,
        deviation: place.deviation_text(scene.parts.meters),
        explained: place.explained,
    })
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use glam::DVec3;

    use super::*;
    use crate::agent::commands::Commands;
    use crate::agent::scene::AgentScene;
    use crate::agent::{Policy, Reply, Session};
    use crate::jobs::locate::testing::{TestPlace, truth};
    use crate::scene::{Identities, Level, NO_IDENTITY, SemanticMap};

    type Effects = Arc<Mutex<Vec<Effect>>>;

    /// The made-up place, one half of which is the floor, seen from a camera far from the photo's.
    fn world(place: &TestPlace) -> (SceneWorld, Effects) {
        let scene = place.scene();
        let mut identities = Identities::default();
        let floor = identities.add(Level::Object, NO_IDENTITY, vec!["floor".into()]);
        identities.add(Level::Object, NO_IDENTITY, vec!["hills".into()]);
        let of: Vec<u32> = (0..scene.cloud.len()).map(|i| floor + (i % 2) as u32).collect();
        let certainty = vec![1.0; of.len()];
        let parts = AgentScene {
            cloud: Arc::clone(&scene.cloud),
            settings: scene.settings.clone(),
            map: Arc::new(SemanticMap::from_identities(identities, of, certainty, Vec::new())),
            cameras: scene.views(),
            up: DVec3::Z,
            meters: None,
            exports: PathBuf::new(),
            folder: None,
            recipe: Default::default(),
            explored: None,
        };
        let (effects, eye) = (Effects::default(), Pose::of(&scene.cameras[9].camera));
        let told = Arc::clone(&effects);
        let emit = Box::new(move |effect| told.lock().expect("no panic").push(effect));
        let mut world = SceneWorld::new(parts, eye, 1.5, emit).expect("a world");
        world.photos.locator = Some(PhotoLocator::new(scene));
        (world, effects)
    }

    fn session() -> Session {
        Session::new(Policy::built_in().expect("policy"), Box::new(Commands::default()))
    }

    fn say(session: &mut Session, world: &mut SceneWorld, text: &str) -> Reply {
        session.say(world, text, &mut |_| {}, &AtomicBool::new(false))
    }

    /// Photos that were shown, and whether as differences.
    fn shown(effects: &Effects) -> Vec<(String, bool)> {
        let located = |effect: &Effect| match effect {
            Effect::Located(photo, differs) => Some((photo.name(), *differs)),
            _ => None,
        };
        effects.lock().expect("no panic").iter().filter_map(located).collect()
    }

    #[test]
    fn a_photo_is_found_by_its_file_and_then_spoken_of() {
        let place = TestPlace::new();
        let ((mut world, effects), mut session) = (world(&place), session());
        let reply = say(&mut session, &mut world, &format!("where was \"{}\" taken?", place.photo.display()));
        assert!(reply.refused.is_none(), "{reply:?}");
        for part in ["photo.png was taken at (", "\u{b1}", "The scene explains", "It shows", "floor", "hills"] {
            assert!(reply.text.contains(part), "{part}: {}", reply.text);
        }
        assert!(world.eye().center.distance(truth().center) < 0.05, "the camera is there");
        let last_two: Vec<bool> =
            effects.lock().expect("no panic").iter().rev().take(2).map(|e| matches!(e, Effect::Fly(..))).collect();
        assert_eq!(last_two, [false, true], "it flies, then the photo is shown");
        assert_eq!(shown(&effects), [("photo.png".to_owned(), false)]);
        let reply = say(&mut session, &mut world, "What has changed?");
        assert!(reply.text.contains("% of photo.png is not as the scene has it"), "{}", reply.text);
        assert_eq!(shown(&effects)[1..], [("photo.png".to_owned(), true)]);
        let reply = say(&mut session, &mut world, "locate photo.png");
        assert!(reply.refused.is_none(), "its name is enough now: {}", reply.text);
    }

    #[test]
    fn a_photo_that_was_given_needs_no_name() {
        let place = TestPlace::new();
        let ((mut world, effects), mut session) = (world(&place), session());
        let reply = say(&mut session, &mut world, "where was this taken?");
        assert!(reply.refused.is_some() && reply.text.contains("No photo was given yet"), "{}", reply.text);
        world.photos.given.push(place.photo.clone());
        assert!(say(&mut session, &mut world, "where was this photo taken?").refused.is_none());
        assert_eq!(shown(&effects).len(), 1);
    }

    #[test]
    fn photos_and_folders_are_added_to_a_scene_that_has_a_folder() {
        let place = TestPlace::new();
        let ((mut world, effects), mut session) = (world(&place), session());
        let added = |effects: &Effects| {
            let of = |effect: &Effect| if let Effect::AddPhotos(paths) = effect { Some(paths.clone()) } else { None };
            effects.lock().expect("no panic").iter().filter_map(of).collect::<Vec<_>>()
        };
        let folder = place.photo.parent().expect("a folder").to_path_buf();
        let sentence = format!("add the photos in \"{}\"", folder.display());
        let reply = say(&mut session, &mut world, &sentence);
        assert!(reply.refused.is_some() && reply.text.contains("with a folder of its own"), "{}", reply.text);
        world.parts.folder = Some(folder.clone());
        for (sentence, why) in [("add these photos", "No photo was given yet"), ("add gone.jpg", "There is no file")] {
            let reply = say(&mut session, &mut world, sentence);
            assert!(reply.refused.is_some() && reply.text.contains(why), "{}", reply.text);
        }
        assert!(added(&effects).is_empty());
        let reply = say(&mut session, &mut world, &sentence);
        assert!(reply.refused.is_none() && reply.text.contains("this one stays as it is"), "{}", reply.text);
        world.photos.given = vec![place.photo.clone(), place.other_photo()];
        assert!(say(&mut session, &mut world, "add photo.png to the scene").refused.is_none(), "its name is enough");
        let reply = say(&mut session, &mut world, "add these photos to the scene");
        assert!(reply.text.contains("2 photos"), "{}", reply.text);
        let given = world.photos.given.clone();
        assert_eq!(added(&effects), [vec![folder], vec![place.photo.clone()], given]);
    }

    #[test]
    fn photos_of_other_things_and_files_that_are_not_there_are_refused() {
        let place = TestPlace::new();
        let ((mut world, effects), mut session) = (world(&place), session());
        let before = world.eye();
        for (file, why) in [
            (place.other_photo(), "No place was found for other.png: it does not show this scene"),
            (place.photo.with_file_name("gone.jpg"), "There is no file"),
        ] {
            let reply = say(&mut session, &mut world, &format!("locate \"{}\"", file.display()));
            assert!(reply.refused.is_some() && reply.text.contains(why), "{}", reply.text);
        }
        assert!(shown(&effects).is_empty() && world.eye() == before, "nothing has moved");
        let stopped = AtomicBool::new(true);
        let refused = locate(&mut world, place.photo.to_str(), false, &stopped).expect_err("stopped");
        assert!(refused.0.contains("cancel"), "{refused}");
        world.photos.locator = None;
        let reply = say(&mut session, &mut world, &format!("locate \"{}\"", place.photo.display()));
        assert!(reply.text.contains("camera of this scene is known"), "{}", reply.text);
    }
}
