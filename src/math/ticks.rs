//! Steps between the labels of an axis.

/// The smallest of 1, 2 and 5 times a power of ten that is at least `least`; 1 if that is no positive number.
pub(crate) fn round_step(least: f64) -> f64 {
    if !(least > 0.0 && least.is_finite()) {
        return 1.0;
    }
    // Negative powers of ten are not exact, their quotients are.
    let power = least.log10().floor() as i32;
    let times = |factor: f64, power: i32| match power {
        0.. => factor * 10_f64.powi(power),
        _ => factor / 10_f64.powi(-power),
    };
    let steps = [times(1.0, power), times(2.0, power), times(5.0, power), times(1.0, power + 1)];
    steps.into_iter().find(|step| *step >= least * (1.0 - 1e-9)).unwrap_or(steps[3])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round_and_not_too_small() {
        let steps = [0.07, 0.1, 0.11, 1.0, 3.0, 5.0, 5.1, 75.0, 1e6].map(round_step);
        assert_eq!(steps, [0.1, 0.1, 0.2, 1.0, 5.0, 5.0, 10.0, 100.0, 1e6]);
        // Control: no step is without an end.
        assert_eq!([0.0, -1.0, f64::NAN, f64::INFINITY].map(round_step), [1.0; 4]);
        assert!((1..2000).map(|i| f64::from(i) * 0.37).all(|least| {
            let step = round_step(least);
            step >= least * 0.999 && step < 2.6 * least
        }));
    }
}
