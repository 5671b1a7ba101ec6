//! Photos of the open scene, from this computer or from the one that holds the scene.

use super::{JobInfo, QueueFull, Task, Tasks};
use crate::io;
use crate::scene::{Photo, PhotoPixels};

/// Loads the photo with this index, at most so many px along its longer side, from another computer. `None` if too many
/// requests wait.
pub(crate) type RemotePhotos = Box<dyn Fn(usize, &Photo, u32) -> Option<Task<PhotoPixels>> + Send>;

/// Loads a photo, undistorted and at most `max_side_px` along its longer side. `index` is its place in the data set;
/// without one, it is a file of this computer.
pub(crate) fn load_photo(
    tasks: &Tasks,
    index: Option<usize>,
    photo: &Photo,
    max_side_px: u32,
) -> Result<Task<PhotoPixels>, QueueFull> {
    if let Some((remote, index)) = tasks.remote_photos().zip(index) {
        return remote(index, photo, max_side_px).ok_or(QueueFull);
    }
    let photo = photo.clone();
    let info = JobInfo::short(format!("Loading {}", photo.name)).aside();
    tasks.spawn(info, move |_| io::photo::load(&photo, max_side_px))
}
