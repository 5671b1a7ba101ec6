//! Arrangement of the panes around the view: tabs that can be dragged, hidden, or detached into windows.

use egui::text::{LayoutJob, TextWrapping};
use egui::{Response, TextStyle, Ui, Vec2, ViewportBuilder, ViewportId, WidgetText, vec2};
use egui_tiles::{
    Behavior, Container, LinearDir, SimplificationOptions, TabState, Tabs, Tile, TileId, Tiles, Tree, UiResponse,
};
use serde::{Deserialize, Serialize};
use strum::VariantArray;

use crate::ui::actions::Pane;

/// Width below which a window has one column beside the view, points.
const NARROW_PT: f32 = 1000.0;

/// Least share of a row or column that the view keeps.
const VIEW_SHARE: f32 = 0.4;

/// Redraws in which a tab is scrolled into sight: its place is known after the first.
const REVEALS: u8 = 4;

/// Content of one tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Place {
    /// The view, or the first page.
    View,
    Pane(Pane),
}

/// The arrangement of the panes, one for wide and one for narrow windows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Dock {
    wide: Tree<Place>,
    narrow: Tree<Place>,
    /// Panes detached into windows.
    detached: Vec<Pane>,
    /// Tabs in front at the last redraw.
    #[serde(skip)]
    front: Vec<TileId>,
    /// Tabs that have come to the front and are to be scrolled into sight, with the redraws left for it.
    #[serde(skip)]
    hidden: Vec<(TileId, u8)>,
}

/// Contents that the dock draws.
pub(crate) trait DockContents {
    /// True if the place has content to show.
    fn has(&self, place: Place) -> bool;
    fn show(&mut self, ui: &mut Ui, place: Place);
    fn hide(&mut self, pane: Pane);
}

impl Default for Dock {
    fn default() -> Self {
        Self { wide: wide(), narrow: narrow(), detached: Vec::new(), front: Vec::new(), hidden: Vec::new() }
    }
}

fn tabs(tiles: &mut Tiles<Place>, panes: &[Pane]) -> TileId {
    let panes = panes.iter().map(|pane| tiles.insert_pane(Place::Pane(*pane))).collect();
    tiles.insert_tab_tile(panes)
}

/// The view, with the panes of its width below it.
fn middle(tiles: &mut Tiles<Place>) -> TileId {
    let view = tiles.insert_pane(Place::View);
    let view = tiles.insert_tab_tile(vec![view]);
    let report = tabs(tiles, &[Pane::Report]);
    let below = tabs(tiles, &[Pane::Camera, Pane::Phrases, Pane::Log]);
    let middle = tiles.insert_vertical_tile(vec![view, report, below]);
    share(tiles, middle, report, 400.0);
    share(tiles, middle, below, 320.0);
    middle
}

/// Photos, view, and two groups of tabs on the right.
fn wide() -> Tree<Place> {
    let mut tiles = Tiles::default();
    let photos = tabs(&mut tiles, &[Pane::Dataset]);
    let middle = middle(&mut tiles);
    let work = tabs(&mut tiles, &[Pane::Training, Pane::Objects, Pane::Clean, Pane::Models, Pane::Plan]);
    let talk = tabs(&mut tiles, &[Pane::Chat, Pane::Query]);
    let right = tiles.insert_vertical_tile(vec![work, talk]);
    share(&mut tiles, right, work, 1.9);
    let root = tiles.insert_horizontal_tile(vec![photos, middle, right]);
    share(&mut tiles, root, photos, 250.0);
    share(&mut tiles, root, right, 350.0);
    Tree::new(egui::Id::unique("dock"), root, tiles)
}

/// The view, and one group of tabs on the right.
fn narrow() -> Tree<Place> {
    let mut tiles = Tiles::default();
    let middle = middle(&mut tiles);
    let panes =
        [Pane::Training, Pane::Objects, Pane::Chat, Pane::Query, Pane::Dataset, Pane::Models, Pane::Plan, Pane::Clean];
    let right = tabs(&mut tiles, &panes);
    let root = tiles.insert_horizontal_tile(vec![middle, right]);
    share(&mut tiles, root, right, 310.0);
    Tree::new(egui::Id::unique("narrow dock"), root, tiles)
}

