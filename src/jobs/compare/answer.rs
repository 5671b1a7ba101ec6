//! Answer of a scene to a phrase or to a pixel of the view that it looks at: relevancy, and masks by its own rule and by
//! the common one.

use std::borrow::Cow;
use std::path::Path;
use std::time::Instant;

use super::cell::{AnswerMs, ShownRelevancy};
use super::subject::CompareSubject;
use super::vectors::KnownVectors;
use crate::jobs::{JobError, export};
use crate::math::stats::median;
use crate::models::ModelError;
use crate::pipeline::semantics::evaluation::by_rule::{CutRule, PhraseInView};
use crate::pipeline::semantics::query::foreign::ForeignError;
use crate::pipeline::semantics::query::foreign::own_rules::ForeignMask;
use crate::pipeline::semantics::query::foreign::pointed::PointedPixel;
use crate::pipeline::semantics::query::timing::ms_since;
use crate::pipeline::semantics::relevancy::on_lerfs_scale;
use crate::pipeline::semantics::smoothing::largest;

/// Answer to a phrase in a view.
#[derive(Clone, Debug)]
pub(crate) struct PhraseAnswer {
    /// Relevancy of the level that the method chose, as it is, row-major.
    pub(crate) raw: Vec<f32>,
    /// The mask by the method's own rule, if it has one.
    pub(crate) own: Option<ForeignMask>,
    /// The mask by the rule that is the same for all.
    pub(crate) common: ForeignMask,
    /// Times of encoding and decoding; rendering is not in it.
    pub(crate) ms: AnswerMs,
}

impl PhraseAnswer {
    /// Asks a scene that looks at a view of `size` px; times are medians of `repeats` runs.
    ///
    /// Returns the reason for which the scene has no answer, if it has none.
    ///
    /// # Errors
    /// If a phrase cannot be encoded or rendering fails.
    pub(crate) fn of(
        scene: &mut CompareSubject,
        phrase: &str,
        size: (usize, usize),
        vectors: &mut KnownVectors<'_>,
        repeats: usize,
    ) -> Result<Result<Self, String>, JobError> {
        let (answer, ms) = match timed(scene, phrase, vectors, repeats) {
            Ok((levels, own, ms)) => (PhraseInView { levels, own, size }, ms),
            Err(e) => return problem(e).map(Err),
        };
        let Some(common) = answer.mask(CutRule::Common) else {
            return Ok(Err("the phrase has no word to look for".into()));
        };
        // The level that the method chose, if it chose one.
        let level = answer.own.as_ref().map_or(common.level, |own| own.level).min(answer.levels.len() - 1);
        let raw = answer.levels.get(level).cloned().unwrap_or_default();
        Ok(Ok(Self { raw, own: answer.own, common, ms }))
    }

    /// Asks a scene what a pixel of its view belongs to.
    ///
    /// Returns the reason for which the scene has no answer, if it has none.
    ///
    /// # Errors
    /// If the pixel cannot be asked for.
    pub(crate) fn of_point(
        scene: &mut CompareSubject,
        pixel: PointedPixel,
        size: (usize, usize),
    ) -> Result<Result<Self, String>, JobError> {
        let start = Instant::now();
        let found = match scene.answers.pointed(pixel) {
            Ok(Some(found)) => found,
            Ok(None) => return Ok(Err("nothing is there".into())),
            Err(e) => return problem(e).map(Err),
        };
        let ms = AnswerMs { decode: ms_since(start), ..AnswerMs::default() };
        let raw = found.values.clone();
        let common = PhraseInView { levels: vec![raw.clone()], own: None, size }.mask(CutRule::Common);
        let common = common.unwrap_or_else(|| found.clone());
        Ok(Ok(Self { raw, own: Some(found), common, ms }))
    }

    /// Returns the relevancy of the pixels on a scale.
    pub(crate) fn values(&self, shown: ShownRelevancy) -> Cow<'_, [f32]> {
        match (shown, &self.own) {
            (ShownRelevancy::Raw, _) => Cow::Borrowed(&self.raw),
            (ShownRelevancy::Own, Some(own)) => Cow::Borrowed(&own.values),
            (ShownRelevancy::Lerf | ShownRelevancy::Own, _) => {
                let most = largest(&self.raw);
                Cow::Owned(self.raw.iter().map(|r| on_lerfs_scale(*r, most).clamp(0.0, 1.0)).collect())
            }
        }
    }

    /// Returns the mask by the method's own rule, or by the common one where it has none.
    pub(crate) fn mask(&self) -> &ForeignMask {
        self.own.as_ref().unwrap_or(&self.common)
    }

    /// Writes the arrays of all three scales into a folder.
    ///
    /// # Errors
    /// If they cannot be written.
    pub(super) fn write(&self, folder: &Path, name: &str) -> Result<(), JobError> {
        export::make_folder(folder)?;
        let size = [self.common.mask.width_px() as u32, self.common.mask.height_px() as u32];
        let write = |what: &str, shown: ShownRelevancy| {
            export::npy(&folder.join(format!("{name}_{what}.npy")), &self.values(shown), size)
        };
        write("raw", ShownRelevancy::Raw)?;
        write("lerf", ShownRelevancy::Lerf)?;
        if self.own.is_some() {
            write("own", ShownRelevancy::Own)?;
        }
        Ok(())
    }
}

type TimedAnswer = (Vec<Vec<f32>>, Option<ForeignMask>, AnswerMs);

/// Relevancy of all levels and the mask by the own rule, with the milliseconds of encoding and decoding.
fn timed(
    scene: &mut CompareSubject,
    phrase: &str,
    vectors: &mut KnownVectors<'_>,
    repeats: usize,
) -> Result<TimedAnswer, JobError> {
    let answers = &mut scene.answers;
    let encode = answers.encode(phrase, vectors)?;
    let (mut levels, mut decode) = (Vec::new(), Vec::with_capacity(repeats));
    for _ in 0..repeats {
        let start = Instant::now();
        levels = answers.levels(phrase, vectors)?;
        decode.push(ms_since(start));
    }
    let ms = AnswerMs { encode, decode: median(&decode), ..AnswerMs::default() };
    let own = answers.own_mask(phrase, &levels, vectors)?;
    Ok((levels, own, ms))
}

/// Returns why a scene has no answer; other errors stay errors.
fn problem(e: JobError) -> Result<String, JobError> {
    match e {
        JobError::Foreign(
            e @ (ForeignError::NoLanguage(_)
            | ForeignError::NoEncoder { .. }
            | ForeignError::NoClass { .. }
            | ForeignError::NoIdentities(_)
            | ForeignError::NoRule(_)
            | ForeignError::Dimension { .. }),
        ) => Ok(e.to_string()),
        JobError::Model(e @ ModelError::NoKnownWord { .. }) => Ok(e.to_string()),
        e => Err(e),
    }
}
