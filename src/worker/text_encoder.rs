//! The text encoder on a thread of its own: typed texts go in, the newest embeddings come out of a slot.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use crossbeam_channel::{Sender, bounded};

use super::{Repaint, Slot};
use crate::models::{self, Encoder, ModelError};
use crate::pipeline::semantics::query::by_embedding::TextEmbeddings;
use crate::pipeline::semantics::query::parse::ParsedQuery;
use crate::pipeline::semantics::query::recipe::{PAPERS_PHRASES, QueryConfig};
use crate::pipeline::semantics::query::timing::ms_since;

/// Requests that may wait; only the newest is read.
const QUEUED: usize = 16;

/// Results for the texts that were requested last.
#[derive(Debug, Default)]
pub(crate) struct Encoded {
    /// Embeddings of their phrases.
    pub(crate) phrases: TextEmbeddings,
    pub(crate) texts: BTreeMap<ParsedQuery, EncodedText>,
    /// Reason for which the encoder cannot be used, if it cannot.
    pub(crate) problem: Option<String>,
}

/// Result for one text.
#[derive(Clone, Debug, Default)]
pub(crate) struct EncodedText {
    /// True if its phrases have embeddings; not if the encoder knows none of its words.
    pub(crate) known: bool,
    /// The words that the encoder does not know.
    pub(crate) unknown: Vec<String>,
    /// Reason for which it could not be encoded, if the encoder failed.
    pub(crate) problem: Option<String>,
    /// Milliseconds that encoding took.
    pub(crate) encode_ms: f64,
}

/// Texts, each with the recipe that answers it and decides which other phrases are needed.
pub(crate) type TextRequest = Vec<(ParsedQuery, QueryConfig)>;

/// Handle of the thread. Dropping it ends the thread.
pub(crate) struct TextEncoder {
    texts: Sender<TextRequest>,
    encoded: Arc<Slot<Encoded>>,
}

impl TextEncoder {
    /// Loads the encoder of this name and waits for texts. Fails only if the system gives no thread.
    pub(crate) fn start(name: String, repaint: Repaint) -> std::io::Result<Self> {
        let (sender, texts) = bounded::<TextRequest>(QUEUED);
        let encoded = Arc::new(Slot::default());
        let slot = Arc::clone(&encoded);
        let work = move || {
            // Networks are prepared at the first use, which shall not be a user's.
            let ready = models::encoder(&name).and_then(|mut e| e.text(PAPERS_PHRASES[0]).map(|_| e));
            let mut encoder = match ready {
                Ok(encoder) => encoder,
                Err(e) => {
                    slot.publish(Encoded { problem: Some(e.to_string()), ..Encoded::default() });
                    return repaint();
                }
            };
            slot.publish(Encoded::default());
            repaint();
            let mut known = TextEmbeddings::default();
            while let Ok(mut newest) = texts.recv() {
                // Each request has all texts on screen, so that older ones need no answer.
                while let Ok(newer) = texts.try_recv() {
                    newest = newer;
                }
                slot.publish(encode(&mut *encoder, &mut known, newest));
                repaint();
            }
        };
        std::thread::Builder::new().name("text encoder".into()).spawn(work)?;
        Ok(Self { texts: sender, encoded })
    }

    /// Asks for all texts that are on screen. Whether there was room for that.
    pub(crate) fn request(&self, texts: TextRequest) -> bool {
        self.texts.try_send(texts).is_ok()
    }

    /// Slot in which the embeddings are published, empty ones as soon as the encoder is loaded.
    pub(crate) fn encoded(&self) -> &Slot<Encoded> {
        &self.encoded
    }
}

/// Encodes the phrases of these texts that are not `known` yet.
fn encode(encoder: &mut dyn Encoder, known: &mut TextEmbeddings, texts: TextRequest) -> Encoded {
    let mut encoded = Encoded::default();
    for (phrase, recipe) in texts {
        let start = Instant::now();
        let learned = known.learn(&phrase, &recipe, encoder);
        let mut copy = |p: &str| known.get(p).map(<[f32]>::to_vec).ok_or(());
        let one = EncodedText {
            known: learned.is_ok() && encoded.phrases.learn(&phrase, &recipe, &mut copy).is_ok(),
            unknown: encoder.unknown_words(&phrase.text),
            problem: match learned {
                // A word that it does not know is no failure.
                Ok(()) | Err(ModelError::NoKnownWord { .. }) => None,
                Err(e) => Some(e.to_string()),
            },
            encode_ms: ms_since(start),
        };
        encoded.texts.insert(phrase, one);
    }
    encoded
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::models::IdentityCrop;

    /// Knows one word, and fails at another as a damaged network does.
    #[derive(Default)]
    struct Script {
        asked: Vec<String>,
    }

    impl Encoder for Script {
        fn name(&self) -> &str {
            "script"
        }

        fn dimension(&self) -> usize {
            2
        }

        fn tile_side_px(&self) -> Option<usize> {
            None
        }

        fn images(&mut self, _tiles: &[IdentityCrop]) -> Result<Vec<Vec<f32>>, ModelError> {
            Ok(Vec::new())
        }

        fn texts(&mut self, phrases: &[&str]) -> Vec<Result<Vec<f32>, ModelError>> {
            self.asked.extend(phrases.iter().map(|p| (*p).to_owned()));
            let one = |phrase: &&str| match *phrase {
                "broken" => Err(ModelError::Run { model: "text.onnx".into(), problem: "out of memory".into() }),
                "giraffe" => Err(ModelError::NoKnownWord { unknown: vec!["giraffe".into()] }),
                _ => Ok(vec![1.0, 0.0]),
            };
            phrases.iter().map(one).collect()
        }

        fn unknown_words(&self, phrase: &str) -> Vec<String> {
            if phrase.contains("giraffe") { vec!["giraffe".into()] } else { Vec::new() }
        }
    }

    #[test]
    fn texts_are_encoded_once_and_failures_are_reported() {
        let (mut script, mut known) = (Script::default(), TextEmbeddings::default());
        let parsed = |text: &str| ParsedQuery::parse(text).expect("words");
        let texts = || ["lamp", "giraffe", "broken"].map(|t| (parsed(t), QueryConfig::default())).to_vec();
        let encoded = encode(&mut script, &mut known, texts());
        let of = |text: &str| encoded.texts[&parsed(text)].clone();
        assert!(of("lamp").known && of("lamp").problem.is_none() && encoded.phrases.get("lamp").is_some());
        assert!(!of("giraffe").known && of("giraffe").problem.is_none() && of("giraffe").unknown == ["giraffe"]);
        assert!(!of("broken").known && of("broken").problem.is_some_and(|p| p.contains("out of memory")));
        let lamps = |script: &Script| script.asked.iter().filter(|p| *p == "lamp").count();
        let before = lamps(&script);
        encode(&mut script, &mut known, texts());
        assert_eq!((before, lamps(&script)), (1, 1), "what was encoded before is kept");
    }

    #[test]
    fn an_encoder_that_is_not_there_is_reported() {
        let (sender, repainted) = bounded(4);
        let repaint: Repaint = Arc::new(move || {
            let _ = sender.try_send(());
        });
        let encoder = TextEncoder::start("no such encoder".into(), repaint).expect("a thread");
        repainted.recv().expect("it says so");
        let (_, encoded) = encoder.encoded().newer_than(0).expect("why");
        assert!(encoded.problem.is_some() && encoded.texts.is_empty());
    }
}