fn share(tiles: &mut Tiles<Place>, of: TileId, child: TileId, share: f32) {
    if let Some(Tile::Container(Container::Linear(linear))) = tiles.get_mut(of) {
        linear.shares.set_share(child, share);
    }
}

impl Dock {
    /// Returns itself if each place occurs once, else the default: stored layouts of other versions may lack places.
    pub(crate) fn checked(self) -> Self {
        let is_whole = |tree: &Tree<Place>| {
            let places = || tree.tiles.tiles().filter_map(|t| if let Tile::Pane(p) = t { Some(*p) } else { None });
            let all = Pane::VARIANTS.iter().map(|p| Place::Pane(*p)).chain([Place::View]);
            places().count() == Pane::VARIANTS.len() + 1 && all.into_iter().all(|p| places().any(|q| q == p))
        };
        if is_whole(&self.wide) && is_whole(&self.narrow) { self } else { Self::default() }
    }

    /// Brings a pane to the front of its group.
    pub(crate) fn activate(&mut self, pane: Pane) {
        for tree in [&mut self.wide, &mut self.narrow] {
            tree.make_active(|_, tile| *tile == Tile::Pane(Place::Pane(pane)));
        }
    }

    /// Detaches a pane into a window, or puts it back.
    pub(crate) fn detach(&mut self, pane: Pane, apart: bool) {
        self.detached.retain(|p| *p != pane);
        if apart {
            self.detached.push(pane);
        }
    }

    /// Draws all places that have content.
    pub(crate) fn show(&mut self, ui: &mut Ui, contents: &mut dyn DockContents) {
        self.show_windows(ui.ctx(), contents);
        let size = ui.available_size();
        let tree = if size.x < NARROW_PT { &mut self.narrow } else { &mut self.wide };
        let places: Vec<(TileId, Place)> = tree
            .tiles
            .iter()
            .filter_map(|(id, tile)| if let Tile::Pane(place) = tile { Some((*id, *place)) } else { None })
            .collect();
        for (id, place) in places {
            let is_apart = matches!(place, Place::Pane(pane) if self.detached.contains(&pane));
            tree.set_visible(id, contents.has(place) && !is_apart);
        }
        give_room(tree, size);
        let front = tree.active_tiles();
        self.hidden.extend(front.iter().filter(|id| !self.front.contains(id)).map(|id| (*id, REVEALS)));
        self.hidden.retain(|(id, left)| *left > 0 && front.contains(id));
        let hidden = &self.hidden;
        let view = tree.tiles.find_pane(&Place::View);
        let mut shown = Shown { contents, view, detach: None, hidden, front: &front };
        tree.ui(&mut shown, ui);
        let detach = shown.detach;
        self.front = front;
        if let Some(pane) = detach {
            self.detach(pane, true);
        }
        // Counted here: a pane alone in its place has no tab.
        self.hidden.iter_mut().for_each(|(_, left)| *left = left.saturating_sub(1));
        if self.hidden.iter().any(|(_, left)| *left > 0) {
            ui.ctx().request_repaint();
        }
    }

    fn show_windows(&mut self, ctx: &egui::Context, contents: &mut dyn DockContents) {
        for pane in self.detached.clone() {
            if !contents.has(Place::Pane(pane)) {
                continue;
            }
            let window = ViewportBuilder::default()
                .with_title(format!("FMLGS: {}", pane.text()))
                .with_app_id("fmlgs")
                .with_inner_size([420.0, 640.0]);
            let closed = ctx.show_viewport_immediate(ViewportId::from_hash_of(("pane", pane)), window, |ui, _| {
                contents.show(ui, Place::Pane(pane));
                ui.input(|i| i.viewport().close_requested())
            });
            if closed {
                self.detach(pane, false);
            }
        }
    }
}

