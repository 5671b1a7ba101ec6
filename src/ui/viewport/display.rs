//! The newest frame on screen: received, uploaded, painted, and read for picking.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Instant;

use eframe::egui_wgpu::RenderState;
use eframe::wgpu::FilterMode;
use egui::{Color32, ColorImage, Rect, TextureHandle, TextureId, TextureOptions, Ui, pos2};
use glam::{DVec2, DVec3};

use super::eye::Eye;
use super::frame_times::FrameTimes;
use super::split::ViewArea;
use crate::jobs::query::ViewMaps;
use crate::render::DevicePicture;
use crate::scene::Camera;
use crate::scene::resource_log::{self, ResourceKind};
use crate::ui::theme;
use crate::worker::view::{MappedView, ViewPicture, ViewResult};
use crate::worker::{Slot, Versioned};

/// Window of the frame rate, s.
const RATE_SECS: f64 = 2.0;

/// Frames that stay on the device that drew them, which is the window's.
struct NativeTexture {
    window: RenderState,
    /// Texture of the newest frame; `None` while another kind is on screen.
    id: Option<TextureId>,
}

/// The frame on screen.
#[derive(Default)]
pub(super) struct Display {
    picture: Option<Arc<ViewPicture>>,
    texture: Option<TextureHandle>,
    /// Painter of frames on the window's device.
    native: Option<NativeTexture>,
    /// Frames of the views beside the first, if they differ.
    beside: Vec<Option<TextureHandle>>,
    error: Option<String>,
    /// Reason why there is no identity map of this view.
    unmapped: Option<String>,
    /// Reason why the CPU draws although there is a GPU, once reported.
    instead_of_gpu: Option<String>,
    /// Generation of the newest frame.
    shown: u64,
    /// Generation of the newest frame at the last call of `take_new`.
    counted: u64,
    /// Generation of the newest maps.
    mapped: u64,
    /// Times of recent frames, while they are shown.
    times: Option<FrameTimes>,
    /// Window times of recent frames, s.
    arrivals: VecDeque<f64>,
}

impl Display {
    pub(super) fn picture(&self) -> Option<&ViewPicture> {
        self.picture.as_deref()
    }

    /// The camera for overlays of a frame in `rect`: the frame's own, so that both move together.
    pub(super) fn overlay_camera(&self, eye: &Eye, rect: Rect) -> Camera {
        match self.picture() {
            Some(p) => p.camera.resized(rect.width().max(1.0) as u32, rect.height().max(1.0) as u32),
            None => eye.camera(rect.width() as u32, rect.height() as u32),
        }
    }

    /// True if a GPU draws the view.
    pub(super) fn on_gpu(&self) -> bool {
        self.picture().is_some_and(ViewPicture::on_gpu)
    }

    /// Times of recent frames, while they are shown.
    pub(super) fn times(&self) -> Option<&FrameTimes> {
        self.times.as_ref()
    }

    /// Lets the worker draw with the device of this window.
    pub(super) fn share(&mut self, window: RenderState) {
        self.native = Some(NativeTexture { window, id: None });
    }

    /// True if frames on the drawing device can be painted.
    pub(super) fn shares_device(&self) -> bool {
        self.native.is_some()
    }

    /// Errors of rendering, for the user.
    pub(super) fn errors(&self) -> impl Iterator<Item = &String> {
        self.error.iter().chain(&self.unmapped)
    }

    /// Forgets the frame of another scene.
    pub(super) fn clear(&mut self) {
        (self.picture, self.texture, self.error, self.unmapped) = (None, None, None, None);
        self.beside.clear();
        self.native.iter_mut().for_each(|native| native.show(None));
    }

    /// Clears the error of the maps, as the view has changed.
    pub(super) fn forget_maps(&mut self) {
        self.unmapped = None;
    }

    /// Starts or stops collecting the times of frames.
    pub(super) fn time_frames(&mut self, on: bool) {
        match on {
            true => drop(self.times.get_or_insert_default()),
            false => self.times = None,
        }
    }

    /// True if a frame has arrived since the last call.
    pub(super) fn take_new(&mut self) -> bool {
        std::mem::replace(&mut self.counted, self.shown) != self.shown
    }

    /// Reason why the CPU draws although there is a GPU, once for each reason.
    pub(super) fn newly_instead_of_gpu(&mut self) -> Option<String> {
        let why = self.picture.as_ref()?.instead_of_gpu.clone()?;
        (self.instead_of_gpu.replace(why.clone()).as_ref() != Some(&why)).then_some(why)
    }

