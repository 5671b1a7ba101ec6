//! What answers typed questions: its encoder is loaded off the window's thread when a scene has features of
//! it; until then, and where there is none, names answer.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use crate::models;
use crate::pipeline::semantics::answer::Answered;
use crate::pipeline::semantics::query_engine::QueryEngine;
use crate::pipeline::semantics::relevancy::CANONICAL;
use crate::scene::{LevelFilter, SemanticMap};

type Loaded = Result<Mutex<QueryEngine>, String>;

/// What answers questions.
#[derive(Default)]
pub struct Speech {
    /// Which encoder is wanted.
    name: Option<String>,
    loaded: Arc<OnceLock<Loaded>>,
    /// Whether it has been noticed that it is there.
    noticed: bool,
    /// Why the encoder could not read the last question, if it could not.
    failed: Option<String>,
}

impl Speech {
    /// Loads the encoder of this name if it is another one than before. Whether one has just come.
    pub fn keep_up(&mut self, ctx: &egui::Context, name: Option<&str>) -> bool {
        if self.name.as_deref() != name {
            *self = Self { name: name.map(str::to_owned), ..Self::default() };
            if let Some(name) = self.name.clone() {
                let (slot, ctx) = (Arc::clone(&self.loaded), ctx.clone());
                let load = move || {
                    // Networks are prepared at the first use, which shall not be a person's.
                    let ready = models::encoder(&name).and_then(|mut e| e.text(CANONICAL[0]).map(|_| e));
                    // Nobody else fills this slot.
                    let _ = slot.set(ready.map(|e| Mutex::new(QueryEngine::with(e))).map_err(|e| e.to_string()));
                    ctx.request_repaint();
                };
                // Without a thread, names alone are understood.
                let _ = std::thread::Builder::new().name("encoder".into()).spawn(load);
            }
        }
        let came = !self.noticed && self.loaded.get().is_some();
        self.noticed |= came;
        came
    }

    /// Why phrases are not understood by looks, if they are not.
    pub fn trouble(&self) -> Option<&str> {
        self.loaded.get().and_then(|l| l.as_ref().err()).or(self.failed.as_ref()).map(String::as_str)
    }

    /// The answer to a question and the words of it that nothing here knows; `None` if there is nothing in it.
    pub fn ask(&mut self, map: &SemanticMap, text: &str, level: LevelFilter) -> Option<(Answered, Vec<String>)> {
        let ask = |engine: &mut QueryEngine| {
            let answered = engine.ask(map, text, level)?;
            Ok(answered.map(|a| (a, engine.unknown_words(&map.identities, text))))
        };
        self.failed = None;
        if let Some(Ok(engine)) = self.loaded.get() {
            match ask(&mut engine.lock().unwrap_or_else(PoisonError::into_inner)) {
                Ok(answered) => return answered,
                Err::<_, models::ModelError>(e) => self.failed = Some(e.to_string()),
            }
        }
        // Names alone need nothing that could fail.
        ask(&mut QueryEngine::default()).ok().flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::models::{Encoder, ModelError, Tile};
    use crate::scene::{Level, NOBODY};

    /// Fails as a damaged network does, or knows no word.
    struct Failing {
        knows: bool,
    }

    impl Encoder for Failing {
        fn name(&self) -> &str {
            "failing"
        }

        fn dimension(&self) -> usize {
            2
        }

        fn tile_side_px(&self) -> Option<usize> {
            None
        }

        fn images(&mut self, _tiles: &[Tile]) -> Result<Vec<Vec<f32>>, ModelError> {
            Ok(Vec::new())
        }

        fn text(&mut self, _phrase: &str) -> Result<Vec<f32>, ModelError> {
            Err(match self.knows {
                true => ModelError::Run { model: "text.onnx".into(), problem: "out of memory".into() },
                false => ModelError::NoKnownWord { unknown: vec!["giraffe".into()] },
            })
        }

        fn unknown_words(&self, _phrase: &str) -> Vec<String> {
            Vec::new()
        }
    }

    #[test]
    fn an_encoder_that_fails_at_a_question_is_told() {
        let mut map = SemanticMap::default();
        map.identities.add(Level::Object, NOBODY, vec!["giraffe".into()]);
        for knows in [true, false] {
            let mut speech = Speech::default();
            let encoder: Box<dyn Encoder> = Box::new(Failing { knows });
            assert!(speech.loaded.set(Ok(Mutex::new(QueryEngine::with(encoder)))).is_ok());
            let (answered, _) = speech.ask(&map, "the giraffe", LevelFilter::Auto).expect("names answer");
            assert_eq!(answered.chosen(1), [1]);
            // A word that nobody knows is no failure.
            assert_eq!(speech.trouble().is_some_and(|t| t.contains("out of memory")), knows);
        }
    }
}
