//! The stages of a query, by name: what is known of each of them stands side by side.

use std::time::Instant;

use serde::Serialize;

/// Something for each stage of a query: a time of one, or percentiles of many.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Stages<T> {
    /// The text becomes vectors.
    pub(crate) encode: T,
    /// Identities are scored for its phrases.
    pub(crate) relevancy: T,
    /// The identities that are meant are chosen.
    pub(crate) localize: T,
    /// Their pixels in the view are found.
    pub(crate) mask: T,
    /// Mask and relevancy become a picture.
    pub(crate) draw: T,
}

/// Names of the stages, in their order.
pub(crate) const STAGES: [&str; 5] = ["encode", "relevancy", "localize", "mask", "draw"];

/// Milliseconds of one query.
pub(crate) type StagesMs = Stages<f64>;

impl<T: Copy> Stages<T> {
    /// The values, as [`STAGES`] names them.
    pub(crate) fn values(&self) -> [T; 5] {
        [self.encode, self.relevancy, self.localize, self.mask, self.draw]
    }

    /// The stages of these values.
    pub(crate) fn of([encode, relevancy, localize, mask, draw]: [T; 5]) -> Self {
        Self { encode, relevancy, localize, mask, draw }
    }
}

impl StagesMs {
    pub(crate) fn whole(&self) -> f64 {
        self.values().iter().sum()
    }

    /// Of both, one after the other.
    pub(crate) fn and(self, other: Self) -> Self {
        let (a, b) = (self.values(), other.values());
        Self::of(std::array::from_fn(|k| a[k] + b[k]))
    }
}

/// Milliseconds since then.
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
