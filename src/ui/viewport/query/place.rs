//! Place from which the scene is asked, and the numbers of what was found together.

use super::side::QuerySide;
use super::{Asked, Queries};
use crate::pipeline::semantics::query::language::QueryPlace;
use crate::scene::{IdentityId, SemanticMap};

impl Queries {
    /// Sets the place from which the scene is asked, and answers again where left and right depend on it.
    pub(crate) fn ask_from(&mut self, place: QueryPlace, semantics: &SemanticMap) {
        if self.place != place {
            self.place = place;
            if self.sides.iter().flat_map(QuerySide::all).any(Asked::is_of_view) {
                self.ask_again(semantics);
            }
        }
    }

    /// True if an answer is on screen.
    pub(in crate::ui::viewport) fn is_asked(&self) -> bool {
        self.sides.iter().any(|side| side.live.is_some() || !side.pinned.is_empty())
    }

    /// Numbers of the things that the query in the field found together, from 1; none if it found one.
    pub(in crate::ui::viewport) fn numbers(&self) -> Vec<(IdentityId, usize)> {
        let shown = self.side().live.as_ref().map(|q| q.shown(&self.side().settings)).unwrap_or_default();
        if shown.len() < 2 { Vec::new() } else { shown.into_iter().zip(1..).collect() }
    }
}
