//! Budget of Gaussians for the memory of this machine.

use crate::io::memory;

/// Bytes per trained Gaussian: parameters, two moments, a snapshot and a copy to roll back to (59 floats each), its
/// statistics, and the renderer's records of about four tiles.
pub(crate) const BYTES_PER_GAUSSIAN: u64 = 59 * 4 * 5 + 12 + 64 + 4 * 60;

/// Share of the free memory that the Gaussians may take.
const SHARE: f64 = 0.4;

/// Number of Gaussians up to which one per pixel is allowed: small pictures may show a large scene.
const CHEAP: usize = 100_000;

/// Largest useful number of Gaussians: one for each pixel of a training picture up to [`CHEAP`], one for two pixels
/// beyond that, at least 1.5 times the initial number `start`, at most as many as fit into memory
/// (docs/notes/density-control.md).
pub(crate) fn worthwhile(pixels: usize, start: usize) -> usize {
    pixels.min(CHEAP).max(pixels / 2).max(start + start / 2).min(gaussians())
}

/// Most Gaussians that fit into memory, between ten thousand and ten million.
pub(crate) fn gaussians() -> usize {
    fitting(memory::free())
}

fn fitting(bytes: u64) -> usize {
    ((bytes as f64 * SHARE) as u64 / BYTES_PER_GAUSSIAN).clamp(10_000, 10_000_000) as usize
}

#[cfg(test)]
mod tests {
    #[test]
    fn budget_follows_memory() {
        assert!(super::fitting(1 << 30) > 200_000);
        assert!(super::fitting(1 << 30) < super::fitting(2 << 30));
        assert_eq!(super::fitting(0), 10_000);
        assert_eq!(super::worthwhile(60_000, 20_000), 60_000);
        assert_eq!(super::worthwhile(150_000, 20_000), 100_000);
        assert_eq!(super::worthwhile(500_000, 20_000), 250_000);
        assert_eq!(super::worthwhile(5_000, 8_000), 12_000);
    }
}
