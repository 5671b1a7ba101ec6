//! Evidence on objects and parts in their list: its order, its numbers, and the doubts, each with a link to its photo.

use std::cmp::Ordering;

use egui::containers::menu::MenuButton;
use egui::{Button, ComboBox, RichText, Ui};
use strum::{IntoStaticStr, VariantArray};

use super::super::ctx::Ctx;
use super::super::labels::ScreenNames;
use super::super::state::AppState;
use super::super::theme;
use crate::math::format::{self, NONE, things};
use crate::scene::findings::{IdentityEvidence, MaskConflict, SegmentationReport};
use crate::scene::{Dataset, Identities, IdentityId, SemanticMap, text};
use crate::ui::actions::Action;

/// Sort key of the list of objects and parts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, VariantArray, IntoStaticStr)]
pub(super) enum SortKey {
    #[default]
    #[strum(serialize = "original order")]
    Found,
    #[strum(serialize = "by name")]
    Name,
    #[strum(serialize = "by Gaussians")]
    Gaussians,
    #[strum(serialize = "by photos")]
    Photos,
    #[strum(serialize = "by confidence")]
    Confidence,
    #[strum(serialize = "by doubts")]
    Doubts,
}

/// The order of the list.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct ListOrder {
    pub(super) key: SortKey,
    /// True for the reverse order: names from Z to A, numbers from the smallest.
    pub(super) reversed: bool,
}

impl ListOrder {
    /// Most doubts first.
    pub(super) fn by_doubts() -> Self {
        Self { key: SortKey::Doubts, reversed: false }
    }

    /// Draws the choice of the order.
    pub(super) fn show(&mut self, ui: &mut Ui) {
        let turn = match self.reversed {
            true => Button::new("\u{23f6}"),
            false => Button::new("\u{23f7}"),
        };
        if self.key != SortKey::Found {
            let turn = ui.add(turn.small()).on_hover_text("Reverse the order");
            if turn.accessible_name("Reverse the order").clicked() {
                self.reversed = !self.reversed;
            }
        }
        let chosen: &str = self.key.into();
        let list = ComboBox::from_id_salt("order").selected_text(RichText::new(chosen).small()).width(96.0);
        let list = list.show_ui(ui, |ui| {
            for &key in SortKey::VARIANTS {
                let text: &str = key.into();
                if ui.selectable_label(self.key == key, text).clicked() {
                    *self = Self { key, reversed: false };
                }
            }
        });
        list.response.on_hover_text("Order of the list").accessible_name("Order of the list");
    }
}

/// Facts shown in the rows.
pub(super) struct RowFacts<'a> {
    identities: &'a Identities,
    names: &'a ScreenNames,
    /// Evidence by number.
    facts: &'a [IdentityEvidence],
    findings: Option<&'a SegmentationReport>,
    dataset: Option<&'a Dataset>,
    order: ListOrder,
}

impl<'a> RowFacts<'a> {
    pub(super) fn new(state: &'a AppState, map: &'a SemanticMap, order: ListOrder) -> Self {
        let dataset = state.scene.as_ref().and_then(|s| s.dataset.as_deref());
        let (identities, findings) = (&map.identities, map.findings.as_ref());
        Self { identities, names: &state.labels, facts: &state.facts, findings, dataset, order }
    }

    fn of(&self, id: IdentityId) -> Option<&IdentityEvidence> {
        self.facts.get(id as usize)
    }

    /// Sorts identities; those without evidence stay last.
    pub(super) fn sort(&self, ids: &mut [IdentityId]) {
        let ListOrder { key, reversed } = self.order;
        let turned = |order: Ordering| if reversed { order.reverse() } else { order };
        let number = |id: IdentityId| -> Option<f64> {
            let fact = self.of(id)?;
            match key {
                SortKey::Photos => fact.photos.map(|n| n as f64),
                SortKey::Confidence => fact.confidence,
                SortKey::Doubts => Some(fact.conflicts.len() as f64),
                _ => Some(fact.gaussians as f64),
            }
        };
        match key {
            SortKey::Found => {}
            SortKey::Name => {
                let name = |id: IdentityId| self.names.name(self.identities, id).to_lowercase();
                ids.sort_by(|a, b| turned(name(*a).cmp(&name(*b))));
            }
            _ => ids.sort_by(|a, b| match (number(*a), number(*b)) {
                (Some(a), Some(b)) => turned(b.total_cmp(&a)),
                (a, b) => b.is_some().cmp(&a.is_some()),
            }),
        }
    }

    /// Text at the end of a row, with its explanation.
    pub(super) fn number(&self, id: IdentityId) -> (String, &'static str) {
        let Some(fact) = self.of(id) else { return (NONE.into(), "") };
        if fact.gaussians == 0 {
            return (
                "empty".into(),
                "It has no Gaussians: undo the change that took them, correct it by clicks, or merge it",
            );
        }
        let known = |n: Option<usize>| n.map_or_else(|| NONE.into(), |n| format::count(n as u64));
        match self.order.key {
            SortKey::Photos => (known(fact.photos), "Photos in which it is seen"),
            SortKey::Confidence => (sure(fact), "Mean share of its pixels that is its own"),
            SortKey::Doubts => (known(Some(fact.conflicts.len())), "Photos that disagreed"),
            _ => (known(Some(fact.gaussians)), "Gaussians"),
        }
    }

