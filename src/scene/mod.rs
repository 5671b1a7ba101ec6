//! What a scene is made of. Pure data: nothing here reads or writes files.

pub(crate) mod appearance;
pub(crate) mod bounds;
pub(crate) mod camera;
pub(crate) mod camera_path;
pub(crate) mod cloud;
pub(crate) mod crop;
pub(crate) mod dataset;
pub(crate) mod findings;
pub(crate) mod history;
pub(crate) mod home_view;
pub(crate) mod identity;
pub(crate) mod language;
pub(crate) mod mask;
pub(crate) mod photo;
pub mod plan;
pub(crate) mod preparation;
pub mod resource_log;
pub(crate) mod semantic_map;
pub(crate) mod text;
pub(crate) mod undo;

pub use bounds::Bounds;
pub use camera::{Camera, CameraError};
pub(crate) use camera_path::{CameraPath, PathError, PathKey};
pub use cloud::{CloudError, ExtraProperty, Gaussian, GaussianCloud, SplatRenderMode};
pub use crop::CropBox;
pub use dataset::{Dataset, SparsePoint};
pub use findings::Findings;
pub use history::{Evaluation, StepMetrics, ViewScore};
pub(crate) use home_view::HomeView;
pub use identity::{Identities, Identity, IdentityId, Level, LevelFilter, NOBODY};
pub use language::{LanguageFeatures, ViewFeatures};
pub use mask::{Mask, PixelBox};
pub use photo::{Distortion, Photo, PhotoPixels};
pub use plan::{Limits, Machine, Overrides, PlanLine, SceneFacts, ScenePlan};
pub use preparation::{Lifting, MaskGrid, MaskPrompt, PART_WEIGHT, Preparation};
pub use semantic_map::SemanticMap;
