//! Numbers for people: one form per quantity, everywhere.

use std::path::Path;

use crate::scene::text;

pub use crate::scene::plan::{bytes, count};

/// A duration: "8 s", "2:05", "1:02:05".
pub fn duration(secs: f64) -> String {
    if !secs.is_finite() || secs < 0.0 {
        return "–".into();
    }
    let s = secs.round() as u64;
    match (s / 3600, (s / 60) % 60, s % 60) {
        (0, 0, s) => format!("{s} s"),
        (0, m, s) => format!("{m}:{s:02}"),
        (h, m, s) => format!("{h}:{m:02}:{s:02}"),
    }
}

/// A rate with three digits and its unit: "12.3 steps/s".
pub fn rate(per_sec: f64, unit: &str) -> String {
    match per_sec {
        r if !r.is_finite() || r <= 0.0 => "–".into(),
        r if r < 10.0 => format!("{r:.2} {unit}/s"),
        r if r < 100.0 => format!("{r:.1} {unit}/s"),
        r => format!("{} {unit}/s", count(r.round() as u64)),
    }
}

/// A PSNR: "23.41 dB".
pub fn decibel(db: f64) -> String {
    if db.is_finite() { format!("{db:.2} dB") } else { "–".into() }
}

/// The rendering time of a picture: "12 ms".
pub fn millis(secs: f64) -> String {
    if secs < 0.01 { format!("{:.1} ms", secs * 1e3) } else { format!("{:.0} ms", secs * 1e3) }
}

/// A path as it may be shown.
pub fn path(path: &Path) -> String {
    text::line(&path.to_string_lossy()).into_owned()
}

/// A text on one line, cut in the middle so that it has at most `limit` characters.
pub fn shortened(text: &str, limit: usize) -> String {
    let text = &*text::line(text);
    let n = text.chars().count();
    if n <= limit {
        return text.to_owned();
    }
    let keep = limit.saturating_sub(1);
    let (head, tail) = (keep / 2, keep - keep / 2);
    text.chars().take(head).chain(['…']).chain(text.chars().skip(n - tail)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_and_rates() {
        assert_eq!(duration(8.4), "8 s");
        assert_eq!(duration(125.0), "2:05");
        assert_eq!(duration(3725.0), "1:02:05");
        assert_eq!(duration(f64::NAN), "–");
        assert_eq!(rate(12.345, "steps"), "12.3 steps/s");
        assert_eq!(rate(1234.0, "steps"), "1,234 steps/s");
        assert_eq!(rate(0.0, "steps"), "–");
    }

    #[test]
    fn long_texts_keep_both_ends() {
        assert_eq!(shortened("short", 10), "short");
        let cut = shortened("a/very/long/path/to/a/file.ply", 12);
        assert_eq!(cut.chars().count(), 12);
        assert!(cut.starts_with("a/ve") && cut.ends_with("e.ply"), "{cut}");
    }
}
