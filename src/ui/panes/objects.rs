//! Objects and parts of the scene as a tree; a click selects one and queries it.

use egui::collapsing_header::CollapsingState;
use egui::{Align, Button, Checkbox, CollapsingHeader, Color32, Id, Layout, Rect, RichText, ScrollArea, Ui, vec2};

use super::super::ctx::Ctx;
use super::super::labels::{self, ScreenNames};
use super::super::next_step::next_step;
use super::super::object_menu;
use super::super::text_field::{NameField, TypedName};
use super::super::theme;
use super::super::viewport::Viewport;
use super::super::viewport::visible::Visibility;
use super::PaneContents;
use super::object_facts::{ListOrder, RowFacts};
use super::object_thumbnails::ObjectThumbnails;
use crate::math::format::{self, things};
use crate::pipeline::semantics::lifting::edit::Edit;
use crate::scene::{Identities, IdentityId, NO_IDENTITY, SegmentationReport, text};
use crate::ui::actions::Action;
use crate::worker::Makes;

/// Side of a thumbnail, points.
const THUMBNAIL_PX: f32 = 30.0;

/// Width of the column of counts such as "123,456", points.
const COUNT_PT: f32 = 48.0;

/// Width of the button of a row's menu, points.
const MENU_PT: f32 = 22.0;

/// The list, and the name that is edited in it.
#[derive(Default)]
pub(crate) struct ObjectsPane {
    renaming: Option<NameField<IdentityId>>,
    /// Identity whose menu is open.
    menu_of: Option<IdentityId>,
    /// Selected identity at the last redraw.
    selected: Option<IdentityId>,
    order: ListOrder,
}

impl ObjectsPane {
    /// Makes a text field of a name.
    pub(crate) fn rename(&mut self, id: IdentityId, all: &Identities) {
        self.renaming = Some(NameField::new(id, all.name(id)));
    }
}

impl PaneContents for ObjectsPane {
    fn ui(&mut self, ui: &mut Ui, cx: &mut Ctx<'_>, view: &mut Viewport) {
        let (state, object_thumbnails) = (cx.state, cx.thumbnails);
        let (visibility, selected) = (&view.visibility, view.picking.selected());
        let Some(map) = &state.semantics else {
            return show_how_to_begin(ui, cx);
        };
        let identities = &map.identities;
        let conflicts = map.findings.as_ref().map_or(0, |f| f.conflicts().len());
        let method = state.scene.as_ref().and_then(|scene| scene.method_name());
        let from = match (map.seeds.len(), method) {
            (0, Some(name)) => format!("from the result of {name}"),
            (0, None) if identities.iter().all(|(_, i)| i.by_hand) => "selected by hand".to_owned(),
            (0, None) => "as they were opened".to_owned(),
            (n, _) => format!("from the masks of {}", things(n, "photo")),
        };
        ui.weak(format!("{}, {from}", identities.counted()));
        if conflicts > 0 {
            let link = ui.link(RichText::new(format!("{} where photos disagreed", things(conflicts, "doubt"))));
            if link.on_hover_text("List the affected objects and parts first").clicked() {
                self.order = ListOrder::by_doubts();
            }
        }
        show_next_photo(ui, cx, map.findings.as_ref().and_then(SegmentationReport::next_to_label));
        if identities.iter().all(|(_, i)| i.names.is_empty()) {
            ui.weak("Regions of the photos, without names yet. Click one to see it, double-click to name it.");
        }
        ui.add_space(4.0);
        ui.horizontal(|ui| {
            if visibility.is_partial() && ui.button("Show all").clicked() {
                cx.ask(Action::Isolate(None));
            }
            let new = Action::SegmentNew(Some(NO_IDENTITY));
            if ui.button("New object\u{2026}").on_hover_text(new.tooltip()).clicked() {
                cx.ask(new);
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                self.order.show(ui);
            });
        });
        // The list scrolls to a new selection in the view.
        let scroll_to = selected.filter(|_| self.selected != selected);
        self.selected = selected;
        let (renaming, menu_of) = (&mut self.renaming, &mut self.menu_of);
        let (labels, sizes) = (&state.labels, &state.sizes);
        let facts = RowFacts::new(state, map, self.order);
        let mut tree = Tree {
            identities,
            labels,
            sizes,
            facts,
            object_thumbnails,
            visibility,
            renaming,
            menu_of,
            selected,
            scroll_to,
        };
        let roots = identities.iter().filter(|(_, i)| i.parent == NO_IDENTITY).map(|(id, _)| id).collect();
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            tree.branches(ui, Id::unique("objects"), roots, cx);
        });
    }
}

