//! Tree of Gaussians that belong together.

use super::leaves::{borders, leaves};
use super::surface::{NEIGHBORS, SplatSurface};
use crate::pipeline::observer::Observer;
use crate::pipeline::semantics::lifting::error::FindError;
use crate::pipeline::semantics::lifting::nearest::nearest;
use crate::pipeline::semantics::lifting::regions::segment::unlike;
use crate::pipeline::semantics::lifting::regions::tree::{Piece, Tree, grow};
use crate::pipeline::semantics::lifting::renderers::Renderers;
use crate::render::RenderSettings;
use crate::scene::{Camera, GaussianCloud};

/// Gaussians as a tree, whose leaves are a few that look the same.
#[derive(Debug)]
pub(crate) struct Hierarchy {
    /// The leaf of each Gaussian.
    pub(super) leaf: Vec<u32>,
    pub(super) leaves: usize,
    pub(super) tree: Tree,
    /// Area of each Gaussian, square units.
    pub(super) area: Vec<f64>,
}

impl Hierarchy {
    /// Builds the tree of a cloud as seen by these cameras.
    pub(crate) fn new(
        cloud: &GaussianCloud,
        cameras: &[Camera],
        settings: &RenderSettings,
        observer: &mut dyn Observer,
    ) -> Result<Self, FindError> {
        let near = nearest(cloud, NEIGHBORS);
        let mut renderers = Renderers::new(cloud.len());
        Ok(Self::of(&SplatSurface::new(&mut renderers, cloud, &near, cameras, settings, observer)?))
    }

    /// Builds the tree of a surface.
    pub(crate) fn of(surface: &SplatSurface) -> Self {
        let (leaf, count) = leaves(surface);
        let mut pieces = vec![Piece { area: 0.0, sums: vec![0.0; 3] }; count];
        for (piece, leaf) in surface.pieces.iter().zip(&leaf) {
            let whole = &mut pieces[*leaf as usize];
            whole.area += piece.area;
            whole.sums.iter_mut().zip(&piece.sums).for_each(|(s, p)| *s += p);
        }
        let borders = borders(surface, &leaf);
        let unit = pieces.iter().map(|p| p.area).sum::<f64>() / 1000.0;
        let tree = grow(pieces, borders, &move |a, b, border| unlike(a, b, border, true, unit));
        Self { leaf, leaves: count, tree, area: surface.pieces.iter().map(|p| p.area).collect() }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use glam::DVec3;

    use super::*;
    use crate::pipeline::observer::testing::StopsAfter;
    use crate::pipeline::observer::{Interrupted, Silent};

    pub(in super::super) const W: usize = 128;
    pub(in super::super) const H: usize = 96;

    /// A sheet of gray Gaussians with a square of 12 x 12 in it, red on the left, blue on the right. Their labels are
    /// 0, 1 and 2.
    pub(in super::super) fn sheet() -> (GaussianCloud, Vec<usize>) {
        let n = 32;
        let of = |i: usize| match (i % n, i / n) {
            (x, y) if (10..16).contains(&x) && (10..22).contains(&y) => 1,
            (x, y) if (16..22).contains(&x) && (10..22).contains(&y) => 2,
            _ => 0,
        };
        let color = [[0.0; 3], [1.6, -1.6, -1.6], [-1.6, -1.2, 1.6]];
        let place = |i: usize| [(i % n) as f32 * 0.05 - 0.8, (i / n) as f32 * 0.05 - 0.8, 0.0];
        let whose: Vec<usize> = (0..n * n).map(of).collect();
        let cloud = GaussianCloud {
            sh: whose.iter().map(|w| color[*w]).collect(),
            log_scales: vec![[-3.7, -3.7, -5.0]; n * n],
            ..GaussianCloud::isotropic((0..n * n).map(place).collect(), -3.7, 4.0)
        };
        (cloud, whose)
    }

    pub(in super::super) fn cameras() -> Vec<Camera> {
        let from = |x: f64, y: f64| {
            Camera::look_at(DVec3::new(x, y, -2.2), DVec3::ZERO, DVec3::NEG_Y, 0.8, W as u32, H as u32).expect("valid")
        };
        vec![from(0.0, 0.0), from(0.5, 0.2), from(-0.4, -0.3)]
    }

    pub(in super::super) fn hierarchy(cloud: &GaussianCloud) -> Hierarchy {
        Hierarchy::new(cloud, &cameras(), &RenderSettings::default(), &mut Silent).expect("made")
    }

    #[test]
    fn a_tree_is_made_again_the_same_and_can_be_stopped() {
        let (cloud, _) = sheet();
        let [one, two] = [hierarchy(&cloud), hierarchy(&cloud)];
        assert_eq!((&one.leaf, one.tree.nodes.len()), (&two.leaf, two.tree.nodes.len()));
        assert!((64..cloud.len()).contains(&one.leaves), "{} leaves of at most 16", one.leaves);
        let settings = RenderSettings::default();
        let stopped = Hierarchy::new(&cloud, &cameras(), &settings, &mut StopsAfter::new(0)).expect_err("stopped");
        assert!(Interrupted::is_cause_of(&stopped), "{stopped}");
    }
}
