//! Axes of plots, on paper and in the window: logarithmic, with a band of its own for zero, which has no logarithm,
//! and with marks wherever they begin and end.

/// Smallest span of an axis, decades: what differs less is drawn as differing little.
const LEAST_SPAN: f64 = 0.02;
/// Span around a single value, decades.
const SINGLE: f64 = 0.3;
/// Room on both sides, as a share of the span.
const SPARE: f64 = 0.06;
/// Height of the band of zero, as a share of the span.
const BAND: f64 = 0.14;
/// Marks with a number that an axis has at most.
const MOST: usize = 9;
/// And at least.
const LEAST: usize = 3;

/// An axis in decimal logarithms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LogAxis {
    /// Ends of the logarithmic part.
    low: f64,
    high: f64,
    /// Set if something is zero.
    zero: bool,
    /// Set if something is less, which is drawn there as well.
    negative: bool,
}

/// A mark: where it is, and whether its number stands at it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tick {
    /// Decimal logarithm of the number.
    pub(crate) at: f64,
    pub(crate) named: bool,
}

impl LogAxis {
    /// The axis that holds these values; those that are no numbers are left out. `None` of none.
    pub(crate) fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
        let (mut zero, mut negative) = (false, false);
        for v in values.into_iter().filter(|v| v.is_finite()) {
            if v > 0.0 {
                (least, most) = (least.min(v), most.max(v));
            } else {
                (zero, negative) = (true, negative || v < 0.0);
            }
        }
        let (low, high) = match (most > 0.0, zero) {
            (true, _) => (least.log10(), most.log10()),
            // Zeros alone: what is above them is there to be seen as above.
            (false, true) => (-3.0, 0.0),
            (false, false) => return None,
        };
        let span = if low == high { SINGLE } else { (high - low).max(LEAST_SPAN) };
        let (middle, half) = (0.5 * (low + high), (0.5 + SPARE) * span);
        Some(Self { low: middle - half, high: middle + half, zero, negative })
    }

    /// The place of a value; that of zero, and of what is less, is the middle of its band.
    pub(crate) fn at(&self, value: f64) -> f64 {
        if value > 0.0 { value.log10() } else { self.low - 0.5 * BAND * (self.high - self.low) }
    }

    /// Ends of the axis, the band of zero included.
    pub(crate) fn bounds(&self) -> (f64, f64) {
        let band = if self.zero { BAND * (self.high - self.low) } else { 0.0 };
        (self.low - band, self.high)
    }

    /// The end of the band of zero, if there is one.
    pub(crate) fn band_end(&self) -> Option<f64> {
        self.zero.then_some(self.low)
    }

    /// The number at the band of zero.
    pub(crate) fn zero_name(&self) -> &'static str {
        if self.negative { "\u{2264} 0" } else { "0" }
    }

    /// Marks of the logarithmic part.
    pub(crate) fn ticks(&self) -> Vec<Tick> {
        ticks(self.low, self.high)
    }
}

/// Marks between two decimal logarithms: at least three have a number wherever numbers are that close, and at most
/// nine.
pub(crate) fn ticks(low: f64, high: f64) -> Vec<Tick> {
    if !(low.is_finite() && high.is_finite() && low < high && high - low < 300.0) {
        return Vec::new();
    }
    let inside = |at: &f64| (low..=high).contains(at);
    let digits = |named: &[i32], every: i32| -> Vec<Tick> {
        let decades = low.floor() as i32..=high.ceil() as i32;
        let ticks = decades
            .flat_map(|decade| (1..10).map(move |digit| (decade, digit, f64::from(decade) + f64::from(digit).log10())));
        let named = |decade: i32, digit| named.contains(&digit) && decade.rem_euclid(every) == 0;
        ticks.filter(|t| inside(&t.2)).map(|(e, d, at)| Tick { at, named: named(e, d) }).collect()
    };
    let count = |ticks: &[Tick]| ticks.iter().filter(|t| t.named).count();
    for every in [1, 2, 3, 5, 10, 20, 50, 100] {
        let found = digits(&[1], every);
        if (LEAST..=MOST).contains(&count(&found)) {
            return found;
        }
    }
    for named in [&[1, 3][..], &[1, 2, 5], &[1, 2, 3, 4, 5, 6, 7, 8, 9]] {
        let found = digits(named, 1);
        if (LEAST..=MOST).contains(&count(&found)) {
            return found;
        }
    }
    even(low, high)
}

