//! The machine that a report was measured on: times of different machines do not compare.

use serde::{Deserialize, Serialize};

use crate::io::memory;
use crate::render::real_gpu;

/// The machine that was measured on.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Computer {
    /// Name of the processor.
    pub processor: String,
    /// Number of cores that this program may use.
    pub cores: usize,
    /// Memory in bytes.
    pub memory_bytes: u64,
    /// The graphics adapter, if there is a real one.
    pub gpu: Option<String>,
    /// Operating system.
    pub system: String,
    /// "optimized" or "for development".
    pub build: String,
}

impl Computer {
    pub(crate) fn words(&self) -> String {
        let gpu = self.gpu.as_deref().unwrap_or("no GPU");
        let memory = self.memory_bytes as f64 / 1e9;
        format!(
            "{}, {} cores, {memory:.0} GB, {gpu}, {}, built {}",
            self.processor, self.cores, self.system, self.build
        )
    }
}

/// Returns the machine that this program runs on.
pub(crate) fn look() -> Computer {
    let (mut processor, mut memory_bytes) = (String::new(), 0);
    if let Ok(mut system) = sysinfo::System::new() {
        system.refresh_cpu_all();
        system.refresh_memory();
        processor = system.cpus().first().map_or("", |c| c.brand()).trim().to_owned();
        memory_bytes = system.total_memory();
    }
    Computer {
        processor: if processor.is_empty() { "unknown".into() } else { processor },
        cores: memory::cores(),
        memory_bytes,
        gpu: real_gpu(),
        system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        build: if cfg!(debug_assertions) { "for development" } else { "optimized" }.into(),
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_machine_has_cores_and_memory() {
        let here = super::look();
        assert!(here.cores > 0 && here.memory_bytes > 1 << 20, "{here:?}");
        assert!(here.words().contains("cores"));
    }
}