/// Keeps the size of columns and rows beside the view in points when the window changes; the view takes the rest.
fn give_room(tree: &mut Tree<Place>, size: Vec2) {
    let Some(mut inner) = tree.tiles.find_pane(&Place::View) else { return };
    while let Some(outer) = tree.tiles.parent_of(inner) {
        let extent = if tree.is_root(outer) { size } else { tree.tiles.rect(outer).map_or(size, |r| r.size()) };
        let children = tree.tiles.get_container(outer).map(|c| c.children_vec()).unwrap_or_default();
        let sides: Vec<TileId> =
            children.into_iter().filter(|c| *c != inner && tree.tiles.is_visible_in_layout(*c)).collect();
        if let Some(Tile::Container(Container::Linear(linear))) = tree.tiles.get_mut(outer) {
            let extent = if linear.dir == LinearDir::Horizontal { extent.x } else { extent.y };
            let mut others = 0.0;
            for side in sides {
                // A tile that was just dropped here has the share 1.
                let wanted = if linear.shares[side] > 1.0 { linear.shares[side] } else { 0.25 * extent };
                linear.shares.set_share(side, wanted);
                others += wanted;
            }
            linear.shares.set_share(inner, (extent - others).max(VIEW_SHARE * extent));
        }
        inner = outer;
    }
}

/// The dock while it is drawn.
struct Shown<'a> {
    contents: &'a mut dyn DockContents,
    /// The tile of the view.
    view: Option<TileId>,
    detach: Option<Pane>,
    hidden: &'a [(TileId, u8)],
    front: &'a [TileId],
}

impl Shown<'_> {
    /// Draws the name of a tab that is cut by the border of its bar again, with an ellipsis.
    fn elide(&self, id: TileId, pane: Pane, button: &Response) {
        let (seen, visuals) = (button.interact_rect, button.ctx.global_style().visuals.clone());
        let margin = self.tab_title_spacing(&visuals);
        if seen.width() < margin {
            return;
        }
        let is_front = self.front.contains(&id);
        let color = if is_front { visuals.strong_text_color() } else { visuals.weak_text_color() };
        let ground = if is_front { visuals.panel_fill } else { self.tab_bar_color(&visuals) };
        let font = TextStyle::Button.resolve(&button.ctx.global_style());
        let mut name = LayoutJob::simple_singleline(pane.text().to_owned(), font, color);
        name.wrap = TextWrapping::truncate_at_width((seen.width() - margin).max(1.0));
        let painter = button.ctx.layer_painter(button.layer_id).with_clip_rect(seen);
        painter.rect_filled(seen, 0.0, ground);
        let galley = painter.layout_job(name);
        painter.galley(seen.left_center() + vec2(margin, -0.5 * galley.size().y), galley, color);
    }

    fn menu(&mut self, ui: &mut Ui, pane: Pane) {
        if ui.button("Open in its own window").clicked() {
            self.detach = Some(pane);
        }
        if ui.button("Hide").clicked() {
            self.contents.hide(pane);
        }
    }
}

