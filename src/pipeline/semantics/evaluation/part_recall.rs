//! `part-recall`, the paper's ablation: how many part queries are answered with a mask of IoU 0.5 or
//! more, as multilevel extraction (ME), semantic deviation (SD) and multilevel localization (ML) are
//! switched on one after another.

use super::{LabeledView, Unit};
use crate::math::stats::mean;
use crate::models::TextSource;
use crate::pipeline::semantics::query::by_embedding::TextEmbeddings;
use crate::pipeline::semantics::query::query_engine::ask_by_embedding;
use crate::pipeline::semantics::query::recipe::{MatchBy, PartEmbedding, QueryConfig, Strategy};
use crate::scene::{Identities, LanguageFeatures, Level, Mask, SemanticMap};

/// IoU from which a query counts as answered.
pub(crate) const HIT_IOU: f64 = 0.5;

#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub(crate) struct Components {
    /// Parts are extracted, not objects alone.
    pub(crate) extraction: bool,
    /// Parts' features are moved toward their objects'.
    pub(crate) deviation: bool,
    /// Localization in the paper's two steps.
    pub(crate) localization: bool,
    /// Part and whole at once, this program's default, instead of the two steps.
    pub(crate) joint: bool,
}

impl Components {
    /// The paper's rows, in its order, and this program's.
    pub(crate) const ROWS: [Self; 5] = [
        Self::of(false, false, false, false),
        Self::of(true, false, false, false),
        Self::of(true, true, false, false),
        Self::of(true, true, true, false),
        Self::of(true, true, false, true),
    ];

    const fn of(extraction: bool, deviation: bool, localization: bool, joint: bool) -> Self {
        Self { extraction, deviation, localization, joint }
    }

    /// The rows differ in these; all else is as the recipe says.
    fn recipe(self, recipe: &QueryConfig) -> QueryConfig {
        QueryConfig {
            match_by: MatchBy::Embedding,
            parts: if self.deviation { PartEmbedding::Deviated } else { PartEmbedding::Raw },
            strategy: match self {
                Self { joint: true, .. } => Strategy::Joint,
                Self { localization: true, .. } => Strategy::TwoSteps,
                _ => Strategy::OneStep,
            },
            ..recipe.clone()
        }
    }
}

#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub(crate) struct Row {
    pub(crate) components: Components,
    /// Share of part queries with an IoU of [`HIT_IOU`] or more.
    pub(crate) recall: f64,
    /// Mean IoU of the part queries.
    pub(crate) mean_iou: f64,
    /// Mean time of a query, its text's encoding included, seconds.
    pub(crate) mean_secs: f64,
    pub(crate) units: Vec<Unit>,
}

/// Asks for every part of the `views` by its phrase and compares, for one row of the table. `source`
/// gives the embeddings of phrases.
pub(crate) fn row<S: TextSource + ?Sized>(
    (components, recipe): (Components, &QueryConfig),
    map: &SemanticMap,
    language: &LanguageFeatures,
    views: &[LabeledView<'_>],
    source: &mut S,
) -> Result<Row, S::Error> {
    let objects = objects_alone(language, &map.identities);
    let features = if components.extraction { language } else { &objects };
    let (mut units, mut secs) = (Vec::new(), Vec::new());
    // Canonical phrases are encoded once for all queries.
    let mut phrases = TextEmbeddings::default();
    let recipe = components.recipe(recipe);
    phrases.learn_canonical(&recipe, source);
    for view in views {
        for category in view.categories.iter().filter(|c| c.level == Level::Part) {
            let start = std::time::Instant::now();
            let mut mask = Mask::empty(view.exact.width_px, view.exact.height_px);
            let answered =
                ask_by_embedding(&map.identities, (features, &recipe), &category.name, &mut phrases, source)?;
            // Recall asks for the place, so the best identity is the answer whatever its score.
            if let Some(best) = answered.iter().flat_map(|a| a.answer.hits()).next() {
                mask = view.exact.mask(&map.identities, best.identity);
            }
            secs.push(start.elapsed().as_secs_f64());
            let iou = mask.iou(&category.mask);
            units.push(category.unit(view.name, iou, None));
        }
    }
    let recall = units.iter().filter(|u| u.iou >= HIT_IOU).count() as f64 / units.len() as f64;
    let mean_iou = mean(&units.iter().map(|u| u.iou).collect::<Vec<_>>());
    Ok(Row { components, recall, mean_iou, mean_secs: mean(&secs), units })
}

/// Returns the features of a scene from which only objects were extracted.
pub(crate) fn objects_alone(language: &LanguageFeatures, identities: &Identities) -> LanguageFeatures {
    let mut objects = language.clone();
    for ((_, identity), features) in identities.iter().zip(&mut objects.by_identity) {
        if identity.level == Level::Part {
            *features = Default::default();
        }
    }
    objects
}
