//! One phrase, or one point, asked of all scenes on screen: relevancy on one scale in every view, with the mask by each method's own
//! rule or by one rule for all. A result that knows embeddings but no objects is asked this way alone, too.

mod bar;
mod figures;
mod painted;

use std::sync::Arc;

use egui::{Color32, Pos2, Stroke, Ui};
use glam::DVec3;

pub(super) use self::figures::AnswerFigures;
use self::painted::PaintedAnswer;
use super::split::ViewArea;
use crate::jobs::compare::answer::PhraseAnswer;
use crate::jobs::compare::cell::ShownRelevancy;
use crate::jobs::compare::subject::AskableScene;
use crate::math::colormap::Colormap;
use crate::pipeline::semantics::query::foreign::own_rules::ForeignMask;
use crate::pipeline::semantics::query::foreign::pointed::PointedPixel;
use crate::scene::Camera;
use crate::ui::state::AppState;
use crate::ui::theme;
use crate::worker::Versioned;
use crate::worker::comparing::{AskedOfAll, CompareQuestion, ComparedAnswer, ComparedAnswers, ComparisonThread};
use crate::worker::view::ViewPicture;

/// Longer side of the views that are asked, px.
const SIDE_PX: u32 = 800;

/// Choices of what the views show.
#[derive(Clone, Debug, PartialEq)]
struct ComparedChoices {
    scale: ShownRelevancy,
    /// True if masks are by the common rule, also where a method has its own.
    by_common_rule: bool,
    opacity: f32,
    /// Scale of what a point means, from 0 (details) to 1 (the largest things).
    size: f32,
    /// Score of what is alike to a point, where a method has scores.
    threshold: f32,
    /// Encoder of phrases for results, in place of their authors'.
    encoder: Option<String>,
}

impl ComparedChoices {
    /// The mask that is shown of an answer.
    fn mask<'a>(&self, answer: &'a PhraseAnswer) -> &'a ForeignMask {
        if self.by_common_rule { &answer.common } else { answer.mask() }
    }
}

impl Default for ComparedChoices {
    fn default() -> Self {
        Self {
            scale: ShownRelevancy::Raw,
            by_common_rule: false,
            opacity: 0.75,
            size: 0.5,
            threshold: 0.8,
            encoder: None,
        }
    }
}

/// The phrase that all scenes are asked, and their answers.
#[derive(Default)]
pub struct Compared {
    /// True if the scenes on screen can be asked.
    is_on: bool,
    typed: String,
    /// Point on a surface that was clicked; it is asked in place of the phrase.
    point: Option<DVec3>,
    /// Frames for which the field still takes the keyboard.
    focus: u8,
    choices: ComparedChoices,
    thread: Option<ComparisonThread>,
    /// The scenes in the order of their views.
    scenes: Vec<Option<Versioned<AskableScene>>>,
    /// Scene and objects that the first of them was made of.
    made_of: (u64, Option<u64>),
    asked: Option<Arc<CompareQuestion>>,
    /// Generation of the newest answers.
    seen: u64,
    answers: Option<Arc<ComparedAnswers>>,
    painted: Vec<PaintedAnswer>,
    /// Least and largest relevancy of all answers.
    raw_range: [f32; 2],
    problem: Option<String>,
}

impl Compared {
    /// True if the scenes on screen are asked one phrase.
    pub(crate) fn is_on(&self) -> bool {
        self.is_on
    }

    /// Focuses the field.
    pub(crate) fn start_typing(&mut self) {
        self.focus = 2;
    }

    /// Asks a phrase as if it had been typed.
    pub(crate) fn ask(&mut self, phrase: &str) {
        (self.typed, self.point) = (phrase.to_owned(), None);
    }

    /// Scale of what a point means, from 0 (details) to 1 (the largest things).
    pub(crate) fn size(&self) -> f32 {
        self.choices.size
    }

    /// Asks what a point on a surface belongs to; `None` asks the phrase again.
    pub(super) fn point_at(&mut self, point: Option<DVec3>) {
        self.point = point;
    }

