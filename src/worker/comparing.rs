//! Comparison thread: asks several scenes the same phrase in one view, so that the window never waits for them.
//!
//! Scenes are opened at their first question and stay open while they are asked. Answers come one by one. Only the
//! latest request counts.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use crossbeam_channel::{Receiver, Sender, bounded};

use super::observer::Repaint;
use super::thread::panic_failure;
use super::{Slot, Versioned};
use crate::jobs::JobError;
use crate::jobs::compare::answer::PhraseAnswer;
use crate::jobs::compare::subject::{AskableScene, CompareSubject};
use crate::jobs::compare::vectors::{InstalledEncoders, KnownVectors, TextFunction};
use crate::pipeline::semantics::query::foreign::pointed::PointedPixel;
use crate::pipeline::semantics::query::timing::ms_since;
use crate::scene::Camera;

/// Requests that may wait; only the newest is read.
const QUEUED: usize = 16;

/// Question to all scenes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum AskedOfAll {
    Phrase(String),
    /// The thing that a pixel of the view belongs to.
    Pixel(PointedPixel),
}

/// Request for the answers of all scenes.
#[derive(Clone, Debug)]
pub(crate) struct CompareQuestion {
    /// Scenes in the order of their views; a scene whose generation changes is opened again.
    pub(crate) scenes: Vec<Versioned<AskableScene>>,
    pub(crate) camera: Camera,
    pub(crate) asks: AskedOfAll,
    /// Encoder of phrases for results, in place of their authors'.
    pub(crate) encoder: Option<String>,
}

impl CompareQuestion {
    /// Returns whether both have the same answers.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        let generations = |q: &Self| q.scenes.iter().map(Versioned::generation).collect::<Vec<_>>();
        self.asks == other.asks
            && self.encoder == other.encoder
            && self.camera == other.camera
            && generations(self) == generations(other)
    }
}

/// Answer of one scene, or the reason for which there is none.
pub(crate) type ComparedAnswer = Result<PhraseAnswer, String>;

/// Answers to a question, as far as they are known.
#[derive(Debug)]
pub(crate) struct ComparedAnswers {
    pub(crate) question: Arc<CompareQuestion>,
    /// One for each scene; `None` until it has answered.
    pub(crate) answers: Vec<Option<Arc<ComparedAnswer>>>,
}

/// Handle of the thread. Dropping it ends the thread.
pub(crate) struct ComparisonThread {
    questions: Sender<Arc<CompareQuestion>>,
    answers: Arc<Slot<ComparedAnswers>>,
}

impl ComparisonThread {
    /// Starts the thread with the encoders of the catalog. Fails only if the system gives none.
    pub(crate) fn start(repaint: Repaint) -> std::io::Result<Self> {
        let (questions, asked) = bounded(QUEUED);
        let answers = Arc::new(Slot::default());
        let slot = Arc::clone(&answers);
        let work = move || {
            let mut encoders = InstalledEncoders::default();
            let mut encode = |name: &str, phrases: &[&str]| encoders.encode(name, phrases);
            answer_all(&asked, &mut encode, &slot, &repaint);
        };
        std::thread::Builder::new().name("comparison".into()).spawn(work)?;
        Ok(Self { questions, answers })
    }

    /// Asks a question. Returns whether there was room for it.
    pub(crate) fn ask(&self, question: Arc<CompareQuestion>) -> bool {
        self.questions.try_send(question).is_ok()
    }

    /// Slot in which answers are published.
    pub(crate) fn answers(&self) -> &Slot<ComparedAnswers> {
        &self.answers
    }
}

/// A scene that was opened for questions, and the camera that it looks from.
struct OpenScene {
    generation: u64,
    /// Encoder that it was opened with.
    encoder: Option<String>,
    scene: Result<CompareSubject, String>,
    looks_from: Option<Camera>,
    /// Milliseconds of rendering what phrases need of the view.
    blend_ms: f64,
}

fn answer_all(
    asked: &Receiver<Arc<CompareQuestion>>,
    encode: TextFunction<'_>,
    slot: &Slot<ComparedAnswers>,
    repaint: &Repaint,
) {
    let mut vectors = KnownVectors::new(encode, 1);
    let mut open: Vec<OpenScene> = Vec::new();
    while let Ok(mut question) = asked.recv() {
        while let Ok(newer) = asked.try_recv() {
            question = newer;
        }
        // Scenes that are no longer asked give their memory back.
        let is_asked = |scene: &OpenScene| question.scenes.iter().any(|asked| asked.generation() == scene.generation);
        open.retain(|scene| scene.encoder == question.encoder && is_asked(scene));
        let mut answers: Vec<Option<Arc<ComparedAnswer>>> = vec![None; question.scenes.len()];
        for (k, scene) in question.scenes.iter().enumerate() {
            if !asked.is_empty() {
                break;
            }
            let work = AssertUnwindSafe(|| answer(scene, &question, &mut open, &mut vectors));
            let found = catch_unwind(work).unwrap_or_else(|payload| {
                open.retain(|known| known.generation != scene.generation());
                Err(panic_failure(payload.as_ref()).message)
            });
            answers[k] = Some(Arc::new(found));
            slot.publish(ComparedAnswers { question: Arc::clone(&question), answers: answers.clone() });
            repaint();
        }
    }
}

