//! Content of a comparison: a cell for each phrase, view and scene, and means of each scene.

use serde::Serialize;

use super::views::ComparedView;
use crate::math::stats::{mean, median};
use crate::pipeline::semantics::evaluation::by_rule::hit;
use crate::pipeline::semantics::query::foreign::own_rules::ForeignMask;

/// Mask of a phrase by a rule.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct RuledCell {
    /// The rule in words.
    pub(crate) rule: &'static str,
    /// Level that it was taken from, from 0.
    pub(crate) level: usize,
    pub(crate) area_px: usize,
    /// Share of the view.
    pub(crate) share: f64,
    /// IoU with the label, if there is one.
    pub(crate) iou: Option<f64>,
    /// True if the pixel that the rule points at is in a box of the label.
    pub(crate) hit: Option<bool>,
}

impl RuledCell {
    pub(super) fn new(found: &ForeignMask, view: &ComparedView, phrase: &str) -> Self {
        let (category, area_px) = (view.category(phrase), found.mask.area());
        Self {
            rule: found.rule,
            level: found.level,
            area_px,
            share: area_px as f64 / (found.mask.width_px() * found.mask.height_px()).max(1) as f64,
            iou: category.map(|category| found.mask.iou(&category.mask)),
            hit: category.and_then(|category| hit(found, category)),
        }
    }
}

/// Milliseconds of an answer: medians of the repeats.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct AnswerMs {
    /// From the phrase to its vector.
    pub(crate) encode: f64,
    /// Rendering of what all phrases of a view need.
    pub(crate) blend: f64,
    /// From vector and rendering to the relevancy of all levels.
    pub(crate) decode: f64,
}

/// A phrase asked of a scene in a view.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct ComparedCell {
    pub(crate) view: String,
    pub(crate) phrase: String,
    pub(crate) method: String,
    /// Reason for which there is no answer.
    pub(crate) problem: Option<String>,
    /// Largest relevancy, as it is.
    pub(crate) most: Option<f32>,
    /// Mask by the method's own rule.
    pub(crate) own: Option<RuledCell>,
    /// Mask by the rule that is the same for all.
    pub(crate) common: Option<RuledCell>,
    pub(crate) ms: AnswerMs,
}

/// A scene and its means over all cells.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct ComparedMethod {
    pub(crate) method: String,
    pub(crate) path: String,
    pub(crate) gaussians: usize,
    /// Encoder of phrases, if any.
    pub(crate) encoder: Option<String>,
    /// Its own rule in words.
    pub(crate) own_rule: Option<&'static str>,
    /// Cells with a label.
    pub(crate) compared: usize,
    pub(crate) own_miou: Option<f64>,
    pub(crate) common_miou: Option<f64>,
    pub(crate) own_localization: Option<f64>,
    pub(crate) common_localization: Option<f64>,
    /// Medians over all answers.
    pub(crate) ms: AnswerMs,
}

impl ComparedMethod {
    /// Adds the means of a scene's cells.
    pub(super) fn with_means(mut self, cells: &[ComparedCell]) -> Self {
        let cells: Vec<&ComparedCell> = cells.iter().filter(|c| c.method == self.method).collect();
        let of = |value: &dyn Fn(&ComparedCell) -> Option<f64>| {
            let all: Vec<f64> = cells.iter().filter_map(|c| value(c)).collect();
            (!all.is_empty()).then(|| mean(&all))
        };
        let hit = |cell: &Option<RuledCell>| cell.as_ref()?.hit.map(f64::from);
        self.own_miou = of(&|c| c.own.as_ref()?.iou);
        self.common_miou = of(&|c| c.common.as_ref()?.iou);
        self.own_localization = of(&|c| hit(&c.own));
        self.common_localization = of(&|c| hit(&c.common));
        self.own_rule = cells.iter().find_map(|c| Some(c.own.as_ref()?.rule));
        self.compared = cells.iter().filter(|c| c.common.as_ref().is_some_and(|r| r.iou.is_some())).count();
        let answered: Vec<&ComparedCell> = cells.iter().copied().filter(|c| c.problem.is_none()).collect();
        let ms = |of: fn(&AnswerMs) -> f64| match answered.is_empty() {
            true => 0.0,
            false => median(&answered.iter().map(|c| of(&c.ms)).collect::<Vec<_>>()),
        };
        self.ms = AnswerMs { encode: ms(|m| m.encode), blend: ms(|m| m.blend), decode: ms(|m| m.decode) };
        self
    }
}

/// Relevancy that pictures show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, clap::ValueEnum, strum::IntoStaticStr)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub(crate) enum ShownRelevancy {
    /// As it is, 0 to 1
    #[default]
    Raw,
    /// LERF's: from 0.5 to the largest in the view
    Lerf,
    /// Values that the method's own rule cuts
    Own,
}

/// All that a comparison says.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Comparison {
    /// Version of the program.
    pub(crate) program: &'static str,
    pub(crate) methods: Vec<ComparedMethod>,
    pub(crate) views: Vec<String>,
    pub(crate) phrases: Vec<String>,
    /// Width and height of each view, px.
    pub(crate) sizes_px: Vec<[u32; 2]>,
    /// Runs that times are medians of.
    pub(crate) repeats: usize,
    pub(crate) shown: ShownRelevancy,
    /// Least and largest relevancy of the legend.
    pub(crate) range: [f32; 2],
    pub(crate) notes: Vec<String>,
    /// By phrase, then view, then method.
    pub(crate) cells: Vec<ComparedCell>,
}
