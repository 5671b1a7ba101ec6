//! Files: one per format, and one [`open()`] that sniffs.
//!
//! Readers never trust a length field: each is compared with the file's real size before memory is allocated, and paths
//! inside a dataset may not leave its folder. Every error names the file and the place in it.

mod alpha;
pub(crate) mod atomic;
pub(crate) mod bundle;
pub mod camera_file;
pub mod camera_path;
pub(crate) mod claim;
pub mod colmap;
mod commit;
mod compressed_ply;
pub(crate) mod data_folder;
pub(crate) mod error;
pub(crate) mod exif;
pub(crate) mod file_stamp;
pub(crate) mod files;
mod finite;
pub(crate) mod folder_lock;
pub mod gltf_mesh;
pub(crate) mod gs_output;
pub(crate) mod http;
pub(crate) mod joined;
pub mod khr_gltf;
pub mod ksplat;
pub mod labels;
mod lenses;
pub mod llff;
pub(crate) mod measurements;
pub(crate) mod memory;
mod morton;
pub mod npy;
mod open;
pub(crate) mod page;
pub mod photo;
mod photo_list;
pub(crate) mod photo_source;
mod pixel_masks;
mod ply;
pub mod points_ply;
mod posed;
pub(crate) mod program;
mod quantized;
mod reader;
mod removed;
mod render_mode;
mod resample;
pub mod results;
pub(crate) mod scene_copy;
pub(crate) mod scene_files;
pub(crate) mod scene_folder;
pub(crate) mod scene_info;
pub mod semantic_map;
mod shift;
pub(crate) mod snapshot;
pub mod sog;
pub mod splat;
pub(crate) mod splat_format;
pub mod splat_ply;
mod splits;
pub mod spz;
pub(crate) mod temporary;
#[cfg(test)]
mod test_clouds;
pub(crate) mod torch;
pub mod trained;
pub(crate) mod trainings;
pub mod transforms;
pub(crate) mod unposed;
mod vertical;
pub(crate) mod video;

pub use error::{IoError, OpenError};
pub use open::{Opened, open, open_in};
pub(crate) use open::{data_set_around, open_beside};
pub use scene_folder::SceneFolder;
pub(crate) use trained::TrainedScene;