    /// True if something is asked.
    pub(super) fn asks(&self) -> bool {
        self.point.is_some() || self.phrase().is_some()
    }

    /// The question in the view of a camera; `None` if nothing is asked, or if the point is out of sight.
    fn asked_in(&self, camera: &Camera) -> Option<AskedOfAll> {
        let Some(point) = self.point else { return self.phrase().map(|text| AskedOfAll::Phrase(text.to_owned())) };
        let at = camera.project(point)?;
        let is_inside = |at: f64, side: u32| (0.0..f64::from(side)).contains(&at);
        let is_in_view = is_inside(at.x, camera.width_px) && is_inside(at.y, camera.height_px);
        let (scale, threshold) = (self.choices.size, self.choices.threshold);
        let pixel = || PointedPixel { at: [at.x as usize, at.y as usize], scale, threshold };
        is_in_view.then(|| AskedOfAll::Pixel(pixel()))
    }

    /// The phrase in the field, if there is one.
    pub fn phrase(&self) -> Option<&str> {
        Some(self.typed.trim()).filter(|text| !text.is_empty())
    }

    /// Takes over which scenes are on screen; `split` tells whether those beside the first are.
    pub(super) fn follow(&mut self, state: &AppState, split: bool) {
        let Some(scene) = &state.scene else { return };
        let made_of = (state.scene_number, state.semantics.as_ref().map(Versioned::generation));
        if self.scenes.is_empty() || self.made_of != made_of {
            let map = state.semantics.as_deref();
            let first = AskableScene::of(&scene.scene, map).filter(|_| scene.remote.is_none());
            let first = first.map(|asked| Versioned::new(Arc::new(asked)));
            self.point = self.point.filter(|_| self.made_of.0 == made_of.0);
            (self.scenes, self.made_of) = (vec![first], made_of);
        }
        self.scenes.truncate(1);
        let beside = state.beside.iter().filter(|_| split);
        self.scenes.extend(beside.clone().map(|other| other.asked.clone()));
        let has_other = beside.clone().any(|other| !other.is_removal) && self.scenes.iter().any(Option::is_some);
        let is_alone = state.semantics.is_none() && self.scenes.first().is_some_and(Option::is_some);
        self.is_on = (has_other || is_alone) && !state.is_training();
        if !self.is_on {
            // The thread's scenes give their memory back.
            (self.asked, self.answers, self.thread, self.seen) = (None, None, None, 0);
            self.painted.clear();
        }
    }

    /// Asks the phrase once the frame on screen is a full one, and takes over answers.
    pub(super) fn keep_up(&mut self, ctx: &egui::Context, picture: Option<&ViewPicture>) {
        if !self.is_on {
            return;
        }
        let Some(picture) = picture.filter(|_| self.asks()) else {
            (self.asked, self.answers) = (None, None);
            return;
        };
        if picture.full {
            let camera = picture.camera.limited_to(SIDE_PX);
            match self.asked_in(&camera) {
                Some(asks) => {
                    let scenes = self.scenes.iter().flatten().cloned().collect();
                    let encoder = self.choices.encoder.clone();
                    self.send(ctx, CompareQuestion { scenes, camera, asks, encoder });
                }
                None => (self.asked, self.answers) = (None, None),
            }
        }
        let newer = self.thread.as_ref().and_then(|thread| thread.answers().newer_than(self.seen));
        if let Some((generation, answers)) = newer {
            let raw = answers.answers.iter().flatten().filter_map(|found| found.as_ref().as_ref().ok());
            self.raw_range = range_of(raw.flat_map(|answer| &answer.raw));
            (self.seen, self.answers) = (generation, Some(answers));
        }
    }

