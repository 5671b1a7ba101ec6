//! Copies from the device to the host, through memory that is kept from one to the next.
//!
//! All copies to the host go through this file. A moving view's colors stay on the device if the window uses the same
//! one ([`super::pack`]).

use std::borrow::Cow;
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::time::Duration;

use super::{Device, GpuError};

/// Most bytes of memory for copies that are kept; making it anew takes longer than a small copy does.
const KEPT_BYTES: u64 = 256 << 20;
/// Longer than any driver takes to hand over memory that it has written.
const PATIENCE: Duration = Duration::from_secs(10);

/// Unused memory for copies, in the order in which it was returned.
#[derive(Clone, Debug, Default)]
pub(super) struct StagingPool(Arc<Mutex<Vec<wgpu::Buffer>>>);

impl StagingPool {
    /// The smallest that holds `bytes`, unless it is far too large.
    fn take(&self, bytes: u64) -> Option<wgpu::Buffer> {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let fits = |b: &wgpu::Buffer| b.size() >= bytes && b.size() / 4 <= bytes.max(4096);
        let (at, _) = kept.iter().enumerate().filter(|(_, b)| fits(b)).min_by_key(|(_, b)| b.size())?;
        Some(kept.remove(at))
    }

    /// Keeps a buffer unless it is huge; drops those unused for longest if there are too many.
    fn give(&self, buffer: wgpu::Buffer) {
        if buffer.size() > KEPT_BYTES {
            return;
        }
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.push(buffer);
        while kept.iter().map(wgpu::Buffer::size).sum::<u64>() > KEPT_BYTES {
            kept.remove(0);
        }
    }
}

/// Copies that lie in memory that the device wrote; it goes back to the pool with them.
pub(super) struct Copies {
    pool: StagingPool,
    staging: wgpu::Buffer,
    view: Option<wgpu::BufferView>,
    /// Start and end of each.
    spans: Vec<[usize; 2]>,
}

impl Copies {
    /// The values of the `k`-th buffer that was read, where they lie.
    pub(super) fn slice<T: bytemuck::AnyBitPattern + bytemuck::NoUninit>(&self, k: usize) -> Cow<'_, [T]> {
        bytemuck::try_cast_slice(self.bytes(k)).map_or_else(|_| Cow::Owned(self.values(k)), Cow::Borrowed)
    }

    /// The values of the `k`-th buffer that was read.
    pub(super) fn values<T: bytemuck::AnyBitPattern + bytemuck::NoUninit>(&self, k: usize) -> Vec<T> {
        bytemuck::pod_collect_to_vec(self.bytes(k))
    }

    pub(super) fn bytes(&self, k: usize) -> &[u8] {
        let span = self.spans.get(k).zip(self.view.as_ref());
        span.and_then(|([from, to], view)| view.get(*from..*to)).unwrap_or(&[])
    }
}

impl Drop for Copies {
    fn drop(&mut self) {
        drop(self.view.take());
        self.staging.unmap();
        self.pool.give(self.staging.clone());
    }
}

impl Device {
    /// Copies the first bytes of buffers to the host; waits for all work submitted before.
    pub(super) fn read(&self, sources: &[(&wgpu::Buffer, u64)]) -> Result<Copies, GpuError> {
        let mut spans = Vec::with_capacity(sources.len());
        let mut end = 0;
        for (_, bytes) in sources {
            spans.push([end, end + *bytes as usize]);
            end = (end + *bytes as usize).next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT as usize);
        }
        let pool = self.staging();
        let staging = match pool.take(end as u64) {
            Some(kept) => kept,
            None => {
                let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
                self.buffer("a copy for the host", end as u64, usage)?
            }
        };
        let mut encoder = self.wgpu().create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("read") });
        for ((source, bytes), [from, _]) in sources.iter().zip(&spans).filter(|s| s.0.1 > 0) {
            encoder.copy_buffer_to_buffer(source, 0, &staging, *from as u64, *bytes);
        }
        let submitted = self.queue().submit([encoder.finish()]);
        let (sender, receiver) = mpsc::sync_channel(1);
        staging.map_async(wgpu::MapMode::Read, .., move |r| {
            // The receiver outlives the wait below; if it is gone, nobody needs the result.
            let _ = sender.send(r);
        });
        self.wait_for(Some(submitted))?;
        // Another thread may have waited for it too, and be about to say so.
        let mapped =
            receiver.recv_timeout(PATIENCE).map_err(|_| GpuError::Lost("a copy to the host never ended".to_owned()))?;
        mapped.map_err(|e| GpuError::Lost(format!("a copy to the host failed: {e}")))?;
        let view = staging.get_mapped_range(..).map_err(|e| GpuError::Refused(e.to_string()))?;
        Ok(Copies { pool: pool.clone(), staging, view: Some(view), spans })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_for_copies_is_used_again_and_never_by_two() {
        let Ok(device) = Device::new() else { return };
        let buffer = |n: u32| {
            let values: Vec<u32> = (0..n).collect();
            device.storage_with("numbers", bytemuck::cast_slice(&values)).expect("fits")
        };
        let (few, many) = (buffer(5), buffer(1000));
        let kept = || device.staging().0.lock().expect("free").len();
        let first = device.read(&[(&few, 12), (&many, 4000), (&few, 0)]).expect("read");
        let second = device.read(&[(&few, 20)]).expect("read");
        assert_eq!(kept(), 0);
        assert_eq!(first.values::<u32>(0), [0, 1, 2]);
        assert_eq!(first.values::<u32>(1), (0..1000).collect::<Vec<_>>());
        assert!(first.values::<u32>(2).is_empty() && first.values::<u32>(3).is_empty());
        assert_eq!(second.values::<u32>(0), [0, 1, 2, 3, 4]);
        drop((first, second));
        assert_eq!(kept(), 2);
        let again = device.read(&[(&many, 4000)]).expect("read");
        assert_eq!((kept(), again.values::<u32>(0)[999]), (1, 999));
        drop(again);
        // A tiny copy does not hold on to a huge buffer, and the buffer unused for longest goes first.
        let large = device.storage("much", 100 << 20).expect("fits");
        drop(device.read(&[(&large, 96 << 20)]).expect("read"));
        assert_eq!(device.read(&[(&few, 4)]).expect("read").staging.size(), 20);
        drop([device.read(&[(&large, 97 << 20)]).expect("read"), device.read(&[(&large, 98 << 20)]).expect("read")]);
        let sizes: Vec<u64> = device.staging().0.lock().expect("free").iter().map(wgpu::Buffer::size).collect();
        assert!(
            sizes.contains(&(97 << 20)) && sizes.contains(&(98 << 20)) && !sizes.contains(&(96 << 20)),
            "{sizes:?}"
        );
        let sizes: u64 = sizes.iter().sum();
        assert!(sizes <= KEPT_BYTES, "{sizes}");
    }

    #[test]
    fn threads_that_read_at_once_all_get_their_own() {
        let Ok(device) = Device::new() else { return };
        std::thread::scope(|scope| {
            for t in 0..4_u32 {
                let device = &device;
                scope.spawn(move || {
                    let values: Vec<u32> = (0..500).map(|i| i * 7 + t).collect();
                    let buffer = device.storage_with("numbers", bytemuck::cast_slice(&values)).expect("fits");
                    for _ in 0..50 {
                        assert_eq!(device.read(&[(&buffer, 2000)]).expect("read").values::<u32>(0), values);
                    }
                });
            }
        });
    }
}