/// Answer of a scene, which is opened and turned to the view first if needed.
fn answer(
    asked: &Versioned<AskableScene>,
    question: &CompareQuestion,
    open: &mut Vec<OpenScene>,
    vectors: &mut KnownVectors<'_>,
) -> ComparedAnswer {
    let generation = asked.generation();
    if !open.iter().any(|known| known.generation == generation) {
        let encoder = question.encoder.clone();
        let scene = asked.open(encoder.as_deref()).map_err(|e| e.to_string());
        open.push(OpenScene { generation, encoder, scene, looks_from: None, blend_ms: 0.0 });
    }
    let Some(known) = open.iter_mut().find(|known| known.generation == generation) else { return Err(String::new()) };
    let scene = known.scene.as_mut().map_err(|why| why.clone())?;
    let told = |e: JobError| e.to_string();
    if known.looks_from.as_ref() != Some(&question.camera) {
        known.looks_from = None;
        let start = std::time::Instant::now();
        scene.answers.look(&question.camera).map_err(told)?;
        (known.looks_from, known.blend_ms) = (Some(question.camera.clone()), ms_since(start));
    }
    let size = (question.camera.width_px as usize, question.camera.height_px as usize);
    let answered = match &question.asks {
        AskedOfAll::Phrase(phrase) => PhraseAnswer::of(scene, phrase, size, vectors, 1),
        AskedOfAll::Pixel(pixel) => PhraseAnswer::of_point(scene, *pixel, size),
    };
    let mut found = answered.map_err(told)??;
    found.ms.blend = known.blend_ms;
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::results::Method;
    use crate::io::results::tests::{expected, samples};
    use crate::jobs::{Scene, open};
    use crate::math::stats::worst_difference;
    use crate::pipeline::semantics::query::recipe::LERFS_PHRASES;

    fn asked(path: &str) -> Versioned<AskableScene> {
        let method = if path == "saga" { Method::Saga } else { Method::LangSplat };
        let scene = Scene { path: samples().join(path), method: Some(method), ..Scene::default() };
        Versioned::new(Arc::new(AskableScene::Result(Box::new(scene), method)))
    }

    #[test]
    fn all_scenes_answer_one_by_one_and_a_problem_stays_with_its_scene() {
        let camera = open::scene(&samples().join("langsplat/output")).expect("opens").cameras[0].camera.clone();
        let texts: Vec<Vec<f32>> = expected("scene/texts.npy").chunks_exact(512).map(<[f32]>::to_vec).collect();
        let mut opened = 0;
        let mut encode = |_: &str, phrases: &[&str]| -> Result<Vec<Vec<f32>>, JobError> {
            opened += 1;
            let at = LERFS_PHRASES.iter().position(|c| *c == phrases[0]).map_or(0, |c| c + 1);
            Ok(vec![texts[at].clone()])
        };
        let (sender, receiver) = bounded(4);
        let (slot, repaint): (Slot<ComparedAnswers>, Repaint) = (Slot::default(), Arc::new(|| {}));
        let scenes =
            vec![asked("langsplat/output"), asked("saga"), asked("no such folder"), asked("langsplat_v2/output")];
        let question = |phrase: &str| {
            let (camera, asks) = (camera.clone(), AskedOfAll::Phrase(phrase.to_owned()));
            Arc::new(CompareQuestion { scenes: scenes.clone(), camera, asks, encoder: None })
        };
        sender.send(question("an older one")).expect("room");
        sender.send(question("kettle")).expect("room");
        drop(sender);
        answer_all(&receiver, &mut encode, &slot, &repaint);
        let (_, found) = slot.newer_than(0).expect("answered");
        assert_eq!(found.question.asks, AskedOfAll::Phrase("kettle".into()), "the newest alone is answered");
        let of = |k: usize| found.answers[k].as_deref().expect("answered");
        let first = of(0).as_ref().expect("LangSplat answers");
        let wanted = |level: usize| expected(&format!("langsplat/expected/relevancy_pixels_{level}.npy"));
        let level = first.mask().level;
        assert!(worst_difference(&first.raw, &wanted(level + 1)) < 1e-4);
        assert!(worst_difference(&first.raw, &wanted((level + 1) % 3 + 1)) > 1e-3, "the control: another level");
        assert!(of(1).as_ref().is_err_and(|why| why.contains("SAGA")), "{:?}", of(1).as_ref().err());
        assert!(of(2).as_ref().is_err_and(|why| why.contains("no such folder")));
        assert!(of(3).as_ref().is_ok_and(|a| a.ms.blend > 0.0 && a.raw != first.raw));
    }

    #[test]
    fn a_pixel_is_asked_of_all_scenes() {
        let camera = open::scene(&samples().join("saga")).expect("opens").cameras[0].camera.clone();
        let mut encode = |_: &str, _: &[&str]| -> Result<Vec<Vec<f32>>, JobError> { Ok(Vec::new()) };
        let (sender, receiver) = bounded(4);
        let (slot, repaint): (Slot<ComparedAnswers>, Repaint) = (Slot::default(), Arc::new(|| {}));
        let asks = AskedOfAll::Pixel(PointedPixel { at: [7, 6], scale: 0.5, threshold: 0.9 });
        let scenes = vec![asked("saga"), asked("langsplat/output")];
        sender.send(Arc::new(CompareQuestion { scenes, camera, asks, encoder: None })).expect("room");
        drop(sender);
        answer_all(&receiver, &mut encode, &slot, &repaint);
        let (_, found) = slot.newer_than(0).expect("answered");
        let of = |k: usize| found.answers[k].as_deref().expect("answered").as_ref();
        assert!(of(0).is_ok_and(|a| a.mask().mask.contains(6 * 24 + 7)));
        assert!(of(1).is_err_and(|why| why.contains("no classes or clusters")), "embeddings tell nothing of a pixel");
    }
}
