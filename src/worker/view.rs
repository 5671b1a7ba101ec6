//! Render thread: it draws the view, so that the window never waits for it.
//!
//! Only the latest request counts: one that was not begun yet is replaced.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::failure::Failure;
use super::observer::Repaint;
use super::thread::panic_failure;
use super::view_renderer::ViewRenderer;
pub use super::view_request::{PictureBeside, QualityBudget, SkipPasses, ViewPicture, ViewRequest, ViewResult};
use super::{Slot, levels};
use crate::jobs::query::ViewMaps;
use crate::render::{DrawError, Renderer};
use crate::scene::Camera;
use crate::scene::resource_log::{self, ResourceKind};

/// Time that the camera rests before working memory is given back.
const REST: Duration = levels::STAY;

/// Identities of the pixels of a view.
#[derive(Clone, Debug)]
pub struct MappedView {
    pub(crate) ticket: u64,
    /// True if drawn while the camera rests; otherwise at the lower resolution of moving frames.
    pub(crate) exact: bool,
    /// The pixels, or why they could not be drawn.
    pub(crate) maps: Result<Arc<ViewMaps>, Failure>,
    /// Seconds that drawing them took.
    pub(crate) secs: f64,
}

#[derive(Default)]
struct Mailbox {
    request: Option<ViewRequest>,
    closed: bool,
}

/// Handle of the drawing thread. Dropping it ends the thread.
pub struct RenderThread {
    mailbox: Arc<(Mutex<Mailbox>, Condvar)>,
    pictures: Arc<Slot<ViewResult>>,
    maps: Arc<Slot<MappedView>>,
}

impl RenderThread {
    /// Starts the thread. Fails only if the system gives none.
    pub fn start(repaint: Repaint) -> std::io::Result<Self> {
        let mailbox = Arc::new((Mutex::new(Mailbox::default()), Condvar::new()));
        let (pictures, maps) = (Arc::new(Slot::default()), Arc::new(Slot::default()));
        let (box_, out, mapped) = (Arc::clone(&mailbox), Arc::clone(&pictures), Arc::clone(&maps));
        let (mut mapper, mut mapped_before) = (Renderer::new(), false);
        let work = move || {
            let mut renderer: Option<ViewRenderer> = None;
            let mut timeout = None;
            loop {
                let request = match next(&box_, timeout.take()) {
                    Waited::Request(request) => request,
                    Waited::Timeout => {
                        renderer.iter_mut().for_each(|p| p.levels.build());
                        renderer.iter_mut().for_each(|p| p.renderer.release_buffers());
                        mapper = Renderer::new();
                        continue;
                    }
                    Waited::Closed => return,
                };
                timeout = Some(REST);
                // Looking for a GPU takes a moment; on this thread nothing waits for it.
                let renderer = match renderer.take().filter(|p| p.without_gpu == request.skip.gpu) {
                    Some(known) => renderer.insert(known),
                    None => renderer.insert(ViewRenderer::without_gpu(request.skip.gpu)),
                };
                if let Some(rough) = renderer.rough(&request) {
                    out.publish(rough);
                    repaint();
                }
                let drawn = renderer.draw(&request);
                let (exact, start) = (request.budget == QualityBudget::Full, Instant::now());
                let camera = match &drawn {
                    // While the camera moves both come together, or masks would trail behind.
                    Ok(picture) if !exact => picture.camera.clone(),
                    _ => {
                        out.publish(drawn.clone());
                        repaint();
                        request.camera.clone()
                    }
                };
                mapper.limit_to(renderer.cut());
                let mut maps_of = || {
                    let by_gpu = renderer.renderer.is_gpu().then(|| maps_of(&mut renderer.renderer, &request, &camera));
                    match by_gpu.flatten() {
                        Some(Err(_)) => {
                            // Buffers may be in any state. The CPU says why, if it cannot either.
                            renderer.renderer.release_buffers();
                            maps_of(&mut mapper, &request, &camera)
                        }
                        Some(drawn) => Some(drawn),
                        None => maps_of(&mut mapper, &request, &camera),
                    }
                };
                // At rest it comes second, and only if no one waits for a frame.
                if (!exact || lock(&box_.0).request.is_none())
                    && let Some(maps) = maps_of()
                {
                    let secs = start.elapsed().as_secs_f64();
                    if let Ok(maps) = &maps
                        && !std::mem::replace(&mut mapped_before, true)
                    {
                        let pixels = maps.identities.identity.len() as u64;
                        resource_log::record(
                            ResourceKind::Maps,
                            "feature maps of the view",
                            "something is queried",
                            pixels * 12,
                        );
                    }
                    if maps.is_err() {
                        // Buffers may be in any state.
                        mapper = Renderer::new();
                    }
                    mapped.publish(MappedView { ticket: request.ticket, exact, maps: maps.map(Arc::new), secs });
                    repaint();
                }
                if !exact {
                    out.publish(drawn);
                    repaint();
                }
            }
        };
        std::thread::Builder::new().name("viewport".into()).spawn(work)?;
        Ok(Self { mailbox, pictures, maps })
    }

