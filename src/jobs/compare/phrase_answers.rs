//! Questions of a comparison to a scene of any method.

use super::vectors::KnownVectors;
use crate::jobs::JobError;
use crate::pipeline::semantics::query::foreign::own_rules::ForeignMask;
use crate::pipeline::semantics::query::foreign::pointed::PointedPixel;
use crate::scene::Camera;

/// Answers of a scene to phrases and clicks.
pub(crate) trait PhraseAnswers {
    /// Renders what phrases need of a view.
    fn look(&mut self, camera: &Camera) -> Result<(), JobError>;

    /// Encodes a phrase; returns the milliseconds that it takes.
    fn encode(&mut self, phrase: &str, vectors: &mut KnownVectors<'_>) -> Result<f64, JobError>;

    /// Relevancy of each level at each pixel of the view, row-major, 0 to 1.
    fn levels(&mut self, phrase: &str, vectors: &mut KnownVectors<'_>) -> Result<Vec<Vec<f32>>, JobError>;

    /// The mask by the scene's own rule, if it has one, from the relevancy of [`Self::levels`].
    fn own_mask(
        &mut self,
        phrase: &str,
        levels: &[Vec<f32>],
        vectors: &mut KnownVectors<'_>,
    ) -> Result<Option<ForeignMask>, JobError>;

    /// The mask of what a pixel of the view belongs to; `None` where nothing is.
    fn pointed(&mut self, pixel: PointedPixel) -> Result<Option<ForeignMask>, JobError>;
}
