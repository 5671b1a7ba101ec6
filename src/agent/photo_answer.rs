//! Sentences about a photo that was located.

use std::sync::atomic::AtomicBool;

use super::describe::{in_view, names};
use super::world::{World, WorldError};
use crate::math::format::short;

/// Objects that a photo is said to show, at most.
const MOST_OBJECTS: usize = 6;

/// Locates a photo, the last one without a name, and says where it was taken and what it shows.
pub(super) fn taken(world: &mut dyn World, photo: Option<&str>, cancel: &AtomicBool) -> Result<String, WorldError> {
    let sight = world.locate_photo(photo, cancel)?;
    let [x, y, z] = sight.center.to_array().map(|v| format!("{v:.3}"));
    let sure = sight.deviation.as_ref().map_or_else(String::new, |sure| format!(" ({sure})"));
    let shows = match in_view(world).as_slice() {
        [] => String::new(),
        seen => format!(" It shows {}.", names(world, seen, MOST_OBJECTS)),
    };
    Ok(format!(
        "{} was taken at ({x}, {y}, {z}){sure}. The scene explains {} of it.{shows}",
        sight.name,
        percent(sight.explained)
    ))
}

/// Shows the difference of the last photo from the scene, and says how much it is.
pub(super) fn changed(world: &mut dyn World, cancel: &AtomicBool) -> Result<String, WorldError> {
    let sight = world.show_changes(cancel)?;
    let rest = percent(1.0 - sight.explained);
    Ok(format!(
        "{rest} of {} is not as the scene has it. The difference is bright where something has changed; the photo's exposure is left out.",
        sight.name
    ))
}

/// Adds photos to the scene, and says what is made.
pub(super) fn added(world: &mut dyn World, photos: Option<&str>) -> Result<String, WorldError> {
    let what = world.add_photos(photos)?;
    Ok(format!("Adding {what}: a training makes a better scene in a folder of its own; this one stays as it is."))
}

fn percent(share: f64) -> String {
    format!("{} %", short((100.0 * share.clamp(0.0, 1.0)).round()))
}
