//! Numbers as the user reads them: one form per quantity, in the window, on the command line and in reports.

use std::time::SystemTime;

/// Text in place of a missing number.
pub(crate) const NONE: &str = "–";

/// A whole number with thousands separators.
pub(crate) fn count(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::with_capacity(digits.len() + digits.len() / 3);
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(c);
    }
    out
}

/// "3 parts", "1 part".
pub(crate) fn things(n: usize, what: &str) -> String {
    format!("{} {what}{}", count(n as u64), if n == 1 { "" } else { "s" })
}

/// Items of a list in a sentence: "a, b and c".
pub(crate) fn list(items: &[String]) -> String {
    match items {
        [start @ .., last] if !start.is_empty() => format!("{} and {last}", start.join(", ")),
        _ => items.concat(),
    }
}

/// Text with a capital as its first letter.
pub(crate) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |c| c.to_uppercase().chain(letters).collect())
}

/// Bytes in decimal units: "12 MB".
pub(crate) fn bytes(n: u64) -> String {
    match n {
        0..1_000 => format!("{n} B"),
        1_000..1_000_000 => format!("{:.0} kB", n as f64 / 1e3),
        1_000_000..999_500_000 => format!("{:.0} MB", n as f64 / 1e6),
        999_500_000..1_000_000_000_000 => format!("{:.1} GB", n as f64 / 1e9),
        _ => format!("{} TB", count((n as f64 / 1e12).round() as u64)),
    }
}

/// Megabytes, as models state their size: "41 MB", "2.6 GB".
pub(crate) fn megabytes(n: u64) -> String {
    bytes(n.saturating_mul(1_000_000))
}

/// A share of 0 to 1 with two significant digits: "0.072 %", "1.5 %", "38 %".
pub(crate) fn percent(share: f64) -> String {
    if !share.is_finite() {
        return NONE.into();
    }
    let percent = 100.0 * share;
    // Rounded first: 9.96 is 10, not 10.0.
    let rounded: f64 = format!("{percent:.1e}").parse().unwrap_or(percent);
    match rounded.abs() {
        0.0 => "0 %".into(),
        size if size >= 10.0 => format!("{percent:.0} %"),
        size => format!("{rounded:.*} %", (1.0 - size.log10().floor()) as usize),
    }
}

/// A time that passes while one waits: "8 s", "2:05", "1:02:05".
pub(crate) fn duration(secs: f64) -> String {
    if !secs.is_finite() || secs < 0.0 {
        return NONE.into();
    }
    let s = secs.round() as u64;
    match (s / 3600, (s / 60) % 60, s % 60) {
        (0, 0, s) => format!("{s} s"),
        (0, m, s) => format!("{m}:{s:02}"),
        (h, m, s) => format!("{h}:{m:02}:{s:02}"),
    }
}

/// A time that is a guess: "40 s", "about 15 min", "about 1.5 h".
pub(crate) fn about(secs: f64) -> String {
    match secs {
        s if !s.is_finite() || s < 0.0 => NONE.into(),
        s if s < 90.0 => format!("{} s", (s / 10.0).ceil() * 10.0),
        s if s < 5_400.0 => format!("about {} min", (s / 60.0).round()),
        s => format!("about {} h", (s / 1_800.0).round() / 2.0),
    }
}

/// A time that is estimated, with two significant digits: "32 ms", "0.65 s", "3.2 s".
pub(crate) fn roughly(secs: f64) -> String {
    match secs {
        s if !s.is_finite() || s < 0.0 => NONE.into(),
        s if s < 0.0995 => format!("{:.0} ms", s * 1e3),
        s if s < 0.995 => format!("{s:.2} s"),
        s if s < 9.95 => format!("{s:.1} s"),
        s => format!("{s:.0} s"),
    }
}

/// A measured time with four significant digits: "3.200 ms".
pub(crate) fn seconds(secs: f64) -> String {
    match secs {
        s if !(s > 0.0) => "0".into(),
        s if s < 1e-3 => format!("{} \u{b5}s", number(s * 1e6)),
        s if s < 1.0 => format!("{} ms", number(s * 1e3)),
        s => format!("{} s", number(s)),
    }
}

/// The time of a frame or of a step of a query: "12 ms", "1.23 ms", "2.5 s".
pub(crate) fn millis(secs: f64) -> String {
    match secs * 1e3 {
        ms if ms < 0.1 => format!("{ms:.3} ms"),
        ms if ms < 10.0 => format!("{ms:.2} ms"),
        ms if ms >= 1e3 => format!("{:.1} s", ms / 1e3),
        ms => format!("{ms:.0} ms"),
    }
}

/// A rate with three digits and its unit: "12.3 steps/s".
pub(crate) fn rate(per_sec: f64, unit: &str) -> String {
    match per_sec {
        r if !r.is_finite() || r <= 0.0 => NONE.into(),
        r if r < 10.0 => format!("{r:.2} {unit}/s"),
        r if r < 100.0 => format!("{r:.1} {unit}/s"),
        r => format!("{} {unit}/s", count(r.round() as u64)),
    }
}

