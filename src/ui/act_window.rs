//! Actions on the window itself.

use super::app::App;
use super::dock::Dock;
use super::layout::Layout;
use super::state::Tone;
use crate::ui::actions::Action;

impl App {
    /// Changes the window: its theme, its panes and the full view.
    pub(super) fn arrange(&mut self, action: &Action, ctx: &egui::Context) {
        match action {
            Action::FillWindow => {
                self.full_view = !self.full_view;
                ctx.send_viewport_cmd(egui::ViewportCommand::Fullscreen(self.full_view));
                if self.full_view {
                    self.state.toast(Tone::Info, "Esc or F11 brings the panes back.");
                }
            }
            Action::ResetPanes => {
                self.layout.dock = Dock::default();
                self.layout.hidden = Layout::default().hidden;
            }
            Action::UseTheme(theme) => {
                self.layout.theme = *theme;
                ctx.set_theme(*theme);
            }
            Action::LargerText => egui::gui_zoom::zoom_in(ctx),
            Action::SmallerText => egui::gui_zoom::zoom_out(ctx),
            Action::NormalText => ctx.set_zoom_factor(1.0),
            _ => {}
        }
    }
}
