//! The folder of the trained demo: unpacked once, and again if it is damaged.

use std::fs;
use std::path::{Path, PathBuf};

use super::{BUNDLE, NAME, digest};
use crate::io::{IoError, atomic, bundle, scene_files, semantic_map, trained};
use crate::jobs::Folders;
use crate::math::format::things;
use crate::pipeline::observer::{Observer, Severity};

/// Returns the folder of the trained demo, unpacked if it does not exist. A user's changes stay: damaged photos are put
/// back; if the scene itself is damaged, all of it is unpacked anew and the damaged folder kept beside it.
///
/// # Errors
/// If it cannot be written.
pub(crate) fn unpacked(folders: &Folders, observer: &mut dyn Observer) -> Result<PathBuf, IoError> {
    let folder = folders.shipped_demo(&digest(BUNDLE)[..12]);
    if folder.exists() {
        match scene_of(&folder) {
            Ok(()) => {
                mend_files(&folder, observer)?;
                return Ok(folder);
            }
            Err(e) => {
                let aside = put_aside(&folder)?;
                let text = format!(
                    "The demo was damaged ({e}) and is unpacked again; what was there is kept in {}",
                    aside.display()
                );
                observer.note(Severity::Warning, text);
            }
        }
    }
    match bundle::unpack(BUNDLE, &folder) {
        // Another process unpacked it at the same time.
        Err(_) if trained::is_scene(&folder.join("scene")) => Ok(folder),
        result => result.map(|()| folder),
    }
}

/// Checks that the demo's scene can be read, with its objects.
fn scene_of(folder: &Path) -> Result<(), IoError> {
    let folder = &folder.join("scene");
    let scene = trained::load(folder)?;
    match semantic_map::load(folder, scene.state.as_deref(), &scene.cloud)? {
        Some(_) => Ok(()),
        None => {
            Err(IoError::Read { path: folder.join(semantic_map::FILE), cause: std::io::ErrorKind::NotFound.into() })
        }
    }
}

/// Moves a folder to a free place beside it.
fn put_aside(folder: &Path) -> Result<PathBuf, IoError> {
    let place = |n: usize| folder.with_added_extension(format!("damaged-{n}"));
    let aside = (1..).map(place).find(|place| !place.exists()).unwrap_or_default();
    fs::rename(folder, &aside).map_err(|cause| IoError::Write {
        path: folder.into(),
        remedy: "the damaged demo cannot be moved away: close other programs that use it",
        cause,
    })?;
    Ok(aside)
}

/// Puts back missing or cut-off files beside the scene, which users do not edit.
fn mend_files(folder: &Path, observer: &mut dyn Observer) -> Result<(), IoError> {
    let is_scene = |name: &str| scene_files::FILES.iter().any(|file| name.strip_prefix("scene/") == Some(file));
    let mut mended = 0;
    for (name, size) in bundle::sizes(BUNDLE, Path::new(NAME))?.into_iter().filter(|(name, _)| !is_scene(name)) {
        let path = folder.join(&name);
        if fs::metadata(&path).is_ok_and(|m| m.len() == size) {
            continue;
        }
        let bytes = bundle::read(BUNDLE, &name, Path::new(NAME))?;
        let parent = path.parent().unwrap_or(folder);
        fs::create_dir_all(parent).and_then(|()| if path.is_dir() { fs::remove_dir(&path) } else { Ok(()) }).map_err(
            |cause| IoError::Write { path: path.clone(), remedy: "the demo's file cannot be put back", cause },
        )?;
        atomic::write(&path, |w| w.write_all(&bytes))?;
        mended += 1;
    }
    if mended > 0 {
        let files = things(mended, "damaged or missing file");
        observer.note(Severity::Warning, format!("{files} of the demo in {} put back", folder.display()));
    }
    Ok(())
}
