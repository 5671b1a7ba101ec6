//! Knobs of typed queries against labelled photos.

use std::time::Instant;

use serde_json::json;

use super::{Input, Plans, overlap, stage};
use crate::math::stats::mean;
use crate::models::Encoder;
use crate::pipeline::observer::Observer;
use crate::pipeline::semantics::answer::{Answered, by_name};
use crate::pipeline::semantics::code_map::CodeMap;
use crate::pipeline::semantics::codes::TOLERANCE;
use crate::pipeline::semantics::grammar::Phrase;
use crate::pipeline::semantics::localise::Strategy;
use crate::pipeline::semantics::matching;
use crate::pipeline::semantics::meaning::{MeaningOptions, PartFeatures, Phrasebook};
use crate::pipeline::semantics::protocols::part_recall::HIT_IOU;
use crate::pipeline::semantics::protocols::{AskedScene, Category, LabelledView, langsplat};
use crate::pipeline::semantics::query_engine::ask_by_embedding;
use crate::pipeline::semantics::view_map::ViewMap;
use crate::render::RenderSettings;
use crate::render::cpu::Renderer;
use crate::report::document::Form;
use crate::report::sweep::failed;
use crate::report::{Case, Measure, Rule, Stage, StageName, Study, StudyError, Trial};
use crate::scene::{Camera, GaussianCloud, IdentityId, LanguageFeatures, Level, LevelFilter, Mask, SemanticMap};

/// A labelled photo.
pub struct Asked {
    /// Its name.
    pub name: String,
    /// Its camera, of the labels' size.
    pub camera: Camera,
    /// What is asked for.
    pub categories: Vec<Category>,
}

/// How stored embeddings are kept.
#[derive(Clone, Copy, PartialEq)]
enum Precision {
    Stored,
    Half,
    Byte,
}

#[derive(Clone)]
struct Plan {
    /// `None` asks by names alone.
    options: Option<MeaningOptions>,
    /// Maps of the view are smaller by this factor.
    smaller: u32,
    blend: bool,
    precision: Precision,
    /// Share of the objects that can be found.
    share: f64,
}

/// The sweep of queries.
pub struct QueryStudy<'a> {
    cloud: &'a GaussianCloud,
    settings: &'a RenderSettings,
    map: &'a SemanticMap,
    language: &'a LanguageFeatures,
    encoder: Box<dyn Encoder>,
    views: Vec<Asked>,
    input: Input,
    repeats: u32,
    plans: Plans<Plan>,
}

impl<'a> QueryStudy<'a> {
    /// Of a scene that `encoder` has looked at, asked for what labelled views show.
    ///
    /// # Errors
    /// If no encoder has looked at it.
    pub fn new(
        (cloud, settings): (&'a GaussianCloud, &'a RenderSettings),
        map: &'a SemanticMap,
        encoder: Box<dyn Encoder>,
        views: Vec<Asked>,
        repeats: u32,
        mut input: Input,
    ) -> Result<Self, StudyError> {
        let language = map.language.as_ref().ok_or_else(|| failed("no encoder has looked at this scene"))?;
        let queries: usize = views.iter().map(|v| v.categories.len()).sum();
        input.insert("queries".into(), format!("{queries} in {} views", views.len()));
        input.insert("identities".into(), map.identities.len().to_string());
        input.insert("encoder".into(), language.encoder.clone());
        Ok(Self { cloud, settings, map, language, encoder, views, input, repeats, plans: plans() })
    }

    /// The features that a plan leaves.
    fn features(&self, plan: &Plan) -> LanguageFeatures {
        let mut features = self.language.clone();
        let objects: Vec<IdentityId> =
            self.map.identities.iter().filter(|(_, i)| i.level == Level::Object).map(|(id, _)| id).collect();
        let known = (plan.share * objects.len() as f64).ceil() as usize;
        let dropped = &objects[known.min(objects.len())..];
        for ((id, _), of) in self.map.identities.iter().zip(&mut features.of) {
            if dropped.contains(&self.map.identities.object_of(id)) {
                *of = Default::default();
            }
            of.raw.iter_mut().chain(&mut of.deviated).for_each(|v| round(v, plan.precision));
        }
        features
    }
}

fn round(v: &mut [f32], precision: Precision) {
    let largest = v.iter().fold(0.0_f32, |m, x| m.max(x.abs()));
    for x in v {
        *x = match precision {
            Precision::Stored => *x,
            Precision::Half => half::f16::from_f32(*x).to_f32(),
            Precision::Byte if largest > 0.0 => (*x / largest * 127.0).round() / 127.0 * largest,
            Precision::Byte => *x,
        };
    }
}

