//! Marks and numbers of the plot's axes: those of the report's own plots, for the visible range.

use egui_plot::{GridInput, GridMark};

use crate::measure::axis::{LogAxis, ticks};

/// Step sizes of marks without and with a number.
const SIZES: [f64; 2] = [0.08, 1.0];

/// Marks of an axis in its visible range, in decimal logarithms, and one in the band of zero.
pub(crate) fn marks(axis: &LogAxis, input: &GridInput) -> Vec<GridMark> {
    let (low, high) = input.bounds;
    let low = axis.band_end().map_or(low, |end| low.max(end));
    let mark = |at: f64, named: bool| GridMark { value: at, step_size: SIZES[usize::from(named)] };
    let zero = axis.band_end().map(|_| mark(axis.at(0.0), true));
    ticks(low, high).into_iter().map(|t| mark(t.at, t.named)).chain(zero).collect()
}

/// The number of a mark, if it has one.
pub(crate) fn label(axis: &LogAxis, mark: GridMark, text: impl Fn(f64) -> String) -> String {
    match axis.band_end() {
        _ if mark.step_size < SIZES[1] => String::new(),
        Some(end) if mark.value < end => axis.zero_name().to_owned(),
        _ => text(10.0_f64.powf(mark.value)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::format::tick;

    fn texts(axis: &LogAxis, bounds: (f64, f64)) -> Vec<String> {
        let input = GridInput { bounds, base_step_size: 1.0 };
        marks(axis, &input).into_iter().map(|m| label(axis, m, tick)).filter(|t| !t.is_empty()).collect()
    }

    #[test]
    fn marks_follow_what_is_in_view_and_zero_has_its_own() {
        let axis = LogAxis::of([0.0, 1e-3, 1.0]).expect("an axis");
        assert_eq!(texts(&axis, axis.bounds()), ["0.001", "0.01", "0.1", "1", "0"]);
        assert_eq!(texts(&axis, (0.030_f64.log10(), 0.0305_f64.log10())).len(), 6 + 1, "zoomed in");
        // Control: without a zero there is no mark of one.
        let above = LogAxis::of([1e-3, 1.0]).expect("an axis");
        assert_eq!(texts(&above, above.bounds()), ["0.001", "0.01", "0.1", "1"]);
    }
}