    /// Asks for a view; replaces a request that was not begun yet.
    pub fn request(&self, request: ViewRequest) {
        let (mutex, wake) = &*self.mailbox;
        let old = lock(mutex).request.replace(request);
        wake.notify_one();
        drop(old);
    }

    /// Slot in which the identities of views are published.
    pub fn maps(&self) -> &Slot<MappedView> {
        &self.maps
    }

    /// Slot in which frames are published.
    pub fn pictures(&self) -> &Slot<ViewResult> {
        &self.pictures
    }
}

impl Drop for RenderThread {
    fn drop(&mut self) {
        let (mutex, wake) = &*self.mailbox;
        lock(mutex).closed = true;
        wake.notify_one();
    }
}

// A request is replaced in one assignment, so a panicking holder leaves nothing half done.
fn lock(mutex: &Mutex<Mailbox>) -> MutexGuard<'_, Mailbox> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Outcome of waiting for a request.
enum Waited {
    Request(Box<ViewRequest>),
    /// None came in time.
    Timeout,
    /// The handle is gone.
    Closed,
}

/// Waits for a request, at most for `timeout` if there is a limit.
fn next(mailbox: &(Mutex<Mailbox>, Condvar), timeout: Option<Duration>) -> Waited {
    let (mutex, wake) = mailbox;
    let start = Instant::now();
    let mut guard = lock(mutex);
    loop {
        if guard.closed {
            return Waited::Closed;
        }
        if let Some(r) = guard.request.take() {
            return Waited::Request(Box::new(r));
        }
        guard = match timeout.map(|p| p.saturating_sub(start.elapsed())) {
            None => wake.wait(guard).unwrap_or_else(PoisonError::into_inner),
            Some(Duration::ZERO) => return Waited::Timeout,
            Some(left) => wake.wait_timeout(guard, left).unwrap_or_else(PoisonError::into_inner).0,
        };
    }
}

/// Draws the identities of the pixels of a view; `None` if the request does not ask for them.
fn maps_of(renderer: &mut Renderer, request: &ViewRequest, camera: &Camera) -> Option<Result<ViewMaps, Failure>> {
    let semantics = request.semantics.as_ref().filter(|s| s.identity_of.len() == request.cloud.len())?;
    if request.budget != QualityBudget::Full && !request.follow {
        return None;
    }
    let (cloud, settings) = (&request.cloud, &request.settings);
    let draw = AssertUnwindSafe(|| {
        ViewMaps::draw(renderer, (cloud, settings), semantics, camera, request.codes, !request.skip.parts)
    });
    let told = |e: DrawError| {
        let failure = Failure::of(&e, "Reset the view (Home), or find the objects again.");
        Failure { message: format!("What the pixels belong to cannot be drawn: {}", failure.message), ..failure }
    };
    Some(match catch_unwind(draw) {
        Ok(drawn) => drawn.map_err(told),
        Err(payload) => Err(panic_failure(payload.as_ref())),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::RenderSettings;
    use crate::scene::{GaussianCloud, PhotoExposure, SemanticMap};
    use crate::scene::{Identities, Level, NO_IDENTITY};
    use crate::worker::Versioned;
    use crate::worker::view_modes::ViewMode;
    use glam::DVec3;

    #[test]
    fn maps_that_cannot_be_drawn_are_told() {
        let cloud = GaussianCloud { sh: vec![[0.5; 3]], ..GaussianCloud::isotropic(vec![[0.0; 3]], -1.0, 2.0) };
        let mut all = Identities::default();
        all.add(Level::Object, NO_IDENTITY, Vec::new());
        let mut map = SemanticMap::from_identities(all, vec![1], vec![1.0], vec![]);
        let render_thread = RenderThread::start(Arc::new(|| {})).expect("a thread");
        let mapped = |ticket: u64, map: &SemanticMap| {
            render_thread.request(ViewRequest {
                cloud: Versioned::new(Arc::new(cloud.clone())),
                camera: Camera::look_at(DVec3::new(0.0, 0.0, -3.0), DVec3::ZERO, DVec3::NEG_Y, 0.8, 32, 24)
                    .expect("valid"),
                mode: ViewMode::Rgb,
                second: None,
                others: Vec::new(),
                settings: RenderSettings::default(),
                budget: QualityBudget::Full,
                photo: None,
                exposure: PhotoExposure::default(),
                semantics: Some(Versioned::new(Arc::new(map.clone()))),
                follow: false,
                codes: true,
                skip: SkipPasses { parts: false, gpu: true, levels: true },
                on_device: false,
                timed: false,
                ticket,
            });
            let start = Instant::now();
            loop {
                assert!(start.elapsed() < Duration::from_secs(60), "maps, or why there are none");
                if let Some((_, found)) = render_thread.maps().newer_than(ticket - 1) {
                    return found;
                }
                std::thread::sleep(Duration::from_millis(2));
            }
        };
        assert!(mapped(1, &map).maps.is_ok(), "the control");
        // One code is missing.
        map.codes.pop();
        let failure = mapped(2, &map).maps.clone().expect_err("told");
        assert!(failure.message.contains("cannot be drawn") && !failure.remedy.is_empty(), "{failure:?}");
        // The thread goes on.
        map.codes.push(Default::default());
        assert!(mapped(3, &map).maps.is_ok());
    }
}
