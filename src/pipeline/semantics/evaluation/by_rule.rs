//! One scene's answers scored by several rules side by side, so that a paper's number and the fair number stand in one
//! table: the method's own rule, LangSplat's, and the common one.

use serde::Serialize;
use strum::VariantArray;

use super::part_recall::HIT_IOU;
use super::{Category, Unit, masks, means};
use crate::math::stats::mean;
use crate::pipeline::semantics::query::foreign::own_rules::ForeignMask;
use crate::pipeline::semantics::smoothing::{BY_COMMON_RULE, BY_SMOOTHING, LeveledMask, by_common_rule, by_smoothing};
use crate::scene::{Level, Mask};

/// Rule that makes a mask of relevancy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, VariantArray, strum::IntoStaticStr)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum CutRule {
    /// The method's own.
    #[strum(serialize = "own")]
    Own,
    /// LangSplat's, which many papers use for all methods.
    #[strum(serialize = "LangSplat's")]
    LangSplat,
    /// The same for all, without smoothing.
    #[strum(serialize = "common")]
    Common,
}

/// A phrase in a view, as a scene answers it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct PhraseInView {
    /// Relevancy of each level, row-major, 0 to 1.
    pub(crate) levels: Vec<Vec<f32>>,
    /// Mask by the scene's own rule, if it has one.
    pub(crate) own: Option<ForeignMask>,
    /// Width and height in px.
    pub(crate) size: (usize, usize),
}

impl PhraseInView {
    /// Returns the mask by a rule; `None` if the scene has no rule of its own.
    pub(crate) fn mask(&self, rule: CutRule) -> Option<ForeignMask> {
        let (w, h) = self.size;
        let ruled = |found: Option<LeveledMask>, rule| {
            found.map(|LeveledMask { mask, level, values, peak }| ForeignMask { mask, level, values, peak, rule })
        };
        match rule {
            CutRule::Own => self.own.clone(),
            CutRule::LangSplat => ruled(by_smoothing(&self.levels, w, h), BY_SMOOTHING),
            CutRule::Common => ruled(by_common_rule(&self.levels, w, h), BY_COMMON_RULE),
        }
    }
}

/// Returns whether a rule points at a category; `None` if it points at nothing.
pub(crate) fn hit(found: &ForeignMask, category: &Category) -> Option<bool> {
    let (w, at) = (found.mask.width_px().max(1), found.peak?);
    Some(category.boxes.iter().any(|b| b.contains(at % w, at / w)))
}

/// Scores of a rule.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct RuleScores {
    pub(crate) rule: CutRule,
    /// The rule in words.
    pub(crate) words: &'static str,
    /// Mean IoU over queries.
    pub(crate) miou: f64,
    /// Mean over views of the mean IoU of each.
    pub(crate) miou_by_view: f64,
    /// Mean IoU of objects.
    pub(crate) object_miou: f64,
    /// Mean IoU of parts.
    pub(crate) part_miou: f64,
    /// Share of parts with an IoU of a half or more.
    pub(crate) part_recall: f64,
    /// Share of queries with the pixel that the rule points at in a box of their category.
    pub(crate) localization: Option<f64>,
    pub(crate) units: Vec<Unit>,
}