/// Marks at round numbers, evenly spaced.
fn even(low: f64, high: f64) -> Vec<Tick> {
    let (from, to) = (10.0_f64.powf(low), 10.0_f64.powf(high));
    let step_of = |pieces: f64| {
        let rough = (to - from) / pieces;
        let power = 10.0_f64.powf(rough.log10().floor());
        [1.0, 2.0, 5.0, 10.0].map(|k| k * power).into_iter().find(|s| *s >= rough * (1.0 - 1e-9)).unwrap_or(rough)
    };
    let at = |step: f64| {
        let (first, last) = ((from / step).ceil() as i64, (to / step).floor() as i64);
        (first..=last).map(|k| Tick { at: (k as f64 * step).log10(), named: true }).collect::<Vec<_>>()
    };
    let tries = [5.0, 8.0, 12.0].map(|pieces| at(step_of(pieces)));
    let most = tries.last().cloned().unwrap_or_default();
    tries.into_iter().find(|t| t.len() >= LEAST).unwrap_or(most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::format::tick;

    fn names(ticks: &[Tick]) -> Vec<String> {
        ticks.iter().filter(|t| t.named).map(|t| tick(10.0_f64.powf(t.at))).collect()
    }

    #[test]
    fn every_axis_has_three_marks_or_more_and_not_too_many() {
        // From a thousandth of a decade to a hundred decades, beginning anywhere.
        for k in 0..4000 {
            let span = 10.0_f64.powf(-3.0 + 5.0 * f64::from(k % 100) / 99.0);
            let low = -8.0 + 0.377 * f64::from(k / 100);
            let ticks = ticks(low, low + span);
            let named = ticks.iter().filter(|t| t.named).count();
            assert!((3..=11).contains(&named), "{named} marks from {low} over {span}: {:?}", names(&ticks));
            assert!(ticks.iter().all(|t| (low..=low + span).contains(&t.at)));
            assert!(ticks.windows(2).all(|w| w[0].at < w[1].at));
        }
        assert!(ticks(f64::NAN, 1.0).is_empty() && ticks(1.0, 1.0).is_empty() && ticks(0.0, 1e9).is_empty());
    }

    #[test]
    fn marks_are_where_they_are_expected() {
        assert_eq!(names(&ticks(-2.5, 0.2)), ["0.01", "0.1", "1"]);
        assert_eq!(names(&ticks(-1.1, 0.1)), ["0.1", "0.3", "1"]);
        assert_eq!(names(&ticks(-6.1, -3.9)), ["1e-6", "1e-5", "1e-4"]);
        // 11.2 and 14.7: no power of ten, and one number of 1, 2 and 5 at most.
        assert_eq!(names(&ticks(11.0_f64.log10(), 15.0_f64.log10())), ["11", "12", "13", "14", "15"]);
        let narrow = names(&ticks(0.030_f64.log10(), 0.0305_f64.log10()));
        assert_eq!(narrow, ["0.03", "0.0301", "0.0302", "0.0303", "0.0304", "0.0305"]);
        assert_eq!(names(&ticks(-12.0, 12.0)).len(), 9);
    }

    #[test]
    fn zero_is_below_all_that_is_not_and_in_no_place_of_theirs() {
        let axis = LogAxis::of([0.0, 1e-9, 0.02, f64::NAN]).expect("an axis");
        let band = axis.band_end().expect("a band");
        let (low, high) = axis.bounds();
        assert!(low < axis.at(0.0) && axis.at(0.0) < band && band < axis.at(1e-9) && axis.at(0.02) < high);
        assert!(axis.ticks().iter().all(|t| t.at >= band), "the band has no logarithms");
        assert_eq!(axis.zero_name(), "0");
        // The control: where nothing is zero, there is no band.
        let above = LogAxis::of([1e-9, 0.02]).expect("an axis");
        assert_eq!((above.band_end(), above.bounds().0), (None, band));
    }

    #[test]
    fn zeros_alone_and_a_single_value_have_axes_too() {
        let zeros = LogAxis::of([0.0, -1e-12]).expect("an axis");
        assert!(zeros.band_end().is_some() && zeros.ticks().len() > 2);
        assert_eq!(zeros.zero_name(), "\u{2264} 0");
        let one = LogAxis::of([3.0]).expect("an axis");
        assert!(one.bounds().0 < one.at(3.0) && one.at(3.0) < one.bounds().1 && names(&one.ticks()).len() >= 3);
        let alike = LogAxis::of([3.0, 3.000_001]).expect("an axis");
        assert!(names(&alike.ticks()).len() >= 3, "{:?}", names(&alike.ticks()));
        assert!(LogAxis::of([f64::NAN, f64::INFINITY]).is_none() && LogAxis::of([]).is_none());
    }
}
