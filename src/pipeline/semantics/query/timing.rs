//! Stages of a query by name, with one value for each.

use std::time::Instant;

use serde::Serialize;

/// Milliseconds of each stage of a query.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct StagesMs {
    /// Encoding of the text.
    pub(crate) encode: f64,
    /// Scoring of identities for its phrases.
    pub(crate) relevancy: f64,
    /// Choice of the identities of the answer.
    pub(crate) localize: f64,
    /// Search for their pixels in the view.
    pub(crate) mask: f64,
    /// Rendering of mask and relevancy as a picture.
    pub(crate) draw: f64,
}

/// Names of the stages, in their order.
pub(crate) const STAGES: [&str; 5] = ["encode", "relevancy", "localize", "mask", "draw"];

impl StagesMs {
    /// Values in the order of [`STAGES`].
    pub(crate) fn values(&self) -> [f64; 5] {
        [self.encode, self.relevancy, self.localize, self.mask, self.draw]
    }

    /// Creates the stages from these values.
    pub(crate) fn of([encode, relevancy, localize, mask, draw]: [f64; 5]) -> Self {
        Self { encode, relevancy, localize, mask, draw }
    }

    pub(crate) fn whole(&self) -> f64 {
        self.values().iter().sum()
    }

    /// Adds the values of both.
    pub(crate) fn and(self, other: Self) -> Self {
        let (a, b) = (self.values(), other.values());
        Self::of(std::array::from_fn(|k| a[k] + b[k]))
    }
}

/// Milliseconds since `start`.
pub(crate) fn ms_since(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_keep_their_names_and_order() {
        let stages = StagesMs::of([1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!((stages.encode, stages.draw, stages.whole()), (1.0, 5.0, 15.0));
        assert_eq!(stages.and(stages).values(), [2.0, 4.0, 6.0, 8.0, 10.0]);
        let json = serde_json::to_value(stages).expect("json");
        assert_eq!(STAGES.map(|name| json[name].as_f64()), stages.values().map(Some));
    }

    #[test]
    fn time_is_in_milliseconds() {
        let start = Instant::now();
        std::thread::sleep(std::time::Duration::from_millis(3));
        assert!(ms_since(start) >= 3.0);
    }
}
