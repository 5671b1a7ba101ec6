//! Renderers for work on several views at once. What one view does on a single thread (its photo, its merged sums) goes
//! on beside the drawing of others.

use rayon::prelude::*;

use super::error::FindError;
use crate::render::Renderer;

/// Most views at once.
const MOST: usize = 8;
/// Working memory of a renderer: 44 bytes of a splat, up to 16 of its values, and 8 of each of some three tile entries,
/// for each Gaussian; and the most for all of them.
const GAUSSIAN_BYTES: usize = 84;
const MOST_BYTES: usize = 512 << 20;

/// Renderers on the CPU, one for each view at once.
pub(crate) struct Renderers(Vec<Renderer>);

impl Renderers {
    /// Renderers for a cloud of so many Gaussians: two for each thread, within the limits.
    pub(crate) fn new(gaussians: usize) -> Self {
        let fit = MOST_BYTES / (GAUSSIAN_BYTES * gaussians.max(1));
        let count = (2 * rayon::current_num_threads()).min(MOST).min(fit).max(1);
        Self((0..count).map(|_| Renderer::new()).collect())
    }

    /// One of them, for a view by itself.
    pub(crate) fn one(&mut self) -> &mut Renderer {
        &mut self.0[0]
    }

    /// Does the `work` on all items, and hands on the results in the order of the items. Of several errors, the first
    /// counts.
    pub(crate) fn each<T: Sync, U: Send>(
        &mut self,
        items: &[T],
        work: impl Fn(&mut Renderer, &T) -> Result<U, FindError> + Sync,
        mut then: impl FnMut(&T, U) -> Result<(), FindError>,
    ) -> Result<(), FindError> {
        for some in items.chunks(self.0.len()) {
            let pairs = self.0.par_iter_mut().zip(some).with_max_len(1);
            let done: Vec<Result<U, FindError>> = pairs.map(|(renderer, item)| work(renderer, item)).collect();
            for (item, result) in some.iter().zip(done) {
                then(item, result?)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::observer::Interrupted;

    #[test]
    fn results_come_in_order_and_the_first_error_ends_the_work() {
        let items: Vec<usize> = (0..23).collect();
        for gaussians in [0, 1_000, usize::MAX / (2 * GAUSSIAN_BYTES)] {
            let mut renderers = Renderers::new(gaussians);
            assert!((1..=MOST).contains(&renderers.0.len()));
            assert!(gaussians < 1 << 40 || renderers.0.len() == 1, "no more than fit");
            let mut found = Vec::new();
            let square = |_: &mut Renderer, i: &usize| Ok(i * i);
            let mut keep = |i: &usize, square: usize| {
                found.push((*i, square));
                Ok(())
            };
            renderers.each(&items, square, &mut keep).expect("done");
            assert_eq!(found, items.iter().map(|i| (*i, i * i)).collect::<Vec<_>>());
            let (name, mut last) = (|i: &usize| FindError::NoSeed(i.to_string()), None);
            let fails = |_: &mut Renderer, i: &usize| if *i >= 5 { Err(name(i)) } else { Ok(*i) };
            let failed = renderers.each(&items, fails, |i, _| {
                last = Some(*i);
                Ok(())
            });
            assert!(matches!(failed, Err(FindError::NoSeed(i)) if i == "5"));
            assert_eq!(last, Some(4), "those before it were handed on");
            let stopped = renderers.each(&items, square, |_, _| Err(FindError::Interrupted(Interrupted)));
            assert!(matches!(stopped, Err(FindError::Interrupted(_))));
        }
    }
}