    /// Uploads the newest frame if there is one.
    pub(super) fn take(&mut self, ctx: &egui::Context, pictures: &Slot<ViewResult>) {
        let Some((generation, result)) = pictures.newer_than(self.shown) else { return };
        self.shown = generation;
        let picture = match &*result {
            Ok(picture) => picture,
            Err(failure) => {
                self.error = Some(failure.in_a_line());
                return;
            }
        };
        let start = Instant::now();
        let size = [picture.camera.width_px as usize, picture.camera.height_px as usize];
        // After a device loss, worker and window may use different devices.
        let native = self.native.as_mut();
        let paints = |texture: &&DevicePicture| native.as_ref().is_some_and(|n| texture.lies_on(&n.window.device));
        let texture = picture.texture.as_ref().filter(paints);
        native.into_iter().for_each(|native| native.show(texture));
        match &picture.texture {
            None => upload(ctx, &mut self.texture, size, &picture.rgb),
            Some(elsewhere) if texture.is_none() => {
                elsewhere.to_rgb8().iter().for_each(|rgb| upload(ctx, &mut self.texture, size, rgb));
            }
            Some(_) => {}
        }
        self.beside.resize_with(picture.beside.len(), || None);
        for (texture, beside) in self.beside.iter_mut().zip(&picture.beside) {
            upload(ctx, texture, size, &beside.rgb);
        }
        let now = ctx.input(|i| i.time);
        self.arrivals.retain(|at| now - at < RATE_SECS);
        self.arrivals.push_back(now);
        if self.picture.is_none() {
            resource_log::record(ResourceKind::Picture, "first frame", "the scene is on screen", 0);
        }
        if let Some(times) = &mut self.times {
            times.add(picture, start.elapsed().as_secs_f64());
        }
        self.picture = Some(Arc::clone(picture));
        self.error = None;
    }

    /// Recent frames per second; `None` before enough frames.
    pub(super) fn rate(&self, now: f64) -> Option<f64> {
        let first = self.arrivals.iter().find(|at| now - **at < RATE_SECS)?;
        let frames = self.arrivals.iter().filter(|at| *at > first).count();
        let secs = self.arrivals.back()? - first;
        (secs > 0.0).then(|| frames as f64 / secs)
    }

    /// New identity maps, and whether the view is at rest. At rest, maps of a request before `ticket` belong to another
    /// view; those of a moving view belong to its newest frame.
    pub(super) fn take_maps(&mut self, maps: &Slot<MappedView>, ticket: u64) -> Option<(Versioned<ViewMaps>, bool)> {
        let (generation, mapped) = maps.newer_than(self.mapped)?;
        self.mapped = generation;
        if let Some(times) = &mut self.times {
            times.add_maps(mapped.secs);
        }
        if mapped.exact && mapped.ticket != ticket {
            return None;
        }
        match &mapped.maps {
            Ok(maps) => return Some((Versioned::new(Arc::clone(maps)), mapped.exact)),
            Err(failure) => self.unmapped = Some(failure.in_a_line()),
        }
        None
    }

    /// Paints the frame of a view into a part of it.
    pub(super) fn paint(&self, ui: &Ui, ViewArea { index, rect, shown, .. }: ViewArea) {
        // Filling the area under the frame would take a fifth of a redraw on an emulated adapter.
        let native = self.native.as_ref().and_then(|native| native.id);
        let first = native.or(self.texture.as_ref().map(TextureHandle::id));
        if first.is_none() || shown != rect {
            ui.painter().rect_filled(rect, 0.0, theme::canvas());
        }
        let beside = index.checked_sub(1).and_then(|k| self.beside.get(k)?.as_ref());
        if let Some(texture) = beside.map(TextureHandle::id).or(first) {
            let uv = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
            ui.painter().image(texture, shown, uv, Color32::WHITE);
        }
    }

    /// The rendered surface at a relative position of the frame, if its depth was drawn from the current position.
    pub(super) fn picked(&self, at: DVec2, eye: &Eye) -> Option<DVec3> {
        let picture = self.picture()?;
        // A frame from another position does not apply here.
        if !eye.is_at(picture.camera.center) {
            return None;
        }
        let size = DVec2::new(f64::from(picture.camera.width_px), f64::from(picture.camera.height_px));
        let px = (at * size).clamp(DVec2::ZERO, size - 1.0);
        let index = px.y as usize * picture.camera.width_px as usize + px.x as usize;
        let depth = f64::from(*picture.median_depth.as_ref()?.get(index)?);
        (depth > 0.0).then(|| picture.camera.center + picture.camera.ray(at * size) * depth)
    }
}

