//! Embeddings of the texts on screen: requested from the text encoder's thread during typing.

use std::sync::Arc;

use crate::pipeline::semantics::query::by_embedding::TextEmbeddings;
use crate::pipeline::semantics::query::parse::ParsedQuery;
use crate::worker::text_encoder::{Encoded, EncodedText, TextEncoder, TextRequest};

/// Embeddings of the texts on screen, as far as known.
#[derive(Default)]
pub(super) struct Embeddings {
    /// Name of the encoder in use.
    name: Option<String>,
    encoder: Option<TextEncoder>,
    /// Generation of the last encoder result.
    seen: u64,
    known: Arc<Encoded>,
    /// The last request.
    requested: TextRequest,
}

impl Embeddings {
    /// Loads the encoder `name` if it differs from the last one, requests `texts`, and takes over its results. Returns
    /// true if there are new ones.
    pub(super) fn keep_up(&mut self, ctx: &egui::Context, name: Option<&str>, texts: TextRequest) -> bool {
        if self.name.as_deref() != name {
            *self = Self { name: name.map(str::to_owned), ..Self::default() };
            if let Some(name) = self.name.clone() {
                match TextEncoder::start(name, crate::ui::repainter(ctx, 0)) {
                    Ok(encoder) => self.encoder = Some(encoder),
                    Err(e) => self.known = Arc::new(Encoded { problem: Some(e.to_string()), ..Encoded::default() }),
                }
            }
        }
        let Some(encoder) = &self.encoder else { return false };
        // With a full queue the request is repeated at the next redraw.
        if self.requested != texts && encoder.request(texts.clone()) {
            self.requested = texts;
        }
        let Some((generation, known)) = encoder.encoded().newer_than(self.seen) else { return false };
        (self.seen, self.known) = (generation, known);
        true
    }

    /// Result for a text; `None` until the encoder has read it.
    pub(super) fn of(&self, text: &ParsedQuery) -> Option<&EncodedText> {
        self.known.texts.get(text)
    }

    /// Embeddings of the phrases of a text, if the encoder knows its words.
    pub(super) fn phrases(&self, text: &ParsedQuery) -> Option<&TextEmbeddings> {
        self.of(text).filter(|t| t.known).map(|_| &self.known.phrases)
    }

    /// True if a text may yet be encoded.
    pub(super) fn is_pending(&self, text: &ParsedQuery) -> bool {
        self.known.problem.is_none() && self.of(text).is_none()
    }

    /// Reason why texts cannot be compared with embeddings of objects, if they cannot.
    pub(super) fn problem(&self) -> Option<&str> {
        let failed = || self.known.texts.values().find_map(|t| t.problem.as_ref());
        self.known.problem.as_ref().or_else(failed).map(String::as_str)
    }
}
