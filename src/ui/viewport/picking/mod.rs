//! Hovered and selected identity: outlined in the view, named beside the cursor.
//!
//! A click selects the part, or the object if it has no part there; a click on the selection selects its whole; with
//! Alt, the object at once.

mod menu;

use egui::{Color32, ColorImage, FontId, Pos2, Rect, Response, TextureHandle, TextureOptions, Ui, Vec2, pos2, vec2};

use super::measured::cards_over;
use super::outline;
use super::visible::Visibility;
use crate::jobs::query::ViewMaps;
use crate::pipeline::semantics::view_map::ViewMap;
use crate::scene::{Identities, IdentityId, Mask, PixelBox, SemanticMap, text};
use crate::ui::ctx::Ctx;
use crate::ui::labels::ScreenNames;
use crate::ui::theme;
use crate::worker::Versioned;

/// Color of the identity that a click would select.
const HOVERED: [u8; 3] = [255, 255, 255];
/// Color of the selection.
const SELECTED: [u8; 3] = [0x6c, 0xb2, 0xf0];

/// Hovered and selected identity.
#[derive(Default)]
pub struct Picking {
    hovered: Option<IdentityId>,
    selected: Option<IdentityId>,
    /// True if the cursor was in the view since the scene was opened: identity maps are needed from then on.
    wanted: bool,
    /// Identity of the open menu.
    menu: Option<IdentityId>,
    outlines: [DrawnOutline; 2],
}

/// An outline on screen.
#[derive(Default)]
pub(super) struct DrawnOutline {
    /// Generations of view and objects, and the identity that it was drawn for.
    of: Option<(u64, u64, IdentityId)>,
    /// Its place in the view, px, and the size of that view; `None` without pixels there.
    at: Option<(PixelBox, [usize; 2])>,
    texture: Option<TextureHandle>,
}

impl Picking {
    /// Selected identity.
    pub fn selected(&self) -> Option<IdentityId> {
        self.selected
    }

    /// Identity that a click would select.
    pub fn hovered(&self) -> Option<IdentityId> {
        self.hovered
    }

    /// True if identity maps are needed.
    pub(super) fn wanted(&self) -> bool {
        self.wanted
    }

    /// Selects an identity, or none.
    pub(crate) fn select(&mut self, id: Option<IdentityId>) {
        self.selected = id;
    }

    /// Handles the cursor: hover, click and context menu. `maps` are given if they are known and the cursor is not on a
    /// camera.
    pub(super) fn update(
        &mut self,
        response: &Response,
        shown: Rect,
        semantics: &SemanticMap,
        maps: Option<&ViewMaps>,
        visibility: &Visibility,
        cx: &mut Ctx<'_>,
    ) {
        let all = &semantics.identities;
        self.selected = self.selected.filter(|id| all.get(*id).is_some());
        self.wanted |= response.hovered();
        let alt = response.ctx.input(|i| i.modifiers.alt);
        let under = |pos: Pos2| innermost(&maps?.identities, shown, pos).filter(|id| all.get(*id).is_some());
        // An open menu belongs to the clicked identity.
        let open = response.context_menu_opened();
        let cursor = response.hover_pos().filter(|_| !open && !response.dragged());
        self.hovered = cursor.and_then(under).map(|id| picked(all, id, self.selected, alt));
        if response.clicked() && maps.is_some() && self.selected != self.hovered {
            self.select(self.hovered);
            // Panes that were drawn already show the selection, too.
            response.ctx.request_repaint();
        }
        if response.secondary_clicked() {
            // On the selection the menu is that of the selection, else of the identity that a click would select.
            let id = response.interact_pointer_pos().and_then(under);
            let within = |s: &IdentityId| id.is_some_and(|id| all.ancestors(id).any(|at| at == *s));
            self.menu = self.selected.filter(within).or_else(|| id.map(|id| picked(all, id, None, alt)));
            if self.menu.is_some() && self.menu != self.selected {
                self.select(self.menu);
                response.ctx.request_repaint();
            }
        }
        let ctx = response.ctx.clone();
        theme::in_window_theme(&ctx, || {
            response.context_menu(|ui| menu::show(ui, all, self.menu, visibility, cx));
        });
    }

