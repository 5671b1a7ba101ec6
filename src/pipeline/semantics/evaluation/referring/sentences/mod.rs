//! Sentences of every kind about a scene.

mod absent;
mod chains;
mod colors;
mod groups;
mod kinds;
mod measures;
mod names;
mod pairs;
mod parts;
mod places;
mod questions;
mod sizes;

use super::collect::SentenceSet;
use super::scope::TrueScope;

/// Writes all sentences, with their truth or as skipped.
pub(super) fn write(scope: &TrueScope, set: &mut SentenceSet) {
    for part in [
        names::write,
        groups::write,
        sizes::write,
        measures::write,
        places::write,
        pairs::write,
        parts::write,
        colors::write,
        kinds::write,
        questions::write,
        chains::write,
        absent::write,
    ] {
        part(scope, set);
    }
}