/// Shows the photo whose labels would tell most.
fn show_next_photo(ui: &mut Ui, cx: &mut Ctx<'_>, next: Option<(&str, f64)>) {
    let photos = cx.state.scene.as_ref().and_then(|s| s.dataset.as_deref()).map(|d| &d.photos);
    let Some((name, inferred)) = next else { return };
    let Some(place) = photos.and_then(|photos| photos.iter().position(|p| p.name == name)) else { return };
    let file = text::elided(name.rsplit('/').next().unwrap_or_default(), 40);
    let link = ui.link(format!("Label {file} next: {} of it is inferred", format::percent(inferred)));
    let why = "No mask shows it. Labels of this photo would tell most. Click to go there";
    if link.on_hover_text(why).clicked() {
        cx.ask(Action::GoToPhoto(place));
    }
}

struct Tree<'a> {
    identities: &'a Identities,
    labels: &'a ScreenNames,
    /// Numbers of Gaussians, indexed by identity.
    sizes: &'a [usize],
    facts: RowFacts<'a>,
    object_thumbnails: &'a ObjectThumbnails,
    visibility: &'a Visibility,
    renaming: &'a mut Option<NameField<IdentityId>>,
    menu_of: &'a mut Option<IdentityId>,
    selected: Option<IdentityId>,
    /// Identity to scroll to.
    scroll_to: Option<IdentityId>,
}

impl Tree<'_> {
    /// Draws one branch per identity, the tiny unnamed ones folded.
    fn branches(&mut self, ui: &mut Ui, of: Id, ids: Vec<IdentityId>, cx: &mut Ctx<'_>) {
        let (mut shown, mut tiny) = labels::listed(self.identities, self.sizes, ids);
        self.facts.sort(&mut shown);
        self.facts.sort(&mut tiny);
        shown.into_iter().for_each(|id| self.branch(ui, id, cx));
        if !tiny.is_empty() {
            let header = CollapsingHeader::new(things(tiny.len(), "tiny region")).id_salt(of.with("tiny"));
            header.show(ui, |ui| tiny.into_iter().for_each(|id| self.branch(ui, id, cx)));
        }
    }

    fn branch(&mut self, ui: &mut Ui, id: IdentityId, cx: &mut Ctx<'_>) {
        let pieces: Vec<IdentityId> = self.identities.children(id).collect();
        if pieces.is_empty() {
            // Aligned with rows that can be unfolded.
            ui.horizontal(|ui| {
                ui.add_space(ui.spacing().indent);
                self.row(ui, id, cx);
            });
            return;
        }
        let mut state = CollapsingState::load_with_default_open(ui.ctx(), Id::unique("branch").with(id), false);
        let is_within = |piece: IdentityId| self.identities.is_piece(piece, id);
        let renamed = self.renaming.as_ref().filter(|r| r.is_new()).map(|r| r.of);
        if renamed.into_iter().chain(self.scroll_to).any(is_within) {
            state.set_open(true);
        }
        let header = state.show_header(ui, |ui| self.row(ui, id, cx));
        let body = header.body(|ui| self.branches(ui, Id::unique("pieces").with(id), pieces, cx));
        body.0.accessible_name(format!("Parts of {}", self.identities.full_name(id)));
    }

    /// Draws a row: check box, thumbnail, color and name on the left; number, doubts and menu on the right.
    fn row(&mut self, ui: &mut Ui, id: IdentityId, cx: &mut Ctx<'_>) {
        ui.spacing_mut().item_spacing.x = 5.0;
        let row = Rect::from_min_size(ui.cursor().min, vec2(ui.available_width(), THUMBNAIL_PX));
        let is_hovered = ui.rect_contains_pointer(row);
        let drawn = self.visibility.draws(self.identities, id);
        let mut ticked = drawn != Some(false);
        let tick = Checkbox::new(&mut ticked, "").indeterminate(drawn.is_none());
        let tick = ui.add(tick).on_hover_text("Visible");
        if tick.accessible_name(format!("{} is visible", self.identities.full_name(id))).changed() {
            cx.ask(Action::Hide(id));
        }
        self.object_thumbnails.show(ui, id, THUMBNAIL_PX);
        let code = self.identities.get(id).map_or([0.5; 3], |i| i.code).map(|c| (c * 255.0) as u8);
        let (rect, _) = ui.allocate_exact_size(vec2(11.0, 11.0), egui::Sense::hover());
        ui.painter().rect_filled(rect, 3.0, Color32::from_rgb(code[0], code[1], code[2]));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let (number, what) = self.facts.number(id);
            let number = RichText::new(number).small().monospace().color(theme::weak());
            // One column, for any number of digits.
            let column = vec2(COUNT_PT, ui.available_height());
            ui.allocate_ui_with_layout(column, Layout::right_to_left(Align::Center), |ui| {
                ui.set_min_width(COUNT_PT);
                ui.label(number).on_hover_text(what);
            });
            let padding = ui.spacing().button_padding.x;
            self.facts.conflicts(ui, id, cx);
            ui.spacing_mut().button_padding.x = padding;
            // Names begin at the left, so none moves under the pointer; a long one is cut there.
            if is_hovered || self.selected == Some(id) || *self.menu_of == Some(id) {
                let room = vec2(MENU_PT, ui.available_height());
                ui.allocate_ui_with_layout(room, Layout::right_to_left(Align::Center), |ui| {
                    ui.set_min_width(MENU_PT);
                    ui.spacing_mut().button_padding.x = 4.0;
                    self.menu(ui, id, cx);
                });
            }
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| self.name(ui, id, cx));
        });
    }

    fn name(&mut self, ui: &mut Ui, id: IdentityId, cx: &mut Ctx<'_>) {
        if self.renaming.as_ref().is_some_and(|r| r.of == id) {
            return self.name_field(ui, cx);
        }
        let is_selected = self.selected == Some(id);
        let name = Button::new(self.labels.name_in_list(self.identities, id)).selected(is_selected).truncate();
        let name = ui.add(name.frame_when_inactive(is_selected));
        if self.scroll_to == Some(id) {
            name.scroll_to_me(Some(Align::Center));
        }
        let name = name.on_hover_ui(|ui| {
            let [full, listed] =
                [ScreenNames::name, ScreenNames::name_in_list].map(|of| of(self.labels, self.identities, id));
            if full != listed {
                ui.strong(full);
            }
            ui.label("Select it and highlight it in the view; double-click to rename it");
            self.facts.line(id).into_iter().for_each(|line| drop(ui.weak(line)));
        });
        if name.clicked() {
            cx.ask(Action::Select(Some(id)));
            cx.ask(Action::Ask(self.identities.full_name(id)));
        }
        if name.double_clicked() {
            self.start_renaming(id);
        }
    }

    fn start_renaming(&mut self, id: IdentityId) {
        *self.renaming = Some(NameField::new(id, self.identities.name(id)));
    }

    /// Draws the name as a field.
    fn name_field(&mut self, ui: &mut Ui, cx: &mut Ctx<'_>) {
        let Some(renaming) = self.renaming.as_mut() else { return };
        let id = renaming.of;
        match renaming.show(ui, Id::unique("name").with(id)) {
            TypedName::Open => return,
            TypedName::Kept(name) if name.trim() != self.identities.name(id) => {
                cx.ask(Action::Change(Edit::Rename(id, name)));
            }
            TypedName::Kept(_) | TypedName::Dropped => {}
        }
        *self.renaming = None;
    }

    /// Draws the menu of actions on an identity.
    fn menu(&mut self, ui: &mut Ui, id: IdentityId, cx: &mut Ctx<'_>) {
        let all = self.identities;
        let is_hidden = self.visibility.draws(all, id) == Some(false);
        let menu = ui.menu_button("\u{2026}", |ui| object_menu::show(ui, all, id, is_hidden, cx));
        // The button stays while its menu is open, wherever the pointer is.
        match menu.inner {
            Some(()) => *self.menu_of = Some(id),
            None if *self.menu_of == Some(id) => *self.menu_of = None,
            None => {}
        }
    }
}