    /// Draws outlines over the frame in `shown`.
    pub(super) fn paint(
        &mut self,
        ui: &Ui,
        shown: Rect,
        semantics: &Versioned<SemanticMap>,
        maps: &Versioned<ViewMaps>,
    ) {
        let hovered = self.expected(ui);
        let [selected, pointed_at] = &mut self.outlines;
        if let Some(id) = self.selected {
            selected.paint(ui, shown, semantics, maps, id, |mask| outline::image(mask, SELECTED));
        }
        if let Some(id) = hovered.filter(|id| Some(*id) != self.selected) {
            pointed_at.paint(ui, shown, semantics, maps, id, |mask| outline::contour(mask, HOVERED));
        }
    }

    /// Draws the name of what is hovered beside the cursor, off the cards.
    pub(super) fn paint_name(&self, ui: &Ui, shown: Rect, all: &Identities, names: &ScreenNames) {
        let pos = ui.input(|i| i.pointer.hover_pos().filter(|pos| shown.contains(*pos)));
        if let Some((id, pos)) = self.expected(ui).zip(pos) {
            label(ui, shown, pos, &text::elided(&names.full_name(all, id), 60));
        }
    }

    /// Identity that a click would select. While text is typed, a click is not expected.
    fn expected(&self, ui: &Ui) -> Option<IdentityId> {
        self.hovered.filter(|_| !ui.ctx().text_edit_focused())
    }
}

impl DrawnOutline {
    pub(super) fn paint(
        &mut self,
        ui: &Ui,
        shown: Rect,
        semantics: &Versioned<SemanticMap>,
        maps: &Versioned<ViewMaps>,
        id: IdentityId,
        image: impl Fn(&Mask) -> Option<(ColorImage, PixelBox)>,
    ) {
        let of = Some((maps.generation(), semantics.generation(), id));
        let map = &maps.identities;
        if self.of != of {
            self.of = of;
            self.at = image(&map.mask(&semantics.identities, id)).map(|(image, at)| {
                match &mut self.texture {
                    Some(texture) => texture.set(image, TextureOptions::LINEAR),
                    None => self.texture = Some(ui.ctx().load_texture("outline", image, TextureOptions::LINEAR)),
                }
                (at, [map.width_px, map.height_px])
            });
        }
        self.paint_again(ui, shown);
    }

    /// Draws the last outline.
    pub(super) fn paint_again(&self, ui: &Ui, shown: Rect) {
        let (Some((at, [w, h])), Some(texture)) = (&self.at, &self.texture) else { return };
        let scale = vec2(shown.width() / *w as f32, shown.height() / *h as f32);
        let corner = |x: usize, y: usize| shown.min + vec2(x as f32, y as f32) * scale;
        let rect = Rect::from_min_max(corner(at.x.start, at.y.start), corner(at.x.end, at.y.end));
        ui.painter().image(texture.id(), rect, Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0)), Color32::WHITE);
    }
}

/// The innermost identity at a window position.
pub(super) fn innermost(map: &ViewMap, shown: Rect, pos: Pos2) -> Option<IdentityId> {
    let at = (pos - shown.min) / shown.size();
    let inside = |v: f32, n: usize| (0.0..1.0).contains(&v).then_some((v * n as f32) as usize);
    let (x, y) = (inside(at.x, map.width_px)?, inside(at.y, map.height_px)?);
    map.identity.get(y * map.width_px + x).copied()
}

/// Identity that a click on a pixel of `innermost` selects: itself; on the selection the next whole, up to the object
/// and then the part again; with Alt the object at once.
fn picked(all: &Identities, innermost: IdentityId, selected: Option<IdentityId>, alt: bool) -> IdentityId {
    if alt {
        return all.object_of(innermost);
    }
    let line: Vec<IdentityId> = all.ancestors(innermost).collect();
    let at = selected.and_then(|s| line.iter().position(|id| *id == s));
    at.map_or(innermost, |at| line[(at + 1) % line.len()])
}

/// Draws a name beside the cursor, inside the view.
fn label(ui: &Ui, shown: Rect, pos: Pos2, name: &str) {
    let galley = ui.painter().layout_no_wrap(name.to_owned(), FontId::proportional(13.0), theme::text());
    let back = beside_cursor(pos, galley.size() + vec2(12.0, 6.0), shown, &cards_over(ui.ctx(), shown));
    ui.painter().rect_filled(back, 5.0, Color32::from_black_alpha(235));
    ui.painter().galley(back.min + vec2(6.0, 3.0), galley, theme::text());
}