fn plans() -> Plans<Plan> {
    let options = MeaningOptions::default();
    let base = Plan { options: Some(options), smaller: 1, blend: false, precision: Precision::Stored, share: 1.0 };
    let mut all = vec![(Case::default("part and whole at once, exact masks"), base.clone())];
    let mut add = |method: &str, setting: &str, knob: (&str, serde_json::Value), plan: Plan| {
        all.push((Case::new(method, setting, &[knob]), plan));
    };
    for (strategy, words) in [
        (Strategy::Paper, "the paper's two steps"),
        (Strategy::OneStep, "one step"),
        (Strategy::WholeFirst, "whole first"),
    ] {
        let options = MeaningOptions { strategy, ..options };
        add("localisation", words, ("strategy", json!(words)), Plan { options: Some(options), ..base.clone() });
    }
    let raw = MeaningOptions { parts: PartFeatures::Raw, ..options };
    add("part features", "without deviation", ("parts", json!("raw")), Plan { options: Some(raw), ..base.clone() });
    add("encoder", "none: names alone", ("encoder", json!("names")), Plan { options: None, ..base.clone() });
    for (smaller, words) in [(2, "1/2 of the size"), (4, "1/4 of the size")] {
        let knob = ("scale", json!(1.0 / f64::from(smaller)));
        add("map resolution", words, knob, Plan { smaller, ..base.clone() });
    }
    add("decoding", "blended codes", ("read", json!("blend")), Plan { blend: true, ..base.clone() });
    add("precision", "16 bits", ("precision", json!(16)), Plan { precision: Precision::Half, ..base.clone() });
    add("precision", "8 bits", ("precision", json!(8)), Plan { precision: Precision::Byte, ..base.clone() });
    for (share, words) in [(0.25, "a quarter of the objects"), (0.5, "half of the objects")] {
        add("identities", words, ("share", json!(share)), Plan { share, ..base.clone() });
    }
    Plans(all)
}

/// What the pixels of a view belong to, as a plan draws it.
struct Maps {
    exact: ViewMap,
    blended: CodeMap,
}

impl Study for QueryStudy<'_> {
    fn stage(&self) -> Stage {
        let measures = vec![
            overlap("mIoU", "mean overlap of the answer's mask with the label, over all names of the views"),
            overlap("part recall", "share of parts that are answered with an overlap of a half or more"),
            overlap(
                "localisation",
                "share of names whose most relevant pixel lies in their box (LangSplat's protocol)",
            ),
            overlap("object mIoU", "mean overlap of objects"),
            overlap("part mIoU", "mean overlap of parts"),
            Measure::new(
                "not understood",
                "",
                Form::Error,
                "share of names of which the encoder knows no word; they count as an overlap of 0",
            ),
        ];
        let rule = Rule { measure: "mIoU".into(), times: 1.02, floor: 0.0, spare_secs: 5e-3 };
        let reference = "labels of photos whose masks were not used; by embedding unless it says otherwise, the best answer whatever its score; names alone measure the lifting";
        let secs_of = "one query, from the text to the mask, maps of the view there";
        stage(StageName::Query, secs_of, reference, &self.input, self.repeats, rule, measures)
    }

    fn cases(&self) -> Vec<Case> {
        self.plans.cases()
    }

    fn run(&mut self, case: &Case, _seed: u64, observer: &mut dyn Observer) -> Result<Option<Trial>, StudyError> {
        let Some(plan) = self.plans.of(case).cloned() else { return Ok(None) };
        let features = self.features(&plan);
        let mut canonical = Phrasebook::default();
        canonical.learn(&[], |p| self.encoder.text(p)).map_err(failed)?;
        let (map, mut renderer) = (self.map, Renderer::new());
        let (mut secs, mut ious, mut hits) = (Vec::new(), [Vec::new(), Vec::new()], Vec::new());
        let (mut not_understood, mut broken) = (Vec::new(), None);
        for view in &self.views {
            if observer.proceed().is_err() {
                return Ok(None);
            }
            let (w, h) = (view.camera.width_px, view.camera.height_px);
            let small = view.camera.resized((w / plan.smaller).max(1), (h / plan.smaller).max(1));
            let draw = |renderer: &mut Renderer<f32>| -> Result<Maps, StudyError> {
                let (of, all) = (&map.of, &map.identities);
                let exact = ViewMap::render(renderer, self.cloud, of, all, &small, self.settings).map_err(failed)?;
                let blended = match plan.blend {
                    true => CodeMap::render(renderer, self.cloud, &map.codes, true, &small, self.settings)
                        .map_err(failed)?,
                    false => CodeMap::default(),
                };
                Ok(Maps { exact, blended })
            };
            let maps = draw(&mut renderer)?;
            for category in &view.categories {
                let start = Instant::now();
                let mut phrases = canonical.clone();
                let answered = ask(&category.name, map, &features, &plan, &mut phrases, &mut *self.encoder)?;
                let mask = answered.map(|a| found(&a, &maps, map, &plan));
                secs.push(start.elapsed().as_secs_f64());
                not_understood.push(f64::from(u8::from(mask.is_none())));
                let iou = mask.map_or(0.0, |m| enlarged(&m, w as usize, h as usize).iou(&category.mask));
                ious[usize::from(category.level == Level::Part)].push(iou);
            }
            let encoder = &mut *self.encoder;
            // An encoder that fails is no answer that misses.
            let mut again = |text: &str| {
                let answered = ask(text, map, &features, &plan, &mut canonical.clone(), encoder);
                answered.unwrap_or_else(|e| {
                    broken.get_or_insert(e);
                    None
                })
            };
            let full =
                ViewMap::render(&mut renderer, self.cloud, &map.of, &map.identities, &view.camera, self.settings)
                    .map_err(failed)?;
            let labelled = LabelledView {
                name: &view.name,
                camera: &view.camera,
                exact: &full,
                blended: &CodeMap::default(),
                categories: view.categories.clone(),
            };
            let units = langsplat::compare(&mut AskedScene { map, ask: &mut again }, &labelled);
            hits.extend(units.into_iter().map(|u| f64::from(u8::from(u.hit == Some(true)))));
            if let Some(e) = broken.take() {
                return Err(e);
            }
        }
        let all: Vec<f64> = ious.iter().flatten().copied().collect();
        let recalled = ious[1].iter().map(|iou| f64::from(u8::from(*iou >= HIT_IOU))).collect::<Vec<_>>();
        let values = vec![
            ("mIoU", mean(&all)),
            ("part recall", mean(&recalled)),
            ("localisation", mean(&hits)),
            ("object mIoU", mean(&ious[0])),
            ("part mIoU", mean(&ious[1])),
            ("not understood", mean(&not_understood)),
        ];
        Ok(Some(Trial { secs: mean(&secs), values, curve: Vec::new() }))
    }
}