fn show_how_to_begin(ui: &mut Ui, cx: &mut Ctx<'_>) {
    let state = cx.state;
    if let Some(origin) = state.scene.as_ref().and_then(|s| s.remote.as_ref()) {
        let text = format!("No objects are known yet. They are found on {}: fmlgs preprocess SCENE", origin.host);
        ui.label(RichText::new(text).color(theme::weak()));
        return;
    }
    let has_masks = state.scene.as_ref().is_some_and(|s| s.masks.is_some());
    ui.label(
        RichText::new(
            "Objects and parts are found from masks of one or a few photos; the Gaussians propagate them to all others.",
        )
        .color(theme::weak()),
    );
    ui.add_space(6.0);
    let idle = state.job.is_none() && state.is_trained();
    let why = if state.is_trained() { "Another job is running." } else { "Train the scene first." };
    let button = |text: &str| Button::new(text.to_owned()).min_size(vec2(170.0, 28.0));
    let finds = state.job.as_ref().is_some_and(|job| job.info.makes == Makes::Objects);
    if !has_masks && !finds {
        let text = "These photos have no masks: choose some, or a network that finds objects.";
        ui.label(RichText::new(text).color(theme::weak()));
    }
    let action = Action::FindObjects;
    let text = if has_masks { "Find objects" } else { "Find objects\u{2026}" };
    let is_next = next_step(state).as_ref() == Some(&action);
    let main = if is_next { theme::primary_button(text).min_size(vec2(170.0, 28.0)) } else { button(text) };
    let found = ui.add_enabled(idle, main).on_disabled_hover_text(why);
    if found.on_hover_text(action.tooltip()).clicked() {
        cx.ask(action);
    }
    let other = ui.add_enabled(idle, button("Choose masks\u{2026}")).on_disabled_hover_text(why);
    if other.on_hover_text(Action::ChooseMasks.tooltip()).clicked() {
        cx.ask(Action::ChooseMasks);
    }
    let by_clicks = Action::SegmentNew(Some(NO_IDENTITY));
    let selects = ui.add_enabled(idle, button("New object\u{2026}")).on_disabled_hover_text(why);
    if selects.on_hover_text(by_clicks.tooltip()).clicked() {
        cx.ask(by_clicks);
    }
}