    /// One line on the photos that show it; `None` if unknown.
    pub(super) fn line(&self, id: IdentityId) -> Option<String> {
        let fact = self.of(id)?;
        let (seen, of) = (fact.photos?, self.findings?.photos.len());
        let guessed = match fact.guessed {
            0 => String::new(),
            n => format!(" {} of its Gaussians are guessed from its mirror image.", format::count(n)),
        };
        Some(format!("Seen in {seen} of {}, {} of its pixels are its own.{guessed}", things(of, "photo"), sure(fact)))
    }

    /// Draws a sign on a row with doubts. A click on a doubt opens its photo and selects its identity.
    pub(super) fn conflicts(&self, ui: &mut Ui, id: IdentityId, cx: &mut Ctx<'_>) {
        let (Some(fact), Some(findings)) = (self.of(id), self.findings) else { return };
        let conflicts: Vec<&MaskConflict> =
            fact.conflicts.iter().filter_map(|k| findings.conflicts().get(*k)).collect();
        let Some(first) = conflicts.first() else { return };
        let sign = RichText::new(things(conflicts.len(), "doubt")).small().color(theme::warning());
        let name = format!("{} about {}", things(conflicts.len(), "doubt"), self.names.full_name(self.identities, id));
        let told = |most: usize| {
            let lines = conflicts.iter().take(most).map(|d| self.sentence(findings, d));
            lines.collect::<Vec<_>>().join("\n")
        };
        ui.spacing_mut().button_padding.x = 4.0;
        let sign = Button::new(sign).frame_when_inactive(false);
        if conflicts.len() == 1 {
            if ui.add(sign).on_hover_text(told(1)).accessible_name(name).clicked() {
                self.go(findings, first, id, cx);
            }
            return;
        }
        let (menu, _) = MenuButton::from_button(sign).ui(ui, |ui| {
            ui.set_max_width(340.0);
            egui::ScrollArea::vertical().max_height(300.0).show(ui, |ui| {
                for conflict in &conflicts {
                    if ui.add(Button::new(self.sentence(findings, conflict)).wrap()).clicked() {
                        self.go(findings, conflict, id, cx);
                        ui.close();
                    }
                }
            });
        });
        menu.on_hover_text(told(5)).accessible_name(name);
    }

    fn sentence(&self, findings: &SegmentationReport, conflict: &MaskConflict) -> String {
        let name = |id: IdentityId| self.names.full_name(self.identities, id);
        let photo = text::elided(findings.photo(conflict).rsplit('/').next().unwrap_or_default(), 40);
        format!("In {photo} {}.", conflict.what.text(name))
    }

    fn go(&self, findings: &SegmentationReport, conflict: &MaskConflict, row: IdentityId, cx: &mut Ctx<'_>) {
        let is_within = |id: &IdentityId| self.identities.ancestors(*id).any(|at| at == row);
        let about = conflict.what.about().into_iter().find(is_within);
        let photo = findings.photo(conflict);
        let place = self.dataset.and_then(|d| d.photos.iter().position(|p| p.name == photo));
        place.into_iter().for_each(|photo| cx.ask(Action::GoToPhoto(photo)));
        cx.ask(Action::Select(about));
    }
}

fn sure(fact: &IdentityEvidence) -> String {
    fact.confidence.map_or_else(|| NONE.into(), |c| format!("{:.0} %", 100.0 * c))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Level, NO_IDENTITY};

    #[test]
    fn rows_are_sorted_by_what_is_told_of_them_and_the_unknown_comes_last() {
        let mut all = Identities::default();
        for name in ["mug", "Lamp", "apple"] {
            all.add(Level::Object, NO_IDENTITY, vec![name.into()]);
        }
        let fact = |gaussians, photos, conflicts: usize| IdentityEvidence {
            gaussians,
            photos,
            confidence: photos.map(|n| 0.1 * n as f64),
            guessed: 4 * photos.unwrap_or(0) as u64 / 3,
            conflicts: (0..conflicts).collect(),
        };
        let facts = [fact(9, None, 0), fact(5, Some(3), 0), fact(7, None, 2), fact(6, Some(8), 1)];
        let (names, findings) = (ScreenNames::default(), SegmentationReport::default());
        let sorted = |key, reversed| {
            let order = ListOrder { key, reversed };
            let rows = RowFacts {
                identities: &all,
                names: &names,
                facts: &facts,
                findings: Some(&findings),
                dataset: None,
                order,
            };
            let lines =
                [1, 2, 3].map(|id| rows.line(id).is_some_and(|text| text.contains("guessed from its mirror image")));
            assert_eq!(lines, [true, false, true], "nothing is known of the second, and nothing guessed");
            let mut ids = [1, 2, 3];
            rows.sort(&mut ids);
            (ids, rows.number(2).0)
        };
        assert_eq!(sorted(SortKey::Found, true), ([1, 2, 3], "7".into()));
        assert_eq!(sorted(SortKey::Name, false).0, [3, 2, 1], "letters' case does not matter");
        assert_eq!(sorted(SortKey::Name, true).0, [1, 2, 3]);
        assert_eq!((sorted(SortKey::Gaussians, false).0, sorted(SortKey::Gaussians, true).0), ([2, 3, 1], [1, 3, 2]));
        assert_eq!(sorted(SortKey::Photos, false), ([3, 1, 2], NONE.into()));
        assert_eq!(sorted(SortKey::Photos, true).0, [1, 3, 2], "nothing is known of the lamp");
        assert_eq!(sorted(SortKey::Confidence, true).0, [1, 3, 2]);
        assert_eq!(sorted(SortKey::Doubts, false), ([2, 3, 1], "2".into()));
    }
}
