//! Properties that a tree and its cuts must keep: every Gaussian, the picture, and the labels; finite numbers for any
//! input.

use glam::DVec3;

use super::*;
use crate::math::lanes::Lane;
use crate::math::stats::psnr_of;
use crate::render::cpu::CpuRenderer;
use crate::render::{ContributionSink, Features, Frame, RenderSettings, TILE_PX};
use crate::scene::Camera;

/// Small Gaussians on a ball's surface, in bands of two colors; the band is their label.
fn ball(n: usize) -> (GaussianCloud, Vec<u32>) {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let point = |i: usize| {
        let y = 1.0 - 2.0 * (i as f64 + 0.5) / n as f64;
        let (r, angle) = ((1.0 - y * y).sqrt(), golden * i as f64);
        [(r * angle.cos()) as f32, y as f32, (r * angle.sin()) as f32]
    };
    let positions: Vec<[f32; 3]> = (0..n).map(point).collect();
    let band = |p: &[f32; 3]| u32::from((p[1] * 4.0 + p[0]).rem_euclid(2.0) < 1.0);
    let of: Vec<u32> = positions.iter().map(band).collect();
    let spacing = (4.0 * std::f32::consts::PI / n as f32).sqrt();
    let mut cloud = GaussianCloud::isotropic(positions, (0.7 * spacing).ln(), 2.0);
    cloud.sh = of.iter().map(|&b| if b == 1 { [1.2, -0.9, 0.1] } else { [-0.6, 0.8, 0.9] }).collect();
    (cloud, of)
}

fn camera(distance: f64) -> Camera {
    let eye = DVec3::new(0.3, -0.4, -1.0).normalize_or_zero() * distance;
    Camera::look_at(eye, DVec3::ZERO, DVec3::NEG_Y, 0.8, 160, 120).expect("valid")
}

fn draw(cloud: &GaussianCloud, camera: &Camera, cut: Option<Cut>) -> Frame<f32> {
    let mut renderer = CpuRenderer::new();
    renderer.limit_to(cut.map(Arc::new));
    renderer.render(cloud, Features::NONE, camera, &RenderSettings::default()).expect("drawn")
}

fn psnr(a: &Frame<f32>, b: &Frame<f32>) -> f64 {
    let pairs = a.color.iter().flatten().zip(b.color.iter().flatten());
    let squares: f64 = pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum();
    psnr_of(squares / (3 * a.alpha.len()) as f64)
}

/// Label of the Gaussian that gives each pixel most of its light.
fn owners(cloud: &GaussianCloud, of: &[u32], camera: &Camera, cut: Option<Cut>) -> Vec<u32> {
    struct Row<'a>(&'a [u32], Vec<[f32; 3]>, usize);
    impl ContributionSink<f32> for Row<'_> {
        fn add(&mut self, gaussian: u32, x: usize, y: usize, weights: &Lane<f32>) {
            for (k, weight) in weights.iter().enumerate().filter(|(_, w)| **w > 0.0) {
                self.1[(y % TILE_PX) * self.2 + x + k][self.0[gaussian as usize] as usize] += weight;
            }
        }
    }
    let (w, h) = (camera.width_px as usize, camera.height_px as usize);
    let mut rows: Vec<Row<'_>> =
        (0..h.div_ceil(TILE_PX)).map(|_| Row(of, vec![[0.0; 3]; (w + 8) * TILE_PX], w)).collect();
    let mut renderer = CpuRenderer::new();
    renderer.limit_to(cut.map(Arc::new));
    renderer.contributions(cloud, camera, &RenderSettings::default(), &mut rows).expect("drawn");
    let one = |s: &[f32; 3]| if s[0] + s[1] < 0.5 { 2 } else { u32::from(s[1] > s[0]) };
    rows.iter().flat_map(|row| row.1[..w * TILE_PX].iter().map(one)).collect()
}

fn tree(cloud: &GaussianCloud) -> Arc<LodTree> {
    Arc::new(build(cloud, || true).expect("nobody stops it"))
}

/// Gaussians beneath a number.
fn beneath(tree: &LodTree, number: u32) -> Vec<u32> {
    match (number as usize).checked_sub(tree.leaves) {
        None => vec![number],
        Some(node) => tree.children(&tree.nodes[node]).iter().flat_map(|&c| beneath(tree, c)).collect(),
    }
}

#[test]
fn every_gaussian_is_beneath_the_root_once() {
    for n in [0, 1, 2, 3, 5, 1_000, 20_000] {
        let (cloud, _) = ball(n);
        let tree = tree(&cloud);
        let mut all: Vec<u32> = tree.roots.iter().flat_map(|&root| beneath(&tree, root)).collect();
        all.sort_unstable();
        assert_eq!(all, (0..n as u32).collect::<Vec<_>>());
        assert!(tree.roots.len() <= 1 && tree.nodes() <= n / 3 + 1, "{} nodes of {n}", tree.nodes());
        tree.merged.validate().expect("finite");
    }
    assert!(build(&ball(100).0, || false).is_none(), "it stops when asked to");
}

