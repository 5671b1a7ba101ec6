//! Answers of a result without language whose classes have names.

use super::phrase_answers::PhraseAnswers;
use super::vectors::KnownVectors;
use crate::jobs::JobError;
use crate::pipeline::semantics::query::foreign::asked::{ForeignScene, ForeignView};
use crate::pipeline::semantics::query::foreign::own_rules::ForeignMask;
use crate::pipeline::semantics::query::foreign::pointed::PointedPixel;
use crate::render::Renderer;
use crate::scene::Camera;

/// A result with named classes, and its view.
pub(super) struct ClassAnswers {
    scene: ForeignScene,
    renderer: Renderer,
    view: Option<ForeignView>,
}

impl ClassAnswers {
    pub(super) fn new(scene: ForeignScene) -> Self {
        Self { scene, renderer: Renderer::new(), view: None }
    }
}

impl PhraseAnswers for ClassAnswers {
    fn look(&mut self, camera: &Camera) -> Result<(), JobError> {
        self.view = Some(self.scene.look(&mut self.renderer, camera)?);
        Ok(())
    }

    /// A name is not encoded.
    fn encode(&mut self, _: &str, _: &mut KnownVectors<'_>) -> Result<f64, JobError> {
        Ok(0.0)
    }

    fn levels(&mut self, phrase: &str, _: &mut KnownVectors<'_>) -> Result<Vec<Vec<f32>>, JobError> {
        let Some(view) = &self.view else { return Ok(Vec::new()) };
        Ok(vec![self.scene.share_of_name(view, phrase)?])
    }

    fn own_mask(
        &mut self,
        phrase: &str,
        _: &[Vec<f32>],
        _: &mut KnownVectors<'_>,
    ) -> Result<Option<ForeignMask>, JobError> {
        let Some(view) = &self.view else { return Ok(None) };
        Ok(Some(self.scene.mask_of_name(view, phrase)?))
    }

    fn pointed(&mut self, pixel: PointedPixel) -> Result<Option<ForeignMask>, JobError> {
        let Some(view) = &self.view else { return Ok(None) };
        Ok(self.scene.pointed(view, pixel)?)
    }
}
