//! The adapter and its device: their identity, abilities and faults.
//!
//! A process has one device: the window's own if a real GPU draws the window. Training keeps few steps ahead of it, so
//! that other drawing need not wait for many.

use std::sync::{Arc, Mutex, PoisonError};

use super::GpuError;
use super::readback::StagingPool;
use crate::scene::resource_log::{self, ResourceKind};

/// Features that are used where an adapter offers them. Everything works without any of them.
const WANTED: wgpu::Features =
    wgpu::Features::SHADER_FLOAT32_ATOMIC.union(wgpu::Features::SUBGROUP).union(wgpu::Features::TIMESTAMP_QUERY);

/// A GPU device with its queue. Cheap to clone; clones are the same device.
#[derive(Clone, Debug)]
pub struct Device {
    device: wgpu::Device,
    queue: wgpu::Queue,
    info: Arc<wgpu::AdapterInfo>,
    /// First fault that no call has returned yet.
    fault: Arc<Mutex<Option<GpuError>>>,
    staging: StagingPool,
}

fn adapter(software: bool) -> Result<wgpu::Adapter, wgpu::RequestAdapterError> {
    let mut description = wgpu::InstanceDescriptor::new_without_display_handle();
    description.backends = wgpu::Backends::PRIMARY;
    let options = wgpu::RequestAdapterOptions {
        power_preference: wgpu::PowerPreference::HighPerformance,
        force_fallback_adapter: software,
        ..wgpu::RequestAdapterOptions::default()
    };
    pollster::block_on(wgpu::Instance::new(description.with_env()).request_adapter(&options))
}

/// The device that everything in the process draws and trains on.
static SHARED: Mutex<Option<Device>> = Mutex::new(None);

/// Device in `held`, opened with `open` at first use and again after it was lost.
fn held_or(
    held: &Mutex<Option<Device>>,
    open: impl FnOnce() -> Result<Option<Device>, GpuError>,
) -> Result<Option<Device>, GpuError> {
    let mut held = held.lock().unwrap_or_else(PoisonError::into_inner);
    if held.as_ref().is_none_or(Device::is_lost) {
        *held = open()?;
    }
    Ok(held.clone())
}

impl Device {
    /// The process's device: the best adapter's, a real GPU's before a software one's. Opened at first use, and again
    /// after it was lost.
    pub(crate) fn shared() -> Result<Self, GpuError> {
        let shared = held_or(&SHARED, || Self::new().map(Some))?;
        shared.ok_or_else(|| GpuError::NoAdapter("none was opened".to_owned()))
    }

    /// The process's device where it is a real GPU's. No device of an emulated adapter is opened to find that out.
    pub(crate) fn shared_real() -> Result<Option<Self>, GpuError> {
        Ok(held_or(&SHARED, Self::real)?.filter(|device| !device.is_software()))
    }

    /// Shares a window's device with the process, and returns whether it did: only one of a real GPU that has all that
    /// [`Self::device_descriptor`] asks for, before another was opened.
    pub(crate) fn adopt(adapter: &wgpu::Adapter, device: &wgpu::Device, queue: &wgpu::Queue) -> bool {
        let (info, wanted) = (adapter.get_info(), Self::device_descriptor(adapter));
        let suits = info.device_type != wgpu::DeviceType::Cpu
            && wgpu::Backends::PRIMARY.contains(info.backend.into())
            && device.features().contains(wanted.required_features)
            && wanted.required_limits.check_limits(&device.limits());
        let mut held = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
        if !suits || held.is_some() {
            return false;
        }
        resource_log::record(
            ResourceKind::Device,
            format!("the window's device on {}", info.name),
            "the window was opened",
            0,
        );
        *held = Some(Self::from_parts(info, device.clone(), queue.clone()));
        true
    }

    /// Opens the best adapter: a real GPU before a software one.
    pub fn new() -> Result<Self, GpuError> {
        let adapter = adapter(false).or_else(|_| adapter(true)).map_err(|e| GpuError::NoAdapter(e.to_string()))?;
        Self::open(&adapter)
    }

    /// Opens the best real GPU; `None` where there is none. No device of an emulated adapter is opened
    /// to find that out.
    pub(crate) fn real() -> Result<Option<Self>, GpuError> {
        let adapter = adapter(false).ok().filter(|a| a.get_info().device_type != wgpu::DeviceType::Cpu);
        adapter.map(|a| Self::open(&a)).transpose()
    }

    /// Opens a device on an adapter of the caller's choice.
    pub(crate) fn open(adapter: &wgpu::Adapter) -> Result<Self, GpuError> {
        resource_log::record(
            ResourceKind::Device,
            format!("device on {}", adapter.get_info().name),
            "something is drawn on it",
            0,
        );
        let (device, queue) = pollster::block_on(adapter.request_device(&Self::device_descriptor(adapter)))
            .map_err(|e| GpuError::Device { adapter: adapter.get_info().name, reason: e.to_string() })?;
        Ok(Self::from_parts(adapter.get_info(), device, queue))
    }

