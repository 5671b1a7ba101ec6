//! Numbers on the command line: what is no number, not finite or beyond its range is refused before
//! anything is opened, with the range.

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// Parses a number within a range; NaN lies within none.
pub(crate) fn within<T>(range: RangeInclusive<T>) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static
where
    T: FromStr + PartialOrd + Display + Clone + Send + Sync + 'static,
{
    move |text| {
        let number: Option<T> = text.trim().parse().ok().filter(|v| range.contains(v));
        number.ok_or_else(|| format!("a number from {} to {} is needed", range.start(), range.end()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stay_within_their_range() {
        let parse = within(0.0..=255.0_f32);
        assert_eq!((parse("0"), parse(" 2.5 "), parse("255")), (Ok(0.0), Ok(2.5), Ok(255.0)));
        for bad in ["nan", "NaN", "inf", "-inf", "-0.1", "255.1", "1e99", "", "x"] {
            assert!(parse(bad).expect_err(bad).contains("from 0 to 255"), "{bad}");
        }
        let parse = within(1..=10_usize);
        assert_eq!(parse("10"), Ok(10));
        for bad in ["0", "11", "-1", "1.5", "99999999999999999999999"] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }
}
