//! Levels of detail of the Gaussians on screen, built in the background once these are seen to stay.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock, Weak};
use std::time::{Duration, Instant};

use super::{Versioned, low_priority_pool};
use crate::render::lod::{self, LodTree, Pace};
use crate::scene::GaussianCloud;
use crate::scene::resource_log::{self, ResourceKind};

/// Gaussians that are looked at for so long are no step of a training.
pub(super) const STAY: Duration = Duration::from_secs(2);
/// Number of Gaussians from which a picture of all is too slow as the first one, and for moving until there is a tree.
const ROUGH_FROM: usize = 1_000_000;
/// Gaussians of a rough picture.
const ROUGH: usize = 150_000;

type Tree = Arc<LodTree>;

/// Levels of detail of the Gaussians that are drawn, which may change at any time.
#[derive(Default)]
pub(super) struct DetailLevels {
    /// Number of Gaussians that can be drawn in time.
    pub(super) pace: Pace,
    now: Option<Seen>,
}

/// Gaussians that are being looked at.
struct Seen {
    generation: u64,
    since: Instant,
    cloud: Weak<GaussianCloud>,
    tree: Arc<OnceLock<Tree>>,
    /// Some of them, until there is a tree.
    rough: Option<Tree>,
    begun: bool,
    stop: Arc<AtomicBool>,
}

impl Drop for Seen {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

impl DetailLevels {
    /// Tracks these Gaussians; returns whether they are so many and so new that a rough picture comes first.
    pub(super) fn see(&mut self, cloud: &Versioned<GaussianCloud>) -> bool {
        if self.now.as_ref().is_some_and(|now| now.generation == cloud.generation()) {
            self.build();
            return false;
        }
        self.now = Some(Seen {
            generation: cloud.generation(),
            since: Instant::now(),
            cloud: Arc::downgrade(cloud),
            tree: Arc::default(),
            rough: None,
            begun: false,
            stop: Arc::default(),
        });
        cloud.len() >= ROUGH_FROM
    }

    /// Looks at nothing any more.
    pub(super) fn forget(&mut self) {
        self.now = None;
    }

    /// The tree of the Gaussians that were seen last, if it is built. Until then a rough one of very many, if `rough`.
    pub(super) fn tree(&mut self, rough: bool) -> Option<Tree> {
        let now = self.now.as_mut()?;
        if let Some(tree) = now.tree.get() {
            now.rough = None;
            return Some(Arc::clone(tree));
        }
        if rough && now.rough.is_none() {
            let cloud = now.cloud.upgrade().filter(|cloud| cloud.len() >= ROUGH_FROM);
            now.rough = cloud.map(|cloud| Arc::new(LodTree::sample(&cloud, ROUGH)));
        }
        now.rough.clone().filter(|_| rough)
    }

    /// Begins to build the tree, if the Gaussians have stayed.
    pub(super) fn build(&mut self) {
        let Some(now) = self.now.as_mut().filter(|now| !now.begun && now.since.elapsed() >= STAY) else { return };
        let Some(cloud) = now.cloud.upgrade() else { return };
        now.begun = true;
        let (tree, stop) = (Arc::clone(&now.tree), Arc::clone(&now.stop));
        let work = move || {
            let proceed = || !stop.load(Ordering::Relaxed);
            let build = || lod::build(&cloud, proceed);
            let built = low_priority_pool::pool().map_or_else(build, |pool| pool.install(build));
            if let Some(built) = built {
                let what = format!("levels of detail of {}", crate::math::format::things(cloud.len(), "Gaussian"));
                resource_log::record(ResourceKind::Levels, what, "they are too many to draw in time", built.bytes());
                // No other code sets it.
                let _ = tree.set(Arc::new(built));
            }
        };
        // Without a thread there are no levels, and all is drawn.
        let _ = std::thread::Builder::new().name("levels of detail".into()).spawn(work);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(n: usize) -> Versioned<GaussianCloud> {
        let positions = (0..n).map(|i| [(i % 97) as f32, (i % 89) as f32, (i % 83) as f32]).collect();
        Versioned::new(Arc::new(GaussianCloud::isotropic(positions, -2.0, 1.0)))
    }

    #[test]
    fn a_tree_is_built_of_what_stays_and_of_nothing_else() {
        let (mut levels, first) = (DetailLevels::default(), cloud(2_000));
        assert!(!levels.see(&first), "few enough to be drawn at once");
        levels.see(&first);
        assert!(levels.tree(true).is_none() && !levels.now.as_ref().is_some_and(|n| n.begun), "not yet");
        levels.now.as_mut().expect("seen").since -= STAY;
        levels.see(&first);
        let start = Instant::now();
        while levels.tree(true).is_none() {
            assert!(start.elapsed() < Duration::from_secs(60));
            std::thread::sleep(Duration::from_millis(2));
        }
        levels.see(&cloud(2_000));
        assert!(levels.tree(true).is_none(), "others have none yet");
    }

    #[test]
    fn many_are_shown_roughly_at_first() {
        let (mut levels, many) = (DetailLevels::default(), cloud(ROUGH_FROM));
        assert!(levels.see(&many));
        assert!(!levels.see(&many), "once");
        assert!(levels.tree(false).is_none(), "where it will not do");
        assert!(levels.tree(true).is_some_and(|tree| tree.nodes() <= ROUGH));
        levels.forget();
        assert!(levels.tree(true).is_none());
    }
}
