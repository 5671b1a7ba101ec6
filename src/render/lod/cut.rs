//! Cuts through the tree: for every part of the scene in view, the coarsest node that looks no coarser than allowed.

use std::sync::Arc;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::{Cut, LodTree};
use crate::math::Real;
use crate::scene::Camera;

/// Standard deviation in px under which nothing is gained by drawing finer Gaussians: the low-pass filter's is larger.
pub(super) const FINEST_PX: f64 = 0.2;
/// Nothing is drawn coarser than this, however many Gaussians that takes.
const COARSEST_PX: f64 = 64.0;
/// A cut that reaches this share of its budget is fine enough.
const FULL: f64 = 0.85;
/// Cuts until one fits its budget, at most: views that follow one another need one or two.
const TRIES: usize = 5;
/// Nodes from which on a cut is made by several threads.
const SEVERAL: usize = 64;
/// Margin outside the picture in which the low-pass filter lets a Gaussian be seen, px.
const FILTER_PX: f64 = 2.0;

/// A camera as cuts need it, relative to a cloud's origin.
struct Eye {
    camera_from_world: DMat3,
    /// The cloud's origin from the camera.
    offset: DVec3,
    near: f64,
    focal_px: f64,
    /// Normals of the four sides of the view frustum, inwards.
    sides: [DVec3; 4],
    grain_px: f64,
}

impl Eye {
    fn new(camera: &Camera, origin: DVec3, near: f64, grain_px: f64) -> Self {
        let [w, h] = [f64::from(camera.width_px), f64::from(camera.height_px)];
        let (focal, middle) = (camera.focal_px, camera.principal_px);
        let side = |axis: DVec3, from_middle: f64, focal: f64| {
            (axis * focal + DVec3::Z * (from_middle + FILTER_PX)).normalize_or_zero()
        };
        Self {
            camera_from_world: camera.world_from_camera.transpose(),
            offset: origin - camera.center,
            near,
            focal_px: focal.max_element(),
            sides: [
                side(DVec3::X, middle.x, focal.x),
                side(DVec3::NEG_X, w - middle.x, focal.x),
                side(DVec3::Y, middle.y, focal.y),
                side(DVec3::NEG_Y, h - middle.y, focal.y),
            ],
            grain_px,
        }
    }
}

/// Visibility of a node in a view.
enum Seen {
    Outside,
    /// It is fine enough.
    Fine,
    /// Its children are drawn instead.
    Coarse,
}

impl<R: Real> LodTree<R> {
    fn see(&self, node: usize, eye: &Eye) -> Seen {
        let relative = DVec3::from_array(self.merged.positions[node].map(Real::f64)) + eye.offset;
        let local = eye.camera_from_world * relative;
        let (size, reach) = (f64::from(self.nodes[node].size), f64::from(self.nodes[node].reach));
        if local.z + reach < eye.near || eye.sides.iter().any(|side| side.dot(local) + reach < 0.0) {
            return Seen::Outside;
        }
        // A node that reaches behind the camera is never drawn as one.
        match size * eye.focal_px <= eye.grain_px * (local.z - size).max(eye.near) {
            true => Seen::Fine,
            false => Seen::Coarse,
        }
    }

    /// Puts `number` onto `list` if it is drawn, or its children onto `open`.
    fn visit(&self, number: u32, eye: &Eye, open: &mut Vec<u32>, list: &mut Vec<u32>) {
        let Some(node) = (number as usize).checked_sub(self.leaves) else { return list.push(number) };
        match self.see(node, eye) {
            Seen::Outside => {}
            Seen::Fine => list.push(number),
            Seen::Coarse => open.extend(self.children(&self.nodes[node]).iter().rev()),
        }
    }

    /// Gaussians and nodes in the picture, none of which looks coarser than the eye's grain.
    fn list(&self, eye: &Eye) -> Vec<u32> {
        let (mut list, mut open) = (Vec::new(), self.roots.clone());
        while open.len() < SEVERAL {
            let before = std::mem::take(&mut open);
            before.into_iter().for_each(|number| self.visit(number, eye, &mut open, &mut list));
            if open.is_empty() {
                return list;
            }
        }
        let beneath = |number: &u32| {
            let (mut list, mut open) = (Vec::new(), vec![*number]);
            while let Some(number) = open.pop() {
                self.visit(number, eye, &mut open, &mut list);
            }
            list
        };
        let lists: Vec<Vec<u32>> = open.par_iter().map(beneath).collect();
        lists.iter().for_each(|more| list.extend(more));
        list
    }
}

impl<R: Real> Cut<R> {
    /// A cut for a view that no node looks coarser in than `grain_px`, its standard deviation in px.
    pub(crate) fn of_grain(tree: &Arc<LodTree<R>>, camera: &Camera, near: f64, grain_px: f64) -> Self {
        let eye = Eye::new(camera, tree.merged.origin, near, grain_px);
        Self { tree: Arc::clone(tree), list: tree.list(&eye) }
    }

    /// The finest cut for a view of about `most` Gaussians, or the finest of any use. `grain_px` is the start of the
    /// search, and then its result.
    pub(crate) fn of_budget(
        tree: &Arc<LodTree<R>>,
        camera: &Camera,
        near: f64,
        most: usize,
        grain_px: &mut f64,
    ) -> Self {
        let mut cut = Self::of_grain(tree, camera, near, *grain_px);
        for _ in 1..TRIES {
            let filled = cut.len() as f64 / most.max(1) as f64;
            if filled <= 1.0 && (filled >= FULL || *grain_px <= FINEST_PX) || *grain_px >= COARSEST_PX {
                break;
            }
            // Of a surface, a quarter as many Gaussians are needed at twice the grain.
            let wanted = *grain_px * (filled / (0.5 + 0.5 * FULL)).sqrt().clamp(0.25, 4.0);
            *grain_px = wanted.clamp(FINEST_PX, COARSEST_PX);
            cut = Self::of_grain(tree, camera, near, *grain_px);
        }
        cut
    }
}
