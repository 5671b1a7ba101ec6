//! Actions on the view and on the selection.

use egui::Context;
use glam::DVec2;

use super::app::App;
use super::labels;
use super::state::Tone;
use crate::navigate::target::Side;
use crate::scene::{Identities, IdentityId, NOBODY};
use crate::ui::actions::{Action, Pane};
use crate::worker::Command;

impl App {
    pub(super) fn view(&mut self, action: &Action, ctx: &Context) {
        let now = ctx.input(|i| i.time);
        self.viewport.act(action, &self.state, &self.worker, now);
        if *action == Action::Inspect && self.viewport.is_inspecting() {
            self.inspect(DVec2::splat(0.5));
        }
    }

    /// Ends the first of these that is there: the tool, the selection, the full view, the running job.
    pub(super) fn dismiss(&mut self, ctx: &Context) {
        match self.viewport.tool() {
            Some(tool) => self.view(&tool, ctx),
            None if self.viewport.picking.selected().is_some() => self.view(&Action::Select(None), ctx),
            None if self.full_view => self.arrange(&Action::FillWindow, ctx),
            None => self.act(Action::Cancel, ctx),
        }
    }

    /// Returns true, with a message, if an action needs the Gaussians of an identity without any.
    pub(super) fn is_about_nothing(&mut self, action: &Action) -> bool {
        let (Action::GoToTarget(id, _)
        | Action::Isolate(Some(id))
        | Action::Arrange(id)
        | Action::Remove(id)
        | Action::ExportTarget(id)) = action
        else {
            return false;
        };
        let Some(map) = self.state.semantics.as_ref().filter(|_| self.state.is_empty(*id)) else { return false };
        let name = self.state.labels.full_name(&map.identities, *id);
        self.state.toast(Tone::Warning, format!("{name} is empty: no Gaussians belong to it."));
        true
    }

    /// Inspects the pixel at a relative position of the view.
    pub(super) fn inspect(&mut self, at: DVec2) {
        if let Some(request) = self.viewport.inspect_request(at, &self.state) {
            self.submit(Command::Inspect(Box::new(request)));
        }
    }

    /// Selected identity, or else the first answer to the query.
    fn chosen_identity(&self) -> Option<IdentityId> {
        self.viewport.picking.selected().or_else(|| self.viewport.queries.found().first().copied())
    }

    /// Applies a key's action to the selected identity.
    pub(super) fn act_on_selected(&mut self, action: &Action, ctx: &Context) {
        let Some(id) = self.chosen_identity() else {
            return self.state.toast(Tone::Info, "Nothing is selected: click an object in the view, or press N.");
        };
        let action = match action {
            Action::HideSelected => Action::Hide(id),
            Action::GoToSelected => Action::GoToTarget(id, Side::Best),
            _ => Action::Isolate(Some(id).filter(|_| !self.viewport.visibility.is_isolated())),
        };
        self.act(action, ctx);
    }

    /// Selects, in the order of the list, the next or previous object or part among its siblings, the whole, or the
    /// first part.
    pub(super) fn select_another(&mut self, action: &Action, ctx: &Context) {
        let Some(map) = self.state.semantics.clone() else {
            return self.state.toast(Tone::Info, "There are no objects yet: find them first (Objects pane).");
        };
        let all = &map.identities;
        let selected = self.viewport.picking.selected();
        let next = match (action, selected) {
            (Action::SelectInner, selected) => {
                let Some(whole) = selected.or_else(|| self.chosen_identity()) else {
                    return self.state.toast(Tone::Info, "Nothing is selected: press N first.");
                };
                let first = listed(all, &self.state.sizes, whole).first().copied();
                if first.is_none() {
                    let name = self.state.labels.full_name(all, whole);
                    return self.state.toast(Tone::Info, format!("{name} has no parts."));
                }
                first
            }
            (Action::SelectOuter, selected) => {
                let Some(part) = selected.or_else(|| self.chosen_identity()) else {
                    return self.state.toast(Tone::Info, "Nothing is selected: press N first.");
                };
                all.ancestors(part).nth(1).or(Some(part))
            }
            (_, selected) => {
                let parent = selected.and_then(|id| all.get(id)).map_or(NOBODY, |i| i.parent);
                let list = listed(all, &self.state.sizes, parent);
                let back = *action == Action::SelectPrevious;
                let at = selected.and_then(|id| list.iter().position(|i| *i == id));
                let step = if back { list.len().saturating_sub(1) } else { 1 };
                let first = if back { list.last() } else { list.first() };
                at.map_or(first, |at| list.get((at + step) % list.len())).copied()
            }
        };
        if next.is_some() {
            self.view(&Action::Select(next), ctx);
        }
    }

    /// Turns the name of the selected identity into a text field.
    pub(super) fn start_renaming(&mut self) {
        match (self.chosen_identity(), self.state.semantics.clone()) {
            (Some(id), Some(map)) => {
                self.layout.show(Pane::Objects);
                self.objects.rename(id, &map.identities);
            }
            _ => self
                .state
                .toast(Tone::Info, "Choose what to rename first: click it in the view or its name in the list."),
        }
    }
}

/// Parts of an identity, or all objects, in the order of the list.
fn listed(all: &Identities, sizes: &[usize], of: IdentityId) -> Vec<IdentityId> {
    let ids = all.iter().filter(|(_, i)| i.parent == of).map(|(id, _)| id).collect();
    let (mut shown, mut tiny) = labels::listed(all, sizes, ids);
    shown.append(&mut tiny);
    shown
}
