//! Assertions of `debug-validation` on the renderer's stages: finite numbers, indices in range, depths in order.

use std::sync::atomic::Ordering::Relaxed;

use super::bin::Tiles;
use super::chunk::Chunk;
use super::project::Splat;
use super::sort;
use crate::math::Real;
use crate::math::finite::{NotFinite, all_finite};
use crate::render::Frame;
use crate::scene::{CloudError, GaussianCloud};

fn splats<R: Real>(stage: &'static str, splats: &[Splat<R>], values: &[R]) -> Result<(), NotFinite> {
    let each = |field, of: fn(&Splat<R>) -> [R; 3]| {
        let bad = splats.iter().position(|s| of(s).iter().any(|v| !v.is_finite()));
        bad.map_or(Ok(()), |i| Err(NotFinite { stage, field, index: splats[i].gaussian as usize }))
    };
    each("the center and depth of Gaussian", |s| [s.mean[0], s.mean[1], s.depth])?;
    each("the conic of Gaussian", |s| s.conic)?;
    each("the opacity and reach of Gaussian", |s| [s.opacity, s.reach, s.half[0] + s.half[1]])?;
    all_finite(stage, "value", values)
}

/// After the projection. Like all of this module, it names the first number that is not finite.
pub(crate) fn projected<R: Real>(parts: &[Chunk<R>]) -> Result<(), NotFinite> {
    parts.iter().try_for_each(|p| splats("projection", &p.splats, &p.values))
}

/// After binning: every entry names a splat, and lists follow on each other.
pub(crate) fn binned<R>(tiles: &Tiles, parts: &[Chunk<R>]) -> Result<(), NotFinite> {
    let broken = |field, index| Err(NotFinite { stage: "binning", field, index });
    let is_there = |k: usize| {
        let (part, i) = sort::part_of(tiles.splat(k));
        parts.get(part).is_some_and(|p| i < p.splats.len())
    };
    if let Some(i) = (0..tiles.entries.len()).position(|k| !is_there(k)) {
        return broken("the splat of entry", i);
    }
    let fall = tiles.first.windows(2).position(|w| w[1] < w[0]);
    fall.map_or(Ok(()), |i| broken("the end of tile", i))
}

/// After sorting: no entry of a tile comes before one that it is to follow.
pub(crate) fn sorted(tiles: &Tiles) -> Result<(), NotFinite> {
    let list = |ends: &[u32]| &tiles.entries[ends[0] as usize..ends[1] as usize];
    let falls = |ends: &[u32]| list(ends).windows(2).any(|w| w[1].load(Relaxed) < w[0].load(Relaxed));
    let fall = tiles.first.windows(2).position(falls);
    fall.map_or(Ok(()), |index| Err(NotFinite { stage: "sorting", field: "the order in tile", index }))
}

pub(crate) fn drawn<R: Real>(frame: &Frame<R>) -> Result<(), NotFinite> {
    let plane = |field, plane: &[R]| all_finite("blending", field, plane);
    frame.color.iter().try_for_each(|p| plane("the color of pixel", p))?;
    frame.features.iter().try_for_each(|p| plane("a feature of pixel", p))?;
    plane("alpha of pixel", &frame.alpha)?;
    plane("depth of pixel", &frame.depth)?;
    plane("median depth of pixel", &frame.median_depth)?;
    plane("distortion of pixel", &frame.distortion)?;
    frame.normals.iter().try_for_each(|p| plane("the normal of pixel", p))
}