/// A PSNR: "23.41 dB".
pub(crate) fn decibel(db: f64) -> String {
    if db.is_finite() { format!("{db:.2} dB") } else { NONE.into() }
}

/// A measured number with four significant digits, all of them written: columns line up.
pub(crate) fn number(v: f64) -> String {
    let size = v.abs();
    match size {
        _ if v == 0.0 => "0".into(),
        1e-3..1e4 => {
            let decimals = (3 - size.log10().floor() as i32).clamp(0, 6) as usize;
            format!("{v:.decimals$}")
        }
        _ => format!("{v:.2e}"),
    }
}

/// A number within a sentence: at most three decimals, none of them needless.
pub(crate) fn short(v: f64) -> String {
    let text = format!("{v:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// A length: in m, cm or mm where the length of a unit in meters is known, else in units.
pub(crate) fn length(units: f64, meters_per_unit: Option<f64>) -> String {
    let Some(scale) = meters_per_unit else { return format!("{} units", short(units)) };
    match units * scale {
        m if m >= 1.0 => format!("{} m", short((m * 100.0).round() / 100.0)),
        m if m >= 0.01 => format!("{} cm", short((m * 1000.0).round() / 10.0)),
        m => format!("{} mm", short((m * 10_000.0).round() / 10.0)),
    }
}

/// A number with four digits, or a whole one in groups of three.
fn grouped(v: f64) -> String {
    if (999.5..1e15).contains(&v) { count(v.round() as u64) } else { number(v) }
}

/// An area: in m\u{b2}, cm\u{b2} or mm\u{b2} where the length of a unit in meters is known, else in square units.
pub(crate) fn area(square_units: f64, meters_per_unit: Option<f64>) -> String {
    let Some(scale) = meters_per_unit else { return format!("{} units\u{b2}", number(square_units)) };
    match square_units * scale * scale {
        m if m >= 1.0 => format!("{} m\u{b2}", number(m)),
        m if m >= 1e-4 => format!("{} cm\u{b2}", grouped(m * 1e4)),
        m => format!("{} mm\u{b2}", number(m * 1e6)),
    }
}

/// A volume, in the same way.
pub(crate) fn volume(cubic_units: f64, meters_per_unit: Option<f64>) -> String {
    let Some(scale) = meters_per_unit else { return format!("{} units\u{b3}", number(cubic_units)) };
    match cubic_units * scale.powi(3) {
        m if m >= 0.1 => format!("{} m\u{b3}", number(m)),
        m if m >= 1e-6 => format!("{} cm\u{b3}", grouped(m * 1e6)),
        m => format!("{} mm\u{b3}", number(m * 1e9)),
    }
}

/// A number of an axis: at most four significant digits, none of them needless.
pub(crate) fn tick(v: f64) -> String {
    match v.abs() {
        a if a == 0.0 || (1e-3..1e5).contains(&a) => format!("{}", significant(v)),
        _ => format!("{:e}", significant(v)),
    }
}

/// Seconds of an axis.
pub(crate) fn tick_secs(secs: f64) -> String {
    match secs {
        s if s < 0.999e-3 => format!("{} \u{b5}s", significant(s * 1e6)),
        s if s < 0.999 => format!("{} ms", significant(s * 1e3)),
        s => format!("{} s", significant(s)),
    }
}

/// Four significant digits; logarithms and back leave more.
fn significant(v: f64) -> f64 {
    format!("{v:.3e}").parse().unwrap_or(v)
}

/// A share as it is written in the field: "1/255", "1e-4".
pub(crate) fn share(v: f64) -> String {
    let whole = (1.0 / v).round();
    match (1.0 / v - whole).abs() < 1e-6 && whole < 9_999.0 {
        true => format!("1/{whole}"),
        false => format!("{v:.0e}"),
    }
}

/// A time that has passed: "2 h ago", "3 days ago"; the day if that is longer ago.
pub(crate) fn ago(time: SystemTime, now: SystemTime) -> String {
    let minutes = now.duration_since(time).map_or(0, |d| d.as_secs() / 60);
    match minutes {
        0 => "just now".into(),
        1..60 => format!("{minutes} min ago"),
        60..1_440 => format!("{} h ago", minutes / 60),
        1_440..2_880 => "1 day ago".into(),
        2_880..20_160 => format!("{} days ago", minutes / 1_440),
        _ => date(time),
    }
}

/// A moment in Greenwich: "2026-02-28, 13:05 UTC".
pub(crate) fn moment(time: SystemTime) -> String {
    let minutes = time.duration_since(SystemTime::UNIX_EPOCH).map_or(0, |d| d.as_secs() / 60) % 1_440;
    format!("{}, {:02}:{:02} UTC", date(time), minutes / 60, minutes % 60)
}

/// The day of a moment in Greenwich: "2026-02-28". Howard Hinnant's days-to-civil: years that begin in March.
pub(crate) fn date(time: SystemTime) -> String {
    let days = time.duration_since(SystemTime::UNIX_EPOCH).map_or(0, |d| d.as_secs() / 86_400) + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1_460 + day / 36_524 - day / 146_096) / 365;
    let of_year = day - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let (year, month) = if month < 10 { (year, month + 3) } else { (year + 1, month - 9) };
    format!("{:04}-{month:02}-{day:02}", 400 * era + year)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_and_rates() {
        assert_eq!([8.4, 125.0, 3725.0, f64::NAN].map(duration), ["8 s", "2:05", "1:02:05", "–"]);
        assert_eq!([12.345, 1234.0, 0.0].map(|r| rate(r, "steps")), ["12.3 steps/s", "1,234 steps/s", "–"]);
        assert_eq!([1.234e-5, 1.234e-3, 0.1234, 16.0].map(millis), ["0.012 ms", "1.23 ms", "123 ms", "16.0 s"]);
        assert_eq!(millis(2.543), "2.5 s");
        assert_eq!([0.0321, 0.65, 3.21, 42.0, f64::NAN].map(roughly), ["32 ms", "0.65 s", "3.2 s", "42 s", "–"]);
        assert_eq!([23.412, f64::INFINITY].map(decibel), ["23.41 dB", "–"]);
    }

    #[test]
    fn guesses_are_round() {
        let guesses = [3.0, 84.0, 880.0, 5_500.0, 9_000.0, f64::NAN].map(about);
        assert_eq!(guesses, ["10 s", "90 s", "about 15 min", "about 1.5 h", "about 2.5 h", "–"]);
    }

    #[test]
    fn what_is_past_is_told_by_how_long_ago_it_was() {
        let at = |secs: u64| SystemTime::UNIX_EPOCH + std::time::Duration::from_secs(secs);
        let now = at(20_819 * 86_400 + 47_100);
        let told = [0, 59, 60, 7_199, 86_400, 172_800, 1_209_600]
            .map(|secs| ago(now - at(secs).duration_since(at(0)).expect("later"), now));
        assert_eq!(told, ["just now", "just now", "1 min ago", "1 h ago", "1 day ago", "2 days ago", "2026-12-18"]);
        assert_eq!(ago(now + std::time::Duration::from_secs(9), now), "just now", "clocks differ");
        assert_eq!(moment(now), "2027-01-01, 13:05 UTC");
    }

    #[test]
    fn days_are_those_of_the_calendar() {
        let day = |days: u64| date(SystemTime::UNIX_EPOCH + std::time::Duration::from_secs(days * 86_400 + 86_399));
        let days = [0, 58, 59, 11_016, 11_017, 20_454, 20_819].map(day);
        let expected =
            ["1970-01-01", "1970-02-28", "1970-03-01", "2000-02-29", "2000-03-01", "2026-01-01", "2027-01-01"];
        assert_eq!(days, expected);
    }

    #[test]
    fn counts_and_sizes() {
        assert_eq!([7, 1_000, 1_234_567].map(count), ["7", "1,000", "1,234,567"]);
        assert_eq!([999, 1_500, 2_000_000, 3_500_000_000].map(bytes), ["999 B", "2 kB", "2 MB", "3.5 GB"]);
        assert_eq!([41, 999, 1_000, 2_565].map(megabytes), ["41 MB", "999 MB", "1.0 GB", "2.6 GB"]);
        assert_eq!(bytes(u64::MAX), "18,446,744 TB");
        let shares = [0.0, 0.000_716_7, 0.015, 0.0996, 0.38, 1.0, f64::NAN].map(percent);
        assert_eq!(shares, ["0 %", "0.072 %", "1.5 %", "10 %", "38 %", "100 %", "–"]);
        assert_eq!([1, 2].map(|n| things(n, "part")), ["1 part", "2 parts"]);
    }

    #[test]
    fn areas_and_volumes_have_units_of_their_size() {
        assert_eq!(area(2.0, None), "2.000 units\u{b2}");
        let scaled = [1.0, 0.02, 1e-4].map(|side: f64| area(side * side, Some(2.0)));
        assert_eq!(scaled, ["4.000 m\u{b2}", "16.00 cm\u{b2}", "0.04000 mm\u{b2}"]);
        let cubes = [1.0, 0.1, 1e-3].map(|side: f64| volume(side * side * side, Some(1.0)));
        assert_eq!(cubes, ["1.000 m\u{b3}", "1,000 cm\u{b3}", "1.000 mm\u{b3}"]);
        assert_eq!(volume(8.0, None), "8.000 units\u{b3}");
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!([0.0, 0.123456, 12.3456, 12345.6, 1e-9].map(number), ["0", "0.1235", "12.35", "1.23e4", "1.00e-9"]);
        assert_eq!([0.0, 2.5e-6, 0.0123, 12.0].map(seconds), ["0", "2.500 \u{b5}s", "12.30 ms", "12.00 s"]);
        assert_eq!([1.0, 0.1234, 12.5].map(short), ["1", "0.123", "12.5"]);
        assert_eq!([0.1, 1e-5, 30.0 + 1e-12].map(tick), ["0.1", "1e-5", "30"]);
        assert_eq!([1e-3, 2e-6, 5.0].map(tick_secs), ["1 ms", "2 \u{b5}s", "5 s"]);
        assert_eq!([1.0 / 255.0, 1e-4].map(share), ["1/255", "1e-4"]);
    }
}
