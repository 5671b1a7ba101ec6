//! The first and the second of two views, of which one is active.

use super::Queries;
use super::side::QuerySide;
use crate::pipeline::semantics::recipe::Recipe;
use crate::scene::SemanticMap;

impl Queries {
    /// True if the second of two views is active, which gets new queries.
    pub fn is_second(&self) -> bool {
        self.active == 1
    }

    /// Makes the first or the second of two views active.
    pub(crate) fn work_in(&mut self, second: bool) {
        self.active = usize::from(second);
    }

    /// Runs `act` with the first or the second of two views active.
    pub fn in_view<R>(&mut self, second: bool, act: impl FnOnce(&mut Self) -> R) -> R {
        let before = self.is_second();
        self.work_in(second);
        let result = act(self);
        self.work_in(before);
        result
    }

    /// Values of the first and of the second view.
    fn in_order<T>(&self, of: impl Fn(&QuerySide) -> T) -> [T; 2] {
        self.sides.each_ref().map(of)
    }

    /// The queries that are pinned in the first and the second view.
    pub(crate) fn pinned_texts(&self) -> [Vec<String>; 2] {
        self.in_order(QuerySide::pinned_texts)
    }

    /// Pins only these queries in the first and the second view.
    pub(crate) fn pin_only(&mut self, texts: &[Vec<String>; 2], semantics: &SemanticMap) {
        for (second, texts) in [false, true].into_iter().zip(texts) {
            self.in_view(second, |all| {
                if all.side().pinned.iter().map(|q| &q.text).ne(texts) {
                    all.side_mut().pinned = all.answers(texts, semantics);
                }
            });
        }
    }

    /// Recipe of the active view.
    pub(crate) fn recipe(&self) -> &Recipe {
        &self.side().settings.recipe
    }

    /// Recipes of the first and the second view.
    pub(crate) fn recipes(&self) -> [Recipe; 2] {
        self.in_order(|side| side.settings.recipe.clone())
    }

    /// Sets the recipes of the first and the second view and answers again.
    pub(crate) fn set_recipes(&mut self, recipes: &[Recipe; 2], semantics: &SemanticMap) {
        if self.recipes() != *recipes {
            for (side, recipe) in self.sides.iter_mut().zip(recipes) {
                side.settings.recipe = recipe.clone();
            }
            self.ask_again(semantics);
        }
    }
}
