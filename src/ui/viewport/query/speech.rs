//! The encoder that understands typed phrases: loaded off the window's thread when a scene has
//! features of it, then asked while a person types.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use crate::models::{self, Encoder, ModelError};
use crate::pipeline::semantics::answer::phrases_of;
use crate::pipeline::semantics::grammar::Phrase;
use crate::pipeline::semantics::meaning::Phrasebook;
use crate::pipeline::semantics::relevancy::CANONICAL;

type Loaded = Result<Mutex<Box<dyn Encoder>>, String>;

/// What turns phrases into vectors.
#[derive(Default)]
pub struct Speech {
    /// Which encoder is wanted.
    name: Option<String>,
    loaded: Arc<OnceLock<Loaded>>,
    /// Whether it has been noticed that it is there.
    noticed: bool,
    phrases: Phrasebook,
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
                    let _ = slot.set(ready.map(Mutex::new).map_err(|e| e.to_string()));
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

    /// The words of a phrase that it does not know; `None` without an encoder.
    pub fn unknown_words(&self, text: &str) -> Option<Vec<String>> {
        let encoder = self.loaded.get()?.as_ref().ok()?;
        Some(encoder.lock().unwrap_or_else(PoisonError::into_inner).unknown_words(text))
    }

    /// Phrases with those of a question among them; `None` if there is no encoder, or it knows none of
    /// the words.
    pub fn learn(&mut self, phrase: &Phrase) -> Option<&Phrasebook> {
        let encoder = self.loaded.get()?.as_ref().ok()?;
        let mut encoder = encoder.lock().unwrap_or_else(PoisonError::into_inner);
        let learnt = self.phrases.learn(&phrases_of(phrase), |p| encoder.text(p));
        self.failed = match &learnt {
            Ok(()) | Err(ModelError::NoKnownWord { .. }) => None,
            Err(e) => Some(e.to_string()),
        };
        learnt.ok().map(|()| &self.phrases)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::models::Tile;

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
        let phrase = Phrase::parse("the giraffe").expect("a phrase");
        for knows in [true, false] {
            let mut speech = Speech::default();
            let encoder: Box<dyn Encoder> = Box::new(Failing { knows });
            assert!(speech.loaded.set(Ok(Mutex::new(encoder))).is_ok());
            assert!(speech.learn(&phrase).is_none());
            // A word that nobody knows is no failure.
            assert_eq!(speech.trouble().is_some_and(|t| t.contains("out of memory")), knows);
        }
    }
}