impl Behavior<Place> for Shown<'_> {
    fn pane_ui(&mut self, ui: &mut Ui, _: TileId, place: &mut Place) -> UiResponse {
        self.contents.show(ui, *place);
        UiResponse::None
    }

    fn tab_title_for_pane(&mut self, place: &Place) -> WidgetText {
        match place {
            Place::View => "View".into(),
            Place::Pane(pane) => pane.text().into(),
        }
    }

    fn is_tab_bar_visible(&self, _: TileId, tabs: &Tabs) -> bool {
        // The view needs no title if it is alone.
        tabs.children.len() > 1 || tabs.active.is_none_or(|id| self.view != Some(id))
    }

    fn on_tab_button(&mut self, tiles: &mut Tiles<Place>, id: TileId, button: Response) -> Response {
        let Some(Place::Pane(pane)) = tiles.get_pane(&id).copied() else { return button };
        // A tab that comes to the front shows all of its name.
        let is_cut = button.interact_rect.width() < button.rect.width() - 1.0;
        if is_cut && self.hidden.iter().any(|(of, _)| *of == id) {
            button.scroll_to_me_animation(None, egui::style::ScrollAnimation::none());
        }
        if is_cut {
            self.elide(id, pane, &button);
        }
        button.context_menu(|ui| self.menu(ui, pane));
        button.on_hover_text(format!("{}: drag to move, right-click for more", pane.text()))
    }

    fn top_bar_right_ui(&mut self, tiles: &Tiles<Place>, ui: &mut Ui, _: TileId, tabs: &Tabs, _: &mut f32) {
        if let Some(Place::Pane(pane)) = tabs.active.and_then(|id| tiles.get_pane(&id)).copied() {
            let name = format!("Menu of {}", pane.text());
            let menu = ui.menu_button("\u{2026}", |ui| self.menu(ui, pane)).response;
            menu.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &name));
        }
    }

    fn tab_bar_height(&self, _: &egui::Style) -> f32 {
        28.0
    }

    fn gap_width(&self, _: &egui::Style) -> f32 {
        3.0
    }

    fn min_size(&self) -> f32 {
        120.0
    }

    fn tab_outline_stroke(&self, _: &egui::Visuals, _: &Tiles<Place>, _: TileId, _: &TabState) -> egui::Stroke {
        egui::Stroke::NONE
    }

    fn tab_text_color(&self, visuals: &egui::Visuals, _: &Tiles<Place>, _: TileId, state: &TabState) -> egui::Color32 {
        if state.active { visuals.strong_text_color() } else { visuals.weak_text_color() }
    }

    fn simplification_options(&self) -> SimplificationOptions {
        SimplificationOptions { all_panes_must_have_tabs: true, ..SimplificationOptions::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Contents with all panes except those of the lower groups; records the rectangles.
    #[derive(Default)]
    struct Rects(Vec<(Place, egui::Rect)>);

    impl DockContents for Rects {
        fn has(&self, place: Place) -> bool {
            !matches!(place, Place::Pane(Pane::Camera | Pane::Phrases | Pane::Report | Pane::Log))
        }
        fn show(&mut self, ui: &mut Ui, place: Place) {
            self.0.push((place, ui.max_rect()));
        }
        fn hide(&mut self, _: Pane) {}
    }

    /// Rectangles of the visible places in a window of this size, after layout has settled.
    fn shown(dock: &mut Dock, size: [f32; 2]) -> Vec<(Place, egui::Rect)> {
        let ctx = egui::Context::default();
        let mut rects = Rects::default();
        for _ in 0..4 {
            rects.0.clear();
            let screen_rect = Some(egui::Rect::from_min_size(egui::Pos2::ZERO, size.into()));
            let input = egui::RawInput { screen_rect, ..egui::RawInput::default() };
            ctx.run_ui(input, |ui| dock.show(ui, &mut rects)).textures_delta.clear();
        }
        rects.0
    }

    fn width(shown: &[(Place, egui::Rect)], place: Place) -> Option<f32> {
        shown.iter().find(|(p, _)| *p == place).map(|(_, r)| r.width())
    }

    #[test]
    fn columns_keep_their_width_and_the_view_takes_the_rest() {
        let mut dock = Dock::default();
        for size in [[1400.0, 900.0], [2560.0, 1440.0], [1100.0, 700.0], [1400.0, 900.0]] {
            let shown = shown(&mut dock, size);
            let of = |pane| width(&shown, Place::Pane(pane)).expect("in sight");
            assert!((of(Pane::Dataset) - 250.0).abs() < 4.0 && (of(Pane::Training) - 350.0).abs() < 4.0, "{shown:?}");
            assert!(width(&shown, Place::View).expect("in sight") > size[0] - 620.0);
        }
        // With less room than all panes need, the view keeps its share.
        let shown = shown(&mut dock, [800.0, 600.0]);
        assert!(width(&shown, Place::View).expect("in sight") > 400.0, "{shown:?}");
        assert_eq!(width(&shown, Place::Pane(Pane::Dataset)), None, "behind a tab");
    }

    #[test]
    fn a_pane_is_brought_before_the_others_in_every_arrangement() {
        let mut dock = Dock::default();
        assert_eq!(width(&shown(&mut dock, [1400.0, 900.0]), Place::Pane(Pane::Plan)), None);
        dock.activate(Pane::Plan);
        for size in [[1400.0, 900.0], [800.0, 600.0]] {
            let shown = shown(&mut dock, size);
            assert!(
                width(&shown, Place::Pane(Pane::Plan)).is_some()
                    && width(&shown, Place::Pane(Pane::Training)).is_none()
            );
        }
    }

    #[test]
    fn an_arrangement_that_lacks_a_pane_is_not_used() {
        let mut dock = Dock::default();
        dock.detach(Pane::Log, true);
        assert_eq!(dock.clone().checked(), dock);
        let log = dock.narrow.tiles.find_pane(&Place::Pane(Pane::Log)).expect("there");
        dock.narrow.tiles.remove(log);
        assert_eq!(dock.checked(), Dock::default());
    }
}
