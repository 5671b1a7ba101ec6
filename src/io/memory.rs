//! Memory that the program may still take, and its number of cores; every plan by memory asks here.

use std::sync::OnceLock;

use sysinfo::{MemoryRefreshKind, ProcessRefreshKind, ProcessesToUpdate, System};

use crate::math::format;

/// Free memory assumed if the system does not report it; any machine can spare that much.
const UNKNOWN: u64 = 2 << 30;

/// Number of cores that the program may use; 1 if the system does not say.
pub(crate) fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}

/// Bytes that one reader may use: half of the memory that is free when the program first asks.
pub(crate) fn budget() -> u64 {
    static BUDGET: OnceLock<u64> = OnceLock::new();
    *BUDGET.get_or_init(|| free() / 2)
}

/// Bytes that the program may still take: the free memory of the machine, and no more than the limits of
/// its control group (a container's) and of the process itself (`ulimit -v`, `ulimit -d`) allow.
pub(crate) fn free() -> u64 {
    let Ok(mut system) = System::new() else { return UNKNOWN };
    system.refresh_memory_specifics(MemoryRefreshKind::nothing().with_ram());
    match system.available_memory() {
        0 => UNKNOWN,
        machine => machine.min(of_group(&mut system)).min(of_process()),
    }
}

/// An operation that does not fit into the free memory.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what} takes about {} of memory, and {} are free; {remedy}", format::bytes(*bytes), format::bytes(*free))]
pub struct NoRoom {
    what: String,
    bytes: u64,
    free: u64,
    remedy: &'static str,
}

/// Checks that `what`, which takes about `bytes`, fits into memory. To be called before it is begun.
pub(crate) fn room(what: impl Into<String>, bytes: u64, remedy: &'static str) -> Result<(), NoRoom> {
    let free = free();
    if bytes <= free { Ok(()) } else { Err(NoRoom { what: what.into(), bytes, free, remedy }) }
}

/// Bytes left to the control group. The file cache does not count: the system frees it on demand.
fn of_group(system: &mut System) -> u64 {
    let Ok(own) = sysinfo::get_current_pid() else { return u64::MAX };
    system.refresh_processes_specifics(ProcessesToUpdate::Some(&[own]), false, ProcessRefreshKind::nothing());
    let limits = system.process(own).and_then(sysinfo::Process::cgroup_limits);
    limits.map_or(u64::MAX, |l| l.total_memory.saturating_sub(l.rss))
}

/// Bytes left under the limits of the process, if `/proc` reports them.
fn of_process() -> u64 {
    let text = |name: &str| std::fs::read_to_string(format!("/proc/self/{name}")).unwrap_or_default();
    within(&text("limits"), &text("status"))
}

/// Bytes left by the limits in `/proc/self/limits` and the use in `/proc/self/status`.
fn within(limits: &str, status: &str) -> u64 {
    let number = |text: &str, line: &str| -> Option<u64> {
        text.lines().find_map(|l| l.strip_prefix(line))?.split_whitespace().next()?.parse().ok()
    };
    let left = |(limit, used)| {
        let limit: u64 = number(limits, limit)?;
        Some(limit.saturating_sub(1024 * number(status, used).unwrap_or(0)))
    };
    [("Max address space", "VmSize:"), ("Max data size", "VmData:")]
        .into_iter()
        .filter_map(left)
        .min()
        .unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_on_the_process_count() {
        let limits = |data: &str, space: &str| {
            format!(
                "Limit  Soft Limit  Hard Limit  Units\nMax data size  {data}  unlimited  bytes\nMax address space  {space}  unlimited  bytes\n"
            )
        };
        let status = "VmPeak:\t 9000 kB\nVmSize:\t  2000 kB\nVmData:\t  1000 kB\n";
        assert_eq!(within(&limits("unlimited", "unlimited"), status), u64::MAX);
        assert_eq!(within(&limits("unlimited", "4096000"), status), 2_048_000);
        assert_eq!(within(&limits("3072000", "4096000"), status), 2_048_000);
        assert_eq!(within(&limits("1024000", "4096000"), status), 0);
        assert_eq!(within("", ""), u64::MAX);
    }

    #[test]
    fn what_does_not_fit_is_refused_with_its_size() {
        assert_eq!(room("a thumbnail", 1000, ""), Ok(()));
        let e = room("a wall", u64::MAX, "make it smaller").expect_err("no machine has that").to_string();
        assert!(e.starts_with("a wall takes about 18,446,744 TB") && e.ends_with("make it smaller"), "{e}");
    }

    #[test]
    fn something_is_free_and_half_of_it_is_a_readers() {
        assert!(free() > 0 && budget() <= UNKNOWN.max(free().saturating_mul(2)));
    }
}
