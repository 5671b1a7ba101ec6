//! The window.
//!
//! [`app::App`] draws [`state::AppState`] and turns the user's input into [`Action`]s; what each does stands in its row
//! and in [`act`]. An action changes the window at once or starts a job. Panes and tools get one [`ctx::Ctx`]. Nothing
//! here computes for longer than a redraw may take.

mod act;
pub mod actions;
pub mod app;
mod arrival;
pub(crate) mod camera;
pub(crate) mod chat;
mod chat_lines;
mod chat_model;
mod chat_offers;
pub mod color_by;
pub(crate) mod comparison;
mod context;
mod ctx;
pub(crate) mod dialogs;
mod dock;
mod export_dialog;
mod file_dialogs;
mod file_kind;
mod find_dialog;
mod fonts;
mod frame;
pub(crate) mod help;
mod history;
pub(crate) mod keep_dialog;
mod keys;
pub(crate) mod labels;
pub(crate) mod layout;
mod main_button;
pub(crate) mod next_step;
mod object_menu;
mod paired;
pub(crate) mod palette;
pub(crate) mod panes;
pub mod select_shape;
mod short_names;
pub(crate) mod state;
mod stored_measurements;
mod stored_path;
mod text_field;
pub(crate) mod theme;
pub(crate) mod toasts;
mod train_history;
mod video_choice;
mod video_dialog;
pub mod viewport;

use std::sync::Arc;

use eframe::egui_wgpu::WgpuSetup;

pub(crate) use self::actions::Action;

use crate::jobs::Folders;
use crate::render::Device;
use crate::scene::plan::PlanOverride;
use crate::worker::Start;

/// Opens the window with the user's overrides of plans, carries out `first` in order, and returns when it is closed.
pub fn run(first: Vec<Start>, overrides: Vec<PlanOverride>) -> eframe::Result {
    let viewport = egui::ViewportBuilder::default()
        .with_title("FMLGS")
        .with_app_id("fmlgs")
        .with_icon(icon())
        .with_inner_size([1480.0, 920.0])
        .with_min_inner_size([640.0, 480.0])
        .with_drag_and_drop(true);
    // On an emulated adapter OpenGL draws the window several times faster: its Vulkan side runs both branches of every
    // condition in egui's shader.
    if crate::render::real_gpu().is_none() {
        match open(viewport.clone(), eframe::Renderer::Glow, first.clone(), overrides.clone()) {
            // Some systems lack OpenGL.
            Err(eframe::Error::OpenGL(_) | eframe::Error::Glutin(_) | eframe::Error::NoGlutinConfigs(..)) => {}
            result => return result,
        }
    }
    open(viewport, eframe::Renderer::Wgpu, first, overrides)
}

/// The window's icon, and that of the application on macOS.
fn icon() -> egui::IconData {
    let png = include_bytes!("../../assets/icon/fmlgs-128.png");
    eframe::icon_data::from_png_bytes(png).unwrap_or_default()
}

fn open(
    viewport: egui::ViewportBuilder,
    renderer: eframe::Renderer,
    first: Vec<Start>,
    overrides: Vec<PlanOverride>,
) -> eframe::Result {
    // A flat theme has no gradients that dithering would smooth.
    let mut options =
        eframe::NativeOptions { viewport, renderer, dithering: false, ..eframe::NativeOptions::default() };
    // The theme installs fallback fonts itself.
    options.system_font_fallback = false;
    // The device also draws and trains.
    if let WgpuSetup::CreateNew(setup) = &mut options.wgpu_options.wgpu_setup {
        setup.power_preference = eframe::wgpu::PowerPreference::HighPerformance;
        setup.device_descriptor = Arc::new(Device::device_descriptor);
    }
    eframe::run_native(
        "fmlgs",
        options,
        Box::new(|cc| {
            let shared = cc.wgpu_render_state.clone().filter(|w| Device::adopt(&w.adapter, &w.device, &w.queue));
            let first = first.into_iter().map(Action::from);
            let mut app = app::App::new(cc, Folders::of_user(), first)?;
            shared.into_iter().for_each(|window| app.viewport.share(window));
            app.override_plan(overrides);
            Ok(Box::new(app))
        }),
    )
}

/// A callback that requests a redraw from any thread, delayed by `millis`.
fn repainter(ctx: &egui::Context, millis: u64) -> crate::worker::Repaint {
    let ctx = ctx.clone();
    Arc::new(move || ctx.request_repaint_after(std::time::Duration::from_millis(millis)))
}