/// Comparisons by all rules.
#[derive(Clone, Debug, Default)]
pub(crate) struct RuleTally(Vec<(CutRule, &'static str, Vec<Unit>)>);

impl RuleTally {
    /// Compares an answer with a category in the photo `view`.
    pub(crate) fn add(&mut self, view: &str, category: &Category, answer: &PhraseInView) {
        for rule in CutRule::VARIANTS {
            let Some(found) = answer.mask(*rule) else { continue };
            let unit = category.unit(view, found.mask.iou(&category.mask), hit(&found, category));
            match self.0.iter_mut().find(|(known, ..)| known == rule) {
                Some((.., units)) => units.push(unit),
                None => self.0.push((*rule, found.rule, vec![unit])),
            }
        }
    }

    /// Scores of the rules that made masks.
    pub(crate) fn scores(self) -> Vec<RuleScores> {
        self.0.into_iter().map(|(rule, words, units)| scores(rule, words, units)).collect()
    }
}

fn scores(rule: CutRule, words: &'static str, units: Vec<Unit>) -> RuleScores {
    let ((miou, miou_by_view), [object_miou, part_miou]) = (means(&units), masks::by_level(&units));
    let parts: Vec<f64> =
        units.iter().filter(|u| u.level == Level::Part).map(|u| f64::from(u.iou >= HIT_IOU)).collect();
    let hits: Vec<f64> = units.iter().filter_map(|u| u.hit).map(f64::from).collect();
    let localization = (!hits.is_empty()).then(|| mean(&hits));
    RuleScores {
        rule,
        words,
        miou,
        miou_by_view,
        object_miou,
        part_miou,
        part_recall: mean(&parts),
        localization,
        units,
    }
}

/// The most relevant of several classes at each pixel.
#[derive(Clone, Debug)]
pub(crate) struct WinningClasses {
    /// Relevancy and class.
    best: Vec<(f32, Option<usize>)>,
    size: (usize, usize),
}

impl WinningClasses {
    /// Nothing has won yet in a view of this size.
    pub(crate) fn new(size: (usize, usize)) -> Self {
        Self { best: vec![(0.0, None); size.0 * size.1], size }
    }

    /// Lets a class compete, with its largest relevancy over all levels. Of equal ones, the first wins.
    pub(crate) fn add(&mut self, class: usize, answer: &PhraseInView) {
        for level in &answer.levels {
            let pixels = self.best.iter_mut().zip(level);
            pixels.filter(|(best, relevancy)| **relevancy > best.0).for_each(|(best, r)| *best = (*r, Some(class)));
        }
    }

    /// Pixels of a class.
    pub(crate) fn mask(&self, class: usize) -> Mask {
        Mask::from_fn(self.size.0, self.size.1, |i| self.best[i].1 == Some(class))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: (usize, usize) = (8, 8);

    fn category(level: Level, from: usize, to: usize) -> Category {
        let mask = Mask::from_fn(SIZE.0, SIZE.1, |i| (from..to).contains(&(i / SIZE.0)));
        Category { name: "thing".into(), level, boxes: mask.bounds().into_iter().collect(), mask }
    }

    /// Relevancy of 0.9 in these rows, 0.2 elsewhere.
    fn relevancy(from: usize, to: usize) -> Vec<f32> {
        (0..SIZE.0 * SIZE.1).map(|i| if (from..to).contains(&(i / SIZE.0)) { 0.9 } else { 0.2 }).collect()
    }

    #[test]
    fn every_rule_has_its_row_and_a_scene_without_a_rule_lacks_its_own() {
        let answer = PhraseInView { levels: vec![relevancy(2, 5)], own: None, size: SIZE };
        let mut tally = RuleTally::default();
        tally.add("v", &category(Level::Object, 2, 5), &answer);
        tally.add("v", &category(Level::Part, 5, 8), &answer);
        let rows = tally.scores();
        assert_eq!(rows.iter().map(|r| r.rule).collect::<Vec<_>>(), [CutRule::LangSplat, CutRule::Common]);
        let common = &rows[1];
        assert_eq!((common.object_miou, common.part_miou, common.part_recall), (1.0, 0.0, 0.0));
        assert_eq!((common.miou, common.localization), (0.5, Some(0.5)));
        assert_ne!(rows[0].words, common.words);
        let own = answer.mask(CutRule::Common).expect("a mask");
        let with = PhraseInView { own: Some(ForeignMask { peak: None, rule: "mine", ..own }), ..answer };
        let mut tally = RuleTally::default();
        tally.add("v", &category(Level::Object, 2, 5), &with);
        let rows = tally.scores();
        assert_eq!((rows[0].rule, rows[0].words, rows[0].miou), (CutRule::Own, "mine", 1.0));
        assert_eq!(rows[0].localization, None, "a rule that points at nothing");
    }

    #[test]
    fn the_level_of_the_largest_relevancy_counts() {
        let mut strong = relevancy(0, 3);
        strong.iter_mut().for_each(|r| *r *= 1.05);
        let answer = PhraseInView { levels: vec![relevancy(5, 8), strong], own: None, size: SIZE };
        let found = answer.mask(CutRule::Common).expect("a mask");
        assert_eq!((found.level, found.mask), (1, category(Level::Object, 0, 3).mask));
        let weak = PhraseInView { levels: answer.levels.iter().rev().cloned().collect(), ..answer };
        assert_eq!(weak.mask(CutRule::Common).expect("a mask").level, 0, "the control: levels exchanged");
    }

    #[test]
    fn classes_compete_for_pixels() {
        let of = |from, to| PhraseInView { levels: vec![relevancy(from, to)], own: None, size: SIZE };
        let mut winning = WinningClasses::new(SIZE);
        winning.add(0, &of(0, 4));
        winning.add(1, &of(4, 6));
        assert_eq!(winning.mask(1), category(Level::Object, 4, 6).mask);
        assert_eq!(winning.mask(0).area(), 6 * SIZE.0, "the first of equal ones has what nobody is sure of");
        assert!(WinningClasses::new(SIZE).mask(0).is_empty());
    }
}