/// Place of a name of this size beside the cursor: below it to the right, or on another side if that is outside the view
/// or under a card.
fn beside_cursor(pos: Pos2, size: Vec2, shown: Rect, cards: &[Rect]) -> Rect {
    let (right, left, below, above) = (16.0, -size.x - 8.0, 14.0, -size.y - 8.0);
    let sides = [vec2(right, below), vec2(left, below), vec2(right, above), vec2(left, above)];
    let places = sides.map(|side| Rect::from_min_size(pos + side, size));
    let is_inside = |place: &&Rect| shown.contains_rect(**place);
    let is_free = |place: &&Rect| is_inside(place) && cards.iter().all(|card| !card.intersects(**place));
    let found = places.iter().find(is_free).or_else(|| places.iter().find(is_inside));
    let place = *found.unwrap_or(&places[2]);
    place.translate(vec2((shown.left() - place.left()).max(0.0), 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Level, NO_IDENTITY};

    fn doll() -> (Identities, [IdentityId; 5]) {
        let mut all = Identities::default();
        let doll = all.add(Level::Object, NO_IDENTITY, vec!["doll".into()]);
        let table = all.add(Level::Object, NO_IDENTITY, vec!["table".into()]);
        let face = all.add(Level::Part, doll, vec!["face".into()]);
        let eye = all.add(Level::Part, face, vec!["eye".into()]);
        let hand = all.add(Level::Part, doll, vec!["hand".into()]);
        (all, [doll, table, face, eye, hand])
    }

    #[test]
    fn clicks_take_the_part_and_go_outwards_on_what_is_selected() {
        let (all, [doll, table, face, eye, hand]) = doll();
        assert_eq!(picked(&all, eye, None, false), eye);
        assert_eq!(picked(&all, eye, Some(eye), false), face);
        assert_eq!(picked(&all, eye, Some(face), false), doll);
        assert_eq!(picked(&all, eye, Some(doll), false), eye, "and from the part again");
        assert_eq!(picked(&all, hand, Some(face), false), hand, "its neighbor");
        assert_eq!(picked(&all, face, Some(eye), false), face, "where no part of it is");
        assert_eq!(picked(&all, table, Some(table), false), table, "nothing is around it");
        assert_eq!(picked(&all, eye, Some(table), false), eye, "another object is selected");
        assert_eq!((picked(&all, eye, None, true), picked(&all, eye, Some(doll), true)), (doll, doll), "Alt");
    }

    #[test]
    fn a_name_beside_the_cursor_is_in_the_view_and_under_no_card() {
        let shown = Rect::from_min_size(pos2(0.0, 0.0), vec2(400.0, 300.0));
        let card = Rect::from_min_size(pos2(10.0, 250.0), vec2(150.0, 40.0));
        let size = vec2(90.0, 20.0);
        let place = |pos: Pos2, cards: &[Rect]| beside_cursor(pos, size, shown, cards);
        let below = place(pos2(60.0, 235.0), &[]);
        assert!(below.top() > 235.0 && below.intersects(card), "control: it is below the cursor");
        let above = place(pos2(60.0, 235.0), &[card]);
        assert!(above.bottom() < 235.0 && !above.intersects(card) && shown.contains_rect(above), "{above}");
        for corner in [pos2(1.0, 1.0), pos2(399.0, 1.0), pos2(1.0, 299.0), pos2(399.0, 299.0)] {
            assert!(shown.contains_rect(place(corner, &[card])), "{corner}");
        }
    }

    #[test]
    fn a_place_of_the_window_is_a_pixel_of_the_view() {
        let map = ViewMap {
            width_px: 4,
            height_px: 2,
            identity: vec![1, 2, 3, 4, 5, 6, 7, 8],
            share: vec![1.0; 8],
            alpha: vec![1.0; 8],
        };
        let shown = Rect::from_min_size(pos2(100.0, 50.0), vec2(400.0, 200.0));
        let at = |x: f32, y: f32| innermost(&map, shown, pos2(x, y));
        assert_eq!((at(100.0, 50.0), at(499.0, 249.0), at(250.0, 160.0)), (Some(1), Some(8), Some(6)));
        assert_eq!((at(99.0, 60.0), at(500.0, 60.0), at(300.0, 250.0)), (None, None, None), "beside the frame");
    }
}