    fn send(&mut self, ctx: &egui::Context, question: CompareQuestion) {
        if self.asked.as_ref().is_some_and(|asked| asked.is_same(&question)) {
            return;
        }
        if self.thread.is_none() && self.problem.is_none() {
            match ComparisonThread::start(crate::ui::repainter(ctx, 0)) {
                Ok(thread) => self.thread = Some(thread),
                Err(e) => self.problem = Some(e.to_string()),
            }
        }
        let question = Arc::new(question);
        // With a full queue the question is repeated at the next redraw.
        if self.thread.as_ref().is_some_and(|thread| thread.ask(Arc::clone(&question))) {
            self.asked = Some(question);
        }
    }

    /// Answer of the scene in a view to the phrase in the field, if it has come.
    fn answer(&self, index: usize) -> Option<&Arc<ComparedAnswer>> {
        let (answers, asked) = (self.answers.as_ref()?, self.asked.as_ref()?);
        if answers.question.asks != asked.asks || answers.question.encoder != asked.encoder {
            return None;
        }
        let generation = self.scenes.get(index)?.as_ref()?.generation();
        let place = answers.question.scenes.iter().position(|scene| scene.generation() == generation)?;
        answers.answers.get(place)?.as_ref()
    }

    /// Pixels of the mask in each view, as far as answers have come; `None` where there is none.
    pub fn areas_px(&self) -> Vec<Option<usize>> {
        let area = |k| Some(self.choices.mask(self.answer(k)?.as_ref().as_ref().ok()?).mask.area());
        (0..self.scenes.len()).map(area).collect()
    }

    /// True if an answer of a view is still to come.
    fn waits(&self, index: usize) -> bool {
        self.asks() && self.scenes.get(index).is_some_and(Option::is_some) && self.answer(index).is_none()
    }

    /// Least and largest relevancy of the legend: one range for all views.
    fn range(&self) -> [f32; 2] {
        let [least, most] = self.raw_range;
        if self.choices.scale == ShownRelevancy::Raw && least < most { [least, most] } else { [0.0, 1.0] }
    }

    /// Paints the answers over the views, unless the camera has moved since.
    pub(super) fn paint(&mut self, ui: &Ui, areas: &[ViewArea], picture: Option<&ViewPicture>) {
        if self.is_on {
            self.paint_answers(ui, areas, picture);
            areas.iter().for_each(|area| self.mark_point(ui, area, picture));
        }
    }

    fn paint_answers(&mut self, ui: &Ui, areas: &[ViewArea], picture: Option<&ViewPicture>) {
        let Some(answers) = self.answers.clone() else { return };
        let is_here = |picture: &ViewPicture| picture.camera.limited_to(SIDE_PX) == answers.question.camera;
        if !picture.is_some_and(is_here) {
            return;
        }
        let range = self.range();
        self.painted.resize_with(self.scenes.len(), PaintedAnswer::default);
        for area in areas {
            let Some(answer) = self.answer(area.index).map(Arc::clone) else { continue };
            if let (Some(painted), Ok(answer)) = (self.painted.get_mut(area.index), &*answer) {
                painted.paint(ui, area.shown, self.seen, answer, &self.choices, range);
            }
        }
    }

    /// Marks the point in a view.
    fn mark_point(&self, ui: &Ui, area: &ViewArea, picture: Option<&ViewPicture>) {
        let at = self.point.zip(picture).and_then(|(point, picture)| {
            let camera = &picture.camera;
            let at = camera.project(point)?;
            let share = egui::vec2(at.x as f32 / camera.width_px as f32, at.y as f32 / camera.height_px as f32);
            let pos: Pos2 = area.shown.min + share * area.shown.size();
            area.shown.contains(pos).then_some(pos)
        });
        let Some(at) = at else { return };
        let painter = ui.painter_at(area.rect);
        painter.circle(at, 5.0, theme::accent(), Stroke::new(2.0, Color32::WHITE));
    }
}

/// Least and largest of what is larger than 0.
fn range_of<'a>(values: impl Iterator<Item = &'a f32>) -> [f32; 2] {
    let shown = values.copied().filter(|v| *v > 0.0);
    shown.fold([f32::INFINITY, 0.0_f32], |[least, most], v| [least.min(v), most.max(v)])
}

/// Colors of relevancy in all views.
const COLORS: Colormap = Colormap::Turbo;