impl NativeTexture {
    /// Shows a frame, or releases the texture of the last one.
    fn show(&mut self, picture: Option<&DevicePicture>) {
        let RenderState { renderer, device, .. } = &self.window;
        let mut renderer = renderer.write();
        match (picture, self.id) {
            (Some(picture), Some(id)) => {
                renderer.update_egui_texture_from_wgpu_texture(device, &picture.view(), FilterMode::Linear, id);
            }
            (Some(picture), None) => {
                self.id = Some(renderer.register_native_texture(device, &picture.view(), FilterMode::Linear));
            }
            (None, Some(id)) => {
                renderer.free_texture(&id);
                self.id = None;
            }
            (None, None) => {}
        }
    }
}

/// Uploads pixels as a texture.
fn upload(ctx: &egui::Context, texture: &mut Option<TextureHandle>, size: [usize; 2], rgb: &[[u8; 3]]) {
    let pixels = rgb.iter().map(|&[r, g, b]| Color32::from_rgb(r, g, b)).collect();
    let image = ColorImage::new(size, pixels);
    match texture {
        Some(texture) => texture.set(image, TextureOptions::LINEAR),
        None => *texture = Some(ctx.load_texture("viewport", image, TextureOptions::LINEAR)),
    }
}

/// A frame of 4 x 4 px from `eye`, with depth 2 except at its first pixel.
#[cfg(test)]
pub(super) fn frame_of(ticket: u64, eye: &Eye) -> ViewPicture {
    let mut depth = vec![2.0; 16];
    depth[0] = 0.0;
    ViewPicture {
        ticket,
        full: true,
        camera: eye.camera(4, 4),
        rgb: vec![[9; 3]; 16],
        texture: None,
        median_depth: Some(depth),
        depth_range: None,
        psnr: None,
        beside: Vec::new(),
        secs: 0.1,
        stages: Vec::new(),
        paint_secs: 0.0,
        drawn_by: "CPU".into(),
        instead_of_gpu: Some("it was lost".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::frame_of as frame;
    use super::*;
    use crate::scene::Bounds;
    use crate::worker::Failure;

    fn failure() -> Failure {
        Failure::new("no", "wait")
    }

    #[test]
    fn frames_are_shown_and_picked_from_where_they_were_drawn() {
        let ctx = egui::Context::default();
        let mut eye = Eye::framing(&Bounds { min: DVec3::NEG_ONE, max: DVec3::ONE }, DVec3::Z);
        let (mut display, pictures) = (Display::default(), Slot::default());
        display.take(&ctx, &pictures);
        assert!(!display.take_new() && display.picked(DVec2::splat(0.6), &eye).is_none());
        pictures.publish(Ok(Arc::new(frame(1, &eye))));
        display.take(&ctx, &pictures);
        assert!(display.take_new() && !display.take_new() && display.texture.is_some());
        let point = display.picked(DVec2::splat(0.625), &eye).expect("a surface");
        let at = eye.camera(4, 4).project(point).expect("in front");
        assert!((at - DVec2::splat(2.5)).length() < 1e-9, "{at}");
        assert!(display.picked(DVec2::splat(0.1), &eye).is_none(), "nothing is there");
        eye.fly(DVec3::Z);
        assert!(display.picked(DVec2::splat(0.625), &eye).is_none(), "seen from elsewhere");
        assert_eq!(display.newly_instead_of_gpu().as_deref(), Some("it was lost"));
        assert_eq!(display.newly_instead_of_gpu(), None, "reported once");
        pictures.publish(Err(failure()));
        display.take(&ctx, &pictures);
        assert_eq!(display.errors().collect::<Vec<_>>(), ["no wait"]);
        assert!(display.picture().is_some(), "the last frame stays");
        display.clear();
        assert!(display.picture().is_none() && display.errors().next().is_none());
    }

    #[test]
    fn a_picture_that_stays_on_the_windows_device_is_painted_like_any_other() {
        use crate::render::gpu::GpuRenderer;
        use crate::render::{Device, Features, RenderSettings};
        use egui_kittest::wgpu::{WgpuTestRenderer, create_render_state, default_wgpu_setup};

        let mut setup = default_wgpu_setup();
        if let eframe::egui_wgpu::WgpuSetup::CreateNew(setup) = &mut setup {
            setup.device_descriptor = Arc::new(Device::device_descriptor);
        }
        let window = create_render_state(setup, eframe::egui_wgpu::RendererOptions::PREDICTABLE);
        let device = Device::from_parts(window.adapter.get_info(), window.device.clone(), window.queue.clone());
        let place = |i: usize| [(i as f32 * 0.7).sin(), (i as f32 * 0.4).cos(), (i as f32 * 0.9).sin()];
        let cloud = crate::scene::GaussianCloud {
            positions: (0..200).map(place).collect(),
            log_scales: vec![[-2.0; 3]; 200],
            quaternions: vec![[1.0, 0.0, 0.0, 0.0]; 200],
            opacity_logits: vec![1.0; 200],
            sh: (0..200).map(place).collect(),
            ..crate::scene::GaussianCloud::default()
        };
        let eye = Eye::framing(&Bounds { min: DVec3::NEG_ONE, max: DVec3::ONE }, DVec3::Z);
        let (camera, settings) = (eye.camera(60, 40), RenderSettings::default());
        let mut renderer = GpuRenderer::new(&device).expect("a renderer");
        renderer.upload(&cloud, Features::NONE).expect("sent");
        let rgb = renderer.draw_rgb8(&camera, &settings).expect("drawn");
        let texture = renderer.draw_texture(&camera, &settings).expect("drawn");
        assert!(rgb.iter().filter(|c| **c != [0; 3]).count() > 100, "there is something to see");

        let (display, pictures) = (&std::cell::RefCell::new(Display::default()), Arc::new(Slot::default()));
        display.borrow_mut().share(window.clone());
        let size = egui::vec2(60.0, 40.0);
        let mut harness = egui_kittest::Harness::builder()
            .with_size(size)
            .renderer(WgpuTestRenderer::from_render_state(window))
            .build_ui(|ui| {
                let rect = Rect::from_min_size(egui::Pos2::ZERO, size);
                display.borrow_mut().take(ui.ctx(), &pictures);
                let area = ViewArea { index: 0, rect, shown: rect, second: false, is_other: false };
                display.borrow().paint(ui, area);
            });
        let mut painted = |rgb: &[[u8; 3]], texture: Option<DevicePicture>| {
            let picture = ViewPicture { camera: camera.clone(), rgb: rgb.to_vec(), texture, ..frame(1, &eye) };
            pictures.publish(Ok(Arc::new(picture)));
            harness.run();
            harness.render().expect("an image")
        };
        let of_bytes = painted(&rgb, None);
        let of_texture = painted(&[], Some(texture.clone()));
        assert_eq!(of_texture, of_bytes);
        // To another frame and back: the newest is always on screen.
        let black = painted(&vec![[0; 3]; rgb.len()], None);
        assert_ne!(black, of_bytes);
        assert_eq!(painted(&[], Some(texture)), of_bytes);
    }

    #[test]
    fn the_rate_is_that_of_the_last_seconds() {
        let mut display = Display { arrivals: [1.0, 1.1, 1.2, 1.3].into(), ..Display::default() };
        assert!(display.rate(1.35).is_some_and(|fps| (fps - 10.0).abs() < 1e-9));
        assert!(display.rate(3.15).is_some_and(|fps| (fps - 10.0).abs() < 1e-9), "of those that are no older");
        assert_eq!(display.rate(3.25), None, "a single frame has no rate");
        display.arrivals.clear();
        assert_eq!(display.rate(1.0), None);
    }

    #[test]
    fn maps_of_an_earlier_view_are_left_out() {
        let (mut display, maps) = (Display::default(), Slot::default());
        let mapped = |ticket, maps| MappedView { ticket, exact: true, maps, secs: 0.0 };
        maps.publish(mapped(1, Ok(Arc::default())));
        assert!(display.take_maps(&maps, 2).is_none());
        maps.publish(mapped(2, Ok(Arc::default())));
        assert!(display.take_maps(&maps, 2).is_some());
        assert!(display.take_maps(&maps, 2).is_none(), "taken once");
        maps.publish(MappedView { exact: false, ..mapped(2, Ok(Arc::default())) });
        let moving = display.take_maps(&maps, 9).map(|(_, exact)| exact);
        assert_eq!(moving, Some(false), "those of a moving view come with its frames, whatever is asked for by now");
        maps.publish(mapped(3, Err(failure())));
        assert!(display.take_maps(&maps, 3).is_none() && display.errors().next().is_some());
        display.forget_maps();
        assert!(display.errors().next().is_none());
    }
}