    /// The device that this module would ask of `adapter`: all its limits, and those of the wanted
    /// features that it has. For callers that open the device themselves, such as a window.
    pub(crate) fn device_descriptor(adapter: &wgpu::Adapter) -> wgpu::DeviceDescriptor<'static> {
        wgpu::DeviceDescriptor {
            label: Some("fmlgs"),
            required_features: adapter.features() & WANTED,
            required_limits: adapter.limits(),
            ..wgpu::DeviceDescriptor::default()
        }
    }

    /// Uses a device that exists already, such as the window's. Takes over its handlers for
    /// faults, so that none of them ends the process.
    pub(crate) fn from_parts(info: wgpu::AdapterInfo, device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let fault = Arc::new(Mutex::new(None));
        let slot = Arc::clone(&fault);
        device.on_uncaptured_error(Arc::new(move |error| keep_first(&slot, gpu_error(error, "a command", 0))));
        let slot = Arc::clone(&fault);
        device.set_device_lost_callback(move |reason, text| {
            // Dropping the last handle of a device also ends it; then there is no one to report to.
            if reason != wgpu::DeviceLostReason::Destroyed {
                keep_first(&slot, GpuError::Lost(text));
            }
        });
        Self { device, queue, info: Arc::new(info), fault, staging: StagingPool::default() }
    }

    /// The device.
    pub fn wgpu(&self) -> &wgpu::Device {
        &self.device
    }

    pub(crate) fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }

    /// Name, type and driver of the adapter.
    pub(crate) fn info(&self) -> &wgpu::AdapterInfo {
        &self.info
    }

    /// Limits of the device.
    pub fn limits(&self) -> wgpu::Limits {
        self.device.limits()
    }

    /// Returns whether the "GPU" is a program on the CPU, slower than the CPU backend.
    pub fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// Returns whether floats can be added atomically; otherwise sums use compare-and-exchange.
    pub fn has_float_atomics(&self) -> bool {
        self.device.features().contains(wgpu::Features::SHADER_FLOAT32_ATOMIC)
    }

    /// Returns whether passes can be timed on the device.
    pub fn has_timestamps(&self) -> bool {
        self.device.features().contains(wgpu::Features::TIMESTAMP_QUERY)
    }

    /// One line for display: name, kind, interface, features in use, largest binding.
    pub fn describe(&self) -> String {
        let kind = match self.info.device_type {
            wgpu::DeviceType::DiscreteGpu => "discrete GPU",
            wgpu::DeviceType::IntegratedGpu => "integrated GPU",
            wgpu::DeviceType::VirtualGpu => "virtual GPU",
            wgpu::DeviceType::Cpu => "software",
            wgpu::DeviceType::Other => "unknown kind",
        };
        let atomics = if self.has_float_atomics() { "float atomics" } else { "no float atomics" };
        let binding = self.limits().max_storage_buffer_binding_size / (1 << 20);
        format!("{} ({kind}, {:?}, {atomics}, {binding} MiB per binding)", self.info.name, self.info.backend)
    }

    /// Returns the first fault not reported before: device lost, out of memory.
    pub fn check(&self) -> Result<(), GpuError> {
        let taken = self.fault.lock().unwrap_or_else(PoisonError::into_inner).take();
        match taken {
            // A lost device stays lost.
            Some(lost @ GpuError::Lost(_)) => {
                keep_first(&self.fault, lost.clone());
                Err(lost)
            }
            Some(fault) => Err(fault),
            None => Ok(()),
        }
    }

    fn is_lost(&self) -> bool {
        matches!(*self.fault.lock().unwrap_or_else(PoisonError::into_inner), Some(GpuError::Lost(_)))
    }

    /// Refuses `need` bytes in one storage binding where the adapter cannot bind so many.
    pub(super) fn fits_binding(&self, what: &str, need: u64, remedy: &'static str) -> Result<(), GpuError> {
        let limits = self.limits();
        let checks = [
            ("maxStorageBufferBindingSize", limits.max_storage_buffer_binding_size),
            ("maxBufferSize", limits.max_buffer_size),
        ];
        for (limit_name, limit) in checks {
            if need > limit {
                return Err(GpuError::Limit { what: what.to_owned(), need, limit_name, limit, remedy });
            }
        }
        Ok(())
    }

    /// Refuses a dispatch of `need` workgroups along one axis where the adapter cannot do it.
    pub(super) fn fits_dispatch(&self, what: &str, need: u64, remedy: &'static str) -> Result<(), GpuError> {
        let limit = u64::from(self.limits().max_compute_workgroups_per_dimension);
        let limit_name = "maxComputeWorkgroupsPerDimension";
        let what = format!("{what} (workgroups)");
        if need > limit { Err(GpuError::Limit { what, need, limit_name, limit, remedy }) } else { Ok(()) }
    }

    /// A zeroed storage buffer of `bytes`, at least 16, that can be copied from and to.
    pub(super) fn storage(&self, what: &str, bytes: u64) -> Result<wgpu::Buffer, GpuError> {
        self.fits_binding(what, bytes, "use fewer Gaussians or smaller pictures")?;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        self.buffer(what, bytes, usage)
    }

    /// Makes room for `bytes` in a storage buffer, whose contents may be lost.
    pub(super) fn grow(&self, buffer: &mut wgpu::Buffer, what: &str, bytes: u64) -> Result<(), GpuError> {
        if buffer.size() < bytes {
            *buffer = self.storage(what, bytes)?;
        }
        Ok(())
    }

    pub(super) fn storage_with(&self, what: &str, contents: &[u8]) -> Result<wgpu::Buffer, GpuError> {
        let buffer = self.storage(what, contents.len() as u64)?;
        self.queue.write_buffer(&buffer, 0, contents);
        Ok(buffer)
    }

    pub(super) fn uniform(&self, what: &str, contents: &[u8]) -> Result<wgpu::Buffer, GpuError> {
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let buffer = self.buffer(what, contents.len() as u64, usage)?;
        self.queue.write_buffer(&buffer, 0, contents);
        Ok(buffer)
    }

    pub(super) fn buffer(&self, what: &str, bytes: u64, usage: wgpu::BufferUsages) -> Result<wgpu::Buffer, GpuError> {
        // Bindings may not be empty, and copies move whole words.
        let size = bytes.max(16).next_multiple_of(4);
        self.scoped(what, size, || {
            self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(what),
                size,
                usage,
                mapped_at_creation: false,
            })
        })
    }

    /// Runs `create` and returns its fault, if it has one, instead of passing it to the handler.
    pub(super) fn scoped<T>(&self, what: &str, bytes: u64, create: impl FnOnce() -> T) -> Result<T, GpuError> {
        let filters = [wgpu::ErrorFilter::Internal, wgpu::ErrorFilter::Validation, wgpu::ErrorFilter::OutOfMemory];
        let scopes = filters.map(|f| self.device.push_error_scope(f));
        let made = create();
        let mut fault = None;
        for scope in scopes.into_iter().rev() {
            if let Some(error) = pollster::block_on(scope.pop()) {
                fault = Some(gpu_error(error, what, bytes));
            }
        }
        fault.map_or(Ok(made), Err)
    }

    /// Waits for everything submitted so far.
    pub(crate) fn wait(&self) -> Result<(), GpuError> {
        self.wait_for(None)
    }

    /// Waits for a submission and all earlier ones, from any thread, but for no later ones; without one for everything
    /// so far.
    pub(super) fn wait_for(&self, submission_index: Option<wgpu::SubmissionIndex>) -> Result<(), GpuError> {
        let until = wgpu::PollType::Wait { submission_index, timeout: None };
        self.device.poll(until).map_err(|e| GpuError::Lost(e.to_string()))?;
        self.check()
    }

    /// Memory for copies to the host.
    pub(super) fn staging(&self) -> &StagingPool {
        &self.staging
    }
}