#[test]
fn a_cut_shows_the_picture_with_fewer_gaussians() {
    let (cloud, _) = ball(60_000);
    let (tree, camera) = (tree(&cloud), camera(4.0));
    let full = draw(&cloud, &camera, None);
    let mut grain_px = 1.0;
    let cut = Cut::of_budget(&tree, &camera, 0.01, 12_000, &mut grain_px);
    assert!((6_000..=12_000).contains(&cut.len()), "{}", cut.len());
    let close = psnr(&full, &draw(&cloud, &camera, Some(cut.clone())));
    assert!(close >= 35.0, "{close}");
    // The controls: a coarse cut, and one whose nodes stand elsewhere.
    let coarse = psnr(&full, &draw(&cloud, &camera, Some(Cut::of_grain(&tree, &camera, 0.01, 8.0))));
    assert!(coarse < 30.0, "{coarse}");
    let last = (tree.leaves + tree.nodes()) as u32 - 1;
    let wrong = Cut { list: cut.list.iter().map(|k| (k + 1).min(last)).collect(), ..cut };
    assert!(psnr(&full, &draw(&cloud, &camera, Some(wrong))) < 35.0);
    // All of it, which is exact.
    let all = Cut { tree: Arc::clone(&tree), list: (0..cloud.len() as u32).collect() };
    assert_eq!(draw(&cloud, &camera, Some(all)), full);
}

#[test]
fn at_rest_nothing_is_left_of_a_cut() {
    let (cloud, _) = ball(20_000);
    let (tree, camera) = (tree(&cloud), camera(4.0));
    let mut renderer = CpuRenderer::new();
    let mut draw = |cut: Option<Cut>, cloud: &GaussianCloud| {
        renderer.limit_to(cut.map(Arc::new));
        renderer.render(cloud, Features::NONE, &camera, &RenderSettings::default()).expect("drawn")
    };
    let before = draw(None, &cloud);
    let cut = Cut::of_grain(&tree, &camera, 0.01, 3.0);
    assert_ne!(draw(Some(cut.clone()), &cloud), before);
    assert_eq!(draw(None, &cloud), before);
    let (other, _) = ball(500);
    assert_eq!(draw(Some(cut), &other), self::draw(&other, &camera, None), "it is not of this cloud");
}

#[test]
fn nodes_belong_to_what_is_beneath_them() {
    let (cloud, of) = ball(60_000);
    let (tree, camera) = (tree(&cloud), camera(4.0));
    let cut = Cut::of_budget(&tree, &camera, 0.01, 12_000, &mut 1.0);
    let exact = owners(&cloud, &of, &camera, None);
    let agree = |cut: Cut| {
        let found = owners(&cloud, &of, &camera, Some(cut));
        found.iter().zip(&exact).filter(|(a, b)| a == b).count() as f64 / exact.len() as f64
    };
    let same = agree(cut.clone());
    assert!(same > 0.98, "{same}");
    let mut shuffled = build(&cloud, || true).expect("built");
    let n = shuffled.leaves as u32;
    shuffled.nodes.iter_mut().for_each(|node| node.heaviest = (node.heaviest + n / 17) % n);
    let wrong = agree(Cut { tree: Arc::new(shuffled), ..cut });
    assert!(wrong < 0.9, "{wrong}");
}

#[test]
fn what_is_outside_the_picture_is_left_out() {
    let (cloud, _) = ball(20_000);
    let tree = tree(&cloud);
    // From the middle, looking out: a small part of the sphere.
    let inside = Camera::look_at(DVec3::ZERO, DVec3::Z, DVec3::NEG_Y, 0.6, 160, 120).expect("valid");
    let cut = Cut::of_grain(&tree, &inside, 0.01, 0.2);
    assert!(cut.len() < cloud.len() / 6, "{}", cut.len());
    let close = psnr(&draw(&cloud, &inside, None), &draw(&cloud, &inside, Some(cut)));
    assert!(close > 60.0, "{close}");
}

#[test]
fn whatever_comes_in_numbers_come_out() {
    let of = |n: usize, change: &dyn Fn(usize, &mut GaussianCloud)| {
        let (mut cloud, _) = ball(n);
        (0..n).for_each(|i| change(i, &mut cloud));
        cloud
    };
    let some = |i: usize| i % 3 == 0;
    let cases: [(&str, GaussianCloud); 10] = [
        ("one place", of(300, &|i, c| c.positions[i] = [0.5, 0.25, -0.125])),
        ("two places", of(300, &|i, c| c.positions[i] = [(i % 2) as f32; 3])),
        ("huge", of(300, &|i, c| c.log_scales[i] = [if some(i) { 80.0 } else { -3.0 }; 3])),
        ("tiny", of(300, &|i, c| c.log_scales[i] = [-300.0; 3])),
        ("opaque", of(300, &|i, c| c.opacity_logits[i] = f32::INFINITY)),
        ("clear", of(300, &|i, c| c.opacity_logits[i] = f32::NEG_INFINITY)),
        ("far", of(300, &|i, c| c.positions[i] = c.positions[i].map(|v| v * 1e37))),
        ("no turn", of(300, &|i, c| c.quaternions[i] = [0.0; 4])),
        ("no place", of(300, &|i, c| c.positions[i] = [if some(i) { f32::NAN } else { 1.0 }; 3])),
        ("no size", of(300, &|i, c| c.log_scales[i] = [if some(i) { f32::NAN } else { -3.0 }; 3])),
    ];
    for (name, cloud) in cases {
        let tree = tree(&cloud);
        tree.merged.validate().unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(tree.nodes.iter().all(|n| n.size.is_finite() && n.reach.is_finite()), "{name}");
        for grain_px in [0.2, 4.0, 64.0] {
            let cut = Cut::of_grain(&tree, &camera(4.0), 0.01, grain_px);
            let frame = draw(&cloud, &camera(4.0), Some(cut));
            assert!(frame.color.iter().flatten().all(|v| v.is_finite()), "{name}");
        }
    }
}

#[test]
fn building_is_repeatable() {
    let (cloud, _) = ball(5_000);
    let (a, b) = (tree(&cloud), tree(&cloud));
    assert_eq!((&a.merged, &a.children, a.bytes()), (&b.merged, &b.children, b.bytes()));
}
