//! What a scene is made of. Pure data: nothing here reads or writes files.

pub mod bounds;
pub mod camera;
pub mod camera_path;
pub mod cloud;
pub mod dataset;
pub mod history;
pub mod home_view;
pub mod identity;
pub mod language;
pub mod mask;
pub mod photo;
pub mod plan;
pub mod resource_log;
pub mod semantic_map;
pub mod text;
pub mod undo;

pub use bounds::Bounds;
pub use camera::{Camera, CameraError};
pub use camera_path::{CameraPath, PathError, PathKey};
pub use cloud::{CloudError, ExtraProperty, Gaussian, GaussianCloud};
pub use dataset::{Dataset, SparsePoint};
pub use history::{Evaluation, StepMetrics, ViewScore};
pub use home_view::HomeView;
pub use identity::{Identities, Identity, IdentityId, Level, LevelFilter, NOBODY};
pub use language::{LanguageFeatures, ViewFeatures};
pub use mask::{Mask, PixelBox};
pub use photo::{Distortion, Photo, PhotoPixels};
pub use plan::{Facts, Limits, Machine, Overrides, PlanLine, ScenePlan};
pub use semantic_map::SemanticMap;