fn keep_first(slot: &Mutex<Option<GpuError>>, error: GpuError) {
    slot.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
}

fn gpu_error(error: wgpu::Error, what: &str, bytes: u64) -> GpuError {
    match error {
        wgpu::Error::OutOfMemory { .. } => GpuError::OutOfMemory { what: what.to_owned(), bytes },
        wgpu::Error::Validation { description, .. } | wgpu::Error::Internal { description, .. } => {
            GpuError::Refused(format!("{what}: {description}"))
        }
    }
}

/// Name of the first adapter that is not emulated. Opens no device.
pub fn real_gpu() -> Option<String> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
    adapters
        .iter()
        .map(wgpu::Adapter::get_info)
        .find(|i| {
            matches!(
                i.device_type,
                wgpu::DeviceType::DiscreteGpu | wgpu::DeviceType::IntegratedGpu | wgpu::DeviceType::VirtualGpu
            )
        })
        .map(|i| i.name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_is_opened_once_and_again_only_after_it_was_lost() {
        let Ok(device) = Device::new() else { return };
        let (held, opened) = (Mutex::new(None), std::cell::Cell::new(0));
        let ask = || {
            let open = || {
                opened.set(opened.get() + 1);
                let parts = (device.info().clone(), device.wgpu().clone(), device.queue().clone());
                Ok(Some(Device::from_parts(parts.0, parts.1, parts.2)))
            };
            held_or(&held, open).expect("opens").expect("held")
        };
        let first = ask();
        ask();
        assert_eq!(opened.get(), 1);
        first.fault.lock().expect("free").replace(GpuError::Lost("unplugged".into()));
        assert!(ask().check().is_ok(), "a new one");
        assert_eq!(opened.get(), 2);
        assert!(matches!(held_or(&Mutex::new(None), || Err(GpuError::Lost("x".into()))), Err(GpuError::Lost(_))));
    }
}
