//! Something to show while there is no tree yet: some Gaussians for all, each as much larger as it stands for more.

use super::{LodTree, Node};
use crate::math::Real;
use crate::scene::GaussianCloud;

impl<R: Real> LodTree<R> {
    /// About `most` Gaussians of a cloud, evenly by their numbers. They cover as much as all of them do.
    pub(crate) fn sample(cloud: &GaussianCloud<R>, most: usize) -> Self {
        let each = cloud.len().div_ceil(most.max(1)).max(1);
        let chosen: Vec<usize> = (0..cloud.len()).step_by(each).collect();
        let mut merged = GaussianCloud { extras: Vec::new(), ..cloud.select(&chosen) };
        let larger = R::of(0.5 * (each as f64).ln());
        merged.log_scales.iter_mut().flatten().for_each(|s| *s += larger);
        let node = |(k, heaviest): (usize, &usize)| {
            let widest = merged.log_scales[k].iter().fold(f64::MIN, |m, s| m.max(s.f64())).exp();
            let reach = (4.0 * widest).min(f64::from(f32::MAX)) as f32;
            // Of no size: there is nothing finer beneath it.
            Node { size: 0.0, reach, first: 0, count: 0, heaviest: *heaviest as u32 }
        };
        let nodes: Vec<Node> = chosen.iter().enumerate().map(node).collect();
        let roots = (0..nodes.len()).map(|k| (cloud.len() + k) as u32).collect();
        Self { leaves: cloud.len(), merged, nodes, children: Vec::new(), roots }
    }
}