/// Answers a name; `None` if there is nothing in it, or no word that the encoder knows.
fn ask(
    text: &str,
    map: &SemanticMap,
    features: &LanguageFeatures,
    plan: &Plan,
    phrases: &mut Phrasebook,
    encoder: &mut dyn Encoder,
) -> Result<Option<Answered>, StudyError> {
    let Some(options) = plan.options else {
        return Ok(Phrase::parse(text).map(|phrase| by_name(&map.identities, &phrase, LevelFilter::Auto)));
    };
    match ask_by_embedding(&map.identities, (features, options), text, phrases, |p| encoder.text(p)) {
        Err(crate::models::ModelError::NoKnownWord { .. }) => Ok(None),
        answered => answered.map_err(failed),
    }
}

/// The pixels of the best answer, whatever its score: it is asked where, not whether.
fn found(answered: &Answered, maps: &Maps, map: &SemanticMap, plan: &Plan) -> Mask {
    let Some(best) = answered.answer.hits().first().map(|h| h.identity) else {
        return Mask::empty(maps.exact.width_px, maps.exact.height_px);
    };
    match plan.blend {
        true => matching::blend(&maps.blended, &map.identities, best, TOLERANCE),
        false => matching::exact(&maps.exact, &map.identities, best, TOLERANCE),
    }
}

/// A mask of a smaller picture at full size: the nearest pixel.
fn enlarged(mask: &Mask, w: usize, h: usize) -> Mask {
    let (sw, sh) = (mask.width_px(), mask.height_px());
    if (sw, sh) == (w, h) {
        return mask.clone();
    }
    Mask::from_fn(w, h, |i| mask.contains(i / w * sh / h * sw + i % w * sw / w))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::stats::worst_difference;

    #[test]
    fn masks_grow_by_nearest_pixels() {
        let small = Mask::from_fn(4, 2, |i| i == 1 || i == 6);
        let large = enlarged(&small, 8, 4);
        assert_eq!(large.area(), 8);
        assert!(large.contains(2) && large.contains(8 + 3) && large.contains(2 * 8 + 4) && !large.contains(0));
    }

    #[test]
    fn rounding_keeps_as_much_as_it_says() {
        let v: Vec<f32> = (0..64).map(|i| (i as f32 * 0.7).sin() / 8.0).collect();
        let off = |p: Precision| {
            let mut r = v.clone();
            round(&mut r, p);
            worst_difference(&v, &r)
        };
        assert_eq!(off(Precision::Stored), 0.0);
        assert!(off(Precision::Half) < 1e-4 && off(Precision::Byte) < 1e-3 && off(Precision::Byte) > 1e-5);
    }
}
