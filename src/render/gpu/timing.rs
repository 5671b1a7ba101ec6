//! Times of the stages of a frame or step, from timestamps that the device writes itself.

use super::{Device, GpuError};

/// Stages that one timer holds.
const STAGES: u32 = 32;

/// Seconds of each stage, in order.
pub(crate) type StageTimes = Vec<(&'static str, f64)>;

/// Timestamps around the stages of one submission.
#[derive(Debug)]
pub(crate) struct Timer {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    names: Vec<&'static str>,
    secs_per_tick: f64,
}

impl Timer {
    /// A timer, or `None` on a device without timestamps.
    pub(crate) fn new(device: &Device) -> Result<Option<Self>, GpuError> {
        if !device.has_timestamps() {
            return Ok(None);
        }
        let queries = device.scoped("timestamps", 0, || {
            device.wgpu().create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("stage times"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * STAGES,
            })
        })?;
        let usage = wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC;
        let resolved = device.buffer("stage times", u64::from(2 * STAGES) * 8, usage)?;
        let secs_per_tick = f64::from(device.queue().get_timestamp_period()) * 1e-9;
        Ok(Some(Self { queries, resolved, names: Vec::new(), secs_per_tick }))
    }

    /// Timestamps for the start and end of the next pass; `None` past the last slot.
    pub(super) fn stage(&mut self, name: &'static str) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        let at = 2 * self.names.len() as u32;
        if at >= 2 * STAGES {
            return None;
        }
        self.names.push(name);
        Some(wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(at),
            end_of_pass_write_index: Some(at + 1),
        })
    }

    pub(super) fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        if !self.names.is_empty() {
            encoder.resolve_query_set(&self.queries, 0..2 * self.names.len() as u32, &self.resolved, 0);
        }
    }

    /// Waits for the submission and returns its times; passes of one name are added up. The timer
    /// is then ready for the next submission.
    pub(crate) fn finish(&mut self, device: &Device) -> Result<StageTimes, GpuError> {
        let names = std::mem::take(&mut self.names);
        let ticks: Vec<u64> = device.read(&[(&self.resolved, names.len() as u64 * 16)])?.values(0);
        let mut out: StageTimes = Vec::new();
        for (name, span) in names.into_iter().zip(ticks.chunks_exact(2)) {
            let secs = span[1].saturating_sub(span[0]) as f64 * self.secs_per_tick;
            match out.iter_mut().find(|(n, _)| *n == name) {
                Some((_, sum)) => *sum += secs,
                None => out.push((name, secs)),
            }
        }
        Ok(out)
    }
}
