//! Lengths and quantities: "20 cm", "of greater size than", and words for the camera.

use super::Grammar;
use crate::pipeline::semantics::query::language::expression::OrderBy;
use crate::pipeline::semantics::query::language::tokens::number;

/// Reads "of greater size than", "less tall than": the quantity, whether more of it, and the number of words.
pub(super) fn said_at_length(g: &Grammar<'_>, from: usize, j: usize) -> Option<(OrderBy, bool, usize)> {
    let words = &g.words[from..j];
    let skip = usize::from(matches!(words.first(), Some(&("of" | "with"))));
    let (more, quantity) = match words.get(skip..)? {
        ["greater" | "more" | "larger", quantity, "than", ..] => (true, quantity),
        ["smaller" | "less" | "lesser", quantity, "than", ..] => (false, quantity),
        _ => return None,
    };
    let order = g.vocabulary.quantity(quantity)?;
    Some((if *quantity == "size" { OrderBy::Size } else { order }, more, skip + 3))
}

/// Number of words at the start that mean the camera.
pub(super) fn is_eye(g: &Grammar<'_>, words: &[&str]) -> Option<usize> {
    match words {
        // A thing of this name comes first.
        ["the", "camera" | "viewer" | "eye", ..] | ["camera" | "viewer", ..]
            if words.iter().take(2).any(|w| g.known.ends(w)) =>
        {
            None
        }
        ["me" | "us" | "here", ..] => Some(1),
        ["the", "camera" | "viewer" | "eye", ..] | ["my", "eye", ..] => Some(2),
        ["camera" | "viewer"] => Some(1),
        _ => None,
    }
}

/// Reads a length, in meters: "20 cm", "half a meter".
pub(super) fn length(g: &Grammar<'_>, from: usize, j: usize) -> Option<(f64, usize)> {
    let words = g.words.get(from..j)?;
    let (amount, n) = match words {
        ["half", "a" | "an", ..] => (0.5, 2),
        ["a" | "an" | "one", ..] => (1.0, 1),
        [first, ..] => (number(first)?, 1),
        [] => return None,
    };
    let unit = g.vocabulary.unit(words.get(n)?)?;
    Some((amount * unit, from + n + 1)).filter(|(meters, _)| meters.is_finite() && *meters >= 0.0)
}
