//! Queries go on in another scene of the same place.

use super::Queries;
use crate::scene::SemanticMap;

impl Queries {
    /// Clears the queries for another scene. With its objects, asks for the same again, in both views.
    pub(crate) fn change_scene(&mut self, goes_on: Option<&SemanticMap>) {
        let typed = self.sides.each_ref().map(|side| side.typed.clone());
        let pinned = self.pinned_texts();
        self.clear();
        // The scene that was clicked to be opened may have been in the second view.
        self.work_in(false);
        let Some(semantics) = goes_on else { return };
        for (second, text) in [false, true].into_iter().zip(&typed) {
            if !text.trim().is_empty() {
                self.in_view(second, |all| all.ask(text, semantics));
            }
        }
        self.pin_only(&pinned, semantics);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Identities, Level, NO_IDENTITY};

    #[test]
    fn queries_go_on_only_in_a_scene_of_the_same_place() {
        let mut identities = Identities::default();
        identities.add(Level::Object, NO_IDENTITY, vec!["table".into()]);
        let lamp = identities.add(Level::Object, NO_IDENTITY, vec!["lamp".into()]);
        let before = SemanticMap { identities, ..SemanticMap::default() };
        let mut identities = Identities::default();
        let lamp_alone = identities.add(Level::Object, NO_IDENTITY, vec!["lamp".into()]);
        let after = SemanticMap { identities, ..SemanticMap::default() };

        let mut queries = Queries::default();
        queries.ask("lamp", &before);
        queries.pin_only(&[Vec::new(), vec!["table".into()]], &before);
        assert_eq!(queries.found(), [lamp]);
        queries.change_scene(Some(&after));
        assert_eq!(queries.found(), [lamp_alone], "the same words, another number");
        assert_eq!(queries.pinned_texts()[1], ["table"], "it is asked for, found or not");
        queries.change_scene(None);
        assert!(queries.found().is_empty() && queries.pinned_texts()[1].is_empty(), "control: another place");
    }
}