/// After a stage that changes a cloud or something laid out like one.
pub(crate) fn cloud<R: Real>(stage: &'static str, cloud: &GaussianCloud<R>) -> Result<(), NotFinite> {
    cloud.validate().map_err(|e| match e {
        CloudError::NotFinite { index, field } => NotFinite { stage, field, index },
        CloudError::Length(field, index, _) => NotFinite { stage, field, index },
        CloudError::NoneFinite { field, .. } => NotFinite { stage, field, index: 0 },
        CloudError::Degree(degree) => NotFinite { stage, field: "degree", index: usize::from(degree) },
    })
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};

    use super::*;
    use crate::math::finite::CHECKED;
    use crate::render::cpu::CpuRenderer;
    use crate::render::{Features, FrameGradient, RenderError, RenderSettings};
    use crate::scene::Camera;

    fn splat(depth: f64) -> Splat<f64> {
        Splat { conic: [1.0, 0.0, 1.0], opacity: 0.5, reach: 2.0, half: [3.0; 2], depth, ..Splat::default() }
    }

    #[test]
    fn a_poisoned_splat_is_named_by_its_gaussian() {
        let part = |conic| Chunk {
            splats: vec![splat(1.0), Splat { conic, gaussian: 7, ..splat(2.0) }],
            values: vec![0.5; 6],
            degenerate: 0,
        };
        assert_eq!(projected(&[part([1.0, 0.0, 1.0])]), Ok(()));
        let found = projected(&[part([1.0, f64::NAN, 1.0])]);
        let named = NotFinite { stage: "projection", field: "the conic of Gaussian", index: 7 };
        assert_eq!(found, Err(named));
    }

    #[test]
    fn poisoned_stages_of_a_renderer_are_named_under_the_feature() {
        let cloud = GaussianCloud::<f32> {
            sh: vec![[0.5; 3]],
            ..GaussianCloud::<f32>::isotropic(vec![[0.0, 0.0, 3.0]], -1.0, 2.0)
        };
        let camera = Camera::of_pose(DVec3::ZERO, DMat3::IDENTITY, 0.8, 20, 20);
        let stage = |value: f32, background: f32| {
            let settings = RenderSettings { background: [background; 3], ..RenderSettings::default() };
            let features = Features { channels: 1, values: &[value] };
            match CpuRenderer::new().render(&cloud, features, &camera, &settings) {
                Ok(_) => None,
                Err(RenderError::NotFinite(e)) => Some(e.stage),
                Err(e) => panic!("{e}"),
            }
        };
        assert_eq!(stage(0.5, 0.5), None);
        assert_eq!(stage(f32::NAN, 0.5), CHECKED.then_some("projection"));
        assert_eq!(stage(0.5, f32::INFINITY), CHECKED.then_some("blending"));
        let mut renderer = CpuRenderer::new();
        let backward = |renderer: &mut CpuRenderer<f32>, value: f32| {
            let gradient = FrameGradient { color: [vec![value; 400], vec![], vec![]], ..FrameGradient::default() };
            renderer.backward_tiles(&gradient);
            renderer.check_backward().map_err(|e| e.stage)
        };
        renderer.render(&cloud, Features::NONE, &camera, &RenderSettings::default()).expect("drawn");
        assert_eq!(backward(&mut renderer, 1.0), Ok(()));
        assert_eq!(backward(&mut renderer, f32::NAN), Err("blending backward"));
    }

    #[test]
    fn wrong_orders_and_lists_are_seen() {
        let tiles = |depths: [f32; 2], places: [u32; 2]| {
            let key = |k: usize| sort::key(depths[k].to_bits(), places[k]).into();
            Tiles { first: vec![0, 2], entries: vec![key(0), key(1)], ..Tiles::default() }
        };
        assert_eq!(sorted(&tiles([1.0, 2.0], [7, 3])), Ok(()));
        assert_eq!(sorted(&tiles([1.0, 1.0], [3, 7])), Ok(()), "equal depths as in the cloud");
        assert!(sorted(&tiles([2.0, 1.0], [3, 7])).is_err() && sorted(&tiles([1.0, 1.0], [7, 3])).is_err());
        let two = [Chunk { splats: vec![splat(1.0), splat(2.0)], values: vec![0.5; 6], degenerate: 0 }];
        assert_eq!(binned(&tiles([1.0, 2.0], [0, 1]), &two), Ok(()));
        let broken = Err(NotFinite { stage: "binning", field: "the splat of entry", index: 1 });
        assert_eq!(binned(&tiles([1.0, 2.0], [0, 2]), &two), broken);
    }

    #[test]
    fn poisoned_pictures_and_clouds_are_seen() {
        let mut frame = Frame { alpha: vec![0.0, 1.0], ..Frame::default() };
        assert_eq!(drawn(&frame), Ok(()));
        frame.alpha[1] = f64::INFINITY;
        assert_eq!(drawn(&frame), Err(NotFinite { stage: "blending", field: "alpha of pixel", index: 1 }));
        let mut gaussians = GaussianCloud::<f64>::isotropic(vec![[0.0; 3]], 0.0, 0.0);
        assert_eq!(cloud("Adam", &gaussians), Ok(()));
        gaussians.opacity_logits[0] = f64::NAN;
        assert_eq!(cloud("Adam", &gaussians), Err(NotFinite { stage: "Adam", field: "opacity", index: 0 }));
    }
}
