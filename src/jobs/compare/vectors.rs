//! Vectors of phrases for other methods' results, from one function; each phrase is encoded once.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::time::Instant;

use crate::jobs::JobError;
use crate::math::stats::median;
use crate::models::{self, Encoder};
use crate::pipeline::semantics::query::recipe::LERFS_PHRASES;
use crate::pipeline::semantics::query::timing::ms_since;

/// Function from an encoder's name and phrases to their vectors.
pub(crate) type TextFunction<'a> = &'a mut dyn FnMut(&str, &[&str]) -> Result<Vec<Vec<f32>>, JobError>;

/// Vectors of phrases, and the time that each took.
pub(crate) struct KnownVectors<'a> {
    encode: TextFunction<'a>,
    repeats: usize,
    /// By encoder and phrase.
    known: HashMap<(String, String), (Vec<f32>, f64)>,
}

impl<'a> KnownVectors<'a> {
    /// Vectors by this function, whose time is the median of so many calls.
    pub(crate) fn new(encode: TextFunction<'a>, repeats: usize) -> Self {
        Self { encode, repeats: repeats.max(1), known: HashMap::new() }
    }

    /// The vector of a phrase and the milliseconds that it takes.
    ///
    /// # Errors
    /// If the encoder is not here or fails.
    pub(crate) fn get(&mut self, encoder: &str, phrase: &str) -> Result<(Vec<f32>, f64), JobError> {
        let key = (encoder.to_owned(), phrase.to_owned());
        if let Some(known) = self.known.get(&key) {
            return Ok(known.clone());
        }
        let (mut vector, mut times) = (None, Vec::with_capacity(self.repeats));
        for _ in 0..self.repeats {
            let start = Instant::now();
            vector = (self.encode)(encoder, &[phrase])?.pop();
            times.push(ms_since(start));
        }
        let none = || JobError::Phrases(format!("the encoder '{encoder}' has no vector of '{phrase}'"));
        let found = (vector.ok_or_else(none)?, median(&times));
        self.known.insert(key, found.clone());
        Ok(found)
    }

    /// Vectors of the canonical phrases.
    ///
    /// # Errors
    /// As [`Self::get`].
    pub(crate) fn canonical(&mut self, encoder: &str) -> Result<Vec<Vec<f32>>, JobError> {
        LERFS_PHRASES.iter().map(|phrase| Ok(self.get(encoder, phrase)?.0)).collect()
    }
}

/// Encoders of the catalog, each opened when it is first needed.
#[derive(Default)]
pub(crate) struct InstalledEncoders(HashMap<String, Box<dyn Encoder>>);

impl InstalledEncoders {
    /// Encodes phrases.
    ///
    /// # Errors
    /// If the encoder is not on this computer, with the way to get it, or if it fails.
    pub(crate) fn encode(&mut self, name: &str, phrases: &[&str]) -> Result<Vec<Vec<f32>>, JobError> {
        let encoder = match self.0.entry(name.to_owned()) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(free) => free.insert(models::encoder(name).map_err(|e| {
                let text = format!("phrases have to be encoded with '{name}': {e}; 'fmlgs models fetch' brings it");
                JobError::Phrases(text)
            })?),
        };
        Ok(encoder.texts(phrases).into_iter().collect::<Result<_, _>>()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_phrase_is_encoded_once_for_each_encoder() {
        let mut asked = Vec::new();
        let mut encode = |name: &str, phrases: &[&str]| {
            asked.push(format!("{name} {}", phrases.join(",")));
            Ok(vec![vec![phrases[0].len() as f32]])
        };
        let mut vectors = KnownVectors::new(&mut encode, 2);
        let (mug, ms) = vectors.get("a", "mug").expect("encoded");
        assert_eq!((mug, vectors.get("a", "mug").expect("known").1), (vec![3.0], ms));
        vectors.get("b", "mug").expect("encoded");
        assert_eq!(vectors.canonical("b").expect("encoded").len(), 4);
        assert_eq!(asked[..3], ["a mug", "a mug", "b mug"]);
        assert_eq!(asked.len(), 4 + 2 * 4);
    }

    #[test]
    fn an_encoder_that_is_not_here_is_named_with_the_remedy() {
        let e = InstalledEncoders::default().encode("clip-of-nobody", &["mug"]).expect_err("not here").to_string();
        assert!(e.contains("clip-of-nobody") && e.contains("fmlgs models fetch"), "{e}");
        let mut empty = |_: &str, _: &[&str]| Ok(Vec::new());
        let e = KnownVectors::new(&mut empty, 1).get("a", "mug").expect_err("no vector").to_string();
        assert!(e.contains("'a'") && e.contains("'mug'"), "{e}");
    }
}
