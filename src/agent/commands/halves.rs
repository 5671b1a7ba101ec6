//! The half of a request that is not understood, beside one that is.

use crate::agent::words::request_tokens;

/// Words that separate one command from the next.
pub(super) const SEPARATORS: [&str; 4] = [",", "and", "then", "?"];

/// Returns the part of a request that is not understood, if the rest of it is: its end, or else its beginning.
pub(super) fn not_understood(request: &str, is_understood: impl Fn(&str) -> bool) -> Option<&str> {
    let separators: Vec<_> =
        request_tokens(request).into_iter().filter(|t| SEPARATORS.contains(&t.low.as_str())).map(|t| t.at).collect();
    let divided = |at: &std::ops::Range<usize>| {
        let [before, after] = [request.get(..at.start)?, request.get(at.end..)?].map(bare);
        (!before.is_empty() && !after.is_empty()).then_some((before, after))
    };
    let is_half = |known: &str, other: &str| is_understood(known) && !is_understood(other);
    let end = separators.iter().rev().filter_map(divided).find(|(before, after)| is_half(before, after));
    let begin = || separators.iter().filter_map(divided).find(|(before, after)| is_half(after, before));
    end.map(|(_, after)| after).or_else(|| begin().map(|(before, _)| before))
}

/// A part without the marks and the words between parts at its ends.
fn bare(part: &str) -> &str {
    let mut part = part.trim_matches(|c: char| c.is_whitespace() || ",;.!:".contains(c));
    for word in ["and ", "then "] {
        part = part.strip_prefix(word).unwrap_or(part).trim_start();
    }
    for word in [" and", " then"] {
        part = part.strip_suffix(word).unwrap_or(part).trim_end_matches([',', ' ']);
    }
    part
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_half_that_is_not_understood_is_named() {
        let part = |request| not_understood(request, |text| text.starts_with("hide") || text.starts_with("which"));
        let which = "which is bigger, the camera or the bear, and turn the lamp off";
        assert_eq!(part(which), Some("turn the lamp off"));
        assert_eq!(part("hide the lamp and fry the mug"), Some("fry the mug"));
        assert_eq!(part("fry the mug, then hide the lamp"), Some("fry the mug"));
        // Controls: nothing of it is understood, or it has one half only.
        assert_eq!([part("fry the mug and eat it"), part("fry the mug")], [None, None]);
    }
}
